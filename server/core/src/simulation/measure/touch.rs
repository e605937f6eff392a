//! Measurement of contacts of a link.

use glamx::DVec3;
use simd_model::sensor::Channels;

use super::reading::{ContactMeasurement, ContactPartner, MAX_CONTACT_PARTNERS};
use crate::simulation::published_state::{ContactReport, PublishedState};
use crate::simulation::sensors::{DueSample, SampleNoise};

/// Measures the contacts of a link. Forces are means over the last step.
pub(super) fn contact(
    state: &PublishedState,
    due: &DueSample,
    threshold: f64,
    noise: &SampleNoise<'_>,
) -> ContactMeasurement {
    let own = (due.robot, due.definition.link);
    let mut partners: Vec<ContactPartner> = Vec::new();
    let (mut force, mut normal_force) = (DVec3::ZERO, 0.0);
    for contact in &state.contacts {
        let ContactReport { robots, links, normal, depth, normal_force: along, friction_force, .. } = contact;
        let on_second = *normal * *along + *friction_force;
        for (side, on_own) in [(0, -on_second), (1, on_second)] {
            if (robots[side], links[side]) != own {
                continue;
            }
            force += on_own;
            normal_force += along;
            let (robot, link) = (robots[1 - side], links[1 - side]);
            let found =
                partners.binary_search_by_key(&(robot, link), |partner| (partner.robot, partner.link));
            match found {
                Ok(index) => {
                    let partner = &mut partners[index];
                    partner.force += on_own;
                    partner.normal_force += along;
                    partner.depth = partner.depth.max(*depth);
                    partner.points += 1;
                }
                Err(index) => {
                    let (force, normal_force, depth) = (on_own, *along, *depth);
                    partners
                        .insert(index, ContactPartner { robot, link, force, normal_force, depth, points: 1 });
                }
            }
        }
    }
    let more_partners = partners.len().saturating_sub(MAX_CONTACT_PARTNERS);
    if more_partners > 0 {
        // Those that press most.
        partners.sort_by(|a, b| b.normal_force.total_cmp(&a.normal_force));
        partners.truncate(MAX_CONTACT_PARTNERS);
        partners.sort_by_key(|partner| (partner.robot, partner.link));
    }
    ContactMeasurement {
        touching: normal_force > threshold,
        force: noise.vector(Channels::Force, force),
        normal_force,
        partners,
        more_partners,
    }
}
