//! Factors against the matrix they come from.

use super::*;

/// A matrix with nodes of 1 to 4 rows in a ring with one chord. Its product with a known vector is solved.
#[test]
fn solving_undoes_multiplying_where_elimination_fills_in() {
    let sizes = [3, 1, 4, 2, 3, 2];
    let edges = [(0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (5, 0), (1, 4)];
    let mut seed = 1u64;
    let mut random = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (seed >> 11) as f64 / (1u64 << 53) as f64 - 0.5
    };
    let n: usize = sizes.iter().sum();
    let firsts: Vec<usize> =
        sizes.iter().scan(0, |sum, size| Some(std::mem::replace(sum, *sum + size))).collect();
    let mut dense = vec![0.0; n * n];
    let mut matrix = BlockCholesky::default();
    // Twice: the second uses the memory of the first.
    for _ in 0..2 {
        matrix.begin(sizes.into_iter());
        edges.iter().for_each(|&(a, b)| matrix.join(a, b));
        assert!(matrix.plan(10).is_none(), "it costs more than ten multiplications");
        matrix.begin(sizes.into_iter());
        edges.iter().for_each(|&(a, b)| matrix.join(a, b));
        assert!(matrix.plan(usize::MAX).is_some());
        matrix.clear();
        dense.fill(0.0);
        for (node, &size) in sizes.iter().enumerate() {
            for i in 0..size {
                for j in 0..=i {
                    let value = if i == j { 8.0 } else { random() };
                    matrix.diagonal_mut(node)[i * size + j] = value;
                    dense[(firsts[node] + i) * n + firsts[node] + j] = value;
                    dense[(firsts[node] + j) * n + firsts[node] + i] = value;
                }
            }
        }
        for (a, b) in edges {
            for i in 0..sizes[a] {
                for j in 0..sizes[b] {
                    let value = random();
                    let (block, is_swapped) = matrix.block_mut(a, b);
                    block[if is_swapped { j * sizes[a] + i } else { i * sizes[b] + j }] = value;
                    dense[(firsts[a] + i) * n + firsts[b] + j] = value;
                    dense[(firsts[b] + j) * n + firsts[a] + i] = value;
                }
            }
        }
        let expected: Vec<f64> = (0..n).map(|_| random()).collect();
        let mut x: Vec<f64> =
            dense.chunks(n).map(|row| row.iter().zip(&expected).map(|(value, x)| value * x).sum()).collect();
        assert!(matrix.factorise());
        matrix.solve(&mut x);
        for (x, expected) in x.iter().zip(&expected) {
            assert!((x - expected).abs() < 1e-13, "{x} {expected}");
        }
    }
}

/// A node that is a tree of seven rows, alone and with another one that joins two of its leaves.
#[test]
fn a_tree_is_solved_whether_or_not_another_node_joins_its_branches() {
    let parents = [None, Some(0), Some(1), Some(2), Some(1), Some(4), Some(0)];
    let related = |mut i: usize, j: usize| {
        while i > j {
            let Some(parent) = parents[i] else { return false };
            i = parent;
        }
        i == j
    };
    // The other node is eliminated after the tree if it is long, and before it if it is short.
    for other in [0, 2, 9] {
        let n = 7 + other;
        let mut dense = vec![0.0; n * n];
        let mut matrix = BlockCholesky::default();
        let begin = |matrix: &mut BlockCholesky| {
            matrix.begin([7, other].into_iter().filter(|size| *size > 0));
            matrix.set_tree(0, parents.into_iter());
        };
        begin(&mut matrix);
        if other > 0 {
            matrix.join(0, 1);
        }
        assert!(matrix.plan(usize::MAX).is_some());
        let mut value = |i: usize, j: usize| {
            let value = if i == j { 5.0 } else { ((3 * i + 7 * j) % 11) as f64 / 11.0 - 0.4 };
            (dense[i * n + j], dense[j * n + i]) = (value, value);
            value
        };
        for i in 0..7 {
            for j in (0..=i).filter(|&j| related(i, j)) {
                matrix.diagonal_mut(0)[i * 7 + j] = value(i, j);
            }
        }
        for i in 0..other {
            for j in 0..=i {
                matrix.diagonal_mut(1)[i * other + j] = value(7 + i, 7 + j);
            }
            for j in [3, 6] {
                let value = value(7 + i, j);
                let (block, is_swapped) = matrix.block_mut(1, 0);
                block[if is_swapped { j * other + i } else { i * 7 + j }] = value;
            }
        }
        let expected: Vec<f64> = (0..n).map(|i| 1.0 - 0.3 * i as f64).collect();
        let row = |row: &[f64]| row.iter().zip(&expected).map(|(value, x)| value * x).sum();
        let mut x: Vec<f64> = dense.chunks(n).map(row).collect();
        assert!(matrix.factorise());
        matrix.solve(&mut x);
        for (x, expected) in x.iter().zip(&expected) {
            assert!((x - expected).abs() < 1e-13, "{other}: {x} {expected}");
        }
    }
}

#[test]
fn indefinite_matrices_are_refused() {
    let mut matrix = BlockCholesky::default();
    matrix.begin([2].into_iter());
    assert!(matrix.plan(usize::MAX).is_some());
    for bad in [-1.0, 0.0, f64::NAN, f64::INFINITY] {
        matrix.clear();
        matrix.diagonal_mut(0).copy_from_slice(&[1.0, 0.0, 0.0, bad]);
        assert!(!matrix.factorise(), "{bad}");
    }
}
