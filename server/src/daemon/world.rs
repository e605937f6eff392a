//! The world of a daemon, without its transports: opened, filled with its robots, and maintained. A daemon
//! and a world embedded in a program share this.

use prost::Message as _;
use simd_core::Simulation;
use simd_core::simulation::WorldLimits;
use simd_model::Severity;

use super::{Error, autosave, memory};
use crate::config::{Autosave, Config, Robot};
use simd_api::convert::to_proto;
use simd_world::access::Access;
use simd_world::blocking_threads::BlockingThreads;
use simd_world::driver;
use simd_world::handle::{CallError, DaemonInfo, RunState, SimHandle, Source, SpawnRequest};
use simd_world::loading::Loader;
use simd_world::recording::{Encoders, Recordings};

/// Makes the loader of descriptions, from uploads and below the asset roots.
///
/// # Errors
/// Returns an error if a root is not a folder, or the system refuses threads.
pub(crate) fn loader(config: &Config) -> Result<Loader, Error> {
    let threads = BlockingThreads::computing().map_err(Error::System)?;
    Loader::new(config.limits, &config.asset_roots, threads)
        .map_err(|(folder, source)| Error::AssetRoot { folder, source })
}

/// Opens an empty world, and returns the process's own handle. The world is paused, since robots are loaded before the first step.
///
/// # Errors
/// Returns an error if the system refuses the thread.
pub(crate) fn open(config: &Config, loader: Loader, access: Access) -> Result<SimHandle, Error> {
    let limits = config.limits;
    // A state that is restored at the start is kept for a moment, even if clients may keep none: `SimHandle`
    // refuses theirs.
    let saved_states = (limits.saved_states as usize).max(1);
    let world = Simulation::new(config.physics, WorldLimits { robots: limits.robots as usize, saved_states });
    let paused = driver::Config { state: RunState::Paused, ..config.driver };
    let link = driver::start(world, paused).map_err(Error::System)?;
    let encoders = Encoders {
        event: |event| to_proto::event::event(event.clone()).encode_to_vec(),
        contacts: |state| to_proto::contact::recorded(state).encode_to_vec(),
        report: |report, summary| {
            to_proto::entity::report(report.clone(), summary.to_owned()).encode_to_vec()
        },
        reading: |reading| to_proto::sensor::reading(reading.clone()).encode_to_vec(),
    };
    let recordings = Recordings::new(config.recording.clone(), encoders);
    let info = DaemonInfo { name: config.name.clone(), version: env!("CARGO_PKG_VERSION"), limits };
    Ok(SimHandle::with_access(link, loader, info, access, recordings).of_process())
}

/// Loads the robots of the configuration, or the saved world, and then sets the run state of the
/// configuration.
///
/// # Errors
/// Returns an error if a robot cannot be loaded, or the driver ended.
pub(crate) async fn fill(config: &Config, handle: &SimHandle) -> Result<(), Error> {
    let restored = match config.autosave.as_ref().filter(|autosave| autosave.restore) {
        Some(autosave) => autosave::restore(handle, autosave).await,
        None => false,
    };
    // A saved world has its robots.
    if !restored {
        load_robots(config, handle).await?;
    }
    if config.driver.state != RunState::Paused {
        let driver = |error: CallError| Error::Driver(error.to_string());
        handle.set_state(config.driver.state).await.map_err(driver)?;
    }
    Ok(())
}

/// Loads the robots of the configuration.
///
/// # Errors
/// Returns an error for the first robot that cannot be loaded.
pub(crate) async fn load_robots(config: &Config, handle: &SimHandle) -> Result<(), Error> {
    for robot in &config.robots {
        load(handle, robot.clone()).await?;
    }
    Ok(())
}

/// Why there is no world: what was met first, or what it comes from. Ends the driver.
pub(crate) fn not_started(handle: &SimHandle, error: Error) -> Error {
    // If the physics thread panicked, the robot that could not be loaded is not at fault.
    let failure = handle.driver_failure().map(str::to_owned);
    handle.end_driver();
    failure.map_or(error, Error::Driver)
}

/// Starts the tasks that maintain a world, until it drains.
pub(crate) fn keep(config: &Config, handle: &SimHandle) {
    tokio::spawn(handle.clone().keep_tidy());
    tokio::spawn(handle.clone().measure_scans());
    tokio::spawn(handle.clone().order_pictures());
    if config.limits.memory_limit > 0 {
        tokio::spawn(memory::watch(handle.clone(), config.autosave.clone()));
    }
    if let Some(autosave) = config.autosave.clone() {
        tokio::spawn(autosave::keep(handle.clone(), autosave));
    }
}

/// Saves the world for the last time, if autosave is enabled.
pub(crate) async fn save_last(autosave: Option<&Autosave>, handle: &SimHandle) {
    if let Some(autosave) = autosave {
        autosave::last(handle, autosave).await;
    }
}

/// Loads a robot that the operator named, and logs the warnings of its report.
async fn load(handle: &SimHandle, robot: Robot) -> Result<(), Error> {
    let path = robot.path;
    let request = SpawnRequest {
        source: Source::Path(path.display().to_string()),
        name: robot.name,
        allow_renaming: false,
        pose: robot.pose,
        free_place: Default::default(),
        fixed_base: robot.fixed,
        passive: robot.passive,
        joint_positions: robot.positions.into_iter().collect(),
        joint_orientations: Vec::new(),
        scale: robot.scale,
        strict: robot.strict,
        mesh_shapes: Default::default(),
        contact_settings: Default::default(),
        srdf: Default::default(),
        collision_pairs: Vec::new(),
        model: String::new(),
    };
    let loaded = handle.spawn_at_start(path.clone(), request).await;
    let loaded = loaded.map_err(|source| Error::Robot { path, source })?;
    for finding in loaded.report.at_least(Severity::Warning) {
        let line = finding.line.unwrap_or(0);
        tracing::warn!(robot = loaded.name, line, "{}: {}", finding.element, finding.message);
    }
    Ok(())
}
