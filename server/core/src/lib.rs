//! Physics and rules.
