//! Why a call failed, alike for every front-end.

use simd_core::simulation::error::list_known;
use simd_model::LoadReport;

use crate::run_state::RunState;

/// Why a call failed. Each message is a sentence for people.
#[derive(Clone, Debug, thiserror::Error)]
pub enum CallError {
    /// The world refused.
    #[error(transparent)]
    World(#[from] simd_core::Error),
    /// A value that the daemon itself refuses.
    #[error("{element} is {value}; {expected}")]
    InvalidValue {
        /// What, for instance `real_time_factor`.
        element: String,
        /// What was given.
        value: String,
        /// What would be accepted, as "it must be ...".
        expected: String,
    },
    /// Too many commands are waiting.
    #[error("the daemon's mailbox is full ({capacity} commands wait); try again")]
    MailboxFull {
        /// How many may wait.
        capacity: usize,
    },
    /// One of the daemon's limits.
    #[error("{what} would be {value}, and the limit is {limit}")]
    LimitExceeded {
        /// What is counted.
        what: String,
        /// What it would be.
        value: u64,
        /// What it may be.
        limit: u64,
    },
    /// Not in this state, for instance stepping while playing.
    #[error("{message}")]
    WrongState {
        /// The state that the world is in.
        state: RunState,
        /// Names the remedy.
        message: String,
    },
    /// The caller's token is for other robots.
    #[error(
        "the token is for {} alone, and this concerns {}", allowed.join(", "),
        if robot.is_empty() { "the whole world".to_owned() } else { format!("robot {robot:?}") }
    )]
    RobotNotAllowed {
        /// Which it is; empty for the whole world.
        robot: String,
        /// Those that the token is for.
        allowed: Vec<String>,
    },
    /// Another client's, whose token or claim holds.
    #[error("{what} belongs to {owner}; choose another name, or take it over")]
    OwnedByAnother {
        /// For instance `saved state "start"`.
        what: String,
        /// Who made it.
        owner: String,
    },
    /// There is no such member (any more).
    #[error(
        "there is no such member in lockstep (any more): it left, or did not ask in its time; join again"
    )]
    LockstepMemberNotFound,
    /// Only the members of a lockstep may do that.
    #[error(
        "{members} clients step the world together: join them (JoinLockstep), or wait until they have left"
    )]
    InLockstep {
        /// How many there are.
        members: u64,
    },
    /// A reset, a pause or a play ended the call.
    #[error("{by} ended the call after {steps_done} of {steps} steps")]
    Superseded {
        /// For instance "a pause".
        by: String,
        /// Steps that were done and stay done.
        steps_done: u64,
        /// Steps that were asked for.
        steps: u64,
    },
    /// The robot that the call loaded is gone before its answer was made.
    #[error(
        "robot {robot:?} was loaded at step {step} and is gone again: it was deleted, or the world was reset or restored"
    )]
    GoneAgain {
        /// Its name.
        robot: String,
        /// From which step on it was there.
        step: u64,
    },
    /// The description cannot be understood.
    #[error("{message}")]
    InvalidDescription {
        /// Names the element and the line.
        message: String,
        /// Everything that was found up to there.
        report: Box<LoadReport>,
    },
    /// It was never uploaded, or is no longer kept.
    #[error("description {sha256} is not kept here; send it again with PrepareDescription")]
    DescriptionNotUploaded {
        /// Its name.
        sha256: String,
    },
    /// It was never uploaded, or is no longer kept.
    #[error("asset {uri:?} ({sha256}) is not kept here; send it with UploadAsset")]
    AssetNotUploaded {
        /// As the description writes it.
        uri: String,
        /// What the request says it is.
        sha256: String,
    },
    /// The bytes are not those that were said.
    #[error("{message}")]
    UploadMismatch {
        /// What does not fit.
        message: String,
    },
    /// Not below an asset root.
    #[error("{message}")]
    PathNotAllowed {
        /// Names the remedy.
        message: String,
    },
    /// No such file on the daemon's disk.
    #[error("{message}")]
    FileNotFound {
        /// Names the path.
        message: String,
    },
    /// No slider or button of that name.
    #[error("there is no parameter {name:?}; {}", list_known("parameters", .known))]
    ParameterNotFound {
        /// What was asked for.
        name: String,
        /// What there is.
        known: Vec<String>,
    },
    /// The name is taken.
    #[error("there is a parameter {name:?} already; choose another name, replace it, or remove it")]
    ParameterExists {
        /// The name.
        name: String,
    },
    /// A file is no saved state that can be restored here.
    #[error("{message}")]
    InvalidSavedState {
        /// What is wrong with it, and with which robot.
        message: String,
    },
    /// No recording can be made or changed.
    #[error("{message}")]
    RecordingNotPossible {
        /// Names the remedy.
        message: String,
    },
    /// No recording of that name.
    #[error("there is no recording {name:?}; {}", list_known("recordings", .known))]
    RecordingNotFound {
        /// What was asked for.
        name: String,
        /// What there is.
        known: Vec<String>,
    },
    /// The name is taken.
    #[error("there is a recording {name:?} already; choose another name, or delete it")]
    RecordingExists {
        /// The name.
        name: String,
    },
    /// A request's id was used before, and not for this request.
    #[error("the request id {id:?} {how}")]
    RequestIdReused {
        /// The id.
        id: String,
        /// What it was used for, and what to do.
        how: String,
    },
    /// A picture is wanted, and nothing draws.
    #[error(
        "no renderer draws this world: start `simd-camera --endpoint ...`, on this machine or on another"
    )]
    NoRenderer,
    /// No picture came in the time that the caller waits.
    #[error("no renderer drew the picture in time; wait longer, or start another `simd-camera`")]
    PictureTimeout,
    /// Renderers could not draw a picture.
    #[error("the picture cannot be drawn: {why}")]
    PictureFailed {
        /// What a renderer said, or did.
        why: String,
    },
    /// The daemon goes down.
    #[error("the daemon is shutting down")]
    ShuttingDown,
    /// A fault of the daemon.
    #[error("the daemon failed: {message}")]
    Internal {
        /// For its log and for a bug report.
        message: String,
    },
}

impl CallError {
    /// Whether the same request, sent again, may well succeed: such an answer is
    /// not the answer to a request's id.
    pub fn is_transient(&self) -> bool {
        matches!(self, Self::MailboxFull { .. } | Self::ShuttingDown | Self::Internal { .. })
    }
}

/// What a panic said.
pub(crate) fn panic_message(payload: &(dyn std::any::Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().copied();
    text.or_else(|| payload.downcast_ref::<String>().map(String::as_str)).unwrap_or("it panicked").to_owned()
}
