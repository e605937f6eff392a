//! `simd tls`: makes a private authority and certificates that it signs, for a lab that has none.

use std::ffi::OsString;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::{Parser, Subcommand};
use rcgen::{
    BasicConstraints, CertificateParams, DnType, ExtendedKeyUsagePurpose, IsCa, Issuer, KeyPair,
    KeyUsagePurpose,
};
use simd_assets::{Replacement, files};
use time::{Duration, OffsetDateTime};

use crate::subcommand;

/// Maximum size of a file of an authority, bytes.
const MAX_BYTES: u64 = 1 << 20;
/// Validity of the authority.
const AUTHORITY: Duration = Duration::days(3_650);
/// Validity of certificates of the daemon and of clients.
const LEAF: Duration = Duration::days(825);
/// Time by which validity begins early, since clocks differ.
const BEFORE: Duration = Duration::days(1);

/// A headless robot physics daemon: certificates
#[derive(Debug, Parser)]
#[command(name = "simd", version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Certificates
    #[command(subcommand)]
    Tls(Tls),
}

#[derive(Debug, Subcommand)]
enum Tls {
    /// Makes a private authority and the daemon's certificate: ca.pem, ca.key, server.pem and server.key
    Init {
        /// Output folder, created if missing. An authority in it signs the new certificate
        folder: PathBuf,
        /// Name or address by which clients reach the daemon, in addition to localhost, 127.0.0.1 and ::1.
        /// Repeatable
        #[arg(long, value_name = "HOST")]
        host: Vec<String>,
    },
    /// Makes the certificate of a client, which Zenoh requires if others can reach it: NAME.pem and NAME.key
    Client {
        /// Folder with the authority of `simd tls init`, also the output folder
        folder: PathBuf,
        /// Name of the client: 1 to 64 of the characters A-Z a-z 0-9 . _ -. `simd zenoh-acl` expects "simd"
        /// for a daemon that joins a router
        name: String,
    },
}

/// Runs the arguments if they begin with `tls`; returns the text to print.
///
/// # Errors
/// Returns a text: clap's about wrong usage, or the reason why a file cannot be written.
pub fn run(arguments: &[OsString]) -> Option<Result<String, String>> {
    let Command::Tls(tls) = match subcommand::read::<Arguments>("tls", arguments)? {
        Ok(arguments) => arguments.command,
        Err(said) => return Some(said),
    };
    Some(match tls {
        Tls::Init { folder, host } => init(&folder, host),
        Tls::Client { folder, name } => client(&folder, &name),
    })
}

fn init(folder: &Path, hosts: Vec<String>) -> Result<String, String> {
    fs::create_dir_all(folder).map_err(|error| failed(folder, &error))?;
    let [authority, server, server_key] =
        ["ca.pem", "server.pem", "server.key"].map(|name| folder.join(name));
    are_free([&server, &server_key])?;
    let issuer = match known(folder)? {
        Some(issuer) => issuer,
        None => new_issuer(folder)?,
    };
    let mut names = ["localhost", "127.0.0.1", "::1"].map(str::to_owned).to_vec();
    names.extend(hosts.iter().filter(|host| !names.contains(host)).cloned().collect::<Vec<_>>());
    let params = params("simd", LEAF, names).map_err(|error| failed(folder, &error))?;
    sign(params, ExtendedKeyUsagePurpose::ServerAuth, &issuer, [&server, &server_key])?;
    let host = hosts.first().map_or("127.0.0.1", String::as_str);
    let (authority, server, server_key) = (authority.display(), server.display(), server_key.display());
    Ok(format!(
        "made {server} and {server_key}; keep the keys to yourself, and give {authority} to clients\n\
         \n\
         daemon:  simd --listen 0.0.0.0:7400 --tls-certificate {server} --tls-key {server_key} --tokens TOKENS\n\
         client:  export SIMD_TLS_CA={authority} SIMD_ENDPOINT=https://{host}:7400\n\
         \x20        simctl server info\n\
         Python:  over Zenoh, which asks for a certificate of the client: see `simd tls client --help`\n"
    ))
}

fn client(folder: &Path, name: &str) -> Result<String, String> {
    let is_name = (1..=64).contains(&name.len())
        && name.bytes().all(|byte| byte.is_ascii_alphanumeric() || b"._-".contains(&byte))
        && !["ca", "server"].contains(&name)
        && !name.starts_with(['.', '-']);
    if !is_name {
        return Err(format!(
            "{name:?} is not a valid name of a client: it must be 1 to 64 of the characters A-Z a-z 0-9 . _ \
             -, not ca and not server, and not begin with . or -"
        ));
    }
    let files = ["pem", "key"].map(|kind| folder.join(format!("{name}.{kind}")));
    let [certificate, key] = &files;
    are_free([certificate, key])?;
    let issuer = known(folder)?
        .ok_or_else(|| format!("{} has no authority: make one with `simd tls init`", folder.display()))?;
    let params = params(name, LEAF, Vec::new()).map_err(|error| failed(folder, &error))?;
    sign(params, ExtendedKeyUsagePurpose::ClientAuth, &issuer, [certificate, key])?;
    let [authority, server, server_key] =
        ["ca.pem", "server.pem", "server.key"].map(|name| folder.join(name).display().to_string());
    Ok(format!(
        "made {} and {}; give them to {name}, with {authority}\n\
         \n\
         daemon:  simd --zenoh tls/0.0.0.0:7447 --tls-certificate {server} --tls-key {server_key} \
         --tls-client-authorities {authority} --tokens TOKENS\n\
         Python:  simd_client.connect(\"tls/HOST:7447\", config=simd_client.tls.authority(\"ca.pem\", \"{name}.pem\", \
         \"{name}.key\"), token=\"TOKEN\")\n\
         simctl:  export SIMD_TLS_CA=ca.pem SIMD_TLS_CLIENT_CERT={name}.pem SIMD_TLS_CLIENT_KEY={name}.key\n",
        certificate.display(),
        key.display()
    ))
}

