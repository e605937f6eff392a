//! The world as a service: the thread that owns it, and [`SimHandle`], the one way to it. Nothing here knows a
//! transport. Modules import downwards only:
//!
//! * [`handle`]: what can be asked of the world, in plain types.
//! * [`recording`]: recordings and their replay.
//! * [`loading`]: descriptions and assets, from uploads and from disk, to robots.
//! * [`driver`]: the thread that owns the world and its pace.
//! * [`fair_permits`]: permits that clients get round robin.
//! * [`unread_answers`]: answers that clients have yet to read.
//! * [`call_error`]: why a call is refused.
//! * [`access`]: tokens and roles. [`account`]: the client that a call counts for.
//! * [`blocking_threads`]: threads for work that blocks. [`process`]: memory and files of this process.
//! * [`files`]: files as the daemon opens them.
//! * [`histogram`], [`info`], [`run_state`]: types that the others share.

pub mod access;
pub mod account;
pub mod blocking_threads;
pub mod call_error;
pub mod driver;
pub mod fair_permits;
pub mod files;
pub mod handle;
pub mod histogram;
pub mod info;
pub mod loading;
pub mod process;
pub mod recording;
pub mod run_state;
pub mod unread_answers;

pub use handle::SimHandle;
