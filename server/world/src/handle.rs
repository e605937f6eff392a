//! The handle: the only way to the world, for every front-end. It has plain types and no wire types. This
//! file has its parts and its end; each noun has its own file.
//!
//! * `simulation`: commands, steps, states. `changes`: since when robots are unchanged. `events`: the log of
//!   events.
//! * `entities`: robots and their descriptions. `meshes`: their meshes as glTF. `parameters`: sliders and
//!   buttons.
//! * `view`: drawings in pages, and input from pages.
//! * `cameras`: pictures of the world, and their renderers.
//! * `recordings`: recordings of the world. `sensors`: readings of sensors. `rollouts`: copies of the world.
//! * `claims`: claims on joints and their leases. `clients`: present clients, and the sources of joint
//!   targets.
//! * `lockstep`: clients that step the world together.
//! * `call`: the context of a call. `calls`: numbers of calls, and their outcomes.
//! * `saved_states`: files of saved states.
//! * `owners`: owners of saved states and parameters. `audit`: audited calls.
//! * `health`: liveness of the physics thread. `accounts`: shares of each client. `heavy`: permits for long
//!   reads. `once`: answers to retries.

mod accounts;
mod audit;
mod bindings;
mod call;
mod calls;
mod cameras;
mod changes;
mod claims;
mod clients;
mod entities;
mod events;
mod health;
mod heavy;
mod lockstep;
mod meshes;
mod once;
mod owners;
mod parameters;
mod recordings;
mod rollouts;
mod saved_states;
mod sensors;
mod simulation;
#[cfg(any(test, feature = "testing"))]
pub mod testing;
#[cfg(test)]
mod tests;
mod view;

use std::future::Future;
use std::sync::Arc;
use std::time::Duration;

use tokio::sync::oneshot::{self, error::TryRecvError};
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

pub use accounts::ClientStream;
pub use audit::RobotNote;
pub use bindings::{BoundQuantity, JointBinding};
pub use call::CallContext;
pub use calls::{MethodCalls, RefusedUnanswered};
pub use cameras::MAX_PIXELS;
pub use cameras::{
    BadMatrix, CameraName, CameraReport, Drawn, Intrinsics, Lens, Light, Picture, PictureOrder, PictureRobot,
    PictureTask, PictureView, Plane, Planes, RendererStatus, intrinsics,
};
pub use claims::Unproven;
pub use clients::{Caller, Client, Disconnect, Peer, TargetSource, Transport};
pub use clients::{Scope, UnderWay};
pub use entities::{Loaded, Reloaded, SpawnRequest};
pub use heavy::Cancelled;
use heavy::HeavyWork;
use lockstep::Lockstep;
pub use lockstep::LockstepMember;
pub use meshes::Key as MeshKey;
pub use once::{IdentifiedRequest, Outcome};
pub use owners::Owner;
pub use parameters::{NameTaken, Parameter, ParameterChange, ParameterKind, ParameterList};
pub use rollouts::{CopiesDone, RolloutAnswer, RolloutFrom, RolloutStart};
pub use sensors::MAX_WATCHED_SENSORS;
pub use sensors::{NumberedSensor, SensorCursor, SensorReadings, SensorSelection};
pub use view::{
    CameraTarget, GivenColor, Input, InputEvent, InputKind, LinkColor, Marker, MarkerShape, MouseButton,
    NewMarker, PageCamera, ViewCamera, ViewChange,
};

pub use crate::call_error::CallError;
pub use crate::driver::{
    AuditedCall, BlockedJoint, ContactReading, Done, EventBatch, LockstepChange, LogEvent, LoggedEvent,
    LoggedReading, Measured, NamedContactPartner, Pace, PaceChange, Published, ReadingBatch, RecordingEnd,
    Statistics, Stepped,
};
pub use crate::info::{DaemonInfo, DaemonLimits};
pub use crate::loading::{
    AssetState, ExpandedXacro, FilePart, Prepared, Source, Validated, ValidatedRobot, XacroFiles,
};
pub use crate::recording::{RecordingContents, RecordingInfo, RecordingRequest, RecordingState};
pub use crate::run_state::RunState;

