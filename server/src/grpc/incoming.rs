//! Arriving connections: accepted, admitted or refused, and distinguished by their HTTP version.

use std::io;
use std::net::IpAddr;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::task::{Context, Poll};
use std::time::Duration;

use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::net::TcpStream;
use tokio::time::{Instant, Sleep};
use tokio_stream::{Stream, StreamExt as _};
use tokio_util::sync::{CancellationToken, WaitForCancellationFutureOwned};
use tonic::transport::server::Connected;

use super::calls::Origin;
use super::connections::{Address, Connections, Slot};
use simd_world::handle::{Disconnect, Peer};

/// Pause after an error of accepting: most causes, such as too many open files, persist for a while.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);
/// First bytes of each HTTP/2 client (RFC 9113, 3.4). After them, keepalive finds out whether the client still
/// answers.
pub(super) const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";

/// First requests of health checks and scrapers on a new connection.
const HEALTH: [&[u8]; 4] = [b"GET /healthz", b"GET /readyz", b"GET /metrics", b"HEAD /healthz"];

/// Number of connections that this process has accepted.
static ACCEPTED: AtomicU64 = AtomicU64::new(0);

/// Accepts from `source`, for as long as it lasts, and serves connections while there is room; others are
/// closed. It also accepts without room, since a client with a reserved slot may connect. Errors of accepting
/// are logged.
pub(super) async fn accept<S, T>(
    mut source: S,
    connections: &Arc<Connections>,
    draining: &CancellationToken,
    mut serve: impl FnMut(T, Slot, IpAddr),
) where
    S: Stream<Item = io::Result<(T, IpAddr)>> + Unpin,
{
    let mut is_failing = false;
    while let Some(accepted) = source.next().await {
        match accepted {
            Ok((io, address)) => {
                is_failing = false;
                let number = ACCEPTED.fetch_add(1, Ordering::Relaxed);
                if let Ok(slot) = connections.admit(number, Address::from(address), draining) {
                    serve(io, slot, address);
                }
            }
            Err(error) => {
                if !is_failing {
                    tracing::warn!("connections cannot be accepted: {error}");
                }
                is_failing = true;
                tokio::time::sleep(ACCEPT_PAUSE).await;
            }
        }
    }
}

/// Kind of a plain connection's first request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FirstRequest {
    /// A health check.
    Health,
    Other,
    /// No request in time.
    Nothing,
}

/// Peeks at the first bytes of a connection, which remain to be read.
pub(super) async fn first_request(io: &TcpStream, time: Duration) -> FirstRequest {
    let mut bytes = [0; 16];
    match tokio::time::timeout(time, io.peek(&mut bytes)).await {
        Ok(Ok(count @ 1..)) => {
            let begun = bytes.get(..count).unwrap_or_default();
            match HEALTH.iter().any(|question| begun.starts_with(question)) {
                true => FirstRequest::Health,
                false => FirstRequest::Other,
            }
        }
        Ok(Ok(0) | Err(_)) | Err(_) => FirstRequest::Nothing,
    }
}

/// A connection with its slot.
#[derive(Debug)]
pub(super) struct Connection<T> {
    io: T,
    speaks: Speaks,
    is_cut: Pin<Box<WaitForCancellationFutureOwned>>,
    /// Address of the client.
    address: IpAddr,
    /// Dropped after `io`, so that there are never more connections than slots.
    slot: Slot,
}

/// Protocol of the other side.
#[derive(Debug)]
enum Speaks {
    /// Unknown: the first `sent` bytes match the preface.
    Opening { sent: usize, deadline: Pin<Box<Sleep>> },
    /// HTTP/2: it sent the preface.
    Http2,
    /// Any other protocol, served as HTTP/1.1.
    Http1 { deadline: Pin<Box<Sleep>>, silence: Duration },
}

impl<T> Connection<T> {
    /// Makes a connection, with deadlines on the calling runtime.
    pub(super) fn new(io: T, slot: Slot, address: IpAddr) -> Self {
        let deadline = Box::pin(tokio::time::sleep(slot.limits().begin));
        let is_cut = Box::pin(slot.cut.clone().cancelled_owned());
        Self { io, speaks: Speaks::Opening { sent: 0, deadline }, is_cut, address, slot }
    }

    /// Returns the token that is cancelled when it must take no more calls.
    pub(super) fn end(&self) -> CancellationToken {
        self.slot.end.clone()
    }

