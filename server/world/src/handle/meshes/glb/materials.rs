//! Materials of a glTF, and their pictures.

use std::sync::Arc;

use serde_json::{Value, json};
use simd_model::robot::{Image, ImageKind, Paint};

/// Default colour, as in sRGB.
const GREY: [f64; 3] = [0.8; 3];
/// Colour of a material with a picture but no colour, which leaves the picture unchanged.
const WHITE: [f64; 3] = [1.0; 3];

/// Indices with one look.
pub(super) struct Group<'m> {
    /// Look; `None` if the file has none, or too many.
    pub(super) paint: Option<&'m Paint>,
    pub(super) count: usize,
}

/// Returns whether the file defines its look.
pub(super) fn has_look(paint: &Paint) -> bool {
    paint.color.is_some() || paint.texture.is_some() || paint.alpha < 1.0
}

/// Returns whether two paints are one material.
pub(super) fn is_alike(one: Option<&Paint>, other: Option<&Paint>) -> bool {
    let key = |paint: &Paint| {
        let image = paint.texture.as_ref().map(|texture| texture.image.sha256);
        (paint.color, paint.alpha, image)
    };
    one.map(key) == other.map(key)
}

/// Materials of a file.
#[derive(Default)]
pub(super) struct Materials {
    pub(super) written: Vec<Value>,
    /// Images, each once.
    pub(super) images: Vec<Arc<Image>>,
}

impl Materials {
    /// Adds a material, and returns its index. It is matt. Without a look in the file it has no name, so that
    /// a viewer knows that the robot's description may choose one.
    pub(super) fn add(&mut self, paint: Option<&Paint>) -> usize {
        let image = paint.and_then(|paint| paint.texture.as_ref()).map(|texture| &texture.image);
        let plain = if image.is_some() { WHITE } else { GREY };
        let [red, green, blue] = paint.and_then(|paint| paint.color).unwrap_or(plain).map(linear);
        let alpha = paint.map_or(1.0, |paint| paint.alpha);
        let mut material = json!({
            "name": if paint.is_some() { "of the file" } else { "" },
            // Single-layer shells are common: both sides are drawn.
            "doubleSided": true,
            "pbrMetallicRoughness": {
                "baseColorFactor": [red, green, blue, alpha], "metallicFactor": 0.0, "roughnessFactor": 0.8,
            },
        });
        if let Some(image) = image {
            let index = self.images.iter().position(|known| known.sha256 == image.sha256);
            let index = index.unwrap_or_else(|| {
                self.images.push(Arc::clone(image));
                self.images.len() - 1
            });
            material["pbrMetallicRoughness"]["baseColorTexture"] = json!({ "index": index });
        }
        if alpha < 1.0 {
            material["alphaMode"] = json!("BLEND");
        } else if image.is_some_and(|image| has_alpha(image)) {
            // Most such pictures hide all or nothing, and those are drawn right in any order.
            material["alphaMode"] = json!("MASK");
        }
        self.written.push(material);
        self.written.len() - 1
    }

    /// Writes textures and images; `first_view` is the first view of the images.
    pub(super) fn write_images(&self, file: &mut Value, first_view: usize) {
        if self.images.is_empty() {
            return;
        }
        let image = |(n, image): (usize, &Arc<Image>)| json!({ "bufferView": first_view + n, "mimeType": image.kind.media_type() });
        file["images"] = self.images.iter().enumerate().map(image).collect();
        file["textures"] = (0..self.images.len()).map(|n| json!({ "source": n })).collect();
    }
}

/// Returns whether an image is a PNG with an alpha channel (ISO/IEC 15948, 11.2.2).
fn has_alpha(image: &Image) -> bool {
    const COLOR_TYPE: usize = 25;
    image.kind == ImageKind::Png && image.bytes.get(COLOR_TYPE).is_some_and(|kind| matches!(kind, 4 | 6))
}

/// Converts a colour component from sRGB to linear (IEC 61966-2-1), as glTF requires.
fn linear(part: f64) -> f64 {
    if part <= 0.04045 { part / 12.92 } else { ((part + 0.055) / 1.055).powf(2.4) }
}
