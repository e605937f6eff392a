//! Certificates: the ones that a daemon presents, and their files.

#[cfg(test)]
mod tests;

use std::{
    fs,
    net::IpAddr,
    path::Path,
    sync::Arc,
    time::{Duration, SystemTime},
};

use tokio::{net::TcpStream, time::timeout};
use tokio_rustls::{
    TlsConnector,
    rustls::{
        self, ClientConfig, DigitallySignedStruct, SignatureScheme,
        client::danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier},
        crypto::{CryptoProvider, ring},
        pki_types::{CertificateDer, PrivateKeyDer, ServerName, UnixTime, pem::PemObject as _},
        sign::CertifiedKey,
    },
};
use x509_parser::{extensions::GeneralName, parse_x509_certificate, prelude::X509Certificate};

use super::{Finding, away, files, unix_seconds};

/// Time before its expiry at which a certificate should be renewed.
const SOON: i64 = 30 * 86_400;
const RENEW: &str =
    "make a new one (`simd tls init` with server.pem and server.key moved away), and send the daemon SIGHUP";

/// Returns the certificates that the daemon at a connection presents, trusted or not. `None` if it does not
/// use TLS.
///
/// Only the handshake is sent on this connection.
pub(super) async fn shown(
    host: &str,
    connection: TcpStream,
    connect_timeout: Duration,
) -> Option<Vec<CertificateDer<'static>>> {
    let provider = Arc::new(ring::default_provider());
    let verifier = Arc::new(Looker(Arc::clone(&provider)));
    let mut config = ClientConfig::builder_with_provider(provider)
        .with_safe_default_protocol_versions()
        .ok()?
        .dangerous()
        .with_custom_certificate_verifier(verifier)
        .with_no_client_auth();
    config.alpn_protocols = vec![b"h2".to_vec()];
    let name = ServerName::try_from(host.to_owned()).ok()?;
    let connect = TlsConnector::from(Arc::new(config)).connect(name, connection);
    let stream = timeout(connect_timeout, connect).await.ok()?.ok()?;
    let (_, session) = stream.get_ref();
    Some(session.peer_certificates()?.iter().map(|certificate| certificate.clone().into_owned()).collect())
}

/// Checks the validity period and the name of the daemon's certificate.
pub(super) fn served(host: &str, chain: &[CertificateDer<'_>], now: SystemTime) -> Vec<Finding> {
    const CHECK: &str = "certificate";
    match chain.first().map(|der| parse_x509_certificate(der)) {
        Some(Ok((_, certificate))) => {
            vec![time(CHECK, &certificate, now), name(CHECK, host, &certificate)]
        }
        _ => vec![Finding::problem(CHECK, "the daemon shows none that can be read", RENEW)],
    }
}

/// Checks the authorities of a client.
pub(super) fn authorities(path: &Path, now: SystemTime) -> Vec<Finding> {
    const CHECK: &str = "authorities";
    let advice = "--tls-ca, SIMD_TLS_CA or the context must name the daemon's `ca.pem`";
    let text = match files::bounded(path) {
        Ok(text) => text,
        Err(error) => {
            return vec![Finding::problem(
                CHECK,
                format!("{} cannot be read: {error}", path.display()),
                advice,
            )];
        }
    };
    match certificates(&text) {
        None => vec![Finding::problem(CHECK, format!("{} has no certificate", path.display()), advice)],
        Some(all) => all.iter().map(|der| of_file(CHECK, path, der, now)).collect(),
    }
}

/// Checks the certificate files of a daemon on this machine.
pub(super) fn files(certificate: &Path, key: &Path, now: SystemTime) -> Vec<Finding> {
    const CHECK: &str = "certificate's file";
    const KEY: &str = "certificate's key";
    let mut all = Vec::new();
    let read = |check, path: &Path, all: &mut Vec<Finding>| match files::bounded(path) {
        Ok(text) => Some(text),
        Err(error) => {
            all.push(files::unreadable(check, path, &error));
            None
        }
    };
    let chain = read(CHECK, certificate, &mut all).map(|text| certificates(&text));
    match chain.as_ref().map(|chain| chain.as_deref()) {
        Some(Some([first, ..])) => all.push(of_file(CHECK, certificate, first, now)),
        Some(_) => {
            let found = format!("{} has no certificate", certificate.display());
            all.push(Finding::problem(CHECK, found, "name the certificate, and the key as the other file"));
        }
        None => {}
    }
    if let Ok(metadata) = fs::metadata(key) {
        all.push(files::private(KEY, key, &metadata));
    }
    let Some(text) = read(KEY, key, &mut all) else { return all };
    let Ok(der) = PrivateKeyDer::from_pem_slice(text.as_bytes()) else {
        let found = format!("{} has no private key", key.display());
        all.push(Finding::problem(KEY, found, "name the file that begins with -----BEGIN PRIVATE KEY-----"));
        return all;
    };
    let Some(Some(chain)) = chain else { return all };
    all.push(match CertifiedKey::from_der(chain, der, &ring::default_provider()) {
        Ok(_) => Finding::ok(KEY, "it belongs to the certificate"),
        Err(rustls::Error::InconsistentKeys(_)) => Finding::problem(
            KEY,
            format!("{} is not the key of {}", key.display(), certificate.display()),
            "name the two files that were made together",
        ),
        Err(error) => Finding::problem(KEY, format!("{} cannot be used: {error}", key.display()), RENEW),
    });
    all
}

fn certificates(text: &str) -> Option<Vec<CertificateDer<'static>>> {
    let all: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(text.as_bytes()).collect();
    all.ok().filter(|all| !all.is_empty())
}

