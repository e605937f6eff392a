//! Meshes as they are in memory: one file is decoded once while robots use it, and all
//! of them together stay within a limit.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use simd_core::collision::{MeshKey, Shapes};
use simd_model::robot::{MeshAsset, Sha256};
use simd_model::{Asset, Assets};

use crate::call_error::CallError;

/// A mesh's look, and what its file was read as.
type Key = (Sha256, String);

/// What robots in the world, in saved states and held by calls have in memory. Holds
/// nothing itself.
#[derive(Debug)]
pub(super) struct Decoded {
    limit: u64,
    used: Mutex<Used>,
}

#[derive(Debug, Default)]
struct Used {
    meshes: BTreeMap<Key, Mesh>,
    made: BTreeMap<MeshKey, Made>,
    /// What all of it takes in memory. What is no more counts until it is forgotten, so that one more robot costs what its own
    /// meshes cost and not those of all.
    bytes: u64,
}

#[derive(Debug)]
struct Mesh {
    asset: Weak<MeshAsset>,
    bytes: u64,
}

/// What a mesh became that robots touch with.
#[derive(Debug)]
struct Made {
    /// Of the robots that share it: each knows what its meshes became.
    shapes: Vec<Weak<Shapes>>,
    bytes: u64,
}

impl Made {
    /// The last that there are of those that share it.
    fn newest(&mut self) -> Option<Arc<Shapes>> {
        loop {
            let newest = self.shapes.last()?.upgrade();
            if newest.is_some() {
                return newest;
            }
            self.shapes.pop();
        }
    }
}

impl Used {
    /// Forgets what is no more.
    fn tidy(&mut self) {
        let Self { meshes, made, bytes } = self;
        meshes.retain(|_, mesh| mesh.asset.strong_count() > 0);
        made.retain(|_, made| {
            made.shapes.retain(|shapes| shapes.strong_count() > 0);
            !made.shapes.is_empty()
        });
        let all = meshes.values().map(|mesh| mesh.bytes).chain(made.values().map(|made| made.bytes));
        *bytes = all.fold(0, u64::saturating_add);
    }

    /// Makes sure that so many bytes more are within a limit.
    ///
    /// # Errors
    /// What all would come to, where that is beyond it.
    fn check(&mut self, limit: u64, more: impl Fn(&Self) -> u64) -> Result<(), u64> {
        let all = |used: &Self| used.bytes.saturating_add(more(used));
        if all(self) > limit {
            // Maybe only with what is no more.
            self.tidy();
        }
        let value = all(self);
        if value > limit { Err(value) } else { Ok(()) }
    }

    /// What the shapes of a robot take beside those that others have too.
    fn own_bytes(&self, shapes: &Shapes) -> u64 {
        let own = shapes.mesh_bytes().filter(|(key, _)| !self.made.contains_key(key));
        own.map(|(_, bytes)| bytes).fold(0, u64::saturating_add)
    }

    fn add_shapes(&mut self, shapes: &Arc<Shapes>) {
        self.bytes = self.bytes.saturating_add(self.own_bytes(shapes));
        for (key, bytes) in shapes.mesh_bytes() {
            let made = self.made.entry(key).or_insert_with(|| Made { shapes: Vec::new(), bytes });
            made.shapes.push(Arc::downgrade(shapes));
        }
    }

    fn add_mesh(&mut self, key: Key, asset: &Arc<MeshAsset>, bytes: u64) {
        self.bytes = self.bytes.saturating_add(bytes);
        let asset = Arc::downgrade(asset);
        if let Some(gone) = self.meshes.insert(key, Mesh { asset, bytes }) {
            self.bytes = self.bytes.saturating_sub(gone.bytes);
        }
    }
}

impl Decoded {
    /// For so many bytes.
    pub(super) fn new(limit: u64) -> Self {
        Self { limit, used: Mutex::default() }
    }

    fn lock(&self) -> MutexGuard<'_, Used> {
        self.used.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Shapes of robots that there are, which have all that the meshes of robots became: hulls of the same meshes need not be made
    /// again. Of robots that are alike it is one.
    pub(super) fn shapes(&self) -> Vec<Arc<Shapes>> {
        let mut used = self.lock();
        let newest = used.made.values_mut().filter_map(Made::newest);
        let each_once: BTreeMap<usize, Arc<Shapes>> =
            newest.map(|shapes| (Arc::as_ptr(&shapes).addr(), shapes)).collect();
        each_once.into_values().collect()
    }

