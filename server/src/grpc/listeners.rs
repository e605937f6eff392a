//! Listeners: a port, and optionally a Unix socket for clients of the same machine.

use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::os::unix::fs::{FileTypeExt as _, MetadataExt as _, PermissionsExt as _};
use std::path::{Path, PathBuf};
use std::time::Duration;

use tokio::net::{TcpListener, TcpSocket, TcpStream, UnixListener, UnixStream};
use tokio_stream::{Stream, StreamExt as _};
use tonic::transport::server::TcpIncoming;

/// Time of silence before the kernel probes a connection, and between two probes.
const KEEPALIVE_INTERVAL: Duration = Duration::from_secs(20);
/// Number of unanswered probes after which the other side counts as gone.
const KEEPALIVE_PROBES: u32 = 3;

/// Mode of a Unix socket, regardless of the umask: the daemon's user and its group.
const SOCKET_MODE: u32 = 0o660;

/// Number of connections that may wait at a Unix socket to be accepted.
const WAITING: u32 = 1024;
/// Maximum length of a Unix socket's path, bytes: one less than `sockaddr_un` holds.
const LONGEST_PATH: usize = 107;

/// Listeners of a daemon.
#[derive(Debug)]
pub struct Listeners {
    /// Listener of gRPC, gRPC-Web and the page.
    pub tcp: TcpListener,
    /// Listener of the same without TLS: the file's permissions control access.
    pub unix: Option<UnixSocket>,
}

impl Listeners {
    /// Moves the listeners to the calling runtime.
    pub(super) fn moved_here(self) -> io::Result<Self> {
        let Self { tcp, unix } = self;
        Ok(Self {
            tcp: TcpListener::from_std(tcp.into_std()?)?,
            unix: unix.map(UnixSocket::moved_here).transpose()?,
        })
    }
}

/// Listens at an address of TCP.
///
/// # Errors
/// Returns an error if the address cannot be taken.
pub fn listen(address: SocketAddr) -> io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4()? } else { TcpSocket::new_v6()? };
    // A daemon takes the port of the one that ended before it.
    socket.set_reuseaddr(true)?;
    socket.bind(address)?;
    socket.listen(WAITING)
}

/// A Unix socket, whose file goes with it.
#[derive(Debug)]
pub struct UnixSocket {
    listener: UnixListener,
    _file: SocketFile,
}

/// The file of a Unix socket, deleted when this is dropped.
#[derive(Debug)]
struct SocketFile {
    path: PathBuf,
    /// Device and inode, which distinguish it from a later file of another process.
    identity: (u64, u64),
}

impl UnixSocket {
    /// Makes the socket. It replaces a file that a killed daemon left behind.
    ///
    /// # Errors
    /// Returns an error with a remedy if a process listens there, another file exists there, or the file
    /// cannot be created.
    pub fn bind(path: &Path) -> io::Result<Self> {
        if is_abandoned(path) {
            std::fs::remove_file(path)?;
        }
        let socket = tokio::net::UnixSocket::new_stream()?;
        socket.bind(path).map_err(|error| explained(path, error))?;
        // Set before it listens, so that no other user connects in between.
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(SOCKET_MODE))?;
        let file = SocketFile { path: path.to_owned(), identity: identity(path)? };
        Ok(Self { listener: socket.listen(WAITING)?, _file: file })
    }

    /// Moves the socket to the calling runtime.
    fn moved_here(self) -> io::Result<Self> {
        Ok(Self { listener: UnixListener::from_std(self.listener.into_std()?)?, ..self })
    }

    /// Returns its connections, which count as connections from the loopback address.
    pub(super) fn accepted(
        &mut self,
    ) -> impl Stream<Item = io::Result<(UnixStream, IpAddr)>> + Unpin + use<'_> {
        futures_util::stream::poll_fn(|context| {
            let accepted = std::task::ready!(self.listener.poll_accept(context));
            std::task::Poll::Ready(Some(accepted.map(|(io, _)| (io, Ipv4Addr::LOCALHOST.into()))))
        })
    }
}

