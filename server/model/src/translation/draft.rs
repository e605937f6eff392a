//! A robot before it is written as URDF: links, joints and their settings, from SDF or MJCF. SI units,
//! radians.

use std::collections::{BTreeMap, BTreeSet};

use glamx::{DPose3, DVec3};

use crate::robot::{Inertial, JointLimits, Material, TextureRepeat};

/// A place: index of the file, and line; 0 means none.
pub(crate) type At = (usize, u32);

/// A place of lines whose use the report does not list.
pub(crate) const UNLISTED: At = (usize::MAX, 0);

/// A robot.
#[derive(Clone, Debug, Default)]
pub(crate) struct Draft {
    pub(crate) name: String,
    pub(crate) at: At,
    /// `world_from_root`.
    pub(crate) pose: DPose3,
    /// Whether its root link is fixed.
    pub(crate) fixed: bool,
    /// The first is the root.
    pub(crate) links: Vec<DraftLink>,
    pub(crate) joints: Vec<DraftJoint>,
    /// Frames that [`frames::hang`](super::frames::hang) makes links of.
    pub(crate) frames: Vec<DraftFrame>,
    pub(crate) states: Vec<DraftState>,
    /// Pairs of links that do not collide, by name.
    pub(crate) excluded: Vec<([String; 2], At)>,
    pub(crate) self_collision: bool,
    pub(crate) stays_awake: bool,
    pub(crate) constraints: Vec<DraftConstraint>,
}

/// A constraint of links in addition to the joints.
#[derive(Clone, Debug)]
pub(crate) struct DraftConstraint {
    pub(crate) name: String,
    pub(crate) at: At,
    pub(crate) kind: DraftConstraintKind,
    /// Parent and child.
    pub(crate) ends: [DraftEnd; 2],
    /// Whether the links collide nevertheless.
    pub(crate) collisions: bool,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum DraftConstraintKind {
    Weld,
    PointToPoint,
    Hinge(DVec3),
    Slide(DVec3),
    /// Ratio and offset.
    Gear(f64, f64),
}

#[derive(Clone, Debug)]
pub(crate) struct DraftEnd {
    /// Name of another robot; `None` is its own.
    pub(crate) robot: Option<String>,
    /// A link, or for a gear a joint; `None` is the world.
    pub(crate) name: Option<String>,
    /// `link_from_frame`; for the world, in the initial frame of the root link.
    pub(crate) pose: DPose3,
}

/// A frame that has a name and is fixed to a link.
#[derive(Clone, Debug)]
pub(crate) struct DraftFrame {
    pub(crate) name: String,
    pub(crate) link: String,
    pub(crate) link_from_frame: DPose3,
}

#[derive(Clone, Debug)]
pub(crate) struct DraftLink {
    pub(crate) name: String,
    pub(crate) at: At,
    /// `None`: the reader of URDF computes it.
    pub(crate) inertial: Option<Inertial>,
    pub(crate) visuals: Vec<DraftShape>,
    pub(crate) collisions: Vec<DraftShape>,
    pub(crate) material: Material,
    /// Bits of its groups, and of the groups that it collides with.
    pub(crate) groups: Option<[u32; 2]>,
    pub(crate) sensors: Vec<DraftSensor>,
}

/// A sensor, as written into a `<sensor>` of its link or joint.
#[derive(Clone, Debug)]
pub(crate) struct DraftSensor {
    pub(crate) name: String,
    pub(crate) at: At,
    /// Type in URDF.
    pub(crate) kind: String,
    /// `link_from_sensor`; for a joint, in the frame of its child.
    pub(crate) pose: DPose3,
    /// Its lines other than the pose, each with its depth.
    pub(crate) lines: Vec<(At, usize, String)>,
}

#[derive(Clone, Debug)]
pub(crate) struct DraftShape {
    pub(crate) at: At,
    pub(crate) link_from_shape: DPose3,
    pub(crate) geometry: DraftGeometry,
    pub(crate) color: Option<[f64; 4]>,
    /// URI of a picture, and its repetitions.
    pub(crate) texture: Option<(String, TextureRepeat)>,
}

#[derive(Clone, Debug, PartialEq)]
pub(crate) enum DraftGeometry {
    Box { size: DVec3 },
    Sphere { radius: f64 },
    Cylinder { radius: f64, length: f64 },
    Capsule { radius: f64, length: f64 },
    Cone { radius: f64, length: f64 },
    Plane { normal: DVec3 },
    Mesh { uri: String, scale: DVec3 },
}

/// A joint. Its child's frame equals the joint's unless a link is between them.
#[derive(Clone, Debug)]
pub(crate) struct DraftJoint {
    pub(crate) name: String,
    pub(crate) at: At,
    /// Type in URDF.
    pub(crate) kind: &'static str,
    pub(crate) parent: String,
    pub(crate) child: String,
    pub(crate) parent_from_joint: DPose3,
    pub(crate) axis: DVec3,
    pub(crate) limits: JointLimits,
    pub(crate) damping: f64,
    pub(crate) friction: f64,
    pub(crate) armature: f64,
    /// Joint that it follows, multiplier, offset.
    pub(crate) mimic: Option<(String, f64, f64)>,
    /// Joints of which its position is the sum, and their factors; and an offset.
    pub(crate) tendon: Option<(Vec<(String, f64)>, f64)>,
    /// Stiffness, and rest position.
    pub(crate) spring: Option<[f64; 2]>,
    pub(crate) drive: Option<DraftDrive>,
    /// Initial position.
    pub(crate) position: Option<f64>,
    pub(crate) sensors: Vec<DraftSensor>,
}

/// Drive of a joint.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct DraftDrive {
    /// `position`, `velocity`, `effort`, or `None` for a passive joint that is only measured.
    pub(crate) command: Option<&'static str>,
    pub(crate) stiffness: Option<f64>,
    pub(crate) damping: Option<f64>,
    /// Whether position and velocity targets hold the weight of the links beyond the joint.
    pub(crate) gravity_compensation: bool,
}

