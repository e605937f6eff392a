//! Reads descriptions into models: outside of the physics thread and the async workers, two at a time.

use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use glamx::DPose3;
use simd_core::collision::{MeshShapes, Shapes};
use simd_core::simulation::command::Spawn;
use simd_model::robot::Sha256;
use simd_model::{
    Asset, Assets, Disposition, Finding, LoadReport, ReadOptions, Refused, RobotModel, Severity,
};

use super::Loader;
use super::decoded::{Decoded, Decoding};
use super::disk::{DiskAssets, OnDisk, find_for_operator, read_file};
use super::progress::{Phase, Reporter};
use super::report::{refuse_proxies, report_absent, report_coarse_pairs, report_proxies};
use super::source::Source;
use crate::account::Account;
use crate::call_error::{CallError, panic_message};

/// Source of a robot, to be read now or again later.
#[derive(Clone, Debug)]
pub(crate) enum Origin {
    /// A stored description and its files.
    Kept { description: Sha256, assets: BTreeMap<String, Sha256>, missing: BTreeMap<String, Vec<String>> },
    /// A description within the request.
    Inline { urdf: Bytes, assets: BTreeMap<String, Sha256>, missing: BTreeMap<String, Vec<String>> },
    /// A description with all its files.
    Sent { urdf: Arc<[u8]>, files: BTreeMap<String, Asset> },
    /// A path that a client named.
    BelowRoot(String),
    /// A path that the operator named.
    Operator(PathBuf),
}

impl From<Source> for Origin {
    fn from(source: Source) -> Self {
        match source {
            Source::Uploaded { description, assets, missing } => Self::Kept { description, assets, missing },
            Source::Inline { urdf, assets, missing } => Self::Inline { urdf, assets, missing },
            Source::Path(path) => Self::BelowRoot(path),
        }
    }
}

/// Options of making a robot from its description.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LoadOptions {
    pub(super) read: ReadOptions,
    pub(super) mesh_shapes: MeshShapes,
    /// Whether the root link cannot move; `None` fixes a root link called `world`.
    pub(super) fixed_base: Option<bool>,
}

/// Result of reading a description.
#[derive(Debug)]
pub(super) struct Reading {
    pub(super) used: Used,
    /// The robot, or the reason why there is none.
    pub(super) outcome: Result<LoadedRobot, Refused>,
}

/// A robot that can be spawned.
#[derive(Debug)]
pub(crate) struct LoadedRobot {
    pub(crate) model: Arc<RobotModel>,
    /// Collision shapes, made here because hulls of large meshes take long.
    pub(crate) shapes: Arc<Shapes>,
    pub(crate) report: LoadReport,
    /// Placement in its description, if the description is a world.
    pub(crate) placement: Option<Placement>,
}

/// Placement of a robot in an SDF or MJCF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Placement {
    /// `world_from_root`.
    pub(crate) pose: DPose3,
    /// Whether its root link cannot move.
    pub(crate) fixed: bool,
}

/// Selection of a description's robots.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Which {
    /// The one with this name, or the only one.
    One(String),
    /// All of them.
    All,
}

/// Bytes that a robot was made from.
#[derive(Debug)]
pub(super) struct Used {
    pub(super) description: Sha256,
    pub(super) urdf: Arc<[u8]>,
    /// Files, each once.
    pub(super) files: BTreeMap<Sha256, Arc<[u8]>>,
    /// URIs that the description names, for a robot that was sent.
    pub(super) uris: BTreeSet<String>,
    /// The files among `files` that were made from an MJCF, by their URIs in the URDF.
    pub(super) made: BTreeMap<String, Sha256>,
}

/// Bytes of a description, or their location.
enum Material {
    Sent { urdf: Arc<[u8]>, files: SentAssets },
    Disk(OnDisk),
}

/// Files that a client sent.
struct SentAssets {
    found: BTreeMap<String, Asset>,
    missing: BTreeMap<String, Vec<String>>,
    /// URIs that the description asked for.
    asked: RefCell<BTreeSet<String>>,
}

impl SentAssets {
    /// Returns the files that the description asked for, and all URIs that it asked for.
    fn into_used(mut self) -> (BTreeMap<Sha256, Arc<[u8]>>, BTreeSet<String>) {
        let asked = self.asked.into_inner();
        self.found.retain(|uri, _| asked.contains(uri));
        (self.found.into_values().map(|file| (file.sha256, file.bytes)).collect(), asked)
    }
}

impl Assets for SentAssets {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        self.asked.borrow_mut().insert(uri.to_owned());
        self.found.get(uri).cloned().ok_or_else(|| self.missing.get(uri).cloned().unwrap_or_default())
    }
}

