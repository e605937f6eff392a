//! Collision filters of an SRDF.

use super::{Severity, read_text};
use crate::limits::LoadLimits;
use crate::robot::RobotModel;
use crate::urdf::{Refused, Srdf, SrdfPair, read_srdf};

fn arm() -> RobotModel {
    let links: String =
        ["base", "upper", "fore", "hand"].map(|name| format!("<link name='{name}'/>")).concat();
    let joint = |parent: &str, child: &str| {
        format!("<joint name='{child}' type='fixed'><parent link='{parent}'/><child link='{child}'/></joint>")
    };
    let joints = [joint("base", "upper"), joint("upper", "fore"), joint("fore", "hand")].concat();
    read_text(&format!("<robot name='arm'>{links}{joints}</robot>")).unwrap().0
}

fn read(content: &str, strict: bool) -> Result<Srdf, Refused> {
    let srdf = format!("<?xml version='1.0'?>\n<robot name='arm'>\n{content}</robot>");
    read_srdf(srdf.as_bytes(), &arm(), strict, &LoadLimits::default())
}

fn pair(a: &str, b: &str, enabled: bool) -> SrdfPair {
    SrdfPair { links: [a.into(), b.into()], enabled }
}

#[test]
fn pairs_are_switched_off_whichever_link_comes_first() {
    let srdf = read(
        "<group name='all'><chain base_link='base' tip_link='hand'/></group>\n\
         <disable_collisions link1='fore' link2='upper' reason='Adjacent'/>\n\
         <disable_collisions link1='base' link2='hand' reason='Never'/>\n\
         <disable_collisions link1='upper' link2='fore'/>\n",
        true,
    )
    .unwrap();
    assert_eq!(srdf.pairs, [pair("base", "hand", false), pair("upper", "fore", false)]);
    assert_eq!(srdf.report.findings[0].message, "2 pairs of links switched off");
    assert_eq!(srdf.report.findings[0].element, "SRDF robot");
}

#[test]
fn a_link_is_switched_off_with_all_others_and_pairs_of_it_on_again() {
    let srdf =
        read("<enable_collisions link1='hand' link2='base'/><disable_default_collisions link='hand'/>", true)
            .unwrap();
    let expected = [pair("base", "hand", true), pair("upper", "hand", false), pair("fore", "hand", false)];
    assert_eq!(srdf.pairs, expected);
}

#[test]
fn links_that_the_robot_lacks_are_warned_of_by_line_and_left_out() {
    let content = "<disable_collisions link1='base' link2='hook'/>\n<disable_collisions link1='base'/>\n\
                   <disable_collisions link1='base' link2='base'/>\n";
    let srdf = read(content, false).unwrap();
    assert_eq!(srdf.pairs, []);
    let warnings: Vec<_> =
        srdf.report.at_least(Severity::Warning).map(|finding| (finding.line, &*finding.message)).collect();
    let expected = [
        (Some(3), "the robot has no link \"hook\"; left out"),
        (Some(4), "it has no link2; left out"),
        (Some(5), "it names one link twice; left out"),
    ];
    assert_eq!(warnings, expected);
    let refused = read(content, true).unwrap_err().to_string();
    assert!(refused.contains("SRDF disable_collisions") || refused.starts_with("SRDF: "), "{refused}");
    assert!(refused.contains("hook") && refused.contains("2 more"), "{refused}");
}

#[test]
fn other_texts_than_srdf_are_refused() {
    let refusal =
        |bytes: &[u8]| read_srdf(bytes, &arm(), false, &LoadLimits::default()).unwrap_err().to_string();
    assert!(refusal(b"<sdf/>").contains("this is not an SRDF"));
    assert!(refusal(b"<robot>").contains("the XML is broken"));
    assert!(refusal(b"\x89PNG\r\n").contains("this is not an SRDF"));
    assert!(refusal(b"\xff\xfe\x01").starts_with("SRDF: the SRDF is"), "bytes that are not text");
    let deep = "<a>".repeat(5_000) + &"</a>".repeat(5_000);
    assert!(refusal(format!("<robot>{deep}</robot>").as_bytes()).contains("nested deeper"));
    let many = "<disable_collisions/>".repeat(300_000);
    assert!(refusal(format!("<robot>{many}</robot>").as_bytes()).contains("more than 250000 XML nodes"));
}
