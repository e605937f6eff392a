//! Bodies: their contents, and their pose in the parent.

use glamx::{DMat3, DPose3, DVec3};

use super::geom::Geom;
use super::joint::BodyJoint;
use super::{Reader, files, geom, joint, value};
use crate::inertia;
use crate::report::Disposition::{Ignored, Repaired, Used};
use crate::robot::Inertial;
use crate::translation::draft::{At, DraftFrame};
use crate::translation::element::Element;
use crate::translation::notes::Stop;

/// A body, or the world, which is the first.
#[derive(Clone, Debug)]
pub(super) struct Body {
    pub(super) name: String,
    pub(super) at: At,
    /// Index of the parent body; the world's is its own.
    pub(super) parent: usize,
    pub(super) parent_from_body: DPose3,
    /// Mass and inertia, from any source.
    pub(super) inertial: Inertial,
    /// In their order.
    pub(super) joints: Vec<BodyJoint>,
    /// Whether it has no joint to a parent.
    pub(super) is_free: bool,
    pub(super) geoms: Vec<Geom>,
    /// Sites with a name.
    pub(super) sites: Vec<DraftFrame>,
    /// Its tree never sleeps.
    pub(super) stays_awake: bool,
    /// Part of its weight that something else carries.
    pub(super) gravity_compensation: f64,
    /// Whether its joints compensate the weight of what they carry: see `gravity`.
    pub(super) compensates: bool,
    /// Mass, centre and inertia of its `<inertial>`, if it has one.
    given: Option<Inertial>,
}

/// Elements around the content of a body.
#[derive(Clone, Copy)]
pub(super) struct Inside<'s> {
    /// Class of elements that name none.
    pub(super) class: Option<usize>,
    /// `body_from_frame`, within a `<frame>`.
    pub(super) frame: DPose3,
    /// Suffix of names, within a `<replicate>`.
    pub(super) suffix: &'s str,
    /// Prefix of names, within an `<attach>`.
    pub(super) prefix: &'s str,
    pub(super) depth: usize,
}

/// Nesting depth of bodies.
const MAX_DEPTH: usize = 100;

impl Inside<'_> {
    pub(super) fn world() -> Self {
        Self { class: None, frame: DPose3::IDENTITY, suffix: "", prefix: "", depth: 0 }
    }

    /// Returns the name of an element, if it has one.
    fn named(&self, element: Element) -> Option<String> {
        element.word("name").map(|name| format!("{}{name}{}", self.prefix, self.suffix))
    }
}

impl Body {
    pub(super) fn world(root: Element) -> Self {
        Self {
            name: "world".to_owned(),
            at: (root.file, root.line()),
            parent: 0,
            parent_from_body: DPose3::IDENTITY,
            inertial: Inertial::ZERO,
            joints: Vec::new(),
            is_free: false,
            geoms: Vec::new(),
            sites: Vec::new(),
            stays_awake: false,
            gravity_compensation: 0.0,
            compensates: false,
            given: None,
        }
    }

    /// Returns whether it has no weight.
    pub(super) fn is_light(&self) -> bool {
        self.inertial.mass == 0.0
    }

    /// Returns whether something else carries its whole weight.
    pub(super) fn is_held(&self) -> bool {
        self.gravity_compensation == 1.0
    }
}

impl<'a> Reader<'a> {
    /// Reads the content of a body, a frame or the world.
    pub(super) fn content(
        &mut self,
        section: Element<'a>,
        body: usize,
        inside: Inside<'_>,
    ) -> Result<(), Stop> {
        if inside.depth > MAX_DEPTH {
            let message = format!("bodies are nested deeper than {MAX_DEPTH} levels");
            return Err(Stop::at(section, message));
        }
        for element in files::expanded(section, self.sources, self.file_indices)? {
            self.one(element, body, inside)?;
        }
        Ok(())
    }

    /// Reads an element of a body, a frame or the world.
    pub(super) fn one(&mut self, element: Element<'a>, body: usize, inside: Inside<'_>) -> Result<(), Stop> {
        self.count_replicated(element, inside)?;
        match element.tag() {
            "body" => self.body(element, body, inside)?,
            "frame" => {
                let frame = self.scope.classes.of(element, None, ["frame", "frame"]);
                let pose = frame.pose(&self.scope.compiler, &mut self.notes)?;
                let class = element
                    .word("childclass")
                    .and_then(|name| self.scope.classes.find(name))
                    .or(inside.class);
                let inner = Inside { class, frame: inside.frame * pose, depth: inside.depth + 1, ..inside };
                self.content(element, body, inner)?;
            }
            "geom" => self.geom(element, body, inside)?,
            "joint" | "freejoint" => self.joint(element, body, inside)?,
            "inertial" => {
                let given = self.inertial(element, inside)?;
                if let Some(slot) = self.bodies.get_mut(body) {
                    slot.given = Some(given);
                }
            }
            "site" => self.site(element, body, inside)?,
            "camera" | "light" => {}
            "replicate" => self.replicate(element, body, inside)?,
            "attach" => self.attach(element, body, inside)?,
            "composite" | "flexcomp" | "plugin" => {
                let message = "not read by simd: left out";
                self.notes.warn(element, Ignored, message);
            }
            _ => self.notes.info(element, Ignored, "not read by simd"),
        }
        Ok(())
    }

