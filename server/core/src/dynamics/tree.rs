//! A robot as a tree of moving bodies: its immutable structure.
//!
//! Links that fixed joints connect are one body. A body's frame has its origin at its joint and, for joints
//! of one axis, its z along that axis.

use std::ops::Range;

use glamx::{DMat3, DPose3, DQuat, DVec3};
use simd_model::RobotModel;
use simd_model::robot::{Inertial, Joint, JointKind};

use super::inertia::Rigid;
use super::spatial::Placement;

/// Rotation of x to y, y to z and z to x. It converts the axes of a body of a ball joint to those of the
/// next, whose z is the joint's next axis.
pub const NEXT_AXIS: DMat3 = DMat3::from_cols(DVec3::Y, DVec3::Z, DVec3::X);

/// A robot as a tree of moving bodies, parents before children.
#[derive(Debug)]
pub struct Tree {
    /// Bodies in the depth-first order of the model; a free root is the first.
    pub bodies: Vec<Body>,
    /// Frame of each link of the model.
    pub links: Vec<LinkFrame>,
    /// Bodies of each joint of the model: none for a fixed joint, three for a planar or spherical one.
    pub joints: Vec<Range<usize>>,
    /// Joints that follow others.
    pub mimics: Vec<MimicPair>,
    /// Joints whose positions are sums of others.
    pub tendons: Vec<Tendon>,
    /// Length of the position vector.
    pub position_count: usize,
    /// Length of the velocity vector.
    pub velocity_count: usize,
    /// Whether the root link cannot move.
    pub fixed_base: bool,
    /// Inertia of the body if it is the only one and free.
    pub single: Option<SingleBody>,
}

/// Inertia of a rigid body that moves alone.
#[derive(Clone, Copy, Debug)]
pub struct SingleBody {
    /// Inverse of the mass, 1/kg.
    pub inverse_mass: f64,
    /// Centre of mass in the body's frame, metres.
    pub center: DVec3,
    /// Inverse of the moment about that centre, body axes.
    pub inverse_moment: DMat3,
}

/// A body that moves on a joint.
#[derive(Clone, Debug)]
pub struct Body {
    /// Parent body; `None` is the base: the fixed root link, or the world if the root is free.
    pub parent: Option<usize>,
    /// Type of its joint.
    pub joint_type: JointType,
    /// `parent_from_body` at position zero.
    pub at_zero: Placement,
    /// Inertia of all its links, in its own frame.
    pub inertia: Rigid,
    /// First of its positions; a ball joint's three bodies share four.
    pub position: usize,
    /// First of its velocities.
    pub velocity: usize,
    /// Joint of the model; `None` for a free root.
    pub joint: Option<usize>,
    /// Whether it is the body of a [`Tendon`].
    pub is_tendon: bool,
}

/// Motion of a body in its parent's frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointType {
    /// Turns about its z: one position, one velocity.
    Revolute,
    /// Slides along its z: one position, one velocity.
    Prismatic,
    /// Turns about its z, one of the three axes of a ball joint; see [`spherical`](super::spherical). One
    /// velocity. The first has the position of all three, a quaternion x y z w; the others have none.
    Spherical {
        /// 0, 1 or 2: x, y or z of the last of the three.
        axis: u8,
    },
    /// Six degrees of freedom. Positions: origin x y z, quaternion x y z w. Velocities:
    /// linear of the origin in the parent's axes, then angular in its own.
    Free {
        /// Index among the tree's free bodies.
        slot: usize,
    },
}

/// Location of a link.
#[derive(Clone, Copy, Debug)]
pub struct LinkFrame {
    /// Body that it belongs to; `None` is the base.
    pub body: Option<usize>,
    /// `body_from_link`.
    pub body_from_link: DPose3,
}

/// `position of follower = multiplier * position of leader + offset`.
#[derive(Clone, Copy, Debug)]
pub struct MimicPair {
    /// Following body.
    pub follower: usize,
    /// Leading body.
    pub leader: usize,
    /// Multiplier, rad or m for each rad or m.
    pub multiplier: f64,
    /// Offset, rad or m.
    pub offset: f64,
}

/// A joint whose position is `sum of factor * position + offset` of others. No body moves with it: its drive,
/// spring, damping, friction and limits act on the others.
#[derive(Clone, Debug)]
pub struct Tendon {
    /// Body of the joint, which has no mass.
    pub body: usize,
    /// Bodies of the other joints, each of one axis, and their factors.
    pub terms: Vec<(usize, f64)>,
    /// Offset, in the unit of the joint.
    pub offset: f64,
}

