//! Meshes and convex colliders as glTF: each is written once, outside of the physics thread, and cached while
//! there is room.

mod glb;

use std::collections::{HashMap, VecDeque};
use std::io::Write as _;
use std::sync::{Mutex, PoisonError};

use bytes::Bytes;
use flate2::Compression;
use flate2::write::GzEncoder;
use simd_core::collision::ConvexMesh;
use simd_model::robot::{MeshAsset, Sha256};

use super::{CallError, SimHandle};

/// Maximum bytes of glTF in the cache.
const CAPACITY: usize = 256 << 20;
/// Minimum size of compressed files, bytes.
const WORTH_IT: usize = 4 << 10;

/// Key of a glTF file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Key {
    /// A mesh, by its look.
    Mesh(Sha256),
    /// A convex collider, by the hash of its vertices and triangles.
    Collider(Sha256),
}

/// A mesh as a browser gets it.
#[derive(Clone, Debug)]
pub struct Glb {
    pub bytes: Bytes,
    /// Compressed bytes, if smaller.
    pub gzip: Option<Bytes>,
}

/// Writer and cache of glTF files.
#[derive(Debug, Default)]
pub struct Meshes {
    /// Locked for a lookup or an insertion.
    cache: Mutex<Cache>,
    /// One file is written at a time: each takes a processor and, while it is written, a few times its
    /// memory.
    writing: tokio::sync::Mutex<()>,
}

#[derive(Debug, Default)]
struct Cache {
    by_key: HashMap<Key, Glb>,
    /// Keys, least recently used first.
    order: VecDeque<Key>,
    bytes: usize,
}

impl Meshes {
    /// Returns the glTF of a mesh that a robot uses or that is in the cache; `None` for others.
    ///
    /// # Errors
    /// Returns an error if too many descriptions and files wait to be read.
    pub async fn get(&self, handle: &SimHandle, key: Key) -> Result<Option<Glb>, CallError> {
        if let Some(cached) = self.cached(&key) {
            return Ok(Some(cached));
        }
        let _writing = self.writing.lock().await;
        if let Some(cached) = self.cached(&key) {
            return Ok(Some(cached));
        }
        let written = match key {
            Key::Mesh(sha256) => handle.with_mesh(&sha256, |mesh| Glb::of(glb::write(mesh))).await?,
            Key::Collider(sha256) => {
                handle.with_collider(sha256, move |collider| written(sha256, collider)).await?
            }
        };
        if let Some(written) = &written {
            self.lock().insert(key, written.clone());
        }
        Ok(written)
    }

    fn cached(&self, key: &Key) -> Option<Glb> {
        let mut cache = self.lock();
        let cached = cache.by_key.get(key).cloned()?;
        cache.order.retain(|other| other != key);
        cache.order.push_back(*key);
        Some(cached)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Cache> {
        self.cache.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn written(sha256: Sha256, ConvexMesh { vertices, triangles }: ConvexMesh) -> Glb {
    Glb::of(glb::write(&MeshAsset {
        sha256,
        vertices,
        triangles,
        paints: Vec::new(),
        files: Vec::new(),
        grid: None,
    }))
}

impl Cache {
    /// Inserts a file; files larger than the cache are written each time.
    fn insert(&mut self, key: Key, glb: Glb) {
        let size = glb.size();
        if size > CAPACITY {
            return;
        }
        while self.bytes + size > CAPACITY
            && let Some(oldest) = self.order.pop_front()
        {
            self.bytes -= self.by_key.remove(&oldest).map_or(0, |glb| glb.size());
        }
        self.bytes += size;
        self.order.push_back(key);
        self.by_key.insert(key, glb);
    }
}

impl Glb {
    fn of(bytes: Vec<u8>) -> Self {
        let gzip = compressed(&bytes).filter(|gzip| gzip.len() < bytes.len() / 10 * 9);
        Self { bytes: bytes.into(), gzip: gzip.map(Bytes::from) }
    }

    fn size(&self) -> usize {
        self.bytes.len() + self.gzip.as_ref().map_or(0, Bytes::len)
    }
}

/// Compresses fast rather than well: a client waits for it.
fn compressed(bytes: &[u8]) -> Option<Vec<u8>> {
    if bytes.len() < WORTH_IT {
        return None;
    }
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).ok()?;
    encoder.finish().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(bytes: usize) -> Glb {
        Glb { bytes: vec![0; bytes].into(), gzip: None }
    }

    #[test]
    fn the_longest_unused_makes_room() {
        let meshes = Meshes::default();
        let keys = [0_u8, 1, 2].map(|n| Key::Mesh(Sha256::of(&[n])));
        meshes.lock().insert(keys[0], glb(CAPACITY / 2));
        meshes.lock().insert(keys[1], glb(CAPACITY / 2));
        meshes.cached(&keys[0]).unwrap();
        meshes.lock().insert(keys[2], glb(CAPACITY / 4));
        assert_eq!(keys.map(|key| meshes.cached(&key).is_some()), [true, false, true]);
        assert_eq!(meshes.lock().bytes, CAPACITY / 2 + CAPACITY / 4);
        meshes.lock().insert(keys[1], glb(CAPACITY + 1));
        assert!(meshes.cached(&keys[1]).is_none());
        let Key::Mesh(hash) = keys[2] else { panic!("{keys:?}") };
        assert!(meshes.cached(&Key::Collider(hash)).is_none(), "a mesh is not a collider");
    }

    #[test]
    fn compressed_meshes_have_equal_content() {
        let bytes: Vec<u8> = (0..100_000_u32).flat_map(|n| (n / 7).to_le_bytes()).collect();
        let glb = Glb::of(bytes.clone());
        let mut decoder = flate2::write::GzDecoder::new(Vec::new());
        decoder.write_all(glb.gzip.as_ref().unwrap()).unwrap();
        assert_eq!(decoder.finish().unwrap(), bytes);
        assert!(Glb::of(vec![0; 100]).gzip.is_none());
    }
}