fn of_file(check: &'static str, path: &Path, der: &CertificateDer<'_>, now: SystemTime) -> Finding {
    match parse_x509_certificate(der) {
        Ok((_, certificate)) => {
            let mut finding = time(check, &certificate, now);
            finding.found = format!("{}: {}", path.display(), finding.found);
            finding
        }
        Err(_) => Finding::problem(check, format!("{} cannot be read", path.display()), RENEW),
    }
}

fn time(check: &'static str, certificate: &X509Certificate<'_>, now: SystemTime) -> Finding {
    let now = unix_seconds(now);
    let until = |time: i64| away(time.saturating_sub(now));
    let (from, to) =
        (certificate.validity().not_before.timestamp(), certificate.validity().not_after.timestamp());
    if now < from {
        let advice = "wait, or set the clock of the machine that is wrong";
        return Finding::problem(check, format!("it is valid only {} from now", until(from)), advice);
    }
    if now >= to {
        return Finding::problem(check, format!("it expired {}", until(to)), RENEW);
    }
    match to - now < SOON {
        true => Finding::warning(check, format!("it expires {}", until(to)), RENEW),
        false => Finding::ok(check, format!("it expires {}", until(to))),
    }
}

fn name(check: &'static str, host: &str, certificate: &X509Certificate<'_>) -> Finding {
    let names = certificate.subject_alternative_name().ok().flatten();
    let names: Vec<String> = names
        .iter()
        .flat_map(|extension| &extension.value.general_names)
        .filter_map(|name| match name {
            GeneralName::DNSName(name) => Some((*name).to_owned()),
            GeneralName::IPAddress(bytes) => address(bytes).map(|address| address.to_string()),
            _ => None,
        })
        .collect();
    match names.iter().any(|name| is_of(name, host)) {
        true => Finding::ok(check, format!("it is for {}", names.join(", "))),
        false => Finding::problem(
            check,
            format!("it is not for {host}, but for {}", names.join(", ")),
            format!(
                "call the daemon by a name of its certificate, or make one with `simd tls init --host {host}`"
            ),
        ),
    }
}

fn address(bytes: &[u8]) -> Option<IpAddr> {
    match bytes.len() {
        4 => <[u8; 4]>::try_from(bytes).ok().map(IpAddr::from),
        _ => <[u8; 16]>::try_from(bytes).ok().map(IpAddr::from),
    }
}

/// Returns whether a name matches a host; `*` stands for the first label.
fn is_of(name: &str, host: &str) -> bool {
    match (name.strip_prefix("*."), host.split_once('.')) {
        (Some(parent), Some((_, of_host))) => parent.eq_ignore_ascii_case(of_host),
        _ => name.eq_ignore_ascii_case(host),
    }
}

/// Accepts any certificate, to inspect it.
#[derive(Debug)]
struct Looker(Arc<CryptoProvider>);

impl ServerCertVerifier for Looker {
    fn verify_server_cert(
        &self,
        _end_entity: &CertificateDer<'_>,
        _intermediates: &[CertificateDer<'_>],
        _server_name: &ServerName<'_>,
        _ocsp_response: &[u8],
        _now: UnixTime,
    ) -> Result<ServerCertVerified, rustls::Error> {
        Ok(ServerCertVerified::assertion())
    }

    fn verify_tls12_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signed: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, rustls::Error> {
        let algorithms = &self.0.signature_verification_algorithms;
        rustls::crypto::verify_tls12_signature(message, certificate, signed, algorithms)
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signed: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, rustls::Error> {
        let algorithms = &self.0.signature_verification_algorithms;
        rustls::crypto::verify_tls13_signature(message, certificate, signed, algorithms)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        self.0.signature_verification_algorithms.supported_schemes()
    }
}
