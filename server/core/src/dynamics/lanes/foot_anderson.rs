//! Anderson's acceleration of the bounds of friction, of all copies: [`Anderson`] has the method and says why.
//!
//! Lanes begin anew in different rounds, so each has a number of differences of its own. What a lane does not have counts as a row and
//! a column of the unit matrix with a right side of zero, which changes no other number.
//!
//! [`Anderson`]: crate::dynamics::constraint::direct::Anderson

use pulp::Simd;

use super::number::{Lanes, Mask};
use crate::dynamics::constraint::direct::anderson::{DAMPING, DEPTH};
use crate::dynamics::real::{MaskOf as _, Real as _};

/// A bound and its residual.
type Pair<S> = [Lanes<S>; 2];

/// The memory of it.
#[derive(Debug)]
pub(super) struct FootAnderson<S: Simd> {
    /// The last bounds and their residuals, by foot.
    last: Vec<Pair<S>>,
    /// Differences of both; of each lane the oldest is written over.
    differences: [Vec<Pair<S>>; DEPTH],
    /// How many there have been, in each lane.
    count: Lanes<S>,
    /// Where the next one is written, in each lane.
    next: Lanes<S>,
    /// 1 where there is a last one.
    is_begun: Lanes<S>,
}

impl<S: Simd> FootAnderson<S> {
    /// Of so many feet.
    pub(super) fn new(zero: Lanes<S>, feet: usize) -> Self {
        let none = || vec![[zero; 2]; feet];
        Self {
            last: none(),
            differences: std::array::from_fn(|_| none()),
            count: zero,
            next: zero,
            is_begun: zero,
        }
    }

    /// Bytes on the heap.
    pub(super) fn bytes(&self) -> usize {
        (DEPTH + 1) * size_of_val(&self.last[..])
    }

    /// Forgets what was in some lanes.
    #[inline(always)]
    pub(super) fn begin(&mut self, lanes: Mask<S>) {
        let zero = self.count.splat(0.0);
        for own in [&mut self.count, &mut self.next, &mut self.is_begun] {
            *own = lanes.select(zero, *own);
        }
    }

    /// Replaces bounds of some lanes by the next ones; each foot has a bound and its residual.
    #[inline(always)]
    #[allow(clippy::needless_range_loop, reason = "reads as that of one copy")]
    pub(super) fn advance(&mut self, lanes: Mask<S>, feet: &mut [Pair<S>]) {
        let zero = self.count.splat(0.0);
        let one = zero.splat(1.0);
        self.keep(lanes, feet);
        // Lanes that have so many differences or more have that one.
        let mut has = [zero.lt(zero); DEPTH];
        let mut kept = 0;
        for (j, has) in has.iter_mut().enumerate() {
            *has = lanes & zero.splat(j as f64).lt(self.count);
            kept = if has.any() { j + 1 } else { kept };
        }
        let (mut matrix, mut right) = ([[zero; DEPTH]; DEPTH], [zero; DEPTH]);
        for i in 0..kept {
            for j in 0..=i {
                let dot = self.dot(i, |foot| self.differences[j][foot][1]);
                matrix[i][j] = has[i].select(dot, zero);
                matrix[j][i] = matrix[i][j];
            }
            let damped = matrix[i][i] * zero.splat(1.0 + DAMPING);
            matrix[i][i] = has[i].select(damped, one);
            right[i] = has[i].select(self.dot(i, |foot| feet[foot][1]), zero);
        }
        solve(&mut matrix, &mut right, kept);
        for (foot, pair) in feet.iter_mut().enumerate() {
            let mut new = pair[0] + pair[1];
            for (j, part) in right.iter().enumerate().take(kept) {
                let [moved, left] = self.differences[j][foot];
                new = has[j].select(new - *part * (moved + left), new);
            }
            pair[0] = lanes.select(new, pair[0]);
        }
    }

    /// Keeps what some lanes have now, and how it differs from the last.
    #[inline(always)]
    fn keep(&mut self, lanes: Mask<S>, feet: &[Pair<S>]) {
        let zero = self.count.splat(0.0);
        let one = zero.splat(1.0);
        let Self { last, differences, count, next, is_begun } = self;
        let goes_on = lanes & zero.lt(*is_begun);
        if goes_on.any() {
            for (j, differences) in differences.iter_mut().enumerate() {
                let here = goes_on & next.equals(zero.splat(j as f64));
                if !here.any() {
                    continue;
                }
                for ((slot, now), last) in differences.iter_mut().zip(feet).zip(&*last) {
                    for k in 0..2 {
                        slot[k] = here.select(now[k] - last[k], slot[k]);
                    }
                }
            }
            *count = goes_on.select(*count + one, *count);
            let after = *next + one;
            let after = after.equals(zero.splat(DEPTH as f64)).select(zero, after);
            *next = goes_on.select(after, *next);
        }
        *is_begun = lanes.select(one, *is_begun);
        for (slot, now) in last.iter_mut().zip(feet) {
            for k in 0..2 {
                slot[k] = lanes.select(now[k], slot[k]);
            }
        }
    }

    /// The product of the residuals' difference of an index with something by foot.
    #[inline(always)]
    fn dot(&self, i: usize, other: impl Fn(usize) -> Lanes<S>) -> Lanes<S> {
        let mut sum = self.count.splat(0.0);
        for (foot, [_, left]) in self.differences[i].iter().enumerate() {
            let own = *left * other(foot);
            sum = if foot == 0 { own } else { sum + own };
        }
        sum
    }
}

/// Solves the normal equations by Gauss.
#[inline(always)]
#[allow(clippy::needless_range_loop, reason = "reads as that of one copy")]
fn solve<S: Simd>(matrix: &mut [[Lanes<S>; DEPTH]; DEPTH], right: &mut [Lanes<S>; DEPTH], kept: usize) {
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
        let mut known = zero;
        for j in i + 1..kept {
            let own = matrix[i][j] * right[j];
            known = if j == i + 1 { own } else { known + own };
        }
        right[i] = (right[i] - known) / matrix[i][i];
    }
}
