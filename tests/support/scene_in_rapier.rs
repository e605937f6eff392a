//! A scene with contact in rapier: its rigid bodies, its own multibody joints, its contacts and its solver.
//! They have their default settings at the scene's time step.
//!
//! Masses, shapes, friction, gains, limits and targets are those of the scene. Fixed meshes and heights are
//! triangles with fixed internal edges; movable ones are their hulls. Overlaps and forces are those of the
//! views alone.

use std::collections::BTreeMap;
use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};
use rapier3d_f64::dynamics::{
    CoefficientCombineRule, GenericJointBuilder, JointAxesMask, JointAxis, MassProperties, MotorModel,
    MultibodyDofCoupling, RigidBodyBuilder, RigidBodyHandle,
};
use rapier3d_f64::geometry::{ColliderBuilder, ColliderHandle, SharedShape, TriMeshFlags};
use rapier3d_f64::parry::query::contact;
use rapier3d_f64::pipeline::PhysicsWorld;
use simd_core::collision::{ColliderGeometry, MeshShapes, Shapes};
use simd_core::dynamics::Tree;
use simd_core::dynamics::inertia::Rigid;
use simd_core::dynamics::tree::JointType;
use simd_model::RobotModel;

use crate::contact_scene::{Robot, Scene, View};
use crate::robots::Described;

/// Something of the scene in the world.
struct Placed {
    name: String,
    tree: Tree,
    model: Arc<RobotModel>,
    /// The bodies of the tree, after the body of a fixed base.
    handles: Vec<RigidBodyHandle>,
}

/// Robot and link of a collider.
type Owner = (String, String);

/// A scene on its way.
pub struct InRapier<'a> {
    scene: &'a Scene,
    world: PhysicsWorld,
    placed: Vec<Placed>,
    owners: BTreeMap<(u32, u32), Owner>,
}

impl Scene {
    /// Returns views from the start on, one each `every` steps, in rapier. `None` for scenes that it cannot
    /// run here: with constraints, or with joints of several degrees of freedom.
    ///
    /// # Panics
    /// Panics if a robot of it cannot be read: then the test has failed.
    pub fn run_in_rapier(&self, every: u64) -> Option<Vec<View>> {
        let mut run = InRapier::new(self)?;
        let mut views = vec![run.view(0.0)];
        for step in 1..=(self.seconds / self.time_step).round() as u64 {
            run.step((step - 1) as f64 * self.time_step);
            if step % every == 0 {
                views.push(run.view(step as f64 * self.time_step));
            }
        }
        Some(views)
    }
}

impl<'a> InRapier<'a> {
    fn new(scene: &'a Scene) -> Option<Self> {
        if !scene.constraints.is_empty() {
            return None;
        }
        let mut world = PhysicsWorld::new();
        world.gravity = DVec3::Z * -scene.gravity;
        world.integration_parameters.dt = scene.time_step;
        let mut new = Self { scene, world, placed: Vec::new(), owners: BTreeMap::new() };
        for thing in &scene.things {
            let model = thing.model();
            let (surface, fixed) = ((thing.friction, thing.restitution), thing.mass == 0.0);
            let shapes = Shapes::reusing(&model, fixed, MeshShapes::Mesh, &[]);
            for (name, at) in thing.places() {
                let placed = new.add(name, &model, &shapes, at, fixed, surface)?;
                if !fixed {
                    let body = new.world.bodies.get_mut(placed.handles[0])?;
                    body.set_linvel(thing.linear.into(), true);
                    body.set_angvel(thing.angular.into(), true);
                }
                new.placed.push(placed);
            }
        }
        for robot in &scene.robots {
            let surface = (robot.friction, robot.restitution);
            for (name, Described { model, pose, fixed }) in robot.described() {
                let shapes = Shapes::reusing(&model, fixed, MeshShapes::Mesh, &[]);
                let placed = new.add(name, &model, &shapes, pose, fixed, surface)?;
                new.begin(robot, &placed);
                new.placed.push(placed);
            }
        }
        Some(new)
    }

