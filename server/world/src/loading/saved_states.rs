//! Saved states to and from files: a state of the world with all sources of its robots.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use bytes::Bytes;
use simd_core::simulation::{RobotParts, Saved};
use simd_model::robot::{Geometry, Sha256};
use simd_model::{Asset, RobotModel};

use super::Loader;
use super::progress::Reporter;
use super::reading::{LoadedRobot, Origin};
use super::saved_state_file::{Content, Opened, RobotSource, SavedRobot, invalid, open, seal};
use crate::account::Account;
use crate::call_error::CallError;
use crate::info::MAX_NAME_BYTES;

/// Files by hash.
pub(crate) type Files = BTreeMap<Sha256, Arc<[u8]>>;

impl Loader {
    /// Returns the file of a saved state with this name, and its hash.
    ///
    /// # Errors
    /// Returns an error if the file would exceed the limit of uploads.
    pub(crate) async fn write_saved_state(
        &self,
        account: &Account,
        name: String,
        saved: Saved,
    ) -> Result<(Sha256, Arc<[u8]>), CallError> {
        let (sources, files) = self.sources_and_files(&saved)?;
        let (sha256, file) = self.off_thread(account, move || sealed(&name, &saved, sources, files)).await?;
        self.check_file(file.len())?;
        Ok((sha256, file))
    }

    /// Reads a saved state from a file, under this name; an empty name keeps its old one.
    ///
    /// # Errors
    /// Returns an error if the file is not a saved state or is damaged, or its robots cannot be read as they
    /// were.
    pub(crate) async fn read_saved_state(
        &self,
        account: &Account,
        file: Bytes,
        name: String,
    ) -> Result<(String, Saved), CallError> {
        let robots = self.most_robots();
        let (opened, files) = self.off_thread(account, move || unpacked(&file, robots)).await??;
        let Opened { written_by, content } = opened;
        let name = if name.is_empty() { content.name.clone() } else { name };
        if name.len() > MAX_NAME_BYTES {
            return Err(invalid(format!(
                "name is {} bytes long; it must have at most {MAX_NAME_BYTES}",
                name.len()
            )));
        }
        let saved = self.saved(account, content, &files, &mut BTreeMap::new()).await?;
        tracing::info!(saved_state = name, "read a file that simd {written_by} wrote");
        Ok((name, saved))
    }

    /// Returns the maximum number of robots in a file.
    pub(crate) fn most_robots(&self) -> usize {
        usize::try_from(self.limits.robots).unwrap_or(usize::MAX)
    }

    /// Returns the state in a file with the files beside it. Its robots are taken from `known`, or made and
    /// added to it.
    ///
    /// # Errors
    /// Returns an error if a file is missing, or its robots cannot be read as they were.
    pub(crate) async fn saved(
        &self,
        account: &Account,
        content: Content,
        files: &Files,
        known: &mut BTreeMap<RobotSource, RobotParts>,
    ) -> Result<Saved, CallError> {
        let mut made = Vec::with_capacity(content.robots.len());
        for SavedRobot { source, state, .. } in &content.robots {
            // Robots with equal sources share one model; otherwise, a thousand balls would be read a thousand
            // times.
            made.push(self.made_again(account, source, files, &state.entity.name, known).await?);
        }
        self.off_thread(account, move || content.into_saved(made)).await?
    }

    /// Makes a robot from its source.
    ///
    /// # Errors
    /// Returns an error if a file is missing, or cannot be read.
    pub(crate) async fn made_again(
        &self,
        account: &Account,
        source: &RobotSource,
        files: &Files,
        robot: &str,
        known: &mut BTreeMap<RobotSource, RobotParts>,
    ) -> Result<RobotParts, CallError> {
        if let Some(made) = known.get(source) {
            return Ok(made.clone());
        }
        let made = self.load_again(account, source, files, robot).await?;
        known.insert(source.clone(), made.clone());
        Ok(made)
    }

    async fn load_again(
        &self,
        account: &Account,
        source: &RobotSource,
        files: &Files,
        robot: &str,
    ) -> Result<RobotParts, CallError> {
        let of_robot =
            || format!("robot {:?} of the saved state", robot.chars().take(80).collect::<String>());
        let find = |sha256: &Sha256| {
            let lacking = || invalid(format!("{}: the file {sha256} is not in it", of_robot()));
            files.get(sha256).cloned().ok_or_else(lacking)
        };
        let urdf = find(&source.description)?;
        let assets = source
            .assets
            .iter()
            .map(|(uri, sha256)| Ok((uri.clone(), Asset { sha256: *sha256, bytes: find(sha256)? })));
        let origin = Origin::Sent { urdf, files: assets.collect::<Result<_, CallError>>()? };
        let RobotSource { scale, mesh_shapes, fixed_base, .. } = *source;
        let options = self.load_options(f64::from_bits(scale), false, mesh_shapes, Some(fixed_base));
        let made = self.load(account, origin, robot, Bytes::new(), options, Reporter::default()).await;
        match made {
            Ok(LoadedRobot { model, shapes, .. }) => Ok((model, shapes)),
            Err(error @ (CallError::InvalidDescription { .. } | CallError::InvalidValue { .. })) => {
                Err(invalid(format!("{} cannot be read: {error}", of_robot())))
            }
            Err(error) => Err(error),
        }
    }

