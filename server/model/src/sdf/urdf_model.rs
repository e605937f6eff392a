//! A URDF that an SDF includes: its robot as a model.
//!
//! The reader of URDF decides what it means. Frames of links are those with all joints at zero, as Gazebo
//! converts it.

use std::collections::{BTreeMap, BTreeSet};

use glamx::DPose3;

use super::Reader;
use super::files::joined;
use super::joint::{Axis, Joint};
use super::model::{Model, Placement};
use crate::assets::{Asset, Assets};
use crate::report::Disposition::Ignored;
use crate::report::{Disposition, LoadReport};
use crate::robot::{Collision, Geometry, JointKind, Link, RobotModel, Visual};
use crate::setup::{DriveMode, JointSetup, Setup};
use crate::translation::draft::{At, DraftDrive, DraftGeometry, DraftLink, DraftShape};
use crate::translation::element::Element;
use crate::translation::notes::Stop;
use crate::urdf::findings::quoted;
use crate::urdf::{self, ReadOptions};

/// Files whose names are relative to a folder.
struct Within<'a> {
    assets: &'a dyn Assets,
    folder: &'a str,
}

impl Assets for Within<'_> {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        self.assets.find(&joined(self.folder, uri))
    }
}

impl<'a> Reader<'a> {
    /// Reads a `<robot>`, the root of an included file.
    pub(super) fn urdf_model(
        &mut self,
        include: Element<'a>,
        robot: Element<'a>,
    ) -> Result<(Model, Placement), Stop> {
        let folder = robot.folder();
        let text = robot.node.document().input_text();
        let files = Within { assets: self.assets, folder };
        let options = ReadOptions { limits: *self.limits, ..ReadOptions::default() };
        let uri = robot.file_name().unwrap_or_default();
        let (read, report) = urdf::read(text.as_bytes(), &files, &options)
            .map_err(|refused| Stop::at(include, format!("{}: {}", quoted(uri), refused.message)))?;
        self.take_report(uri, &read, report);
        self.links += read.links.len();
        if self.links > crate::MAX_LINKS {
            let message = format!("all its models together have more than {} links", crate::MAX_LINKS);
            return Err(Stop::at(include, message));
        }
        let at = (robot.file, robot.line());
        let model = self.model_of(&read, at, folder, include);
        Ok((model, Placement::at_origin()))
    }

    /// Takes over the findings about the robot, except for those that the translated text gets again.
    fn take_report(&mut self, uri: &str, read: &RobotModel, report: LoadReport) {
        let meshes = read.links.iter().flat_map(|link| {
            let visuals = link.visuals.iter().map(|visual| &visual.geometry);
            visuals.chain(link.collisions.iter().map(|collision| &collision.geometry))
        });
        let meshes: Vec<&str> = meshes
            .filter_map(|geometry| match geometry {
                Geometry::Mesh { uri, .. } => Some(uri.as_str()),
                _ => None,
            })
            .collect();
        for finding in report.findings {
            let is_again = finding.file.as_deref().is_some_and(|file| meshes.contains(&file));
            if finding.disposition != Disposition::Used && !is_again {
                self.notes.of_file(uri, finding);
            }
        }
    }

