//! Colours and pictures: from a visual's own material, or from one that it names.

use std::collections::HashMap;

use roxmltree::Node;

use super::findings::{Findings, quoted};
use super::numbers::{self, Shape};
use super::prescan::{texture, texture_of};
use super::repair::RepairedUrdf;
use crate::report::Disposition::{Defaulted, Ignored, Repaired};
use crate::robot::TextureRepeat;

/// Named colours and pictures.
pub(super) struct Palette<'m> {
    colors: HashMap<&'m str, [f64; 4]>,
    /// URIs of pictures in the description, with their repetitions.
    textures: HashMap<String, (String, TextureRepeat)>,
}

/// Maximum number of repetitions of a picture on a shape, or on a metre of one.
const MAX_REPETITIONS: f64 = 1e4;

impl<'m> Palette<'m> {
    /// Collects materials of the robot first, then those that a visual defines. Real files define "blue" in
    /// the first link and name it in the others.
    pub(super) fn of(repaired: &'m RepairedUrdf, findings: &mut Findings) -> Self {
        let robot = &repaired.robot;
        report_twins(repaired, findings);
        let passing =
            robot.links.iter().flat_map(|link| &link.visual).filter_map(|visual| visual.material.as_ref());
        let mut colors = HashMap::new();
        for material in robot.materials.iter().chain(passing).filter(|material| !material.name.is_empty()) {
            if let Some(color) = &material.color {
                colors.entry(material.name.as_str()).or_insert(color.rgba.0);
            }
        }
        let shapes =
            repaired.children(repaired.root, "link").flat_map(|link| repaired.children(link, "visual"));
        let passing = shapes.filter_map(|visual| repaired.child(visual, "material"));
        let mut textures = HashMap::new();
        for material in repaired.children(repaired.root, "material").chain(passing) {
            let name = material.attribute("name").map(str::trim).filter(|name| !name.is_empty());
            if let (Some(name), Some(file)) = (name, texture_of(material)) {
                textures.entry(name.to_owned()).or_insert_with(|| (file.to_owned(), repeat_of(material)));
            }
        }
        Self { colors, textures }
    }

    /// Returns the URI of a visual's picture, and its repetitions.
    pub(super) fn texture<'s>(&'s self, node: Option<Node<'s, '_>>) -> Option<(&'s str, TextureRepeat)> {
        let node = node?;
        if let Some(own) = texture_of(node) {
            return Some((own, repeat_of(node)));
        }
        let (file, repeat) = self.textures.get(node.attribute("name")?.trim())?;
        Some((file, *repeat))
    }

    /// Returns the colour of a visual.
    pub(super) fn color(
        &self,
        material: Option<&urdf_rs::Material>,
        node: Option<Node>,
        findings: &mut Findings,
    ) -> Option<[f64; 4]> {
        let (material, node) = (material?, node?);
        let own = material.color.as_ref().map(|color| color.rgba.0);
        let color = own.or_else(|| self.colors.get(material.name.as_str()).copied());
        let Some(color) = color else {
            if self.texture(Some(node)).is_some() {
                return None;
            }
            let message = if material.name.is_empty() {
                "it gives no colour; the default is shown".to_owned()
            } else {
                format!("no colour is defined for {}; the default is shown", quoted(&material.name))
            };
            findings.info(node, Defaulted, message);
            return None;
        };
        let clamped = color.map(|part| part.clamp(0.0, 1.0));
        if clamped != color {
            let [r, g, b, a] = color;
            findings.warn(node, Repaired, format!("rgba {r} {g} {b} {a} is cut to 0 to 1"));
        }
        Some(clamped)
    }
}

/// Returns the repetitions of a material's picture on a shape: `repeat`, or `per_metre`, which URDF does not
/// know. Invalid values are ignored: a picture only affects the look.
fn repeat_of(material: Node) -> TextureRepeat {
    let numbers = |name: &str| {
        let found = numbers::of::<2>(texture(material)?, name, Shape::Exactly(2))?;
        let can_be = |often: &f64| *often != 0.0 && often.abs() <= MAX_REPETITIONS;
        found.iter().all(can_be).then_some(found)
    };
    let times = numbers("repeat").map(TextureRepeat::Times);
    times.or_else(|| numbers("per_metre").map(TextureRepeat::PerMetre)).unwrap_or_default()
}

/// Reports materials of the robot that redefine a name with another colour.
fn report_twins(repaired: &RepairedUrdf, findings: &mut Findings) {
    let mut seen = HashMap::new();
    for (material, node) in repaired.robot.materials.iter().zip(repaired.children(repaired.root, "material"))
    {
        let Some(color) = material.color.as_ref().map(|color| color.rgba.0) else { continue };
        let (first, line) = *seen.entry(material.name.as_str()).or_insert((color, findings.line(node)));
        if first != color {
            let message = format!(
                "material {} has another colour at line {line}, which is used",
                quoted(&material.name)
            );
            findings.warn(node, Ignored, message);
        }
    }
}
