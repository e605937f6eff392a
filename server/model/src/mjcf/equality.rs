//! `<equality>`: joints that follow one another. What holds bodies together is no part of a tree.

use super::Reader;
use super::joint::{Joints, Kind};
use super::value;
use crate::report::Disposition::{Ignored, Repaired};
use crate::translation::element::Element;
use crate::translation::notes::Stop;
use crate::urdf::findings::quoted;

pub(super) fn read<'a>(
    elements: &[Element<'a>],
    reader: &mut Reader<'a>,
    joints: &mut Joints,
) -> Result<(), Stop> {
    for element in elements.iter().copied() {
        if element.word("active") == Some("false") {
            reader.notes.info(element, Ignored, "it is not active; left out");
            continue;
        }
        match element.tag() {
            "joint" => follow(element, reader, joints)?,
            "weld" | "connect" => {
                let bodies = [element.word("body1"), element.word("body2")];
                let named =
                    bodies.map(|body| body.map_or_else(|| "the world".to_owned(), quoted)).join(" and ");
                let message = format!(
                    "no tree holds {named} together: left out; `simctl constraint create` does it once the robots are there"
                );
                reader.notes.warn(element, Ignored, message);
            }
            _ => {
                let message = "not read by simd: the robot is without it";
                reader.notes.warn(element, Ignored, message);
            }
        }
    }
    Ok(())
}

/// q1 - ref1 = c0 + c1 (q2 - ref2) + ...
fn follow<'a>(element: Element<'a>, reader: &mut Reader<'a>, joints: &mut Joints) -> Result<(), Stop> {
    let (Some(follower), Some(leader)) = (element.word("joint1"), element.word("joint2")) else {
        reader.notes.warn(element, Ignored, "it holds one joint in place: left out; give the joint a range");
        return Ok(());
    };
    let known = |name: &str| joints.known.get(name).copied().filter(|(kind, _)| *kind != Kind::Ball);
    let (Some((_, first)), Some((_, second))) = (known(follower), known(leader)) else {
        reader.notes.warn(element, Ignored, "it names a joint that is not there or is a ball: left out");
        return Ok(());
    };
    let equality = reader.classes.of(element, None, ["equality", "equality"]);
    let polynomial = match equality.get("polycoef") {
        Some((at, text)) => value::list(at, "polycoef", text, 5)?,
        None => vec![0.0, 1.0],
    };
    let of = |place: usize| polynomial.get(place).copied().unwrap_or(0.0);
    if (2..5).any(|place| of(place) != 0.0) {
        let message = "joints follow one another by a factor in simd: the first two coefficients are taken";
        reader.notes.warn(element, Repaired, message);
    }
    let (offset, factor) = (of(0), of(1));
    if follower == leader {
        reader.notes.warn(element, Ignored, "a joint does not follow itself: left out");
        return Ok(());
    }
    let mimic = (leader.to_owned(), factor, first + offset - factor * second);
    joints.mimics.insert(follower.to_owned(), mimic);
    Ok(())
}
