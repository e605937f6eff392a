//! Symmetric positive definite matrix of blocks, sparse, as L' D L.
//!
//! Rows and columns are grouped into nodes, the robots of an island. Two nodes share a block if they touch.
//! Nodes are eliminated in the order of least degree (George and Liu, "The evolution of the minimum degree
//! ordering algorithm" (1989)). A chain or a tree of nodes therefore gets no additional blocks.
//!
//! Within a node, a row has entries only for its ancestors in a tree: the velocities nearer to the root.
//! Elimination from the leaves adds no others (Featherstone, section 6.5). This ends as soon as a previously
//! eliminated node has joined its branches; then each row is the child of the one before it.

mod branches;

pub(in crate::dynamics) use branches::dot;
use branches::{Branches, subtract_multiple};

/// Maximum number of nodes.
pub const MAX_NODES: usize = 256;

/// Parent of a row without one.
const ROOT: usize = usize::MAX;

/// Set of nodes, one bit each.
type Set = [u64; MAX_NODES / 64];

/// The matrix, then its factors, with memory that is reused.
#[derive(Debug, Default)]
pub struct BlockCholesky {
    /// Number of rows of each node, and the first row of each.
    sizes: Vec<usize>,
    firsts: Vec<usize>,
    /// Parent of each row: a row of its node, or [`ROOT`].
    parents: Vec<usize>,
    /// First row of the run that ends with each row, in which each is the parent of the next.
    heads: Vec<usize>,
    /// Nodes whose branches are joined.
    is_joined: Vec<bool>,
    /// Nodes with which each node shares a block; while ordering, also those that elimination joins it with.
    neighbours: Vec<Set>,
    /// Number of remaining rows of each node's neighbours.
    degrees: Vec<usize>,
    /// Nodes in the order of elimination, and the index of each in that order.
    order: Vec<usize>,
    ranks: Vec<usize>,
    /// For each node in that order, the nodes below its diagonal block in their order, as concatenated lists.
    below: Vec<usize>,
    ends: Vec<usize>,
    /// Offset of the block of two nodes, by the later one's and the earlier one's index.
    offsets: Vec<usize>,
    /// Blocks of each node, row by row: the diagonal one, then those below.
    values: Vec<f64>,
    /// Inverse of D of each row.
    inverse_diagonal: Vec<f64>,
    /// L D of the blocks below the diagonal block that is being eliminated.
    scaled: Vec<f64>,
}

impl BlockCholesky {
    /// Begins a matrix with nodes of these sizes and only diagonal blocks.
    pub fn begin(&mut self, sizes: impl Iterator<Item = usize>) {
        let Self { sizes: own, firsts, parents, is_joined, .. } = self;
        own.clear();
        firsts.clear();
        parents.clear();
        for size in sizes {
            own.push(size);
            firsts.push(parents.len());
            parents.extend((0..size).map(|row| row.checked_sub(1).unwrap_or(ROOT)));
        }
        is_joined.clear();
        is_joined.resize(own.len(), true);
        self.neighbours.clear();
        self.neighbours.resize(self.sizes.len(), Set::default());
    }

    /// Sets the tree of a node's rows: the parent of each, which comes before it.
    pub fn set_tree(&mut self, node: usize, parents: impl Iterator<Item = Option<usize>>) {
        let own = &mut self.parents[self.firsts[node]..][..self.sizes[node]];
        own.iter_mut().zip(parents).for_each(|(own, parent)| *own = parent.unwrap_or(ROOT));
        self.is_joined[node] = false;
    }

    /// Discards the tree of a node, since its branches are joined.
    pub fn join_branches(&mut self, node: usize) {
        self.is_joined[node] = true;
    }

    /// Declares that two nodes share a block.
    pub fn join(&mut self, a: usize, b: usize) {
        if a != b {
            insert(&mut self.neighbours[a], b);
            insert(&mut self.neighbours[b], a);
        }
    }

    /// Computes the order of elimination. Blocks are undefined until they are [cleared](Self::clear). Returns
    /// the approximate number of multiplications of a factorisation; `None`, without a plan, if it exceeds
    /// `most`.
    pub fn plan(&mut self, most: usize) -> Option<usize> {
        let Self { sizes, is_joined, neighbours, degrees, order, ranks, below, ends, .. } = self;
        let count = sizes.len();
        let rows = |set: &Set| members(set).map(|node| sizes[node]).sum::<usize>();
        degrees.clear();
        degrees.extend(neighbours.iter().map(rows));
        order.clear();
        below.clear();
        ends.clear();
        ranks.clear();
        ranks.resize(count, usize::MAX);
        let mut cost = 0usize;
        for rank in 0..count {
            let left = (0..count).filter(|&node| ranks[node] == usize::MAX);
            let node = left.min_by_key(|&node| (degrees[node], node))?;
            ranks[node] = rank;
            order.push(node);
            let (own, others) = (sizes[node], neighbours[node]);
            let degree = degrees[node];
            cost = cost.saturating_add(factorisation_cost(own, degree));
            if cost > most {
                return None;
            }
            for other in members(&others) {
                below.push(other);
                is_joined[other] = true;
                let set = &mut neighbours[other];
                set.iter_mut().zip(others).for_each(|(bits, more)| *bits |= more);
                remove(set, other);
                remove(set, node);
                degrees[other] = rows(set);
            }
            ends.push(below.len());
        }
        self.find_heads();
        self.lay_out();
        Some(cost)
    }

    fn find_heads(&mut self) {
        let Self { sizes, firsts, parents, heads, is_joined, .. } = self;
        heads.clear();
        for ((&size, &first), is_joined) in sizes.iter().zip(&*firsts).zip(is_joined) {
            for row in 0..size {
                let parent = &mut parents[first + row];
                if *is_joined {
                    *parent = row.checked_sub(1).unwrap_or(ROOT);
                }
                let follows = row > 0 && *parent == row - 1;
                heads.push(if follows { heads[first + row - 1] } else { row });
            }
        }
    }

