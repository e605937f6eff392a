//! A scene in rapier: its own multibody joints, and none of its collision detection.
//!
//! One body represents all links that fixed joints connect, as in simd, so that rapier does not solve
//! additional joints. Its motors are implicit springs of simd's default gains.

use glamx::{DPose3, DQuat};
use rapier3d_f64::dynamics::{
    GenericJointBuilder, JointAxesMask, JointAxis, MassProperties, MotorModel, MultibodyDofCoupling,
    RigidBodyBuilder, RigidBodyHandle,
};
use rapier3d_f64::pipeline::PhysicsWorld;
use simd_core::dynamics::Tree;
use simd_core::dynamics::inertia::Rigid;
use simd_core::dynamics::tree::JointType;
use simd_core::simulation::PhysicsSettings;
use simd_model::RobotModel;

use crate::World;
use crate::scene::{Held, Scene, TIME_STEP};

pub(crate) struct Rapier {
    model: std::sync::Arc<RobotModel>,
    tree: Tree,
    joints: Vec<Held>,
    copies: usize,
    world: PhysicsWorld,
}

impl Rapier {
    pub(crate) fn new(scene: &Scene) -> Self {
        let model = scene.model();
        let tree = Tree::new(&model, !scene.free);
        let mut new =
            Self { model, tree, joints: scene.joints(), copies: scene.copies, world: PhysicsWorld::new() };
        new.put_back();
        new
    }

    fn add(&mut self, world_from_root: DPose3) {
        let mut handles: Vec<RigidBodyHandle> = Vec::new();
        if self.tree.fixed_base {
            handles.push(self.world.insert_body(RigidBodyBuilder::fixed().pose(world_from_root)));
        }
        let base = handles.len();
        let mut held = self.joints.iter();
        for body in &self.tree.bodies {
            let builder = RigidBodyBuilder::dynamic()
                .pose(world_from_root)
                .can_sleep(false)
                .additional_mass_properties(mass_properties(&body.inertia));
            let handle = self.world.insert_body(builder);
            let axis = match body.joint_type {
                JointType::Revolute => Some((JointAxis::AngZ, JointAxesMask::ANG_Z)),
                JointType::Prismatic => Some((JointAxis::LinZ, JointAxesMask::LIN_Z)),
                // No robot of the benches has a ball joint.
                JointType::Free { .. } | JointType::Spherical { .. } => None,
            };
            if let (Some((axis, free)), Some(held)) = (axis, body.joint.and_then(|_| held.next())) {
                let at_zero = &body.at_zero;
                let frame = DPose3::from_parts(at_zero.origin, DQuat::from_mat3(&at_zero.rotation));
                let mut joint =
                    GenericJointBuilder::new(JointAxesMask::all() & !free).local_frame1(frame).build();
                if let Some((stiffness, damping)) = held.gains {
                    joint.set_motor_model(axis, MotorModel::ForceBased);
                    joint.set_motor(axis, held.position, 0.0, stiffness, damping);
                    joint.set_motor_max_force(axis, held.effort.unwrap_or(f64::MAX));
                }
                let limits = body.joint.map(|joint| self.model.joints[joint].limits);
                if let Some((lower, upper)) = limits.and_then(|limits| limits.lower.zip(limits.upper)) {
                    joint.set_limits(axis, [lower, upper]);
                }
                let parent = body.parent.map_or(handles[0], |parent| handles[base + parent]);
                assert!(self.world.multibody_joints.insert(parent, handle, joint, true).is_some());
            }
            handles.push(handle);
        }
        self.settle(handles[0], base);
    }

    /// Puts the joints of a robot at their positions, and its damping and pairs in force.
    fn settle(&mut self, root: RigidBodyHandle, base: usize) {
        let PhysicsWorld { multibody_joints, bodies, .. } = &mut self.world;
        let handle = multibody_joints.rigid_body_link(root).map(|link| link.multibody);
        let Some(robot) = handle.and_then(|handle| multibody_joints.get_multibody_mut(handle)) else {
            return;
        };
        robot.forward_kinematics(bodies, true);
        let first = self.tree.root_velocities();
        let positions = self.joints.iter().map(|joint| joint.position);
        let q: Vec<f64> = std::iter::repeat_n(0.0, first).chain(positions).collect();
        robot.apply_displacements(&q);
        robot.damping_mut().fill(0.0);
        for body in &self.tree.bodies {
            if let Some(joint) = body.joint {
                robot.damping_mut()[body.velocity] = self.model.joints[joint].damping;
            }
        }
        for pair in &self.tree.mimics {
            let axis = |body: usize| match self.tree.bodies[body].joint_type {
                JointType::Prismatic => 2,
                _ => 5,
            };
            robot.add_dof_coupling(MultibodyDofCoupling {
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
        robot.forward_kinematics(bodies, false);
        robot.update_rigid_bodies(bodies, true);
    }
}

impl World for Rapier {
    fn put_back(&mut self) {
        self.world = PhysicsWorld::new();
        self.world.gravity = PhysicsSettings::default().gravity;
        self.world.integration_parameters.dt = TIME_STEP;
        // Substeps, four by default.
        self.world.integration_parameters.num_solver_iterations = 1;
        for copy in 0..self.copies {
            self.add(Scene::root_pose(copy));
        }
    }

    fn step(&mut self) {
        self.world.step();
    }

    fn error(&self) -> f64 {
        let mut largest = 0.0f64;
        for robot in self.world.multibody_joints.multibodies() {
            for (link, held) in robot.links().skip(1).zip(&self.joints) {
                // All but one of the coordinates are locked at zero.
                let at: f64 = link.joint().coords().iter().sum();
                largest = largest.max((at - held.position).abs());
            }
        }
        largest
    }
}

fn mass_properties(inertia: &Rigid) -> MassProperties {
    let center = inertia.first_moment / inertia.mass;
    // The moment is about the body's origin, rapier's about the centre of mass.
    let about_center = inertia.shifted(-center).moment;
    MassProperties::with_inertia_matrix(center, inertia.mass, about_center.matrix())
}
