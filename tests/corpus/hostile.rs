//! Files made to harm. Each gets an answer, and the test prints how soon.

use std::time::{Duration, Instant};

use simd_model::{LoadLimits, ReadOptions};

use crate::mutations::Nothing;

/// Returns the result of a load, and its duration.
fn answer(urdf: &[u8]) -> (Result<usize, String>, Duration) {
    let start = Instant::now();
    let read = simd_model::read(urdf, &Nothing, &ReadOptions::default());
    let outcome = read.map(|(model, _)| model.links.len()).map_err(|refused| refused.message);
    let took = start.elapsed();
    let start = Instant::now();
    drop(simd_model::describe(urdf, &LoadLimits::default()));
    (outcome, took.max(start.elapsed()))
}

fn robot(content: &str) -> String {
    format!("<robot name='r'><link name='a'/>{content}</robot>")
}

fn times(count: usize, of: impl Fn(usize) -> String) -> String {
    (0..count).map(of).collect()
}

/// Whole of the allowed bytes, filled with something.
fn filled(with: &str) -> String {
    robot(&with.repeat((LoadLimits::default().urdf_bytes - 100) / with.len()))
}

/// 1,000 links in a chain, with something in each joint.
fn chain(of: impl Fn(usize) -> String) -> String {
    let joint = |i: usize| {
        let (next, content) = (i + 1, of(i));
        format!(
            "<joint name='j{i}' type='continuous'><parent link='l{i}'/><child link='l{next}'/>{content}</joint>"
        )
    };
    format!(
        "<robot name='r'>{}{}</robot>",
        times(1000, |i| format!("<link name='l{i}'/>")),
        times(999, joint)
    )
}

/// Names and files. Large, so they are made when it is their turn.
type Made = fn() -> String;

const FILES: [(&str, Made); 26] = [
    ("200,000 levels of elements", || robot(&("<x>".repeat(200_000) + &"</x>".repeat(200_000)))),
    ("a million open elements", || "<robot>".repeat(1_000_000)),
    ("a root that begins again and again", || "<robot name='r'".repeat(1_000_000)),
    ("an attribute a million times", || format!("<robot{}/>", times(1_000_000, |i| format!(" a{i}=''")))),
    ("an attribute of 16 MB", || robot(&format!("<x a='{}'/>", "y".repeat(16_000_000)))),
    ("a comment of 16 MB", || robot(&format!("<!--{}-->", "<a b='c'>".repeat(1_700_000)))),
    ("a million comments", || robot(&"<!-- -->".repeat(1_000_000))),
    ("a comment that does not end", || robot("<!--").repeat(1000) + &"-".repeat(15_000_000)),
    ("a section that does not end", || robot(&("<![CDATA[".to_owned() + &"]]".repeat(7_000_000)))),
    ("16 MB of opening brackets", || "<".repeat(16_000_000)),
    ("16 MB of closing brackets", || ">".repeat(16_000_000)),
    ("16 MB of ampersands", || robot(&"&".repeat(16_000_000))),
    ("16 MB of entities", || filled("&amp;&#x41;")),
    ("the billion laughs", || {
        let entity = |i: usize| format!("<!ENTITY a{} '{}'>", i + 1, format!("&a{i};").repeat(10));
        format!(
            "<!DOCTYPE r [<!ENTITY a0 'ha'>{}]><robot name='&a9;'><link name='a'/></robot>",
            times(9, entity)
        )
    }),
    ("a million declarations", || "<?xml version='1.0'?>\n".repeat(700_000) + &robot("")),
    ("200 namespaces on the root and a robot in none", || {
        let names = times(200, |i| format!(" xmlns:n{i}='u{i}'"));
        format!("<robot name='r'{names}>{}</robot>", "<link/>".repeat(200_000))
    }),
    ("200,000 undeclared prefixes", || robot(&times(200_000, |i| format!("<p{i}:x/>")))),
    ("240,000 links", || {
        format!("<robot name='r'>{}</robot>", times(240_000, |i| format!("<link name='l{i}'/>")))
    }),
    ("a link of 9,000 materials", || {
        let visual = |i: usize| {
            format!("<visual><geometry><sphere radius='1'/></geometry><material name='m{i}'/></visual>")
        };
        format!("<robot name='r'><link name='a'>{}</link></robot>", times(9_000, visual))
    }),
    ("100,000 materials", || {
        robot(&times(100_000, |i| format!("<material name='m{i}'><color rgba='1 1 1 1'/></material>")))
    }),
    ("a chain of 1,000 links", || chain(|_| String::new())),
    ("a chain of 1,000 links of which each joint follows the one before", || {
        chain(|i| if i > 0 { format!("<mimic joint='j{}'/>", i - 1) } else { String::new() })
    }),
    ("1,000 joints that follow one another in one circle", || {
        chain(|i| format!("<mimic joint='j{}'/>", (i + 1) % 999))
    }),
    ("1,000 joints of one name", || {
        chain(|_| String::new()).replace("<joint name='j", "<joint name='j' x='")
    }),
    ("60,000 elements for Gazebo", || {
        robot(&"<gazebo reference='a'><mu1>1</mu1><x/></gazebo>".repeat(60_000))
    }),
    ("a number of 16 MB", || {
        robot(&format!(
            "<joint name='j' type='fixed'><parent link='a'/><child link='a'/><origin xyz='{} 0 0'/></joint>",
            "1".repeat(15_000_000)
        ))
    }),
];

/// Far more than any of them takes: a file that needs longer hangs the daemon.
const HUNG: Duration = Duration::from_secs(300);

#[test]
fn each_hostile_file_is_answered() {
    for (what, make) in FILES {
        let (outcome, took) = answer(make().as_bytes());
        let outcome = outcome.map_or_else(|why| why, |links| format!("{links} links"));
        println!("{took:>10.1?} {what}: {outcome}");
        assert!(took < HUNG, "{what}: {took:?}");
    }
}

#[test]
fn bytes_of_any_kind_are_answered() {
    let mut random = fastrand::Rng::with_seed(7);
    for length in [0, 1, 2, 3, 4, 100, 10_000, 1_000_000] {
        for head in
            [&b""[..], b"<", b"<robot", b"\xff\xfe", b"\xfe\xff", b"\xef\xbb\xbf", b"solid ", b"\0<\0r"]
        {
            let bytes: Vec<u8> = head.iter().copied().chain((0..length).map(|_| random.u8(..))).collect();
            assert!(answer(&bytes).0.is_err());
        }
    }
}
