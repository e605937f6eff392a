//! The one way to the world, for every front-end: plain types, no wire types. Here are its parts and its end; what
//! can be asked of it is in one file a noun.
//!
//! * `simulation`: commands, steps, states. `changes`: since when robots are as they are. `events`: what happened.
//! * `entities`: robots and their descriptions. `meshes`: their meshes as glTF. `parameters`: sliders and buttons.
//! * `view`: what pages show beside the world, and what people do in them.
//! * `cameras`: pictures of the world, and who draws them.
//! * `recordings`: what happens, into files. `sensors`: what sensors measured. `rollouts`: copies of the world that run on.
//! * `claims`: claims on joints and their leases. `clients`: who is here, and whose targets joints have.
//! * `lockstep`: clients that step the world together.
//! * `calls`: how many calls there were, and how they ended.
//! * `saved_states`: states of the world to files and from them.
//! * `owners`: whose saved states and parameters are. `audit`: who did what.
//! * `health`: whether the physics thread gets on. `accounts`: what each client has. `heavy`: permits for reads that take long. `once`: answers to retries.

mod accounts;
mod audit;
mod bindings;
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

use simd_core::simulation::command::ClaimId;
use tokio::sync::oneshot::{self, error::TryRecvError};
use tokio::time::Instant;
use tokio_util::sync::CancellationToken;

pub use accounts::ClientStream;
pub use audit::RobotNote;
pub use bindings::{BoundQuantity, JointBinding};
pub use calls::{MethodCalls, RefusedUnanswered};
pub use cameras::MOST_PIXELS;
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
pub use sensors::MOST_FOLLOWED;
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
pub use crate::loading::{AssetState, ExpandedXacro, Prepared, Source, Validated, XacroFiles};
pub use crate::recording::{RecordingContents, RecordingInfo, RecordingRequest, RecordingState};
pub use crate::run_state::RunState;

use crate::access::{Access, Grant};
use crate::account::Account;
use crate::driver::{self, Event, ReplyTo, Sender};
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

/// How often unused things are looked for.
const TIDY: Duration = Duration::from_secs(10);

/// The one way to the world. Clones are the same handle.
#[derive(Clone, Debug)]
pub struct SimHandle {
    inner: Arc<Inner>,
    /// That commands come with.
    claim: Option<ClaimId>,
    /// The robots that commands may change; none is all, and the world.
    only: Arc<[String]>,
    /// Whom commands come from, for recordings.
    sender: Sender,
    /// Whom what is made belongs to.
    account: Account,
    /// What is another's may be replaced and taken away.
    takes_over: bool,
    /// Where the robots of the call are noted.
    note: Option<RobotNote>,
    /// Cancelled when the caller's token is revoked or expires.
    revoked: Option<CancellationToken>,
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
    /// For the making of large answers.
    large_answers: HeavyWork,
    info: DaemonInfo,
    access: Access,
    recordings: Recordings,
    /// Held while a recording begins or is being ended.
    recording_lock: tokio::sync::Mutex<()>,
    /// For looks into recordings, which may be large.
    recording_looks: HeavyWork,
    /// What the times of targets are counted from.
    started: Instant,
    draining: CancellationToken,
}

/// Looks for an answer for so long before its caller waits for it: a thread that waits has to be woken, which takes longer
/// than most commands. A thread that needs the processor meanwhile gets it.
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
    /// A handle on a driver that was started, to which everybody may come.
    #[cfg(any(test, feature = "testing"))]
    pub fn new(driver: driver::Link, loader: Loader, info: DaemonInfo) -> Self {
        let recordings = Recordings::none();
        Self::with_access(driver, loader, info, Access::open(), recordings)
    }

    /// A handle on a driver that was started.
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
        Self::of_everybody(Arc::new(Inner {
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
        }))
    }

    /// For no caller in particular.
    fn of_everybody(inner: Arc<Inner>) -> Self {
        Self {
            inner,
            claim: None,
            only: Arc::default(),
            sender: None,
            account: Account::Process,
            takes_over: false,
            note: None,
            revoked: None,
        }
    }

    /// The same for the holder of a claim, whom the caller has found to be that: each command begins its lease anew.
    #[must_use]
    pub fn acting_for(&self, claim: Option<ClaimId>) -> Self {
        Self { claim, ..self.clone() }
    }

    /// The same for what this caller sends.
    #[must_use]
    pub fn called_by(&self, caller: Option<&Caller>) -> Self {
        Self { sender: caller.map(|caller| caller.name.clone()), ..self.clone() }
    }

    /// The same for this client, as limits know it.
    #[must_use]
    pub fn of_account(&self, account: Option<&Account>) -> Self {
        let account = account.cloned().unwrap_or(Account::Process);
        Self { account, ..self.clone() }
    }

    /// The same for the owner of a token, which may be for some robots alone.
    #[must_use]
    pub fn within(&self, grant: Option<&Grant>) -> Self {
        match grant {
            Some(grant) => {
                let (only, revoked) = (Arc::clone(&grant.robots), Some(grant.revoked.clone()));
                Self { only, revoked, ..self.clone() }
            }
            None => self.clone(),
        }
    }

    /// Refuses what changes other robots than those that this handle is for; `None` is the world.
    pub(crate) fn check_robots(&self, robots: Option<&[&str]>) -> Result<(), CallError> {
        if self.only.is_empty() {
            return Ok(());
        }
        let other = match robots {
            Some(robots) => robots.iter().find(|robot| !self.only.iter().any(|only| only == *robot)),
            None => Some(&""),
        };
        match other {
            Some(robot) => {
                Err(CallError::RobotNotAllowed { robot: (*robot).to_owned(), allowed: self.only.to_vec() })
            }
            None => Ok(()),
        }
    }

    /// Who this daemon is, and its limits.
    pub fn info(&self) -> &DaemonInfo {
        &self.inner.info
    }

    /// Who may call what.
    pub fn access(&self) -> &Access {
        &self.inner.access
    }

    /// Cancelled when the daemon drains: every stream ends with OK then.
    pub fn draining(&self) -> CancellationToken {
        self.inner.draining.clone()
    }

    /// Cancelled when the driver has ended, because it was asked to or because it failed.
    pub fn driver_ended(&self) -> CancellationToken {
        self.inner.driver.mailbox.ended().clone()
    }

    /// Ends the driver after the step that it is in.
    pub fn end_driver(&self) {
        self.inner.driver.mailbox.close();
    }

    /// Looks now and then for what is unused. Ends when the daemon drains.
    pub async fn keep_tidy(self) {
        let draining = self.draining();
        let mut ticks = tokio::time::interval(TIDY);
        while draining.run_until_cancelled(ticks.tick()).await.is_some() {
            self.tidy(Instant::now());
        }
    }

    /// Drops what is unused.
    pub(crate) fn tidy(&self, now: Instant) {
        self.inner.answers.tidy(now);
        self.inner.loader.tidy(now);
        self.inner.driver.sensors.tidy();
        self.tidy_view(now);
        self.tidy_cameras(now);
    }

    /// The meshes of robots as viewers and renderers get them.
    pub fn meshes(&self) -> &Meshes {
        &self.inner.meshes
    }

    /// Answers that clients have yet to read.
    pub fn unread_answers(&self) -> &Arc<UnreadAnswers> {
        &self.inner.unread
    }

    /// What is known of robots' descriptions.
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
                    // Whatever else it says, it says once.
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
            // Only an ending driver drops a question; then it says why.
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
