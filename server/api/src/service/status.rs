//! Refusals of calls, as `error.proto` defines them: one exhaustive map from every error to its reason, and
//! from every reason to its code.

use std::collections::{BTreeMap, HashMap};

use simd_proto::v1::{self, ErrorReason};
use simd_proto::{ApiVersion, ERROR_DOMAIN};
use tonic::{Code, Status};
use tonic_types::{ErrorDetails, StatusExt as _};

use crate::convert::{BadField, to_proto};
use simd_world::handle::CallError;

/// Longest message, in bytes. A status travels in headers, percent-encoded and
/// once more in base64, and clients refuse headers beyond 16 KiB.
const MAX_MESSAGE: usize = 1000;
/// Longest value of a metadata entry or name of a field, in bytes.
const MAX_VALUE: usize = 200;

/// A refusal, on its way to a `Status` or to a `Refusal` in a stream.
#[derive(Clone, Debug, PartialEq)]
pub struct Explained {
    /// Reason that programs act on.
    pub reason: ErrorReason,
    /// Sentence for people.
    pub message: String,
    /// Metadata that `error.proto` defines for each reason.
    pub metadata: BTreeMap<&'static str, String>,
    /// Refused field, and its fault.
    pub field: Option<(String, String)>,
}

impl Explained {
    /// Makes a refusal with only a reason and a sentence.
    pub fn new(reason: ErrorReason, message: impl ToString) -> Self {
        Self { reason, message: message.to_string(), metadata: BTreeMap::new(), field: None }
    }

    /// Returns the code and the reason without its prefix, for counters.
    pub fn how(&self) -> (i32, &'static str) {
        (code(self.reason).into(), without_prefix(self.reason.as_str_name(), "ERROR_REASON_"))
    }

    fn with(mut self, key: &'static str, value: impl ToString) -> Self {
        self.metadata.insert(key, clip(&value.to_string(), MAX_VALUE));
        self
    }

    fn field(self, field: &str, value: &str, expected: &str) -> Self {
        self.described(field, &format!("is {value}; {expected}"))
    }

    fn described(mut self, field: &str, description: &str) -> Self {
        self.field = Some((clip(field, MAX_VALUE), clip(description, MAX_VALUE)));
        self
    }

    /// Refuses a client of an unsupported version.
    pub fn version_mismatch(client: ApiVersion, daemon: ApiVersion) -> Self {
        let remedy = if client > daemon {
            "the daemon is older: update the daemon"
        } else {
            "the client is older: update the client"
        };
        let message = format!("client speaks simd API {client}, this daemon speaks {daemon}; {remedy}");
        Self::new(ErrorReason::VersionMismatch, message).with("client", client).with("daemon", daemon)
    }
}

/// Returns the canonical code of a reason.
fn code(reason: ErrorReason) -> Code {
    match reason {
        ErrorReason::RobotNotFound
        | ErrorReason::JointNotFound
        | ErrorReason::LinkNotFound
        | ErrorReason::ClaimNotFound
        | ErrorReason::LockstepMemberNotFound
        | ErrorReason::SavedStateNotFound
        | ErrorReason::ConstraintNotFound
        | ErrorReason::SensorNotFound
        | ErrorReason::FileNotFound
        | ErrorReason::ParameterNotFound
        | ErrorReason::RecordingNotFound => Code::NotFound,
        ErrorReason::RobotExists
        | ErrorReason::ParameterExists
        | ErrorReason::ConstraintExists
        | ErrorReason::SensorExists
        | ErrorReason::RecordingExists
        | ErrorReason::RequestIdReused => Code::AlreadyExists,
        ErrorReason::InvalidValue
        | ErrorReason::JointNotActuated
        | ErrorReason::InvalidDescription
        | ErrorReason::InvalidSavedState
        | ErrorReason::UploadMismatch => Code::InvalidArgument,
        ErrorReason::TargetBeyondLimit => Code::OutOfRange,
        ErrorReason::DescriptionNotUploaded
        | ErrorReason::AssetNotUploaded
        | ErrorReason::WrongState
        | ErrorReason::VersionMismatch
        | ErrorReason::JointClaimed
        | ErrorReason::RobotClaimed
        | ErrorReason::WorldClaimed
        | ErrorReason::WorldNotClaimed
        | ErrorReason::InLockstep
        | ErrorReason::OwnedByAnother
        | ErrorReason::RecordingNotPossible
        | ErrorReason::NoRenderer => Code::FailedPrecondition,
        ErrorReason::MailboxFull | ErrorReason::LimitExceeded => Code::ResourceExhausted,
        ErrorReason::PathNotAllowed | ErrorReason::RoleTooLow | ErrorReason::RobotNotAllowed => {
            Code::PermissionDenied
        }
        ErrorReason::Unauthenticated => Code::Unauthenticated,
        ErrorReason::ShuttingDown => Code::Unavailable,
        ErrorReason::Superseded => Code::Cancelled,
        ErrorReason::LayoutChanged | ErrorReason::PictureTimeout | ErrorReason::PictureFailed => {
            Code::Aborted
        }
        ErrorReason::NotSupported => Code::Unimplemented,
        ErrorReason::Internal | ErrorReason::Unspecified => Code::Internal,
    }
}

