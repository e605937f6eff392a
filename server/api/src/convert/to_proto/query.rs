//! Answers about distances, overlaps and bounds.

use simd_core::simulation::queries::{DistanceReport, LinkBounds};
use simd_proto::v1;

use super::geometry::vector;

/// Converts the closest points of two links.
pub fn closest(report: DistanceReport) -> v1::ClosestPoints {
    let DistanceReport { robots: [robot_a, robot_b], links: [link_a, link_b], points, normal, distance } =
        report;
    v1::ClosestPoints {
        robot_a,
        link_a,
        robot_b,
        link_b,
        point_a: Some(vector(points[0])),
        point_b: Some(vector(points[1])),
        normal: Some(vector(normal)),
        distance,
    }
}

/// Converts the box around a link of a robot.
pub fn bounds(robot: &str, (link, [lower, upper]): LinkBounds) -> v1::LinkBounds {
    v1::LinkBounds { robot: robot.to_owned(), link, lower: Some(vector(lower)), upper: Some(vector(upper)) }
}
