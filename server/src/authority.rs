//! `simd tls init`: a private authority and a certificate that it signed, for a lab that has none.

use std::ffi::OsString;
use std::fs;
use std::io::Write as _;
use std::path::{Path, PathBuf};

use clap::{Parser, Subcommand};
use rcgen::{
    BasicConstraints, CertificateParams, DnType, ExtendedKeyUsagePurpose, IsCa, Issuer, KeyPair,
    KeyUsagePurpose,
};
use time::{Duration, OffsetDateTime};

use crate::subcommand;

/// How long clients may rely on the authority.
const AUTHORITY: Duration = Duration::days(3_650);
/// How long the daemon's certificate is valid.
const SERVER: Duration = Duration::days(825);
/// Clocks differ.
const BEFORE: Duration = Duration::days(1);

/// A robot physics daemon without a screen: certificates
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
        /// Where to put them; made where it is not there. With an authority in it, that signs the new certificate
        folder: PathBuf,
        /// A name or an address by which clients reach the daemon, beside localhost, 127.0.0.1 and ::1. Repeatable
        #[arg(long, value_name = "HOST")]
        host: Vec<String>,
    },
}

/// Does what the arguments ask for, where they ask for certificates; the result is what to print.
///
/// # Errors
/// Help and usage as clap has them, and where a file cannot be made; a text.
pub fn run(arguments: &[OsString]) -> Option<Result<String, String>> {
    let Command::Tls(Tls::Init { folder, host }) = match subcommand::read::<Arguments>("tls", arguments)? {
        Ok(arguments) => arguments.command,
        Err(said) => return Some(said),
    };
    Some(init(&folder, host))
}

fn init(folder: &Path, hosts: Vec<String>) -> Result<String, String> {
    let failed = |error: &dyn std::fmt::Display| format!("cannot make {}: {error}", folder.display());
    fs::create_dir_all(folder).map_err(|error| failed(&error))?;
    let [authority, authority_key, server, server_key] =
        ["ca.pem", "ca.key", "server.pem", "server.key"].map(|name| folder.join(name));
    for path in [&server, &server_key] {
        if path.exists() {
            return Err(format!("{} is there already: move it away first", path.display()));
        }
    }
    let made = |error: rcgen::Error| failed(&error);
    let known = fs::read_to_string(&authority).ok().zip(fs::read_to_string(&authority_key).ok());
    let issuer = match &known {
        Some((certificate, key)) => {
            Issuer::from_ca_cert_pem(certificate, KeyPair::from_pem(key).map_err(made)?).map_err(made)?
        }
        None => {
            let key = KeyPair::generate().map_err(made)?;
            let mut params = params("simd authority", AUTHORITY, Vec::new()).map_err(made)?;
            params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
            params.key_usages = vec![KeyUsagePurpose::KeyCertSign, KeyUsagePurpose::CrlSign];
            let certificate = params.self_signed(&key).map_err(made)?;
            write(&authority, &certificate.pem(), false)?;
            write(&authority_key, &key.serialize_pem(), true)?;
            Issuer::new(params, key)
        }
    };
    let mut names = ["localhost", "127.0.0.1", "::1"].map(str::to_owned).to_vec();
    names.extend(hosts.iter().filter(|host| !names.contains(host)).cloned().collect::<Vec<_>>());
    let key = KeyPair::generate().map_err(made)?;
    let mut params = params("simd", SERVER, names).map_err(made)?;
    params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
    params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ServerAuth];
    params.use_authority_key_identifier_extension = true;
    let certificate = params.signed_by(&key, &issuer).map_err(made)?;
    write(&server, &certificate.pem(), false)?;
    write(&server_key, &key.serialize_pem(), true)?;
    let host = hosts.first().map_or("127.0.0.1", String::as_str);
    let (authority, server, server_key) = (authority.display(), server.display(), server_key.display());
    Ok(format!(
        "made {server} and {server_key}; keep the keys to yourself, and give {authority} to clients\n\
         \n\
         daemon:  simd --listen 0.0.0.0:7400 --tls-certificate {server} --tls-key {server_key} --tokens TOKENS\n\
         client:  export SIMD_TLS_CA={authority} SIMD_ENDPOINT=https://{host}:7400\n\
         \x20        simctl server info\n"
    ))
}

fn params(name: &str, lifetime: Duration, names: Vec<String>) -> Result<CertificateParams, rcgen::Error> {
    let mut params = CertificateParams::new(names)?;
    params.distinguished_name.push(DnType::CommonName, name);
    let now = OffsetDateTime::now_utc();
    (params.not_before, params.not_after) = (now - BEFORE, now + lifetime);
    Ok(params)
}

/// A key that others could read would be no secret.
fn write(path: &Path, text: &str, is_secret: bool) -> Result<(), String> {
    let mut options = fs::OpenOptions::new();
    options.write(true).create_new(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, if is_secret { 0o600 } else { 0o644 });
    let written = options.open(path).and_then(|mut file| file.write_all(text.as_bytes()));
    written.map_err(|error| format!("cannot write {}: {error}", path.display()))
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
        assert!(init(&path, Vec::new()).unwrap_err().contains("server.pem is there already"));
        fs::remove_file(path.join("server.pem")).unwrap();
        assert!(init(&path, Vec::new()).unwrap_err().contains("server.key is there already"));
        fs::remove_file(path.join("server.key")).unwrap();
        init(&path, Vec::new()).unwrap();
        assert_eq!(fs::read_to_string(path.join("ca.pem")).unwrap(), authority);
    }

    #[cfg(unix)]
    #[test]
    fn keys_are_the_owners_alone() {
        use std::os::unix::fs::PermissionsExt as _;
        let folder = tempfile::tempdir().unwrap();
        init(folder.path(), Vec::new()).unwrap();
        for key in ["ca.key", "server.key"] {
            let mode = fs::metadata(folder.path().join(key)).unwrap().permissions().mode();
            assert_eq!(mode & 0o777, 0o600, "{key}");
        }
    }
}
