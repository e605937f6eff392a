//! Decoded meshes in memory: a file is decoded once while robots use it, and all meshes together stay within
//! a limit.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use simd_core::collision::{MeshKey, Shapes};
use simd_model::robot::{MeshAsset, Sha256};
use simd_model::{Asset, Assets};

use crate::call_error::CallError;

/// Hash of a mesh's look, and the format of its file.
type Key = (Sha256, String);

/// Decoded data of robots in the world, in saved states and in calls. It holds only weak references.
#[derive(Debug)]
pub(super) struct Decoded {
    limit: u64,
    used: Mutex<Used>,
}

#[derive(Debug, Default)]
struct Used {
    meshes: BTreeMap<Key, Mesh>,
    made: BTreeMap<MeshKey, Made>,
    /// Memory of all of it, bytes. Dropped data counts until `tidy`, so that the time to add a robot depends
    /// only on the robot's meshes, and not on all.
    bytes: u64,
}

#[derive(Debug)]
struct Mesh {
    asset: Weak<MeshAsset>,
    bytes: u64,
}

/// Collision shapes made from a mesh.
#[derive(Debug)]
struct Made {
    /// Shapes of the robots that share it: each knows the results of its meshes.
    shapes: Vec<Weak<Shapes>>,
    bytes: u64,
}

impl Made {
    /// Returns the newest shapes that still exist.
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
    /// Forgets dropped data.
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

    /// Checks that additional bytes are within a limit.
    ///
    /// # Errors
    /// Returns the total, if it exceeds the limit.
    fn check(&mut self, limit: u64, more: impl Fn(&Self) -> u64) -> Result<(), u64> {
        let all = |used: &Self| used.bytes.saturating_add(more(used));
        if all(self) > limit {
            // The total may include dropped data.
            self.tidy();
        }
        let value = all(self);
        if value > limit { Err(value) } else { Ok(()) }
    }

    /// Returns the bytes of a robot's shapes that no other robot shares.
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
    /// Makes an empty record with a limit in bytes.
    pub(super) fn new(limit: u64) -> Self {
        Self { limit, used: Mutex::default() }
    }

    fn lock(&self) -> MutexGuard<'_, Used> {
        self.used.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns shapes of existing robots that together have all results of meshes: hulls of the same meshes
    /// need not be made again. Identical robots share one.
    pub(super) fn shapes(&self) -> Vec<Arc<Shapes>> {
        let mut used = self.lock();
        let newest = used.made.values_mut().filter_map(Made::newest);
        let each_once: BTreeMap<usize, Arc<Shapes>> =
            newest.map(|shapes| (Arc::as_ptr(&shapes).addr(), shapes)).collect();
        each_once.into_values().collect()
    }

    /// Records the shapes of a robot.
    ///
    /// # Errors
    /// Returns an error if the total would exceed the limit.
    pub(super) fn admit_shapes(&self, shapes: &Arc<Shapes>) -> Result<(), CallError> {
        let mut used = self.lock();
        used.check(self.limit, |used| used.own_bytes(shapes)).map_err(|value| self.too_much(value))?;
        used.add_shapes(shapes);
        Ok(())
    }

    /// Forgets dropped data.
    pub(super) fn tidy(&self) {
        self.lock().tidy();
    }

    fn known(&self, key: &Key) -> Option<Arc<MeshAsset>> {
        self.lock().meshes.get(key)?.asset.upgrade()
    }

    /// Returns the mesh with this look that a robot uses, read from any format.
    pub(super) fn find(&self, look: &Sha256) -> Option<Arc<MeshAsset>> {
        let used = self.lock();
        let from_look_on = used.meshes.range((*look, String::new())..);
        let mut alike = from_look_on.take_while(|((own, _format), _)| own == look);
        alike.find_map(|(_, mesh)| mesh.asset.upgrade())
    }

    /// Records a newly read mesh; the error is the total.
    fn admit(&self, key: Key, mesh: MeshAsset) -> Result<Arc<MeshAsset>, u64> {
        let mut used = self.lock();
        // Two calls may have read the same file at the same time.
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

/// Returns the memory of a mesh, bytes.
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

/// Files of one robot, decoded with reuse of other robots' meshes.
pub(super) struct Decoding<'d> {
    decoded: &'d Decoded,
    files: &'d dyn Assets,
    /// Total of all meshes, if it exceeded the limit.
    excess: Cell<Option<u64>>,
}

impl<'d> Decoding<'d> {
    /// Makes a decoder of these files.
    pub(super) fn new(decoded: &'d Decoded, files: &'d dyn Assets) -> Self {
        Self { decoded, files, excess: Cell::new(None) }
    }

    /// # Errors
    /// Returns an error if the meshes exceeded their common limit.
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
        // The call fails, so later meshes are not even read.
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
