//! Energy and momentum of a tree of links on joints that turn or slide, in the middle of steps, from its
//! published state. Also their changes by a step that computes velocity terms at other velocities than it
//! moves with. docs/physics.md derives it, under energy.

use glamx::{DMat3, DPose3, DQuat, DVec3};
use simd_core::PublishedState;
use simd_model::RobotModel;
use simd_model::robot::{Inertial, JointKind};

/// Velocities that are equal except for rounding, m/s or rad/s.
const TOLERANCE: f64 = 1e-8;

/// A step in which a link turns by more than this takes velocity terms at the mean of the velocities before
/// and after it, rad.
const FAST: f64 = 0.1;

/// Position of a tree. Its generalized velocities are those of its root, linear in world axes and angular in
/// its own, and of its joints.
struct Place {
    root: DPose3,
    joints: Vec<f64>,
}

#[derive(Clone)]
struct Velocities {
    linear: DVec3,
    angular: DVec3,
    joints: Vec<f64>,
}

/// A link's pose, its velocities, and its accelerations at constant generalized velocities; of its origin,
/// world axes.
#[derive(Clone, Copy, Default)]
struct Motion {
    pose: DPose3,
    linear: DVec3,
    angular: DVec3,
    acceleration: DVec3,
    angular_acceleration: DVec3,
}

/// Energy and momentum.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Sums {
    pub(crate) kinetic: f64,
    pub(crate) energy: f64,
    pub(crate) momentum: DVec3,
}

impl Place {
    /// Returns the position of the first robot.
    fn of(seen: &PublishedState) -> Self {
        Self { root: seen.roots[0].pose, joints: seen.positions.clone() }
    }

    /// Returns the state to which these velocities lead in a time.
    fn after(&self, velocities: &Velocities, time: f64) -> Self {
        let turn = DQuat::from_scaled_axis(velocities.angular * time);
        let root =
            DPose3::from_parts(self.root.translation + velocities.linear * time, self.root.rotation * turn);
        let joints = self.joints.iter().zip(&velocities.joints).map(|(at, rate)| at + rate * time);
        Self { root, joints: joints.collect() }
    }
}

impl Velocities {
    /// Those that are reported.
    fn reported(seen: &PublishedState) -> Self {
        let root = &seen.roots[0];
        let angular = root.pose.rotation.inverse() * root.angular;
        Self { linear: root.linear, angular, joints: seen.velocities.clone() }
    }

    /// Those that lead from one place to another in a time.
    fn between(from: &Place, to: &Place, time: f64) -> Self {
        let turn = from.root.rotation.inverse() * to.root.rotation;
        Self {
            linear: (to.root.translation - from.root.translation) / time,
            angular: turn.to_scaled_axis() / time,
            joints: to.joints.iter().zip(&from.joints).map(|(to, from)| (to - from) / time).collect(),
        }
    }

    fn mean(&self, other: &Self) -> Self {
        Self {
            linear: (self.linear + other.linear) * 0.5,
            angular: (self.angular + other.angular) * 0.5,
            joints: self.joints.iter().zip(&other.joints).map(|(a, b)| (a + b) * 0.5).collect(),
        }
    }

    /// Returns the sum of the squares of differences.
    fn squares(&self, other: &Self) -> f64 {
        let joints = self.joints.iter().zip(&other.joints).map(|(a, b)| (a - b).powi(2));
        let root =
            (self.linear - other.linear).length_squared() + (self.angular - other.angular).length_squared();
        joints.sum::<f64>() + root
    }

    /// Returns the largest difference, m/s or rad/s.
    fn off(&self, other: &Self) -> f64 {
        let joints = self.joints.iter().zip(&other.joints).map(|(a, b)| (a - b).abs());
        let root = (self.linear - other.linear).length().max((self.angular - other.angular).length());
        joints.fold(root, f64::max)
    }
}

