//! Reads robots from descriptions and assets, which come from uploads and from the disk.
//!
//! * `store`, `partial`: uploaded files.
//! * `disk`: files on the daemon's own disk.
//! * `decoded`: meshes in memory, shared by robots.
//! * `reading`: models from descriptions.
//! * `progress`: progress of a load.
//! * `source`: sources of descriptions, and facts about them. `uploads`: their upload.
//! * `xacro`: URDFs from xacro files.
//! * `saved states`: saved states to and from files; [`saved_state_file`]: the bytes of such files.
//! * Here: everything that is stored, and the source of each robot.

mod decoded;
mod disk;
mod partial;
mod progress;
mod reading;
mod report;
pub mod saved_state_file;
mod saved_states;
mod source;
mod store;
#[cfg(test)]
mod tests;
mod uploads;
mod xacro;

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};

use bytes::Bytes;
use simd_core::collision::MeshShapes;
use simd_core::simulation::command::Spawn;
use simd_model::robot::Sha256;
use simd_model::{ReadOptions, RobotModel};
use tokio::time::Instant;

pub(crate) use progress::Reporter;
pub use progress::{Phase, Progress};
pub(crate) use reading::{LoadOptions, LoadedRobot, Origin, Which};
pub(crate) use report::summary;
pub(crate) use saved_states::Files;
pub use source::{AssetState, FilePart, Prepared, Source, Validated, ValidatedRobot};
pub use xacro::{ExpandedXacro, XacroFiles};

use crate::blocking_threads::BlockingThreads;
use crate::call_error::CallError;
use crate::fair_permits::FairPermits;
use crate::info::DaemonLimits;
use decoded::Decoded;
use disk::Roots;
use partial::Partials;
use reading::Used;
use store::Store;

/// Maximum number of descriptions read at one time: the physics thread wants a core too.
const CONCURRENT_READS: usize = 2;

/// Stores uploads and the sources of robots.
#[derive(Debug)]
pub struct Loader {
    limits: DaemonLimits,
    roots: Roots,
    threads: Arc<BlockingThreads>,
    read_permits: Arc<FairPermits>,
    decoded: Arc<Decoded>,
    /// Locked for a look or a change, never during a read or a hash.
    cache: Mutex<Cache>,
}

#[derive(Debug)]
struct Cache {
    store: Store,
    partials: Partials,
    /// Sources by the address of the model, which no other model gets while this entry exists.
    known: BTreeMap<usize, Known>,
}

/// Source of a model. It lives as long as the model, which the world, a saved state or a call may hold. So a
/// robot from a restored state still has its description and its meshes.
#[derive(Debug)]
pub(crate) struct Known {
    model: Weak<RobotModel>,
    pub(crate) origin: Origin,
    pub(crate) description: Sha256,
    pub(crate) scale: f64,
    pub(crate) mesh_shapes: MeshShapes,
    /// Whether the root link cannot move.
    pub(crate) fixed_base: bool,
    /// SRDF beside the description, if any.
    pub(crate) srdf: Option<Sha256>,
    /// Files that are kept for the model: description, assets and SRDF.
    pinned: Vec<Sha256>,
}

impl Loader {
    /// # Errors
    /// Returns the asset root that is not a readable folder, and the error.
    pub fn new(
        limits: DaemonLimits,
        asset_roots: &[PathBuf],
        threads: BlockingThreads,
    ) -> Result<Self, (PathBuf, std::io::Error)> {
        let cache = Cache {
            store: Store::new(limits.upload_store_bytes, limits.unused_file),
            partials: Partials::new(&limits),
            known: BTreeMap::new(),
        };
        Ok(Self {
            limits,
            roots: Roots::new(asset_roots)?,
            threads: Arc::new(threads),
            read_permits: Arc::new(FairPermits::new(
                CONCURRENT_READS,
                limits.waiting_descriptions,
                limits.waiting_descriptions_of_client,
                "descriptions and files that wait to be read",
            )),
            decoded: Arc::new(Decoded::new(limits.decoded_bytes)),
            cache: Mutex::new(cache),
        })
    }

    fn lock(&self) -> MutexGuard<'_, Cache> {
        self.cache.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the threads for long work.
    pub(crate) fn threads(&self) -> &BlockingThreads {
        &self.threads
    }

    pub(crate) fn load_options(
        &self,
        scale: f64,
        strict: bool,
        mesh_shapes: MeshShapes,
        fixed_base: Option<bool>,
    ) -> LoadOptions {
        LoadOptions {
            read: ReadOptions { scale, strict, limits: self.limits.reading },
            mesh_shapes,
            fixed_base,
        }
    }