    fn body(&mut self, element: Element<'a>, parent: usize, inside: Inside<'_>) -> Result<(), Stop> {
        let index = self.bodies.len();
        if index > crate::MAX_LINKS {
            let message = format!("it has more than {} bodies", crate::MAX_LINKS);
            return Err(Stop::at(element, message));
        }
        let pose = self
            .scope
            .classes
            .of(element, None, ["body", "body"])
            .pose(&self.scope.compiler, &mut self.notes)?;
        let name = inside.named(element).unwrap_or_else(|| format!("body_{index}"));
        // Names of bodies must be unique, as in MuJoCo.
        if element.word("name").is_some() && !self.names.take(&name) {
            return Err(Stop::at(element, "another body has this name"));
        }
        let name = if element.word("name").is_some() { name } else { self.names.unique(&name) };
        if element.word("mocap") == Some("true") {
            let message = "simd has no mocap bodies: it stands still";
            self.notes.warn(element, Ignored, message);
        }
        let held = value::numbers::<1>(element, "gravcomp", &mut self.notes)?;
        let stays_awake = match element.word("sleep") {
            Some("never") => true,
            Some("init") => {
                self.notes.info(element, Ignored, "sleep=\"init\" is not read: bodies begin awake in simd");
                false
            }
            _ => false,
        };
        self.bodies.push(Body {
            name,
            at: (element.file, element.line()),
            parent,
            parent_from_body: inside.frame * pose,
            stays_awake,
            gravity_compensation: held.map_or(0.0, |[held]| held),
            ..Body::world(element)
        });
        let class =
            element.word("childclass").and_then(|name| self.scope.classes.find(name)).or(inside.class);
        let inner = Inside { class, frame: DPose3::IDENTITY, depth: inside.depth + 1, ..inside };
        self.content(element, index, inner)
    }

    fn geom(&mut self, element: Element<'a>, body: usize, inside: Inside<'_>) -> Result<(), Stop> {
        self.geoms += 1;
        let most = self.limits.shapes;
        if self.geoms > most {
            return Err(Stop::at(element, format!("it has more than {most} geoms")));
        }
        let geom = self.scope.classes.of(element, inside.class, ["geom", "geom"]);
        let context = geom::Context {
            compiler: &self.scope.compiler,
            library: &self.scope.library,
            assets: self.assets,
            made: &self.made,
            limits: self.limits,
        };
        let read = geom::read(&geom, &inside.frame, &context, &mut self.notes)?;
        if let Some(slot) = self.bodies.get_mut(body) {
            slot.geoms.extend(read);
        }
        Ok(())
    }

    fn joint(&mut self, element: Element<'a>, body: usize, inside: Inside<'_>) -> Result<(), Stop> {
        if body == 0 {
            return Err(Stop::at(element, "the world has no joints"));
        }
        let joint = self.scope.classes.of(element, inside.class, ["joint", "joint"]);
        let is_free = element.tag() == "freejoint" || joint.word("type") == Some("free");
        if joint.word("type") == Some("fixed") {
            self.notes.info(
                element,
                Used,
                "PyBullet's way to say that the body has no joint; MuJoCo does not have it",
            );
            return Ok(());
        }
        let Some(slot) = self.bodies.get_mut(body) else { return Ok(()) };
        if is_free {
            if slot.parent != 0 || !slot.joints.is_empty() {
                return Err(Stop::at(element, "a free joint is for a body of the world that has no other"));
            }
            slot.is_free = true;
            // The class's values only apply to `joint`, as in MuJoCo.
            for name in ["armature", "damping", "stiffness", "frictionloss"] {
                let value = if element.tag() == "joint" { joint.number(name)? } else { None };
                if value.is_some_and(|value| value != 0.0) {
                    let message = format!("the {name} of a free joint is not read: left out");
                    self.notes.warn(element, Ignored, message);
                }
            }
            return Ok(());
        }
        if slot.is_free {
            return Err(Stop::at(element, "the body has a free joint, and no other"));
        }
        let count = slot.joints.len();
        if count >= 6 {
            return Err(Stop::at(element, "a body has at most 6 joints"));
        }
        let name = inside.named(element).unwrap_or_else(|| match count {
            0 => format!("{}_joint", slot.name),
            _ => format!("{}_joint_{}", slot.name, count + 1),
        });
        let read = joint::read(&joint, name, &inside.frame, &self.scope.compiler, &mut self.notes)?;
        slot.joints.push(read);
        Ok(())
    }

