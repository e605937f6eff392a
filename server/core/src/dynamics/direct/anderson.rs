//! Anderson's acceleration of a fixed point z = g(z). The next z is the combination of the last ones whose
//! residuals g(z) - z have the least norm. See Walker and Ni, "Anderson acceleration for fixed-point
//! iterations" (2011). If g is affine, it needs as many steps as z has numbers.
//!
//! Each of several lanes restarts in its own rounds, so each has its own number of differences. A missing
//! difference counts as a row and a column of the unit matrix with a right side of zero, which changes no
//! other number.

use crate::dynamics::real::{MaskOf, Real};

/// Number of stored differences.
const DEPTH: usize = 6;

/// Damping of the normal equations: part of the diagonal that is added to it.
const DAMPING: f64 = 1e-14;

/// Memory of the acceleration.
#[derive(Debug, Default)]
pub(in crate::dynamics) struct Anderson<R> {
    /// Last z and its residual.
    last: [Vec<R>; 2],
    /// Differences of z and of residuals; a new one overwrites the oldest.
    differences: [[Vec<R>; 2]; DEPTH],
    /// Number of differences so far.
    count: R,
    /// Index of the next difference.
    next: R,
    /// 1 if there is a last z.
    is_begun: R,
}

impl<R: Real> Anderson<R> {
    /// Creates the memory for `size` numbers.
    pub(in crate::dynamics) fn new(zero: R, size: usize) -> Self {
        let none = || [vec![zero; size], vec![zero; size]];
        let differences = std::array::from_fn(|_| none());
        Self { last: none(), differences, count: zero, next: zero, is_begun: zero }
    }

    /// Returns the bytes on the heap.
    pub(in crate::dynamics) fn bytes(&self) -> usize {
        2 * (DEPTH + 1) * size_of_val(&self.last[0][..])
    }

    /// Resets some lanes.
    #[inline(always)]
    pub(in crate::dynamics) fn begin(&mut self, lanes: R::Mask) {
        let zero = self.count.splat(0.0);
        for own in [&mut self.count, &mut self.next, &mut self.is_begun] {
            *own = lanes.select(zero, *own);
        }
    }

    /// Replaces `z` of some lanes by the next one. `residual` is g(z) - z.
    #[inline(always)]
    #[allow(clippy::needless_range_loop, reason = "reads as the algorithm does")]
    pub(in crate::dynamics) fn advance(&mut self, lanes: R::Mask, z: &mut [R], residual: &[R]) {
        let zero = self.count.splat(0.0);
        self.keep(lanes, [z, residual]);
        // A lane has difference j if its count exceeds j.
        let mut has = [zero.lt(zero); DEPTH];
        let mut kept = 0;
        for (j, has) in has.iter_mut().enumerate() {
            *has = lanes & zero.splat(j as f64).lt(self.count);
            kept = if has.any() { j + 1 } else { kept };
        }
        let (mut matrix, mut right) = ([[zero; DEPTH]; DEPTH], [zero; DEPTH]);
        for i in 0..kept {
            let [_, own] = &self.differences[i];
            for j in 0..=i {
                matrix[i][j] = has[i].select(dot(own, &self.differences[j][1]), zero);
                matrix[j][i] = matrix[i][j];
            }
            let damped = matrix[i][i] * zero.splat(1.0 + DAMPING);
            matrix[i][i] = has[i].select(damped, zero.splat(1.0));
            right[i] = has[i].select(dot(own, residual), zero);
        }
        solve(&mut matrix, &mut right, kept);
        for (index, (z, residual)) in z.iter_mut().zip(residual).enumerate() {
            let mut new = *z + *residual;
            for j in 0..kept {
                let [moved, left] = &self.differences[j];
                new = has[j].select(new - right[j] * (moved[index] + left[index]), new);
            }
            *z = lanes.select(new, *z);
        }
    }