    fn check_description(&self, bytes: usize) -> Result<(), CallError> {
        let (value, limit) = (bytes as u64, self.limits.description_bytes);
        if value <= limit {
            return Ok(());
        }
        Err(CallError::LimitExceeded { what: "the size of the description in bytes".into(), value, limit })
    }

    /// Keeps a robot's source for as long as its model lives.
    fn keep(
        &self,
        model: &Arc<RobotModel>,
        used: Used,
        origin: Origin,
        srdf: Bytes,
        options: LoadOptions,
    ) -> Result<(), CallError> {
        let Used { description, urdf, files, uris, made } = used;
        let kept = |mut assets: BTreeMap<String, Sha256>, mut missing: BTreeMap<String, Vec<String>>| {
            // Facts from a client about files that the description does not name are dropped.
            assets.retain(|uri, _| uris.contains(uri));
            missing.retain(|uri, _| uris.contains(uri));
            assets.extend(made);
            Origin::Kept { description, assets, missing }
        };
        let origin = match origin {
            Origin::Inline { assets, missing, .. } | Origin::Kept { assets, missing, .. } => {
                kept(assets, missing)
            }
            Origin::Sent { files, .. } => {
                kept(files.into_iter().map(|(uri, file)| (uri, file.sha256)).collect(), BTreeMap::new())
            }
            Origin::BelowRoot(_) | Origin::Operator(_) => origin,
        };
        let beside = (!srdf.is_empty()).then(|| (Sha256::of(&srdf), Arc::<[u8]>::from(&srdf[..])));
        let srdf = beside.as_ref().map(|(sha256, _)| *sha256);
        let mut cache = self.lock();
        cache.release_unused();
        let mut pinned = Vec::with_capacity(files.len() + 2);
        for (sha256, bytes) in std::iter::once((description, urdf)).chain(files).chain(beside) {
            if let Err(full) = cache.store.insert(sha256, bytes) {
                cache.store.unpin(&pinned);
                return Err(full);
            }
            // Pinned at once, or the next file could take its room.
            cache.store.pin(&[sha256]);
            pinned.push(sha256);
        }
        let LoadOptions { read: ReadOptions { scale, .. }, mesh_shapes, fixed_base } = options;
        let fixed_base = Spawn::is_base_fixed(model, fixed_base);
        let address = Arc::as_ptr(model).addr();
        let model = Arc::downgrade(model);
        let known = Known { model, origin, description, scale, mesh_shapes, fixed_base, srdf, pinned };
        if let Some(before) = cache.known.insert(address, known) {
            cache.store.unpin(&before.pinned);
        }
        Ok(())
    }

    /// Stores a file like an upload.
    pub(crate) fn insert(&self, sha256: Sha256, bytes: Arc<[u8]>) -> Result<(), CallError> {
        let mut cache = self.lock();
        cache.release_unused();
        cache.store.insert(sha256, bytes)
    }

    /// Drops unused data: abandoned uploads, files that no robot uses, and sources of deleted robots.
    pub(crate) fn tidy(&self, now: Instant) {
        let mut cache = self.lock();
        cache.release_unused();
        cache.partials.forget_abandoned(now);
        cache.store.forget_unused(now);
        drop(cache);
        self.decoded.tidy();
    }

    /// Returns the bytes of all files, and of data kept for robots and uploads.
    #[cfg(test)]
    pub(crate) fn held(&self) -> usize {
        let cache = self.lock();
        let of_origin = |known: &Known| match &known.origin {
            Origin::Kept { assets, missing, .. } => {
                let places = missing.values().flatten().map(String::len).sum::<usize>();
                assets.keys().chain(missing.keys()).map(String::len).sum::<usize>() + places
            }
            _ => 0,
        };
        let known: usize = cache.known.values().map(|it| size_of::<Known>() + of_origin(it)).sum();
        cache.store.bytes() as usize + cache.partials.bytes() + known
    }

    pub(crate) fn with_known<T>(&self, model: &Arc<RobotModel>, look: impl FnOnce(&Known) -> T) -> Option<T> {
        let cache = self.lock();
        cache.known.get(&Arc::as_ptr(model).addr()).map(look)
    }
}

impl Cache {
    /// Releases the files of models that no longer exist.
    fn release_unused(&mut self) {
        let Self { store, known, .. } = self;
        known.retain(|_, known| {
            let lives = known.model.strong_count() > 0;
            if !lives {
                store.unpin(&known.pinned);
            }
            lives
        });
    }
}
