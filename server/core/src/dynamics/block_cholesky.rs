//! A symmetric positive definite matrix of blocks, sparse, as L D L'.
//!
//! Rows and columns are grouped into nodes, the robots of an island; two nodes share a block where they touch. Nodes are
//! eliminated in the order of least degree (George and Liu, "The evolution of the minimum degree ordering
//! algorithm" (1989)), so that a chain or a tree of nodes has no blocks that it did not begin with.

/// Nodes at the most.
pub const MOST_NODES: usize = 256;

/// A set of nodes.
type Set = [u64; MOST_NODES / 64];

/// The matrix, then its factors; and the memory for both, kept from one to the next.
#[derive(Clone, Debug, Default)]
pub struct BlockCholesky {
    /// How long each node is, and where its rows begin.
    sizes: Vec<usize>,
    firsts: Vec<usize>,
    /// Of each node, those it shares a block with; while ordering, those that elimination joins it with.
    neighbours: Vec<Set>,
    /// Of each node, the rows of its neighbours that are left.
    degrees: Vec<usize>,
    /// Nodes as they are eliminated, and the place of each.
    order: Vec<usize>,
    places: Vec<usize>,
    /// Of each place, the nodes below its diagonal block, in their order; one list after the other.
    below: Vec<usize>,
    ends: Vec<usize>,
    /// Where the block of two nodes begins, by the later one's and the earlier one's index.
    offsets: Vec<usize>,
    /// Blocks of a node: the diagonal one, then those below; row by row.
    values: Vec<f64>,
    /// D of each row, inverted.
    inverse_diagonal: Vec<f64>,
    /// L D of the blocks below the diagonal one that is eliminated.
    scaled: Vec<f64>,
}

impl BlockCholesky {
    /// Begins a matrix without blocks but those of the diagonal.
    pub fn begin(&mut self, sizes: impl Iterator<Item = usize>) {
        self.sizes.clear();
        self.firsts.clear();
        let mut first = 0;
        for size in sizes {
            self.sizes.push(size);
            self.firsts.push(first);
            first += size;
        }
        self.neighbours.clear();
        self.neighbours.resize(self.sizes.len(), Set::default());
    }

    /// Says that two nodes share a block.
    pub fn join(&mut self, a: usize, b: usize) {
        if a != b {
            insert(&mut self.neighbours[a], b);
            insert(&mut self.neighbours[b], a);
        }
    }

    /// Finds the order of elimination. How many multiplications a factorisation takes, roughly; `None` beyond
    /// `most`, and then there is no plan.
    pub fn plan(&mut self, most: usize) -> Option<usize> {
        let Self { sizes, firsts: _, neighbours, degrees, order, places, below, ends, .. } = self;
        let count = sizes.len();
        let rows = |set: &Set| members(set).map(|node| sizes[node]).sum::<usize>();
        degrees.clear();
        degrees.extend(neighbours.iter().map(rows));
        order.clear();
        below.clear();
        ends.clear();
        places.clear();
        places.resize(count, usize::MAX);
        let mut cost = 0usize;
        for place in 0..count {
            let left = (0..count).filter(|&node| places[node] == usize::MAX);
            let node = left.min_by_key(|&node| (degrees[node], node))?;
            places[node] = place;
            order.push(node);
            let (own, others) = (sizes[node], neighbours[node]);
            let degree = degrees[node];
            cost = cost.saturating_add(own * (own + degree) * (own + degree));
            if cost > most {
                return None;
            }
            for other in members(&others) {
                below.push(other);
                let set = &mut neighbours[other];
                set.iter_mut().zip(others).for_each(|(bits, more)| *bits |= more);
                remove(set, other);
                remove(set, node);
                degrees[other] = rows(set);
            }
            ends.push(below.len());
        }
        self.lay_out();
        Some(cost)
    }

    fn lay_out(&mut self) {
        let Self { sizes, order, places, below, ends, offsets, values, inverse_diagonal, firsts, .. } = self;
        let count = sizes.len();
        if offsets.len() < count * count {
            offsets.resize(count * count, 0);
        }
        let mut at = 0;
        for (place, &node) in order.iter().enumerate() {
            let begin = if place == 0 { 0 } else { ends[place - 1] };
            let list = &mut below[begin..ends[place]];
            list.sort_unstable_by_key(|&other| places[other]);
            for &row in std::iter::once(&node).chain(&*list) {
                offsets[row * count + node] = at;
                at += sizes[row] * sizes[node];
            }
        }
        values.clear();
        values.resize(at, 0.0);
        let rows = firsts.last().map_or(0, |first| first + sizes[count - 1]);
        inverse_diagonal.clear();
        inverse_diagonal.resize(rows, 0.0);
    }

