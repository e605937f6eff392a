//! Contacts of two convex shapes by clipping one face to the other.

use glamx::{DPose3, DVec3};
use rapier3d_f64::parry::query::details::{NormalConstraints, contact_manifold_pfm_pfm};
use rapier3d_f64::parry::query::{ContactManifold, DefaultQueryDispatcher, PersistentQueryDispatcher as _};
use rapier3d_f64::parry::shape::{PolygonalFeatureMap, Shape, ShapeType};

use super::hull::Graph;
use super::hull_support::HullSupport;

/// Computes a manifold of two convex shapes, with a separate search for hulls; `None` if there is no valid
/// one. `constraints` limit the directions from which the first is touched.
pub(super) fn clip_convex(
    [(a, graph_a), (b, graph_b)]: [(&dyn Shape, Option<&Graph>); 2],
    constraints: Option<&dyn NormalConstraints>,
    a_from_b: &DPose3,
    within: f64,
    manifold: &mut ContactManifold<(), ()>,
) -> Option<()> {
    // parry continues from a manifold's contents; this one is empty.
    manifold.points.clear();
    manifold.local_n1 = DVec3::ZERO;
    manifold.local_n2 = DVec3::ZERO;
    let hulls = [HullSupport::of(a, graph_a), HullSupport::of(b, graph_b)];
    let has_hull = hulls.iter().any(Option::is_some);
    match (faces(hulls[0].as_ref(), a), faces(hulls[1].as_ref(), b)) {
        (Some((first, around_first)), Some((second, around_second))) if has_hull => {
            contact_manifold_pfm_pfm(
                a_from_b,
                first,
                around_first,
                constraints,
                second,
                around_second,
                None,
                within,
                manifold,
            );
        }
        _ => DefaultQueryDispatcher
            .contact_manifold_convex_convex(a_from_b, a, b, constraints, None, within, manifold)
            .ok()?,
    }
    manifold.local_n1.is_finite().then_some(())
}

/// Returns a shape's polygonal features for clipping, and the radius around them; `None` for a ball.
fn faces<'a>(
    hull: Option<&'a HullSupport<'a>>,
    shape: &'a dyn Shape,
) -> Option<(&'a dyn PolygonalFeatureMap, f64)> {
    hull.map(|hull| (hull as &dyn PolygonalFeatureMap, 0.0)).or_else(|| shape.as_polygonal_feature_map())
}

/// Returns whether a shape is a capsule, which is used for feet and not for wheels.
pub(super) fn is_capsule(shape: &dyn Shape) -> bool {
    shape.shape_type() == ShapeType::Capsule
}
