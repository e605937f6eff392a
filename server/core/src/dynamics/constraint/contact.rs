//! One point of contact as three rows: normal, and two tangents held by a cone of friction.

use glamx::DVec3;
use serde::{Deserialize, Serialize};

use super::contact_law::{self, Resistance, inverse_of_tangents};
use super::side::{Side, add_transposed};
use crate::dynamics::contact_point::ContactPoint;
use crate::plain::vector3;

/// Points that touch may be this deep inside each other, metres: a contact that rests is found
/// again in each step, and its normal with it, and nothing moves it.
pub const SLOP: f64 = 2e-5;

/// What rests is this deep, metres: points that arrive go on to here.
pub const REST: f64 = SLOP / 2.0;

/// Points this much above [`REST`] count as there, metres: they neither fall nor press for the sake of rounding.
pub const AT_REST: f64 = 1e-9;

/// What is hit by another hit may go this deep before it rebounds, metres.
const MOST_PASSED: f64 = 2e-3;

/// The fraction of an overlap that position correction removes in a step.
pub const OVERLAP_REDUCTION: f64 = 0.2;

/// Position correction moves no faster than this, m/s.
pub const MAX_CORRECTION_VELOCITY: f64 = 1.0;

/// A hit slower than this does not bounce, m/s; nor does one that gravity makes in two steps.
pub const BOUNCE_THRESHOLD: f64 = 0.01;

/// A point at which two bodies touch or are about to.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Contact {
    /// Indices of the two robots, the smaller first.
    pub robots: [usize; 2],
    /// Its index among the points of the same colliders. Counted again where contacts are read.
    #[serde(skip)]
    pub index: usize,
    /// Where, and on what.
    pub point: ContactPoint,
    /// On the second, world, N s; before solving that of the last step.
    #[serde(with = "vector3")]
    pub impulse: DVec3,
    /// The torque against rolling and spinning, times the step: on the second, world, N m s. The same.
    #[serde(with = "vector3")]
    pub turning_impulse: DVec3,
    /// The impulse is the one of a solution with the least impulses, and not of sweeps.
    pub is_least: bool,
    /// The sum of the impulses of the parts of a step.
    #[serde(with = "vector3")]
    pub total: DVec3,
    /// How far the only point of two colliders has moved since the step before, world, metres; 0 where there are more, and where it is new.
    #[serde(with = "vector3")]
    pub moved: DVec3,
    /// The same where it moves on steadily, as that of a coin that rolls, and 0 elsewhere. Found again with the contact.
    #[serde(skip)]
    pub wanders: DVec3,
}

/// The only point of two colliders moves steadily where its way differs from that of the step before by less than this part of it.
pub const STEADY: f64 = 0.25;

impl Contact {
    /// A new one, without impulses.
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

    /// Takes the impulses of the one that it was in the part of a step before; sums of impulses begin anew where a step `begins`.
    pub fn go_on_from(&mut self, known: &Self, begins: bool) {
        let Self { impulse, turning_impulse, is_least, total, .. } = *known;
        (self.impulse, self.turning_impulse) = (impulse, turning_impulse);
        (self.is_least, self.total) = (is_least, if begins { DVec3::ZERO } else { total });
    }

    /// Notes that nothing has acted here in a part of a step.
    pub fn skip_part(&mut self) {
        (self.impulse, self.turning_impulse, self.is_least) = (DVec3::ZERO, DVec3::ZERO, false);
    }

    /// Notes how far it has come, where it is the only point of its colliders and was that before.
    pub fn follow(&mut self, known: &Self) {
        self.moved = self.point.position - known.point.position;
        let is_steady = self.moved.distance(known.moved) < STEADY * self.moved.length();
        self.wanders = if is_steady { self.moved } else { DVec3::ZERO };
    }
}

/// Along a direction that no joint can move, J M^-1 J' is rounding: less than this part of what
/// it is along all three. To divide by it would throw a robot away.
pub const IMMOVABLE: f64 = 1e-12;

