//! Robots that touch or are constrained, solved together: the rows of their joints, of their contacts and of the constraints between
//! their links, on all their velocities.

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

use std::ops::Range;

use glamx::{DPose3, DVec3};

use super::articulation::{Articulation, EXACT_ROUNDS, MAX_ROUNDS};
use super::constraint::contact::{Contact, ContactRows};
use super::constraint::direct::Direct;
use super::constraint::link_constraint::LinkConstraint;
use super::constraint::link_rows::LinkRows;
use super::constraint::momentum::Momentum;
use super::constraint::turning::TurningRows;
use super::constraint::{PlacedBody, Turning};
use super::lanes::SingleBodies;
use super::scratch::MultiRhs;
use super::symmetric::Symmetric;
pub(in crate::dynamics) use impulses::{DIRECT_AT, MAX_SWEEPS, SETTLED, SETTLED_ROUNDS, UNCHANGED};
pub use residual::SolverChoice;
pub(in crate::dynamics) use rows::{MANY, find_spans};
use split_velocities::Split;

/// Sweeps of position correction; the rest is left to the next step.
pub(in crate::dynamics) const CORRECTION_SWEEPS: usize = 5;

/// Position correction changes no velocity by more than this, m/s or rad/s.
pub(in crate::dynamics) const MAX_SPLIT_VELOCITY: f64 = 3.0;

/// What became of a step of an island.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IslandOutcome {
    /// All have moved on.
    Solved,
    /// What was found of several robots cannot be. Those that this is due to have new velocities that are not finite, and the others can be
    /// solved without these: they are started again.
    Unusable,
    /// As the caller wanted. The robots are in the midst of a step.
    Interrupted,
}

/// The memory that solving needs, kept from step to step.
#[derive(Debug, Default)]
pub struct Island {
    members: Vec<Member>,
    /// Of each member, where it is, if it is one free body that nothing stiffens.
    placed: Vec<Option<PlacedBody>>,
    /// How each of these turned before the step.
    turns: Vec<Turning>,
    rows: Vec<ContactRows>,
    /// Of those contacts that have friction against rolling or spinning.
    turning: Vec<TurningRows>,
    /// Of constraints between links.
    links: Vec<LinkRows>,
    /// Of all sides of all contacts and constraints.
    blocks: Vec<f64>,
    /// Of all members, one after the other.
    velocities: Vec<f64>,
    /// The velocities before the step.
    before: Vec<f64>,
    /// The velocities without impulses.
    free: Vec<f64>,
    /// A response, before it is filed.
    scratch: Vec<f64>,
    /// One for each body of the largest member: of all robots the same, so that it is in the cache.
    rhs: Vec<MultiRhs<4>>,
    /// Bodies with many contacts, in order.
    bases: Vec<Basis>,
    /// Of each basis the responses to six wrenches.
    basis_responses: Vec<f64>,
    /// Member and body of each side of each contact.
    touched: Vec<(usize, usize)>,
    direct: Direct,
    single_bodies: SingleBodies,
    momentum: Momentum,
    /// Of each contact before the last sweep, where there is momentum.
    impulses_before: Vec<[f64; 3]>,
    /// Of constraints that put positions right.
    split: Split,
    /// All impulses that it starts from are the least of the step before, and it is so with those that it ends with.
    was_least: bool,
    /// Of each member, what it resists turning with beside its own moment, world.
    stiffening: Vec<Symmetric>,
    /// Of each member, what constraints have it resist turning by, times the square of the step.
    stiffness: Vec<Symmetric>,
    /// Some contact may rebound.
    bounces: bool,
    /// How impulses are found.
    choice: SolverChoice,
    is_measured: bool,
    /// See [`Island::take_residual`].
    residual: Option<f64>,
}

/// Where the responses to a body's six wrenches are.
#[derive(Clone, Copy, Debug)]
struct Basis {
    member: usize,
    body: usize,
    at: usize,
}

/// A constraint between links that acts in this step.
#[derive(Debug)]
pub struct ActiveConstraint<'a> {
    /// What it is, and what is kept of it.
    pub constraint: &'a mut LinkConstraint,
    /// Where the frames of its ends are, of those that cannot move; world.
    pub fixed: [DPose3; 2],
    /// What its owner sorts them by.
    pub order: (usize, usize),
}