    fn model_of(&mut self, read: &RobotModel, at: At, folder: &str, include: Element<'a>) -> Model {
        let Setup {
            self_collision, stays_awake, ref states, ref pairs, ref constraints, ref sensors, ..
        } = read.setup;
        let left_out = [
            ("sensors", sensors.len()),
            ("constraints", constraints.len()),
            ("named states", states.len()),
            ("switched collisions of links", pairs.len()),
        ];
        for (what, count) in left_out.into_iter().filter(|(_, count)| *count > 0) {
            let message = format!("{what} of an included URDF are left out ({count}): load it separately");
            self.notes.warn(include, Ignored, message);
        }
        let mut poses: Vec<DPose3> = vec![DPose3::IDENTITY];
        for joint in &read.joints {
            let parent = poses.get(joint.parent).copied().unwrap_or(DPose3::IDENTITY);
            poses.push(parent * joint.parent_from_joint);
        }
        let names: Vec<&str> = read.links.iter().map(|link| link.name.as_str()).collect();
        let name = |index: usize| names.get(index).copied().unwrap_or_default().to_owned();
        let mut model = Model {
            name: read.name.clone(),
            at,
            is_static: false,
            self_collide: self_collision,
            stays_awake,
            links: Vec::new(),
            joints: Vec::new(),
            frames: BTreeMap::new(),
            named: Vec::new(),
            canonical: names.first().map(|name| (*name).to_owned()),
            attached: BTreeMap::new(),
            absent: BTreeSet::new(),
        };
        for (index, (one, pose)) in read.links.iter().zip(&poses).enumerate() {
            let mut made = link(one, at, folder);
            let groups = read.setup.groups.iter().find(|groups| groups.link == index);
            made.groups = groups.map(|groups| [groups.group, groups.mask]);
            model.frames.insert(one.name.clone(), *pose);
            model.attached.insert(one.name.clone(), one.name.clone());
            model.links.push((made, *pose));
        }
        for (index, one) in read.joints.iter().enumerate() {
            let model_from_joint = poses.get(one.child).copied().unwrap_or(DPose3::IDENTITY);
            model.frames.entry(one.name.clone()).or_insert(model_from_joint);
            model.attached.entry(one.name.clone()).or_insert_with(|| name(one.child));
            let setup = read.setup.joints.iter().find(|setup| setup.joint == index).copied();
            let setup = setup.unwrap_or(JointSetup { joint: index, ..JointSetup::default() });
            let kind = match one.kind {
                JointKind::Fixed | JointKind::Spherical => None,
                JointKind::Revolute => Some("revolute"),
                JointKind::Continuous => Some("continuous"),
                JointKind::Prismatic => Some("prismatic"),
                // Without a joint the child is a robot that moves freely.
                JointKind::Floating => continue,
                JointKind::Planar => {
                    let message =
                        format!("the planar joint {} of an included URDF: left out", quoted(&one.name));
                    self.notes.warn(include, Ignored, message);
                    continue;
                }
            };
            let axis = |kind| Axis {
                kind,
                direction: one.axis,
                limits: one.limits,
                damping: one.damping,
                friction: one.friction,
                spring: setup.spring.map(|spring| [spring.stiffness, spring.rest]),
                armature: setup.armature,
                drive: drive(&setup),
                position: setup.position,
            };
            let mimic = one.mimic.and_then(|mimic| {
                let leader = read.joints.get(mimic.joint)?;
                Some((leader.name.clone(), mimic.multiplier, mimic.offset))
            });
            model.joints.push(Joint {
                name: one.name.clone(),
                at,
                parent: Some(name(one.parent)),
                child: name(one.child),
                model_from_joint,
                axes: kind.map(axis).into_iter().collect(),
                is_ball: one.kind == JointKind::Spherical,
                mimic,
                sensors: Vec::new(),
            });
        }
        model
    }
}

/// Returns the drive of a joint; `None` holds its position.
fn drive(setup: &JointSetup) -> Option<DraftDrive> {
    let JointSetup { mode, stiffness, damping, gravity_compensation, .. } = *setup;
    let command = match mode {
        None => Some("position"),
        Some(DriveMode::Velocity) => Some("velocity"),
        Some(DriveMode::Effort) => Some("effort"),
        Some(DriveMode::Passive) => None,
    };
    let drive = DraftDrive { command, stiffness, damping, gravity_compensation };
    (drive != DraftDrive { command: Some("position"), ..DraftDrive::default() }).then_some(drive)
}

fn link(read: &Link, at: At, folder: &str) -> DraftLink {
    let mut link = DraftLink::bare(read.name.clone(), at);
    link.inertial = Some(read.inertial);
    let visual = |visual: &Visual| {
        let Visual { link_from_shape, geometry: of, color, texture } = visual;
        let texture = texture.as_ref().map(|picture| (joined(folder, &picture.uri), picture.repeat));
        DraftShape {
            at,
            link_from_shape: *link_from_shape,
            geometry: geometry(of, folder),
            color: *color,
            texture,
        }
    };
    link.visuals = read.visuals.iter().map(visual).collect();
    let collision = |collision: &Collision| DraftShape {
        at,
        link_from_shape: collision.link_from_shape,
        geometry: geometry(&collision.geometry, folder),
        color: None,
        texture: None,
    };
    link.collisions = read.collisions.iter().map(collision).collect();
    link.material = read.collisions.first().map(|first| first.material).unwrap_or_default();
    link
}

fn geometry(read: &Geometry, folder: &str) -> DraftGeometry {
    match read {
        Geometry::Box { size } => DraftGeometry::Box { size: *size },
        Geometry::Sphere { radius } => DraftGeometry::Sphere { radius: *radius },
        Geometry::Cylinder { radius, length } => DraftGeometry::Cylinder { radius: *radius, length: *length },
        Geometry::Capsule { radius, length } => DraftGeometry::Capsule { radius: *radius, length: *length },
        Geometry::Cone { radius, length } => DraftGeometry::Cone { radius: *radius, length: *length },
        Geometry::Plane { normal } => DraftGeometry::Plane { normal: *normal },
        Geometry::Mesh { uri, scale, .. } => DraftGeometry::Mesh { uri: joined(folder, uri), scale: *scale },
    }
}