impl From<&BadField> for Explained {
    fn from(error: &BadField) -> Self {
        let BadField { field, of: _, value, expected } = error;
        Self::new(ErrorReason::InvalidValue, error).field(field, value, expected)
    }
}

impl From<&CallError> for Explained {
    fn from(error: &CallError) -> Self {
        let new = |reason| Self::new(reason, error);
        match error {
            CallError::World(error) => error.into(),
            CallError::InvalidValue { element, value, expected } => {
                new(ErrorReason::InvalidValue).field(element, value, expected)
            }
            CallError::MailboxFull { capacity: _ } => new(ErrorReason::MailboxFull),
            CallError::LimitExceeded { what: _, value: _, limit: _ } => new(ErrorReason::LimitExceeded),
            CallError::WrongState { state, message: _ } => {
                let name = to_proto::simulation::run_state(*state).as_str_name();
                new(ErrorReason::WrongState).with("state", without_prefix(name, "SIMULATION_STATE_"))
            }
            CallError::RobotNotAllowed { robot, allowed: _ } => {
                new(ErrorReason::RobotNotAllowed).with("robot", robot)
            }
            CallError::OwnedByAnother { what: _, owner } => {
                new(ErrorReason::OwnedByAnother).with("owner", owner)
            }
            CallError::LockstepMemberNotFound => new(ErrorReason::LockstepMemberNotFound),
            CallError::InLockstep { members } => new(ErrorReason::InLockstep).with("members", members),
            CallError::Superseded { by: _, steps_done: _, steps: _ } => new(ErrorReason::Superseded),
            CallError::GoneAgain { robot, step: _ } => new(ErrorReason::RobotNotFound).with("robot", robot),
            CallError::InvalidDescription { message: _, report: _ } => new(ErrorReason::InvalidDescription),
            CallError::DescriptionNotUploaded { sha256: _ } => new(ErrorReason::DescriptionNotUploaded),
            CallError::AssetNotUploaded { uri, sha256 } => {
                new(ErrorReason::AssetNotUploaded).with("uri", uri).with("sha256", sha256)
            }
            CallError::UploadMismatch { message: _ } => new(ErrorReason::UploadMismatch),
            CallError::PathNotAllowed { message: _ } => new(ErrorReason::PathNotAllowed),
            CallError::FileNotFound { message: _ } => new(ErrorReason::FileNotFound),
            CallError::ParameterNotFound { name, known: _ } => {
                new(ErrorReason::ParameterNotFound).with("parameter", name)
            }
            CallError::ParameterExists { name } => new(ErrorReason::ParameterExists).with("parameter", name),
            CallError::InvalidSavedState { message: _ } => new(ErrorReason::InvalidSavedState),
            CallError::RecordingNotPossible { message: _ } => new(ErrorReason::RecordingNotPossible),
            CallError::RecordingNotFound { name, known: _ } => {
                new(ErrorReason::RecordingNotFound).with("recording", name)
            }
            CallError::RecordingExists { name } => new(ErrorReason::RecordingExists).with("recording", name),
            CallError::RequestIdReused { id, how: _ } => {
                new(ErrorReason::RequestIdReused).with("request_id", id)
            }
            CallError::NoRenderer => new(ErrorReason::NoRenderer),
            CallError::PictureTimeout => new(ErrorReason::PictureTimeout),
            CallError::PictureFailed { why: _ } => new(ErrorReason::PictureFailed),
            CallError::ShuttingDown => new(ErrorReason::ShuttingDown),
            CallError::Internal { message: _ } => new(ErrorReason::Internal),
        }
    }
}

