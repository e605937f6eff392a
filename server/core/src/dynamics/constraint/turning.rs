//! Friction of one contact against spinning about the normal and rolling along the tangents, as three rows on the
//! angular velocities of what touches.
//!
//! The torques are bounded by coefficients in metres times the normal force, as MuJoCo's coefficients of torsional and rolling
//! friction are: about the normal on its own, and along both tangents together within a circle. What would turn on is held, and what
//! turns is braked.

use super::contact::ContactRows;

/// Turning of one contact.
#[derive(Clone, Copy, Debug)]
pub struct TurningRows {
    /// J of relative angular velocities along the contact's axes, and the impulses, N m s. What it says of targets and
    /// friction is not used.
    pub rows: ContactRows,
    /// Index of the rows of its forces.
    pub of: usize,
    /// Metres.
    pub spinning: f64,
    /// Metres.
    pub rolling: f64,
}

impl TurningRows {
    /// Whether anything can turn.
    pub fn acts(&self) -> bool {
        let [nn, _, _, tt, _, uu] = self.rows.effect;
        nn + tt + uu > 0.0
    }

    /// Gives the contact the torques that stop its turning, as far as they go with this normal impulse, N s. The
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
            // As for the friction of what slips: a step against the motion.
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
