//! Looks of a COLLADA file's materials: their diffuse colour or picture, and their transparency.
//!
//! Unresolved references are left out; a mesh is not refused for them.

use std::collections::HashMap;
use std::sync::Arc;

use roxmltree::{Node, NodeId};

use super::xml::{File, child, children, is, numbers, words};
use crate::mesh::Beside;
use crate::mesh::builder::Look;
use crate::robot::Image;

/// Looks that were read so far.
pub(super) struct Materials<'f, 'a> {
    file: &'f File<'a>,
    beside: &'f Beside,
    /// Looks by `<effect>`.
    known: HashMap<NodeId, Look>,
    /// Effects by `<material>`: a search among many children is done once.
    effects: HashMap<NodeId, Option<Node<'a, 'a>>>,
}

impl<'f, 'a> Materials<'f, 'a> {
    /// Makes it without looks.
    pub(super) fn new(file: &'f File<'a>, beside: &'f Beside) -> Self {
        Self { file, beside, known: HashMap::new(), effects: HashMap::new() }
    }

    /// Returns the look of each material by its name in a geometry, as bound in an instance of the geometry.
    /// The visit of the instance was already counted.
    pub(super) fn bound_in(&mut self, instance: Node<'a, 'a>) -> impl FnMut(&'a str) -> Look {
        let binding = child(instance, "bind_material").and_then(|bind| child(bind, "technique_common"));
        let bound = binding.into_iter().flat_map(|common| children(common, "instance_material"));
        let bound: HashMap<&str, Node> =
            bound.filter_map(|material| Some((material.attribute("symbol")?, material))).collect();
        move |symbol| {
            let material =
                bound.get(symbol).and_then(|bound| self.file.follow(*bound, "target", "material").ok());
            let Some(material) = material else { return Look::default() };
            let effect = *self.effects.entry(material.id()).or_insert_with(|| effect(self.file, material));
            let Some(effect) = effect else { return Look::default() };
            let look = self.known.entry(effect.id());
            look.or_insert_with(|| look_of(self.file, self.beside, effect).unwrap_or_default()).clone()
        }
    }
}

/// Returns the effect of a material.
fn effect<'a>(file: &File<'a>, material: Node<'a, 'a>) -> Option<Node<'a, 'a>> {
    file.follow(child(material, "instance_effect")?, "url", "effect").ok()
}

/// Returns the diffuse part of an effect, and its transparency (COLLADA 1.4.1, chapters 7 and 8).
fn look_of<'a>(file: &File<'a>, beside: &Beside, effect: Node<'a, 'a>) -> Option<Look> {
    let profile = child(effect, "profile_COMMON")?;
    let technique = child(profile, "technique")?;
    let shader = ["phong", "lambert", "blinn"].iter().find_map(|name| child(technique, name));
    // An unlit surface has one colour, its emission.
    let (shader, part) = match shader {
        Some(shader) => (shader, "diffuse"),
        None => (child(technique, "constant")?, "emission"),
    };
    let diffuse = child(shader, part)?;
    let color = child(diffuse, "color").and_then(|color| numbers(color).ok());
    let color =
        color.map(|[red, green, blue, _alpha]: [f64; 4]| [red, green, blue].map(|part| part.clamp(0.0, 1.0)));
    let image = child(diffuse, "texture").and_then(|texture| {
        let sampler = texture.attribute("texture")?;
        image(file, beside, [technique, profile, effect], sampler)
    });
    Some(Look { color, alpha: alpha(shader).unwrap_or(1.0), image })
}

/// Returns the opacity. Many exporters write its opposite, which is used if the surface would be invisible
/// otherwise.
fn alpha(shader: Node) -> Option<f64> {
    /// A surface with a lower opacity is not visible.
    const LEAST: f64 = 0.02;
    let transparent = child(shader, "transparent")?;
    let [red, green, blue, alpha]: [f64; 4] = numbers(child(transparent, "color")?).ok()?;
    let factor = child(shader, "transparency").and_then(|factor| child(factor, "float"));
    let factor = factor.and_then(|factor| numbers(factor).ok()).map_or(1.0, |[factor]: [f64; 1]| factor);
    let covered = if transparent.attribute("opaque").unwrap_or("A_ONE").trim() == "RGB_ZERO" {
        // Luminance in the standard, ITU-R BT.709.
        1.0 - (0.212671 * red + 0.715160 * green + 0.072169 * blue) * factor
    } else {
        alpha * factor
    };
    let covered = covered.clamp(0.0, 1.0);
    Some(if covered < LEAST { 1.0 } else { covered })
}

/// Returns the image of a sampler's name, through its surface. Some exporters name the image directly.
fn image<'a>(
    file: &File<'a>,
    beside: &Beside,
    scopes: [Node<'a, 'a>; 3],
    sampler: &'a str,
) -> Option<Arc<Image>> {
    let parameter = |sid: &str| {
        let mut all = scopes.iter().flat_map(|scope| children(*scope, "newparam"));
        all.find(|parameter| parameter.attribute("sid") == Some(sid))
    };
    let first_word = |node: Node<'a, 'a>| words(node).next();
    let mut id = sampler;
    if let Some(sampler) = parameter(sampler).and_then(|parameter| child(parameter, "sampler2D")) {
        // COLLADA 1.5 leads directly to the image.
        let of_instance = child(sampler, "instance_image").and_then(|instance| instance.attribute("url"));
        let surface = || {
            let surface = child(parameter(first_word(child(sampler, "source")?)?)?, "surface")?;
            first_word(child(surface, "init_from")?)
        };
        id = match of_instance {
            Some(url) => url.trim_start_matches('#'),
            None => surface()?,
        };
    }
    let image = file.by_id(id).filter(|image| is(*image, "image"))?;
    let file = child(image, "init_from")?;
    let file = child(file, "ref").unwrap_or(file);
    beside.image(file.text()?)
}
