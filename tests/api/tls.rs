//! Connections over TLS: checks of the peer, certificates and their expiry.

use std::path::{Path, PathBuf};
use std::time::Duration;

use simd_client::access::Role;
use simd_client::{Client, Error, JointWatch, every_joint};
use simd_server::config::TlsFiles;
use simd_tests::network;
use simd_tests::process::soon;
use tempfile::TempDir;

use crate::security::{certificates, guarded, of, options};

#[tokio::test(flavor = "multi_thread")]
async fn clients_talk_over_tls_and_to_no_other_daemon() {
    let guarded = guarded(|config, folder| config.tls = Some(certificates(folder))).await;
    let admin = guarded.client(&of(Role::Admin)).await;
    assert!(admin.robots().await.unwrap().is_empty());
    let connect = async |endpoint: &str, authority: Option<PathBuf>| {
        let connected = Client::connect_with(endpoint, options(Some(of(Role::Admin)), authority)).await;
        connected.map(drop).unwrap_err()
    };
    // Plain text, an authority that did not sign it, none, and a name that the certificate lacks.
    let port = guarded.running.address.port();
    let plain = Client::connect_with(&format!("localhost:{port}"), options(None, None)).await;
    let plain = match plain {
        Ok(client) => client.robots().await.map(drop),
        Err(error) => Err(error),
    };
    assert!(matches!(plain, Err(Error::Unreachable { .. })), "{plain:?}");
    let other = TempDir::new().unwrap();
    certificates(other.path());
    let unknown = connect(&guarded.grpc(), Some(other.path().join("ca.pem"))).await;
    assert!(
        matches!(&unknown, Error::Untrusted { sentence, .. } if sentence.contains("is not signed by an authority that is known here")),
        "{unknown:?}"
    );
    assert!(connect(&guarded.grpc(), None).await.to_string().contains("SIMD_TLS_CA"));
    let wrong = connect(&format!("https://[::ffff:127.0.0.1]:{port}"), Some(guarded.authority())).await;
    assert!(
        matches!(&wrong, Error::Untrusted { sentence, .. } if sentence.contains("is not for that host")),
        "{wrong:?}"
    );
    // A new certificate applies to new connections; existing ones continue.
    for file in ["server.pem", "server.key", "ca.pem", "ca.key"] {
        std::fs::remove_file(guarded.folder.path().join(file)).unwrap();
    }
    guarded.running.reload();
    admin.robots().await.unwrap();
    certificates(guarded.folder.path());
    guarded.running.reload();
    admin.robots().await.unwrap();
    let old = connect(&guarded.grpc(), Some(other.path().join("ca.pem"))).await;
    assert!(matches!(&old, Error::Untrusted { .. }), "{old:?}");
    guarded.client(&of(Role::Viewer)).await.robots().await.unwrap();
}

/// Reads a stream until a state comes that is newer than all earlier ones.
async fn goes_on(client: &Client, watch: &mut JointWatch) {
    let now = client.joint_states(Vec::new()).await.unwrap().stamp.unwrap().sequence;
    soon("a newer state of the stream", async {
        while watch.next().await.unwrap().unwrap().stamp.unwrap().sequence <= now {}
    })
    .await;
}

/// Clients that connect meanwhile get the new certificate, which the old authority did not sign; connected
/// ones do not need it.
#[tokio::test(flavor = "multi_thread")]
async fn a_stream_continues_while_the_certificate_is_read_again() {
    let guarded = guarded(|config, folder| config.tls = Some(certificates(folder))).await;
    let folder = guarded.folder.path();
    let admin = guarded.client(&of(Role::Admin)).await;
    crate::load_arm(&admin, "arm").await;
    let mut watch = admin.watch(vec![every_joint("arm")], 200.0).await.unwrap();
    goes_on(&admin, &mut watch).await;
    let before = folder.join("before.pem");
    std::fs::rename(folder.join("ca.pem"), &before).unwrap();
    for file in ["server.pem", "server.key", "ca.key"] {
        std::fs::remove_file(folder.join(file)).unwrap();
    }
    // No certificate can be read: the previous one is kept.
    guarded.running.reload();
    goes_on(&admin, &mut watch).await;
    certificates(folder);
    guarded.running.reload();
    goes_on(&admin, &mut watch).await;
    guarded.client(&of(Role::Viewer)).await.robots().await.unwrap();
    let late = Client::connect_with(&guarded.grpc(), options(Some(of(Role::Viewer)), Some(before))).await;
    assert!(matches!(late.map(drop), Err(Error::Untrusted { .. })), "it has the certificate of before");
    goes_on(&admin, &mut watch).await;
}

