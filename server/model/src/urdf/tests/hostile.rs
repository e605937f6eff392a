//! Malicious files: each is refused quickly.

use std::time::{Duration, Instant};

use super::*;

/// A bound only for hangs, since the machine may be busy.
fn soon(urdf: &str) -> String {
    let start = Instant::now();
    let message = refusal(urdf);
    assert!(start.elapsed() < Duration::from_secs(300), "{:?}", start.elapsed());
    message
}

#[test]
fn elements_nested_50_000_deep_are_refused() {
    let deep =
        format!("<robot name='r'><link name='a'/>{}{}</robot>", "<a>".repeat(50_000), "</a>".repeat(50_000));
    assert_eq!(soon(&deep), "line 1: elements are nested deeper than 100 levels");
    let unclosed = "<robot>".repeat(50_000);
    assert!(soon(&unclosed).contains("the XML is broken"));
}

#[test]
fn an_element_with_200_000_attributes_is_refused() {
    let attributes: String = (0..200_000).map(|i| format!(" a{i}='1'")).collect();
    let message = soon(&format!("<robot name='r'>\n<link name='a'{attributes}/></robot>"));
    assert!(message.starts_with("line 2: an element has some 200001 attributes"), "{message}");
    let behind = format!("<robot name='r'><link name='>'{attributes}/></robot>");
    assert!(soon(&behind).contains("attributes"));
}

#[test]
fn namespaces_without_end_are_refused() {
    let elements: String = (0..100_000).map(|i| format!("<a xmlns:n{i}='{i}'>")).collect();
    assert!(soon(&format!("<robot>{elements}")).contains("100000 namespaces are declared"));
    let prefixes: String = (0..100).map(|i| format!("<p{i}:a/>")).collect();
    assert!(soon(&format!("<robot name='r'><link name='a'/>{prefixes}</robot>")).contains("namespace"));
}

#[test]
fn the_billion_laughs_are_refused_unread() {
    let urdf = "<?xml version='1.0'?><!DOCTYPE robot [<!ENTITY a 'ha'><!ENTITY b '&a;&a;&a;&a;'>]>\
        <robot name='&b;'><link name='a'/></robot>";
    assert!(soon(urdf).contains("DTD"));
}

#[test]
fn more_nodes_links_or_shapes_than_the_cap_are_refused_with_both_numbers() {
    let nodes = format!("<robot name='r'><link name='a'/>{}</robot>", "<a/>".repeat(300_000));
    assert_eq!(soon(&nodes), "the URDF has more than 250000 XML nodes");
    let links: String = (0..1001).map(|i| format!("<link name='l{i}'/>")).collect();
    assert!(soon(&format!("<robot name='r'>{links}</robot>")).contains("1001 links; the limit is 1000"));
    let shapes = "<visual/>".repeat(10_001);
    let message = soon(&format!("<robot name='r'><link name='a'>{shapes}</link></robot>"));
    assert!(message.contains("10001 shapes; the limit is 10000"), "{message}");
}

#[test]
fn a_file_above_the_size_cap_is_refused_with_both_numbers() {
    let bytes = vec![b' '; (16 << 20) + 1];
    let message = read(&bytes, &Files::default(), &ReadOptions::default()).unwrap_err().message;
    assert_eq!(message, "the URDF has 16777217 bytes; the limit is 16777216");
}

#[test]
fn endless_names_are_refused_and_not_repeated() {
    let name = "x".repeat(100_000);
    let message = soon(&format!("<robot name='r'><link name='{name}'/></robot>"));
    assert!(message.contains("name has 100000 bytes; the limit is 1024"), "{message}");
    assert!(message.len() < 300);
    assert!(refusal("<robot name='r'><link name='a&#10;b'/></robot>").contains("control character"));
}

#[test]
fn findings_without_end_are_counted_and_hide_no_warning() {
    let shape = "<link name='a'><visual/></link>";
    let urdf = format!("<robot name='r'>{}{shape}</robot>", "<gazebo/>".repeat(5000));
    let (_, report) = robot(&urdf);
    let ignored = report
        .findings
        .iter()
        .filter(|it| it.disposition == Disposition::Ignored && it.severity == Severity::Info)
        .count();
    assert_eq!(ignored, 1001);
    find(&report, "4001 more findings like these are left out");
    assert_eq!(warnings(&report), ["it has no usable geometry, and is ignored"]);
}

#[test]
fn sixteen_megabytes_of_attributes_are_read_or_refused_soon() {
    let attributes: String = (0..120).map(|i| format!(" a{i}=''")).collect();
    let element = format!("<gazebo{attributes}/>");
    let filled = |element: &str| {
        format!("<robot name='r'>{}</robot>", element.repeat(((16 << 20) - 64) / element.len()))
    };
    soon(&filled(&element));
    soon(&filled(&format!("<link{attributes}/>")));
    assert!(soon(&filled("<a/>")).contains("XML nodes"));
    assert!(soon(&filled("<!---->")).contains("XML nodes"));
    assert!(soon(&filled("&amp;&#65;")).contains("no links"));
}

#[test]
fn a_chain_of_1000_links_is_read() {
    let links: String = (0..1000).map(|i| format!("<link name='l{i}'/>")).collect();
    let joint = |i: usize| {
        format!("<joint name='j{i}' type='fixed'><parent link='l{i}'/><child link='l{}'/></joint>", i + 1)
    };
    let joints: String = (0..999).map(joint).collect();
    let (model, _) = robot(&format!("<robot name='r'>{links}{joints}</robot>"));
    assert_eq!(model.links[999].name, "l999");
}

/// A deterministic random generator (Marsaglia, "Xorshift RNGs", 2003).
struct Xorshift(u64);

impl Xorshift {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % end as u64) as usize
    }
}

#[test]
fn files_with_random_damage_are_read_or_refused_but_never_panic() {
    let whole = one_joint(
        "revolute",
        "<origin xyz='1 2 3' rpy='0 0 1'/><axis xyz='0 0 1'/><limit lower='-1' upper='1' effort='2' velocity='3'/>\
         <dynamics damping='1' friction='2'/>",
    )
    .replace("</link>", "<visual><geometry><mesh filename='m.stl' scale='1 1 1'/></geometry></visual>\
        <collision><geometry><box size='1 2 3'/></geometry></collision></link>");
    let scraps = [
        "<", ">", "/", "'", "\"", "&", "-", "9", "e", "NaN", "<!--", "]]>", "<a>", "\u{0}", "é", "='' ",
        "<x:y/>",
    ];
    let mut random = Xorshift(0x5eed);
    let mut read = 0;
    for _ in 0..4000 {
        let mut bytes = whole.clone().into_bytes();
        for _ in 0..=random.below(3) {
            let start = random.below(bytes.len());
            let end = (start + random.below(6)).min(bytes.len());
            let scrap = scraps[random.below(scraps.len())];
            bytes.splice(start..end, scrap.bytes());
        }
        read += usize::from(super::read(&bytes, &Files::default(), &ReadOptions::default()).is_ok());
    }
    assert!(read > 100, "damage that is small is read: {read}");
}
