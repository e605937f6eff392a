//! Islands: robots that touch or are constrained, solved together. The rows of their joints, contacts and
//! link constraints act on all their velocities.

mod dragging;
mod impulses;
mod links;
mod momenta;
mod momentum_sweeps;
mod projection;
mod residual;
mod rows;
mod split_velocities;
mod stiffening;
mod unsound;

use glamx::{DPose3, DVec3};

use super::articulation::{Articulation, EXACT_ROUNDS, MAX_ROUNDS};
use super::bullet::BulletContacts;
use super::constraint::contact::{Contact, ContactRows};
use super::constraint::link_constraint::LinkConstraint;
use super::constraint::link_rows::LinkRows;
use super::constraint::momentum::Momentum;
use super::constraint::turning::TurningRows;
use super::constraint::{PlacedBody, Turning};
use super::direct::Direct;
use super::member::Member;
use super::scratch::MultiRhs;
use super::single_bodies::SingleBodies;
use super::symmetric::Symmetric;
pub(in crate::dynamics) use impulses::{DIRECT_AT, MAX_SWEEPS, SETTLED, SETTLED_ROUNDS, UNCHANGED};
pub use residual::SolverChoice;
pub(in crate::dynamics) use rows::{MANY, find_spans};
use split_velocities::Split;

/// Sweeps of position correction per step; later steps correct the rest.
pub(in crate::dynamics) const CORRECTION_SWEEPS: usize = 5;

/// Largest change of a velocity by position correction, m/s or rad/s.
pub(in crate::dynamics) const MAX_SPLIT_VELOCITY: f64 = 3.0;

/// Result of an island's step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IslandOutcome {
    /// All robots have advanced.
    Solved,
    /// The solution of several robots is not usable. The robots that caused it have new velocities that are
    /// not finite. The others can be solved without them, after a restart.
    Unusable,
    /// The caller interrupted the step. The robots are mid-step.
    Interrupted,
}

/// Memory of the solver, reused from step to step.
#[derive(Debug, Default)]
pub struct Island {
    members: Vec<Member>,
    /// Pose of each member that is one free body which nothing stiffens.
    placed: Vec<Option<PlacedBody>>,
    /// Rotation of each of these before the step.
    turns: Vec<Turning>,
    rows: Vec<ContactRows>,
    /// Rows of contacts with friction against rolling or spinning.
    turning: Vec<TurningRows>,
    /// Rows of constraints between links.
    links: Vec<LinkRows>,
    /// Blocks of all sides of all contacts and constraints.
    blocks: Vec<f64>,
    /// Velocities of all members, concatenated.
    velocities: Vec<f64>,
    /// Velocities before the step.
    before: Vec<f64>,
    /// Velocities without impulses.
    free: Vec<f64>,
    /// A response before it is stored.
    scratch: Vec<f64>,
    /// Right-hand sides, one for each body of the largest member. All robots share them, so they stay in the
    /// cache.
    rhs: Vec<MultiRhs<4>>,
    /// Bodies with many contacts, in order.
    bases: Vec<Basis>,
    /// Responses to six wrenches, for each basis.
    basis_responses: Vec<f64>,
    /// Member and body of each side of each contact.
    touched: Vec<(usize, usize)>,
    direct: Direct,
    single_bodies: SingleBodies,
    momentum: Momentum,
    /// Impulses of each contact before the last sweep, if sweeps use momentum.
    impulses_before: Vec<[f64; 3]>,
    /// Constraints that correct positions.
    split: Split,
    /// Whether all initial impulses were the least possible in the previous step and the final ones still
    /// are.
    was_least: bool,
    /// Resistance to turning of each member in addition to its own moment, world.
    stiffening: Vec<Symmetric>,
    /// Resistance to turning that constraints give each member, times the square of the step.
    stiffness: Vec<Symmetric>,
    /// Whether some contact may rebound.
    bounces: bool,
    /// Solver that computes the impulses.
    choice: SolverChoice,
    is_measured: bool,
    /// See [`Island::take_residual`].
    residual: Option<f64>,
}

/// Location of the responses to a body's six wrenches.
#[derive(Clone, Copy, Debug)]
struct Basis {
    member: usize,
    body: usize,
    at: usize,
}

