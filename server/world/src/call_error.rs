//! Errors of calls, for every front-end.

use simd_core::simulation::error::list_known;
use simd_model::LoadReport;

use crate::run_state::RunState;

/// Error of a call. Each message is a sentence for people.
#[derive(Clone, Debug, thiserror::Error)]
pub enum CallError {
    /// The world refused the call.
    #[error(transparent)]
    World(#[from] simd_core::Error),
    /// The daemon itself refused a value.
    #[error("{element} is {value}; {expected}")]
    InvalidValue {
        /// Name of the value, for instance `real_time_factor`.
        element: String,
        /// Given value.
        value: String,
        /// Accepted values, as "it must be ...".
        expected: String,
    },
    /// Too many commands are waiting.
    #[error("the daemon's mailbox is full ({capacity} commands wait); try again")]
    MailboxFull {
        /// Maximum number of waiting commands.
        capacity: usize,
    },
    /// The call would exceed one of the daemon's limits.
    #[error("{what} would be {value}, and the limit is {limit}")]
    LimitExceeded {
        /// Counted quantity.
        what: String,
        /// Value that it would have.
        value: u64,
        /// Limit.
        limit: u64,
    },
    /// The call is not possible in this state, for instance stepping while playing.
    #[error("{message}")]
    WrongState {
        /// Present state of the world.
        state: RunState,
        /// Sentence that names the remedy.
        message: String,
    },
    /// The caller's token is for other robots.
    #[error(
        "the token is only for {}, and this call concerns {}", allowed.join(", "),
        if robot.is_empty() { "the whole world".to_owned() } else { format!("robot {robot:?}") }
    )]
    RobotNotAllowed {
        /// Name of the robot; empty for the whole world.
        robot: String,
        /// Robots of the token.
        allowed: Vec<String>,
    },
    /// The object belongs to another client with an active token or claim.
    #[error("{what} belongs to {owner}; choose another name, or take it over")]
    OwnedByAnother {
        /// Object, for instance `saved state "start"`.
        what: String,
        /// Owner.
        owner: String,
    },
    /// The lockstep member does not exist (any more).
    #[error(
        "this client is not a member of the lockstep: it left, or did not ask for its step in time; join \
         again"
    )]
    LockstepMemberNotFound,
    /// Only lockstep members may do this.
    #[error(
        "{members} clients step the world together: join them (JoinLockstep), or wait until they have left"
    )]
    InLockstep {
        /// Number of members.
        members: u64,
    },
    /// A reset, a pause or a play ended the call.
    #[error("{by} ended the call after {steps_done} of {steps} steps")]
    Superseded {
        /// Cause, for instance "a pause".
        by: String,
        /// Steps that were made and remain.
        steps_done: u64,
        /// Requested steps.
        steps: u64,
    },
    /// The robot that the call loaded was deleted before the answer was made.
    #[error(
        "robot {robot:?} was loaded at step {step} and no longer exists: it was deleted, or the world was \
         reset or restored"
    )]
    GoneAgain {
        /// Name of the robot.
        robot: String,
        /// Step from which it existed.
        step: u64,
    },
    /// The description is invalid.
    #[error("{message}")]
    InvalidDescription {
        /// Sentence that names the element and the line.
        message: String,
        /// Findings up to the error.
        report: Box<LoadReport>,
    },
    /// The description was never uploaded, or is no longer stored.
    #[error("description {sha256} is not stored here; send it again with PrepareDescription")]
    DescriptionNotUploaded {
        /// Hash of the description.
        sha256: String,
    },
    /// The file was never uploaded, or is no longer stored.
    #[error("asset {uri:?} ({sha256}) is not stored here; send it with UploadAsset")]
    AssetNotUploaded {
        /// URI, as the description writes it.
        uri: String,
        /// Hash in the request.
        sha256: String,
    },
    /// The uploaded bytes do not match the announced ones.
    #[error("{message}")]
    UploadMismatch {
        /// Sentence that names the mismatch.
        message: String,
    },
    /// The path is not below an asset root.
    #[error("{message}")]
    PathNotAllowed {
        /// Sentence that names the remedy.
        message: String,
    },
    /// The file does not exist on the daemon's disk.
    #[error("{message}")]
    FileNotFound {
        /// Sentence that names the path.
        message: String,
    },
    /// No slider or button has that name.
    #[error("there is no parameter {name:?}; {}", list_known("parameters", .known))]
    ParameterNotFound {
        /// Requested name.
        name: String,
        /// Existing names.
        known: Vec<String>,
    },
    /// The name is taken.
    #[error("there is a parameter {name:?} already; choose another name, replace it, or remove it")]
    ParameterExists {
        /// Name.
        name: String,
    },
    /// The file is not a saved state that can be restored here.
    #[error("{message}")]
    InvalidSavedState {
        /// Sentence that names the fault and the robot.
        message: String,
    },
    /// No recording can be made or changed.
    #[error("{message}")]
    RecordingNotPossible {
        /// Sentence that names the remedy.
        message: String,
    },
    /// No recording has that name.
    #[error("there is no recording {name:?}; {}", list_known("recordings", .known))]
    RecordingNotFound {
        /// Requested name.
        name: String,
        /// Existing names.
        known: Vec<String>,
    },
    /// The name is taken.
    #[error("there is a recording {name:?} already; choose another name, or delete it")]
    RecordingExists {
        /// Name.
        name: String,
    },
    /// The request's id was used before for another request.
    #[error("the request id {id:?} {how}")]
    RequestIdReused {
        /// Id.
        id: String,
        /// Earlier use of the id, and the remedy.
        how: String,
    },
    /// A picture was requested, but there is no renderer.
    #[error(
        "no renderer draws this world: start `simd-camera --endpoint ...`, on this machine or on another"
    )]
    NoRenderer,
    /// No picture came in the caller's time.
    #[error("no renderer drew the picture in time; wait longer, or start another `simd-camera`")]
    PictureTimeout,
    /// Renderers could not draw the picture.
    #[error("the picture cannot be drawn: {why}")]
    PictureFailed {
        /// Reason from a renderer, or its failure.
        why: String,
    },
    /// The daemon shuts down.
    #[error("the daemon is shutting down")]
    ShuttingDown,
    /// The daemon has a fault.
    #[error("the daemon failed: {message}")]
    Internal {
        /// Message for its log and for a bug report.
        message: String,
    },
}

impl CallError {
    /// Returns whether the same request may succeed when sent again: such an answer is not stored for a
    /// request's id.
    pub fn is_transient(&self) -> bool {
        matches!(self, Self::MailboxFull { .. } | Self::ShuttingDown | Self::Internal { .. })
    }
}

/// Returns the message of a panic.
pub(crate) fn panic_message(payload: &(dyn std::any::Any + Send)) -> String {
    let text = payload.downcast_ref::<&str>().copied();
    text.or_else(|| payload.downcast_ref::<String>().map(String::as_str)).unwrap_or("it panicked").to_owned()
}