/// Writes a server certificate of the authority in a folder, which expired more than a day ago.
fn expire(folder: &Path) {
    use rcgen::{CertificateParams, Issuer, KeyPair};
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let authority = KeyPair::from_pem(&read("ca.key")).unwrap();
    let issuer = Issuer::from_ca_cert_pem(&read("ca.pem"), authority).unwrap();
    let mut params = CertificateParams::new(vec!["localhost".into(), "127.0.0.1".into()]).unwrap();
    let now = time::OffsetDateTime::now_utc();
    (params.not_before, params.not_after) = (now - time::Duration::days(2), now - time::Duration::days(1));
    let key = KeyPair::from_pem(&read("server.key")).unwrap();
    let certificate = params.signed_by(&key, &issuer).unwrap();
    std::fs::write(folder.join("server.pem"), certificate.pem()).unwrap();
}

/// A self-signed certificate, and a daemon without TLS: a client that requires TLS refuses both.
#[tokio::test(flavor = "multi_thread")]
async fn a_certificate_that_signs_itself_and_plain_text_in_its_place_are_refused() {
    let guarded = guarded(|config, folder| config.tls = Some(certificates(folder))).await;
    let names = vec!["localhost".to_owned(), "127.0.0.1".to_owned()];
    let own = rcgen::generate_simple_self_signed(names).unwrap();
    let folder = guarded.folder.path();
    std::fs::write(folder.join("server.pem"), own.cert.pem()).unwrap();
    std::fs::write(folder.join("server.key"), own.signing_key.serialize_pem()).unwrap();
    guarded.running.reload();
    let plain = crate::security::guarded(|_, _| {}).await;
    let there = format!("https://localhost:{}", plain.running.address.port());
    for endpoint in [guarded.grpc(), there] {
        let options = options(Some(of(Role::Admin)), Some(guarded.authority()));
        let answered = match Client::connect_with(&endpoint, options).await {
            Ok(client) => client.robots().await.map(drop),
            Err(error) => Err(error),
        };
        let is_refused = matches!(answered, Err(Error::Unreachable { .. } | Error::Untrusted { .. }));
        assert!(is_refused, "{endpoint}: {answered:?}");
    }
}

