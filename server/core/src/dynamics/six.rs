//! Six spatial vectors side by side, so that what is done to all of them is done to two or more at a time.

use glamx::DVec3;

use super::spatial::Spatial;

/// Of each component the six numbers.
#[derive(Clone, Copy, Debug, Default)]
pub struct Six {
    /// See [`Spatial`].
    pub angular: [[f64; 6]; 3],
    /// See [`Spatial`].
    pub linear: [[f64; 6]; 3],
}

impl Six {
    /// One of them.
    pub fn get(&self, k: usize) -> Spatial {
        let part = |part: &[[f64; 6]; 3]| DVec3::new(part[0][k], part[1][k], part[2][k]);
        Spatial::new(part(&self.angular), part(&self.linear))
    }

    /// Replaces one of them.
    pub fn set(&mut self, k: usize, value: Spatial) {
        for i in 0..3 {
            (self.angular[i][k], self.linear[i][k]) = (value.angular[i], value.linear[i]);
        }
    }

    /// [`Spatial::dot`] of each.
    #[inline]
    pub fn dot(&self, Spatial { angular: a, linear: l }: Spatial) -> [f64; 6] {
        let Self { angular, linear } = self;
        std::array::from_fn(|k| {
            (angular[0][k] * a.x + angular[1][k] * a.y + angular[2][k] * a.z)
                + (linear[0][k] * l.x + linear[1][k] * l.y + linear[2][k] * l.z)
        })
    }

    /// Adds a vector to each, times its factor.
    #[inline]
    pub fn add_multiples(&mut self, vector: Spatial, factors: &[f64; 6]) {
        for i in 0..3 {
            let (a, l) = (vector.angular[i], vector.linear[i]);
            for (k, factor) in factors.iter().enumerate() {
                self.angular[i][k] += a * factor;
                self.linear[i][k] += l * factor;
            }
        }
    }

    /// [`Spatial::motion_at`] of each.
    #[inline]
    pub fn motion_at(&self, reach: DVec3) -> Self {
        Self { angular: self.angular, linear: plus_cross(&self.linear, -reach, &self.angular) }
    }

    /// [`Spatial::force_from`] of each.
    #[inline]
    pub fn force_from(&self, reach: DVec3) -> Self {
        Self { angular: plus_cross(&self.angular, reach, &self.linear), linear: self.linear }
    }

    /// Adds six.
    #[inline]
    pub fn add(&mut self, other: &Self) {
        for i in 0..3 {
            for k in 0..6 {
                self.angular[i][k] += other.angular[i][k];
                self.linear[i][k] += other.linear[i][k];
            }
        }
    }
}

/// sums + v x part, each.
#[inline]
fn plus_cross(sums: &[[f64; 6]; 3], v: DVec3, part: &[[f64; 6]; 3]) -> [[f64; 6]; 3] {
    let mut out = *sums;
    for k in 0..6 {
        out[0][k] += v.y * part[2][k] - v.z * part[1][k];
        out[1][k] += v.z * part[0][k] - v.x * part[2][k];
        out[2][k] += v.x * part[1][k] - v.y * part[0][k];
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_of_the_six_is_treated_as_it_would_be_alone() {
        let vector = |k: usize| {
            let at = k as f64;
            Spatial::new(DVec3::new(1.0 + at, -0.3 * at, 0.7), DVec3::new(0.2, at * at, -1.5 * at))
        };
        let (reach, other) = (DVec3::new(0.3, -1.1, 0.6), vector(9));
        let mut six = Six::default();
        (0..6).for_each(|k| six.set(k, vector(k)));
        let mut moved = six.motion_at(reach);
        moved.add_multiples(other, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
        let mut shifted = six.force_from(reach);
        shifted.add(&six);
        for k in 0..6 {
            let near = |a: Spatial, b: Spatial| {
                (a.angular - b.angular).length() + (a.linear - b.linear).length() < 1e-12
            };
            assert!(near(moved.get(k), vector(k).motion_at(reach) + other * (k + 1) as f64));
            assert!(near(shifted.get(k), vector(k).force_from(reach) + vector(k)));
            assert!((six.dot(other)[k] - vector(k).dot(other)).abs() < 1e-12);
        }
    }
}
