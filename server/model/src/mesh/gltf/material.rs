//! Looks of a glTF's materials: the base colour, its picture, and transparency.

use std::collections::HashMap;
use std::sync::Arc;

use simd_gltf::{Buffers, Document, Pbr, data, srgb};

use crate::limits;
use crate::mesh::builder::Look;
use crate::mesh::{Beside, image};
use crate::robot::{Image, Sha256};

/// Looks that were read so far.
pub(super) struct Materials<'d> {
    document: &'d Document,
    buffers: &'d Buffers<'d>,
    beside: &'d Beside,
    /// By material.
    known: HashMap<usize, Look>,
    /// By the index of the image.
    images: HashMap<usize, Option<Arc<Image>>>,
    /// Bytes of all images within the file.
    bytes: usize,
}

impl<'d> Materials<'d> {
    /// Makes it without looks.
    pub(super) fn new(document: &'d Document, buffers: &'d Buffers<'d>, beside: &'d Beside) -> Self {
        Self { document, buffers, beside, known: HashMap::new(), images: HashMap::new(), bytes: 0 }
    }

    fn pbr(&self, material: Option<usize>) -> Option<&'d Pbr> {
        self.document.materials.get(material?)?.pbr_metallic_roughness.as_ref()
    }

    /// Returns the set of texture coordinates of a material's picture.
    pub(super) fn texture_set(&self, material: Option<usize>) -> Option<usize> {
        Some(self.pbr(material)?.base_color_texture.as_ref()?.tex_coord)
    }

    /// Returns the look of a material; the default if the file has none, or none that is read.
    pub(super) fn look(&mut self, material: Option<usize>) -> Look {
        let Some(index) = material else { return Look::default() };
        if let Some(known) = self.known.get(&index) {
            return known.clone();
        }
        let look = self.read(index).unwrap_or_default();
        self.known.insert(index, look.clone());
        look
    }

    fn read(&mut self, index: usize) -> Option<Look> {
        let pbr = self.pbr(Some(index))?;
        let [red, green, blue, alpha] = pbr.base_color_factor.unwrap_or([1.0; 4]);
        let texture = pbr.base_color_texture.as_ref().map(|texture| texture.index);
        let image = texture.and_then(|texture| self.image(self.document.textures.get(texture)?.source?));
        let blends = self.document.materials.get(index)?.alpha_mode.as_deref() == Some("BLEND");
        Some(Look {
            color: Some([red, green, blue].map(srgb)),
            alpha: if blends { alpha.clamp(0.0, 1.0) } else { 1.0 },
            image,
        })
    }

    fn image(&mut self, index: usize) -> Option<Arc<Image>> {
        if let Some(known) = self.images.get(&index) {
            return known.clone();
        }
        let read = self.read_image(index);
        self.images.insert(index, read.clone());
        read
    }

    fn read_image(&mut self, index: usize) -> Option<Arc<Image>> {
        let found = self.document.images.get(index)?;
        let bytes: Arc<[u8]> = match (found.buffer_view, &found.uri) {
            (Some(view), _) => Arc::from(self.buffers.view(view).ok()?),
            (None, Some(uri)) if uri.starts_with("data:") => Arc::from(data(uri)?),
            (None, Some(uri)) => return self.beside.image(uri),
            (None, None) => return None,
        };
        self.bytes += bytes.len();
        if self.bytes > limits::BESIDE_BYTES {
            return None;
        }
        image::check(Sha256::of(&bytes), bytes).ok().map(Arc::new)
    }
}