/// Existing connections continue: TLS checks the time only when a connection begins.
#[tokio::test(flavor = "multi_thread")]
async fn a_certificate_that_expired_is_refused_by_clients_that_come() {
    let guarded = guarded(|config, folder| config.tls = Some(certificates(folder))).await;
    let before = guarded.client(&of(Role::Admin)).await;
    before.robots().await.unwrap();
    expire(guarded.folder.path());
    guarded.running.reload();
    let options = options(Some(of(Role::Admin)), Some(guarded.authority()));
    let refused = match Client::connect_with(&guarded.grpc(), options).await {
        Ok(client) => client.robots().await.unwrap_err(),
        Err(error) => error,
    };
    assert!(
        matches!(&refused, Error::Untrusted { sentence, .. } if sentence.contains("has expired")),
        "{refused:?}"
    );
    before.robots().await.unwrap();
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_without_a_certificate_is_not_served_where_one_is_asked_for() {
    let guarded = guarded(|config, folder| {
        let files = certificates(folder);
        config.tls = Some(TlsFiles { client_authorities: Some(folder.join("ca.pem")), ..files });
    })
    .await;
    let connected =
        Client::connect_with(&guarded.grpc(), options(Some(of(Role::Admin)), Some(guarded.authority())))
            .await;
    let refused = connected.err().unwrap();
    assert!(matches!(refused, Error::Untrusted { .. }), "{refused:?}");
    assert!(refused.to_string().contains("SIMD_TLS_CLIENT_CERT"), "{refused}");
    let client = Client::connect_with(&guarded.grpc(), with_certificate(&guarded)).await.unwrap();
    assert!(client.robots().await.unwrap().is_empty());
}

/// Returns a client's certificate of the daemon's own authority.
fn with_certificate(guarded: &crate::security::Guarded) -> simd_client::ConnectOptions {
    use rcgen::{CertificateParams, ExtendedKeyUsagePurpose, Issuer, KeyPair};
    let folder = guarded.folder.path();
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap();
    let authority = KeyPair::from_pem(&read("ca.key")).unwrap();
    let issuer = Issuer::from_ca_cert_pem(&read("ca.pem"), authority).unwrap();
    let mut params = CertificateParams::new(vec!["me".into()]).unwrap();
    params.extended_key_usages.push(ExtendedKeyUsagePurpose::ClientAuth);
    let key = KeyPair::generate().unwrap();
    std::fs::write(folder.join("me.pem"), params.signed_by(&key, &issuer).unwrap().pem()).unwrap();
    std::fs::write(folder.join("me.key"), key.serialize_pem()).unwrap();
    simd_client::ConnectOptions {
        tls_certificate: Some(folder.join("me.pem")),
        tls_key: Some(folder.join("me.key")),
        ..options(Some(of(Role::Admin)), Some(guarded.authority()))
    }
}

/// Zenoh itself reports that each of them has expired.
#[tokio::test(flavor = "multi_thread")]
async fn faults_of_certificates_are_reported_over_zenoh_too() {
    if !network::has_one_thread("tls::faults_of_certificates_are_reported_over_zenoh_too") {
        return;
    }
    let sealed = async |asks: bool| {
        guarded(move |config, folder| {
            let files = certificates(folder);
            let client_authorities = asks.then(|| folder.join("ca.pem"));
            config.zenoh.tls = Some(TlsFiles { client_authorities, ..files });
            config.zenoh.listen = Some(vec!["tls/127.0.0.1:0".into()]);
        })
        .await
    };
    let said = async |guarded: &crate::security::Guarded, authority: Option<PathBuf>| {
        let connect_timeout = Duration::from_secs(2);
        let options =
            simd_client::ConnectOptions { connect_timeout, ..options(Some(of(Role::Admin)), authority) };
        Client::connect_with(&guarded.running.locators()[0], options)
            .await
            .map(drop)
            .map_err(|error| error.to_string())
    };
    let open = sealed(false).await;
    assert_eq!(said(&open, Some(open.authority())).await, Ok(()));
    let other = TempDir::new().unwrap();
    certificates(other.path());
    for (authority, part) in [
        (None, "is not signed by an authority that is known here: SIMD_TLS_CA names"),
        (Some(other.path().join("ca.pem")), "is not signed by an authority that is known here"),
        (Some(other.path().join("lost.pem")), "there is no file "),
        (Some(open.folder.path().join("ca.key")), "has no certificate of an authority"),
    ] {
        let sentence = said(&open, authority).await.unwrap_err();
        assert!(sentence.contains(part), "{sentence}");
    }
    let strict = sealed(true).await;
    let sentence = said(&strict, Some(strict.authority())).await.unwrap_err();
    assert!(sentence.contains("set SIMD_TLS_CLIENT_CERT and SIMD_TLS_CLIENT_KEY to the files"), "{sentence}");
    let locator = &strict.running.locators()[0];
    let client = Client::connect_with(locator, with_certificate(&strict)).await.unwrap();
    assert!(client.robots().await.unwrap().is_empty());
}

/// A connection that never completes its handshake is closed like one that sends nothing.
#[tokio::test(flavor = "multi_thread")]
async fn a_silent_connection_is_cut_off() {
    use tokio::io::AsyncReadExt as _;
    let guarded = guarded(|config, folder| {
        config.tls = Some(certificates(folder));
        config.connections.begin = Duration::from_millis(50);
    })
    .await;
    let mut silent = tokio::net::TcpStream::connect(guarded.running.address).await.unwrap();
    let mut byte = [0];
    let read = tokio::time::timeout(Duration::from_secs(20), silent.read(&mut byte)).await;
    assert!(matches!(read, Ok(Ok(0) | Err(_))), "{read:?}");
}
