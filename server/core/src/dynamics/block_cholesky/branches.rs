//! Diagonal block of a node, factorised along the tree of its rows.

use std::ops::Range;

use crate::dynamics::real::Real;

/// Rows of a node as a tree, see [`BlockCholesky`](super::BlockCholesky).
#[derive(Clone, Copy)]
pub(super) struct Branches<'a> {
    pub(super) parents: &'a [usize],
    pub(super) heads: &'a [usize],
}

impl Branches<'_> {
    /// Returns the ancestors of a row in runs, starting with the row itself or with its parent.
    #[inline]
    fn runs(self, mut end: usize) -> impl Iterator<Item = Range<usize>> {
        std::iter::from_fn(move || {
            let run = *self.heads.get(end)?..end + 1;
            end = self.parents[run.start];
            Some(run)
        })
    }

    /// Factorises as L' D L in place.
    pub(super) fn factorise(self, matrix: &mut [f64], inverse: &mut [f64]) -> bool {
        let n = inverse.len();
        for k in (0..n).rev() {
            let (above, row) = matrix.split_at_mut(k * n);
            let diagonal = row[k];
            if !(diagonal > 0.0 && diagonal.is_finite()) {
                return false;
            }
            inverse[k] = 1.0 / diagonal;
            for run in self.runs(self.parents[k]) {
                // The six rows of a free root are ancestors of all, and a known length is fast. Values
                // written above the diagonal are never read.
                if let (Range { start: 0, end: 6 }, Some(&root)) = (&run, row.first_chunk::<6>()) {
                    for i in 0..6 {
                        if let Some(target) = above[i * n..].first_chunk_mut::<6>() {
                            let l = root[i] * inverse[k];
                            (0..6).for_each(|j| target[j] -= l * root[j]);
                        }
                    }
                    continue;
                }
                for i in run {
                    let l = row[i] * inverse[k];
                    let target = &mut above[i * n..i * n + i + 1];
                    for run in self.runs(i) {
                        subtract_multiple(&mut target[run.clone()], l, &row[run]);
                    }
                }
            }
            for run in self.runs(self.parents[k]) {
                row[run].iter_mut().for_each(|l| *l *= inverse[k]);
            }
        }
        true
    }

    /// Replaces `x` by L'^-1 x.
    #[inline]
    pub(super) fn backward_pass(self, lower: &[f64], x: &mut [f64]) {
        let n = x.len();
        for k in (0..n).rev() {
            let (value, row) = (x[k], &lower[k * n..(k + 1) * n]);
            for run in self.runs(self.parents[k]) {
                subtract_multiple(&mut x[run.clone()], value, &row[run]);
            }
        }
    }

    /// Replaces `x` by L^-1 x.
    #[inline]
    pub(super) fn forward_pass(self, lower: &[f64], x: &mut [f64]) {
        let n = x.len();
        for k in 0..n {
            let row = &lower[k * n..(k + 1) * n];
            for run in self.runs(self.parents[k]) {
                x[k] -= dot(0.0, &row[run.clone()], &x[run]);
            }
        }
    }
}

/// Computes values -= factor * others.
#[inline(always)]
pub(super) fn subtract_multiple(values: &mut [f64], factor: f64, others: &[f64]) {
    // The six rows of a free root are the most frequent run, and a known length is fast.
    if values.len() == 6
        && let (Some(values), Some(others)) = (values.first_chunk_mut::<6>(), others.first_chunk::<6>())
    {
        (0..6).for_each(|i| values[i] -= factor * others[i]);
        return;
    }
    values.iter_mut().zip(others).for_each(|(value, other)| *value -= factor * other);
}

/// Returns the sum of products as four sums, so that none waits for the one before it.
#[inline(always)]
pub(in crate::dynamics) fn dot<R: Real>(zero: R, a: &[R], b: &[R]) -> R {
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