/// A robot of an island.
#[derive(Clone, Copy, Debug)]
pub struct Member {
    /// Its index in the world.
    pub robot: usize,
    /// Where its velocities begin among those of the island.
    pub first: usize,
    /// How many it has.
    pub len: usize,
    /// It has one body.
    pub is_one_body: bool,
    /// It is a free body that only touches: nothing of it is looked at again before positions follow velocities. To look would fetch
    /// each of a heap from far away.
    is_seen_last: bool,
    /// A contact has given it an impulse in this step.
    is_touched: bool,
}

impl Member {
    /// Where its velocities are among those of the island.
    fn velocities(&self) -> Range<usize> {
        self.first..self.first + self.len
    }
}

impl Island {
    /// Solves and moves on `robots`, whose numbers in the world are `members`, in order. They have been
    /// [started](Articulation::start), touch at `contacts` and are held together by `constraints`, which act on no other robot that
    /// can move.
    ///
    /// Erleben, "Stable, robust, and versatile multibody dynamics animation" (2005), chapter
    /// 5, with the tangents of a contact as a block. Position correction uses
    /// split impulses: velocities of its own, which are dropped after integration and so add no energy
    /// (as in Guendelman, Bridson and Fedkiw, "Nonconvex rigid bodies with stacking" (2003)).
    ///
    /// `interrupt` is asked before each contact is measured and each sweep.
    pub fn solve<R: AsMut<Articulation>>(
        &mut self,
        (robots, members): (&mut [R], &[usize]),
        contacts: &mut [&mut Contact],
        constraints: &mut [ActiveConstraint<'_>],
        (gravity, h): (DVec3, f64),
        interrupt: &dyn Fn() -> bool,
    ) -> IslandOutcome {
        self.list(robots, members, constraints.is_empty());
        let at = self.make_rows(robots, contacts);
        self.make_links(robots, constraints, (h, at));
        self.stiffening.clear();
        self.find_stiffening(robots, h);
        for round in 0..MAX_ROUNDS {
            self.stiffen(robots);
            self.gather(robots);
            self.brake(robots);
            if !(self.measure(robots, contacts, interrupt) && self.measure_links(robots, interrupt)) {
                return IslandOutcome::Interrupted;
            }
            if round == 0 {
                self.aim(robots, contacts, gravity, h);
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
            body.keep_rows();
        }
        self.keep_links(robots, constraints);
        if has_split {
            let split = &self.split.velocities;
            self.velocities.iter_mut().zip(split).for_each(|(velocity, split)| *velocity += split);
            self.foresee(robots, constraints, h);
            self.finish_with_split_velocities(robots, gravity, h);
            return IslandOutcome::Solved;
        }
        let is_corrected = self.correct_positions();
        self.foresee(robots, constraints, h);
        for (robot, member) in robots.iter_mut().zip(&self.members) {
            let (body, own) = (robot.as_mut(), member.velocities());
            if member.is_seen_last {
                body.fetch();
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

    /// Adds position correction to the velocities, with which positions are integrated then; the new ones become those `before`. False
    /// if there is none.
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
        // A correction near an axis would turn a joint the faster, the shorter its arm is.
        let largest = split_velocities.iter().fold(0.0f64, |largest, velocity| largest.max(velocity.abs()));
        let scale = if largest > MAX_SPLIT_VELOCITY { MAX_SPLIT_VELOCITY / largest } else { 1.0 };
        for (velocity, split) in velocities.iter_mut().zip(split_velocities) {
            (*velocity, *split) = (*velocity + scale * *split, *velocity);
        }
        true
    }

    /// Lists robots, which constraints between links hold too, or which `only_touch`.
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

    /// The index of a robot among the members.
    fn member(&self, robot: usize) -> Option<usize> {
        // Where all robots between the first and the last are members, as in a heap, it is known at once.
        let likely = robot.checked_sub(self.members.first()?.robot)?;
        if self.members.get(likely).is_some_and(|member| member.robot == robot) {
            return Some(likely);
        }
        self.members.binary_search_by_key(&robot, |member| member.robot).ok()
    }
}
