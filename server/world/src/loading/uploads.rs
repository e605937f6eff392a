//! Descriptions and files as clients send them.

use std::collections::BTreeMap;
use std::sync::Arc;

use bytes::Bytes;
use simd_core::collision::MeshShapes;
use simd_model::robot::{MeshAsset, Sha256};
use simd_model::setup::NamedState;
use simd_model::{Asset, Assets, RobotModel, Srdf, wire_name};
use tokio::time::Instant;

use super::Loader;
use super::partial;
use super::progress::Reporter;
use super::reading::{LoadOptions, LoadedRobot, Origin, Reading, Used, Which};
use super::report::summary;
use super::source::{AssetState, Prepared, Source, Validated};
use crate::account::Account;
use crate::call_error::CallError;

impl Loader {
    /// Keeps a description and says which of its files are lacking.
    ///
    /// # Errors
    /// Returns an error if it is too large or cannot be read at all.
    pub(crate) async fn prepare(
        &self,
        urdf: Bytes,
        assets: BTreeMap<String, Sha256>,
    ) -> Result<Prepared, CallError> {
        self.check_description(urdf.len())?;
        let reading = self.limits.reading;
        // Included files and meshes that are here say what else is named.
        let known = {
            let mut cache = self.lock();
            let known = assets.iter().filter_map(|(uri, sha256)| {
                let bytes = cache.store.get(sha256)?;
                Some((uri.clone(), Asset { sha256: *sha256, bytes }))
            });
            Known(known.collect())
        };
        let (described, description, urdf) = self
            .off_thread(move || {
                let urdf: Arc<[u8]> = Arc::from(&urdf[..]);
                (simd_model::describe_with(&urdf, &known, &reading), Sha256::of(&urdf), urdf)
            })
            .await?;
        let described = described.map_err(refused)?;
        self.insert(description, urdf)?;
        let cache = self.lock();
        let state = |uri: String| {
            let state = match assets.get(&uri) {
                None => AssetState::Unresolved,
                Some(sha256) if cache.store.contains(sha256) => AssetState::Present,
                Some(_) => AssetState::Lacking,
            };
            (uri, state)
        };
        let assets = described.asset_uris.into_iter().map(state).collect();
        Ok(Prepared { description, name: wire_name(&described.name), assets, models: described.models })
    }

    /// Takes a part of a file; gives how much of it is here.
    ///
    /// # Errors
    /// Returns an error if the file is too large, where parts do not fit, and where the whole
    /// does not have the hash.
    pub(crate) async fn upload(
        self: &Arc<Self>,
        sha256: Sha256,
        total: u64,
        offset: u64,
        data: Bytes,
    ) -> Result<u64, CallError> {
        let limit = self.limits.asset_bytes;
        if total > limit {
            let what = "the size of the file in bytes".into();
            return Err(CallError::LimitExceeded { what, value: total, limit });
        }
        let bytes = loop {
            let checked = {
                let mut cache = self.lock();
                if let Some(kept) = cache.store.get(&sha256) {
                    let there = kept.len() as u64;
                    if there == total {
                        return Ok(there);
                    }
                    let message = format!("the file {sha256} has {there} bytes, not {total}");
                    return Err(CallError::UploadMismatch { message });
                }
                match cache.store.checking(&sha256) {
                    Some(checked) => checked,
                    None => match cache.partials.append(sha256, total, offset, &data, Instant::now())? {
                        partial::Progress::Received(received) => return Ok(received),
                        partial::Progress::Complete(bytes) => {
                            cache.store.begin_check(sha256);
                            break bytes;
                        }
                    },
                }
            };
            checked.cancelled().await;
        };
        // A task of its own: others wait for the file, also where this caller goes away. It counts for this caller.
        let loader = self.clone();
        let checked = tokio::spawn(Account::current().scope(async move {
            let check = Check { loader, sha256 };
            let loader = &check.loader;
            let (found, bytes) = loader.off_thread(move || (Sha256::of(&bytes), Arc::from(bytes))).await?;
            if found != sha256 {
                let message = format!("the file has the hash {found}, not {sha256}; send it anew");
                return Err(CallError::UploadMismatch { message });
            }
            loader.insert(sha256, bytes)?;
            Ok(total)
        }));
        let failed = |error| CallError::Internal { message: format!("a file was not checked: {error}") };
        checked.await.map_err(failed)?
    }

    /// Uploads of which a part has come and not the rest, and the bytes that have.
    pub fn uploads_under_way(&self) -> (usize, usize) {
        self.lock().partials.under_way()
    }

    /// Reads a description as a spawn would, and only reports.
    ///
    /// # Errors
    /// Returns an error if its bytes cannot be had.
    pub(crate) async fn validate(&self, source: Source, scale: f64) -> Result<Validated, CallError> {
        let options = self.load_options(scale, false, MeshShapes::default(), None);
        let which = Which::One(String::new());
        let mut readings = self.read(&source.into(), which, options, Reporter::default()).await?;
        let reading = readings.pop().ok_or_else(nothing_read)?;
        let description = reading.used.description;
        Ok(match reading.outcome {
            Ok(LoadedRobot { model, report, .. }) => {
                Validated { summary: summary(&model, &report), report, model: Some(model), description }
            }
            Err(refused) => Validated {
                summary: format!("refused: {refused}"),
                report: refused.report,
                model: None,
                description,
            },
        })
    }

