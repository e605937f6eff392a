//! Meshes as they are in memory: one file is decoded once while robots use it, and all
//! of them together stay within a limit.

use std::cell::Cell;
use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use simd_core::collision::Shapes;
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
    meshes: HashMap<Key, Weak<MeshAsset>>,
    /// Of robots: each knows what its meshes became.
    shapes: Vec<Weak<Shapes>>,
}

impl Used {
    /// Forgets what is no more.
    fn tidy(&mut self) {
        self.shapes.retain(|shapes| shapes.strong_count() > 0);
        self.meshes.retain(|_, mesh| mesh.strong_count() > 0);
    }

    /// What all of it takes in memory, with the shapes of one more robot.
    fn bytes(&self, more: Option<&Shapes>) -> u64 {
        let meshes: u64 = self.meshes.values().filter_map(Weak::upgrade).map(|mesh| bytes(&mesh)).sum();
        let shapes: Vec<Arc<Shapes>> = self.shapes.iter().filter_map(Weak::upgrade).collect();
        let all = shapes.iter().map(|shapes| &**shapes).chain(more);
        let shared: BTreeMap<_, u64> = all.flat_map(Shapes::mesh_bytes).collect();
        shared.into_values().fold(meshes, u64::saturating_add)
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

    /// Shapes of robots that there are: hulls of the same meshes need not be made again.
    pub(super) fn shapes(&self) -> Vec<Arc<Shapes>> {
        self.lock().shapes.iter().filter_map(Weak::upgrade).collect()
    }

    /// Keeps those of a robot in mind.
    ///
    /// # Errors
    /// Where all would take more than the limit.
    pub(super) fn admit_shapes(&self, shapes: &Arc<Shapes>) -> Result<(), CallError> {
        let mut used = self.lock();
        used.tidy();
        let value = used.bytes(Some(shapes));
        if value > self.limit {
            return Err(self.too_much(value));
        }
        used.shapes.push(Arc::downgrade(shapes));
        Ok(())
    }

    /// Forgets those that are no more.
    pub(super) fn tidy(&self) {
        self.lock().tidy();
    }

    fn known(&self, key: &Key) -> Option<Arc<MeshAsset>> {
        self.lock().meshes.get(key)?.upgrade()
    }

    /// The mesh of a look that a robot uses, whichever format it was read as.
    pub(super) fn find(&self, look: &Sha256) -> Option<Arc<MeshAsset>> {
        let used = self.lock();
        let alike = used.meshes.iter().filter(|((own, _format), _)| own == look);
        let live = alike.filter_map(|((_, format), mesh)| Some((format, mesh.upgrade()?)));
        live.min_by(|a, b| a.0.cmp(b.0)).map(|(_format, mesh)| mesh)
    }

    /// Keeps a mesh in mind that was just read; the error is what all would come to.
    fn admit(&self, key: Key, mesh: MeshAsset) -> Result<Arc<MeshAsset>, u64> {
        let mut used = self.lock();
        // Two may have read the same file at the same time.
        if let Some(known) = used.meshes.get(&key).and_then(Weak::upgrade) {
            return Ok(known);
        }
        used.tidy();
        let value = used.bytes(None).saturating_add(bytes(&mesh));
        if value > self.limit {
            return Err(value);
        }
        let mesh = Arc::new(mesh);
        used.meshes.insert(key, Arc::downgrade(&mesh));
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
    /// Where a mesh went beyond the limit of them all.
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
mod tests {
    use glamx::DVec3;

    use super::*;

    struct Nowhere;

    impl Assets for Nowhere {
        fn find(&self, _uri: &str) -> Result<Asset, Vec<String>> {
            Err(Vec::new())
        }
    }

    /// 1200 bytes.
    fn mesh(n: u8) -> MeshAsset {
        MeshAsset {
            sha256: Sha256::of(&[n]),
            vertices: vec![DVec3::ZERO; 40],
            triangles: vec![[0, 1, 2]; 20],
            paints: Vec::new(),
            files: Vec::new(),
            grid: None,
        }
    }

    fn get(decoding: &Decoding, n: u8, reads: &Cell<u32>) -> Result<Arc<MeshAsset>, String> {
        decoding.mesh(Sha256::of(&[n]), "stl", &mut || {
            reads.set(reads.get() + 1);
            Ok(mesh(n))
        })
    }

    #[test]
    fn a_file_is_decoded_once_while_it_is_used() {
        let (decoded, reads) = (Decoded::new(10_000), Cell::new(0));
        let [one, other] = [Decoding::new(&decoded, &Nowhere), Decoding::new(&decoded, &Nowhere)];
        let [first, second] = [get(&one, 1, &reads).unwrap(), get(&other, 1, &reads).unwrap()];
        assert!(Arc::ptr_eq(&first, &second));
        assert_eq!(reads.get(), 1);
        drop((first, second));
        get(&other, 1, &reads).unwrap();
        assert_eq!(reads.get(), 2, "nothing unused is kept");
    }

    #[test]
    fn all_meshes_together_stay_within_the_limit() {
        let (decoded, reads) = (Decoded::new(2400), Cell::new(0));
        let decoding = Decoding::new(&decoded, &Nowhere);
        let kept = [1, 2].map(|n| get(&decoding, n, &reads).unwrap());
        decoding.check().unwrap();
        get(&decoding, 3, &reads).unwrap_err();
        let refused = decoding.check().unwrap_err().to_string();
        assert!(refused.ends_with("would be 3600, and the limit is 2400"), "{refused}");
        assert!(get(&decoding, 4, &reads).is_err());
        assert_eq!(reads.get(), 3, "the fourth is not read");
        drop(kept);
        let decoding = Decoding::new(&decoded, &Nowhere);
        get(&decoding, 3, &reads).unwrap();
        decoding.check().unwrap();
    }
}
