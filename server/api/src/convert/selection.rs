//! Joints that a client wants to see. They are resolved once, and again only when the robots of the world
//! change.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Arc;

use simd_core::Error;
use simd_core::simulation::command::JointSelection;
use simd_core::simulation::published_state::{EntityLayout, Flags, Mode, PublishedState, WorldLayout};
use simd_proto::v1;

use super::to_proto;
use simd_world::handle::Published;

/// Joints of robots, in an order of the client's choice.
#[derive(Debug, Default)]
pub struct Selection {
    /// Wanted joints; empty means all joints of all robots.
    wanted: Vec<JointSelection>,
    /// Resolution of `wanted` in one world. It holds the layout, so that no other layout can get the same
    /// address.
    found: Option<(Arc<WorldLayout>, Vec<Found>)>,
}

/// A robot and its wanted values.
#[derive(Debug)]
struct Found {
    /// Index in [`WorldLayout::entities`].
    index: usize,
    entity: Arc<EntityLayout>,
    values: Values,
}

/// Wanted values of a robot, by their position in the arrays of a published state.
#[derive(Debug)]
enum Values {
    /// All values of the robot.
    Whole,
    /// Indices of joints, positions and velocities, in the client's order.
    Some { joints: Vec<usize>, positions: Vec<usize>, velocities: Vec<usize> },
}

impl Selection {
    /// Selects joints by name; an empty list means all joints of all robots.
    pub fn new(wanted: Vec<JointSelection>) -> Self {
        Self { wanted, found: None }
    }

    /// Finds the robots and joints of this selection in a world.
    ///
    /// # Errors
    /// `RobotNotFound` and `JointNotFound`.
    pub fn resolve(&mut self, world: &Arc<WorldLayout>) -> Result<(), Error> {
        self.found_in(world).map(|_found| ())
    }

    /// Returns the values of this selection in a state.
    ///
    /// # Errors
    /// `RobotNotFound` and `JointNotFound`, if the state does not have them any more.
    pub fn states(&mut self, published: &Published) -> Result<v1::JointStates, Error> {
        self.changed_states(published, &[])
    }

    /// Like `states`, without the values of unchanged robots. `unchanged` is by index in the world; robots
    /// beyond its end count as changed.
    ///
    /// # Errors
    /// As [`Selection::states`].
    pub fn changed_states(
        &mut self,
        published: &Published,
        unchanged: &[bool],
    ) -> Result<v1::JointStates, Error> {
        let state = &published.state;
        let robots = self
            .found_in(&state.world)?
            .iter()
            .map(|found| match &found.values {
                _ if unchanged.get(found.index).copied().unwrap_or_default() => v1::RobotJointStates {
                    robot: found.entity.name.clone(),
                    layout_version: found.entity.version,
                    unchanged: true,
                    ..Default::default()
                },
                Values::Whole => whole(state, found.index, &found.entity),
                Values::Some { joints, positions, velocities } => v1::RobotJointStates {
                    obstructions: to_proto::joint::obstructions(state, found.index, Some(joints)),
                    ..some(state, &found.entity, positions, velocities)
                },
            })
            .collect();
        Ok(v1::JointStates { stamp: Some(to_proto::stamp::published(published)), robots })
    }

    /// Returns the robots of this selection, in its order, with their indices in the world.
    ///
    /// # Errors
    /// `RobotNotFound` and `JointNotFound`.
    pub fn robots(&mut self, world: &Arc<WorldLayout>) -> Result<Vec<(usize, Arc<EntityLayout>)>, Error> {
        let found = self.found_in(world)?;
        Ok(found.iter().map(|found| (found.index, Arc::clone(&found.entity))).collect())
    }

    /// Returns all joints of the robot at this index of a state, without looking up names; `None` if the
    /// state has fewer robots.
    pub fn whole_robot(published: &Published, index: usize) -> Option<v1::JointStates> {
        let state = &published.state;
        let robots = vec![whole(state, index, state.world.entities.get(index)?)];
        Some(v1::JointStates { stamp: Some(to_proto::stamp::published(published)), robots })
    }

    fn found_in(&mut self, world: &Arc<WorldLayout>) -> Result<&[Found], Error> {
        let known = self.found.take().filter(|(known, _found)| Arc::ptr_eq(known, world));
        let (_world, found) = self.found.insert(match known {
            Some(known) => known,
            None => (Arc::clone(world), find(world, &self.wanted)?),
        });
        Ok(found)
    }
}