impl JointType {
    /// Returns its number of positions.
    pub fn positions(self) -> usize {
        match self {
            Self::Revolute | Self::Prismatic => 1,
            Self::Spherical { axis: 0 } => 4,
            Self::Spherical { .. } => 0,
            Self::Free { .. } => 7,
        }
    }

    /// Returns its number of velocities.
    pub fn velocities(self) -> usize {
        match self {
            Self::Revolute | Self::Prismatic | Self::Spherical { .. } => 1,
            Self::Free { .. } => 6,
        }
    }
}

impl Tree {
    /// Creates the tree of a robot whose root link is fixed or free.
    pub fn new(model: &RobotModel, fixed_base: bool) -> Self {
        Self::with_masses(model, fixed_base, |_link| 1.0)
    }

    /// Like [`new`](Self::new), with the mass and the inertia of each link multiplied by a factor of its
    /// index; its centre of mass stays.
    pub fn with_masses(model: &RobotModel, fixed_base: bool, factor: impl Fn(usize) -> f64) -> Self {
        let mut tree = Self {
            bodies: Vec::new(),
            links: Vec::with_capacity(model.links.len()),
            joints: Vec::with_capacity(model.joints.len()),
            mimics: Vec::new(),
            tendons: Vec::new(),
            position_count: 0,
            velocity_count: 0,
            fixed_base,
            single: None,
        };
        let root =
            (!fixed_base).then(|| tree.push(None, JointType::Free { slot: 0 }, Placement::IDENTITY, None));
        tree.links.push(LinkFrame { body: root, body_from_link: DPose3::IDENTITY });
        for (index, joint) in model.joints.iter().enumerate() {
            let first = tree.bodies.len();
            let link = tree.attach(index, joint);
            tree.links.push(link);
            tree.joints.push(first..tree.bodies.len());
        }
        for (index, (link, frame)) in model.links.iter().zip(&tree.links).enumerate() {
            if let Some(body) = frame.body {
                let Inertial { mass, center_of_mass, inertia } = link.inertial;
                let factor = factor(index);
                let inertial = Inertial { mass: mass * factor, center_of_mass, inertia: inertia * factor };
                tree.bodies[body].inertia += inertia_in_body(&inertial, frame.body_from_link);
            }
        }
        tree.mimics = mimics(model, &tree.joints);
        tree.tendons = tendons(model, &tree.joints);
        for tendon in &tree.tendons {
            tree.bodies[tendon.body].is_tendon = true;
        }
        tree.single = match &tree.bodies[..] {
            [body] if !fixed_base => {
                let Rigid { mass, first_moment, .. } = body.inertia;
                let center = first_moment / mass;
                let inverse_moment = body.inertia.shifted(-center).moment.matrix().inverse();
                Some(SingleBody { inverse_mass: 1.0 / mass, center, inverse_moment })
            }
            _ => None,
        };
        tree
    }

    /// Returns whether a joint of the model turns or slides about one axis.
    pub fn has_one_axis(&self, joint: usize) -> bool {
        let bodies = self.joints.get(joint).map_or(&[][..], |bodies| &self.bodies[bodies.clone()]);
        matches!(bodies, [body] if !matches!(body.joint_type, JointType::Free { .. }))
    }

    /// Returns the number of bodies with six degrees of freedom.
    pub fn free_bodies(&self) -> usize {
        self.bodies.iter().filter(|body| matches!(body.joint_type, JointType::Free { .. })).count()
    }

    /// Returns for each velocity the next one on the way to the root.
    pub fn velocity_parents(&self) -> impl Iterator<Item = Option<usize>> {
        self.bodies.iter().flat_map(|body| {
            let last = |parent: usize| {
                let parent = &self.bodies[parent];
                parent.velocity + parent.joint_type.velocities() - 1
            };
            let (first, above) = (body.velocity, body.parent.map(last));
            let own = first..first + body.joint_type.velocities();
            own.map(move |velocity| if velocity == first { above } else { Some(velocity - 1) })
        })
    }

    /// Returns the number of the root's positions: 7 if it is free, else 0.
    pub fn root_positions(&self) -> usize {
        if self.fixed_base { 0 } else { 7 }
    }

    /// Returns the number of the root's velocities: 6 if it is free, else 0.
    pub fn root_velocities(&self) -> usize {
        if self.fixed_base { 0 } else { 6 }
    }

