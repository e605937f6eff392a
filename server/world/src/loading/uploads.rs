//! Descriptions and files that clients send.

use std::collections::BTreeMap;
use std::sync::Arc;

use bytes::Bytes;
use simd_core::collision::MeshShapes;
use simd_core::simulation::command::Spawn;
use simd_model::robot::{MeshAsset, Sha256};
use simd_model::setup::NamedState;
use simd_model::{Asset, Assets, LoadReport, RobotModel, Srdf, wire_name};
use tokio::time::Instant;

use super::Loader;
use super::partial;
use super::progress::Reporter;
use super::reading::{LoadOptions, LoadedRobot, Origin, Reading, Used, Which};
use super::report::summary;
use super::source::{AssetState, FilePart, Prepared, Source, Validated, ValidatedRobot};
use crate::account::Account;
use crate::call_error::CallError;

impl Loader {
    /// Stores a description, and returns which of its files are missing.
    ///
    /// # Errors
    /// Returns an error if it is too large, or cannot be read at all.
    pub(crate) async fn prepare(
        &self,
        account: &Account,
        urdf: Bytes,
        assets: BTreeMap<String, Sha256>,
    ) -> Result<Prepared, CallError> {
        self.check_description(urdf.len())?;
        let reading = self.limits.reading;
        // Stored includes and meshes may name further files.
        let known = {
            let mut cache = self.lock();
            let known = assets.iter().filter_map(|(uri, sha256)| {
                let bytes = cache.store.get(sha256)?;
                Some((uri.clone(), Asset { sha256: *sha256, bytes }))
            });
            Known(known.collect())
        };
        let (described, description, urdf) = self
            .off_thread(account, move || {
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

    /// Stores a part of a file; returns the number of received bytes.
    ///
    /// # Errors
    /// Returns an error if the file is too large, parts do not match, or the whole file does not have the
    /// hash.
    pub(crate) async fn upload(
        self: &Arc<Self>,
        account: &Account,
        part: FilePart,
    ) -> Result<u64, CallError> {
        let FilePart { sha256, total, .. } = part;
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
                    None => match cache.partials.append(account, &part, Instant::now())? {
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
        // A separate task: other callers wait for the file, even if this caller disconnects.
        let (loader, account) = (self.clone(), account.clone());
        let checked = tokio::spawn(async move {
            let check = Check { loader, sha256 };
            let loader = &check.loader;
            let (found, bytes) =
                loader.off_thread(&account, move || (Sha256::of(&bytes), Arc::from(bytes))).await?;
            if found != sha256 {
                let message = format!("the file has the hash {found}, not {sha256}; send it again");
                return Err(CallError::UploadMismatch { message });
            }
            loader.insert(sha256, bytes)?;
            Ok(total)
        });
        let failed = |error| CallError::Internal { message: format!("a file was not checked: {error}") };
        checked.await.map_err(failed)?
    }

    /// Returns the number of incomplete uploads, and their received bytes.
    pub fn uploads_under_way(&self) -> (usize, usize) {
        self.lock().partials.under_way()
    }

    /// Reads a description like a spawn, but only returns the report. An empty `model` means all robots.
    ///
    /// # Errors
    /// Returns an error if its bytes are not available.
    pub(crate) async fn validate(
        &self,
        account: &Account,
        source: Source,
        scale: f64,
        model: &str,
    ) -> Result<Validated, CallError> {
        let options = self.load_options(scale, false, MeshShapes::default(), None);
        let which = if model.is_empty() { Which::All } else { Which::One(model.to_owned()) };
        let readings = self.read(account, &source.into(), which, options, Reporter::default()).await?;
        let mut findings = Vec::new();
        let mut summaries = Vec::with_capacity(readings.len());
        let mut robots = Vec::with_capacity(readings.len());
        for Reading { used, outcome } in readings {
            match outcome {
                Ok(LoadedRobot { model, report, placement, .. }) => {
                    summaries.push(summary(&model, &report));
                    findings.extend(report.findings);
                    let fixed = Spawn::is_base_fixed(&model, placement.map(|placement| placement.fixed));
                    robots.push(ValidatedRobot { model, fixed, description: used.description });
                }
                Err(refused) => {
                    let summary = format!("refused: {refused}");
                    findings.extend(refused.report.findings);
                    return Ok(Validated { report: LoadReport { findings }, summary, robots: Vec::new() });
                }
            }
        }
        Ok(Validated { report: LoadReport { findings }, summary: summaries.join("; "), robots })
    }

    /// Returns a file that was uploaded or that a robot uses.
    pub(crate) fn asset(&self, sha256: &Sha256) -> Option<Bytes> {
        self.lock().store.get(sha256).map(Bytes::from_owner)
    }

    /// Runs long work on the mesh of a look, on threads that delay no other call; `None` if no robot uses the
    /// mesh.
    ///
    /// # Errors
    /// Returns an error if too many calls wait for a permit already.
    pub(crate) async fn with_mesh<T: Send + 'static>(
        &self,
        account: &Account,
        look: &Sha256,
        work: impl FnOnce(&MeshAsset) -> T + Send + 'static,
    ) -> Result<Option<T>, CallError> {
        let Some(mesh) = self.decoded.find(look) else { return Ok(None) };
        self.off_thread(account, move || work(&mesh)).await.map(Some)
    }

    /// Returns the text of a description with other file names of its meshes.
    ///
    /// # Errors
    /// Returns an error if too many reads wait already, or the text cannot be read.
    pub(crate) async fn readdress(
        &self,
        account: &Account,
        urdf: Bytes,
        address: impl Fn(&str) -> Option<String> + Send + 'static,
    ) -> Result<String, CallError> {
        let limits = self.limits.reading;
        let read = move || simd_model::readdress(&urdf, &limits, &address);
        self.off_thread(account, read).await?.map_err(refused)
    }

    /// Reads the collision filter of an SRDF.
    ///
    /// # Errors
    /// Returns an error if it is not an SRDF, or `strict` refuses its findings.
    async fn read_srdf(
        &self,
        account: &Account,
        srdf: Bytes,
        model: Arc<RobotModel>,
        strict: bool,
    ) -> Result<Srdf, CallError> {
        let limits = self.limits.reading;
        let read = move || simd_model::read_srdf(&srdf, &model, strict, &limits);
        self.off_thread(account, read).await?.map_err(refused)
    }

    /// Returns a robot's source, with states of an SRDF added to its description.
    async fn with_states(
        &self,
        account: &Account,
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
        self.off_thread(account, write).await
    }

    /// Reads a robot, and keeps its source for as long as its model lives. In a file with several robots, it
    /// is the one with the robot's name. Only the named states of the SRDF are used; empty means no SRDF.
    ///
    /// # Errors
    /// Returns an error if its bytes are not available, or are not a robot.
    pub(crate) async fn load(
        &self,
        account: &Account,
        origin: Origin,
        name: &str,
        srdf: Bytes,
        options: LoadOptions,
        reporter: Reporter,
    ) -> Result<LoadedRobot, CallError> {
        let which = Which::One(name.to_owned());
        let mut made = self.load_with_srdf(account, origin, which, srdf, options, reporter).await?;
        let (mut made, found) = made.pop().ok_or_else(nothing_read)?;
        made.report.findings.extend(found.report.findings);
        Ok(made)
    }

    /// Like `load`, for several robots, with a whole SRDF, whose named states become the model's; empty means
    /// no SRDF.
    ///
    /// # Errors
    /// As [`load`](Self::load), and if the SRDF is invalid or refused.
    pub(crate) async fn load_with_srdf(
        &self,
        account: &Account,
        origin: Origin,
        which: Which,
        srdf: Bytes,
        options: LoadOptions,
        reporter: Reporter,
    ) -> Result<Vec<(LoadedRobot, Srdf)>, CallError> {
        let mut all = Vec::new();
        for Reading { mut used, outcome } in self.read(account, &origin, which, options, reporter).await? {
            let mut made = outcome.map_err(refused)?;
            let mut found = Srdf::default();
            if !srdf.is_empty() {
                found = self
                    .read_srdf(account, srdf.clone(), Arc::clone(&made.model), options.read.strict)
                    .await?;
                let states = std::mem::take(&mut found.states);
                let model = Arc::make_mut(&mut made.model);
                let own = model.setup.states.len();
                model.setup.add_states(states);
                // The stored and saved descriptions include them too.
                let added = model.setup.states.get(own..).unwrap_or_default().to_vec();
                if !added.is_empty() {
                    used = self.with_states(account, used, Arc::clone(&made.model), added).await?;
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
    CallError::Internal { message: "a description was refused".into() }
}

/// Files by URI.
struct Known(BTreeMap<String, Asset>);

impl Assets for Known {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        self.0.get(uri).cloned().ok_or_else(Vec::new)
    }
}

/// A check of a file's hash, which ends when this is dropped for any reason.
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
