//! A robot on its way to URDF: links, joints and what belongs to them, as SDF and MJCF both give it. SI units, radians.

use std::collections::{BTreeMap, BTreeSet};

use glamx::{DPose3, DVec3};

use crate::robot::{Inertial, JointLimits, Material, TextureRepeat};

/// Where something stands: index of the file, and line; 0 is none.
pub(crate) type At = (usize, u32);

/// A robot.
#[derive(Clone, Debug, Default)]
pub(crate) struct Draft {
    pub(crate) name: String,
    pub(crate) at: At,
    /// `world_from_root`.
    pub(crate) pose: DPose3,
    /// Its root link does not move.
    pub(crate) fixed: bool,
    /// The first is the root.
    pub(crate) links: Vec<DraftLink>,
    pub(crate) joints: Vec<DraftJoint>,
    pub(crate) states: Vec<DraftState>,
    /// Links of one name each that do not touch.
    pub(crate) excluded: Vec<([String; 2], At)>,
    pub(crate) self_collision: bool,
    pub(crate) constraints: Vec<DraftConstraint>,
}

/// What holds links together beside the joints.
#[derive(Clone, Debug)]
pub(crate) struct DraftConstraint {
    pub(crate) name: String,
    pub(crate) at: At,
    pub(crate) kind: DraftConstraintKind,
    /// Parent and child.
    pub(crate) ends: [DraftEnd; 2],
    /// The links touch each other all the same.
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
    /// Another robot's name; none is its own.
    pub(crate) robot: Option<String>,
    /// A link, of a gear a joint; none is the world.
    pub(crate) name: Option<String>,
    /// `link_from_frame`; of the world in the frame that the root link begins at.
    pub(crate) pose: DPose3,
}

#[derive(Clone, Debug)]
pub(crate) struct DraftLink {
    pub(crate) name: String,
    pub(crate) at: At,
    /// `None` leaves it to the reader of URDF.
    pub(crate) inertial: Option<Inertial>,
    pub(crate) visuals: Vec<DraftShape>,
    pub(crate) collisions: Vec<DraftShape>,
    pub(crate) material: Material,
    /// Bits of the groups that it is in, and of those that it touches.
    pub(crate) groups: Option<[u32; 2]>,
    pub(crate) sensors: Vec<DraftSensor>,
}

/// What measures: as it is written into a `<sensor>` of its link or joint.
#[derive(Clone, Debug)]
pub(crate) struct DraftSensor {
    pub(crate) name: String,
    pub(crate) at: At,
    /// A word that the reader of URDF knows.
    pub(crate) kind: String,
    /// `link_from_sensor`, of a joint in the frame of the joint's child.
    pub(crate) pose: DPose3,
    /// What is in it beside the pose, a line each, with how deep it stands.
    pub(crate) lines: Vec<(At, usize, String)>,
}

#[derive(Clone, Debug)]
pub(crate) struct DraftShape {
    pub(crate) at: At,
    pub(crate) link_from_shape: DPose3,
    pub(crate) geometry: DraftGeometry,
    pub(crate) color: Option<[f64; 4]>,
    /// URI of a picture, and how often it is there.
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

/// A joint. Its child's frame is the joint's where nothing is between them.
#[derive(Clone, Debug)]
pub(crate) struct DraftJoint {
    pub(crate) name: String,
    pub(crate) at: At,
    /// URDF's word.
    pub(crate) kind: &'static str,
    pub(crate) parent: String,
    pub(crate) child: String,
    pub(crate) parent_from_joint: DPose3,
    pub(crate) axis: DVec3,
    pub(crate) limits: JointLimits,
    pub(crate) damping: f64,
    pub(crate) friction: f64,
    pub(crate) armature: f64,
    /// The joint that it follows, how many times, plus what.
    pub(crate) mimic: Option<(String, f64, f64)>,
    /// Stiffness, and the position at rest.
    pub(crate) spring: Option<[f64; 2]>,
    pub(crate) drive: Option<DraftDrive>,
    /// Where it starts.
    pub(crate) position: Option<f64>,
    pub(crate) sensors: Vec<DraftSensor>,
}

/// What drives a joint.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct DraftDrive {
    /// `position`, `velocity`, `effort`, or `None`, which is measured and not driven.
    pub(crate) command: Option<&'static str>,
    pub(crate) stiffness: Option<f64>,
    pub(crate) damping: Option<f64>,
}

#[derive(Clone, Debug)]
pub(crate) struct DraftState {
    pub(crate) name: String,
    pub(crate) at: At,
    /// By joint.
    pub(crate) positions: Vec<(String, f64)>,
}

impl DraftLink {
    /// Without mass or shapes.
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
    /// One that does not move.
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
            spring: None,
            drive: None,
            position: None,
            sensors: Vec::new(),
        }
    }
}

/// Names of which no two are alike.
#[derive(Clone, Debug, Default)]
pub(crate) struct Names {
    taken: BTreeSet<String>,
    /// How far a name that was taken has been counted, so that many of one name do not take long.
    counts: BTreeMap<String, usize>,
}

impl Names {
    /// Takes a name if it is free.
    pub(crate) fn take(&mut self, name: &str) -> bool {
        !self.taken.contains(name) && self.taken.insert(name.to_owned())
    }

    /// Takes this name, or with `_2`, `_3` and so on one that is free.
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
