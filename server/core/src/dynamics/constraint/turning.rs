//! Friction of a contact against spinning about the normal and rolling along the tangents, as three rows on
//! the relative angular velocities.
//!
//! The torques are bounded by coefficients in metres times the normal force, as MuJoCo's coefficients of
//! torsional and rolling friction are. The bound about the normal is separate; the one along both tangents is
//! a circle. A body that would start to turn is held, and a turning one is braked.

use super::contact::ContactRows;

/// Rows of one contact against turning.
#[derive(Clone, Copy, Debug)]
pub struct TurningRows {
    /// J of relative angular velocities along the contact's axes, and the impulses, N m s. Its targets and
    /// friction are unused.
    pub rows: ContactRows,
    /// Index of the contact's force rows.
    pub of: usize,
    /// Coefficient against spinning, metres.
    pub spinning: f64,
    /// Coefficient against rolling, metres.
    pub rolling: f64,
}

impl TurningRows {
    /// Returns whether anything can turn.
    pub fn acts(&self) -> bool {
        let [nn, _, _, tt, _, uu] = self.rows.effect;
        nn + tt + uu > 0.0
    }

    /// Applies the torques that stop its turning, within the bounds of this normal impulse, N s. Returns the
    /// largest change of an angular velocity, rad/s.
    #[inline]
    pub fn solve(&mut self, normal: f64, blocks: &[f64], velocities: &mut [f64]) -> f64 {
        let (spin, roll) = (self.spinning * normal, self.rolling * normal);
        let [before_n, before_t, before_u] = self.rows.impulse;
        let [nn, nt, nu, tt, _, uu] = self.rows.effect;
        let [n, mut t, mut u] = self.rows.velocities(blocks, velocities);
        let spinning = if nn > 0.0 { (before_n - n / nn).clamp(-spin, spin) } else { 0.0 };
        let dn = spinning - before_n;
        (t, u) = (t + nt * dn, u + nu * dn);
        let [a, b, c] = self.rows.inverse;
        let mut rolling = [before_t - a * t - b * u, before_u - b * t - c * u];
        if rolling[0] * rolling[0] + rolling[1] * rolling[1] > roll * roll {
            // As for slipping friction: a step against the motion.
            let step = self.rows.gradient_step;
            rolling = [before_t - step * t, before_u - step * u];
            let size = rolling[0].hypot(rolling[1]);
            if size > roll {
                rolling = rolling.map(|part| part * roll / size);
            }
        }
        let change = [dn, rolling[0] - before_t, rolling[1] - before_u];
        if change == [0.0; 3] {
            return 0.0;
        }
        self.rows.impulse = [spinning, rolling[0], rolling[1]];
        self.rows.apply_impulse(blocks, change, velocities);
        (change[0] * nn).abs().max((change[1] * tt).abs()).max((change[2] * uu).abs())
    }
}
