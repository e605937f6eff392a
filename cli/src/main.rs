//! simctl.

fn main() {}
