//! How the impulse of one contact follows from its velocity while nothing else changes.

/// What a sweep knows of a contact beside J and M^-1 J'.
#[derive(Clone, Copy, Debug, Default)]
pub struct ContactLaw {
    /// The least normal velocity.
    pub target: f64,
    /// The tangent velocities of what does not slip.
    pub drift: [f64; 2],
    /// J M^-1 J': nn, nt, nu, tt, uu.
    pub effect: [f64; 5],
    /// The inverse of its tangent part: tt, tu, uu.
    pub inverse: [f64; 3],
    /// The inverse of the largest effect along a tangent.
    pub gradient_step: f64,
    /// Coulomb's coefficient.
    pub friction: f64,
    /// See [`ContactRows`](super::contact::ContactRows).
    pub compliance: f64,
    /// Normal and tangents, N s.
    pub impulse: [f64; 3],
}

impl ContactLaw {
    /// Takes the impulses that make the normal velocity reach the target or the impulse vanish, and tangent velocities vanish as far
    /// as friction goes, where velocities along the axes are these. The change of the impulse.
    ///
    /// The tangent impulse is projected on the disc of radius friction times normal
    /// impulse: the circular cone of Coulomb's law, not a pyramid. Where that settles, friction
    /// points against the slip.
    #[inline(always)]
    pub fn solve(&mut self, [normal_velocity, t, u]: [f64; 3]) -> [f64; 3] {
        let [nn, nt, nu, ..] = self.effect;
        let slip = [t - self.drift[0], u - self.drift[1]];
        let left = self.target - normal_velocity - self.compliance * self.impulse[0];
        let normal = (self.impulse[0] + left / (nn + self.compliance)).max(0.0);
        let dn = normal - self.impulse[0];
        let most = self.friction * normal;
        let (mut dt, mut du) = (0.0, 0.0);
        if most > 0.0 || self.impulse[1] != 0.0 || self.impulse[2] != 0.0 {
            let (vt, vu) = (slip[0] + nt * dn, slip[1] + nu * dn);
            let [a, b, c] = self.inverse;
            let (mut t, mut u) = (self.impulse[1] - a * vt - b * vu, self.impulse[2] - b * vt - c * vu);
            if t * t + u * u > most * most {
                // It slips. The impulse that would stop it is no guide to where friction points,
                // since the body may be easier to move one way than the other; a step against the
                // slip is.
                t = self.impulse[1] - self.gradient_step * vt;
                u = self.impulse[2] - self.gradient_step * vu;
                let size = (t * t + u * u).sqrt();
                if size > most {
                    (t, u) = (t * most / size, u * most / size);
                }
            }
            (dt, du) = (t - self.impulse[1], u - self.impulse[2]);
            (self.impulse[1], self.impulse[2]) = (t, u);
        }
        self.impulse[0] = normal;
        [dn, dt, du]
    }

    /// The largest change of one of its own velocities by a change of its impulse, m/s.
    #[inline(always)]
    pub fn largest_change(&self, [dn, dt, du]: [f64; 3]) -> f64 {
        let [nn, _, _, tt, uu] = self.effect;
        (dn * nn).abs().max((dt * tt).abs()).max((du * uu).abs())
    }
}
