//! The world as a service: the thread that owns it, and [`SimHandle`], the only way to it. This crate knows
//! no transport. Modules import downwards only:
//!
//! * [`handle`]: all requests to the world, in plain types.
//! * [`recording`]: recordings and their replay.
//! * [`loading`]: robots from descriptions and assets, uploaded or on disk.
//! * [`driver`]: the thread that owns the world and its pace.
//! * [`fair_permits`]: permits that clients get round robin.
//! * [`unread_answers`]: answers that clients have yet to read.
//! * [`call_error`]: errors of calls.
//! * [`access`]: tokens and roles. [`account`]: the client that a call counts for.
//! * [`blocking_threads`]: threads for work that blocks. [`process`]: memory and files of this process.
//! * [`histogram`], [`info`], [`run_state`]: shared types.

pub mod access;
pub mod account;
pub mod blocking_threads;
pub mod call_error;
pub mod driver;
pub mod fair_permits;
pub mod handle;
pub mod histogram;
pub mod info;
pub mod loading;
pub mod process;
pub mod recording;
pub mod run_state;
pub mod unread_answers;

pub use handle::SimHandle;
