//! Contacts that keep driven joints from their targets, from only a published state.

use std::collections::BTreeMap;

use simd_model::RobotModel;
use simd_model::robot::JointKind;

use super::published_state::{ContactReport, EntityLayout, Mode, PublishedState};

/// Link that keeps a driven joint from its target.
#[derive(Clone, Debug, PartialEq)]
pub struct Obstruction {
    /// Joint in its robot's model, by index.
    pub joint: usize,
    /// Obstructed link, which the joint moves, by index.
    pub link: usize,
    /// Obstructing robot, by index in
    /// [`WorldLayout::entities`](super::published_state::WorldLayout::entities). It may be the same robot.
    pub by_robot: usize,
    /// Link of that robot, by index.
    pub by_link: usize,
    /// Effort of the contact forces at the joint, N m or N; it opposes the actuator's.
    pub effort: f64,
}

/// Distance from the target position beyond which a joint does not reach it: rad, m.
const POSITION_TOLERANCE: [f64; 2] = [0.02, 0.005];

/// Speed below which a joint on its way to a target position is obstructed: rad/s, m/s.
const STILL: [f64; 2] = [0.02, 0.005];

/// Relative difference from a target velocity beyond which a joint does not reach it.
const VELOCITY_TOLERANCE: f64 = 0.1;

/// Smallest part of the actuator's effort at which contact forces obstruct a joint.
const LEAST_SHARE: f64 = 0.25;

impl PublishedState {
    /// Returns the joints of the robot at this index that do not reach their targets because of contacts.
    /// Each comes with the link that pushes most against its actuator. Only joints of one axis.
    pub fn obstructions(&self, robot: usize) -> Vec<Obstruction> {
        let Some(entity) = self.world.entities.get(robot) else { return Vec::new() };
        let joints = entity.model.joints.iter().enumerate();
        let late: Vec<(usize, f64)> =
            joints.filter_map(|(joint, _)| Some((joint, self.wanted_effort(entity, joint)?))).collect();
        if late.is_empty() {
            return Vec::new();
        }
        let touches = |contact: &&ContactReport| contact.robots.contains(&robot);
        let contacts: Vec<&ContactReport> = self.contacts.iter().filter(touches).collect();
        if contacts.is_empty() {
            return Vec::new();
        }
        let Some(world_from_link) = self.link_poses(robot) else { return Vec::new() };
        let obstruction = |&(joint, wanted): &(usize, f64)| {
            let model = &entity.model;
            let description = &model.joints[joint];
            let frame = world_from_link.get(description.child)?;
            let axis = frame.rotation * description.axis;
            // By own link, other robot and its link.
            let mut efforts: BTreeMap<(usize, usize, usize), f64> = BTreeMap::new();
            for contact in &contacts {
                let moved = [0, 1].map(|side| {
                    contact.robots[side] == robot && is_below(model, contact.links[side], description.child)
                });
                // A force between two links that both move with the joint does not act on it.
                let (own, other, force) = match moved {
                    [true, false] => (0, 1, -contact.last_force),
                    [false, true] => (1, 0, contact.last_force),
                    _ => continue,
                };
                let effort = match description.kind {
                    JointKind::Prismatic => axis.dot(force),
                    _ => axis.dot((contact.point - frame.translation).cross(force)),
                };
                let key = (contact.links[own], contact.robots[other], contact.links[other]);
                *efforts.entry(key).or_default() += effort;
            }
            let against = |effort: f64| -effort * wanted.signum();
            let ((link, by_robot, by_link), effort) =
                efforts.into_iter().max_by(|a, b| against(a.1).total_cmp(&against(b.1)))?;
            let is_enough = against(effort) > LEAST_SHARE * wanted.abs();
            is_enough.then_some(Obstruction { joint, link, by_robot, by_link, effort })
        };
        late.iter().filter_map(obstruction).collect()
    }

    /// Returns the effort of a joint's actuator if it pushes the joint towards a target that the joint does
    /// not approach.
    fn wanted_effort(&self, entity: &EntityLayout, joint: usize) -> Option<f64> {
        let kind = match entity.model.joints.get(joint)?.kind {
            JointKind::Revolute | JointKind::Continuous => 0,
            JointKind::Prismatic => 1,
            JointKind::Fixed | JointKind::Floating | JointKind::Planar | JointKind::Spherical => return None,
        };
        let position = entity.positions.start + entity.joint_positions.get(joint)?.start;
        let axis = entity.velocities.start + entity.joint_velocities.get(joint)?.start;
        let (target, velocity) = (*self.targets.get(axis)?, *self.velocities.get(axis)?);
        let missing = match self.modes.get(axis)? {
            Mode::Position => {
                let missing = target - self.positions.get(position)?;
                let is_late = missing.abs() > POSITION_TOLERANCE[kind] && velocity.abs() < STILL[kind];
                is_late.then_some(missing)?
            }
            Mode::Velocity => {
                let missing = target - velocity;
                (missing.abs() > VELOCITY_TOLERANCE * target.abs()).then_some(missing)?
            }
            Mode::None | Mode::Passive | Mode::Effort | Mode::Hold => return None,
        };
        let effort = *self.efforts.get(axis)?;
        (effort * missing > 0.0).then_some(effort)
    }
}

impl Obstruction {
    /// Returns the name of the obstructing link, from its robot's model; empty if that robot has only one
    /// link.
    pub fn by_link_name(&self, by: &RobotModel) -> String {
        let link = by.links.get(self.by_link).filter(|_| by.links.len() > 1);
        link.map(|link| link.name.clone()).unwrap_or_default()
    }
}

/// Returns whether a link is another one or belongs to its subtree.
fn is_below(model: &RobotModel, link: usize, root: usize) -> bool {
    // Joint `i` ends at link `i + 1`, after its parent.
    let parent = |link: &usize| model.joints.get(link.checked_sub(1)?).map(|joint| joint.parent);
    std::iter::successors(Some(link), parent).any(|above| above == root)
}