    /// Bodies, joints and colliders, where joints are at 0.
    fn add(
        &mut self,
        name: String,
        model: &Arc<RobotModel>,
        shapes: &Shapes,
        world_from_root: DPose3,
        fixed: bool,
        surface: (f64, f64),
    ) -> Option<Placed> {
        let tree = Tree::new(model, fixed);
        let mut handles: Vec<RigidBodyHandle> = Vec::new();
        if tree.fixed_base {
            handles.push(self.world.insert_body(RigidBodyBuilder::fixed().pose(world_from_root)));
        }
        let base = handles.len();
        for body in &tree.bodies {
            let builder = RigidBodyBuilder::dynamic()
                .pose(world_from_root)
                .can_sleep(false)
                .additional_mass_properties(mass_properties(&body.inertia));
            let handle = self.world.insert_body(builder);
            let (axis, free) = match body.joint_type {
                JointType::Revolute => (JointAxis::AngZ, JointAxesMask::ANG_Z),
                JointType::Prismatic => (JointAxis::LinZ, JointAxesMask::LIN_Z),
                JointType::Free { .. } if body.joint.is_none() => {
                    handles.push(handle);
                    continue;
                }
                JointType::Free { .. } | JointType::Spherical { .. } => return None,
            };
            let frame = DPose3::from_parts(body.at_zero.origin, DQuat::from_mat3(&body.at_zero.rotation));
            let mut joint =
                GenericJointBuilder::new(JointAxesMask::all() & !free).local_frame1(frame).build();
            joint.set_contacts_enabled(false);
            let limits = body.joint.map(|joint| model.joints[joint].limits);
            if let Some((lower, upper)) = limits.and_then(|limits| limits.lower.zip(limits.upper)) {
                joint.set_limits(axis, [lower, upper]);
            }
            let parent = body.parent.map_or(handles[0], |parent| handles[base + parent]);
            self.world.multibody_joints.insert(parent, handle, joint, true)?;
            handles.push(handle);
        }
        let placed = Placed { name, tree, model: Arc::clone(model), handles };
        self.collide(&placed, shapes, surface);
        Some(placed)
    }