    /// Makes all blocks zero.
    pub fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// The block of a node with itself, row by row; only what is on and below its diagonal is read.
    pub fn diagonal_mut(&mut self, node: usize) -> &mut [f64] {
        let at = self.offsets[node * self.sizes.len() + node];
        &mut self.values[at..at + self.sizes[node] * self.sizes[node]]
    }

    /// The block of two nodes that were [joined](Self::join), row by row; and whether its rows are the second's.
    pub fn block_mut(&mut self, a: usize, b: usize) -> (&mut [f64], bool) {
        let is_swapped = self.places[a] < self.places[b];
        let (row, column) = if is_swapped { (b, a) } else { (a, b) };
        let at = self.offsets[row * self.sizes.len() + column];
        (&mut self.values[at..at + self.sizes[a] * self.sizes[b]], is_swapped)
    }

    /// Replaces the matrix by its factors; false where it is not positive definite.
    pub fn factorise(&mut self) -> bool {
        let Self { sizes, firsts, order, below, ends, offsets, values, inverse_diagonal, scaled, .. } = self;
        let count = sizes.len();
        for (place, &node) in order.iter().enumerate() {
            let begin = if place == 0 { 0 } else { ends[place - 1] };
            let list = &below[begin..ends[place]];
            let n = sizes[node];
            let at = offsets[node * count + node];
            let height: usize = list.iter().map(|&other| sizes[other]).sum();
            let inverse = &mut inverse_diagonal[firsts[node]..firsts[node] + n];
            // The blocks of a column lie one after the other.
            let (column, later) = values[at..].split_at_mut((n + height) * n);
            let (diagonal, rows) = column.split_at_mut(n * n);
            if !factorise_dense(diagonal, inverse) {
                return false;
            }
            if scaled.len() < rows.len() {
                scaled.resize(rows.len(), 0.0);
            }
            let scaled = &mut scaled[..rows.len()];
            scaled.copy_from_slice(rows);
            for (row, scaled) in rows.chunks_exact_mut(n).zip(scaled.chunks_exact_mut(n)) {
                for i in 1..n {
                    let dot: f64 = diagonal[i * n..i * n + i].iter().zip(&*scaled).map(|(l, y)| l * y).sum();
                    scaled[i] -= dot;
                }
                row.iter_mut().zip(&*scaled).zip(&*inverse).for_each(|((l, y), d)| *l = y * d);
            }
            let mut from_i = 0;
            for (index, &i) in list.iter().enumerate() {
                let rows_i = &scaled[from_i * n..(from_i + sizes[i]) * n];
                from_i += sizes[i];
                let mut from_j = 0;
                for &j in &list[..=index] {
                    let rows_j = &rows[from_j * n..(from_j + sizes[j]) * n];
                    from_j += sizes[j];
                    let target = offsets[i * count + j] - at - (n + height) * n;
                    let block = &mut later[target..target + sizes[i] * sizes[j]];
                    subtract_product(block, rows_i, rows_j, n);
                }
            }
        }
        true
    }

