//! Methods of `simd.v1` from the schema, for transports that carry messages without knowing them.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use prost::Message as _;
use prost_types::FileDescriptorSet;

use crate::v1::FILE_DESCRIPTOR_SET;

/// One method.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Method {
    /// `/simd.v1.SERVICE/METHOD`, as in gRPC.
    pub path: String,
    /// Name of the request's message, without its package.
    pub request: String,
    /// Name of the answer's message, without its package.
    pub answer: String,
    /// Whether it takes a stream of requests.
    pub takes_many: bool,
    /// Whether it returns a stream of answers.
    pub gives_many: bool,
}

static METHODS: LazyLock<BTreeMap<(String, String), Method>> = LazyLock::new(read);

/// Returns the method of these names, for instance `JointService` and `GetJointStates`.
pub fn find(service: &str, method: &str) -> Option<&'static Method> {
    METHODS.get(&(service.to_owned(), method.to_owned()))
}

/// Returns whether the schema has a service of this name, for instance `JointService`.
pub fn is_service(name: &str) -> bool {
    all().any(|(service, _, _)| service == name)
}

/// Returns service and method of `/simd.v1.SERVICE/METHOD`.
pub fn parse_path(path: &str) -> Option<(&str, &str)> {
    path.strip_prefix("/simd.v1.")?.split_once('/')
}

/// Returns all methods, by service and method.
pub fn all() -> impl Iterator<Item = (&'static str, &'static str, &'static Method)> {
    METHODS.iter().map(|((service, method), entry)| (service.as_str(), method.as_str(), entry))
}

/// Reads the compiled schema; returns nothing if it is broken, which a test would show.
fn read() -> BTreeMap<(String, String), Method> {
    let schema = FileDescriptorSet::decode(FILE_DESCRIPTOR_SET).unwrap_or_default();
    let services = schema.file.into_iter().flat_map(|file| file.service);
    services
        .flat_map(|service| {
            let name = service.name().to_owned();
            service.method.into_iter().map(move |method| {
                let entry = Method {
                    path: format!("/simd.v1.{name}/{}", method.name()),
                    request: method.input_type().trim_start_matches(".simd.v1.").to_owned(),
                    answer: method.output_type().trim_start_matches(".simd.v1.").to_owned(),
                    takes_many: method.client_streaming(),
                    gives_many: method.server_streaming(),
                };
                ((name.clone(), method.name().to_owned()), entry)
            })
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_method_is_found_with_its_answer_and_its_streams() {
        let method = find("JointService", "GetJointStates").unwrap();
        assert_eq!(method.path, "/simd.v1.JointService/GetJointStates");
        assert_eq!(method.request, "GetJointStatesRequest");
        assert_eq!(method.answer, "GetJointStatesResponse");
        assert!(!method.takes_many && !method.gives_many);
        let control = find("JointService", "Control").unwrap();
        assert!(control.takes_many && control.gives_many);
        assert!(find("EventService", "WatchEvents").unwrap().gives_many);
        assert_eq!(find("JointService", "GetLost"), None);
    }

    #[test]
    fn every_path_reads_back_to_its_names() {
        assert!(all().count() > 30);
        for (service, name, method) in all() {
            assert_eq!(parse_path(&method.path), Some((service, name)));
        }
        assert_eq!(parse_path("/grpc.health.v1.Health/Check"), None);
    }
}