/// Constraint between links that acts in this step.
#[derive(Debug)]
pub struct ActiveConstraint<'a> {
    /// The constraint and its stored state.
    pub constraint: &'a mut LinkConstraint,
    /// Frames of the ends that cannot move, world.
    pub fixed: [DPose3; 2],
    /// Sort key of the owner.
    pub order: (usize, usize),
}

impl Island {
    /// Solves and advances `robots`, whose ascending indices in the world are `members`. They have been
    /// [started](Articulation::start), touch at `contacts` and are held together by `constraints`. These
    /// constraints act on no other movable robot.
    ///
    /// Erleben, "Stable, robust, and versatile multibody dynamics animation" (2005), chapter 5, with the
    /// tangents of a contact as a block. Position correction uses split impulses: separate velocities, which
    /// are dropped after integration and so add no energy. Source: Guendelman, Bridson and Fedkiw, "Nonconvex
    /// rigid bodies with stacking" (2003).
    ///
    /// With `bullet`, contacts follow [its law](BulletContacts) instead.
    ///
    /// Calls `interrupt` before each contact is measured and before each sweep.
    pub fn solve<R: AsMut<Articulation>>(
        &mut self,
        (robots, members): (&mut [R], &[usize]),
        contacts: &mut [&mut Contact],
        constraints: &mut [ActiveConstraint<'_>],
        (gravity, h): (DVec3, f64),
        bullet: Option<BulletContacts>,
        interrupt: &dyn Fn() -> bool,
    ) -> IslandOutcome {
        self.list(robots, members, constraints.is_empty());
        let at = self.make_rows(robots, contacts);
        self.make_links(robots, constraints, (h, at));
        self.stiffening.clear();
        self.find_stiffening(robots, h);
        for round in 0..MAX_ROUNDS {
            self.apply_stiffening(robots);
            self.gather(robots);
            self.brake_swinging(robots);
            if !(self.measure(robots, contacts, interrupt) && self.measure_links(robots, interrupt)) {
                return IslandOutcome::Interrupted;
            }
            if round == 0 {
                match bullet {
                    None => self.set_targets(robots, contacts, gravity, h),
                    Some(law) => self.set_bullets_targets(contacts, law, h),
                }
            } else {
                let turning = self.turning.iter_mut().map(|turning| &mut turning.rows);
                let links = self.links.iter_mut().map(|link| &mut link.rows);
                for rows in self.rows.iter_mut().chain(turning).chain(links) {
                    rows.unloaded = rows.velocities(&self.blocks, &self.velocities);
                }
            }
            self.direct.begin();
            self.single_bodies.begin();
            self.start(robots);
            if !self.find_impulses(robots, interrupt) {
                return IslandOutcome::Interrupted;
            }
            if self.postpone_hits(contacts, gravity.length(), h) && !self.find_impulses(robots, interrupt) {
                return IslandOutcome::Interrupted;
            }
            if !self.stop_idle_pulls(robots, constraints, h, interrupt) {
                return IslandOutcome::Interrupted;
            }
            if !self.project(robots, constraints, h, interrupt) {
                return IslandOutcome::Interrupted;
            }
            if !self.is_usable() {
                self.leave_out_unsound(robots, gravity, h);
                return IslandOutcome::Unusable;
            }
            let mut changed = self.find_stiffening(robots, h) && round + 1 < EXACT_ROUNDS;
            for (robot, member) in robots.iter_mut().zip(&self.members).filter(|(_, of)| !of.is_seen_last) {
                let body = robot.as_mut();
                body.new_velocities_mut().copy_from_slice(&self.velocities[member.velocities()]);
                if body.saturate(h, round) {
                    changed = true;
                }
            }
            if !changed {
                break;
            }
            robots.iter_mut().for_each(|robot| robot.as_mut().predict(gravity, h));
        }
        self.measure_residual();
        let Some(has_split) = self.update_split_velocities(robots, constraints, h, interrupt) else {
            return IslandOutcome::Interrupted;
        };
        for rows in &self.rows {
            let contact = &mut *contacts[rows.contact];
            (contact.impulse, contact.is_least) = (rows.world_impulse(), self.was_least);
            contact.turning_impulse = DVec3::ZERO;
            for side in rows.sides.iter().filter(|side| side.len > 0 && rows.impulse != [0.0; 3]) {
                self.members[side.member].is_touched = true;
            }
        }
        for turning in &self.turning {
            contacts[turning.rows.contact].turning_impulse = turning.rows.world_impulse();
        }
        for (robot, member) in robots.iter_mut().zip(&self.members).filter(|(_, of)| !of.is_seen_last) {
            let body = robot.as_mut();
            if member.is_touched {
                body.note_contact();
            }
            body.store_impulses();
        }
        self.keep_links(robots, constraints);
        if has_split {
            let split = &self.split.velocities;
            self.velocities.iter_mut().zip(split).for_each(|(velocity, split)| *velocity += split);
            self.store_predicted_errors(robots, constraints, h);
            self.finish_with_split_velocities(robots, gravity, h);
            return IslandOutcome::Solved;
        }
        let is_corrected = self.correct_positions();
        self.store_predicted_errors(robots, constraints, h);
        for (robot, member) in robots.iter_mut().zip(&self.members) {
            let (body, own) = (robot.as_mut(), member.velocities());
            if member.is_seen_last {
                body.prefetch();
                let new = if is_corrected { &self.before } else { &self.velocities };
                body.new_velocities_mut().copy_from_slice(&new[own.clone()]);
                if member.is_touched {
                    body.note_contact();
                }
            }
            if is_corrected {
                body.finish_corrected(&self.velocities[own], gravity, h);
            } else {
                body.finish(gravity, h);
            }
        }
        IslandOutcome::Solved
    }

    /// Adds position correction to the velocities, which then integrate positions; the new velocities are
    /// moved to `before`. Returns false if there is no correction.
    fn correct_positions(&mut self) -> bool {
        if self.rows.iter().all(|rows| rows.correction_velocity == 0.0 || !rows.acts()) {
            return false;
        }
        let Self { rows, blocks, velocities, single_bodies, before: split_velocities, .. } = self;
        split_velocities.clear();
        split_velocities.resize(velocities.len(), 0.0);
        if !single_bodies.correct(rows, split_velocities, CORRECTION_SWEEPS) {
            for _ in 0..CORRECTION_SWEEPS {
                for rows in rows.iter_mut().filter(|rows| rows.acts()) {
                    rows.correct_position(blocks, split_velocities);
                }
            }
        }
        // A correction near an axis would turn a joint faster the shorter its arm is.
        let largest = split_velocities.iter().fold(0.0f64, |largest, velocity| largest.max(velocity.abs()));
        let scale = if largest > MAX_SPLIT_VELOCITY { MAX_SPLIT_VELOCITY / largest } else { 1.0 };
        for (velocity, split) in velocities.iter_mut().zip(split_velocities) {
            (*velocity, *split) = (*velocity + scale * *split, *velocity);
        }
        true
    }

    /// Lists robots as members, either including those that constraints hold, or those that `only_touch`.
    fn list<R: AsMut<Articulation>>(&mut self, robots: &mut [R], members: &[usize], only_touch: bool) {
        self.members.clear();
        let (mut first, mut most_bodies) = (0, 0);
        for (&number, robot) in members.iter().zip(robots) {
            let body = robot.as_mut();
            let (len, bodies) = (body.velocities().len(), body.tree().bodies.len());
            let is_seen_last = only_touch && bodies == 1 && !body.tree().fixed_base;
            self.members.push(Member {
                robot: number,
                first,
                len,
                is_one_body: bodies == 1,
                is_seen_last,
                is_touched: false,
            });
            first += len;
            most_bodies = most_bodies.max(bodies);
        }
        if self.rhs.len() < most_bodies {
            self.rhs.resize(most_bodies, MultiRhs::default());
        }
    }

    fn gather<R: AsMut<Articulation>>(&mut self, robots: &mut [R]) {
        self.velocities.clear();
        self.placed.clear();
        for robot in robots {
            let body = robot.as_mut();
            self.velocities.extend_from_slice(body.new_velocities_mut());
            self.placed.push(body.placed_body());
        }
    }

    /// Returns the index of a robot among the members.
    fn member(&self, robot: usize) -> Option<usize> {
        // If all robots between the first and the last are members, as in a heap, the index is known at once.
        let likely = robot.checked_sub(self.members.first()?.robot)?;
        if self.members.get(likely).is_some_and(|member| member.robot == robot) {
            return Some(likely);
        }
        self.members.binary_search_by_key(&robot, |member| member.robot).ok()
    }
}
