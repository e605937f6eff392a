//! Cameras keep to their share of the bytes per second.

use super::*;

const SECOND: Duration = Duration::from_secs(1);

/// Returns the number of pictures of this size that are written in ten seconds, if one comes each `period`.
fn written(bytes: u64, period: Duration, bytes_per_second: f64) -> u64 {
    let (begin, mut share, mut written) = (Instant::now(), Share::default(), 0);
    let mut at = Duration::ZERO;
    while at < 10 * SECOND {
        if share.is_free(begin + at) {
            share.take(bytes, bytes_per_second, begin + at);
            written += 1;
        }
        at += period;
    }
    written
}

#[test]
fn pictures_within_the_bytes_of_a_second_are_all_written_and_of_others_as_many_as_fit() {
    let period = Duration::from_millis(40);
    assert_eq!(written(1_000, period, 30_000.0), 250);
    let fitting = written(1_000, period, 10_000.0);
    // Ten per second, and the first one.
    assert!((90..=101).contains(&fitting), "{fitting}");
}

#[test]
fn a_picture_of_more_than_a_second_has_is_written_and_the_next_one_waits_for_it() {
    let fitting = written(30_000, Duration::from_millis(10), 10_000.0);
    assert!((3..=5).contains(&fitting), "{fitting}");
}

#[test]
fn waiting_counts_for_one_picture_alone() {
    let (begin, mut share) = (Instant::now(), Share::default());
    share.take(1_000, 1_000.0, begin);
    assert!(!share.is_free(begin + SECOND / 2) && share.is_free(begin + SECOND));
    // After a minute, two are written at once, but not a third one.
    let later = begin + 60 * SECOND;
    share.take(1_000, 1_000.0, later);
    assert!(share.is_free(later));
    share.take(1_000, 1_000.0, later);
    assert!(!share.is_free(later));
}

#[test]
fn no_camera_waits_for_longer_than_ten_minutes() {
    for bytes_per_second in [1e-300, 1.0] {
        let (now, mut share) = (Instant::now(), Share::default());
        share.take(u64::MAX, bytes_per_second, now);
        assert!(!share.is_free(now + 599 * SECOND) && share.is_free(now + 600 * SECOND));
    }
}

#[test]
fn a_camera_says_what_there_is_of_it() {
    let camera = |drawn, recorded, left_out| Recorded { drawn, recorded, left_out, ..Recorded::default() };
    assert_eq!(camera(None, 0, 0).summary(), "no picture of it was drawn");
    assert_eq!(camera(Some(9), 3, 0).summary(), "3 pictures");
    assert_eq!(camera(Some(9), 3, 6).summary(), "3 pictures; 6 more were drawn and left out");
    let large = Recorded { is_too_large: true, ..camera(Some(9), 0, 9) };
    assert_eq!(large.summary(), "its pictures are too large for a recording");
}