impl Loader {
    /// Reads the robots of a description; there is at least one.
    ///
    /// # Errors
    /// Returns an error if its bytes are not available; their faults are in a reading's outcome.
    pub(super) async fn read(
        &self,
        account: &Account,
        origin: &Origin,
        which: Which,
        options: LoadOptions,
        reporter: Reporter,
    ) -> Result<Vec<Reading>, CallError> {
        // Not written as two comparisons, so that NaN is refused too.
        if !(f64::MIN_POSITIVE..=1000.0).contains(&options.read.scale) {
            return Err(CallError::InvalidValue {
                element: "scale".into(),
                value: options.read.scale.to_string(),
                expected: "it must be above 0 and at most 1000".into(),
            });
        }
        let limits = self.limits;
        let (origin, roots, decoded) = (origin.clone(), self.roots.clone(), self.decoded.clone());
        let sent = match &origin {
            Origin::Kept { description, assets, missing } => {
                let urdf = self.lock().store.get(description);
                let lacking = || CallError::DescriptionNotUploaded { sha256: description.to_string() };
                Some((urdf.ok_or_else(lacking)?, self.gather(assets)?, missing.clone()))
            }
            Origin::Inline { urdf, assets, missing } => {
                self.check_description(urdf.len())?;
                Some((Arc::from(&urdf[..]), self.gather(assets)?, missing.clone()))
            }
            Origin::Sent { urdf, files } => {
                self.check_description(urdf.len())?;
                Some((urdf.clone(), files.clone(), BTreeMap::new()))
            }
            Origin::BelowRoot(_) | Origin::Operator(_) => None,
        };
        self.off_thread(account, move || {
            reporter.say(Phase::Reading);
            let material = match (sent, &origin) {
                (Some((urdf, found, missing)), _) => {
                    Material::Sent { urdf, files: SentAssets { found, missing, asked: RefCell::default() } }
                }
                (None, Origin::BelowRoot(path)) => Material::Disk(roots.find(path)?),
                (None, Origin::Operator(path)) => Material::Disk(find_for_operator(path)?),
                (None, Origin::Kept { .. } | Origin::Inline { .. } | Origin::Sent { .. }) => {
                    return Err(CallError::Internal { message: "an upload without its bytes".into() });
                }
            };
            match material {
                Material::Sent { urdf, files } => {
                    let parts = read_parts(urdf, &files, &which, &options, &decoded, &reporter)?;
                    let (files, uris) = files.into_used();
                    let reading = |part| Reading::new(part, files.clone(), uris.clone());
                    Ok(parts.into_iter().map(reading).collect())
                }
                Material::Disk(robot) => {
                    let urdf = read_file(&robot.urdf, limits.description_bytes)?;
                    let files = DiskAssets::new(&robot, limits.asset_bytes);
                    let parts = read_parts(urdf, &files, &which, &options, &decoded, &reporter)?;
                    let files = files.into_files();
                    let reading = |part| Reading::new(part, files.clone(), BTreeSet::new());
                    Ok(parts.into_iter().map(reading).collect())
                }
            }
        })
        .await?
    }

    /// Returns the stored files of an upload.
    fn gather(&self, assets: &BTreeMap<String, Sha256>) -> Result<BTreeMap<String, Asset>, CallError> {
        let mut cache = self.lock();
        let found = assets.iter().map(|(uri, sha256)| match cache.store.get(sha256) {
            Some(bytes) => Ok((uri.clone(), Asset { sha256: *sha256, bytes })),
            None => Err(CallError::AssetNotUploaded { uri: uri.clone(), sha256: sha256.to_string() }),
        });
        found.collect()
    }

    /// Runs long work for a client when a permit is free. A caller that waits too long is refused. The work, which is
    /// bounded, still ends, and releases its permit.
    pub(crate) async fn off_thread<T: Send + 'static>(
        &self,
        account: &Account,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, CallError> {
        let (read_permits, threads) = (self.read_permits.clone(), Arc::clone(&self.threads));
        let done = async move {
            let permit = read_permits.acquire(account).await?;
            let done = threads.run(move || {
                let done = work();
                drop(permit);
                done
            });
            done.await.map_err(|error| match error.try_into_panic() {
                Ok(payload) => CallError::Internal {
                    message: format!("a description could not be read: {}", panic_message(payload.as_ref())),
                },
                Err(_cancelled) => CallError::ShuttingDown,
            })
        };
        let limit = self.limits.reading_seconds;
        let in_time = tokio::time::timeout(Duration::from_secs(limit), done).await;
        in_time.unwrap_or_else(|_elapsed| {
            let what = "the time for reading a description or a file, in seconds,".into();
            Err(CallError::LimitExceeded { what, value: limit + 1, limit })
        })
    }
}

impl Reading {
    fn new(part: Part, mut files: BTreeMap<Sha256, Arc<[u8]>>, uris: BTreeSet<String>) -> Self {
        let (urdf, meshes, outcome) = part;
        let made = meshes.iter().map(|(uri, mesh)| (uri.clone(), mesh.sha256)).collect();
        files.extend(meshes.into_values().map(|mesh| (mesh.sha256, mesh.bytes)));
        Self { used: Used { description: Sha256::of(&urdf), urdf, files, uris, made }, outcome }
    }
}

/// URDF of a robot, its generated meshes, and the robot or the reason why there is none.
type Part = (Arc<[u8]>, BTreeMap<String, Asset>, Result<LoadedRobot, Refused>);

