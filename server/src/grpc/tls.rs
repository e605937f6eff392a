//! TLS: the part of a connection before HTTP.

use std::io;
use std::path::Path;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll, ready};

use arc_swap::ArcSwap;
use simd_assets::files;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::{TcpStream, UnixStream};
use tokio_rustls::rustls::crypto::ring;
use tokio_rustls::rustls::pki_types::pem::PemObject as _;
use tokio_rustls::rustls::pki_types::{CertificateDer, PrivateKeyDer};
use tokio_rustls::rustls::server::WebPkiClientVerifier;
use tokio_rustls::rustls::{RootCertStore, ServerConfig};
use tokio_rustls::server::TlsStream;
use tokio_rustls::{Accept, TlsAcceptor};

use super::socket_names::SocketNames;
use crate::config::TlsFiles;

/// Maximum size of a file with certificates or a key, bytes.
const MAX_BYTES: u64 = 1 << 20;

/// Certificate of the served connections.
#[derive(Debug)]
pub struct Tls {
    files: TlsFiles,
    config: ArcSwap<ServerConfig>,
}

impl Tls {
    /// Reads the certificate in these files.
    ///
    /// # Errors
    /// Returns a sentence if a file cannot be read, or they do not belong together.
    pub fn read(files: TlsFiles) -> Result<Self, String> {
        let config = ArcSwap::new(Arc::new(config(&files)?));
        Ok(Self { files, config })
    }

    /// Reads the files again; present connections are unchanged.
    ///
    /// # Errors
    /// As [`read`](Self::read); then the certificate is unchanged.
    pub fn reload(&self) -> Result<(), String> {
        self.config.store(Arc::new(config(&self.files)?));
        Ok(())
    }

    fn accept(&self, io: TcpStream) -> Wire {
        Wire::Handshake(Box::new(TlsAcceptor::from(self.config.load_full()).accept(io)))
    }
}

fn config(files: &TlsFiles) -> Result<ServerConfig, String> {
    let TlsFiles { certificate, key, client_authorities } = files;
    let chain = certificates(certificate)?;
    let unreadable =
        |error: &dyn std::fmt::Display| format!("the private key {} cannot be read: {error}", key.display());
    let private = PrivateKeyDer::from_pem_slice(&read(key).map_err(|error| unreadable(&error))?)
        .map_err(|error| unreadable(&error))?;
    let provider = Arc::new(ring::default_provider());
    let builder = ServerConfig::builder_with_provider(Arc::clone(&provider))
        .with_safe_default_protocol_versions()
        .map_err(|error| format!("TLS cannot be served: {error}"))?;
    let builder = match client_authorities {
        None => builder.with_no_client_auth(),
        Some(path) => {
            let mut roots = RootCertStore::empty();
            let unusable = |error: &dyn std::fmt::Display| {
                format!("the authorities of clients in {} cannot be used: {error}", path.display())
            };
            for authority in certificates(path)? {
                roots.add(authority).map_err(|error| unusable(&error))?;
            }
            let verifier = WebPkiClientVerifier::builder_with_provider(Arc::new(roots), provider).build();
            builder.with_client_cert_verifier(verifier.map_err(|error| unusable(&error))?)
        }
    };
    let mut config = builder.with_single_cert(chain, private).map_err(|error| {
        let (certificate, key) = (certificate.display(), key.display());
        format!("the certificate {certificate} and the private key {key} cannot be used together: {error}")
    })?;
    config.alpn_protocols = vec![b"h2".to_vec(), b"http/1.1".to_vec()];
    Ok(config)
}

fn read(path: &Path) -> io::Result<Vec<u8>> {
    files::read(files::open(path)?, MAX_BYTES)
}

fn certificates(path: &Path) -> Result<Vec<CertificateDer<'static>>, String> {
    let unreadable =
        |error: &dyn std::fmt::Display| format!("the certificate {} cannot be read: {error}", path.display());
    let bytes = read(path).map_err(|error| unreadable(&error))?;
    let chain: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(&bytes).collect();
    match chain {
        Ok(chain) if chain.is_empty() => Err(unreadable(&"it has no certificate in PEM")),
        Ok(chain) => Ok(chain),
        Err(error) => Err(unreadable(&error)),
    }
}

/// A connection, with TLS or without. The handshake is part of the first read, and so has its deadline.
pub(super) enum Wire {
    Plain(TcpStream),
    /// Without TLS: nothing of it leaves the machine.
    Unix(UnixStream, SocketNames),
    Handshake(Box<Accept<TcpStream>>),
    Tls(Box<TlsStream<TcpStream>>),
}

impl Wire {
    pub(super) fn new(io: TcpStream, tls: Option<&Tls>) -> Self {
        match tls {
            Some(tls) => tls.accept(io),
            None => Self::Plain(io),
        }
    }

    pub(super) fn of_socket(io: UnixStream) -> Self {
        Self::Unix(io, SocketNames::default())
    }

    fn handshake(&mut self, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        if let Self::Handshake(accept) = self {
            let stream = ready!(Pin::new(accept.as_mut()).poll(context))?;
            *self = Self::Tls(Box::new(stream));
        }
        Poll::Ready(Ok(()))
    }
}

impl AsyncRead for Wire {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        ready!(self.handshake(context))?;
        match &mut *self {
            Self::Plain(io) => Pin::new(io).poll_read(context, buffer),
            Self::Unix(io, names) => {
                let before = buffer.filled().len();
                let polled = Pin::new(io).poll_read(context, buffer);
                names.change(buffer.filled_mut().get_mut(before..).unwrap_or_default());
                polled
            }
            Self::Tls(io) => Pin::new(io.as_mut()).poll_read(context, buffer),
            Self::Handshake(_) => Poll::Pending,
        }
    }
}

impl AsyncWrite for Wire {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        ready!(self.handshake(context))?;
        match &mut *self {
            Self::Plain(io) => Pin::new(io).poll_write(context, bytes),
            Self::Unix(io, _) => Pin::new(io).poll_write(context, bytes),
            Self::Tls(io) => Pin::new(io.as_mut()).poll_write(context, bytes),
            Self::Handshake(_) => Poll::Pending,
        }
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        match &mut *self {
            Self::Plain(io) => Pin::new(io).poll_flush(context),
            Self::Unix(io, _) => Pin::new(io).poll_flush(context),
            Self::Tls(io) => Pin::new(io.as_mut()).poll_flush(context),
            // Nothing was written yet.
            Self::Handshake(_) => Poll::Ready(Ok(())),
        }
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        match &mut *self {
            Self::Plain(io) => Pin::new(io).poll_shutdown(context),
            Self::Unix(io, _) => Pin::new(io).poll_shutdown(context),
            Self::Tls(io) => Pin::new(io.as_mut()).poll_shutdown(context),
            Self::Handshake(_) => Poll::Ready(Ok(())),
        }
    }
}
