//! `gravcomp`: bodies whose weight something else carries.
//!
//! MuJoCo pushes such a body upwards. In simd an actuator holds the weight of all links beyond its joint, so
//! this is read for joints that carry only compensated bodies.

use super::body::Body;
use super::joint::Joints;
use crate::report::Disposition::Ignored;
use crate::translation::notes::Notes;
use crate::urdf::findings::quoted;

/// Sets the bodies whose joints compensate gravity. Warns once of the bodies whose compensation is lost.
pub(super) fn settle(bodies: &mut [Body], joints: &Joints, notes: &mut Notes) {
    if bodies.iter().all(|body| body.gravity_compensation == 0.0) {
        return;
    }
    let mut is_whole: Vec<bool> = bodies.iter().map(|body| body.is_light() || body.is_held()).collect();
    let mut has_some: Vec<bool> = bodies.iter().map(|body| !body.is_light() && body.is_held()).collect();
    for (index, body) in bodies.iter().enumerate().skip(1).rev() {
        let own = (is_whole.get(index) == Some(&true), has_some.get(index) == Some(&true));
        if let (Some(whole), Some(some)) = (is_whole.get_mut(body.parent), has_some.get_mut(body.parent)) {
            (*whole, *some) = (*whole && own.0, *some || own.1);
        }
    }
    for (body, (whole, some)) in bodies.iter_mut().zip(is_whole.into_iter().zip(has_some)) {
        body.compensates = whole && some && !body.joints.is_empty();
    }
    // Bodies whose weight only compensating joints carry, and those with an actuator at each of them.
    let mut is_covered = vec![true; bodies.len()];
    let (mut lost, mut idle) = (Vec::new(), Vec::new());
    for (index, body) in bodies.iter().enumerate().skip(1) {
        let above = is_covered.get(body.parent) == Some(&true);
        let own = !body.is_free && (body.joints.is_empty() || body.compensates);
        if let Some(covered) = is_covered.get_mut(index) {
            *covered = above && own;
        }
        if body.gravity_compensation != 0.0 && !body.is_light() && !(above && own) {
            lost.push(body);
        }
        let is_driven = |name: &str| {
            let name = &joints.couplings.leader(name).joint;
            joints
                .drives
                .get(name)
                .is_some_and(|drive| matches!(drive.command, Some("position" | "velocity")))
        };
        if body.compensates && !body.joints.iter().all(|joint| is_driven(&joint.name)) {
            idle.push(body);
        }
    }
    let mut warn = |bodies: Vec<&Body>, why: &str| {
        let Some(first) = bodies.first() else { return };
        let names: Vec<String> = bodies.iter().take(4).map(|body| quoted(&body.name)).collect();
        let more = if bodies.len() > 4 { format!(" and {} more", bodies.len() - 4) } else { String::new() };
        let message = format!("gravcomp of {}{more}: {why}", names.join(", "));
        notes.warn_at_line(Ignored, first.at, message);
    };
    warn(lost, "not read, as joints in simd compensate the weight of all that they carry, once, or nothing");
    warn(
        idle,
        "joints compensate weight while they have targets of position or velocity, and these have none",
    );
}
