//! Certificates of TLS: the files that options name, and explanations of failed connections. tonic and Zenoh
//! only say that the transport failed.

use std::path::Path;
use std::time::Duration;

use simd_proto::v1::{GetSimulatorInfoRequest, simulation_service_client::SimulationServiceClient};
use tonic::transport::{Certificate, Channel, ClientTlsConfig, Endpoint, Identity};

use crate::error::root_cause;
use crate::{ConnectOptions, Error};

/// Environment variable that names the file of the authorities.
pub(crate) const AUTHORITIES: &str = "SIMD_TLS_CA";
/// Environment variables that name the client's own certificate, and its key.
pub(crate) const CERTIFICATE: &str = "SIMD_TLS_CLIENT_CERT";
pub(crate) const KEY: &str = "SIMD_TLS_CLIENT_KEY";

/// Result of a probe if each try ended after the handshake, and this client showed no certificate.
const CLOSED: &str =
    "the connection was closed after the handshake, in which this client showed no certificate";
/// Number of tries of a probe.
const TRIES: usize = 4;

/// Contents of the files that the options name.
#[derive(Debug, Default)]
pub(crate) struct Pems {
    authorities: Option<String>,
    /// The certificate, and its key.
    own: Option<(String, String)>,
}

/// Reads the files that the options name.
///
/// # Errors
/// [`Error::Certificate`] if one does not exist, is of another kind, or lacks its counterpart.
pub(crate) fn read(options: &ConnectOptions) -> Result<Pems, Error> {
    let ConnectOptions { tls_authorities, tls_certificate, tls_key, .. } = options;
    let authorities =
        tls_authorities.as_deref().map(|path| pem(path, AUTHORITIES, "CERTIFICATE")).transpose()?;
    let own = match (tls_certificate.as_deref(), tls_key.as_deref()) {
        (Some(certificate), Some(key)) => {
            Some((pem(certificate, CERTIFICATE, "CERTIFICATE")?, pem(key, KEY, "PRIVATE KEY")?))
        }
        (None, None) => None,
        (Some(_), None) => {
            return Err(refuse(format!("the key of the certificate is missing: {KEY} names it")));
        }
        (None, Some(_)) => {
            return Err(refuse(format!("the certificate of the key is missing: {CERTIFICATE} names it")));
        }
    };
    Ok(Pems { authorities, own })
}

impl Pems {
    /// Returns whether there are authorities to check a daemon's certificate.
    pub(crate) fn has_authorities(&self) -> bool {
        self.authorities.is_some()
    }

    /// Returns the configuration of a gRPC connection.
    pub(crate) fn config(&self) -> ClientTlsConfig {
        let mut tls = ClientTlsConfig::new();
        if let Some(authorities) = &self.authorities {
            tls = tls.ca_certificate(Certificate::from_pem(authorities));
        }
        if let Some((certificate, key)) = &self.own {
            tls = tls.identity(Identity::from_pem(certificate, key));
        }
        tls
    }
}

fn refuse(reason: String) -> Error {
    Error::Certificate { reason }
}

/// Reads a file that must have a part of this kind.
fn pem(path: &Path, name: &str, kind: &str) -> Result<String, Error> {
    let shown = path.display();
    let text = match std::fs::read_to_string(path) {
        Ok(text) => text,
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            return Err(refuse(format!("there is no file {shown}, which {name} or its option names")));
        }
        Err(error) => {
            return Err(refuse(format!(
                "{shown}, which {name} or its option names, cannot be read: {error}"
            )));
        }
    };
    // `RSA PRIVATE KEY` and `EC PRIVATE KEY` are keys too.
    let has_kind = text.lines().any(|line| {
        line.strip_prefix("-----BEGIN ")
            .and_then(|rest| rest.strip_suffix("-----"))
            .is_some_and(|said| said.ends_with(kind))
    });
    if has_kind {
        return Ok(text);
    }
    let what = match (name, kind) {
        (AUTHORITIES, _) => "certificate of an authority",
        (_, "CERTIFICATE") => "certificate",
        _ => "private key",
    };
    Err(refuse(format!("{shown} has no {what}: it must be a file of PEM")))
}

/// Explains in a sentence why the connection to an endpoint failed; `None` if certificates are not the cause.
/// `reason` is the message of rustls.
pub(crate) fn sentence(endpoint: &str, reason: &str) -> Option<String> {
    let daemon = format!("the daemon at {endpoint}");
    if reason.contains("invalid peer certificate") {
        let certificate = format!("the certificate of {daemon}");
        let is = |words: &[&str]| words.iter().any(|word| reason.contains(word));
        return Some(if is(&["UnknownIssuer", "BadSignature"]) {
            format!(
                "{certificate} is not signed by an authority that is known here: {AUTHORITIES} names the file of the one that signed it"
            )
        } else if is(&["not valid for name", "NotValidForName"]) {
            format!("{certificate} is not for that host: use a host name of the certificate ({reason})")
        } else if is(&["expired", "Expired"]) {
            format!("{certificate} has expired: a new one is made there with `simd tls init`")
        } else {
            format!("{certificate} is not accepted ({reason})")
        });
    }
    if let Some((_, alert)) = reason.split_once("received fatal alert: ") {
        return Some(match alert {
            alert if alert.starts_with("CertificateRequired") => {
                format!(
                    "{daemon} asks for a certificate of this client: set {CERTIFICATE} and {KEY} to the \
                     files of the certificate and its key"
                )
            }
            alert => format!("{daemon} does not accept the certificate of this client ({alert})"),
        });
    }
    if reason == CLOSED {
        return Some(format!(
            "{daemon} closed the connection after it had shown its certificate: if it asks for one of this \
             client, set {CERTIFICATE} and {KEY} to the files of the certificate and its key"
        ));
    }
    let is_plain = reason.contains("InvalidContentType") || reason.contains("corrupt message");
    is_plain.then(|| {
        format!("the server at {endpoint} does not use TLS: without TLS the address is http:// or tcp/")
    })
}

