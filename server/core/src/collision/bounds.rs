//! Bounding boxes of colliders.

use glamx::{DMat3, DPose3, DVec3};
use rapier3d_f64::parry::bounding_volume::BoundingVolume as _;
use rapier3d_f64::parry::shape::Shape;

use super::facets;

/// A box along the world's axes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Bounds {
    pub(super) least: DVec3,
    pub(super) most: DVec3,
}

impl Default for Bounds {
    fn default() -> Self {
        Self { least: DVec3::INFINITY, most: DVec3::NEG_INFINITY }
    }
}

impl Bounds {
    /// Returns the bounds of a box, given by its centre and half lengths, enlarged by a margin, metres.
    pub(super) fn of_box(of: [DVec3; 2], world_from_box: &DPose3, margin: f64) -> Self {
        Self::of_turned_box(of, DMat3::from_quat(world_from_box.rotation), world_from_box.translation, margin)
    }

    /// Returns the bounds of a box with these axes and origin in the world.
    #[inline]
    pub(super) fn of_turned_box([middle, half]: [DVec3; 2], axes: DMat3, origin: DVec3, margin: f64) -> Self {
        let DMat3 { x_axis, y_axis, z_axis } = axes;
        let half =
            x_axis.abs() * half.x + y_axis.abs() * half.y + z_axis.abs() * half.z + DVec3::splat(margin);
        Self::about(origin + axes * middle, half)
    }

    /// Returns the box with this centre and these half lengths.
    pub(super) fn about(middle: DVec3, half: DVec3) -> Self {
        Self { least: middle - half, most: middle + half }
    }

    /// Returns the bounds of a shape, enlarged by a margin, metres.
    pub(super) fn of(shape: &dyn Shape, world_from_shape: &DPose3, margin: f64) -> Self {
        if let Some(cylinder) = shape.as_cylinder() {
            // parry would search for the farthest point six times.
            let axis = world_from_shape.rotation * DVec3::Y;
            let across = (DVec3::ONE - axis * axis).max(DVec3::ZERO).map(f64::sqrt);
            let half = axis.abs() * cylinder.half_height + across * cylinder.radius + DVec3::splat(margin);
            return Self::about(world_from_shape.translation, half);
        }
        if let Some(cone) = shape.as_cone() {
            let axis = world_from_shape.rotation * DVec3::Y;
            let across = (DVec3::ONE - axis * axis).max(DVec3::ZERO).map(f64::sqrt) * cone.radius;
            let base = world_from_shape.translation - axis * cone.half_height;
            let apex = world_from_shape.translation + axis * cone.half_height;
            let margin = DVec3::splat(margin);
            let (least, most) = ((base - across).min(apex), (base + across).max(apex));
            return Self { least: least - margin, most: most + margin };
        }
        let aabb = match shape.as_heightfield() {
            Some(field) => facets::ground(field).transform_by(world_from_shape),
            None => shape.compute_aabb(world_from_shape),
        };
        let aabb = aabb.loosened(margin);
        Self { least: aabb.mins, most: aabb.maxs }
    }

    /// Returns the box enlarged on each side.
    pub(super) fn loosened(&self, by: f64) -> Self {
        Self { least: self.least - DVec3::splat(by), most: self.most + DVec3::splat(by) }
    }

    pub(super) fn around(self, other: Self) -> Self {
        Self { least: self.least.min(other.least), most: self.most.max(other.most) }
    }

    /// Returns the largest gap between the two along any axis; negative if they overlap.
    pub(super) fn gap(&self, other: &Self) -> f64 {
        (other.least - self.most).max(self.least - other.most).max_element()
    }

    /// Returns whether the two overlap.
    pub(super) fn meets(&self, other: &Self) -> bool {
        self.least.cmple(other.most).all() && other.least.cmple(self.most).all()
    }
}

#[cfg(test)]
mod tests {
    use glamx::DQuat;
    use rapier3d_f64::parry::shape::{Cone, SupportMap as _};

    use super::*;

    /// The box around a cone equals the box around its points, found along each axis.
    #[test]
    fn a_box_around_a_cone_is_the_least() {
        let cone = Cone::new(0.4, 0.3);
        for i in 0..50 {
            let turn = f64::from(i);
            let rotation = DQuat::from_rotation_x(1.3 * turn) * DQuat::from_rotation_y(0.7 * turn);
            let pose = DPose3::from_parts(DVec3::new(turn, 1.0, -2.0), rotation);
            let found = Bounds::of(&cone, &pose, 0.0);
            for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
                let most = cone.support_point(&pose, axis).dot(axis);
                let least = cone.support_point(&pose, -axis).dot(axis);
                assert!((found.most.dot(axis) - most).abs() < 1e-12, "{i}");
                assert!((found.least.dot(axis) - least).abs() < 1e-12, "{i}");
            }
        }
    }
}
