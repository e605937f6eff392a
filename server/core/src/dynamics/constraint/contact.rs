//! A contact point as three rows: normal, and two tangents bounded by a friction cone.

use glamx::DVec3;
use serde::{Deserialize, Serialize};

use super::contact_law::{self, Resistance, inverse_of_tangents};
use super::side::{Side, add_transposed};
use crate::dynamics::bullet::BulletContacts;
use crate::dynamics::contact_point::ContactPoint;
use crate::plain::vector3;

/// Allowed depth of touching points, metres. A resting contact, with its normal, is then found in each step,
/// and nothing moves it.
pub const SLOP: f64 = 2e-5;

/// Depth of resting points, metres; arriving points move to this depth.
pub const REST: f64 = SLOP / 2.0;

/// Tolerance above [`REST`] within which points count as arrived, metres. They then neither fall nor press
/// because of rounding.
pub const AT_REST: f64 = 1e-9;

/// Maximum depth before the rebound of a hit that another hit causes, metres.
const MAX_REBOUND_DEPTH: f64 = 2e-3;

/// Part of an overlap that position correction removes in a step.
pub const OVERLAP_REDUCTION: f64 = 0.2;

/// Maximum velocity of position correction, m/s.
pub const MAX_CORRECTION_VELOCITY: f64 = 1.0;

/// Minimum speed of a hit that bounces, m/s, in addition to the speed that gravity adds in two steps.
pub const BOUNCE_THRESHOLD: f64 = 0.01;

/// Point at which two bodies touch or are about to.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Contact {
    /// Indices of the two robots, the smaller first.
    pub robots: [usize; 2],
    /// Index among the points of the same colliders. Recounted when contacts are read.
    #[serde(skip)]
    pub index: usize,
    /// Position, colliders and surface.
    pub point: ContactPoint,
    /// Impulse on the second robot, world, N s; before solving, the last step's.
    #[serde(with = "vector3")]
    pub impulse: DVec3,
    /// Torque against rolling and spinning on the second robot, times the step, world, N m s; before solving,
    /// the last step's.
    #[serde(with = "vector3")]
    pub turning_impulse: DVec3,
    /// Whether the impulse comes from a solution with the least impulses, and not from sweeps.
    pub is_least: bool,
    /// Sum of the impulses of a step's parts, N s.
    #[serde(with = "vector3")]
    pub total: DVec3,
    /// Displacement of the only point of two colliders since the previous step, world, metres; 0 if there are
    /// several points, or if it is new.
    #[serde(with = "vector3")]
    pub moved: DVec3,
    /// `moved` if the point moves steadily, as under a rolling coin, else 0. Recomputed with the contact.
    #[serde(skip)]
    pub wanders: DVec3,
}

/// Largest relative change of displacement from step to step at which the only point of two colliders moves
/// steadily.
pub const STEADY: f64 = 0.25;

impl Contact {
    /// Creates a contact without impulses.
    pub fn new(robots: [usize; 2], point: ContactPoint) -> Self {
        Self {
            robots,
            index: 0,
            point,
            impulse: DVec3::ZERO,
            turning_impulse: DVec3::ZERO,
            is_least: false,
            total: DVec3::ZERO,
            moved: DVec3::ZERO,
            wanders: DVec3::ZERO,
        }
    }

    /// Copies the impulses of the same contact in the previous part of a step. Their sum starts from zero if
    /// a step `begins`.
    pub fn warm_start_from(&mut self, known: &Self, begins: bool) {
        let Self { impulse, turning_impulse, is_least, total, .. } = *known;
        (self.impulse, self.turning_impulse) = (impulse, turning_impulse);
        (self.is_least, self.total) = (is_least, if begins { DVec3::ZERO } else { total });
    }

    /// Clears the impulses: nothing acted here in a part of a step.
    pub fn skip_part(&mut self) {
        (self.impulse, self.turning_impulse, self.is_least) = (DVec3::ZERO, DVec3::ZERO, false);
    }

    /// Records its displacement, if it is the only point of its colliders and was before.
    pub fn follow(&mut self, known: &Self) {
        self.moved = self.point.position - known.point.position;
        let is_steady = self.moved.distance(known.moved) < STEADY * self.moved.length();
        self.wanders = if is_steady { self.moved } else { DVec3::ZERO };
    }
}

/// Threshold of J M^-1 J' along a direction, as a part of the sum along all three. Below it no joint can move
/// the point, and the value is rounding: dividing by it would eject a robot.
pub const IMMOVABLE: f64 = 1e-12;

