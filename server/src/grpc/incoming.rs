//! The connections as they come: accepted, taken in or refused, and distinguished by the HTTP that they speak.

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

/// How long nothing is accepted after an error: most, such as too many open
/// files, are still there at once.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);
/// What each HTTP/2 client begins with (RFC 9113, 3.4). After it, it is for keepalive to
/// find out whether the client is there.
const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";

/// Who looks after the daemon asks these of a new connection.
const HEALTH: [&[u8]; 4] = [b"GET /healthz", b"GET /readyz", b"GET /metrics", b"HEAD /healthz"];

/// Connections that were accepted by this process.
static ACCEPTED: AtomicU64 = AtomicU64::new(0);

/// Accepts from `source`, for as long as it lasts, and serves what there is room for; the rest is closed. Accepting
/// goes on where there is none, since a client may come for which a slot is reserved. Errors of accepting are logged.
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

/// What a connection without TLS begins with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FirstRequest {
    /// The question whether the daemon is well.
    Health,
    Other,
    /// It did not come in time.
    Nothing,
}

/// Looks at the first bytes of a connection, which stay to be read.
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

/// A connection with its slot among those that are served.
#[derive(Debug)]
pub(super) struct Connection<T> {
    io: T,
    speaks: Speaks,
    is_cut: Pin<Box<WaitForCancellationFutureOwned>>,
    /// Where it comes from.
    address: IpAddr,
    /// Dropped after `io`, so that there are never more connections than slots.
    slot: Slot,
}

/// What is known of the other side.
#[derive(Debug)]
enum Speaks {
    /// It sent so many bytes of the preface.
    Opening { sent: usize, deadline: Pin<Box<Sleep>> },
    /// HTTP/2: it began as that must.
    Http2,
    /// Anything else, which is served as HTTP/1.1.
    Http1 { deadline: Pin<Box<Sleep>>, silence: Duration },
}

impl<T> Connection<T> {
    /// Its deadlines are of the runtime that this is called on.
    pub(super) fn new(io: T, slot: Slot, address: IpAddr) -> Self {
        let deadline = Box::pin(tokio::time::sleep(slot.limits().begin));
        let is_cut = Box::pin(slot.cut.clone().cancelled_owned());
        Self { io, speaks: Speaks::Opening { sent: 0, deadline }, is_cut, address, slot }
    }

    /// Set when it shall take no more calls.
    pub(super) fn end(&self) -> CancellationToken {
        self.slot.end.clone()
    }

    /// Set once it has ended.
    pub(super) fn ended(&self) -> CancellationToken {
        self.slot.cut.clone()
    }

    /// Whether it was cut, or nothing came or went for too long.
    fn check(&mut self, context: &mut Context<'_>) -> io::Result<()> {
        if self.is_cut.as_mut().poll(context).is_ready() {
            return Err(io::Error::new(io::ErrorKind::ConnectionAborted, "closed for idleness"));
        }
        self.speaks.check(context)
    }

    /// The result of writing, after a look at the time.
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
    /// Looks at the next bytes of the other side.
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

    /// Something went over the connection.
    fn moved(&mut self) {
        if let Self::Http1 { deadline, silence, .. } = self {
            deadline.as_mut().reset(Instant::now() + *silence);
        }
    }

    /// Whether nothing came or went for too long.
    fn check(&mut self, context: &mut Context<'_>) -> io::Result<()> {
        let (deadline, sentence) = match self {
            Self::Http2 => return Ok(()),
            Self::Opening { deadline, .. } => (deadline, "the client did not say which HTTP it speaks"),
            Self::Http1 { deadline, .. } => (deadline, "nothing came or went for too long"),
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

/// Requests come with it to [`super::calls::follow`].
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