    fn collide(&mut self, placed: &Placed, shapes: &Shapes, (friction, restitution): (f64, f64)) {
        let Placed { name, tree, model, handles } = placed;
        let base = usize::from(tree.fixed_base);
        for collider in shapes.colliders(tree) {
            let frame = &tree.links[collider.link];
            let upright = DPose3::from_rotation(DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2));
            let (shape, turn) = match collider.geometry {
                ColliderGeometry::Box { size } => {
                    let half = size / 2.0;
                    (SharedShape::cuboid(half.x, half.y, half.z), DPose3::IDENTITY)
                }
                ColliderGeometry::Sphere { radius } => (SharedShape::ball(radius), DPose3::IDENTITY),
                ColliderGeometry::Cylinder { radius, length } => {
                    (SharedShape::cylinder(length / 2.0, radius), upright)
                }
                ColliderGeometry::Cone { radius, length } => {
                    (SharedShape::cone(length / 2.0, radius), upright)
                }
                ColliderGeometry::Capsule { radius, length } => {
                    (SharedShape::capsule_z(length / 2.0, radius), DPose3::IDENTITY)
                }
                ColliderGeometry::Plane { normal } => (SharedShape::halfspace(normal), DPose3::IDENTITY),
                ColliderGeometry::Convex { sha256 } => {
                    let Some(mesh) = shapes.convex_mesh(&sha256) else { continue };
                    let made = if frame.body.is_none() {
                        let flags = TriMeshFlags::FIX_INTERNAL_EDGES;
                        SharedShape::trimesh_with_flags(mesh.vertices, mesh.triangles, flags).ok()
                    } else {
                        SharedShape::convex_hull(&mesh.vertices)
                    };
                    let Some(made) = made else { continue };
                    (made, DPose3::IDENTITY)
                }
            };
            let handle = handles[frame.body.map_or(0, |body| base + body)];
            let builder = ColliderBuilder::new(shape)
                .position(frame.body_from_link * collider.link_from_shape * turn)
                .density(0.0)
                .friction(friction)
                .friction_combine_rule(CoefficientCombineRule::Min)
                .restitution(restitution)
                .restitution_combine_rule(CoefficientCombineRule::Max);
            let made = self.world.insert_collider(builder, Some(handle));
            let owner = (name.clone(), model.links[collider.link].name.clone());
            self.owners.insert(made.into_raw_parts(), owner);
        }
    }

    /// Sets the initial joint positions and velocities of a robot.
    fn begin(&mut self, robot: &Robot, placed: &Placed) {
        let PhysicsWorld { multibody_joints, bodies, .. } = &mut self.world;
        let handle = multibody_joints.rigid_body_link(placed.handles[0]).map(|link| link.multibody);
        let Some(multibody) = handle.and_then(|handle| multibody_joints.get_multibody_mut(handle)) else {
            return;
        };
        multibody.set_self_contacts_enabled(false);
        multibody.forward_kinematics(bodies, true);
        let count = placed.tree.velocity_count;
        let (mut positions, mut velocities) = (vec![0.0; count], vec![0.0; count]);
        for body in &placed.tree.bodies {
            let Some(joint) = body.joint else { continue };
            let name = &placed.model.joints[joint].name;
            positions[body.velocity] = robot.joints.get(name).copied().unwrap_or_default();
            velocities[body.velocity] = robot.velocities.get(name).copied().unwrap_or_default();
        }
        multibody.apply_displacements(&positions);
        // No damping, and nothing else that the scene does not have.
        multibody.damping_mut().fill(0.0);
        multibody.armature_mut().fill(0.0);
        multibody.frictions_mut().fill(0.0);
        if !robot.fixed {
            velocities[..3].copy_from_slice(&robot.linear);
            velocities[3..6].copy_from_slice(&robot.angular);
        }
        let mut known = multibody.generalized_velocity_mut();
        known.iter_mut().zip(&velocities).for_each(|(known, velocity)| *known = *velocity);
        let base = usize::from(placed.tree.fixed_base);
        for pair in &placed.tree.mimics {
            let axis = |body: usize| match placed.tree.bodies[body].joint_type {
                JointType::Prismatic => 2,
                _ => 5,
            };
            multibody.add_dof_coupling(MultibodyDofCoupling {
                link1: base + pair.leader,
                dof1: 0,
                axis1: axis(pair.leader),
                link2: base + pair.follower,
                dof2: 0,
                axis2: axis(pair.follower),
                coeff: pair.multiplier,
                offset: pair.offset,
            });
        }
        multibody.forward_kinematics(bodies, false);
        multibody.update_rigid_bodies(bodies, true);
    }

    /// Gives the motors their targets, and advances by a time step.
    fn step(&mut self, now: f64) {
        for robot in &self.scene.robots {
            let Some(placed) = self.placed.iter().find(|placed| placed.name == robot.name) else { continue };
            let base = usize::from(placed.tree.fixed_base);
            for (index, body) in placed.tree.bodies.iter().enumerate() {
                let Some(joint) = body.joint else { continue };
                let name = &placed.model.joints[joint].name;
                let Some(drive) = robot.drive(name, now) else { continue };
                let set = &mut self.world.multibody_joints;
                let link = set.rigid_body_link(placed.handles[base + index]).copied();
                let multibody = link.and_then(|link| Some((set.get_multibody_mut(link.multibody)?, link.id)));
                let Some(link) = multibody.and_then(|(multibody, id)| multibody.link_mut(id)) else {
                    continue;
                };
                let axis = match body.joint_type {
                    JointType::Prismatic => JointAxis::LinZ,
                    _ => JointAxis::AngZ,
                };
                let data = &mut link.joint.data;
                data.set_motor_model(axis, MotorModel::ForceBased);
                data.set_motor(axis, drive.position, drive.velocity, drive.stiffness, drive.damping);
                data.set_motor_max_force(axis, robot.effort.get(name).copied().unwrap_or(f64::MAX));
            }
        }
        self.world.step();
    }

    fn view(&self, time: f64) -> View {
        let (mut roots, mut joints) = (Vec::new(), Vec::new());
        for placed in self.placed.iter().filter(|placed| !placed.tree.fixed_base) {
            let Some(body) = self.world.bodies.get(placed.handles[0]) else { continue };
            let pose = *body.position() * placed.tree.links[0].body_from_link;
            let (linear, angular) = (body.linvel(), body.angvel());
            let linear = linear + angular.cross(pose.translation - body.center_of_mass());
            let turn = pose.rotation.to_array();
            let [at, linear, angular] =
                [pose.translation, linear, angular].map(|part: DVec3| part.to_array());
            roots.push([&at[..], &turn, &linear, &angular].concat());
        }
        for robot in &self.scene.robots {
            let placed = self.placed.iter().find(|placed| placed.name == robot.name);
            joints.extend(
                robot
                    .order
                    .iter()
                    .map(|name| placed.and_then(|placed| self.position(placed, name)).unwrap_or(f64::NAN)),
            );
        }
        let (mut deepest, mut forces) = (0.0f64, vec![0.0; self.scene.watch.len()]);
        for pair in self.world.narrow_phase.contact_pairs() {
            deepest = deepest.max(self.overlap(pair.collider1, pair.collider2));
            let owners = [pair.collider1, pair.collider2].map(|collider| self.owner(collider));
            let impulse: f64 = pair
                .solver_manifolds()
                .iter()
                .flat_map(|manifold| &manifold.points)
                .map(|point| point.data.impulse)
                .sum();
            for ([robot, link], force) in self.scene.watch.iter().zip(&mut forces) {
                let of = |owner: &&Owner| owner.0 == *robot && (link.is_empty() || owner.1 == *link);
                if owners.iter().flatten().any(of) {
                    *force += impulse / self.scene.time_step;
                }
            }
        }
        View { time, roots, joints, deepest, forces, error: 0.0 }
    }

    /// Returns the position of a joint by name.
    fn position(&self, placed: &Placed, name: &str) -> Option<f64> {
        let joint = placed.model.joints.iter().position(|joint| joint.name == name)?;
        let body = placed.tree.bodies.iter().position(|body| body.joint == Some(joint))?;
        let handle = placed.handles[usize::from(placed.tree.fixed_base) + body];
        let link = self.world.multibody_joints.rigid_body_link(handle)?;
        let multibody = self.world.multibody_joints.get_multibody(link.multibody)?;
        // All but one of the coordinates are locked at zero.
        Some(multibody.link(link.id)?.joint().coords().iter().sum())
    }

    fn owner(&self, collider: ColliderHandle) -> Option<&Owner> {
        self.owners.get(&collider.into_raw_parts())
    }

    /// Returns the present overlap of two colliders; rapier's data of a pair is from an earlier step.
    fn overlap(&self, a: ColliderHandle, b: ColliderHandle) -> f64 {
        let [Some(a), Some(b)] = [a, b].map(|handle| self.world.colliders.get(handle)) else { return 0.0 };
        let found = contact(a.position(), a.shape(), b.position(), b.shape(), 0.0);
        found.ok().flatten().map_or(0.0, |found| (-found.dist).max(0.0))
    }
}

fn mass_properties(inertia: &Rigid) -> MassProperties {
    let center = inertia.first_moment / inertia.mass;
    // The moment is about the body's origin, rapier's about the centre of mass.
    let about_center = inertia.shifted(-center).moment;
    MassProperties::with_inertia_matrix(center, inertia.mass, about_center.matrix())
}
