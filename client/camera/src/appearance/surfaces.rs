//! Meshes on the GPU, each once: generated for primitives, fetched from the daemon for files.

use std::collections::HashMap;
use std::sync::Arc;

use simd_client::{Client, Code, Error, Refusal};

use crate::draw::Surface;
use crate::drawing::Drawing;
use crate::primitives::{self, segments};
use crate::scene::Mesh;
use crate::{glb, images};

use super::AppearanceError;

const MIB: u64 = 1 << 20;

/// Key of a mesh.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(super) enum Key {
    Cube,
    /// Number of segments.
    Ball(u32),
    Cylinder(u32),
    /// Bits of its radius and length: a stretched one has another shape.
    Capsule(u64, u64),
    Cone(u64, u64),
    Plane,
    /// SHA-256 of its file and of the files that it names.
    Mesh(String),
    /// A primitive with a picture, whose SHA-256 this is.
    Pictured(Box<Key>, String),
}

impl Key {
    /// Metres.
    pub(super) fn capsule(radius: f64, length: f64) -> Self {
        Self::Capsule(radius.to_bits(), length.to_bits())
    }

    /// Metres.
    pub(super) fn cone(radius: f64, length: f64) -> Self {
        Self::Cone(radius.to_bits(), length.to_bits())
    }
}

struct Kept {
    /// `None`: it cannot be drawn, which was logged once.
    surface: Option<Arc<Surface>>,
    /// Time of its last use.
    asked: u64,
}

/// A cache that is bounded by the bytes on the GPU.
pub(super) struct Surfaces {
    drawing: Drawing,
    most_bytes: u64,
    kept: HashMap<Key, Kept>,
    asked: u64,
}

impl Surfaces {
    pub(super) fn new(drawing: Drawing, most_bytes: u64) -> Self {
        Self { drawing, most_bytes, kept: HashMap::new(), asked: 0 }
    }

    /// Returns a mesh; `None` if it cannot be drawn.
    pub(super) async fn get(
        &mut self,
        client: &Client,
        key: &Key,
    ) -> Result<Option<Arc<Surface>>, AppearanceError> {
        self.asked += 1;
        if let Some(kept) = self.kept.get_mut(key) {
            kept.asked = self.asked;
            return Ok(kept.surface.clone());
        }
        let mesh = match key {
            Key::Mesh(look) => fetched(client, look).await?,
            Key::Pictured(of, sha256) => match made(of) {
                Some(mesh) => Some(pictured(client, mesh, sha256).await?),
                None => None,
            },
            of => made(of),
        };
        let surface = match mesh {
            Some(mesh) => Some(Arc::new(self.drawing.upload(mesh).await?)),
            None => None,
        };
        let kept = Kept { surface: surface.clone(), asked: self.asked };
        self.kept.insert(key.clone(), kept);
        if self.is_over() {
            self.shrink()?;
        }
        Ok(surface)
    }

    /// Returns whether the meshes take more than half of the bound.
    pub(super) fn is_half_full(&self) -> bool {
        self.bytes() > self.most_bytes / 2
    }

    fn is_over(&self) -> bool {
        self.bytes() > self.most_bytes
    }

    /// Releases meshes that no robot uses, in order of their last use, until the rest is within the bound.
    ///
    /// # Errors
    /// Returns an error if the used meshes exceed the bound.
    fn shrink(&mut self) -> Result<(), AppearanceError> {
        let mut unused: Vec<(u64, Key)> = self
            .kept
            .iter()
            .filter(|(_, kept)| kept.surface.as_ref().is_none_or(|surface| Arc::strong_count(surface) == 1))
            .map(|(key, kept)| (kept.asked, key.clone()))
            .collect();
        unused.sort_unstable_by_key(|(asked, _)| *asked);
        for (_, key) in unused {
            if !self.is_over() {
                break;
            }
            self.kept.remove(&key);
        }
        if self.is_over() {
            return Err(AppearanceError::Memory { wanted: self.bytes() / MIB, most: self.most_bytes / MIB });
        }
        Ok(())
    }

    fn bytes(&self) -> u64 {
        self.kept.values().filter_map(|kept| kept.surface.as_ref()).map(|surface| surface.bytes()).sum()
    }
}

/// Generates a primitive.
fn made(key: &Key) -> Option<Mesh> {
    match key {
        Key::Cube => Some(primitives::cube()),
        Key::Ball(around) => Some(primitives::ball(*around)),
        Key::Cylinder(around) => Some(primitives::cylinder(*around)),
        Key::Capsule(radius, length) => {
            let (radius, length) = (f64::from_bits(*radius), f64::from_bits(*length));
            Some(primitives::capsule(segments(radius), radius, length))
        }
        Key::Cone(radius, length) => {
            let (radius, length) = (f64::from_bits(*radius), f64::from_bits(*length));
            Some(primitives::cone(segments(radius), radius, length))
        }
        Key::Plane => Some(primitives::plane()),
        Key::Mesh(_) | Key::Pictured(..) => None,
    }
}

/// Adds a picture from the daemon to a primitive; leaves it out if it cannot be read.
async fn pictured(client: &Client, mut mesh: Mesh, sha256: &str) -> Result<Mesh, AppearanceError> {
    let file = match client.asset(sha256).await {
        Ok(file) => file,
        Err(Error::Refused(refusal)) if is_gone(&refusal) => {
            tracing::warn!("a texture is not drawn: {refusal}");
            return Ok(mesh);
        }
        Err(error) => return Err(error.into()),
    };
    let read = tokio::task::spawn_blocking(move || images::read(&file)).await;
    match read.unwrap_or_else(|_| Err("it cannot be read".to_owned())) {
        Ok(image) => {
            mesh.images = vec![image];
            for part in &mut mesh.parts {
                part.image = Some(0);
            }
        }
        Err(reason) => tracing::warn!("texture {sha256} is not drawn: {reason}"),
    }
    Ok(mesh)
}

/// Returns whether the daemon does not have the file.
fn is_gone(refusal: &Refusal) -> bool {
    matches!(refusal.code, Code::NotFound | Code::FailedPrecondition)
}

/// Fetches a mesh from the daemon; `None` if it has no readable one. Failures of the connection are errors.
async fn fetched(client: &Client, look: &str) -> Result<Option<Mesh>, AppearanceError> {
    let file = match client.mesh(look).await {
        Ok(file) => file,
        Err(Error::Refused(refusal)) if is_gone(&refusal) => {
            tracing::warn!("a mesh is not drawn: {refusal}");
            return Ok(None);
        }
        Err(error) => return Err(error.into()),
    };
    // Reading large meshes takes long.
    let read = tokio::task::spawn_blocking(move || glb::read(&file)).await;
    match read.unwrap_or_else(|_| Err("it cannot be read".to_owned())) {
        Ok(mesh) => Ok(Some(mesh)),
        Err(reason) => {
            tracing::warn!("mesh {look} is not drawn: {reason}");
            Ok(None)
        }
    }
}