use crate::access::Access;
use crate::account::Account;
use crate::driver::{self, Event, ReplyTo};
use crate::loading::Loader;
use crate::recording::Recordings;
use crate::unread_answers::UnreadAnswers;
use accounts::Accounts;
use calls::CallCounts;
use cameras::Cameras;
use changes::ChangeTracker;
use claims::Leases;
use clients::Clients;
use meshes::Meshes;
use once::AnswerCache;
use owners::SavedStateOwners;
use parameters::Parameters;
use rollouts::RolloutWork;
use view::View;

/// Time between two searches for unused objects.
const TIDY: Duration = Duration::from_secs(10);

/// The only way to the world, for one call or for all calls of one client.
#[derive(Clone, Debug)]
pub struct SimHandle {
    inner: Arc<Inner>,
    /// Context of the call that it is for.
    call: CallContext,
}

#[derive(Debug)]
struct Inner {
    driver: driver::Link,
    loader: Arc<Loader>,
    answers: AnswerCache,
    leases: Leases,
    calls: CallCounts,
    clients: Arc<Clients>,
    parameters: Parameters,
    view: View,
    cameras: Cameras,
    changes: ChangeTracker,
    meshes: Meshes,
    saved_state_owners: SavedStateOwners,
    lockstep: Lockstep,
    heavy: HeavyWork,
    rollouts: RolloutWork,
    accounts: Arc<Accounts>,
    unread: Arc<UnreadAnswers>,
    /// Permits for making large answers.
    large_answers: HeavyWork,
    info: DaemonInfo,
    access: Access,
    recordings: Recordings,
    /// Locked while a recording begins or ends.
    recording_lock: tokio::sync::Mutex<()>,
    /// Permits for reading recordings, which may be large.
    recording_looks: HeavyWork,
    /// Origin of the times of targets.
    started: Instant,
    draining: CancellationToken,
}

/// Polls for an answer before its caller sleeps: waking a sleeping thread takes longer than most commands.
/// Meanwhile it yields its processor to other threads.
fn look<T>(answer: &mut oneshot::Receiver<T>, spin: Duration) -> Result<T, TryRecvError> {
    let begun = std::time::Instant::now();
    loop {
        let seen = answer.try_recv();
        if !matches!(seen, Err(TryRecvError::Empty)) || begun.elapsed() >= spin {
            return seen;
        }
        std::thread::yield_now();
    }
}

impl SimHandle {
    /// Makes a handle on a started driver, without access control, for this process.
    #[cfg(any(test, feature = "testing"))]
    pub fn new(driver: driver::Link, loader: Loader, info: DaemonInfo) -> Self {
        let recordings = Recordings::none();
        Self::with_access(driver, loader, info, Access::open(), recordings).of_process()
    }

    /// Makes a handle on a started driver. Its calls are those of an unknown client, until it gets a context:
    /// see [`of_call`](Self::of_call) and [`of_process`](Self::of_process).
    pub fn with_access(
        driver: driver::Link,
        loader: Loader,
        info: DaemonInfo,
        access: Access,
        recordings: Recordings,
    ) -> Self {
        let (leases, calls, clients, saved_state_owners, lockstep, draining) = Default::default();
        let limits = &info.limits;
        let parameters = Parameters::new(limits.parameters);
        let (answers, heavy) = (AnswerCache::new(limits), HeavyWork::new(limits));
        let accounts = Accounts::new(limits.calls_per_second_of_client, limits.streams_of_client);
        let inner = Arc::new(Inner {
            driver,
            loader: Arc::new(loader),
            answers,
            leases,
            calls,
            clients,
            parameters,
            view: View::default(),
            cameras: Cameras::new(&info.limits),
            changes: ChangeTracker::default(),
            meshes: Meshes::default(),
            saved_state_owners,
            lockstep,
            heavy,
            rollouts: RolloutWork::new(limits),
            accounts: Arc::new(accounts),
            unread: UnreadAnswers::new(limits.unread_bytes),
            large_answers: HeavyWork::of_answers(),
            info,
            access,
            recordings,
            recording_lock: tokio::sync::Mutex::default(),
            recording_looks: HeavyWork::of_recordings(),
            started: Instant::now(),
            draining,
        });
        Self { inner, call: CallContext::of(Account::Unknown) }
    }

