//! The forces of each kind of constraint compared with the dense equations, on robots with free roots and
//! between two robots.
//!
//! From rest under gravity, a constraint gives in a step of h the impulses p of `(J M^-1 J' + R) p = -J M^-1
//! f h`. J and M are dense, f are the forces of gravity, and R is 1e-5 of the mean of the diagonal. Rows of
//! forces and rows of torques have separate means. So its rows and J M^-1 J' are those of the dense matrices.

use std::sync::Arc;

use fastrand::Rng;
use glamx::{DPose3, DQuat, DVec3};
use simd_core::dynamics::inverse_dynamics::inertia_matrix;
use simd_core::dynamics::jacobian::jacobian;
use simd_core::simulation::command::*;
use simd_core::{Command, PublishedState, Simulation};
use simd_model::RobotModel;
use simd_model::robot::{Inertial, JointKind};

use crate::constraint_properties::{bent, solve};
use crate::constraints::{held, tree, vector};
use simd_tests::world::{apply, euler, look};

const G: f64 = 9.81;

/// s.
const STEP: f64 = 1e-4;

/// R as a part of the mean of the diagonal.
const SOFTNESS: f64 = 1e-5;

/// A tenth of R. Rounding of poses, a fifth of which is corrected in a step, is far below it.
const TOLERANCE: f64 = 1e-6;

/// Rows that leave their tangent by less than 1e-10 m or rad in a step are not corrected beforehand. Links
/// may turn by this much in it.
const MAX_TURN: f64 = 5e-6;

/// Largest element of the inverse matrix, with 1 as the mean of its diagonal. Rows that nearly depend on each
/// other amplify rounding.
const MAX_INVERSE: f64 = 1e3;

/// Names of the robots, and whether their roots are free.
const ROBOTS: [(&str, bool); 3] = [("first", false), ("second", false), ("free", true)];

/// Parent and child, as indices of robots; no parent is the world.
type Ends = (Option<usize>, usize);

const ENDS: [Ends; 4] = [(None, 2), (Some(0), 2), (Some(0), 1), (Some(0), 0)];

const KINDS: usize = 6;

/// A row: the axis of its force or torque, world, and its J for the velocities of all robots.
type Row = (DVec3, Vec<f64>);

/// Rows of forces, and rows of torques.
type Rows = [Vec<Row>; 2];

/// A world at rest as dense matrices: velocities of all robots, one after the other.
struct Dense {
    seen: PublishedState,
    /// Index of each robot's first velocity.
    first: Vec<usize>,
    count: usize,
}

impl Dense {
    fn new(world: &Simulation) -> Self {
        let (seen, mut first, mut count) = (look(world), Vec::new(), 0);
        for entity in &seen.world.entities {
            first.push(count);
            count += entity.tree.velocity_count;
        }
        Self { seen, first, count }
    }

    fn pose(&self, (robot, link): (usize, usize)) -> DPose3 {
        self.seen.link_poses(robot).unwrap()[link]
    }

    /// How each velocity moves a point of a link that is here, and turns the link; world.
    fn columns(&self, (robot, link): (usize, usize), point: DVec3) -> Vec<[DVec3; 2]> {
        let (entity, now) = (&self.seen.world.entities[robot], self.seen.configuration(robot).unwrap());
        let point = self.pose((robot, link)).inverse_transform_point(point);
        let mut columns = vec![[DVec3::ZERO; 2]; self.count];
        let own = jacobian(&entity.tree, &now, link, point);
        for (column, own) in columns[self.first[robot]..].iter_mut().zip(own) {
            *column = [own.linear, own.angular];
        }
        columns
    }

    fn inertia(&self) -> Vec<Vec<f64>> {
        let mut matrix = vec![vec![0.0; self.count]; self.count];
        for (robot, entity) in self.seen.world.entities.iter().enumerate() {
            let (first, n) = (self.first[robot], entity.tree.velocity_count);
            let own = inertia_matrix(&entity.tree, &self.seen.configuration(robot).unwrap(), &[]);
            for (row, own) in matrix[first..].iter_mut().zip(own.chunks(n)) {
                row[first..first + n].copy_from_slice(own);
            }
        }
        matrix
    }