    /// Stores the present values of some lanes, and their differences from the last.
    #[inline(always)]
    fn keep(&mut self, lanes: R::Mask, now: [&[R]; 2]) {
        let Self { last, differences, count, next, is_begun } = self;
        let zero = count.splat(0.0);
        let one = zero.splat(1.0);
        if last[0].len() != now[0].len() {
            for list in last.iter_mut().chain(differences.as_flattened_mut()) {
                list.clear();
                list.resize(now[0].len(), zero);
            }
        }
        let continues = lanes & zero.lt(*is_begun);
        if continues.any() {
            for (j, differences) in differences.iter_mut().enumerate() {
                let here = continues & next.equals(zero.splat(j as f64));
                if !here.any() {
                    continue;
                }
                for ((slots, now), last) in differences.iter_mut().zip(now).zip(&*last) {
                    for ((slot, now), last) in slots.iter_mut().zip(now).zip(last) {
                        *slot = here.select(*now - *last, *slot);
                    }
                }
            }
            *count = continues.select(*count + one, *count);
            let after = *next + one;
            let after = after.equals(zero.splat(DEPTH as f64)).select(zero, after);
            *next = continues.select(after, *next);
        }
        *is_begun = lanes.select(one, *is_begun);
        for (slots, now) in last.iter_mut().zip(now) {
            for (slot, now) in slots.iter_mut().zip(now) {
                *slot = lanes.select(*now, *slot);
            }
        }
    }
}

/// Returns the scalar product; the vectors must not be empty.
#[inline(always)]
fn dot<R: Real>(a: &[R], b: &[R]) -> R {
    let mut sum = a[0] * b[0];
    for (a, b) in a[1..].iter().zip(&b[1..]) {
        sum += *a * *b;
    }
    sum
}

/// Solves the normal equations by Gaussian elimination: they are few, symmetric and not indefinite.
#[inline(always)]
#[allow(clippy::needless_range_loop, reason = "reads as the algorithm does")]
fn solve<R: Real>(matrix: &mut [[R; DEPTH]; DEPTH], right: &mut [R; DEPTH], kept: usize) {
    let zero = right[0].splat(0.0);
    for i in 0..kept {
        let is_none = matrix[i][i].le(zero);
        if is_none.any() {
            for j in 0..kept {
                let unit = zero.splat(if j == i { 1.0 } else { 0.0 });
                matrix[i][j] = is_none.select(unit, matrix[i][j]);
            }
            right[i] = is_none.select(zero, right[i]);
        }
        for j in i + 1..kept {
            let factor = matrix[j][i] / matrix[i][i];
            for k in i..kept {
                matrix[j][k] -= factor * matrix[i][k];
            }
            right[j] -= factor * right[i];
        }
    }
    for i in (0..kept).rev() {
        let mut known = zero.splat(-0.0);
        for j in i + 1..kept {
            known += matrix[i][j] * right[j];
        }
        right[i] = (right[i] - known) / matrix[i][i];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// z = A z + b with an A for which plain iteration diverges.
    #[test]
    fn an_affine_map_is_solved_in_as_many_steps_as_it_has_numbers() {
        let a = [[0.5, -2.0, 0.1], [1.5, 0.3, 0.0], [0.0, 0.4, -1.7]];
        let b = [1.0, -2.0, 0.5];
        let residual = |z: &[f64; 3]| {
            [0, 1, 2].map(|i| a[i].iter().zip(z).map(|(a, z)| a * z).sum::<f64>() + b[i] - z[i])
        };
        let (mut anderson, mut z) = (Anderson::new(0.0, 3), [0.0; 3]);
        for _ in 0..2 {
            anderson.begin(true);
            for _ in 0..6 {
                let left = residual(&z);
                anderson.advance(true, &mut z, &left);
            }
            assert!(residual(&z).iter().all(|left| left.abs() < 1e-9), "{:?}", residual(&z));
            z = [3.0, -1.0, 2.0];
        }
    }
}
