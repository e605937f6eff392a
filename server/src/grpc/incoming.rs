//! The connections that are served: so many at one time, and none that is silent from the start.

use std::convert::Infallible;
use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::task::{Context, Poll};
use std::time::Duration;

use futures_util::stream;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::{Instant, Sleep};
use tokio_stream::{Stream, StreamExt as _};
use tonic::transport::server::Connected;

use crate::handle::Peer;

/// How long nothing is accepted after an error: most, such as too many open
/// files, are still there at once, and tonic would try again without a pause.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);
/// What each HTTP/2 client begins with (RFC 9113, 3.4). After it, it is for keepalive to
/// find out whether somebody is there.
const PREFACE: &[u8] = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n";

/// Connections that were accepted by this process.
static ACCEPTED: AtomicU64 = AtomicU64::new(0);

/// What connections are held to.
#[derive(Clone, Copy, Debug)]
pub(super) struct ConnectionLimits {
    /// Connections at one time; more wait in the kernel's backlog.
    pub(super) connections: usize,
    /// How long after it was accepted a connection may take to say which HTTP it speaks, in wall time.
    pub(super) preface: Duration,
    /// Connections of HTTP/1.1 at one time, which are among the others; more are closed. Browsers
    /// keep theirs, six each, and must not keep programs out.
    pub(super) http1: usize,
    /// How long nothing may go over a connection of HTTP/1.1 in either direction. Between two
    /// requests hyper waits for 30 s.
    pub(super) http1_silence: Duration,
}

/// Accepts from `source` within limits. Errors of accepting are logged and not passed on.
pub(super) fn incoming<S, T>(
    source: S,
    limits: ConnectionLimits,
) -> impl Stream<Item = Result<Connection<T>, Infallible>>
where
    S: Stream<Item = io::Result<T>> + Unpin,
{
    let places = Arc::new(Semaphore::new(limits.connections));
    let http1 = Arc::new(Semaphore::new(limits.http1));
    stream::unfold(source, move |mut source| {
        let (places, http1) = (Arc::clone(&places), Arc::clone(&http1));
        async move {
            let place = places.acquire_owned().await.ok()?;
            let io = accept(&mut source).await?;
            Some((Ok(Connection::new(io, place, http1, limits)), source))
        }
    })
}

/// The next connection, however many errors come before it.
async fn accept<S, T>(source: &mut S) -> Option<T>
where
    S: Stream<Item = io::Result<T>> + Unpin,
{
    let mut is_failing = false;
    loop {
        match source.next().await? {
            Ok(io) => return Some(io),
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

/// A connection with its place among those that are served.
#[derive(Debug)]
pub(super) struct Connection<T> {
    io: T,
    /// No other connection has it.
    number: u64,
    speaks: Speaks,
    /// Dropped after `io`, so that there are never more connections than places.
    _place: OwnedSemaphorePermit,
}

/// What is known of the other side.
#[derive(Debug)]
enum Speaks {
    /// It sent so many bytes of the preface.
    Opening { sent: usize, deadline: Pin<Box<Sleep>>, http1: Arc<Semaphore>, silence: Duration },
    /// HTTP/2: it began as that must.
    Http2,
    /// Anything else, which is served as HTTP/1.1.
    Http1 { deadline: Pin<Box<Sleep>>, silence: Duration, _place: OwnedSemaphorePermit },
}

impl<T> Connection<T> {
    fn new(io: T, place: OwnedSemaphorePermit, http1: Arc<Semaphore>, limits: ConnectionLimits) -> Self {
        let deadline = Box::pin(tokio::time::sleep(limits.preface));
        let speaks = Speaks::Opening { sent: 0, deadline, http1, silence: limits.http1_silence };
        Self { io, number: ACCEPTED.fetch_add(1, Ordering::Relaxed), speaks, _place: place }
    }
}

impl Speaks {
    /// Looks at the next bytes of the other side.
    fn heard(&mut self, bytes: &[u8]) -> io::Result<()> {
        let Self::Opening { sent, http1, silence, .. } = self else {
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
        let full = |_| io::Error::other("too many connections of HTTP/1.1");
        let place = Arc::clone(http1).try_acquire_owned().map_err(full)?;
        let silence = *silence;
        *self = Self::Http1 { deadline: Box::pin(tokio::time::sleep(silence)), silence, _place: place };
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
            Self::Opening { deadline, .. } => (deadline, "nobody said which HTTP it is"),
            Self::Http1 { deadline, .. } => (deadline, "nothing came or went for too long"),
        };
        match deadline.as_mut().poll(context) {
            Poll::Pending => Ok(()),
            Poll::Ready(()) => Err(io::Error::new(io::ErrorKind::TimedOut, sentence)),
        }
    }

    /// The result of writing, after a look at the time.
    fn wrote(
        &mut self,
        polled: Poll<io::Result<usize>>,
        context: &mut Context<'_>,
    ) -> Poll<io::Result<usize>> {
        match polled {
            Poll::Ready(_) => self.moved(),
            Poll::Pending => self.check(context)?,
        }
        polled
    }
}

impl<T: AsyncRead + Unpin> AsyncRead for Connection<T> {
    fn poll_read(
        mut self: Pin<&mut Self>,
        context: &mut Context<'_>,
        buffer: &mut ReadBuf<'_>,
    ) -> Poll<io::Result<()>> {
        let Self { io, speaks, .. } = &mut *self;
        let before = buffer.filled().len();
        let polled = Pin::new(io).poll_read(context, buffer);
        match polled {
            Poll::Pending => speaks.check(context)?,
            Poll::Ready(_) => speaks.heard(buffer.filled().get(before..).unwrap_or_default())?,
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
        let Self { io, speaks, .. } = &mut *self;
        let polled = Pin::new(io).poll_write(context, bytes);
        speaks.wrote(polled, context)
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
        let Self { io, speaks, .. } = &mut *self;
        let polled = Pin::new(io).poll_write_vectored(context, slices);
        speaks.wrote(polled, context)
    }

    fn is_write_vectored(&self) -> bool {
        self.io.is_write_vectored()
    }
}

/// Services find in each request by which connection it came.
impl<T> Connected for Connection<T> {
    type ConnectInfo = Peer;

    fn connect_info(&self) -> Peer {
        Peer::Connection(self.number)
    }
}