    /// Replaces `x` by the solution, with [`factorise`](Self::factorise)'s factors.
    pub fn solve(&self, x: &mut [f64]) {
        let Self { sizes, firsts, order, below, ends, offsets, values, inverse_diagonal, .. } = self;
        let count = sizes.len();
        let column = |place: usize| {
            let node = order[place];
            let begin = if place == 0 { 0 } else { ends[place - 1] };
            (node, firsts[node], sizes[node], &below[begin..ends[place]], offsets[node * count + node])
        };
        for place in 0..count {
            let (_, first, n, list, at) = column(place);
            for i in 1..n {
                let dot: f64 =
                    values[at + i * n..at + i * n + i].iter().zip(&x[first..]).map(|(l, y)| l * y).sum();
                x[first + i] -= dot;
            }
            let mut at = at + n * n;
            for &other in list {
                for i in firsts[other]..firsts[other] + sizes[other] {
                    let dot: f64 = values[at..at + n].iter().zip(&x[first..]).map(|(l, y)| l * y).sum();
                    x[i] -= dot;
                    at += n;
                }
            }
        }
        x.iter_mut().zip(inverse_diagonal).for_each(|(x, inverse)| *x *= inverse);
        for place in (0..count).rev() {
            let (_, first, n, list, at) = column(place);
            let mut row = at + n * n;
            for &other in list {
                for i in firsts[other]..firsts[other] + sizes[other] {
                    let value = x[i];
                    let own = &mut x[first..first + n];
                    own.iter_mut().zip(&values[row..row + n]).for_each(|(own, l)| *own -= l * value);
                    row += n;
                }
            }
            for i in (1..n).rev() {
                let value = x[first + i];
                let own = &mut x[first..first + i];
                own.iter_mut().zip(&values[at + i * n..]).for_each(|(own, l)| *own -= l * value);
            }
        }
    }
}

/// L D L' in place (Golub and Van Loan, algorithm 4.1.2), of what is on and below the diagonal.
fn factorise_dense(matrix: &mut [f64], inverse: &mut [f64]) -> bool {
    let n = inverse.len();
    for i in 0..n {
        let (above, row) = matrix.split_at_mut(i * n);
        // First L D of the row, then L.
        let mut diagonal = row[i];
        for j in 0..i {
            let dot: f64 = above[j * n..j * n + j].iter().zip(&*row).map(|(l, y)| l * y).sum();
            row[j] -= dot;
        }
        for j in 0..i {
            let l = row[j] * inverse[j];
            diagonal -= l * row[j];
            row[j] = l;
        }
        if !(diagonal > 0.0 && diagonal.is_finite()) {
            return false;
        }
        row[i] = 1.0;
        inverse[i] = 1.0 / diagonal;
    }
    true
}

/// block -= a b', where `a` and `b` have rows of `n`.
fn subtract_product(block: &mut [f64], a: &[f64], b: &[f64], n: usize) {
    let width = b.len() / n;
    let six = |row: &[f64]| row.first_chunk::<6>().copied().unwrap_or_default();
    for (row, a) in block.chunks_exact_mut(width).zip(a.chunks_exact(n)) {
        if n == 6 {
            let a = six(a);
            for (value, b) in row.iter_mut().zip(b.chunks_exact(6)) {
                let b = six(b);
                *value -= a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + a[3] * b[3] + a[4] * b[4] + a[5] * b[5];
            }
            continue;
        }
        for (value, b) in row.iter_mut().zip(b.chunks_exact(n)) {
            *value -= a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        }
    }
}

fn insert(set: &mut Set, node: usize) {
    set[node / 64] |= 1 << (node % 64);
}

fn remove(set: &mut Set, node: usize) {
    set[node / 64] &= !(1 << (node % 64));
}

fn members(set: &Set) -> impl Iterator<Item = usize> {
    set.iter().enumerate().flat_map(|(word, &bits)| {
        let mut bits = bits;
        std::iter::from_fn(move || {
            let bit = bits.trailing_zeros() as usize;
            (bits != 0).then(|| {
                bits &= bits - 1;
                word * 64 + bit
            })
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A matrix of nodes of 1 to 4 rows in a ring with one chord, whose product with a known vector is solved.
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
        // Twice: the second begins in the memory of the first.
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
            let mut x: Vec<f64> = dense
                .chunks(n)
                .map(|row| row.iter().zip(&expected).map(|(value, x)| value * x).sum())
                .collect();
            assert!(matrix.factorise());
            matrix.solve(&mut x);
            for (x, expected) in x.iter().zip(&expected) {
                assert!((x - expected).abs() < 1e-13, "{x} {expected}");
            }
        }
    }

    #[test]
    fn what_is_not_positive_definite_is_refused() {
        let mut matrix = BlockCholesky::default();
        matrix.begin([2].into_iter());
        assert!(matrix.plan(usize::MAX).is_some());
        for bad in [-1.0, 0.0, f64::NAN, f64::INFINITY] {
            matrix.clear();
            matrix.diagonal_mut(0).copy_from_slice(&[1.0, 0.0, 0.0, bad]);
            assert!(!matrix.factorise(), "{bad}");
        }
    }
}
