//! Quantities that are read of copies.

use glamx::DPose3;

use super::names::{joints, links, robot};
use super::request::{Named, Quantity};
use crate::collision::distance::Closest;
use crate::simulation::published_state::{ContactReport, EntityLayout, WorldLayout};
use crate::simulation::queries::DistanceQuery;
use crate::simulation::{Error, PublishedState};

/// State of a copy with the poses of its links, which are computed once.
#[derive(Debug, Default)]
pub(super) struct View {
    pub(super) state: PublishedState,
    /// Poses by robot; empty until requested.
    poses: Vec<Vec<DPose3>>,
}

impl View {
    /// Discards the poses; call it when the state changes.
    pub(super) fn changed(&mut self) {
        self.poses.iter_mut().for_each(Vec::clear);
        self.poses.resize_with(self.state.world.entities.len(), Vec::new);
    }

    fn find_poses(&mut self, robot: usize) {
        if self.poses[robot].is_empty() {
            self.poses[robot] = self.state.link_poses(robot).unwrap_or_default();
        }
    }

    /// Returns `world_from_link` of a link.
    pub(super) fn link_pose(&mut self, robot: usize, link: usize) -> DPose3 {
        self.find_poses(robot);
        self.poses[robot].get(link).copied().unwrap_or(DPose3::IDENTITY)
    }

    /// Returns the nearest points of the two sides of a distance query.
    ///
    /// # Errors
    /// See [`PublishedState::distances`].
    pub(super) fn closest_points(
        &mut self,
        query: &DistanceQuery,
        is_cancelled: &dyn Fn() -> bool,
    ) -> Result<Vec<Closest>, Error> {
        for robot in 0..self.poses.len() {
            self.find_poses(robot);
        }
        let Self { state, poses } = self;
        state.closest_points(query, &|robot| poses[robot].as_slice().into(), is_cancelled)
    }

    /// Returns the sum of the normal forces on links of a robot, newtons.
    pub(super) fn contact_force(&self, robot: usize, links: &[usize]) -> f64 {
        let on = |contact: &ContactReport| {
            let is_on = |side: usize| contact.robots[side] == robot && links.contains(&contact.links[side]);
            is_on(0) || is_on(1)
        };
        self.state.contacts.iter().filter(|contact| on(contact)).map(|contact| contact.normal_force).sum()
    }
}

/// A quantity with resolved names.
#[derive(Debug)]
pub(super) enum QuantityPlan {
    /// Positions at these indices among the positions of all robots.
    Positions(Vec<usize>),
    /// Velocities at these indices among the velocities of all robots.
    Velocities(Vec<usize>),
    Efforts(Vec<usize>),
    RootPose(usize),
    RootTwist(usize),
    LinkPoses(usize, Vec<usize>),
    ContactCount(usize),
    ContactForce(usize, Vec<usize>),
}

/// Returns the indices of the joints of a robot. `field` returns the path of a field by its name.
fn indices(
    layout: &WorldLayout,
    named: &Named,
    field: impl Fn(&str) -> String,
    of: impl Fn(&EntityLayout) -> (usize, &[std::ops::Range<usize>]),
) -> Result<Vec<usize>, Error> {
    let (_, entity) = robot(layout, &field("robot"), &named.robot)?;
    let joints = joints(entity, &field("names"), &named.names)?;
    let (first, ranges) = of(entity);
    Ok(joints.into_iter().flat_map(|joint| ranges[joint].clone()).map(|index| first + index).collect())
}

impl QuantityPlan {
    /// Resolves names; `index` is the quantity's index in the request.
    pub(super) fn new(layout: &WorldLayout, index: usize, quantity: &Quantity) -> Result<Self, Error> {
        let field = |name: &str| format!("quantities[{index}].{name}");
        let velocities = |named: &Named| {
            indices(layout, named, field, |entity| (entity.velocities.start, &entity.joint_velocities[..]))
        };
        let robot_index = |name: &str| robot(layout, &field("robot"), name).map(|(robot, _)| robot);
        let of_links = |named: &Named| {
            let (robot, entity) = robot(layout, &field("robot"), &named.robot)?;
            Ok::<_, Error>((robot, links(entity, &field("names"), &named.names)?))
        };
        Ok(match quantity {
            Quantity::JointPositions(named) => Self::Positions(indices(layout, named, field, |entity| {
                (entity.positions.start, &entity.joint_positions[..])
            })?),
            Quantity::JointVelocities(named) => Self::Velocities(velocities(named)?),
            Quantity::JointEfforts(named) => Self::Efforts(velocities(named)?),
            Quantity::RootPose(name) => Self::RootPose(robot_index(name)?),
            Quantity::RootTwist(name) => Self::RootTwist(robot_index(name)?),
            Quantity::LinkPoses(named) => {
                let (robot, links) = of_links(named)?;
                Self::LinkPoses(robot, links)
            }
            Quantity::ContactCount(name) => Self::ContactCount(robot_index(name)?),
            Quantity::ContactForce(named) => {
                let (robot, links) = of_links(named)?;
                Self::ContactForce(robot, links)
            }
        })
    }

    /// Returns its number of values.
    pub(super) fn width(&self) -> usize {
        match self {
            Self::Positions(indices) | Self::Velocities(indices) | Self::Efforts(indices) => indices.len(),
            Self::RootPose(_) => 7,
            Self::RootTwist(_) => 6,
            Self::LinkPoses(_, links) => 7 * links.len(),
            Self::ContactCount(_) | Self::ContactForce(..) => 1,
        }
    }

    /// Writes its values.
    pub(super) fn write(&self, view: &mut View, into: &mut [f64]) {
        let pose = |pose: DPose3, into: &mut [f64]| {
            into[..3].copy_from_slice(&pose.translation.to_array());
            into[3..].copy_from_slice(&pose.rotation.to_array());
        };
        let chosen = |indices: &[usize], from: &[f64], into: &mut [f64]| {
            into.iter_mut().zip(indices).for_each(|(value, index)| *value = from[*index]);
        };
        match self {
            Self::Positions(indices) => chosen(indices, &view.state.positions, into),
            Self::Velocities(indices) => chosen(indices, &view.state.velocities, into),
            Self::Efforts(indices) => chosen(indices, &view.state.efforts, into),
            Self::RootPose(robot) => pose(view.state.roots[*robot].pose, into),
            Self::RootTwist(robot) => {
                let root = &view.state.roots[*robot];
                into[..3].copy_from_slice(&root.linear.to_array());
                into[3..].copy_from_slice(&root.angular.to_array());
            }
            Self::LinkPoses(robot, links) => {
                for (link, into) in links.iter().zip(into.chunks_exact_mut(7)) {
                    pose(view.link_pose(*robot, *link), into);
                }
            }
            Self::ContactCount(robot) => {
                let touching = |contact: &&ContactReport| contact.robots.contains(robot);
                into[0] = view.state.contacts.iter().filter(touching).count() as f64;
            }
            Self::ContactForce(robot, links) => into[0] = view.contact_force(*robot, links),
        }
    }
}
