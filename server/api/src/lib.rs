//! Services of `simd.v1`, the same for every transport.
//!
//! * [`service`]: the services, and the checks of every call: authorization, limits, retries.
//! * [`publication`]: the published messages.
//! * [`convert`]: wire types to types of the world and back.

pub mod convert;
pub mod publication;
pub mod service;
