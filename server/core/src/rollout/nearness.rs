//! Distance of links to others in each step of each copy.

use glamx::{DPose3, DVec3};

use super::quantities::View;
use crate::collision::scene::LinkBox;
use crate::simulation::Error;
use crate::simulation::published_state::WorldLayout;
use crate::simulation::queries::{DistanceQuery, QueryBody, QuerySide};

/// Maximum number of pairs of boxes that are compared before shapes; with more it saves no time.
const MAX_PAIRS: usize = 64;

/// Margin below which a pair is measured exactly, metres: far above rounding.
const ROUNDING: f64 = 1e-6;

/// Distance query for each step.
#[derive(Debug)]
pub(super) struct Nearness {
    query: DistanceQuery,
    /// Robot and box of each box on each side; empty if there are too many.
    boxes: [Vec<(usize, LinkBox)>; 2],
}

impl Nearness {
    /// Creates the query for a link or all links of a robot, and another robot or all others, by index. It
    /// has a search distance in metres.
    pub(super) fn new(
        layout: &WorldLayout,
        own: (usize, Option<usize>),
        other: Option<(usize, Option<usize>)>,
        within: f64,
    ) -> Self {
        let side = |(robot, link)| QuerySide::Body(QueryBody { robot, link, configuration: None });
        let boxes_of = |(robot, link): (usize, Option<usize>)| {
            let boxes = layout.entities[robot].shapes.boxes(link);
            boxes.map(move |of_link| (robot, of_link))
        };
        let others = (0..layout.entities.len()).filter(|robot| *robot != own.0).map(|robot| (robot, None));
        let others = other.map_or_else(|| others.collect(), |other| vec![other]);
        let mut boxes: [Vec<_>; 2] =
            [boxes_of(own).collect(), others.into_iter().flat_map(boxes_of).take(MAX_PAIRS + 1).collect()];
        if boxes[0].len() * boxes[1].len() > MAX_PAIRS {
            boxes = Default::default();
        }
        let query =
            DistanceQuery { a: side(own), b: other.map(side), within, nearest_only: true, filtered: false };
        Self { query, boxes }
    }

    /// Returns the shortfall of the distance against the search distance; 0 if it is larger.
    ///
    /// # Errors
    /// Returns an error if it cannot be computed. If cancelled, the result is invalid.
    pub(super) fn lack(&self, view: &mut View, is_cancelled: &dyn Fn() -> bool) -> Result<f64, Error> {
        let within = self.query.within;
        if self.are_apart(view) {
            return Ok(0.0);
        }
        let found = view.closest_points(&self.query, is_cancelled)?;
        let nearest = found.iter().map(|closest| closest.distance).fold(within, f64::min);
        Ok(within - nearest)
    }

    /// Returns whether boxes suffice to show that everything is farther apart than the search distance.
    fn are_apart(&self, view: &mut View) -> bool {
        let [own, others] = &self.boxes;
        if own.is_empty() {
            return false;
        }
        let most = self.query.within + ROUNDING;
        let mut pose = |(robot, of_link): &(usize, LinkBox)| {
            view.link_pose(*robot, of_link.link) * of_link.link_from_box
        };
        own.iter().all(|a| {
            let at = pose(a);
            others.iter().all(|b| {
                let (other_at, halves) = (pose(b), [a.1.half, b.1.half]);
                least_gap([&at, &other_at], halves) > most
            })
        })
    }
}

/// Returns a lower bound of the distance of two boxes with these half lengths and poses. It is the distance
/// between each box and a ball around the other one.
fn least_gap([a, b]: [&DPose3; 2], [half_a, half_b]: [DVec3; 2]) -> f64 {
    let between = b.translation - a.translation;
    let outside = |at: &DPose3, half: DVec3, other: DVec3| {
        let own = at.rotation.inverse() * between;
        (own.abs() - half).max(DVec3::ZERO).length() - other.length()
    };
    outside(a, half_a, half_b).max(outside(b, half_b, half_a))
}

#[cfg(test)]
mod tests {
    use glamx::DQuat;

    use super::*;

    #[test]
    fn a_ball_beside_a_long_box_is_as_far_from_it_as_from_its_side() {
        let post = DPose3::from_parts(DVec3::new(1.0, 0.0, 0.0), DQuat::from_rotation_x(0.3));
        let (long, small) = (DVec3::new(0.1, 0.1, 5.0), DVec3::splat(0.2 / 3.0_f64.sqrt()));
        let beside = DPose3::from_translation(DVec3::ZERO);
        for (poses, halves) in [([&post, &beside], [long, small]), ([&beside, &post], [small, long])] {
            assert!((least_gap(poses, halves) - 0.7).abs() < 1e-12);
        }
        let endless = DVec3::INFINITY;
        assert!(least_gap([&post, &beside], [endless, small]) < 0.0);
    }
}
