//! Refuses clients of another version, before their request is read.

use axum::extract::Request;
use simd_proto::{API_VERSION, API_VERSION_HEADER, ApiVersion};
use tonic::Status;
use tonic::codegen::http::HeaderMap;

use super::status::Explained;
use crate::convert::field::Path;

/// Method for clients of any version, so that they can find out which side is older.
const FOR_ALL: &str = "/simd.v1.SimulationService/GetSimulatorInfo";

/// Accepts a call whose client has a supported version, or that is for all versions.
pub(super) fn check_call(request: &Request) -> Result<(), Status> {
    if request.uri().path() == FOR_ALL { Ok(()) } else { check(request.headers()) }
}

/// Accepts a supported version; a client without a version is accepted too.
pub fn check(headers: &HeaderMap) -> Result<(), Status> {
    let Some(said) = headers.get(API_VERSION_HEADER) else {
        return Ok(());
    };
    let Some(client) = said.to_str().ok().and_then(ApiVersion::parse) else {
        let said = format!("{said:?}");
        let expected = format!("it must be like \"{API_VERSION}\"");
        return Err(Path::ROOT.field(API_VERSION_HEADER).refuse(said, expected).into());
    };
    if serves(API_VERSION, client) {
        Ok(())
    } else {
        Err(Explained::version_mismatch(client, API_VERSION).into())
    }
}

/// Returns whether the daemon serves the client's version. Within a major version, it serves older clients.
fn serves(daemon: ApiVersion, client: ApiVersion) -> bool {
    client.major == daemon.major && client.minor <= daemon.minor
}

#[cfg(test)]
mod tests {
    use tonic::Code;
    use tonic_types::StatusExt as _;

    use super::*;

    fn check_version(said: &str) -> Result<(), Status> {
        let mut headers = HeaderMap::new();
        headers.insert(API_VERSION_HEADER, said.parse().unwrap());
        check(&headers)
    }

    #[test]
    fn a_client_of_our_version_or_of_none_is_served() {
        assert!(check(&HeaderMap::new()).is_ok());
        assert!(check_version(&API_VERSION.to_string()).is_ok());
    }

    #[test]
    fn older_clients_are_served_within_a_major_version() {
        let version = |major, minor| ApiVersion { major, minor };
        assert!(serves(version(1, 3), version(1, 0)));
        assert!(!serves(version(1, 3), version(1, 4)));
        assert!(!serves(version(2, 0), version(1, 0)));
    }

    #[test]
    fn a_newer_client_is_asked_to_update_the_daemon() {
        for client in ["1.1", "2.0"] {
            let status = check_version(client).unwrap_err();
            assert_eq!(status.code(), Code::FailedPrecondition);
            assert!(status.message().ends_with("the daemon is older: update the daemon"));
            let info = status.get_details_error_info().unwrap();
            assert_eq!(info.reason, "VERSION_MISMATCH");
            assert_eq!(info.metadata["client"], client);
            assert_eq!(info.metadata["daemon"], API_VERSION.to_string());
        }
    }

    #[test]
    fn an_older_client_is_asked_to_update_itself() {
        let status = check_version("0.9").unwrap_err();
        assert!(status.message().ends_with("the client is older: update the client"));
    }

    #[test]
    fn invalid_versions_are_refused_by_the_name_of_the_header() {
        for said in ["", "one", "1", "1.x", "1.0.0"] {
            let status = check_version(said).unwrap_err();
            assert_eq!(status.code(), Code::InvalidArgument);
            let field = &status.get_details_bad_request().unwrap().field_violations[0].field;
            assert_eq!(field, API_VERSION_HEADER);
        }
    }
}
