//! Colours and pictures: from a visual's own material, or from one that it names.

use std::collections::HashMap;

use roxmltree::Node;

use super::findings::{Findings, quoted};
use super::mend::Mended;
use super::prescan::texture_of;
use crate::report::Disposition::{Defaulted, Ignored, Repaired};

/// The colours and pictures that have a name.
pub(super) struct Palette<'m> {
    colors: HashMap<&'m str, [f64; 4]>,
    /// How the description names their files.
    textures: HashMap<String, String>,
}

impl<'m> Palette<'m> {
    /// Materials of the robot first, then those that a visual defines in
    /// passing: real files define "blue" in the first link and name it in the
    /// others.
    pub(super) fn of(mended: &'m Mended, findings: &mut Findings) -> Self {
        let robot = &mended.robot;
        report_twins(mended, findings);
        let passing =
            robot.links.iter().flat_map(|link| &link.visual).filter_map(|visual| visual.material.as_ref());
        let mut colors = HashMap::new();
        for material in robot.materials.iter().chain(passing).filter(|material| !material.name.is_empty()) {
            if let Some(color) = &material.color {
                colors.entry(material.name.as_str()).or_insert(color.rgba.0);
            }
        }
        let shapes = mended.children(mended.root, "link").flat_map(|link| mended.children(link, "visual"));
        let passing = shapes.filter_map(|visual| mended.child(visual, "material"));
        let mut textures = HashMap::new();
        for material in mended.children(mended.root, "material").chain(passing) {
            let name = material.attribute("name").map(str::trim).filter(|name| !name.is_empty());
            if let (Some(name), Some(file)) = (name, texture_of(material)) {
                textures.entry(name.to_owned()).or_insert_with(|| file.to_owned());
            }
        }
        Self { colors, textures }
    }

    /// How the description names the picture of a visual.
    pub(super) fn texture<'s>(&'s self, node: Option<Node<'s, '_>>) -> Option<&'s str> {
        let node = node?;
        let own = texture_of(node);
        own.or_else(|| self.textures.get(node.attribute("name")?.trim()).map(String::as_str))
    }

    /// The colour of a visual.
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

/// Materials of the robot that give a name another colour than the one before.
fn report_twins(mended: &Mended, findings: &mut Findings) {
    let mut seen = HashMap::new();
    for (material, node) in mended.robot.materials.iter().zip(mended.children(mended.root, "material")) {
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