/// A contact's three rows.
#[derive(Clone, Copy, Debug, Default)]
pub struct ContactRows {
    /// Index of the contact.
    pub contact: usize,
    /// Sides of the two robots; the second has length 0 if only one can move.
    pub sides: [Side; 2],
    /// Normal and tangents, world.
    pub axes: [DVec3; 3],
    /// Velocities along the axes without impulses.
    pub unloaded: [f64; 3],
    /// Minimum normal velocity, m/s.
    pub target: f64,
    /// Tangent velocities without slip, m/s.
    pub drift: [f64; 2],
    /// Normal velocity of position correction, m/s.
    pub correction_velocity: f64,
    /// Impulse of position correction along the normal, which changes no velocity, N s.
    pub split_impulse: f64,
    /// J M^-1 J': nn, nt, nu, tt, tu, uu.
    pub effect: [f64; 6],
    /// Inverse of its tangent part: tt, tu, uu.
    pub inverse: [f64; 3],
    /// Inverse of the largest effect along a tangent.
    pub gradient_step: f64,
    /// Coulomb's coefficient of friction.
    pub friction: f64,
    /// Compliance of the normal's row, J v + compliance p >= target, m/(N s²) times s. It is 1 / (h (h k +
    /// c)) for a spring k and a damper c, and 0 if the surfaces are rigid.
    pub compliance: f64,
    /// Impulses along normal and tangents, N s.
    pub impulse: [f64; 3],
}

impl ContactRows {
    /// Returns the velocities of the second body's point relative to the first's, along the axes.
    #[inline]
    pub fn velocities(&self, blocks: &[f64], velocities: &[f64]) -> [f64; 3] {
        let mut sums = [[0.0; 2]; 3];
        self.sides[0].add_velocities(blocks, velocities, &mut sums);
        self.sides[1].add_velocities(blocks, velocities, &mut sums);
        sums.map(|[even, odd]| even + odd)
    }

    /// Returns the normal velocity, and the tangent velocities relative to those without slip.
    #[inline]
    pub fn slip(&self, blocks: &[f64], velocities: &[f64]) -> [f64; 3] {
        let [n, t, u] = self.velocities(blocks, velocities);
        [n, t - self.drift[0], u - self.drift[1]]
    }

    /// Applies an impulse along the axes to the velocities.
    #[inline]
    pub fn apply_impulse(&self, blocks: &[f64], impulse: [f64; 3], velocities: &mut [f64]) {
        self.sides[0].apply_impulse(blocks, impulse, velocities);
        self.sides[1].apply_impulse(blocks, impulse, velocities);
    }

    /// Adds J' times an impulse along the axes.
    pub fn add_momentum(&self, blocks: &[f64], impulse: [f64; 3], momentum: &mut [f64]) {
        for side in &self.sides {
            let own = &mut momentum[side.first..side.first + side.len];
            for (span, part) in side.parts(blocks) {
                add_transposed(&mut own[span], part, impulse);
            }
        }
    }

    /// Computes J M^-1 J' from the blocks.
    #[inline(always)]
    pub fn measure(&mut self, blocks: &[f64]) {
        let mut effect = [0.0; 6];
        for side in self.sides.iter().filter(|side| side.len > 0) {
            let [[nn, ..], [tn, tt, _], [un, ut, uu]] = side.effects(blocks);
            let own = [nn, tn, un, tt, ut, uu];
            effect.iter_mut().zip(own).for_each(|(sum, own)| *sum += own);
        }
        self.effect = effect;
        (self.inverse, self.gradient_step) = inverse_of_tangents(effect);
    }

    /// Sets the minimum normal velocity and the velocity of position correction for a step of `h`. They
    /// follow from the velocities before the step and the unloaded ones. `gravity` is its magnitude.
    /// `turning` are the velocities at which the point that is touched in the middle of the step is at rest.
    /// With them, friction holds a point in place to second order. With tangent velocities of 0, an object on
    /// a turntable would creep outwards by r w² h/2 a second.
    ///
    /// * Less deep than [`REST`]: arrive there, but do not pass.
    /// * Deeper: do not approach. Resting points are therefore not at a threshold where rounding decides, and
    ///   do not fall repeatedly.
    /// * After a hit: leave with a part of the approach speed.
    /// * Deeper than [`SLOP`]: position correction.
    ///
    /// If the correction were part of the velocities, warm starting would accumulate it, and a stack would
    /// sway with growing amplitude. Let the sweeps of a step correct a mode by a part a, and let c be the
    /// corrected part of the overlap. `s^3 + a s^2 + a s + a c = 0` has growing solutions if c exceeds a.
    ///
    /// A spring and a damper are implicit, p = h (-k (d + h v) - c v), as in MuJoCo and Bullet. They are
    /// stable at any stiffness, and exact at rest.
    pub fn set_targets(
        &mut self,
        contact: &Contact,
        before: [f64; 3],
        turning: [f64; 3],
        (gravity, h): (f64, f64),
    ) {
        let ContactPoint { distance, surface, .. } = contact.point;
        let [leaving, drift @ ..] = [0, 1, 2].map(|i| contact_law::leaving(turning[i], before[i]));
        let [before, ..] = before;
        self.drift = drift;
        if surface.stiffness > 0.0 {
            let hardness = h * surface.stiffness + surface.damping;
            self.compliance = 1.0 / (h * hardness);
            self.target = -surface.stiffness * distance / hardness;
            (self.correction_velocity, self.split_impulse) = (0.0, 0.0);
            return;
        }
        self.target = contact_law::arrival(distance, h) + leaving;
        let hits = distance + h * self.unloaded[0] <= 0.0 && before < -(BOUNCE_THRESHOLD + 2.0 * gravity * h);
        // A contact without rebound arrives: ending its motion where the hit was detected would leave a gap.
        if hits && surface.restitution > 0.0 {
            self.target = self.target.max(-surface.restitution * before);
        }
        self.correction_velocity = contact_law::correction(distance, h);
        self.split_impulse = 0.0;
    }