    /// A file that was uploaded or that a robot uses.
    pub(crate) fn asset(&self, sha256: &Sha256) -> Option<Bytes> {
        self.lock().store.get(sha256).map(Bytes::from_owner)
    }

    /// Does what takes long with the mesh of a look, off the threads that others wait for;
    /// `None` where no robot uses it.
    ///
    /// # Errors
    /// Returns an error if too much waits for a permit already.
    pub(crate) async fn with_mesh<T: Send + 'static>(
        &self,
        look: &Sha256,
        work: impl FnOnce(&MeshAsset) -> T + Send + 'static,
    ) -> Result<Option<T>, CallError> {
        let Some(mesh) = self.decoded.find(look) else { return Ok(None) };
        self.off_thread(move || work(&mesh)).await.map(Some)
    }

    /// The text of a description with other file names of its meshes.
    ///
    /// # Errors
    /// Returns an error if too much waits to be read already, and where the text cannot be read.
    pub(crate) async fn readdress(
        &self,
        urdf: Bytes,
        address: impl Fn(&str) -> Option<String> + Send + 'static,
    ) -> Result<String, CallError> {
        let limits = self.limits.reading;
        self.off_thread(move || simd_model::readdress(&urdf, &limits, &address)).await?.map_err(refused)
    }

    /// Reads what an SRDF says of what a robot touches.
    ///
    /// # Errors
    /// Returns an error if it is none, and where `strict` refuses what it was found to have.
    async fn read_srdf(&self, srdf: Bytes, model: Arc<RobotModel>, strict: bool) -> Result<Srdf, CallError> {
        let limits = self.limits.reading;
        let read = move || simd_model::read_srdf(&srdf, &model, strict, &limits);
        self.off_thread(read).await?.map_err(refused)
    }

    /// What a robot was made from, with states of an SRDF in its description.
    async fn with_states(
        &self,
        used: Used,
        model: Arc<RobotModel>,
        states: Vec<NamedState>,
    ) -> Result<Used, CallError> {
        let limits = self.limits.reading;
        let write = move || {
            let text = simd_model::with_states(&used.urdf, &limits, &model, &states);
            match text {
                Some(text) => {
                    let urdf: Arc<[u8]> = Arc::from(text.into_bytes());
                    Used { description: Sha256::of(&urdf), urdf, ..used }
                }
                None => used,
            }
        };
        self.off_thread(write).await
    }

    /// Reads a robot, and keeps what it was made from for as long as its model lives. Of a file with several robots it is
    /// the one of the name that the robot had. Of an SRDF the named states alone are taken; empty is none.
    ///
    /// # Errors
    /// Returns an error if its bytes cannot be had, and where they are no robot.
    pub(crate) async fn load(
        &self,
        origin: Origin,
        name: &str,
        srdf: Bytes,
        options: LoadOptions,
        reporter: Reporter,
    ) -> Result<LoadedRobot, CallError> {
        let which = Which::One(name.to_owned());
        let mut made = self.load_with_srdf(origin, which, srdf, options, reporter).await?;
        let (mut made, found) = made.pop().ok_or_else(nothing_read)?;
        made.report.findings.extend(found.report.findings);
        Ok(made)
    }

    /// The same of several robots, with an SRDF, of which the named states become the model's; empty is none.
    ///
    /// # Errors
    /// As [`load`](Self::load), and where the SRDF is none or is refused.
    pub(crate) async fn load_with_srdf(
        &self,
        origin: Origin,
        which: Which,
        srdf: Bytes,
        options: LoadOptions,
        reporter: Reporter,
    ) -> Result<Vec<(LoadedRobot, Srdf)>, CallError> {
        let mut all = Vec::new();
        for Reading { mut used, outcome } in self.read(&origin, which, options, reporter).await? {
            let mut made = outcome.map_err(refused)?;
            let mut found = Srdf::default();
            if !srdf.is_empty() {
                found = self.read_srdf(srdf.clone(), Arc::clone(&made.model), options.read.strict).await?;
                let states = std::mem::take(&mut found.states);
                let model = Arc::make_mut(&mut made.model);
                let own = model.setup.states.len();
                model.setup.add_states(states);
                // What is kept has them too, and so has what is saved.
                let added = model.setup.states.get(own..).unwrap_or_default().to_vec();
                if !added.is_empty() {
                    used = self.with_states(used, Arc::clone(&made.model), added).await?;
                }
            }
            let fixed_base = made.placement.map(|placement| placement.fixed).or(options.fixed_base);
            let options = LoadOptions { fixed_base, ..options };
            self.keep(&made.model, used, origin.clone(), srdf.clone(), options)?;
            all.push((made, found));
        }
        Ok(all)
    }
}

fn nothing_read() -> CallError {
    CallError::Internal { message: "a description was read as no robot".into() }
}

/// Files by URI.
struct Known(BTreeMap<String, Asset>);

impl Assets for Known {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        self.0.get(uri).cloned().ok_or_else(Vec::new)
    }
}

/// A check of a file's hash, which ends with it however that comes about.
struct Check {
    loader: Arc<Loader>,
    sha256: Sha256,
}

impl Drop for Check {
    fn drop(&mut self) {
        self.loader.lock().store.end_check(&self.sha256);
    }
}

fn refused(refused: simd_model::Refused) -> CallError {
    CallError::InvalidDescription { message: refused.message, report: Box::new(refused.report) }
}