    /// Adds the bodies of a joint, and returns the frame of its child link.
    fn attach(&mut self, index: usize, joint: &Joint) -> LinkFrame {
        let parent = self.links[joint.parent];
        let body_from_joint = parent.body_from_link * joint.parent_from_joint;
        let one_axis = |tree: &mut Self, joint_type, parent, frame: DPose3, axis| {
            // The body's z is the joint's axis; the link keeps its own frame in the body.
            let joint_from_body = DQuat::from_rotation_arc(DVec3::Z, axis);
            let at_zero = Placement::new(frame.rotation * joint_from_body, frame.translation);
            let body = tree.push(parent, joint_type, at_zero, Some(index));
            LinkFrame { body: Some(body), body_from_link: DPose3::from_rotation(joint_from_body.inverse()) }
        };
        match joint.kind {
            JointKind::Fixed => LinkFrame { body: parent.body, body_from_link: body_from_joint },
            JointKind::Revolute | JointKind::Continuous => {
                one_axis(self, JointType::Revolute, parent.body, body_from_joint, joint.axis)
            }
            JointKind::Prismatic => {
                one_axis(self, JointType::Prismatic, parent.body, body_from_joint, joint.axis)
            }
            JointKind::Planar => {
                // Two prismatic axes through bodies without mass, then a turn about the normal.
                let plane = DQuat::from_rotation_arc(DVec3::Z, joint.axis);
                let mut at = LinkFrame { body: parent.body, body_from_link: body_from_joint };
                for (joint_type, axis) in [
                    (JointType::Prismatic, plane * DVec3::X),
                    (JointType::Prismatic, plane * DVec3::Y),
                    (JointType::Revolute, joint.axis),
                ] {
                    at = one_axis(self, joint_type, at.body, at.body_from_link, axis);
                }
                at
            }
            JointKind::Spherical => {
                let mut at_zero = Placement::new(body_from_joint.rotation, body_from_joint.translation);
                let mut parent = parent.body;
                for axis in 0..3 {
                    parent = Some(self.push(parent, JointType::Spherical { axis }, at_zero, Some(index)));
                    at_zero = Placement { rotation: NEXT_AXIS, origin: DVec3::ZERO };
                }
                LinkFrame { body: parent, body_from_link: DPose3::IDENTITY }
            }
            JointKind::Floating => {
                let joint_type = JointType::Free { slot: self.free_bodies() };
                let at_zero = Placement::new(body_from_joint.rotation, body_from_joint.translation);
                let body = self.push(parent.body, joint_type, at_zero, Some(index));
                LinkFrame { body: Some(body), body_from_link: DPose3::IDENTITY }
            }
        }
    }

    fn push(
        &mut self,
        parent: Option<usize>,
        joint_type: JointType,
        at_zero: Placement,
        joint: Option<usize>,
    ) -> usize {
        let position = match joint_type {
            // Those of the first body.
            JointType::Spherical { axis: 1.. } => self.position_count - 4,
            _ => self.position_count,
        };
        self.bodies.push(Body {
            parent,
            joint_type,
            at_zero,
            inertia: Rigid::default(),
            position,
            velocity: self.velocity_count,
            joint,
            is_tendon: false,
        });
        self.position_count += joint_type.positions();
        self.velocity_count += joint_type.velocities();
        self.bodies.len() - 1
    }
}

/// Returns a link's inertia in the frame of its body.
fn inertia_in_body(inertial: &Inertial, body_from_link: DPose3) -> Rigid {
    let rotation = DMat3::from_quat(body_from_link.rotation);
    Rigid::new(
        inertial.mass,
        body_from_link.transform_point(inertial.center_of_mass),
        &(rotation * inertial.inertia * rotation.transpose()),
    )
}

/// Returns the pairs of one-axis joints of which one follows the other.
fn mimics(model: &RobotModel, joints: &[Range<usize>]) -> Vec<MimicPair> {
    let single = |joint: usize| joints.get(joint).filter(|bodies| bodies.len() == 1).map(|b| b.start);
    model
        .joints
        .iter()
        .enumerate()
        .filter_map(|(index, joint)| {
            let mimic = joint.mimic?;
            Some(MimicPair {
                follower: single(index)?,
                leader: single(mimic.joint)?,
                multiplier: mimic.multiplier,
                offset: mimic.offset,
            })
        })
        .collect()
}

/// Returns the joints that are sums of others. All of them have one axis.
fn tendons(model: &RobotModel, joints: &[Range<usize>]) -> Vec<Tendon> {
    let single = |joint: usize| joints.get(joint).filter(|bodies| bodies.len() == 1).map(|b| b.start);
    let of = |tendon: &simd_model::setup::Tendon| {
        let terms = tendon.terms.iter().map(|(joint, factor)| Some((single(*joint)?, *factor)));
        Some(Tendon {
            body: single(tendon.joint)?,
            terms: terms.collect::<Option<_>>()?,
            offset: tendon.offset,
        })
    };
    model.setup.tendons.iter().filter_map(of).collect()
}
