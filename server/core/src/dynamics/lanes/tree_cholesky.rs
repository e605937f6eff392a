//! L' D L of a symmetric matrix along the tree of a robot's velocities, of all copies: what
//! [`BlockCholesky`](crate::dynamics::block_cholesky) does with a single node.

use pulp::Simd;

use super::number::{Lanes, Mask};
use crate::dynamics::tree::Tree;

/// The matrix, then its factors.
#[derive(Debug)]
pub(super) struct TreeCholesky<S: Simd> {
    /// Row by row, on and below the diagonal, of which only columns of ancestors are read.
    pub(super) values: Vec<Lanes<S>>,
    inverse_diagonal: Vec<Lanes<S>>,
    /// Of each row, its ancestors in runs, from its parent on.
    runs: Vec<Vec<(usize, usize)>>,
    /// The same one by one, upwards.
    ancestors: Vec<Vec<usize>>,
}

impl<S: Simd> TreeCholesky<S> {
    /// One of so many rows.
    pub(super) fn new(zero: Lanes<S>, size: usize) -> Self {
        Self {
            values: vec![zero; size * size],
            inverse_diagonal: vec![zero; size],
            runs: vec![Vec::new(); size],
            ancestors: vec![Vec::new(); size],
        }
    }

    /// Takes the tree.
    pub(super) fn set_tree(&mut self, tree: &Tree) {
        let parents: Vec<Option<usize>> = tree.velocity_parents().collect();
        let mut heads: Vec<usize> = Vec::new();
        for (row, parent) in parents.iter().enumerate() {
            let follows = row > 0 && *parent == Some(row - 1);
            heads.push(if follows { heads[row - 1] } else { row });
        }
        for (row, (runs, ancestors)) in self.runs.iter_mut().zip(&mut self.ancestors).enumerate() {
            runs.clear();
            let mut next = parents[row];
            while let Some(end) = next {
                runs.push((heads[end], end + 1));
                next = parents[heads[end]];
            }
            *ancestors = runs.iter().rev().flat_map(|(first, end)| *first..*end).collect();
        }
    }

    /// Bytes on the heap.
    pub(super) fn bytes(&self) -> usize {
        let lists = self.ancestors.iter().map(|own| size_of_val(&own[..])).sum::<usize>();
        size_of_val(&self.values[..]) + size_of_val(&self.inverse_diagonal[..]) + 3 * lists
    }

    /// Replaces the matrix by its factors. Where it is positive definite.
    #[inline(always)]
    pub(super) fn factorise(&mut self) -> Mask<S> {
        let n = self.inverse_diagonal.len();
        let zero = self.values[0].same(0.0);
        let (one, infinity) = (zero.same(1.0), zero.same(f64::INFINITY));
        let mut is_definite = zero.lt(one);
        for k in (0..n).rev() {
            let (above, row) = self.values.split_at_mut(k * n);
            let row = &mut row[..n];
            let diagonal = row[k];
            is_definite = is_definite & zero.lt(diagonal) & diagonal.lt(infinity);
            let inverse = one / diagonal;
            self.inverse_diagonal[k] = inverse;
            let ancestors = &self.ancestors[k][..];
            for (count, &i) in ancestors.iter().enumerate() {
                let l = row[i] * inverse;
                let target = &mut above[i * n..(i + 1) * n];
                for &j in &ancestors[..=count] {
                    target[j] -= l * row[j];
                }
            }
            for &i in ancestors {
                row[i] = row[i] * inverse;
            }
        }
        is_definite
    }

    /// Replaces `x` by the solution.
    #[inline(always)]
    pub(super) fn solve(&self, x: &mut [Lanes<S>]) {
        let n = self.inverse_diagonal.len();
        for k in (0..n).rev() {
            let (value, row) = (x[k], &self.values[k * n..(k + 1) * n]);
            for &i in &self.ancestors[k] {
                x[i] -= value * row[i];
            }
        }
        for (x, inverse) in x.iter_mut().zip(&self.inverse_diagonal) {
            *x = *x * *inverse;
        }
        for k in 0..n {
            let row = &self.values[k * n..(k + 1) * n];
            for &(first, end) in &self.runs[k] {
                let sum = dot(&row[first..end], &x[first..end]);
                x[k] -= sum;
            }
        }
    }
}

/// The sum of products, as the one-robot step sums them: four sums, then what is left.
#[inline(always)]
fn dot<S: Simd>(a: &[Lanes<S>], b: &[Lanes<S>]) -> Lanes<S> {
    let zero = a[0].same(0.0);
    let (fours, rest) = a.as_chunks::<4>();
    let (others, other_rest) = b.as_chunks::<4>();
    let mut sums = [zero; 4];
    for (a, b) in fours.iter().zip(others) {
        for k in 0..4 {
            sums[k] += a[k] * b[k];
        }
    }
    let mut tail = zero;
    for (a, b) in rest.iter().zip(other_rest) {
        tail += *a * *b;
    }
    (sums[0] + sums[2]) + (sums[1] + sums[3]) + tail
}
