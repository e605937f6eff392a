//! Rows of constraints between links: where they act, their targets, and their stored state.

use glamx::{DPose3, DVec3};

use super::dragging::UNREACHED;
use super::rows::{Measure, find_spans};
use super::{ActiveConstraint, Island};
use crate::dynamics::articulation::Articulation;
use crate::dynamics::constraint::ERROR_REDUCTION;
use crate::dynamics::constraint::contact::ContactRows;
use crate::dynamics::constraint::link_constraint::{ConstraintEnd, ConstraintKind, LinkConstraint};
use crate::dynamics::constraint::link_rows::{
    Aim, FAR, GearRow, LinkRows, LinkState, MAX_CORRECTION, Motion,
};
use crate::dynamics::constraint::side::Side;
use crate::dynamics::member::Member;
use crate::dynamics::tree::JointType;

/// Largest error, m and rad, at which a constraint drags its links. It applies after its target or one of its
/// links was moved other than by a step. Links with a larger error are moved there in positions.
const DRAGGED: [f64; 2] = [0.05, 0.15];

/// Member and body of an end, and the pose of its frame, world.
type End = ((usize, Option<usize>), DPose3);

impl Island {
    /// Makes one or two blocks for each constraint, with their targets in a step of `h`; their numbers start
    /// at `at`.
    pub(super) fn make_links<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        constraints: &[ActiveConstraint<'_>],
        (h, at): (f64, usize),
    ) {
        self.links.clear();
        for (index, ActiveConstraint { constraint, fixed, .. }) in constraints.iter().enumerate() {
            self.was_least &= constraint.is_least;
            let definition = &constraint.definition;
            let ends = [0, 1].map(|i| self.end(robots, definition.ends[i], fixed[i]));
            let mut idle = false;
            let is_gear = matches!(definition.kind, ConstraintKind::Gear { .. });
            let aims = (!is_gear).then(|| constraint.aims(ends.map(|end| end.1)));
            // Position and orientation together: if one is corrected in positions, the other does not drag.
            let drags = constraint.is_dragged
                && aims.iter().flatten().zip(DRAGGED).all(|(aim, most)| aim.error() <= most);
            let mut add = |turns: bool, Aim { axes, errors }, gear: Option<GearRow>| {
                let kept = constraint.impulses[usize::from(turns)];
                let most = if turns { definition.max_torque } else { definition.max_force } * h;
                let rows = ContactRows { contact: index, axes, impulse: kept, ..ContactRows::default() };
                let mut link = LinkRows {
                    rows,
                    ends: ends.map(|end| end.0),
                    point: ends[1].1.translation,
                    turns,
                    gear,
                    errors,
                    most,
                    is_one_sided: matches!(definition.kind, ConstraintKind::Distance { is_rope: true, .. }),
                    h,
                    ..LinkRows::default()
                };
                (link.rows.impulse, link.state) = link.bounded(kept);
                link.is_dragged = drags && link.is_within(DRAGGED);
                link.is_pulled = (link.is_dragged || link.most.is_finite()) && !link.is_near();
                // A constraint that did not reach its target does not try again.
                let is_idle = is_idle(constraint, &link);
                idle |= is_idle;
                link.is_pulled &= !link.is_slack() && !is_idle;
                let is_smooth = !link.is_one_sided || kept[0] > 0.0;
                let motion = constraint.motion.filter(|_| is_smooth);
                link.predict_drift(motion.map(|motion| motion[usize::from(turns)]));
                self.links.push(link);
            };
            if let ConstraintKind::Gear { ratio, offset } = definition.kind {
                let Some((gear, axis, error)) = gear(robots, ends, ratio, offset) else { continue };
                add(
                    false,
                    Aim { axes: [axis, DVec3::ZERO, DVec3::ZERO], errors: [error, 0.0, 0.0] },
                    Some(gear),
                );
                continue;
            }
            for (turns, aim) in [false, true].into_iter().zip(aims.into_iter().flatten()) {
                if aim.axes != [DVec3::ZERO; 3] {
                    add(turns, aim, None);
                }
            }
            if idle {
                let (ends, point) = (ends.map(|end| end.0), ends[1].1.translation);
                self.links.extend([false, true].map(|turns| brake(index, ends, point, (turns, h))));
            }
        }
        self.lay_out_links(robots, at);
    }

    /// Returns the body and the frame of an end; `fixed` is the pose of its frame if it cannot move.
    fn end<R: AsMut<Articulation>>(
        &self,
        robots: &mut [R],
        ConstraintEnd { link, frame }: ConstraintEnd,
        fixed: DPose3,
    ) -> End {
        let still = ((usize::MAX, None), fixed);
        let Some((robot, link)) = link else { return still };
        let Some(member) = self.member(robot) else { return still };
        let articulation = robots[member].as_mut();
        let at = articulation.tree().links[link];
        let Some(body) = at.body else { return still };
        let pose = articulation.body_motion(body).pose * at.body_from_link * frame;
        ((member, at.body), pose)
    }