    /// Returns facts about this daemon, and its limits.
    pub fn info(&self) -> &DaemonInfo {
        &self.inner.info
    }

    /// Returns the access control.
    pub fn access(&self) -> &Access {
        &self.inner.access
    }

    /// Returns the token that is cancelled when the daemon drains: every stream then ends with OK.
    pub fn draining(&self) -> CancellationToken {
        self.inner.draining.clone()
    }

    /// Returns the token that is cancelled when the driver has ended, with or without a panic.
    pub fn driver_ended(&self) -> CancellationToken {
        self.inner.driver.mailbox.ended().clone()
    }

    /// Ends the driver after its present step.
    pub fn end_driver(&self) {
        self.inner.driver.mailbox.close();
    }

    /// Drops unused objects at regular intervals, until the daemon drains.
    pub async fn keep_tidy(self) {
        let draining = self.draining();
        let mut ticks = tokio::time::interval(TIDY);
        while draining.run_until_cancelled(ticks.tick()).await.is_some() {
            self.tidy(Instant::now());
        }
    }

    /// Drops unused objects.
    pub(crate) fn tidy(&self, now: Instant) {
        self.inner.answers.tidy(now);
        self.inner.loader.tidy(now);
        self.inner.driver.sensors.tidy();
        self.tidy_view(now);
        self.tidy_cameras(now);
    }

    /// Returns the meshes of robots, in the form for viewers and renderers.
    pub fn meshes(&self) -> &Meshes {
        &self.inner.meshes
    }

    /// Returns the account of answers that clients have yet to read.
    pub fn unread_answers(&self) -> &Arc<UnreadAnswers> {
        &self.inner.unread
    }

    /// Returns the loader of robots' descriptions.
    pub fn loader(&self) -> &Arc<Loader> {
        &self.inner.loader
    }

    async fn ask<T>(&self, event: impl FnOnce(ReplyTo<T>) -> Event) -> Result<T, CallError> {
        let (reply, mut answer) = oneshot::channel();
        let driver::Link { mailbox, callers, spin, .. } = &self.inner.driver;
        let mut seen = Err(TryRecvError::Empty);
        match callers {
            None => {
                mailbox.post(event(reply))?;
                if !spin.is_zero() {
                    seen = look(&mut answer, *spin);
                }
            }
            Some(callers) => {
                mailbox.put(event(reply))?;
                let mut is_answered = || {
                    // The answer is received only once.
                    if matches!(seen, Err(TryRecvError::Empty)) {
                        seen = answer.try_recv();
                    }
                    !matches!(seen, Err(TryRecvError::Empty))
                };
                callers.drive(&mut is_answered);
                is_answered();
            }
        }
        let answered = match seen {
            Ok(answered) => Some(answered),
            Err(TryRecvError::Empty) => answer.await.ok(),
            Err(TryRecvError::Closed) => None,
        };
        let Some(answered) = answered else {
            // Only an ending driver drops a question; it then gives the reason.
            mailbox.ended().cancelled().await;
            return Err(mailbox.end());
        };
        answered
    }

    async fn until_drained<T>(&self, work: impl Future<Output = T>) -> Result<T, CallError> {
        tokio::select! {
            biased;
            done = work => Ok(done),
            () = self.inner.draining.cancelled() => Err(CallError::ShuttingDown),
            () = self.inner.driver.mailbox.ended().cancelled() => Err(self.inner.driver.mailbox.end()),
        }
    }
}