impl Drop for SocketFile {
    fn drop(&mut self) {
        if identity(&self.path).is_ok_and(|file| file == self.identity) {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

/// Adds a remedy to errors whose text from the system does not explain it.
fn explained(path: &Path, error: io::Error) -> io::Error {
    let is_folder = |folder: &Path| folder.as_os_str().is_empty() || folder.is_dir();
    let length = path.as_os_str().len();
    let words = match error.kind() {
        io::ErrorKind::AddrInUse if is_socket(path) => {
            "another process listens there; end that, or name another path".to_owned()
        }
        io::ErrorKind::AddrInUse => {
            "the path exists and is not a socket; delete it, or name another path".to_owned()
        }
        _ if length > LONGEST_PATH => {
            format!(
                "the path has {length} bytes, and the path of a socket may have {LONGEST_PATH}; name a \
                 shorter one"
            )
        }
        io::ErrorKind::NotFound if path.parent().is_some_and(|folder| !is_folder(folder)) => {
            "its folder is not there; make it, or name another path".to_owned()
        }
        _ => return error,
    };
    io::Error::new(error.kind(), words)
}

fn is_socket(path: &Path) -> bool {
    std::fs::symlink_metadata(path).is_ok_and(|file| file.file_type().is_socket())
}

/// Returns whether this is a socket at which no process listens.
fn is_abandoned(path: &Path) -> bool {
    let refuses = || {
        let connected = std::os::unix::net::UnixStream::connect(path);
        connected.is_err_and(|error| error.kind() == io::ErrorKind::ConnectionRefused)
    };
    is_socket(path) && refuses()
}

fn identity(path: &Path) -> io::Result<(u64, u64)> {
    std::fs::symlink_metadata(path).map(|file| (file.dev(), file.ino()))
}

/// Returns connections over TCP, with the clients' addresses.
pub(super) fn accepted(listener: TcpListener) -> impl Stream<Item = io::Result<(TcpStream, IpAddr)>> + Unpin {
    let accepted = TcpIncoming::from(listener)
        .with_nodelay(Some(true))
        .with_keepalive(Some(KEEPALIVE_INTERVAL))
        .with_keepalive_interval(Some(KEEPALIVE_INTERVAL))
        .with_keepalive_retries(Some(KEEPALIVE_PROBES));
    accepted.filter_map(|accepted| match accepted {
        // A connection without an address has already ended.
        Ok(io) => io.peer_addr().ok().map(|address| Ok((io, address.ip()))),
        Err(error) => Some(Err(error)),
    })
}

/// A connection that can be moved to another runtime.
pub(super) trait Movable: Send + 'static {
    /// Moves the connection to the calling runtime.
    fn moved_here(self) -> io::Result<Self>
    where
        Self: Sized;
}

impl Movable for TcpStream {
    fn moved_here(self) -> io::Result<Self> {
        Self::from_std(self.into_std()?)
    }
}

impl Movable for UnixStream {
    fn moved_here(self) -> io::Result<Self> {
        Self::from_std(self.into_std()?)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn a_socket_that_was_left_behind_is_replaced_and_one_in_use_is_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("simd.sock");
        // The standard library's listener does not delete its file.
        drop(std::os::unix::net::UnixListener::bind(&path).unwrap());
        let first = UnixSocket::bind(&path).unwrap();
        assert_eq!(std::fs::metadata(&path).unwrap().permissions().mode() & 0o777, SOCKET_MODE);
        let refused = UnixSocket::bind(&path).unwrap_err();
        assert_eq!(refused.kind(), io::ErrorKind::AddrInUse);
        assert_eq!(refused.to_string(), "another process listens there; end that, or name another path");
        drop(first);
        assert!(!path.exists(), "the file goes with the socket");
    }

    #[tokio::test]
    async fn hundreds_of_clients_wait_to_be_accepted() {
        let listener = listen("127.0.0.1:0".parse().unwrap()).unwrap();
        let address = listener.local_addr().unwrap();
        let connect = || std::net::TcpStream::connect_timeout(&address, Duration::from_secs(5));
        // The standard library's listener has room for 128.
        let waiting: Vec<_> = (0..300).map(|_| connect().unwrap()).collect();
        assert_eq!(waiting.len(), 300);
    }

    #[tokio::test]
    async fn a_path_at_which_no_socket_can_be_is_refused_with_what_to_do() {
        let folder = tempfile::tempdir().unwrap();
        let refused = |name: &str| UnixSocket::bind(&folder.path().join(name)).unwrap_err().to_string();
        let long = refused(&"x".repeat(120));
        assert!(long.ends_with("and the path of a socket may have 107; name a shorter one"), "{long}");
        assert_eq!(refused("none/simd.sock"), "its folder is not there; make it, or name another path");
        std::fs::create_dir(folder.path().join("simd.sock")).unwrap();
        assert_eq!(
            refused("simd.sock"),
            "the path exists and is not a socket; delete it, or name another path"
        );
    }

    #[tokio::test]
    async fn a_file_that_is_not_a_socket_of_this_daemon_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("simd.sock");
        let socket = UnixSocket::bind(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        std::fs::write(&path, "another's").unwrap();
        drop(socket);
        assert!(path.exists());
        UnixSocket::bind(&path).unwrap_err();
        assert_eq!(std::fs::read(&path).unwrap(), b"another's");
    }
}