    /// Assigns the offset of each block's numbers, starting at `at`.
    fn lay_out_links<R: AsMut<Articulation>>(&mut self, robots: &mut [R], mut at: usize) {
        for link in &mut self.links {
            let own = link.ends[0].0 == link.ends[1].0;
            let mut count = 0;
            for (i, (member, body)) in link.ends.into_iter().enumerate() {
                let Some(body) = body else { continue };
                let Member { first, len, .. } = self.members[member];
                if own && count == 1 {
                    continue;
                }
                let mut side = Side { member, first, len, at, ..Side::default() };
                side = if let Some(GearRow { joints }) = &link.gear {
                    let [a, b] = [joints[0].2, joints[1].2];
                    if own && a != b {
                        side.is_pair = true;
                        side.add_span(a.max(b)..a.max(b) + 1);
                        side.add_span(a.min(b)..a.min(b) + 1);
                    } else {
                        side.add_span(joints[i].2..joints[i].2 + 1);
                    }
                    side
                } else {
                    let bodies = if own { link.ends.map(|end| end.1) } else { [Some(body), None] };
                    find_spans(side, robots[member].as_mut().tree(), bodies)
                };
                link.rows.sides[count] = side;
                at += side.size();
                count += 1;
            }
        }
        if self.blocks.len() < at {
            self.blocks.resize(at, 0.0);
        }
    }

    /// Computes J and M^-1 J' of all blocks. Returns false if interrupted.
    pub(super) fn measure_links<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        interrupt: &dyn Fn() -> bool,
    ) -> bool {
        let Self { links, placed, blocks, scratch, rhs, bases, basis_responses, .. } = self;
        let mut measure = Measure { placed, blocks, scratch, rhs, bases, basis_responses };
        for link in links {
            if interrupt() {
                return false;
            }
            match link.gear {
                Some(gear) => measure.gear(robots, &gear, &mut link.rows),
                None => measure.wrenches(robots, link.ends, link.point, &mut link.rows, link.turns),
            }
            link.measure(measure.blocks);
        }
        true
    }

    /// Stores the results of the step, and notifies robots for their next step.
    pub(super) fn keep_links<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        constraints: &mut [ActiveConstraint<'_>],
    ) {
        for ActiveConstraint { constraint, .. } in &mut *constraints {
            constraint.is_least = self.was_least;
            constraint.is_dragged = false;
            let reading = &mut constraint.reading;
            (reading.last_force, reading.last_torque) = (DVec3::ZERO, DVec3::ZERO);
        }
        // Velocities that were set take half of a kick alike, or a whole one: separate parts would separate
        // the links that the constraint holds together.
        let is_alike = robots.iter_mut().all(|robot| robot.as_mut().takes_half_alike());
        for link in self.links.iter().filter(|link| !link.is_brake) {
            let constraint = &mut *constraints[link.rows.contact].constraint;
            let part = usize::from(link.turns);
            let was_pulling = constraint.impulses[part] != [0.0; 3];
            let was_saturated = link.bounded(constraint.impulses[part]).1 == LinkState::Saturated;
            let is_saturated = link.state == LinkState::Saturated;
            let is_jump = !is_alike || link.meets_jump(&self.blocks, &self.before);
            let is_kink = was_saturated != is_saturated
                || link.is_one_sided && was_pulling != (link.rows.impulse[0] != 0.0);
            for (member, body) in link.ends {
                if body.is_some() {
                    robots[member].as_mut().note_link(is_jump, is_kink);
                }
            }
            let residual = link
                .split_residual
                .unwrap_or_else(|| link.residual(link.rows.velocities(&self.blocks, &self.velocities)));
            constraint.is_dragged |= link.is_dragged && link.is_pulled && !link.is_near();
            let impulse = link.rows.world_impulse();
            constraint.impulses[part] = link.rows.impulse;
            let is_turn = link.turns || link.gear.is_some_and(|gear| turns(robots, gear));
            let reading = &mut constraint.reading;
            let (sum, last) = if is_turn {
                (&mut reading.torque, &mut reading.last_torque)
            } else {
                (&mut reading.force, &mut reading.last_force)
            };
            *sum += impulse;
            *last = impulse;
            reading.point = link.point;
            reading.errors[part] = if link.is_one_sided && link.errors[0] > 0.0 {
                0.0
            } else {
                DVec3::from_array(link.errors).length()
            };
            let is_left = link.state != LinkState::Open;
            reading.residuals[part] = if is_left { DVec3::from_array(residual).length() } else { 0.0 };
            reading.is_saturated |= is_saturated;
        }
    }

    /// Stores the errors that the velocities lead to, which positions then follow. Call it before positions
    /// are updated.
    pub(super) fn store_predicted_errors<R: AsMut<Articulation>>(
        &mut self,
        robots: &mut [R],
        constraints: &mut [ActiveConstraint<'_>],
        h: f64,
    ) {
        if constraints.is_empty() {
            return;
        }
        // Corrections to distant positions turn on a curve, which is not part of the motion.
        let is_known = !self.links.iter().any(LinkRows::is_put_far)
            && !robots.iter_mut().any(|robot| robot.as_mut().halves_its_kick());
        for of in &mut *constraints {
            of.constraint.motion = is_known.then_some([Motion { predicted: [0.0; 3], bent: [0.0; 3] }; 2]);
        }
        for link in self.links.iter().filter(|link| is_known && !link.is_brake) {
            let velocities = link.rows.velocities(&self.blocks, &self.velocities);
            if let Some(motion) = &mut constraints[link.rows.contact].constraint.motion {
                let predicted = [0, 1, 2].map(|k| link.errors[k] + h * velocities[k]);
                motion[usize::from(link.turns)] = Motion { predicted, bent: link.bent };
            }
        }
    }
}