/// Returns why the first call over a connection fails in the transport. A daemon that does not accept the certificate of this
/// client says so only then.
pub(crate) async fn first_call(channel: Channel, time: Duration) -> Option<String> {
    let mut client = SimulationServiceClient::new(channel);
    let answered = tokio::time::timeout(time, client.get_simulator_info(GetSimulatorInfoRequest {})).await;
    let status = answered.ok()?.err()?;
    // An answer has no cause of the transport's.
    std::error::Error::source(&status)?;
    Some(root_cause(&status))
}

/// Returns why a connection with TLS did not come about, in the words of rustls. Zenoh itself says that time was over, and gRPC
/// that the connection was closed. Makes a handshake of gRPC with the same files, and one call. The alert is lost if the
/// connection ends before it is read, so there are several tries.
pub(crate) async fn probe(address: &str, pems: &Pems, time: Duration) -> Option<String> {
    let endpoint = Endpoint::from_shared(format!("https://{address}")).ok()?;
    let endpoint = endpoint.tls_config(pems.config().assume_http2(true)).ok()?.connect_timeout(time);
    let asked = async {
        for _ in 0..TRIES {
            let failed = match endpoint.connect().await {
                Ok(channel) => first_call(channel, time).await?,
                Err(error) => root_cause(&error),
            };
            if pems.own.is_some() || !is_cut(&failed) {
                return Some(failed);
            }
        }
        Some(CLOSED.to_owned())
    };
    tokio::time::timeout(time, asked).await.ok()?
}

/// Returns whether a connection ended after its handshake without a reason.
fn is_cut(reason: &str) -> bool {
    let reason = reason.to_lowercase();
    let words = ["connection reset", "broken pipe", "closed", "end of file", "eof"];
    !reason.contains("handshake") && words.iter().any(|word| reason.contains(word))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_wrong_file_has_a_separate_sentence() {
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        std::fs::write(at("cert"), "-----BEGIN CERTIFICATE-----\nAA==\n-----END CERTIFICATE-----\n").unwrap();
        std::fs::write(at("key"), "-----BEGIN EC PRIVATE KEY-----\nAA==\n-----END EC PRIVATE KEY-----\n")
            .unwrap();
        let said = |authorities: Option<&str>, certificate: Option<&str>, key: Option<&str>| {
            let [tls_authorities, tls_certificate, tls_key] =
                [authorities, certificate, key].map(|name| name.map(at));
            let options = ConnectOptions {
                tls_authorities,
                tls_certificate,
                tls_key,
                token: None,
                connect_timeout: Duration::ZERO,
                timeout: Duration::ZERO,
            };
            read(&options).map(drop).map_err(|error| error.to_string())
        };
        assert_eq!(said(Some("cert"), Some("cert"), Some("key")), Ok(()));
        assert_eq!(said(None, None, None), Ok(()));
        let shown = |name: &str| at(name).display().to_string();
        for (outcome, sentence) in [
            (
                said(Some("lost"), None, None),
                format!("there is no file {}, which SIMD_TLS_CA or its option names", shown("lost")),
            ),
            (
                said(Some("key"), None, None),
                format!("{} has no certificate of an authority: it must be a file of PEM", shown("key")),
            ),
            (
                said(None, Some("lost"), Some("key")),
                format!("there is no file {}, which SIMD_TLS_CLIENT_CERT or its option names", shown("lost")),
            ),
            (
                said(None, Some("cert"), Some("cert")),
                format!("{} has no private key: it must be a file of PEM", shown("cert")),
            ),
            (
                said(None, Some("cert"), None),
                "the key of the certificate is missing: SIMD_TLS_CLIENT_KEY names it".into(),
            ),
            (
                said(None, None, Some("key")),
                "the certificate of the key is missing: SIMD_TLS_CLIENT_CERT names it".into(),
            ),
        ] {
            assert_eq!(outcome.unwrap_err(), sentence);
        }
    }

    #[test]
    fn errors_of_rustls_become_sentences_and_errors_of_the_network_do_not() {
        for (reason, part) in [
            ("invalid peer certificate: UnknownIssuer", "SIMD_TLS_CA"),
            ("invalid peer certificate: certificate not valid for name \"lab\"", "not for that host"),
            ("invalid peer certificate: certificate expired: verification time 1", "has expired"),
            ("invalid peer certificate: Revoked", "is not accepted"),
            ("received fatal alert: CertificateRequired", "SIMD_TLS_CLIENT_CERT and SIMD_TLS_CLIENT_KEY"),
            (CLOSED, "if it asks for one of this client, set SIMD_TLS_CLIENT_CERT and SIMD_TLS_CLIENT_KEY"),
            ("received fatal alert: UnknownCA", "does not accept the certificate of this client (UnknownCA)"),
            ("received corrupt message of type InvalidContentType", "does not use TLS"),
        ] {
            let said = sentence("lab:1", reason).unwrap();
            assert!(said.contains(part) && said.contains("lab:1"), "{said}");
        }
        assert_eq!(sentence("lab:1", "connection refused"), None);
    }

    #[test]
    fn a_connection_that_is_cut_is_distinguished_from_one_that_is_refused_or_answered_with_an_alert() {
        for reason in ["Connection reset by peer (os error 104)", "stream closed because of a broken pipe"] {
            assert!(is_cut(reason), "{reason}");
        }
        for reason in
            ["Connection refused (os error 111)", "received fatal alert: UnknownCA", "tls handshake eof"]
        {
            assert!(!is_cut(reason), "{reason}");
        }
    }
}
