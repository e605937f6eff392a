//! The simd daemon: transports, configuration, the process. A call passes the front-end, `simd_api::service`,
//! `simd_api::convert`, `simd_world::SimHandle`, the mailbox and the driver thread, and its answer returns
//! the same way. Modules import downwards only:
//!
//! * [`embedded`]: a world within another program, without a socket.
//! * [`daemon`]: the whole daemon, from start to drain.
//! * [`grpc`]: services over HTTP/2 and gRPC-Web, and the port.
//! * `connect`: the services in JSON.
//! * [`http`], [`zenoh`], [`ros2`]: the page, Zenoh, a node on a ROS 2 graph. `absent` replaces the last two
//!   in a build without their features.
//! * [`replay`]: `simd replay`. [`zenoh_acl`]: `simd zenoh-acl`.
//! * [`config`]: flags, variables and the configuration file.
//! * [`authority`]: `simd tls`. [`log`]: lines on stderr, which block no caller.
//! * `subcommand`: parsing of subcommands' arguments.

pub mod authority;
pub mod config;
mod connect;
pub mod daemon;
pub mod embedded;
pub mod grpc;
pub mod http;
pub mod log;
pub mod replay;
#[cfg(feature = "ros2")]
pub mod ros2;
#[cfg(not(feature = "ros2"))]
#[path = "absent/ros2.rs"]
pub mod ros2;
mod subcommand;
#[cfg(feature = "zenoh")]
pub mod zenoh;
#[cfg(not(feature = "zenoh"))]
#[path = "absent/zenoh.rs"]
pub mod zenoh;
pub mod zenoh_acl;