    /// Sets the targets of [`BulletContacts`]: overlaps are corrected by velocities, and friction acts against
    /// the slip at the start of the step.
    pub fn set_bullets_targets(&mut self, contact: &Contact, law: BulletContacts, h: f64) {
        let ContactPoint { distance, surface, .. } = &contact.point;
        (self.target, self.compliance) = law.target(*distance, self.unloaded[0], surface, h);
        self.drift = [0.0; 2];
        (self.correction_velocity, self.split_impulse) = (0.0, 0.0);
    }

    /// Postpones a hit that another hit in this step has caused to the next step, and removes its impulse.
    /// Returns whether it did.
    ///
    /// A ball that is hit and meets another one within the step was not predicted to do so. Stopping it at
    /// the meeting point without rebound would remove energy. It moves on by at most [`MAX_REBOUND_DEPTH`], and
    /// rebounds in the next step.
    pub fn postpone_hit(
        &mut self,
        contact: &Contact,
        (gravity, h): (f64, f64),
        blocks: &[f64],
        velocities: &mut [f64],
    ) -> bool {
        let ContactPoint { distance, surface, .. } = contact.point;
        let is_rigid = self.compliance == 0.0;
        if surface.restitution == 0.0 || !is_rigid || self.impulse[0] <= 0.0 || self.target >= 0.0 {
            return false;
        }
        let approach = self.velocities(blocks, velocities)[0] - self.effect[0] * self.impulse[0];
        let hits = approach < -(BOUNCE_THRESHOLD + 2.0 * gravity * h);
        if !hits || distance + h * approach < -MAX_REBOUND_DEPTH {
            return false;
        }
        self.apply_impulse(blocks, self.impulse.map(|impulse| -impulse), velocities);
        (self.impulse, self.target) = ([0.0; 3], 2.0 * approach);
        true
    }

    /// Applies the split impulse along the normal. It changes the velocities that integrate positions, but
    /// not the velocities themselves.
    pub fn correct_position(&mut self, blocks: &[f64], split_velocities: &mut [f64]) {
        let velocity = self.velocities(blocks, split_velocities)[0];
        let split_impulse =
            (self.split_impulse + (self.correction_velocity - velocity) / self.effect[0]).max(0.0);
        let change = split_impulse - self.split_impulse;
        if change != 0.0 {
            self.split_impulse = split_impulse;
            self.apply_impulse(blocks, [change, 0.0, 0.0], split_velocities);
        }
    }

    /// Returns whether it can move anything.
    pub fn acts(&self) -> bool {
        contact_law::acts(self.effect)
    }

    /// Applies the impulses that bring the normal velocity to its target or the normal impulse to 0. They
    /// also stop the tangent velocities within the friction bound. Returns the largest change of a velocity,
    /// m/s.
    #[inline]
    pub fn solve(&mut self, blocks: &[f64], velocities: &mut [f64]) -> f64 {
        let [nn, nt, nu, tt, _, uu] = self.effect;
        let [n, t, u] = self.slip(blocks, velocities);
        let left = self.target - n - self.compliance * self.impulse[0];
        let resistance = Resistance {
            normal: nn + self.compliance,
            coupling: [nt, nu],
            inverse: self.inverse,
            gradient_step: self.gradient_step,
        };
        let before = self.impulse;
        self.impulse = resistance.next(before, self.friction, [left, t, u]);
        let [dn, dt, du] = [0, 1, 2].map(|k| self.impulse[k] - before[k]);
        if dn == 0.0 && dt == 0.0 && du == 0.0 {
            return 0.0;
        }
        self.apply_impulse(blocks, [dn, dt, du], velocities);
        (dn * nn).abs().max((dt * tt).abs()).max((du * uu).abs())
    }

    /// Returns the impulse on the second body, world.
    pub fn world_impulse(&self) -> DVec3 {
        let [n, t, u] = self.axes;
        n * self.impulse[0] + t * self.impulse[1] + u * self.impulse[2]
    }
}
