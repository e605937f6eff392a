//! The shape that replaces an ellipsoid.

use glamx::{DPose3, DVec3};

use super::draft::DraftGeometry;

/// Returns a capsule that replaces an ellipsoid: as long as its longest axis, as thick as the mean of the
/// other radii. Also returns its pose in the ellipsoid, and a note for the report.
pub(crate) fn ellipsoid(radii: DVec3) -> (DPose3, DraftGeometry, String) {
    let [x, y, z] = radii.abs().to_array();
    let (axis, longest, others) = if z >= x && z >= y {
        (DVec3::Z, z, [x, y])
    } else if y >= x {
        (DVec3::Y, y, [x, z])
    } else {
        (DVec3::X, x, [y, z])
    };
    let radius = 0.5 * (others[0] + others[1]);
    let turn = DPose3::from_rotation(glamx::DQuat::from_rotation_arc(DVec3::Z, axis));
    let length = 2.0 * (longest - radius);
    let message = |shape: &str, distance: f64| {
        let error = format!("the largest distance between the two is {distance:.4} m");
        format!("simd has no ellipsoids: {shape} is used instead; {error}")
    };
    if length < 1e-6 * longest {
        let said = message("a ball", distance_from_capsule(longest, others, longest));
        return (DPose3::IDENTITY, DraftGeometry::Sphere { radius: longest }, said);
    }
    let said = message("a capsule along its longest axis", distance_from_capsule(longest, others, radius));
    (turn, DraftGeometry::Capsule { radius, length }, said)
}

/// Returns the largest distance between the surfaces of an ellipsoid and of a capsule as long as its longest
/// axis.
///
/// For two convex bodies it is the largest difference of their support functions over all directions
/// (Schneider, "Convex Bodies: The Brunn-Minkowski Theory" (2014), 1.8). Let c be the cosine of the angle to
/// the longest axis, whose length is L. The ellipsoid's is sqrt(w^2 (1 - c^2) + L^2 c^2), with w between the
/// two other radii. The capsule's is r + (L - r) c. So the difference has its extremes at one of these radii.
/// There they are at c = 0, at c = 1 (where it is 0), or where its derivative is 0.
fn distance_from_capsule(longest: f64, others: [f64; 2], radius: f64) -> f64 {
    let half = longest - radius;
    let of = |across: f64| {
        let flattening = (longest - across) * (longest + across);
        let steepness = flattening - half * half;
        let cosine = half * across / (flattening * steepness).sqrt();
        let least = across * (steepness / flattening).sqrt() - radius;
        let middle = if steepness > 0.0 && cosine < 1.0 { least.abs() } else { 0.0 };
        middle.max((across - radius).abs())
    };
    of(others[0]).max(of(others[1]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compares with support functions on a grid of directions, without assumptions on the maximum.
    #[test]
    fn the_distance_of_a_capsule_from_an_ellipsoid_is_the_largest_difference_of_their_supports() {
        const STEPS: u32 = 400;
        let quarter = |i: u32| (f64::from(i) / f64::from(STEPS) * std::f64::consts::FRAC_PI_2).sin_cos();
        for [p, q, longest] in
            [[1.0, 1.0, 2.0], [1.0, 2.0, 3.0], [0.1, 1.0, 1.0], [0.02, 0.03, 0.5], [0.9, 1.0, 1.0], [1.0; 3]]
        {
            let radius: f64 = 0.5 * (p + q);
            let mut found = 0.0f64;
            for i in 0..=STEPS {
                let (across, along) = quarter(i);
                for j in 0..=STEPS {
                    let (sin, cos) = quarter(j);
                    let own = DVec3::new(p * across * cos, q * across * sin, longest * along).length();
                    found = found.max((own - radius - (longest - radius) * along).abs());
                }
            }
            let said = distance_from_capsule(longest, [p, q], radius);
            let is_near = found <= said + 1e-12 && said - found < 1e-4 * longest;
            assert!(is_near, "{p} {q} {longest}: {found} {said}");
        }
    }

    #[test]
    fn a_capsule_in_place_of_an_ellipsoid_reports_its_distance() {
        let (_, _, said) = ellipsoid(DVec3::new(1.0, 1.0, 2.0));
        assert!(said.ends_with("is 0.1835 m"), "1 - sqrt(2 / 3): {said}");
        let (_, _, said) = ellipsoid(DVec3::ONE);
        assert!(said.contains("a ball") && said.ends_with("is 0.0000 m"), "{said}");
    }
}