    /// Returns the forces of gravity.
    fn weights(&self) -> Vec<f64> {
        let mut weights = vec![0.0; self.count];
        for (robot, entity) in self.seen.world.entities.iter().enumerate() {
            for (index, link) in entity.model.links.iter().enumerate() {
                let Inertial { mass, center_of_mass, .. } = link.inertial;
                let center = self.pose((robot, index)).transform_point(center_of_mass);
                for (weight, [linear, _]) in weights.iter_mut().zip(self.columns((robot, index), center)) {
                    *weight -= mass * G * linear.z;
                }
            }
        }
        weights
    }

    /// Returns the rows of a constraint with the child's frame at this pose; `way` leads from the one frame
    /// of a distance to the other.
    fn rows(
        &self,
        kind: RequestedConstraint,
        (parent, child): (Option<(usize, usize)>, (usize, usize)),
        (frame, way): (DPose3, DVec3),
    ) -> Rows {
        let moves = self.columns(child, frame.translation);
        let still = vec![[DVec3::ZERO; 2]; self.count];
        let beside = parent.map_or(still, |parent| self.columns(parent, frame.translation));
        let all = vec![DVec3::X, DVec3::Y, DVec3::Z];
        let across = |axis: DVec3| {
            let (t, u) = (frame.rotation * axis).normalize().any_orthonormal_pair();
            vec![t, u]
        };
        let axes = match kind {
            RequestedConstraint::Weld => [all.clone(), all],
            RequestedConstraint::PointToPoint => [all, Vec::new()],
            RequestedConstraint::Hinge { axis } => [all, across(axis)],
            RequestedConstraint::Slide { axis } => [across(axis), all],
            RequestedConstraint::Distance { .. } => [vec![way], Vec::new()],
            RequestedConstraint::Gear { .. } => panic!("its row is of joints"),
        };
        let row = |part: usize, axis: DVec3| -> Row {
            (axis, moves.iter().zip(&beside).map(|(b, a)| axis.dot(b[part] - a[part])).collect())
        };
        [0, 1].map(|part| axes[part].iter().map(|axis| row(part, *axis)).collect())
    }

    /// Returns the row of a gear between joints of these robots.
    fn gear(&self, ratio: f64, parent: (usize, usize), child: (usize, usize)) -> Rows {
        let velocity = |(robot, joint): (usize, usize)| {
            let entity = &self.seen.world.entities[robot];
            let root = if entity.fixed_base { 0 } else { 6 };
            self.first[robot] + root + entity.joint_velocities[joint].start
        };
        let mut row = vec![0.0; self.count];
        row[velocity(parent)] -= ratio;
        row[velocity(child)] += 1.0;
        let joint = &self.seen.world.entities[child.0].model.joints[child.1];
        let axis = self.pose((child.0, joint.child)).rotation * joint.axis;
        match joint.kind {
            JointKind::Prismatic => [vec![(axis, row)], Vec::new()],
            _ => [Vec::new(), vec![(axis, row)]],
        }
    }

