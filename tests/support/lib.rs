//! What the suites share.

pub mod robots;
pub mod statistics;