fn find(world: &WorldLayout, wanted: &[JointSelection]) -> Result<Vec<Found>, Error> {
    if wanted.is_empty() {
        let whole = |(index, entity): (usize, &Arc<EntityLayout>)| Found {
            index,
            entity: Arc::clone(entity),
            values: Values::Whole,
        };
        return Ok(world.entities.iter().enumerate().map(whole).collect());
    }
    let named = world.entities.iter().enumerate().map(|of| (of.1.name.as_str(), of));
    let by_name: BTreeMap<&str, (usize, &Arc<EntityLayout>)> = named.collect();
    wanted
        .iter()
        .map(|selection| {
            let (index, entity) =
                *by_name.get(selection.robot.as_str()).ok_or_else(|| Error::RobotNotFound {
                    robot: selection.robot.clone(),
                    known: world.entities.iter().map(|entity| entity.name.clone()).collect(),
                })?;
            let values = find_values(entity, &selection.joints)?;
            Ok(Found { index, entity: Arc::clone(entity), values })
        })
        .collect()
}

fn find_values(entity: &EntityLayout, wanted: &[String]) -> Result<Values, Error> {
    if wanted.is_empty() {
        return Ok(Values::Whole);
    }
    let joints = &entity.model.joints;
    let by_name: BTreeMap<&str, usize> =
        joints.iter().enumerate().map(|(index, joint)| (joint.name.as_str(), index)).collect();
    let (mut chosen, mut positions, mut velocities) = (Vec::new(), Vec::new(), Vec::new());
    for name in wanted {
        let index = *by_name.get(name.as_str()).ok_or_else(|| Error::JointNotFound {
            robot: entity.name.clone(),
            joint: name.clone(),
            known: joints.iter().map(|joint| joint.name.clone()).collect(),
        })?;
        chosen.push(index);
        positions.extend(within(&entity.positions, entity.joint_positions.get(index)));
        velocities.extend(within(&entity.velocities, entity.joint_velocities.get(index)));
    }
    Ok(Values::Some { joints: chosen, positions, velocities })
}

/// Returns a joint's range within the values of the world, from its range within its robot.
fn within(robot: &Range<usize>, joint: Option<&Range<usize>>) -> Range<usize> {
    joint.map_or(0..0, |joint| robot.start + joint.start..robot.start + joint.end)
}

fn whole(state: &PublishedState, index: usize, entity: &EntityLayout) -> v1::RobotJointStates {
    let (positions, velocities) = (&entity.positions, &entity.velocities);
    v1::RobotJointStates {
        robot: entity.name.clone(),
        layout_version: entity.version,
        position: slice(&state.positions, positions).to_vec(),
        velocity: slice(&state.velocities, velocities).to_vec(),
        effort: slice(&state.efforts, velocities).to_vec(),
        target: slice(&state.targets, velocities).to_vec(),
        mode: slice(&state.modes, velocities).iter().copied().map(mode).collect(),
        flags: slice(&state.flags, velocities).iter().copied().map(flags).collect(),
        unchanged: false,
        obstructions: to_proto::joint::obstructions(state, index, None),
    }
}

fn some(
    state: &PublishedState,
    entity: &EntityLayout,
    positions: &[usize],
    velocities: &[usize],
) -> v1::RobotJointStates {
    v1::RobotJointStates {
        robot: entity.name.clone(),
        layout_version: entity.version,
        position: gather(&state.positions, positions).collect(),
        velocity: gather(&state.velocities, velocities).collect(),
        effort: gather(&state.efforts, velocities).collect(),
        target: gather(&state.targets, velocities).collect(),
        mode: gather(&state.modes, velocities).map(mode).collect(),
        flags: gather(&state.flags, velocities).map(flags).collect(),
        unchanged: false,
        obstructions: Vec::new(),
    }
}

fn slice<'a, T>(values: &'a [T], range: &Range<usize>) -> &'a [T] {
    values.get(range.clone()).unwrap_or_default()
}

fn gather<'a, T: Copy>(values: &'a [T], indices: &'a [usize]) -> impl Iterator<Item = T> + 'a {
    indices.iter().filter_map(|index| values.get(*index).copied())
}

fn mode(mode: Mode) -> i32 {
    to_proto::joint::mode(mode).into()
}

fn flags(flags: Flags) -> u32 {
    to_proto::joint::flags(flags)
}

#[cfg(test)]
mod tests;