    /// Force and torque, N and N m, and the mean of the diagonal of each. `None` if rounding would count:
    /// rows nearly depend on each other, or hardly anything pulls at them.
    fn wrench(&self, rows: &Rows) -> Option<([DVec3; 2], [f64; 2])> {
        let flat: Vec<&[f64]> = rows.iter().flatten().map(|(_, row)| row.as_slice()).collect();
        let (count, weights) = (flat.len(), self.weights());
        // M^-1 of J' and of the forces.
        let right = |i: usize| flat.iter().map(|row| row[i]).chain([weights[i]]).collect::<Vec<f64>>();
        let solved = solve(self.inertia(), (0..self.count).map(right).collect());
        let times = |row: &[f64], k: usize| -> f64 { row.iter().zip(&solved).map(|(a, b)| a * b[k]).sum() };
        let mut effect: Vec<Vec<f64>> =
            flat.iter().map(|row| (0..count).map(|k| times(row, k)).collect()).collect();
        let free: Vec<f64> = flat.iter().map(|row| times(row, count)).collect();
        let (mut means, mut first) = ([1.0; 2], 0);
        for (mean, part) in means.iter_mut().zip(rows) {
            let own = first..first + part.len();
            first = own.end;
            if !part.is_empty() {
                *mean = own.clone().map(|k| effect[k][k]).sum::<f64>() / part.len() as f64;
            }
            own.for_each(|k| effect[k][k] += SOFTNESS * *mean);
        }
        if means.iter().any(|mean| *mean < 1e-9) {
            return None;
        }
        let scale: Vec<f64> =
            rows.iter().zip(means).flat_map(|(part, mean)| vec![mean.sqrt(); part.len()]).collect();
        let pull: f64 = free.iter().zip(&scale).map(|(free, scale)| (free / scale).powi(2)).sum();
        let row = |k: usize| (0..count).map(|l| effect[k][l] / (scale[k] * scale[l])).collect::<Vec<f64>>();
        let unit = |k: usize| (0..count).map(|l| f64::from(u8::from(k == l))).collect::<Vec<f64>>();
        let inverse = solve((0..count).map(row).collect(), (0..count).map(unit).collect());
        let largest = inverse.iter().flatten().fold(0.0f64, |largest, entry| largest.max(entry.abs()));
        if pull.sqrt() < 0.5 || largest > MAX_INVERSE {
            return None;
        }
        let mut forces = solve(effect, free.iter().map(|free| vec![-free]).collect()).into_iter();
        let wrench = rows.each_ref().map(|part| {
            let forces = part.iter().zip(&mut forces);
            forces.fold(DVec3::ZERO, |sum, ((axis, _), force)| sum + *axis * force[0])
        });
        Some((wrench, means))
    }
}

/// Robots near each other, with their joints anywhere.
fn robots(rng: &mut Rng) -> Simulation {
    let mut world = euler(STEP);
    for (name, free) in ROBOTS {
        let fits = |model: &Arc<RobotModel>| free || model.links.len() > 2;
        let model = std::iter::repeat_with(|| tree(rng)).find(fits).unwrap();
        let pose = DPose3::from_parts(vector(rng, 0.2), DQuat::from_scaled_axis(vector(rng, 3.0)));
        let spawn = Spawn { name: name.into(), pose, ..bent(rng, &model, free) };
        apply(&mut world, Command::Spawn(Box::new(spawn)));
    }
    world
}

/// Returns a constraint of this kind between links, near the child's origin, and its rows. `None` if it would
/// be nearly zero.
fn linked(
    rng: &mut Rng,
    dense: &Dense,
    kind: usize,
    (parent, child): Ends,
) -> Option<(CreateConstraint, Rows)> {
    let links = |robot: usize| dense.seen.world.entities[robot].model.links.len();
    // For a fixed robot the last one, which most joints move.
    let link = if ROBOTS[child].1 { rng.usize(0..links(child)) } else { links(child) - 1 };
    let child = (child, link);
    let origin = dense.pose(child).transform_point(vector(rng, 0.1));
    let frame = DPose3::from_parts(origin, DQuat::from_scaled_axis(vector(rng, 3.0)));
    let parent = parent.map(|robot| {
        if robot == child.0 {
            return (robot, rng.usize(0..link));
        }
        // The nearest movable one: a constraint at the end of a long arm has little resistance.
        let far = |link: &usize| dense.pose((robot, *link)).translation.distance(origin);
        let near = (1..links(robot)).min_by(|a, b| far(a).total_cmp(&far(b)));
        (robot, near.unwrap_or(0))
    });
    let axis = vector(rng, 1.0).try_normalize().unwrap_or(DVec3::Z);
    let kind = match kind {
        0 => RequestedConstraint::Weld,
        1 => RequestedConstraint::PointToPoint,
        2 => RequestedConstraint::Hinge { axis },
        3 => RequestedConstraint::Slide { axis },
        _ => RequestedConstraint::Distance { length: None, is_rope: false },
    };
    let is_distance = matches!(kind, RequestedConstraint::Distance { .. });
    let across = if is_distance { vector(rng, 0.2) } else { DVec3::ZERO };
    if is_distance && across.length() < 0.05 {
        return None;
    }
    let end = |link: Option<(usize, usize)>, frame: Option<DPose3>| {
        let world = RequestedEnd { pose: frame, ..RequestedEnd::default() };
        let Some((robot, link)) = link else { return world };
        let pose = frame.map(|frame| dense.pose((robot, link)).inverse() * frame);
        let link = format!("link-{link}");
        RequestedEnd { robot: ROBOTS[robot].0.into(), link, pose, ..RequestedEnd::default() }
    };
    let first = end(parent, Some(DPose3::from_parts(origin - across, frame.rotation)));
    let second = end(Some(child), is_distance.then_some(frame));
    let rows = dense.rows(kind, (parent, child), (frame, across.normalize_or_zero()));
    Some((held(kind, first, second), rows))
}