/// Reads the robots of a description. SDF and MJCF are translated to URDF here.
///
/// # Errors
/// As [`read`].
fn read_parts(
    bytes: Arc<[u8]>,
    files: &dyn Assets,
    which: &Which,
    options: &LoadOptions,
    decoded: &Decoded,
    reporter: &Reporter,
) -> Result<Vec<Part>, CallError> {
    let translation = match simd_model::translate(&bytes, files, &options.read.limits) {
        Ok(None) => {
            let mut outcome = read(&bytes, files, options, decoded, reporter)?;
            if let Ok(made) = &mut outcome {
                let names = BTreeSet::from([made.model.name.as_str()]);
                report_absent(&made.model, &names, &mut made.report);
            }
            return Ok(vec![(bytes, BTreeMap::new(), outcome)]);
        }
        Ok(Some(translation)) => translation,
        Err(refused) => return Ok(vec![(bytes, BTreeMap::new(), Err(refused))]),
    };
    if let Some(missing) = translation.missing.as_ref().filter(|_| options.read.strict) {
        let message = format!("{missing} (strict loading refuses this)");
        let mut report = translation.report.clone();
        if let Some(at) = report.findings.iter().position(|finding| finding.message == *missing) {
            let finding = report.findings.remove(at);
            let (severity, disposition) = (Severity::Error, Disposition::Refused);
            report.findings.push(Finding { severity, disposition, message: message.clone(), ..finding });
        }
        return Ok(vec![(bytes, BTreeMap::new(), Err(Refused { message, report }))]);
    }
    let files = &translation.files(files);
    let models = match which {
        Which::All => translation.models.iter().collect(),
        Which::One(name) => match translation.model(name) {
            Ok(model) => vec![model],
            Err(refused) => return Ok(vec![(bytes, BTreeMap::new(), Err(refused))]),
        },
    };
    let names: BTreeSet<&str> = models.iter().map(|model| model.name.as_str()).collect();
    let mut parts = Vec::with_capacity(models.len());
    for model in models {
        let urdf: Arc<[u8]> = Arc::from(model.urdf.as_bytes());
        let fixed = options.fixed_base.unwrap_or(model.fixed);
        let options = LoadOptions { fixed_base: Some(fixed), ..*options };
        let mut outcome = read(&urdf, files, &options, decoded, reporter)?;
        // Findings about the whole file are reported once.
        let of_file = if parts.is_empty() { translation.report.findings.clone() } else { Vec::new() };
        let whole = |own: LoadReport| LoadReport {
            findings: of_file.into_iter().chain(model.report(own).findings).collect(),
        };
        match &mut outcome {
            Ok(made) => {
                report_absent(&made.model, &names, &mut made.report);
                made.report = whole(std::mem::take(&mut made.report));
                made.placement = Some(Placement { pose: model.pose, fixed });
            }
            Err(refused) => {
                refused.report = whole(std::mem::take(&mut refused.report));
                // The line belongs to the generated URDF, which the client did not send.
                if let Some(last) = refused.report.findings.last() {
                    let line = last.line.map_or_else(String::new, |line| format!(" (line {line})"));
                    refused.message =
                        format!("robot {:?}: {}{line}: {}", model.name, last.element, last.message);
                }
            }
        }
        parts.push((urdf, translation.meshes.clone(), outcome));
    }
    Ok(parts)
}

/// Reads a description and makes its shapes, with reuse of other robots' data from the same files.
///
/// # Errors
/// Returns an error if the meshes of all robots would exceed the limit of memory.
fn read(
    urdf: &[u8],
    files: &dyn Assets,
    options: &LoadOptions,
    decoded: &Decoded,
    reporter: &Reporter,
) -> Result<Result<LoadedRobot, Refused>, CallError> {
    // The count is only needed for progress reports.
    let described = reporter.is_heard().then(|| simd_model::describe(urdf, &options.read.limits));
    let total = described.and_then(Result::ok).map_or(0, |described| described.asset_uris.len());
    let files = Decoding::new(decoded, files);
    let outcome = simd_model::read(urdf, &reporter.counting(&files, total), &options.read);
    files.check()?;
    let (model, mut report) = match outcome {
        Ok(read) => read,
        Err(refused) => return Ok(Err(refused)),
    };
    reporter.say(Phase::Hulls);
    let fixed_base = Spawn::is_base_fixed(&model, options.fixed_base);
    let shapes = Arc::new(Shapes::reusing(&model, fixed_base, options.mesh_shapes, &decoded.shapes()));
    decoded.admit_shapes(&shapes)?;
    let most = options.read.limits.findings;
    report_proxies(&shapes, most, &mut report);
    report_coarse_pairs(&shapes.coarse_pairs(&model, fixed_base), &model, most, &mut report);
    if options.read.strict {
        match refuse_proxies(report) {
            Ok(unchanged) => report = unchanged,
            Err(refused) => return Ok(Err(refused)),
        }
    }
    Ok(Ok(LoadedRobot { model: Arc::new(model), shapes, report, placement: None }))
}