#[derive(Clone, Debug)]
pub(crate) struct DraftState {
    pub(crate) name: String,
    pub(crate) at: At,
    /// By joint.
    pub(crate) positions: Vec<(String, f64)>,
}

impl DraftLink {
    /// Makes a link without mass or shapes.
    pub(crate) fn bare(name: String, at: At) -> Self {
        Self {
            name,
            at,
            inertial: Some(Inertial::ZERO),
            visuals: Vec::new(),
            collisions: Vec::new(),
            material: Material::default(),
            groups: None,
            sensors: Vec::new(),
        }
    }
}

impl DraftJoint {
    /// Makes a fixed joint.
    pub(crate) fn fixed(
        name: String,
        at: At,
        [parent, child]: [String; 2],
        parent_from_joint: DPose3,
    ) -> Self {
        Self {
            name,
            at,
            kind: "fixed",
            parent,
            child,
            parent_from_joint,
            axis: DVec3::Z,
            limits: JointLimits::default(),
            damping: 0.0,
            friction: 0.0,
            armature: 0.0,
            mimic: None,
            tendon: None,
            spring: None,
            drive: None,
            position: None,
            sensors: Vec::new(),
        }
    }
}

/// Unique names.
#[derive(Clone, Debug, Default)]
pub(crate) struct Names {
    taken: BTreeSet<String>,
    /// Last number that was tried for a taken name, so that many equal names do not take long.
    counts: BTreeMap<String, usize>,
}

impl Names {
    /// Takes a name if it is free.
    pub(crate) fn take(&mut self, name: &str) -> bool {
        !self.taken.contains(name) && self.taken.insert(name.to_owned())
    }

    /// Takes this name, or the first free one with `_2`, `_3` and so on.
    pub(crate) fn unique(&mut self, name: &str) -> String {
        if self.take(name) {
            return name.to_owned();
        }
        loop {
            let count = self.counts.entry(name.to_owned()).or_insert(1);
            *count += 1;
            let counted = format!("{name}_{count}");
            if self.take(&counted) {
                return counted;
            }
        }
    }
}