/// Returns a gear between two joints, and its row. `None` if there are no two of one axis.
fn geared(rng: &mut Rng, dense: &Dense, (parent, child): Ends) -> Option<(CreateConstraint, Rows)> {
    let one_axis = |robot: usize| -> Vec<usize> {
        let joints = dense.seen.world.entities[robot].model.joints.iter().enumerate();
        joints.filter(|(_, joint)| joint.kind != JointKind::Spherical).map(|(index, _)| index).collect()
    };
    // The world has no joints.
    let parent = parent.unwrap_or(1);
    let parent = (parent, *one_axis(parent).first()?);
    let child = (child, *one_axis(child).last()?);
    if parent == child {
        return None;
    }
    let end = |(robot, joint): (usize, usize)| {
        let joint = dense.seen.world.entities[robot].model.joints[joint].name.clone();
        RequestedEnd { robot: ROBOTS[robot].0.into(), joint, ..RequestedEnd::default() }
    };
    let ratio = 2.0 * rng.f64() - 1.0;
    let kind = RequestedConstraint::Gear { ratio, offset: None };
    Some((held(kind, end(parent), end(child)), dense.gear(ratio, parent, child)))
}

#[test]
fn each_kind_has_the_forces_of_the_dense_equations_on_free_roots_and_between_robots() {
    let mut compared = [[0usize; ENDS.len()]; KINDS];
    for seed in 0..720 {
        let rng = &mut Rng::with_seed(seed);
        let (kind, ends) = (seed as usize % KINDS, seed as usize / KINDS % ENDS.len());
        let mut world = robots(rng);
        let dense = Dense::new(&world);
        let made = match kind {
            5 => geared(rng, &dense, ENDS[ends]),
            _ => linked(rng, &dense, kind, ENDS[ends]),
        };
        let Some((create, rows)) = made else { continue };
        let Some((wrench, means)) = dense.wrench(&rows) else { continue };
        let what = format!("{seed}: {:?} from {:?} to {:?}", create.kind, create.parent, create.child);
        apply(&mut world, Command::CreateConstraint(Box::new(create)));
        world.step();
        let seen = look(&world);
        let (parent, child) = ENDS[ends];
        let robots = [parent.unwrap_or(1), child].into_iter();
        let twists = robots.flat_map(|robot| seen.link_twists(robot).unwrap());
        if twists.map(|(_, angular)| angular.length()).fold(0.0, f64::max) * STEP > MAX_TURN {
            continue;
        }
        let state = seen.constraint_states[0];
        let found = [state.force, state.torque];
        // Forces and torques scaled by their effect on the bodies.
        let size = |of: [DVec3; 2]| (0..2).map(|k| means[k] * of[k].length_squared()).sum::<f64>().sqrt();
        let error = size([0, 1].map(|k| found[k] - wrench[k])) / size(wrench);
        assert!(error < TOLERANCE, "{what}: {found:?} and not {wrench:?}: {error:e}");
        compared[kind][ends] += 1;
    }
    let of_ends = (0..ENDS.len()).map(|ends| compared.iter().map(|of| of[ends]).sum::<usize>());
    let of_kinds = compared.iter().map(|of| of.iter().sum::<usize>());
    assert!(of_ends.chain(of_kinds).all(|count| count > 20), "{compared:?}");
}
