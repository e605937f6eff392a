//! Cost of a step of a copy.

use std::f64::consts::{PI, TAU};

use glamx::{DQuat, DVec3};
use simd_model::LARGEST_GIVEN;

use super::names::{axes_of, link, links, moderate, refuse, robot, sized};
use super::nearness::Nearness;
use super::quantities::View;
use super::request::{Cost, CostTerm, Named};
use crate::simulation::published_state::WorldLayout;
use crate::simulation::{Error, PublishedState};

/// A term with resolved names.
#[derive(Debug)]
pub(super) struct CostPlan {
    pub(super) weight: f64,
    pub(super) final_weight: f64,
    of: Weighted,
}

#[derive(Debug)]
enum Weighted {
    /// Indices among the positions of all robots, and target positions.
    Positions {
        indices: Vec<usize>,
        targets: Vec<f64>,
        wrapped: bool,
    },
    /// Indices among the velocities of all robots, and target velocities.
    Velocities {
        indices: Vec<usize>,
        targets: Vec<f64>,
    },
    Efforts(Vec<usize>),
    LinkPosition {
        robot: usize,
        link: usize,
        point: DVec3,
        target: DVec3,
    },
    LinkOrientation {
        robot: usize,
        link: usize,
        target: DQuat,
    },
    ContactForce(usize, Vec<usize>),
    Nearness(Nearness),
}

/// Returns the difference of a revolute joint's position without whole turns: between -pi and pi.
fn wrapped(difference: f64) -> f64 {
    (difference + PI).rem_euclid(TAU) - PI
}

/// Returns the sum of the squared differences of the numbers at some indices.
fn squares(indices: &[usize], targets: &[f64], from: &[f64], difference: impl Fn(f64) -> f64) -> f64 {
    let pairs = indices.iter().zip(targets);
    pairs.map(|(index, target)| difference(from[*index] - target).powi(2)).sum()
}