impl From<&simd_core::Error> for Explained {
    fn from(error: &simd_core::Error) -> Self {
        use simd_core::Error;
        let new = |reason| Self::new(reason, error);
        match error {
            Error::RobotNotFound { robot, known: _ } => new(ErrorReason::RobotNotFound).with("robot", robot),
            Error::JointNotFound { robot, joint, known: _ } => {
                new(ErrorReason::JointNotFound).with("robot", robot).with("joint", joint)
            }
            Error::LinkNotFound { robot, link, known: _ } => {
                new(ErrorReason::LinkNotFound).with("robot", robot).with("link", link)
            }
            Error::RobotExists { robot } => new(ErrorReason::RobotExists).with("robot", robot),
            Error::InvalidValue { element, of: _, value, expected } => {
                new(ErrorReason::InvalidValue).field(element, value, expected)
            }
            Error::WrongCount { element, has, needs } => {
                new(ErrorReason::InvalidValue).described(element, &format!("has {has}, and needs {needs}"))
            }
            // Programs act on the reason and the metadata, which do not depend on the field of a name.
            Error::InField { field, error: cause } => {
                let of_cause = Self::from(&**cause);
                Self { message: error.to_string(), ..of_cause }.described(field, &cause.to_string())
            }
            Error::JointNotActuated { robot, joint, why: _ } => {
                new(ErrorReason::JointNotActuated).with("robot", robot).with("joint", joint)
            }
            Error::TargetBeyondLimit { joint, requested: _, lower, upper } => {
                new(ErrorReason::TargetBeyondLimit)
                    .with("joint", joint)
                    .with("lower", lower)
                    .with("upper", upper)
            }
            Error::LayoutChanged { robot, requested: _, present: _ } => {
                new(ErrorReason::LayoutChanged).with("robot", robot)
            }
            Error::JointClaimed { robot, joint, holder } => new(ErrorReason::JointClaimed)
                .with("robot", robot)
                .with("joint", joint)
                .with("holder", holder),
            Error::RobotClaimed { robot, holder } => {
                new(ErrorReason::RobotClaimed).with("robot", robot).with("holder", holder)
            }
            Error::WorldClaimed { holder } => new(ErrorReason::WorldClaimed).with("holder", holder),
            Error::WorldShared { holder } => new(ErrorReason::WorldNotClaimed).with("holder", holder),
            Error::ClaimNotFound => new(ErrorReason::ClaimNotFound),
            Error::ConstraintNotFound { constraint, known: _ } => {
                new(ErrorReason::ConstraintNotFound).with("constraint", constraint)
            }
            Error::ConstraintExists { constraint } => {
                new(ErrorReason::ConstraintExists).with("constraint", constraint)
            }
            Error::SensorNotFound { robot, sensor, known: _ } => {
                new(ErrorReason::SensorNotFound).with("robot", robot).with("sensor", sensor)
            }
            Error::SensorExists { robot, sensor } => {
                new(ErrorReason::SensorExists).with("robot", robot).with("sensor", sensor)
            }
            Error::SavedStateNotFound { name, known: _ } => {
                new(ErrorReason::SavedStateNotFound).with("saved_state", name)
            }
            Error::LimitExceeded { what: _, value: _, limit: _ } => new(ErrorReason::LimitExceeded),
        }
    }
}

impl From<Explained> for Status {
    fn from(explained: Explained) -> Self {
        let metadata: HashMap<String, String> =
            explained.metadata.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
        let reason = without_prefix(explained.reason.as_str_name(), "ERROR_REASON_");
        let mut details = ErrorDetails::with_error_info(reason, ERROR_DOMAIN, metadata);
        if let Some((field, description)) = explained.field {
            details.add_bad_request_violation(field, description);
        }
        let message = clip(&explained.message, MAX_MESSAGE);
        Self::with_error_details(code(explained.reason), message, details)
    }
}

impl From<Explained> for v1::Refusal {
    fn from(explained: Explained) -> Self {
        Self {
            code: code(explained.reason).into(),
            message: clip(&explained.message, MAX_MESSAGE),
            reason: explained.reason.into(),
            metadata: explained.metadata.into_iter().map(|(key, value)| (key.to_owned(), value)).collect(),
        }
    }
}

impl From<BadField> for Status {
    fn from(error: BadField) -> Self {
        Explained::from(&error).into()
    }
}

/// A result whose error becomes a status.
pub trait OrStatus<T> {
    /// Returns the value, or the error as a status with its reason.
    ///
    /// # Errors
    /// Returns the status of the error.
    fn or_status(self) -> Result<T, Status>;
}

impl<T> OrStatus<T> for Result<T, CallError> {
    fn or_status(self) -> Result<T, Status> {
        self.map_err(|error| Explained::from(&error).into())
    }
}

fn without_prefix<'a>(name: &'a str, prefix: &str) -> &'a str {
    name.strip_prefix(prefix).unwrap_or(name)
}

/// Returns text of at most `bytes` bytes; longer text ends in an ellipsis.
fn clip(text: &str, bytes: usize) -> String {
    if text.len() <= bytes {
        return text.to_owned();
    }
    const ELLIPSIS: &str = "...";
    let end = text.floor_char_boundary(bytes.saturating_sub(ELLIPSIS.len()));
    format!("{}{ELLIPSIS}", text.get(..end).unwrap_or_default())
}

#[cfg(test)]
mod tests;
