//! The simd daemon. A call goes: front-end, [`service`], `convert`, [`SimHandle`], mailbox,
//! driver thread, and back. Modules import downwards only; `ARCHITECTURE.md` has the order.
//!
//! * [`handle`]: the one way to the world, for every front-end.
//! * [`driver`]: the thread that owns the world and its pace.
//! * [`loading`]: descriptions and assets, from uploads and from disk, to robots.
//! * [`recording`]: what happens, into files, and the same again. [`replay`]: `simd replay`.
//! * [`convert`]: wire types to core types and back.
//! * [`service`]: the services of `simd.v1`, once for every transport.
//! * [`grpc`], [`zenoh`], [`http`]: the front-ends.
//! * [`ros2`]: a node on a graph of ROS 2.
//! * [`embedded`]: a world within another program, without a socket.
//! * [`config`]: what the operator can say.
//! * [`access`]: who may call what. [`authority`]: `simd tls`. [`zenoh_acl`]: `simd zenoh-acl`.
//! * `call_error`, `histogram`, `info`, `run_state`: types that all of these use. `blocking_threads`: threads for what takes long.
//! * `account`, `fair_permits`: what each client may have. `process`: what the system says of this process.
//! * [`log`]: lines on stderr, which block no caller.
//! * [`daemon`]: all of it put together, from start to drain.

pub mod authority;
pub mod config;
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