/// Featherstone (2008), table 5.1, without accelerations of joints.
fn motions(model: &RobotModel, place: &Place, velocities: &Velocities) -> Vec<Motion> {
    let angular = place.root.rotation * velocities.angular;
    // A root's angular velocity stays as it is in its own axes, and so in the world's.
    let root = Motion { pose: place.root, linear: velocities.linear, angular, ..Motion::default() };
    let mut motions = vec![root; model.links.len()];
    for ((joint, at), rate) in model.joints.iter().zip(&place.joints).zip(&velocities.joints) {
        let parent = motions[joint.parent];
        let frame = parent.pose * joint.parent_from_joint;
        let way = joint.axis.normalize();
        let axis = frame.rotation * way;
        let turns = joint.kind == JointKind::Continuous;
        let pose = match turns {
            true => frame * DPose3::from_rotation(DQuat::from_axis_angle(way, *at)),
            false => frame * DPose3::from_translation(way * *at),
        };
        let (arm, w) = (pose.translation - parent.pose.translation, parent.angular);
        let (slide, turn) = if turns { (DVec3::ZERO, axis * *rate) } else { (axis * *rate, DVec3::ZERO) };
        motions[joint.child] = Motion {
            pose,
            linear: parent.linear + w.cross(arm) + slide,
            angular: w + turn,
            acceleration: parent.acceleration
                + parent.angular_acceleration.cross(arm)
                + w.cross(w.cross(arm) + 2.0 * slide),
            angular_acceleration: parent.angular_acceleration + w.cross(turn),
        };
    }
    motions
}

/// Returns the velocity and the acceleration of a link's centre of mass.
fn center(inertial: &Inertial, at: &Motion) -> (DVec3, DVec3) {
    let (arm, w) = (at.pose.rotation * inertial.center_of_mass, at.angular);
    let acceleration = at.acceleration + at.angular_acceleration.cross(arm) + w.cross(w.cross(arm));
    (at.linear + w.cross(arm), acceleration)
}

/// Returns the momenta and energies of a robot with a pose and velocities.
fn sums(model: &RobotModel, place: &Place, velocities: &Velocities, gravity: f64) -> Sums {
    let mut sums = Sums::default();
    for (link, at) in model.links.iter().zip(motions(model, place, velocities)) {
        let Inertial { mass, inertia, .. } = link.inertial;
        let (velocity, _) = center(&link.inertial, &at);
        let own = at.pose.rotation.inverse() * at.angular;
        let kinetic = 0.5 * (mass * velocity.length_squared() + own.dot(inertia * own));
        let height = at.pose.transform_point(link.inertial.center_of_mass).z;
        sums.kinetic += kinetic;
        sums.energy += kinetic + mass * gravity * height;
        sums.momentum += mass * velocity;
    }
    sums
}

/// Returns the effect of weight and velocity terms, at the velocities `read`, per second. They act on energy
/// while the tree moves at the velocities `moves`, and on momentum.
fn terms(
    model: &RobotModel,
    place: &Place,
    moves: &Velocities,
    read: &Velocities,
    gravity: f64,
) -> (f64, DVec3) {
    let (moves, read) = (motions(model, place, moves), motions(model, place, read));
    let (mut power, mut force) = (0.0, DVec3::ZERO);
    for ((link, moves), read) in model.links.iter().zip(moves).zip(read) {
        let Inertial { mass, inertia, .. } = link.inertial;
        let (velocity, _) = center(&link.inertial, &moves);
        let (_, acceleration) = center(&link.inertial, &read);
        let turn = DMat3::from_quat(read.pose.rotation);
        let inertia = turn * inertia * turn.transpose();
        let torque = inertia * read.angular_acceleration + read.angular.cross(inertia * read.angular);
        let own = mass * (acceleration + DVec3::Z * gravity);
        power += velocity.dot(own) + moves.angular.dot(torque);
        force += own;
    }
    (power, force)
}

