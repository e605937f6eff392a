//! Descriptions and assets, from uploads and from disk, to robots.
//!
//! * `store`, `partial`: what was uploaded.
//! * `disk`: what lies on the daemon's own disk.
//! * `decoded`: meshes in memory, shared by robots.
//! * `reading`: from there to a model.
//! * `progress`: how far that is.
//! * `source`: what clients say and learn of a description. `uploads`: how it comes.
//! * `xacro`: xacro files to URDFs.
//! * `saved states`: states of the world out to a file and in from one; [`saved_state_file`]: its bytes.
//! * Here: what is kept of it all, and which robot came from where.

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
pub use source::{AssetState, Prepared, Source, Validated};
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

/// Descriptions that are read at one time: the physics thread wants a core too.
const CONCURRENT_READS: usize = 2;

/// Keeps uploads and knows where robots came from.
#[derive(Debug)]
pub struct Loader {
    limits: DaemonLimits,
    roots: Roots,
    threads: Arc<BlockingThreads>,
    read_permits: Arc<FairPermits>,
    decoded: Arc<Decoded>,
    /// Held for a look or a change, never while something is read or hashed.
    cache: Mutex<Cache>,
}

#[derive(Debug)]
struct Cache {
    store: Store,
    partials: Partials,
    /// By the address of the model, which no other one gets while this is here.
    known: BTreeMap<usize, Known>,
}

/// Where a model came from. Lives as long as the model does, be it in the world,
/// in a kept saved state, or held by a call: so a robot that a saved state brings
/// back still has its description and its meshes.
#[derive(Debug)]
pub(crate) struct Known {
    model: Weak<RobotModel>,
    pub(crate) origin: Origin,
    pub(crate) description: Sha256,
    pub(crate) scale: f64,
    pub(crate) mesh_shapes: MeshShapes,
    /// Its root link cannot move.
    pub(crate) fixed_base: bool,
    /// The SRDF beside the description, if there is one.
    pub(crate) srdf: Option<Sha256>,
    /// The description, the files and the SRDF.
    pinned: Vec<Sha256>,
}

impl Loader {
    /// # Errors
    /// Returns an error if an asset root is not a folder that can be read, with that root.
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

    /// Threads for work that takes long.
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

    /// Keeps what a robot was made from for as long as its model lives.
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
            // What a client says of files that the description does not name is not kept.
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
            // At once, lest the next one takes its room.
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

    /// Keeps a file as an upload is kept.
    pub(crate) fn insert(&self, sha256: Sha256, bytes: Arc<[u8]>) -> Result<(), CallError> {
        let mut cache = self.lock();
        cache.release_unused();
        cache.store.insert(sha256, bytes)
    }

    /// Drops what is unused: uploads that were abandoned, files that no robot uses, and what
    /// belonged to robots that are gone.
    pub(crate) fn tidy(&self, now: Instant) {
        let mut cache = self.lock();
        cache.release_unused();
        cache.partials.forget_abandoned(now);
        cache.store.forget_unused(now);
        drop(cache);
        self.decoded.tidy();
    }

    /// Bytes of all files and of what is kept with robots and uploads.
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
    /// Releases the files of models that are gone.
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