/// A contact's three rows.
#[derive(Clone, Copy, Debug, Default)]
pub struct ContactRows {
    /// Index of the contact.
    pub contact: usize,
    /// The second side has length 0 where only one can move.
    pub sides: [Side; 2],
    /// Normal and tangents, world.
    pub axes: [DVec3; 3],
    /// Velocities along the axes without impulses.
    pub unloaded: [f64; 3],
    /// The least normal velocity.
    pub target: f64,
    /// The tangent velocities of what does not slip.
    pub drift: [f64; 2],
    /// The normal velocity of position correction.
    pub correction_velocity: f64,
    /// The split impulse: that of position correction, which changes no velocity.
    pub split_impulse: f64,
    /// J M^-1 J': nn, nt, nu, tt, tu, uu.
    pub effect: [f64; 6],
    /// The inverse of its tangent part: tt, tu, uu.
    pub inverse: [f64; 3],
    /// The inverse of the largest effect along a tangent.
    pub gradient_step: f64,
    /// Coulomb's coefficient.
    pub friction: f64,
    /// Of the normal's row, J v + compliance p >= target, m/(N s²) times s: 1 / (h (h k + c)) of a spring k and a damper c,
    /// and 0 where the surfaces are rigid.
    pub compliance: f64,
    /// Normal and tangents, N s.
    pub impulse: [f64; 3],
}

impl ContactRows {
    /// Velocities of the second body's point against the first's, along the axes.
    #[inline]
    pub fn velocities(&self, blocks: &[f64], velocities: &[f64]) -> [f64; 3] {
        let mut sums = [[0.0; 2]; 3];
        self.sides[0].add_velocities(blocks, velocities, &mut sums);
        self.sides[1].add_velocities(blocks, velocities, &mut sums);
        sums.map(|[even, odd]| even + odd)
    }

    /// The normal velocity, and by how much tangent velocities are not those of what does not slip.
    #[inline]
    pub fn slip(&self, blocks: &[f64], velocities: &[f64]) -> [f64; 3] {
        let [n, t, u] = self.velocities(blocks, velocities);
        [n, t - self.drift[0], u - self.drift[1]]
    }

    /// Gives the velocities an impulse along the axes.
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

    /// Takes J M^-1 J' from the blocks.
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

    /// The least normal velocity for a step of `h`, from the velocities before the step and the
    /// unloaded ones; and the velocity of position correction. `gravity` is its size, and `turning` the velocities here
    /// with which the point that is touched in the middle of the step has none. Along the tangents, what friction holds so keeps its
    /// place to second order: with tangent velocities of 0 a thing on a turntable would creep outwards by r w² h/2 a second.
    ///
    /// Less deep than [`REST`]: arrive there, and do not pass. Deeper: come no nearer. So what rests is not where a
    /// rounding decides between the two, and does not fall again and again. After a
    /// hit: leave with a part of the approach speed. Deeper than [`SLOP`]: position correction.
    ///
    /// If the correction were part of the velocities, warm starting would accumulate it, and
    /// a stack would sway more and more: for a mode that the sweeps of a step put right by a
    /// part a, s^3 + a s^2 + a s + a c = 0 has growing solutions where c, the part of the
    /// overlap, is above a.
    ///
    /// A spring and a damper are implicit, p = h (-k (d + h v) - c v), as MuJoCo's and Bullet's are: stable at any stiffness, and
    /// exact at rest.
    pub fn aim(&mut self, contact: &Contact, before: [f64; 3], turning: [f64; 3], (gravity, h): (f64, f64)) {
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
        // What does not bounce arrives: to end it where the hit was found would leave a gap.
        if hits && surface.restitution > 0.0 {
            self.target = self.target.max(-surface.restitution * before);
        }
        self.correction_velocity = contact_law::correction(distance, h);
        self.split_impulse = 0.0;
    }

    /// Leaves a hit to the next step that another hit in this one has caused, and takes its impulse back. Whether it did.
    ///
    /// A ball that is hit and meets another one within the step was not seen to do so: to stop it where they meet, which is
    /// no rebound, would take energy. It goes on, by at most [`MOST_PASSED`], and rebounds in the next step.
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
        if !hits || distance + h * approach < -MOST_PASSED {
            return false;
        }
        self.apply_impulse(blocks, self.impulse.map(|impulse| -impulse), velocities);
        (self.impulse, self.target) = ([0.0; 3], 2.0 * approach);
        true
    }

    /// Applies the split impulse along the normal: it changes the velocities that positions are integrated
    /// with, and not the velocities themselves.
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

    /// Whether it can move anything.
    pub fn acts(&self) -> bool {
        contact_law::acts(self.effect)
    }

    /// Gives the contact the impulses that make its normal velocity reach the target or its
    /// impulse vanish, and its tangent velocities vanish as far as friction goes. The largest
    /// change of a velocity, m/s.
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

    /// The impulse on the second body, world.
    pub fn world_impulse(&self) -> DVec3 {
        let [n, t, u] = self.axes;
        n * self.impulse[0] + t * self.impulse[1] + u * self.impulse[2]
    }
}