impl CostPlan {
    /// Resolves names; `index` is the term's index in the request.
    pub(super) fn new(layout: &WorldLayout, index: usize, term: CostTerm) -> Result<Self, Error> {
        let field = |name: &str| format!("costs[{index}].{name}");
        let CostTerm { weight, final_weight, of } = term;
        for (name, value) in [("weight", weight), ("final_weight", final_weight)] {
            if value.is_nan() || value.abs() > LARGEST_GIVEN {
                let expected =
                    format!("it must be a number between -{LARGEST_GIVEN:e} and {LARGEST_GIVEN:e}");
                return Err(refuse(field(name), value, expected));
            }
        }
        // Indices of joints of one axis, and a number for each.
        let joints = |named: &Named, targets: Vec<f64>, of_positions: bool| {
            let (robot, axes) = axes_of(layout, named, field, "joints")?;
            let entity = &layout.entities[robot];
            let (first, ranges) = match of_positions {
                true => (entity.positions.start, &entity.joint_positions),
                false => (entity.velocities.start, &entity.joint_velocities),
            };
            let indices: Vec<usize> = axes.iter().map(|axis| first + ranges[axis.joint].start).collect();
            sized(&field("targets"), targets.len(), &[(0, "zero for all"), (indices.len(), "one a joint")])?;
            moderate(&field("targets"), &targets)?;
            let targets = if targets.is_empty() { vec![0.0; indices.len()] } else { targets };
            Ok::<_, Error>((indices, targets))
        };
        let one_link = |name: &str, of: &str| {
            let (index, entity) = robot(layout, &field("robot"), name)?;
            Ok::<_, Error>((index, link(entity, &field("link"), of)?))
        };
        let of = match of {
            Cost::JointPositions { joints: named, targets, wrapped } => {
                let (indices, targets) = joints(&named, targets, true)?;
                Weighted::Positions { indices, targets, wrapped }
            }
            Cost::JointVelocities { joints: named, targets } => {
                let (indices, targets) = joints(&named, targets, false)?;
                Weighted::Velocities { indices, targets }
            }
            Cost::JointEfforts(named) => Weighted::Efforts(joints(&named, Vec::new(), false)?.0),
            Cost::LinkPosition { robot, link, point, target } => {
                moderate(&field("point"), &point.to_array())?;
                moderate(&field("target"), &target.to_array())?;
                let (robot, link) = one_link(&robot, &link)?;
                Weighted::LinkPosition { robot, link, point, target }
            }
            Cost::LinkOrientation { robot, link, target } => {
                let (robot, link) = one_link(&robot, &link)?;
                let length = target.length();
                if !length.is_finite() || (length - 1.0).abs() >= 1e-6 {
                    let expected = "it must be a quaternion of unit length";
                    return Err(refuse(field("target"), target, expected));
                }
                Weighted::LinkOrientation { robot, link, target }
            }
            Cost::ContactForce(named) => {
                let (index, entity) = robot(layout, &field("robot"), &named.robot)?;
                Weighted::ContactForce(index, links(entity, &field("links"), &named.names)?)
            }
            Cost::Nearness { robot: name, link: of_link, other_robot, other_link, distance } => {
                if !(distance >= 0.0 && distance.is_finite()) {
                    return Err(refuse(field("distance"), distance, "it must be finite and at least 0"));
                }
                let side = |[robot_field, link_field]: [&str; 2], name: &str, of_link: &str| {
                    let (robot, entity) = robot(layout, &field(robot_field), name)?;
                    let link = match of_link {
                        "" => None,
                        of_link => Some(link(entity, &field(link_field), of_link)?),
                    };
                    Ok::<_, Error>((robot, link))
                };
                if other_robot.is_empty() && !other_link.is_empty() {
                    let expected = "it must be empty if no other robot is named";
                    return Err(refuse(field("other_link"), format!("{other_link:?}"), expected));
                }
                let other = || side(["other_robot", "other_link"], &other_robot, &other_link);
                let other = (!other_robot.is_empty()).then(other).transpose()?;
                let own = side(["robot", "link"], &name, &of_link)?;
                Weighted::Nearness(Nearness::new(layout, own, other, distance))
            }
        };
        Ok(Self { weight, final_weight, of })
    }

    /// Returns its unweighted value in a state.
    ///
    /// # Errors
    /// Returns an error if a distance cannot be computed. If cancelled, the value is invalid.
    pub(super) fn value(&self, view: &mut View, is_cancelled: &dyn Fn() -> bool) -> Result<f64, Error> {
        let state: &PublishedState = &view.state;
        Ok(match &self.of {
            Weighted::Positions { indices, targets, wrapped: false } => {
                squares(indices, targets, &state.positions, |lack| lack)
            }
            Weighted::Positions { indices, targets, wrapped: true } => {
                squares(indices, targets, &state.positions, wrapped)
            }
            Weighted::Velocities { indices, targets } => {
                squares(indices, targets, &state.velocities, |lack| lack)
            }
            Weighted::Efforts(indices) => indices.iter().map(|index| state.efforts[*index].powi(2)).sum(),
            Weighted::LinkPosition { robot, link, point, target } => {
                (view.link_pose(*robot, *link).transform_point(*point) - *target).length_squared()
            }
            Weighted::LinkOrientation { robot, link, target } => {
                let turned = target.inverse() * view.link_pose(*robot, *link).rotation;
                let axis = DVec3::new(turned.x, turned.y, turned.z);
                (2.0 * axis.length().atan2(turned.w.abs())).powi(2)
            }
            Weighted::ContactForce(robot, links) => view.contact_force(*robot, links),
            Weighted::Nearness(nearness) => nearness.lack(view, is_cancelled)?.powi(2),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn whole_turns_do_not_count_where_they_are_wrapped() {
        for turns in [-2.0, 0.0, 3.0] {
            assert!((wrapped(0.5 + turns * TAU) - 0.5).abs() < 1e-12);
            assert!((wrapped(-3.0 + turns * TAU) + 3.0).abs() < 1e-12);
        }
    }
}