impl Measure<'_> {
    /// Writes J and M^-1 J' of two joints, as the first row.
    fn gear<R: AsMut<Articulation>>(&mut self, robots: &mut [R], gear: &GearRow, rows: &mut ContactRows) {
        let own = gear.joints[0].0 == gear.joints[1].0;
        for side in rows.sides.iter().filter(|side| side.len > 0) {
            self.blocks[side.at..side.at + side.size()].fill(0.0);
        }
        for (i, (member, body, velocity, factor)) in gear.joints.into_iter().enumerate() {
            let side = rows.sides[if own { 0 } else { i }];
            let (jacobian, responses) =
                self.blocks[side.at..side.at + side.size()].split_at_mut(3 * side.columns());
            if let Some([column, ..]) = side.columns_of(velocity) {
                jacobian[column] += factor;
            }
            let response = &mut self.scratch[..side.len];
            robots[member].as_mut().joint_response((body, factor), response);
            responses[..side.len].iter_mut().zip(&*response).for_each(|(sum, response)| *sum += response);
        }
    }
}

/// Returns the row of a gear, the axis of the second joint, world, and the error.
fn gear<R: AsMut<Articulation>>(
    robots: &mut [R],
    ends: [End; 2],
    ratio: f64,
    offset: f64,
) -> Option<(GearRow, DVec3, f64)> {
    let joint = |robots: &mut [R], end: End| {
        let (member, body) = end.0;
        let body = body?;
        let articulation = robots[member].as_mut();
        let own = &articulation.tree().bodies[body];
        if matches!(own.joint_type, JointType::Free { .. } | JointType::Spherical { .. }) {
            return None;
        }
        let (velocity, position) = (own.velocity, own.position);
        let axis = articulation.body_motion(body).pose.rotation * DVec3::Z;
        Some((member, body, velocity, articulation.positions()[position], axis))
    };
    let (first, second) = (joint(robots, ends[0])?, joint(robots, ends[1])?);
    let joints = [(first.0, first.1, first.2, -ratio), (second.0, second.1, second.2, 1.0)];
    Some((GearRow { joints }, second.4, second.3 - ratio * first.3 - offset))
}

/// Returns a brake for the relative motion of the two ends of the constraint of this index, in steps of `h`.
/// It brakes all of their turning, or all of the motion of a point.
fn brake(index: usize, ends: [(usize, Option<usize>); 2], point: DVec3, (turns, h): (bool, f64)) -> LinkRows {
    let axes = [DVec3::X, DVec3::Y, DVec3::Z];
    let rows = ContactRows { contact: index, axes, ..ContactRows::default() };
    LinkRows { rows, ends, point, turns, most: f64::INFINITY, h, is_brake: true, ..LinkRows::default() }
}

/// Returns whether it did not approach its target in the last step, although it was below its maximum force.
fn is_idle(constraint: &LinkConstraint, link: &LinkRows) -> bool {
    let part = usize::from(link.turns);
    let (error, residual) = (constraint.reading.errors[part], constraint.reading.residuals[part]);
    let aim = (ERROR_REDUCTION * error / link.h).min(MAX_CORRECTION[part]);
    error > FAR[part] && residual > UNREACHED * aim && !link.is_at_most(constraint.impulses[part])
}

/// Returns whether the second joint of a gear turns.
fn turns<R: AsMut<Articulation>>(robots: &mut [R], gear: GearRow) -> bool {
    let (member, body, ..) = gear.joints[1];
    robots[member].as_mut().tree().bodies[body].joint_type == JointType::Revolute
}