    /// Keeps those of a robot in mind.
    ///
    /// # Errors
    /// Returns an error if all would take more than the limit.
    pub(super) fn admit_shapes(&self, shapes: &Arc<Shapes>) -> Result<(), CallError> {
        let mut used = self.lock();
        used.check(self.limit, |used| used.own_bytes(shapes)).map_err(|value| self.too_much(value))?;
        used.add_shapes(shapes);
        Ok(())
    }

    /// Forgets those that are no more.
    pub(super) fn tidy(&self) {
        self.lock().tidy();
    }

    fn known(&self, key: &Key) -> Option<Arc<MeshAsset>> {
        self.lock().meshes.get(key)?.asset.upgrade()
    }

    /// The mesh of a look that a robot uses, whichever format it was read as.
    pub(super) fn find(&self, look: &Sha256) -> Option<Arc<MeshAsset>> {
        let used = self.lock();
        let from_look_on = used.meshes.range((*look, String::new())..);
        let mut alike = from_look_on.take_while(|((own, _format), _)| own == look);
        alike.find_map(|(_, mesh)| mesh.asset.upgrade())
    }

    /// Keeps a mesh in mind that was just read; the error is what all would come to.
    fn admit(&self, key: Key, mesh: MeshAsset) -> Result<Arc<MeshAsset>, u64> {
        let mut used = self.lock();
        // Two may have read the same file at the same time.
        if let Some(known) = used.meshes.get(&key).and_then(|mesh| mesh.asset.upgrade()) {
            return Ok(known);
        }
        let bytes = bytes(&mesh);
        used.check(self.limit, |_| bytes)?;
        let mesh = Arc::new(mesh);
        used.add_mesh(key, &mesh, bytes);
        Ok(mesh)
    }

    fn too_much(&self, value: u64) -> CallError {
        let what = "the size of all robots' meshes in memory, in bytes,".into();
        CallError::LimitExceeded { what, value, limit: self.limit }
    }
}

/// What a mesh takes in memory.
fn bytes(mesh: &MeshAsset) -> u64 {
    let triangles = size_of_val(mesh.vertices.as_slice()) + size_of_val(mesh.triangles.as_slice());
    let mut images = BTreeMap::new();
    let mut looks = size_of_val(mesh.paints.as_slice());
    for texture in mesh.paints.iter().filter_map(|paint| paint.texture.as_ref()) {
        looks += size_of_val(texture.uvs.as_slice());
        images.insert(texture.image.sha256, texture.image.bytes.len());
    }
    (triangles + looks + images.into_values().sum::<usize>()) as u64
}

/// Files of one robot, decoded by way of what others have.
pub(super) struct Decoding<'d> {
    decoded: &'d Decoded,
    files: &'d dyn Assets,
    /// What all meshes would have come to, where that is too much.
    excess: Cell<Option<u64>>,
}

impl<'d> Decoding<'d> {
    /// Of files as they come.
    pub(super) fn new(decoded: &'d Decoded, files: &'d dyn Assets) -> Self {
        Self { decoded, files, excess: Cell::new(None) }
    }

    /// # Errors
    /// Returns an error if a mesh went beyond the limit of them all.
    pub(super) fn check(&self) -> Result<(), CallError> {
        self.excess.get().map_or(Ok(()), |value| Err(self.decoded.too_much(value)))
    }
}

impl Assets for Decoding<'_> {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        self.files.find(uri)
    }

    fn note(&self, uri: &str) -> Option<String> {
        self.files.note(uri)
    }

    fn mesh(
        &self,
        look: Sha256,
        format: &str,
        read: &mut dyn FnMut() -> Result<MeshAsset, String>,
    ) -> Result<Arc<MeshAsset>, String> {
        let key = (look, format.to_owned());
        if let Some(known) = self.decoded.known(&key) {
            return Ok(known);
        }
        // The call fails for it: what comes after is not even read.
        let too_much = || "all robots' meshes take too much memory".to_owned();
        if self.excess.get().is_some() {
            return Err(too_much());
        }
        self.decoded.admit(key, read()?).map_err(|value| {
            self.excess.set(Some(value));
            too_much()
        })
    }
}

#[cfg(test)]
mod tests;
