//! Factorised symmetric 6x6 block, which turns a free body's forces into accelerations.

use super::inertia::Articulated;
use super::real::{MaskOf, MatrixOf, Real, VectorOf};
use super::spatial::Spatial;
use super::spatials::Spatials;

/// Relative threshold of inertia: a direction with at most this part of the largest counts as without
/// inertia.
pub(super) const FLAT: f64 = 1e-14;

/// L D L' of an inertia (Golub and Van Loan, algorithm 4.1.2).
#[derive(Clone, Copy, Debug, Default)]
pub struct Ldlt6<R: Real = f64> {
    pub(super) lower: [[R; 6]; 6],
    /// Inverse of D; 0 if a direction has no inertia, so that it is not accelerated.
    pub(super) inverse_diagonal: [R; 6],
}

impl<R: Real> Ldlt6<R> {
    /// Returns the factors of a zero inertia.
    #[inline(always)]
    pub(super) fn zero(zero: R) -> Self {
        Self { lower: [[zero; 6]; 6], inverse_diagonal: [zero; 6] }
    }

    /// Factorises an inertia. A flat direction counts as without inertia; see [`FLAT`].
    #[inline(always)]
    #[allow(clippy::needless_range_loop, reason = "reads as the algorithm does")]
    pub fn new(inertia: &Articulated<R>) -> Self {
        let matrix = lower_half(inertia);
        let zero = matrix[0][0].splat(0.0);
        let one = zero.splat(1.0);
        let mut largest = zero;
        for i in 0..6 {
            largest = largest.max(matrix[i][i].abs());
        }
        let least = largest * zero.splat(FLAT);
        let mut factors = Self::zero(zero);
        let mut diagonal = [zero; 6];
        for j in 0..6 {
            let mut d = matrix[j][j];
            for k in 0..j {
                d -= factors.lower[j][k] * factors.lower[j][k] * diagonal[k];
            }
            let is_flat = d.le(least);
            if is_flat.all() {
                continue;
            }
            diagonal[j] = is_flat.select(zero, d);
            factors.inverse_diagonal[j] = is_flat.select(zero, one / d);
            for i in j + 1..6 {
                let mut sum = matrix[i][j];
                for k in 0..j {
                    sum -= factors.lower[i][k] * factors.lower[j][k] * diagonal[k];
                }
                factors.lower[i][j] = is_flat.select(zero, sum / d);
            }
        }
        factors
    }

    /// Returns whether every direction has inertia.
    #[inline(always)]
    pub fn is_regular(&self) -> R::Mask {
        let zero = self.inverse_diagonal[0].splat(0.0);
        let mut is_regular = zero.lt(self.inverse_diagonal[0]);
        for inverse in self.inverse_diagonal {
            is_regular = is_regular & zero.lt(inverse);
        }
        is_regular
    }

    /// Returns I^-1 force.
    #[inline(always)]
    #[allow(clippy::needless_range_loop, reason = "reads as the algorithm does")]
    pub fn solve(&self, force: Spatial<R>) -> Spatial<R> {
        let ([a, b, c], [d, e, f]) = (force.angular.parts(), force.linear.parts());
        let mut x = [a, b, c, d, e, f];
        for i in 0..6 {
            for k in 0..i {
                let known = x[k];
                x[i] -= self.lower[i][k] * known;
            }
        }
        for i in 0..6 {
            x[i] = x[i] * self.inverse_diagonal[i];
        }
        for i in (0..6).rev() {
            for k in i + 1..6 {
                let known = x[k];
                x[i] -= self.lower[k][i] * known;
            }
        }
        let [a, b, c, d, e, f] = x;
        Spatial { angular: R::Vector::of([a, b, c]), linear: R::Vector::of([d, e, f]) }
    }
}

impl Ldlt6 {
    /// Applies [`solve`](Self::solve) to the negative of each.
    #[inline(always)]
    #[allow(clippy::needless_range_loop, reason = "reads as the algorithm does")]
    pub fn solve_all<const N: usize>(&self, minus: &Spatials<N>) -> Spatials<N> {
        let ([a, b, c], [d, e, f]) = (minus.angular, minus.linear);
        let mut x = [a, b, c, d, e, f];
        for i in 0..6 {
            for j in 0..N {
                x[i][j] = -x[i][j];
            }
        }
        for i in 0..6 {
            for k in 0..i {
                for j in 0..N {
                    x[i][j] -= self.lower[i][k] * x[k][j];
                }
            }
        }
        for i in 0..6 {
            for j in 0..N {
                x[i][j] *= self.inverse_diagonal[i];
            }
        }
        for i in (0..6).rev() {
            for k in i + 1..6 {
                for j in 0..N {
                    x[i][j] -= self.lower[k][i] * x[k][j];
                }
            }
        }
        let [a, b, c, d, e, f] = x;
        Spatials { angular: [a, b, c], linear: [d, e, f] }
    }
}

/// Returns the rows of an inertia without the entries above the diagonal.
#[inline(always)]
fn lower_half<R: Real>(inertia: &Articulated<R>) -> [[R; 6]; 6] {
    let Articulated { moment: m, coupling, mass } = inertia;
    let [a, b, c] = coupling.columns();
    let ([ax, ay, az], [bx, by, bz], [cx, cy, cz]) = (a.parts(), b.parts(), c.parts());
    let none = m.xx.splat(0.0);
    [
        [m.xx, none, none, none, none, none],
        [m.xy, m.yy, none, none, none, none],
        [m.xz, m.yz, m.zz, none, none, none],
        [ax, ay, az, mass.xx, none, none],
        [bx, by, bz, mass.xy, mass.yy, none],
        [cx, cy, cz, mass.xz, mass.yz, mass.zz],
    ]
}

#[cfg(test)]
mod tests {
    use glamx::{DMat3, DVec3};

    use super::*;
    use crate::dynamics::inertia::Rigid;

    #[test]
    fn solving_undoes_multiplying() {
        let moment = DMat3::from_diagonal(DVec3::new(0.2, 0.3, 0.4));
        let inertia = Articulated::of(&Rigid::new(3.0, DVec3::new(0.3, -0.1, 0.2), &moment));
        let motion = Spatial::new(DVec3::new(1.0, 2.0, 3.0), DVec3::new(-1.0, 0.5, 0.25));
        let factors = Ldlt6::new(&inertia);
        let back = factors.solve(inertia.times(motion)) - motion;
        assert!(back.angular.length() + back.linear.length() < 1e-12);
        let mut minus = Spatials::<3>::ZERO;
        minus.set(1, -inertia.times(motion));
        let all = factors.solve_all(&minus);
        assert_eq!((all.get(0), all.get(1)), (Spatial::ZERO, factors.solve(inertia.times(motion))));
    }

    #[test]
    fn a_point_mass_is_not_turned_to_infinity() {
        let inertia = Articulated::of(&Rigid::new(3.0, DVec3::ZERO, &DMat3::ZERO));
        let answer = Ldlt6::new(&inertia).solve(Spatial::new(DVec3::X, DVec3::new(0.0, 6.0, 0.0)));
        assert_eq!(answer, Spatial::new(DVec3::ZERO, DVec3::new(0.0, 2.0, 0.0)));
    }
}