    /// Reads a site with a name.
    fn site(&mut self, element: Element<'a>, body: usize, inside: Inside<'_>) -> Result<(), Stop> {
        let Some(name) = inside.named(element) else { return Ok(()) };
        let site = self.scope.classes.of(element, inside.class, ["site", "site"]);
        let mut pose = site.pose(&self.scope.compiler, &mut self.notes)?;
        if let Some([a, b, c, d, e, f]) = site.numbers("fromto", &mut self.notes)? {
            let (from, to) = (DVec3::new(a, b, c), DVec3::new(d, e, f));
            let along = (from - to).try_normalize().unwrap_or(DVec3::Z);
            pose = DPose3::from_parts((from + to) * 0.5, glamx::DQuat::from_rotation_arc(DVec3::Z, along));
        }
        let body_from_site = inside.frame * pose;
        self.sites.insert(name.clone(), (body, body_from_site));
        if let Some(slot) = self.bodies.get_mut(body) {
            let link = slot.name.clone();
            slot.sites.push(DraftFrame { name, link, link_from_frame: body_from_site });
        }
        Ok(())
    }

    fn inertial(&mut self, element: Element<'a>, inside: Inside<'_>) -> Result<Inertial, Stop> {
        let inertial = self.scope.classes.of(element, None, ["inertial", "inertial"]);
        let pose = inside.frame * inertial.pose(&self.scope.compiler, &mut self.notes)?;
        let mass = inertial.number("mass")?.ok_or_else(|| Stop::at(element, "it has no mass"))?;
        let full: Option<[f64; 6]> = inertial.numbers("fullinertia", &mut self.notes)?;
        let diagonal: Option<[f64; 3]> = inertial.numbers("diaginertia", &mut self.notes)?;
        let tensor = match (full, diagonal) {
            (Some([xx, yy, zz, xy, xz, yz]), _) => {
                DMat3::from_cols_array(&[xx, xy, xz, xy, yy, yz, xz, yz, zz])
            }
            (None, Some(diagonal)) => DMat3::from_diagonal(DVec3::from_array(diagonal)),
            (None, None) => {
                let message = "it has neither diaginertia nor fullinertia: they are computed from its geoms \
                               and its mass";
                self.notes.warn(element, Repaired, message);
                DMat3::ZERO
            }
        };
        let inertia = inertia::rotated(tensor, pose.rotation);
        Ok(Inertial { mass, center_of_mass: pose.translation, inertia })
    }

    /// Sets the masses of all bodies: their own or their geoms', within the compiler's bounds.
    pub(super) fn finish_masses(&mut self) {
        let compiler = &self.scope.compiler;
        for body in self.bodies.iter_mut().skip(1) {
            let given = body.given.filter(|_| compiler.inertia_from_geoms != Some(true));
            let from_geoms = || geom::together(&body.geoms, compiler.inertia_groups);
            body.inertial = match (given, compiler.inertia_from_geoms) {
                (Some(given), _) if given.inertia == DMat3::ZERO && given.mass > 0.0 => {
                    let geoms = from_geoms();
                    let factor = if geoms.mass > 0.0 { given.mass / geoms.mass } else { 0.0 };
                    Inertial { inertia: geoms.inertia * factor, ..given }
                }
                (Some(given), _) => given,
                (None, Some(false)) => Inertial::ZERO,
                (None, _) => from_geoms(),
            };
            let inertial = &mut body.inertial;
            inertial.mass = inertial.mass.max(compiler.bound_mass);
            if compiler.bound_inertia > 0.0 {
                inertial.inertia = at_least(inertial.inertia, compiler.bound_inertia);
            }
            if compiler.balance_inertia && inertia::checked(inertial.inertia).is_err() {
                let mean =
                    (inertial.inertia.x_axis.x + inertial.inertia.y_axis.y + inertial.inertia.z_axis.z) / 3.0;
                inertial.inertia = DMat3::from_diagonal(DVec3::splat(mean));
                let message =
                    format!("the inertia of {:?} is impossible for a rigid body: balanced", body.name);
                self.notes.warn_at_line(Repaired, body.at, message);
            }
        }
        let all: f64 = self.bodies.iter().map(|body| body.inertial.mass).sum();
        if let Some(total) = compiler.total_mass.filter(|_| all > 0.0) {
            let factor = total / all;
            for body in &mut self.bodies {
                body.inertial.mass *= factor;
                body.inertial.inertia *= factor;
            }
        }
    }
}

/// Returns a tensor whose principal moments are at least `least`.
fn at_least(tensor: DMat3, least: f64) -> DMat3 {
    let eigen = glamx::DSymmetricEigen3::new(tensor);
    let moments = eigen.eigenvalues.max(DVec3::splat(least));
    let axes = eigen.eigenvectors;
    axes * DMat3::from_diagonal(moments) * axes.transpose()
}