fn failed(folder: &Path, error: &dyn std::fmt::Display) -> String {
    format!("cannot make certificates in {}: {error}", folder.display())
}

fn are_free(paths: [&Path; 2]) -> Result<(), String> {
    match paths.into_iter().find(|path| path.exists()) {
        Some(path) => Err(format!("{} already exists: move it away first", path.display())),
        None => Ok(()),
    }
}

/// Returns the authority in a folder, if any.
fn known(folder: &Path) -> Result<Option<Issuer<'static, KeyPair>>, String> {
    let read = |name: &str| match files::read_text(&folder.join(name), MAX_BYTES) {
        Ok(text) => Ok(Some(text)),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(format!("cannot read {}: {error}", folder.join(name).display())),
    };
    let Some((certificate, key)) = read("ca.pem")?.zip(read("ca.key")?) else { return Ok(None) };
    let broken =
        |name: &str, error: rcgen::Error| format!("{} is incomplete: {error}", folder.join(name).display());
    let key = KeyPair::from_pem(&key).map_err(|error| broken("ca.key", error))?;
    Issuer::from_ca_cert_pem(&certificate, key).map(Some).map_err(|error| broken("ca.pem", error))
}

fn new_issuer(folder: &Path) -> Result<Issuer<'static, KeyPair>, String> {
    let made = |error: rcgen::Error| failed(folder, &error);
    let key = KeyPair::generate().map_err(made)?;
    let mut params = params("simd authority", AUTHORITY, Vec::new()).map_err(made)?;
    params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
    params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
    let certificate = params.self_signed(&key).map_err(made)?;
    write(&folder.join("ca.pem"), &certificate.pem(), false)?;
    write(&folder.join("ca.key"), &key.serialize_pem(), true)?;
    Ok(Issuer::new(params, key))
}

/// Makes a key and signs its certificate, for one side of a connection.
fn sign(
    mut params: CertificateParams,
    purpose: ExtendedKeyUsagePurpose,
    issuer: &Issuer<'_, KeyPair>,
    [certificate_path, key_path]: [&Path; 2],
) -> Result<(), String> {
    let made = |error: rcgen::Error| failed(certificate_path, &error);
    let key = KeyPair::generate().map_err(made)?;
    params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
    params.extended_key_usages = vec![purpose];
    params.use_authority_key_identifier_extension = true;
    let certificate = params.signed_by(&key, issuer).map_err(made)?;
    write(certificate_path, &certificate.pem(), false)?;
    write(key_path, &key.serialize_pem(), true)
}

fn params(name: &str, lifetime: Duration, names: Vec<String>) -> Result<CertificateParams, rcgen::Error> {
    let mut params = CertificateParams::new(names)?;
    params.distinguished_name.push(DnType::CommonName, name);
    let now = OffsetDateTime::now_utc();
    (params.not_before, params.not_after) = (now - BEFORE, now + lifetime);
    Ok(params)
}

/// Writes a new file, which other users cannot read if it is secret.
fn write(path: &Path, text: &str, is_secret: bool) -> Result<(), String> {
    let written = || {
        let mut file = Replacement::begin_new(path)?;
        if is_secret {
            file.make_private()?;
        }
        file.write_all(text.as_bytes())?;
        file.finish()
    };
    written().map_err(|error: std::io::Error| format!("cannot write {}: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_second_certificate_is_signed_by_the_same_authority_and_nothing_is_overwritten() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("tls");
        let said = init(&path, vec!["lab.example".into()]).unwrap();
        assert!(said.contains("https://lab.example:7400"), "{said}");
        let authority = fs::read_to_string(path.join("ca.pem")).unwrap();
        assert!(init(&path, Vec::new()).unwrap_err().contains("server.pem already exists"));
        fs::remove_file(path.join("server.pem")).unwrap();
        assert!(init(&path, Vec::new()).unwrap_err().contains("server.key already exists"));
        fs::remove_file(path.join("server.key")).unwrap();
        init(&path, Vec::new()).unwrap();
        assert_eq!(fs::read_to_string(path.join("ca.pem")).unwrap(), authority);
    }

    #[test]
    fn a_client_gets_a_certificate_from_the_existing_authority() {
        let folder = tempfile::tempdir().unwrap();
        let lacks = client(folder.path(), "alice").unwrap_err();
        assert!(lacks.contains("simd tls init"), "{lacks}");
        init(folder.path(), Vec::new()).unwrap();
        let said = client(folder.path(), "alice").unwrap();
        assert!(said.contains("\"alice.pem\", \"alice.key\""), "{said}");
        assert!(client(folder.path(), "alice").unwrap_err().contains("alice.pem already exists"));
        fs::write(folder.path().join("ca.key"), "x").unwrap();
        let broken = client(folder.path(), "bob").unwrap_err();
        assert!(broken.contains("ca.key is incomplete"), "{broken}");
        for name in ["", "ca", "server", "../alice", "a b", "-a", ".a"] {
            assert!(
                client(folder.path(), name).unwrap_err().contains("is not a valid name of a client"),
                "{name}"
            );
        }
    }

    #[cfg(unix)]
    #[test]
    fn keys_are_the_owners_alone() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().unwrap();
        init(folder.path(), Vec::new()).unwrap();
        client(folder.path(), "alice").unwrap();
        for key in ["ca.key", "server.key", "alice.key"] {
            let mode = fs::metadata(folder.path().join(key)).unwrap().permissions().mode();
            assert_eq!(mode & 0o777, 0o600, "{key}");
        }
    }
}