    /// Returns the sources of a state's robots, and the files for them.
    fn sources_and_files(&self, saved: &Saved) -> Result<(Vec<RobotSource>, Files), CallError> {
        let mut sources = Vec::new();
        let mut used = BTreeSet::new();
        for source in self.robot_sources(saved)? {
            used.insert(source.description);
            used.extend(source.assets.values());
            sources.push(source);
        }
        let mut files = Files::new();
        let mut size = 0usize;
        for sha256 in used {
            let bytes = self.file_of_robot(&sha256)?;
            size = size.saturating_add(bytes.len());
            self.check_file(size)?;
            files.insert(sha256, bytes);
        }
        Ok((sources, files))
    }

    /// Returns the sources of a state's robots.
    pub(crate) fn robot_sources(&self, saved: &Saved) -> Result<Vec<RobotSource>, CallError> {
        saved.models().map(|model| self.robot_source(model)).collect()
    }

    /// Returns the source of a robot.
    ///
    /// # Errors
    /// Returns an error if it was not made by this loader.
    pub(crate) fn robot_source(&self, model: &Arc<RobotModel>) -> Result<RobotSource, CallError> {
        let source = self.with_known(model, |known| RobotSource {
            description: known.description,
            assets: mesh_files(model),
            scale: known.scale.to_bits(),
            mesh_shapes: known.mesh_shapes,
            fixed_base: known.fixed_base,
        });
        let unknown = || format!("it is not known where robot model {:?} came from", model.name);
        source.ok_or_else(|| CallError::Internal { message: unknown() })
    }

    /// Returns a file that a robot was made from.
    ///
    /// # Errors
    /// Returns an error if it is no longer stored.
    pub(crate) fn file_of_robot(&self, sha256: &Sha256) -> Result<Arc<[u8]>, CallError> {
        let gone = || CallError::Internal { message: format!("the file {sha256} of a robot is gone") };
        self.lock().store.get(sha256).ok_or_else(gone)
    }

    /// Refuses to write a file that no daemon with these limits would accept.
    fn check_file(&self, bytes: usize) -> Result<u64, CallError> {
        let (value, limit) = (bytes as u64, self.limits.asset_bytes);
        if value <= limit {
            return Ok(value);
        }
        let what = "the size of the saved state's file, its robots' meshes included, in bytes".into();
        Err(CallError::LimitExceeded { what, value, limit })
    }
}

/// Returns the meshes and pictures that a model was made with. Missing or unreadable ones are missing again.
fn mesh_files(model: &RobotModel) -> BTreeMap<String, Sha256> {
    let mut files = BTreeMap::new();
    for link in &model.links {
        for picture in link.visuals.iter().filter_map(|visual| visual.texture.as_ref()) {
            files.insert(picture.uri.clone(), picture.image.sha256);
        }
        let seen = link.visuals.iter().map(|visual| &visual.geometry);
        for geometry in seen.chain(link.collisions.iter().map(|collision| &collision.geometry)) {
            if let Geometry::Mesh { uri, asset: Some(asset), .. } = geometry {
                files.insert(uri.clone(), asset.sha256);
                // The picture of the description's material is named by the visual.
                let beside = asset.files.iter().filter(|file| !file.name.is_empty());
                files.extend(beside.map(|file| (simd_model::beside_mesh(uri, &file.name), file.sha256)));
            }
        }
    }
    files
}

fn sealed(name: &str, saved: &Saved, sources: Vec<RobotSource>, files: Files) -> (Sha256, Arc<[u8]>) {
    let file = seal(&Content::new(name, saved, sources, files.into_values().collect()));
    (Sha256::of(&file), file.into())
}

fn unpacked(file: &[u8], robots: usize) -> Result<(Opened, Files), CallError> {
    let mut opened = open(file, robots)?;
    let files = std::mem::take(&mut opened.content.files);
    let files = files.into_iter().map(|bytes| (Sha256::of(&bytes), bytes));
    Ok((opened, files.collect()))
}
