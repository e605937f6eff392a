//! Lines of other crates: one a second of each, since a client may make them log as often as it likes.

use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use tracing::{Level, Metadata};

/// Time between two lines of a crate.
const PAUSE: Duration = Duration::from_secs(1);

/// When each crate logged last, and how many lines were left out since. Names come from code, so their number
/// is bounded.
#[derive(Debug, Default)]
pub(super) struct Foreign(Mutex<HashMap<String, (Instant, u64)>>);

/// Passage of a line through the limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Passage {
    /// It is written, after a note with the number of omitted lines.
    Written(u64),
    LeftOut,
}

impl Foreign {
    pub(super) fn passage(&self, event: &Metadata<'_>, now: Instant) -> Passage {
        // An operator who asks for details gets all of them.
        if *event.level() > Level::INFO {
            return Passage::Written(0);
        }
        self.of_crate(crate_of(event.target()), now)
    }

    fn of_crate(&self, name: &str, now: Instant) -> Passage {
        if name.starts_with("simd") {
            return Passage::Written(0);
        }
        let mut crates = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let Some((last, left_out)) = crates.get_mut(name) else {
            crates.insert(name.to_owned(), (now, 0));
            return Passage::Written(0);
        };
        if now.saturating_duration_since(*last) < PAUSE {
            *left_out += 1;
            return Passage::LeftOut;
        }
        *last = now;
        Passage::Written(std::mem::take(left_out))
    }
}

/// `zenoh_transport` of `zenoh_transport::unicast`.
pub(super) fn crate_of(target: &str) -> &str {
    target.split("::").next().unwrap_or(target)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crate_has_a_line_a_second_and_says_what_it_left_out() {
        let (foreign, begin) = (Foreign::default(), Instant::now());
        let at = |name, ms| foreign.of_crate(name, begin + Duration::from_millis(ms));
        assert_eq!(at("h2", 0), Passage::Written(0));
        assert_eq!([at("h2", 1), at("h2", 999)], [Passage::LeftOut; 2]);
        assert_eq!(at("rustls", 999), Passage::Written(0), "another crate");
        assert_eq!(at("h2", 1_000), Passage::Written(2));
        assert_eq!(at("h2", 2_500), Passage::Written(0));
        assert!((0..100).all(|_| at("simd_server", 0) == Passage::Written(0)));
        assert_eq!(crate_of("zenoh_transport::unicast::link"), "zenoh_transport");
    }
}