    /// Returns the token that is cancelled once it has ended.
    pub(super) fn ended(&self) -> CancellationToken {
        self.slot.cut.clone()
    }

    /// Returns an error if it was cut, or had no traffic for too long.
    fn check(&mut self, context: &mut Context<'_>) -> io::Result<()> {
        if self.is_cut.as_mut().poll(context).is_ready() {
            return Err(io::Error::new(io::ErrorKind::ConnectionAborted, "closed for idleness"));
        }
        self.speaks.check(context)
    }

    /// Returns the result of a write, and restarts the deadline.
    fn wrote(
        &mut self,
        polled: Poll<io::Result<usize>>,
        context: &mut Context<'_>,
    ) -> Poll<io::Result<usize>> {
        match polled {
            Poll::Ready(_) => self.speaks.moved(),
            Poll::Pending => self.check(context)?,
        }
        polled
    }
}

impl Speaks {
    /// Examines the next bytes of the other side.
    fn heard(&mut self, bytes: &[u8], slot: &Slot) -> io::Result<()> {
        let Self::Opening { sent, .. } = self else {
            self.moved();
            return Ok(());
        };
        let missing = PREFACE.get(*sent..).unwrap_or_default();
        let compared = bytes.len().min(missing.len());
        if bytes.get(..compared) == missing.get(..compared) {
            *sent += compared;
            if compared == missing.len() {
                *self = Self::Http2;
            }
            return Ok(());
        }
        slot.becomes_http1().map_err(io::Error::other)?;
        let silence = slot.limits().http1_silence;
        *self = Self::Http1 { deadline: Box::pin(tokio::time::sleep(silence)), silence };
        Ok(())
    }

    /// Restarts the deadline after traffic.
    fn moved(&mut self) {
        if let Self::Http1 { deadline, silence, .. } = self {
            deadline.as_mut().reset(Instant::now() + *silence);
        }
    }

    /// Returns an error if there was no traffic for too long.
    fn check(&mut self, context: &mut Context<'_>) -> io::Result<()> {
        let (deadline, sentence) = match self {
            Self::Http2 => return Ok(()),
            Self::Opening { deadline, .. } => (deadline, "the client sent no HTTP request in time"),
            Self::Http1 { deadline, .. } => (deadline, "no byte was sent or received for too long"),
        };
        match deadline.as_mut().poll(context) {
            Poll::Pending => Ok(()),
            Poll::Ready(()) => Err(io::Error::new(io::ErrorKind::TimedOut, sentence)),
        }
    }
}

impl<T: AsyncRead + Unpin> AsyncRead for Connection<T> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let before = buffer.filled().len();
        let polled = Pin::new(&mut self.io).poll_read(context, buffer);
        match polled {
            Poll::Pending => self.check(context)?,
            Poll::Ready(_) => {
                let Self { speaks, slot, .. } = &mut *self;
                speaks.heard(buffer.filled().get(before..).unwrap_or_default(), slot)?;
            }
        }
        polled
    }
}

impl<T: AsyncWrite + Unpin> AsyncWrite for Connection<T> {
    fn poll_write(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        bytes: &[u8],
    ) -> Poll<io::Result<usize>> {
        let polled = Pin::new(&mut self.io).poll_write(context, bytes);
        self.wrote(polled, context)
    }

    fn poll_flush(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.io).poll_flush(context)
    }

    fn poll_shutdown(mut self: Pin<&mut Self>, context: &mut Context<'_>) -> Poll<io::Result<()>> {
        Pin::new(&mut self.io).poll_shutdown(context)
    }

    fn poll_write_vectored(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        slices: &[io::IoSlice<'_>],
    ) -> Poll<io::Result<usize>> {
        let polled = Pin::new(&mut self.io).poll_write_vectored(context, slices);
        self.wrote(polled, context)
    }

    fn is_write_vectored(&self) -> bool {
        self.io.is_write_vectored()
    }
}

/// [`super::calls::follow`] gets it with each request.
impl<T> Connected for Connection<T> {
    type ConnectInfo = Origin;

    fn connect_info(&self) -> Origin {
        Origin {
            peer: Peer::Connection { number: self.slot.number, address: self.address },
            activity: Arc::clone(&self.slot.activity),
            disconnect: Disconnect(self.slot.cut.clone()),
        }
    }
}
