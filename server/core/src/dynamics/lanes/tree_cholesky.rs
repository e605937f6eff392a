//! L' D L of a symmetric matrix along the tree of a robot's velocities, for all copies, as
//! [`BlockCholesky`](crate::dynamics::block_cholesky) does with a single node.

use pulp::Simd;

use crate::dynamics::block_cholesky::dot;
use crate::dynamics::lane::number::{Lanes, Mask};
use crate::dynamics::real::Real as _;
use crate::dynamics::tree::Tree;

/// The matrix, then its factors.
#[derive(Debug)]
pub(super) struct TreeCholesky<S: Simd> {
    /// Matrix row by row: the columns of the row's ancestors, from the root on, then the diagonal. Nothing
    /// else of the matrix is read, and so few numbers stay in the cache.
    pub(super) values: Vec<Lanes<S>>,
    inverse_diagonal: Vec<Lanes<S>>,
    pub(super) rows: Vec<TreeRow>,
}

/// A row of the matrix.
#[derive(Clone, Debug, Default)]
pub(super) struct TreeRow {
    /// Offset of its values.
    pub(super) at: usize,
    /// Ancestors from the root on.
    pub(super) ancestors: Vec<usize>,
    /// Ancestors in runs, from its parent on: the first one, the number, and the offset among its values.
    runs: Vec<(usize, usize, usize)>,
}

impl<S: Simd> TreeCholesky<S> {
    /// Creates a matrix of `size` rows, whose tree must be [set](Self::set_tree).
    pub(super) fn new(zero: Lanes<S>, size: usize) -> Self {
        Self { values: Vec::new(), inverse_diagonal: vec![zero; size], rows: Vec::new() }
    }

    /// Sets the tree. Returns the number of values.
    pub(super) fn set_tree(&mut self, zero: Lanes<S>, tree: &Tree) -> usize {
        let parents: Vec<Option<usize>> = tree.velocity_parents().collect();
        let mut heads: Vec<usize> = Vec::new();
        for (row, parent) in parents.iter().enumerate() {
            let follows = row > 0 && *parent == Some(row - 1);
            heads.push(if follows { heads[row - 1] } else { row });
        }
        let mut at = 0;
        self.rows.clear();
        for parent in &parents {
            let (mut runs, mut next) = (Vec::new(), *parent);
            while let Some(last) = next {
                runs.push((heads[last], last + 1 - heads[last], 0));
                next = parents[heads[last]];
            }
            let mut ancestors = Vec::new();
            for (first, count, place) in runs.iter_mut().rev() {
                *place = ancestors.len();
                ancestors.extend(*first..*first + *count);
            }
            let end = at + ancestors.len() + 1;
            self.rows.push(TreeRow { at, ancestors, runs });
            at = end;
        }
        self.values = vec![zero; at];
        at
    }

    /// Returns the bytes on the heap.
    pub(super) fn bytes(&self) -> usize {
        let of_row = |row: &TreeRow| {
            size_of::<TreeRow>() + size_of_val(&row.ancestors[..]) + size_of_val(&row.runs[..])
        };
        size_of_val(&self.values[..])
            + size_of_val(&self.inverse_diagonal[..])
            + self.rows.iter().map(of_row).sum::<usize>()
    }

    /// Replaces the matrix by its factors. Returns the lanes in which it is positive definite.
    #[inline(always)]
    pub(super) fn factorise(&mut self) -> Mask<S> {
        let Self { values, inverse_diagonal, rows } = self;
        let zero = values[0].splat(0.0);
        let (one, infinity) = (zero.splat(1.0), zero.splat(f64::INFINITY));
        let mut is_definite = zero.lt(one);
        for (TreeRow { at, ancestors, .. }, slot) in rows.iter().zip(inverse_diagonal).rev() {
            let (above, row) = values.split_at_mut(*at);
            let row = &mut row[..=ancestors.len()];
            let diagonal = row[ancestors.len()];
            is_definite = is_definite & zero.lt(diagonal) & diagonal.lt(infinity);
            let inverse = one / diagonal;
            *slot = inverse;
            // The ancestors of an ancestor are those before it.
            for (count, i) in ancestors.iter().enumerate() {
                let l = row[count] * inverse;
                let first = rows[*i].at;
                let target = &mut above[first..=first + count];
                for (target, value) in target.iter_mut().zip(&row[..=count]) {
                    *target -= l * *value;
                }
            }
            for value in &mut row[..ancestors.len()] {
                *value = *value * inverse;
            }
        }
        is_definite
    }

    /// Replaces `x` by the solution.
    #[inline(always)]
    pub(super) fn solve(&self, x: &mut [Lanes<S>]) {
        for (k, TreeRow { at, ancestors, .. }) in self.rows.iter().enumerate().rev() {
            let (value, row) = (x[k], &self.values[*at..*at + ancestors.len()]);
            for (i, l) in ancestors.iter().zip(row) {
                x[*i] -= value * *l;
            }
        }
        for (x, inverse) in x.iter_mut().zip(&self.inverse_diagonal) {
            *x = *x * *inverse;
        }
        for (k, TreeRow { at, runs, .. }) in self.rows.iter().enumerate() {
            for &(first, count, place) in runs {
                let row = &self.values[*at + place..][..count];
                let sum = dot(x[k].splat(0.0), row, &x[first..first + count]);
                x[k] -= sum;
            }
        }
    }
}
