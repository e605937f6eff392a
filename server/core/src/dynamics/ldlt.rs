//! A symmetric 6x6 block, factorised: what a free body needs to turn force into acceleration.

use super::inertia::Articulated;
use super::spatial::Spatial;
use super::spatials::Spatials;

/// A direction whose inertia is at most this part of the largest counts as without.
pub(super) const FLAT: f64 = 1e-14;

/// L D L' of an inertia (Golub and Van Loan, algorithm 4.1.2).
#[derive(Clone, Debug, Default)]
pub struct Ldlt6 {
    pub(super) lower: [[f64; 6]; 6],
    /// 0 where a direction has no inertia: it is then not accelerated.
    pub(super) inverse_diagonal: [f64; 6],
}

impl Ldlt6 {
    #[allow(clippy::needless_range_loop, reason = "reads as the algorithm does")]
    /// Factorises. A flat direction counts as without inertia; see [`FLAT`].
    pub fn new(inertia: &Articulated) -> Self {
        let matrix = rows(inertia);
        let largest = (0..6).map(|i| matrix[i][i].abs()).fold(0.0, f64::max);
        let mut factors = Self::default();
        let mut diagonal = [0.0; 6];
        for j in 0..6 {
            let mut d = matrix[j][j];
            for k in 0..j {
                d -= factors.lower[j][k] * factors.lower[j][k] * diagonal[k];
            }
            if d <= largest * FLAT {
                continue;
            }
            diagonal[j] = d;
            factors.inverse_diagonal[j] = 1.0 / d;
            for i in j + 1..6 {
                let mut sum = matrix[i][j];
                for k in 0..j {
                    sum -= factors.lower[i][k] * factors.lower[j][k] * diagonal[k];
                }
                factors.lower[i][j] = sum / d;
            }
        }
        factors
    }

    /// Whether every direction has inertia.
    pub fn is_regular(&self) -> bool {
        self.inverse_diagonal.iter().all(|inverse| *inverse > 0.0)
    }

    /// I^-1 force.
    pub fn solve(&self, force: Spatial) -> Spatial {
        let mut minus = Spatials::<1>::ZERO;
        minus.set(0, -force);
        self.solve_all(&minus).get(0)
    }

    /// [`solve`](Self::solve) of minus each.
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

/// The inertia as six rows.
fn rows(inertia: &Articulated) -> [[f64; 6]; 6] {
    let mut rows = [[0.0; 6]; 6];
    let (moment, mass) = (inertia.moment.matrix(), inertia.mass.matrix());
    for i in 0..3 {
        for j in 0..3 {
            rows[i][j] = moment.col(j)[i];
            rows[i][j + 3] = inertia.coupling.col(j)[i];
            rows[i + 3][j] = inertia.coupling.col(i)[j];
            rows[i + 3][j + 3] = mass.col(j)[i];
        }
    }
    rows
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
