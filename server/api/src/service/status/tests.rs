//! Each refusal with its code, reason and details.

use simd_core::Error;
use simd_model::LoadReport;

use super::*;
use simd_world::handle::RunState;

fn text(text: &str) -> String {
    text.to_owned()
}

/// Returns each error once, with its code and reason in `error.proto`.
fn table() -> Vec<(CallError, Code, &'static str, &'static [&'static str])> {
    let (robot, joint, known) = (text("arm"), text("elbow"), vec![text("left")]);
    let message = text("a sentence");
    vec![
        (
            CallError::RequestIdReused { id: text("x"), how: text("was used by another request") },
            Code::AlreadyExists,
            "REQUEST_ID_REUSED",
            &["request_id"],
        ),
        (
            Error::RobotNotFound { robot: robot.clone(), known: known.clone() }.into(),
            Code::NotFound,
            "ROBOT_NOT_FOUND",
            &["robot"],
        ),
        (
            Error::JointNotFound { robot: robot.clone(), joint: joint.clone(), known: known.clone() }.into(),
            Code::NotFound,
            "JOINT_NOT_FOUND",
            &["joint", "robot"],
        ),
        (
            Error::LinkNotFound { robot: robot.clone(), link: text("hand"), known: known.clone() }.into(),
            Code::NotFound,
            "LINK_NOT_FOUND",
            &["link", "robot"],
        ),
        (Error::RobotExists { robot: robot.clone() }.into(), Code::AlreadyExists, "ROBOT_EXISTS", &["robot"]),
        (
            Error::InvalidValue {
                element: text("x"),
                of: text(""),
                value: text("NaN"),
                expected: text("finite"),
            }
            .into(),
            Code::InvalidArgument,
            "INVALID_VALUE",
            &[],
        ),
        (
            Error::WrongCount { element: text("x"), has: text("1 number"), needs: text("2") }.into(),
            Code::InvalidArgument,
            "INVALID_VALUE",
            &[],
        ),
        (
            Error::JointNotActuated { robot: robot.clone(), joint: joint.clone(), why: text("is fixed") }
                .into(),
            Code::InvalidArgument,
            "JOINT_NOT_ACTUATED",
            &["joint", "robot"],
        ),
        (
            Error::TargetBeyondLimit { joint: joint.clone(), requested: 2.0, lower: -1.0, upper: 1.0 }.into(),
            Code::OutOfRange,
            "TARGET_BEYOND_LIMIT",
            &["joint", "lower", "upper"],
        ),
        (
            Error::LayoutChanged { robot: robot.clone(), requested: 1, present: 2 }.into(),
            Code::Aborted,
            "LAYOUT_CHANGED",
            &["robot"],
        ),
        (
            Error::JointClaimed { robot, joint, holder: text("me") }.into(),
            Code::FailedPrecondition,
            "JOINT_CLAIMED",
            &["holder", "joint", "robot"],
        ),
        (
            Error::RobotClaimed { robot: text("arm"), holder: text("me") }.into(),
            Code::FailedPrecondition,
            "ROBOT_CLAIMED",
            &["holder", "robot"],
        ),
        (
            Error::WorldClaimed { holder: text("me") }.into(),
            Code::FailedPrecondition,
            "WORLD_CLAIMED",
            &["holder"],
        ),
        (
            Error::WorldShared { holder: text("me") }.into(),
            Code::FailedPrecondition,
            "WORLD_NOT_CLAIMED",
            &["holder"],
        ),
        (Error::ClaimNotFound.into(), Code::NotFound, "CLAIM_NOT_FOUND", &[]),
        (
            Error::SavedStateNotFound { name: text("a"), known }.into(),
            Code::NotFound,
            "SAVED_STATE_NOT_FOUND",
            &["saved_state"],
        ),
        (
            Error::LimitExceeded { what: text("robots"), value: 2, limit: 1 }.into(),
            Code::ResourceExhausted,
            "LIMIT_EXCEEDED",
            &[],
        ),
        (
            CallError::InvalidValue { element: text("x"), value: text("1"), expected: text("0") },
            Code::InvalidArgument,
            "INVALID_VALUE",
            &[],
        ),
        (CallError::MailboxFull { capacity: 1 }, Code::ResourceExhausted, "MAILBOX_FULL", &[]),
        (
            CallError::LimitExceeded { what: text("steps"), value: 2, limit: 1 },
            Code::ResourceExhausted,
            "LIMIT_EXCEEDED",
            &[],
        ),
        (
            CallError::WrongState { state: RunState::Playing, message: message.clone() },
            Code::FailedPrecondition,
            "WRONG_STATE",
            &["state"],
        ),
        (CallError::GoneAgain { robot: text("arm"), step: 1 }, Code::NotFound, "ROBOT_NOT_FOUND", &["robot"]),
        (
            CallError::Superseded { by: text("a pause"), steps_done: 1, steps: 2 },
            Code::Cancelled,
            "SUPERSEDED",
            &[],
        ),
        (
            CallError::InvalidDescription {
                message: message.clone(),
                report: Box::new(LoadReport::default()),
            },
            Code::InvalidArgument,
            "INVALID_DESCRIPTION",
            &[],
        ),
        (
            CallError::DescriptionNotUploaded { sha256: text("00") },
            Code::FailedPrecondition,
            "DESCRIPTION_NOT_UPLOADED",
            &[],
        ),
        (
            CallError::AssetNotUploaded { uri: text("a.stl"), sha256: text("00") },
            Code::FailedPrecondition,
            "ASSET_NOT_UPLOADED",
            &["sha256", "uri"],
        ),
        (
            CallError::UploadMismatch { message: message.clone() },
            Code::InvalidArgument,
            "UPLOAD_MISMATCH",
            &[],
        ),
        (
            CallError::PathNotAllowed { message: message.clone() },
            Code::PermissionDenied,
            "PATH_NOT_ALLOWED",
            &[],
        ),
        (CallError::FileNotFound { message: message.clone() }, Code::NotFound, "FILE_NOT_FOUND", &[]),
        (
            CallError::ParameterNotFound { name: text("speed"), known: vec![text("gain")] },
            Code::NotFound,
            "PARAMETER_NOT_FOUND",
            &["parameter"],
        ),
        (
            CallError::ParameterExists { name: text("speed") },
            Code::AlreadyExists,
            "PARAMETER_EXISTS",
            &["parameter"],
        ),
        (CallError::ShuttingDown, Code::Unavailable, "SHUTTING_DOWN", &[]),
        (CallError::Internal { message }, Code::Internal, "INTERNAL", &[]),
    ]
}

fn status(error: CallError) -> Status {
    Explained::from(&error).into()
}

#[test]
fn each_error_has_the_code_the_reason_and_the_metadata_that_the_schema_says() {
    for (error, code, reason, keys) in table() {
        let status = status(error.clone());
        assert_eq!(status.code(), code, "{reason}");
        assert_eq!(status.message(), error.to_string());
        let info = status.get_details_error_info().unwrap();
        assert_eq!((info.reason.as_str(), info.domain.as_str()), (reason, "simd"));
        let mut present: Vec<_> = info.metadata.keys().map(String::as_str).collect();
        present.sort_unstable();
        assert_eq!(present, keys, "{reason}");
        assert_eq!(status.get_details_bad_request().is_some(), reason == "INVALID_VALUE", "{reason}");

        let refusal = v1::Refusal::from(Explained::from(&error));
        assert_eq!(refusal.code, i32::from(code));
        assert_eq!(refusal.reason().as_str_name(), format!("ERROR_REASON_{reason}"));
        assert_eq!(refusal.message, error.to_string());
        assert_eq!(refusal.metadata.keys().map(String::as_str).collect::<Vec<_>>(), keys);
    }
}

#[test]
fn a_bad_field_is_named_in_a_bad_request() {
    let error = BadField {
        field: text("a[0].b"),
        of: text(""),
        value: text("NaN"),
        expected: text("it must be finite"),
    };
    let status = Status::from(error);
    assert_eq!(status.code(), Code::InvalidArgument);
    assert_eq!(status.message(), "a[0].b is NaN; it must be finite");
    let violation = status.get_details_bad_request().unwrap().field_violations.remove(0);
    assert_eq!(
        (violation.field.as_str(), violation.description.as_str()),
        ("a[0].b", "is NaN; it must be finite")
    );
}

#[test]
fn a_list_that_is_too_short_says_in_a_bad_request_how_many_it_needs() {
    let (element, has, needs) = (text("costs[0].targets"), text("1 number"), text("2 (one a joint)"));
    let status = status(CallError::World(Error::WrongCount { element, has, needs }));
    assert_eq!(status.message(), "costs[0].targets has 1 number, and needs 2 (one a joint)");
    let violation = status.get_details_bad_request().unwrap().field_violations.remove(0);
    assert_eq!(
        (violation.field.as_str(), violation.description.as_str()),
        ("costs[0].targets", "has 1 number, and needs 2 (one a joint)")
    );
}

#[test]
fn a_name_that_is_not_found_in_a_field_has_its_own_reason_and_names_the_field() {
    let missing = Error::LinkNotFound { robot: text("arm"), link: text("hook"), known: vec![text("hand")] };
    let (sentence, alone) = (missing.to_string(), status(CallError::World(missing.clone())));
    let error = Error::InField { field: text("costs[2].links[0]"), error: Box::new(missing) };
    let status = status(CallError::World(error));
    assert_eq!(status.code(), alone.code());
    let [info, info_alone] = [&status, &alone].map(|status| status.get_details_error_info().unwrap());
    assert_eq!((info.reason, info.metadata), (info_alone.reason, info_alone.metadata));
    assert_eq!(status.message(), format!("costs[2].links[0]: {sentence}"));
    let violation = status.get_details_bad_request().unwrap().field_violations.remove(0);
    assert_eq!((violation.field.as_str(), violation.description), ("costs[2].links[0]", sentence));
}

#[test]
fn the_state_that_is_wrong_is_named_without_its_prefix() {
    let error = CallError::WrongState { state: RunState::Playing, message: text("pause first") };
    let info = status(error).get_details_error_info().unwrap();
    assert_eq!(info.metadata["state"], "PLAYING");
}

#[test]
fn however_long_a_name_is_the_status_fits_into_headers() {
    let robot = "\u{e4}".repeat(100_000);
    let status = status(CallError::World(Error::RobotNotFound { robot, known: Vec::new() }));
    // Each byte of the message takes up to three bytes in percent-encoding, each of the details four thirds
    // in base64.
    assert!(status.message().len() * 3 + status.details().len() * 4 / 3 < 8 << 10);
    assert!(status.message().ends_with("..."));
}