/// Returns the change of energy and momentum in the middle of steps by one step, without the work of joints
/// and contacts. The step begins at a place that the tree reached with the velocities `u[0]`, which it had
/// for the time `since`, and leaves with `u[1]`. Its velocity terms are the mean of those at the velocities
/// `read`. The change is of third order in the step if these are the mean of the two.
fn left_over(
    model: &RobotModel,
    place: &Place,
    (u, read): ([&Velocities; 2], &[&Velocities]),
    since: f64,
    (gravity, h): (f64, f64),
) -> (f64, DVec3) {
    let at =
        |velocities: &Velocities, time: f64| sums(model, &place.after(velocities, time), velocities, gravity);
    let [before, after] = u;
    let (first, last) = (at(before, -since), at(after, 0.5 * h));
    let (arrives, leaves) = (at(before, 0.0), at(after, 0.0));
    let moves = before.mean(after);
    let (power, force) = match read {
        [read] => terms(model, place, &moves, read, gravity),
        [first, second] => {
            let (a, b) =
                (terms(model, place, &moves, first, gravity), terms(model, place, &moves, second, gravity));
            (0.5 * (a.0 + b.0), 0.5 * (a.1 + b.1))
        }
        _ => (0.0, DVec3::ZERO),
    };
    let energy = last.energy - leaves.energy + arrives.energy - first.energy - h * power;
    (energy, last.momentum - leaves.momentum + arrives.momentum - first.momentum - h * force)
}

/// The first robot of a world, followed from step to step.
pub(crate) struct Followed {
    place: Place,
    reported: Velocities,
    /// The velocities with which it arrived there.
    moves: Velocities,
    /// Time for which it had these: half of a step, or zero if they were given.
    since: f64,
    is_smooth: bool,
}

/// Result of a step: energy and momentum in the middle of it, and the [remainder](left_over). In smooth steps
/// after smooth steps, without fast rotation, the remainder counts as zero.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Followup {
    pub(crate) middle: Sums,
    pub(crate) energy: f64,
    pub(crate) momentum: DVec3,
}

impl Followed {
    pub(crate) fn new(seen: &PublishedState) -> Self {
        let reported = Velocities::reported(seen);
        Self { place: Place::of(seen), moves: reported.clone(), reported, since: 0.0, is_smooth: true }
    }

    /// Call after a step. Positions give the velocities in the middle of it, except if an overlap was
    /// corrected with them. Then the reported velocities are used, which apply after each step that is not
    /// smooth.
    pub(crate) fn step(
        &mut self,
        seen: &PublishedState,
        is_corrected: bool,
        (gravity, h): (f64, f64),
    ) -> Followup {
        let model = &seen.world.entities[0].model;
        let (place, reported) = (Place::of(seen), Velocities::reported(seen));
        let moves = if is_corrected { reported.clone() } else { Velocities::between(&self.place, &place, h) };
        let is_smooth = moves.off(&reported) > TOLERANCE;
        let middle = sums(model, &place.after(&moves, -0.5 * h), &moves, gravity);
        let (mut energy, mut momentum) = (0.0, DVec3::ZERO);
        let is_fast = |at: &Motion| at.angular.length() * h > FAST;
        let is_fast = motions(model, &self.place, &self.reported).iter().any(is_fast);
        let counts = is_fast || !is_smooth || !self.is_smooth;
        if counts {
            let mean = self.moves.mean(&moves);
            // A floating tree without contacts takes the mean of the terms if its motion is disturbed.
            let is_disturbed = seen.contacts.is_empty()
                && !(is_fast && self.is_smooth)
                && self.reported.squares(&mean) > 0.0625 * moves.squares(&self.moves) + 1e-12;
            let read: &[&Velocities] = match (is_fast, is_disturbed) {
                (_, true) => &[&self.moves, &moves],
                (true, false) => &[&mean],
                (false, false) => &[&self.reported],
            };
            let velocities = ([&self.moves, &moves], read);
            (energy, momentum) = left_over(model, &self.place, velocities, self.since, (gravity, h));
        }
        *self = Self { place, reported, moves, since: 0.5 * h, is_smooth };
        Followup { middle, energy, momentum }
    }
}