    fn lay_out(&mut self) {
        let Self { sizes, order, ranks, below, ends, offsets, values, inverse_diagonal, firsts, .. } = self;
        let count = sizes.len();
        if offsets.len() < count * count {
            offsets.resize(count * count, 0);
        }
        let mut at = 0;
        for (rank, &node) in order.iter().enumerate() {
            let begin = if rank == 0 { 0 } else { ends[rank - 1] };
            let list = &mut below[begin..ends[rank]];
            list.sort_unstable_by_key(|&other| ranks[other]);
            for &row in std::iter::once(&node).chain(&*list) {
                offsets[row * count + node] = at;
                at += sizes[row] * sizes[node];
            }
        }
        values.resize(at, 0.0);
        let rows = firsts.last().map_or(0, |first| first + sizes[count - 1]);
        inverse_diagonal.clear();
        inverse_diagonal.resize(rows, 0.0);
    }

    /// Sets all blocks to zero.
    pub fn clear(&mut self) {
        self.values.fill(0.0);
    }

    /// Returns the diagonal block of a node, row by row. Only entries on and below its diagonal are read, and
    /// of those only columns of ancestors.
    pub fn diagonal_mut(&mut self, node: usize) -> &mut [f64] {
        let at = self.offsets[node * self.sizes.len() + node];
        &mut self.values[at..at + self.sizes[node] * self.sizes[node]]
    }

    /// Returns the block of two nodes that were [joined](Self::join), row by row, and whether its rows belong
    /// to the second one.
    pub fn block_mut(&mut self, a: usize, b: usize) -> (&mut [f64], bool) {
        let is_swapped = self.ranks[a] < self.ranks[b];
        let (row, column) = if is_swapped { (b, a) } else { (a, b) };
        let at = self.offsets[row * self.sizes.len() + column];
        (&mut self.values[at..at + self.sizes[a] * self.sizes[b]], is_swapped)
    }

    /// Replaces the matrix by its factors. Returns false if it is not positive definite.
    pub fn factorise(&mut self) -> bool {
        let Self {
            sizes,
            firsts,
            parents,
            heads,
            order,
            below,
            ends,
            offsets,
            values,
            inverse_diagonal,
            scaled,
            ..
        } = self;
        let count = sizes.len();
        for (rank, &node) in order.iter().enumerate() {
            let begin = if rank == 0 { 0 } else { ends[rank - 1] };
            let list = &below[begin..ends[rank]];
            let n = sizes[node];
            let at = offsets[node * count + node];
            let height: usize = list.iter().map(|&other| sizes[other]).sum();
            let own = firsts[node]..firsts[node] + n;
            let inverse = &mut inverse_diagonal[own.clone()];
            let branches = Branches { parents: &parents[own.clone()], heads: &heads[own] };
            // The blocks of a column are adjacent.
            let (column, later) = values[at..].split_at_mut((n + height) * n);
            let (diagonal, rows) = column.split_at_mut(n * n);
            if !branches.factorise(diagonal, inverse) {
                return false;
            }
            if scaled.len() < rows.len() {
                scaled.resize(rows.len(), 0.0);
            }
            let scaled = &mut scaled[..rows.len()];
            scaled.copy_from_slice(rows);
            for (row, scaled) in rows.chunks_exact_mut(n).zip(scaled.chunks_exact_mut(n)) {
                branches.backward_pass(diagonal, scaled);
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

    /// Replaces `x` by the solution, with the factors of [`factorise`](Self::factorise).
    pub fn solve(&self, x: &mut [f64]) {
        let Self {
            sizes, firsts, parents, heads, order, below, ends, offsets, values, inverse_diagonal, ..
        } = self;
        let count = sizes.len();
        let column = |rank: usize| {
            let node = order[rank];
            let begin = if rank == 0 { 0 } else { ends[rank - 1] };
            let own = firsts[node]..firsts[node] + sizes[node];
            let branches = Branches { parents: &parents[own.clone()], heads: &heads[own.clone()] };
            let values = &values[offsets[node * count + node]..];
            let (diagonal, rows) = values.split_at(own.len() * own.len());
            (own, branches, diagonal, rows, &below[begin..ends[rank]])
        };
        for rank in 0..count {
            let (own, branches, diagonal, rows, list) = column(rank);
            branches.backward_pass(diagonal, &mut x[own.clone()]);
            let mut rows = rows.chunks_exact(own.len());
            for &other in list {
                for (i, row) in (firsts[other]..firsts[other] + sizes[other]).zip(&mut rows) {
                    x[i] -= dot(0.0, row, &x[own.clone()]);
                }
            }
        }
        x.iter_mut().zip(inverse_diagonal).for_each(|(x, inverse)| *x *= inverse);
        for rank in (0..count).rev() {
            let (own, branches, diagonal, rows, list) = column(rank);
            let mut rows = rows.chunks_exact(own.len());
            for &other in list {
                for (i, row) in (firsts[other]..firsts[other] + sizes[other]).zip(&mut rows) {
                    let value = x[i];
                    subtract_multiple(&mut x[own.clone()], value, row);
                }
            }
            branches.forward_pass(diagonal, &mut x[own]);
        }
    }
}

/// Returns the approximate number of multiplications to eliminate a node of `own` rows whose neighbours have
/// `degree` rows.
pub fn factorisation_cost(own: usize, degree: usize) -> usize {
    own * (own + degree) * (own + degree)
}

/// Computes block -= a b', where `a` and `b` have rows of `n`.
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
            *value -= dot(0.0, a, b);
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
mod tests;
