//! Frames in the world, for all copies: rotations by quaternions, as in glam, operation by operation, so that
//! a lane has the same bits.

use glamx::{DPose3, DQuat};
use pulp::Simd;

use super::free::Quaternion;
use crate::dynamics::lane::number::Lanes;
use crate::dynamics::lane::vectors::{Matrix, Vector};
use crate::dynamics::real::{MaskOf as _, Real as _};

/// See [`DPose3`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Pose<S: Simd> {
    pub(super) rotation: Quaternion<S>,
    pub(super) translation: Vector<S>,
}

impl<S: Simd> Quaternion<S> {
    /// Returns the same rotation in all lanes.
    #[inline(always)]
    pub(super) fn broadcast(simd: S, of: DQuat) -> Self {
        let vector = Vector::broadcast(simd, glamx::DVec3::new(of.x, of.y, of.z));
        Self { vector, w: Lanes::broadcast(simd, of.w) }
    }

    /// Returns the quaternion of a rotation matrix; see [`DQuat::from_mat3`].
    #[inline(always)]
    pub(super) fn of(matrix: Matrix<S>) -> Self {
        let Matrix { x: a, y: b, z: c } = matrix;
        let (zero, one, half) = (c.z.splat(0.0), c.z.splat(1.0), c.z.splat(0.5));
        let (dif, sum) = (b.y - a.x, b.y + a.x);
        let (minus, plus) = (one - c.z, one + c.z);
        let leans = c.z.le(zero);
        let (of_x, of_z) = (dif.le(zero), sum.le(zero));
        let (xx, yy, zz, ww) = (minus - dif, minus + dif, plus - sum, plus + sum);
        let largest = leans.select(of_x.select(xx, yy), of_z.select(zz, ww));
        let inverse = half / largest.sqrt();
        let own = largest * inverse;
        let (xy, xz, yz) = ((a.y + b.x) * inverse, (a.z + c.x) * inverse, (b.z + c.y) * inverse);
        let (wx, wy, wz) = ((b.z - c.y) * inverse, (c.x - a.z) * inverse, (a.y - b.x) * inverse);
        Self {
            vector: Vector {
                x: leans.select(of_x.select(own, xy), of_z.select(xz, wx)),
                y: leans.select(of_x.select(xy, own), of_z.select(yz, wy)),
                z: leans.select(of_x.select(xz, yz), of_z.select(own, wz)),
            },
            w: leans.select(of_x.select(wx, wy), of_z.select(wz, own)),
        }
    }

    /// Returns it scaled to length 1.
    #[inline(always)]
    pub(super) fn normalized(self) -> Self {
        let Self { vector: Vector { x, y, z }, w } = self;
        let inverse = w.splat(1.0) / ((x * x) + (y * y) + (z * z) + (w * w)).sqrt();
        Self { vector: Vector { x: x * inverse, y: y * inverse, z: z * inverse }, w: w * inverse }
    }

    /// Returns the inverse rotation.
    #[inline(always)]
    pub(super) fn inverse(self) -> Self {
        Self { vector: -self.vector, w: self.w }
    }

    /// Returns this rotation after another one.
    #[inline(always)]
    pub(super) fn after(self, other: Self) -> Self {
        let (Vector { x: x0, y: y0, z: z0 }, w0) = (self.vector, self.w);
        let (Vector { x: x1, y: y1, z: z1 }, w1) = (other.vector, other.w);
        Self {
            vector: Vector {
                x: w0 * x1 + x0 * w1 + y0 * z1 - z0 * y1,
                y: w0 * y1 - x0 * z1 + y0 * w1 + z0 * x1,
                z: w0 * z1 + x0 * y1 - y0 * x1 + z0 * w1,
            },
            w: w0 * w1 - x0 * x1 - y0 * y1 - z0 * z1,
        }
    }
}

impl<S: Simd> Pose<S> {
    /// Returns the same pose in all lanes.
    #[inline(always)]
    pub(super) fn broadcast(simd: S, of: &DPose3) -> Self {
        Self {
            rotation: Quaternion::broadcast(simd, of.rotation),
            translation: Vector::broadcast(simd, of.translation),
        }
    }

    /// Returns the pose of a frame in this one.
    #[inline(always)]
    pub(super) fn after(self, other: Self) -> Self {
        Self {
            rotation: self.rotation.after(other.rotation),
            translation: self.translation + self.rotation.times(other.translation),
        }
    }

    /// Returns the inverse pose.
    #[inline(always)]
    pub(super) fn inverse(self) -> Self {
        let rotation = self.rotation.inverse();
        Self { rotation, translation: rotation.times(-self.translation) }
    }

    /// Returns a point of this frame, in its parent.
    #[inline(always)]
    pub(super) fn point(self, point: Vector<S>) -> Vector<S> {
        self.rotation.times(point) + self.translation
    }
}
