//! `<compiler>`: settings for reading the rest of the file.

use super::value;
use crate::report::Disposition::Ignored;
use crate::translation::element::Element;
use crate::translation::notes::{Notes, Stop};

/// Settings of all `<compiler>` elements; later ones override earlier ones.
#[derive(Clone, Debug)]
pub(super) struct Compiler {
    pub(super) degrees: bool,
    pub(super) auto_limits: bool,
    /// `None`: only for bodies without an inertial.
    pub(super) inertia_from_geoms: Option<bool>,
    pub(super) inertia_groups: [f64; 2],
    /// Minimum values of a body, kg and kg m^2.
    pub(super) bound_mass: f64,
    pub(super) bound_inertia: f64,
    /// Sum of all bodies, kg.
    pub(super) total_mass: Option<f64>,
    pub(super) balance_inertia: bool,
    /// Axes of Euler angles, in order.
    pub(super) euler: [u8; 3],
    pub(super) mesh_folder: String,
    pub(super) texture_folder: String,
    pub(super) strip_path: bool,
    pub(super) discard_visual: bool,
    /// Whether primitives are fitted to the extent of a mesh; otherwise to the box of its inertia.
    pub(super) fit_extent: bool,
    /// Folder of an attached file, with a slash at its end.
    pub(super) folder: String,
}

impl Default for Compiler {
    fn default() -> Self {
        Self {
            degrees: true,
            auto_limits: true,
            inertia_from_geoms: None,
            inertia_groups: [0.0, 5.0],
            bound_mass: 0.0,
            bound_inertia: 0.0,
            total_mass: None,
            balance_inertia: false,
            euler: *b"xyz",
            mesh_folder: String::new(),
            texture_folder: String::new(),
            strip_path: false,
            discard_visual: false,
            fit_extent: false,
            folder: String::new(),
        }
    }
}

impl Compiler {
    pub(super) fn read(&mut self, element: Element, notes: &mut Notes) -> Result<(), Stop> {
        if element.word("coordinate") == Some("global") {
            return Err(Stop::at(
                element,
                "coordinate=\"global\" is of MuJoCo before 2.3.3: save the model with it",
            ));
        }
        match element.word("angle") {
            Some("radian") => self.degrees = false,
            Some("degree") => self.degrees = true,
            _ => {}
        }
        let says = |name: &str, before: bool| element.word(name).map_or(before, |word| word == "true");
        self.auto_limits = says("autolimits", self.auto_limits);
        self.balance_inertia = says("balanceinertia", self.balance_inertia);
        self.strip_path = says("strippath", self.strip_path);
        self.discard_visual = says("discardvisual", self.discard_visual);
        self.fit_extent = says("fitaabb", self.fit_extent);
        match element.word("inertiafromgeom") {
            Some("true") => self.inertia_from_geoms = Some(true),
            Some("false") => self.inertia_from_geoms = Some(false),
            Some("auto") => self.inertia_from_geoms = None,
            _ => {}
        }
        if let Some(groups) = value::numbers::<2>(element, "inertiagrouprange", notes)? {
            self.inertia_groups = groups;
        }
        let number = |name: &str, notes: &mut Notes| -> Result<Option<f64>, Stop> {
            Ok(value::numbers::<1>(element, name, notes)?.map(|[value]| value))
        };
        self.bound_mass = number("boundmass", notes)?.unwrap_or(self.bound_mass);
        self.bound_inertia = number("boundinertia", notes)?.unwrap_or(self.bound_inertia);
        self.total_mass = number("settotalmass", notes)?.filter(|mass| *mass > 0.0).or(self.total_mass);
        if let Some(sequence) = element.word("eulerseq") {
            let known = sequence.bytes().all(|axis| b"xyzXYZ".contains(&axis));
            match sequence.as_bytes() {
                [a, b, c] if known => self.euler = [*a, *b, *c],
                _ => return Err(Stop::at(element, format!("eulerseq={sequence:?} is not three of x, y, z"))),
            }
        }
        for (name, folder) in [("meshdir", &mut self.mesh_folder), ("texturedir", &mut self.texture_folder)] {
            if let Some(said) = element.word(name).or_else(|| element.word("assetdir")) {
                said.trim_end_matches('/').clone_into(folder);
            }
        }
        if element.word("alignfree") == Some("true") {
            notes.info(element, Ignored, "alignfree is not read: frames of free bodies stay theirs");
        }
        Ok(())
    }

    /// Converts an angle in the file to radians.
    pub(super) fn angle(&self, angle: f64) -> f64 {
        if self.degrees { angle.to_radians() } else { angle }
    }

    /// Returns the URI of a mesh or a height field in the assets.
    pub(super) fn mesh_uri(&self, file: &str) -> String {
        self.uri(&self.mesh_folder, file)
    }

    /// Returns the URI of a picture in the assets.
    pub(super) fn texture_uri(&self, file: &str) -> String {
        self.uri(&self.texture_folder, file)
    }

    fn uri(&self, folder: &str, file: &str) -> String {
        let file = file.trim();
        let file = if self.strip_path { file.rsplit(['/', '\\']).next().unwrap_or(file) } else { file };
        if file.starts_with('/') || file.contains("://") {
            return file.to_owned();
        }
        let slash = if folder.is_empty() { "" } else { "/" };
        let from = if folder.starts_with('/') { "" } else { self.folder.as_str() };
        format!("{from}{folder}{slash}{file}")
    }
}
