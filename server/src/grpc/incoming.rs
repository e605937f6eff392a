//! The connections that are served: so many at one time, and none that is silent from the start.

use std::convert::Infallible;
use std::io;
use std::pin::Pin;
use std::sync::Arc;
use std::task::{Context, Poll};
use std::time::Duration;

use futures_util::stream;
use tokio::io::{AsyncRead, AsyncWrite, ReadBuf};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio::time::Sleep;
use tokio_stream::{Stream, StreamExt as _};
use tonic::transport::server::Connected;

/// How long nothing is accepted after an error: most, such as too many open
/// files, are still there at once, and tonic would try again without a pause.
const ACCEPT_PAUSE: Duration = Duration::from_millis(50);
/// Length of what each HTTP/2 client begins with (RFC 9113, 3.4). After it, it is
/// for keepalive to find out whether somebody is there.
const PREFACE_BYTES: usize = 24;

/// What connections are held to.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limits {
    /// Connections at one time; more wait in the kernel's backlog.
    pub(super) connections: usize,
    /// How long after it was accepted a connection may take to send its preface, in wall time.
    pub(super) preface: Duration,
}

/// Accepts from `source` within limits. Errors of accepting are logged and not passed on.
pub(super) fn incoming<S, T>(
    source: S,
    limits: Limits,
) -> impl Stream<Item = Result<Connection<T>, Infallible>>
where
    S: Stream<Item = io::Result<T>> + Unpin,
{
    let places = Arc::new(Semaphore::new(limits.connections));
    stream::unfold(source, move |mut source| {
        let places = Arc::clone(&places);
        async move {
            let place = places.acquire_owned().await.ok()?;
            let io = accept(&mut source).await?;
            Some((Ok(Connection::new(io, place, limits.preface)), source))
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
    /// None once the preface has come.
    opening: Option<Opening>,
    /// Dropped after `io`, so that there are never more connections than places.
    _place: OwnedSemaphorePermit,
}

/// What a connection still owes.
#[derive(Debug)]
struct Opening {
    missing_bytes: usize,
    deadline: Pin<Box<Sleep>>,
}

impl<T> Connection<T> {
    fn new(io: T, place: OwnedSemaphorePermit, preface: Duration) -> Self {
        let deadline = Box::pin(tokio::time::sleep(preface));
        Self { io, opening: Some(Opening { missing_bytes: PREFACE_BYTES, deadline }), _place: place }
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
        let Some(opening) = &mut self.opening else { return polled };
        if polled.is_pending() {
            let late = || Err(io::Error::new(io::ErrorKind::TimedOut, "no HTTP/2 preface came"));
            return opening.deadline.as_mut().poll(context).map(|()| late());
        }
        let read = buffer.filled().len().saturating_sub(before);
        opening.missing_bytes = opening.missing_bytes.saturating_sub(read);
        if opening.missing_bytes == 0 {
            self.opening = None;
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
        Pin::new(&mut self.io).poll_write(context, bytes)
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
        Pin::new(&mut self.io).poll_write_vectored(context, slices)
    }

    fn is_write_vectored(&self) -> bool {
        self.io.is_write_vectored()
    }
}

impl<T: Connected> Connected for Connection<T> {
    type ConnectInfo = T::ConnectInfo;

    fn connect_info(&self) -> Self::ConnectInfo {
        self.io.connect_info()
    }
}
