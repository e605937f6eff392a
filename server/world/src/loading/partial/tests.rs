//! Uploads in parts, with given times.

use bytes::Bytes;

use super::*;

const COUNT: usize = 64;
const ABANDONED: Duration = Duration::from_secs(60);

fn hash(n: u8) -> Sha256 {
    Sha256([n; 32])
}

fn part(n: u8, total: u64, offset: u64, data: &[u8]) -> FilePart {
    FilePart { sha256: hash(n), total, offset, data: Bytes::copy_from_slice(data) }
}

#[test]
fn parts_in_order_make_a_file() {
    let (mut partials, now) = (Partials::new(&DaemonLimits::default()), Instant::now());
    assert_eq!(
        partials.append(&Account::Process, &part(0, 6, 0, b"abc"), now).unwrap(),
        Progress::Received(3)
    );
    assert_eq!(
        partials.append(&Account::Process, &part(1, 2, 0, b"xy"), now).unwrap(),
        Progress::Complete(b"xy".to_vec())
    );
    assert_eq!(
        partials.append(&Account::Process, &part(0, 6, 3, b"def"), now).unwrap(),
        Progress::Complete(b"abcdef".to_vec())
    );
    assert!(partials.by_hash.is_empty());
    assert_eq!(
        partials.append(&Account::Process, &part(0, 0, 0, b""), now).unwrap(),
        Progress::Complete(Vec::new())
    );
}

#[test]
fn part_zero_restarts_an_upload_and_a_repeated_part_changes_nothing() {
    let (mut partials, now) = (Partials::new(&DaemonLimits::default()), Instant::now());
    partials.append(&Account::Process, &part(0, 6, 0, b"abcd"), now).unwrap();
    assert_eq!(
        partials.append(&Account::Process, &part(0, 6, 0, b"ab"), now).unwrap(),
        Progress::Received(4)
    );
    assert_eq!(
        partials.append(&Account::Process, &part(0, 6, 2, b"cd"), now).unwrap(),
        Progress::Received(4)
    );
    assert_eq!(
        partials.append(&Account::Process, &part(0, 6, 0, b"xyz"), now).unwrap(),
        Progress::Received(3)
    );
    assert_eq!(
        partials.append(&Account::Process, &part(0, 9, 0, b"xyz"), now).unwrap(),
        Progress::Received(3)
    );
}

#[test]
fn parts_that_do_not_fit_are_refused_and_what_is_here_stays() {
    let (mut partials, now) = (Partials::new(&DaemonLimits::default()), Instant::now());
    partials.append(&Account::Process, &part(0, 6, 0, b"abc"), now).unwrap();
    let mut refused = |total, offset, data: &[u8]| {
        partials.append(&Account::Process, &part(0, total, offset, data), now).unwrap_err().to_string()
    };
    assert!(refused(6, 4, b"e").contains("only 3 bytes are here"));
    assert!(refused(6, 3, b"defg").contains("beyond the file's 6 bytes"));
    assert!(refused(6, u64::MAX, b"d").contains("beyond"));
    assert!(refused(7, 3, b"d").contains("was 6 bytes and is 7 now"));
    assert!(refused(6, 2, b"X").contains("not what was sent before"));
    assert_eq!(
        partials.append(&Account::Process, &part(0, 6, 3, b"def"), now).unwrap(),
        Progress::Complete(b"abcdef".to_vec())
    );
}

#[test]
fn an_abandoned_upload_is_forgotten() {
    let (mut partials, now) = (Partials::new(&DaemonLimits::default()), Instant::now());
    partials.append(&Account::Process, &part(0, 6, 0, b"abc"), now).unwrap();
    let refused =
        partials.append(&Account::Process, &part(0, 6, 3, b"def"), now + ABANDONED).unwrap_err().to_string();
    assert!(refused.contains("start again at 0"), "{refused}");
}

#[test]
fn beyond_the_number_the_longest_untouched_upload_goes() {
    let (mut partials, now) = (Partials::new(&DaemonLimits::default()), Instant::now());
    for n in 0..=COUNT as u8 {
        let later = now + Duration::from_millis(n.into());
        partials.append(&Account::Process, &part(n, 6, 0, b"abc"), later).unwrap();
    }
    assert_eq!(partials.by_hash.len(), COUNT);
    assert!(!partials.by_hash.contains_key(&hash(0)));
    assert!(partials.by_hash.contains_key(&hash(1)));
}

#[test]
fn beyond_the_bytes_the_longest_untouched_upload_goes() {
    let mut partials = Partials::new(&DaemonLimits::default());
    let now = Instant::now();
    for n in 0..3 {
        partials
            .append(&Account::Process, &part(n, 6, 0, b"abc"), now + Duration::from_millis(n.into()))
            .unwrap();
    }
    partials.make_room(COUNT, 7, |other, _| *other != hash(0));
    assert!(partials.by_hash.contains_key(&hash(0)), "the one that is being sent stays");
    assert!(!partials.by_hash.contains_key(&hash(1)));
}

#[test]
fn a_client_with_many_uploads_pushes_out_its_own_and_not_those_of_others() {
    let limits = DaemonLimits { uploads: 8, uploads_of_client: 4, ..DaemonLimits::default() };
    let (mut partials, now) = (Partials::new(&limits), Instant::now());
    let mut begin = |name: &str, n: u8| {
        partials.append(&Account::Token(name.into()), &part(n, 6, 0, b"abc"), now).unwrap();
        partials.by_hash.len()
    };
    begin("other", 0);
    let here: Vec<usize> = (1..7).map(|n| begin("flooder", n)).collect();
    assert_eq!(here, [2, 3, 4, 5, 5, 5]);
    assert!(partials.by_hash.contains_key(&hash(0)));
}
