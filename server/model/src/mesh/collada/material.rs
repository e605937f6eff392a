//! The colours of a COLLADA file: what its materials reflect of light from everywhere.
//!
//! A colour that cannot be resolved is left out, and never a reason to refuse a mesh.

use std::collections::HashMap;

use roxmltree::{Node, NodeId};

use super::xml::{File, child, children, numbers};

/// The colours that were looked up.
pub(super) struct Materials<'f, 'a> {
    file: &'f File<'a>,
    /// By `<material>`.
    known: HashMap<NodeId, Option<[f64; 3]>>,
}

impl<'f, 'a> Materials<'f, 'a> {
    /// None yet.
    pub(super) fn new(file: &'f File<'a>) -> Self {
        Self { file, known: HashMap::new() }
    }

    /// The colour of each material by what a geometry calls it, as an instance of the geometry
    /// binds it. The walk over the instance has already been counted for this.
    pub(super) fn bound_in(&mut self, instance: Node<'a, 'a>) -> impl FnMut(&'a str) -> Option<[f64; 3]> {
        let binding = child(instance, "bind_material").and_then(|bind| child(bind, "technique_common"));
        let bound = binding.into_iter().flat_map(|common| children(common, "instance_material"));
        let bound: HashMap<&str, Node> =
            bound.filter_map(|material| Some((material.attribute("symbol")?, material))).collect();
        move |symbol| {
            let material = self.file.follow(*bound.get(symbol)?, "target", "material").ok()?;
            *self.known.entry(material.id()).or_insert_with(|| color(self.file, material))
        }
    }
}

/// The diffuse colour of a material's effect (COLLADA 1.4.1, chapter 8).
fn color<'a>(file: &File<'a>, material: Node<'a, 'a>) -> Option<[f64; 3]> {
    let effect = file.follow(child(material, "instance_effect")?, "url", "effect").ok()?;
    let technique = child(child(effect, "profile_COMMON")?, "technique")?;
    let shader = ["phong", "lambert", "blinn"].iter().find_map(|name| child(technique, name))?;
    let color = child(child(shader, "diffuse")?, "color")?;
    let [red, green, blue, _alpha] = numbers(color).ok()?;
    Some([red, green, blue].map(|part: f64| part.clamp(0.0, 1.0)))
}
