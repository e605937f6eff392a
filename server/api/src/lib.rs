//! The services of `simd.v1`, the same for every transport.
//!
//! * [`service`]: the services, and what every call passes: authorization, limits, retries.
//! * [`publication`]: the messages that are published.
//! * [`convert`]: wire types to types of the world and back.

pub mod convert;
pub mod publication;
pub mod service;
