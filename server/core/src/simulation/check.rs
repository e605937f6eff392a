//! Validation of a command's numbers. A refusal names the field by its path in the request, since a command
//! has the fields of its request. No other module does this.

use std::fmt::Display;
use std::ops::RangeInclusive;

use glamx::{DPose3, DQuat, DVec3};
use simd_model::robot::{Geometry, JointLimits};
use simd_model::{LARGEST_GIVEN, shown};

use super::error::Error;

/// Returns the refusal of a field.
pub(crate) fn refuse(field: impl Into<String>, value: impl Display, expected: impl Into<String>) -> Error {
    Error::InvalidValue {
        element: field.into(),
        of: String::new(),
        value: shown(value),
        expected: expected.into(),
    }
}

/// Requires a finite number.
pub(super) fn finite(field: &str, value: f64) -> Result<f64, Error> {
    if value.is_finite() { Ok(value) } else { Err(refuse(field, value, "it must be finite")) }
}

/// Requires a finite number that is not negative.
pub(super) fn at_least_zero(field: &str, value: f64) -> Result<f64, Error> {
    if value.is_finite() && value >= 0.0 {
        return Ok(value);
    }
    Err(refuse(field, value, "it must be finite and at least 0"))
}

/// Like [`at_least_zero`], for a given value.
pub(super) fn optional_at_least_zero(field: &str, value: Option<f64>) -> Result<(), Error> {
    value.map_or(Ok(()), |value| at_least_zero(field, value).map(drop))
}

/// Requires a valid gain, if it is given.
pub(super) fn gain(field: &str, value: Option<f64>) -> Result<(), Error> {
    match value {
        Some(value) if !(0.0..=LARGEST_GIVEN).contains(&value) => {
            Err(refuse(field, value, format!("it must be between 0 and {LARGEST_GIVEN:e}")))
        }
        _ => Ok(()),
    }
}

/// Requires a number in a range, which excludes NaN.
pub(super) fn within(field: &str, value: f64, range: RangeInclusive<f64>) -> Result<f64, Error> {
    if range.contains(&value) {
        return Ok(value);
    }
    Err(refuse(field, value, format!("it must be between {} and {}", range.start(), range.end())))
}

/// Requires a number within bounds, or 0, which means that there is none.
pub(super) fn zero_or_within(field: &str, value: f64, range: RangeInclusive<f64>) -> Result<f64, Error> {
    if value == 0.0 || range.contains(&value) {
        return Ok(value);
    }
    Err(refuse(field, value, format!("it must be 0, or between {} and {:e}", range.start(), range.end())))
}

/// Requires a number within [`LARGEST_GIVEN`], as for positions, targets and sizes of shapes.
pub(super) fn moderate(field: &str, value: f64) -> Result<f64, Error> {
    if value.abs() <= LARGEST_GIVEN {
        return Ok(value);
    }
    Err(refuse(field, value, format!("it must be a number between -{LARGEST_GIVEN:e} and {LARGEST_GIVEN:e}")))
}

/// Like [`moderate`], for each number of a list.
pub(super) fn moderate_list(field: &str, values: &[f64]) -> Result<(), Error> {
    match values.iter().position(|value| moderate(field, *value).is_err()) {
        Some(index) => moderate(&format!("{field}[{index}]"), values[index]).map(drop),
        None => Ok(()),
    }
}

/// Requires three finite numbers.
pub(super) fn point(field: &str, point: DVec3) -> Result<DVec3, Error> {
    for (axis, value) in ["x", "y", "z"].into_iter().zip(point.to_array()) {
        finite(axis, value).map_err(|error| error.within(|| field.to_owned()))?;
    }
    Ok(point)
}

/// Requires three numbers within [`LARGEST_GIVEN`].
pub(super) fn moderate_point(field: &str, point: DVec3) -> Result<DVec3, Error> {
    for (axis, value) in ["x", "y", "z"].into_iter().zip(point.to_array()) {
        moderate(axis, value).map_err(|error| error.within(|| field.to_owned()))?;
    }
    Ok(point)
}

/// Requires three finite numbers, of a finite length.
pub(super) fn vector(field: &str, vector: DVec3) -> Result<DVec3, Error> {
    point(field, vector)?;
    if vector.length().is_finite() {
        return Ok(vector);
    }
    Err(refuse(field, vector, "its length must be finite"))
}

/// Requires a finite pose with a rotation of unit length.
pub(super) fn pose(field: &str, pose: &DPose3) -> Result<(), Error> {
    point("position", pose.translation).map_err(|error| error.within(|| field.to_owned()))?;
    if (pose.rotation.length_squared() - 1.0).abs() < 1e-6 {
        return Ok(());
    }
    Err(refuse(format!("{field}.orientation"), pose.rotation, "it must be a quaternion of unit length"))
}

/// Like [`pose`], with a position within [`LARGEST_GIVEN`].
pub(super) fn moderate_pose(field: &str, given: &DPose3) -> Result<(), Error> {
    pose(field, given)?;
    for (axis, value) in ["x", "y", "z"].into_iter().zip(given.translation.to_array()) {
        moderate(axis, value).map_err(|error| error.within(|| format!("{field}.position")))?;
    }
    Ok(())
}

/// Returns a rotation, normalised to the last digit.
pub(super) fn orientation(field: &str, orientation: DQuat) -> Result<DQuat, Error> {
    if (orientation.length_squared() - 1.0).abs() < 1e-6 {
        return Ok(orientation.normalize());
    }
    Err(refuse(field, orientation, "it must be a quaternion of unit length"))
}

/// Requires limits that are ordered and finite, and not negative if they bound a size.
pub(super) fn limits(limits: &JointLimits) -> Result<(), Error> {
    let JointLimits { lower, upper, effort, velocity } = *limits;
    for (field, value) in [("limits.lower", lower), ("limits.upper", upper)] {
        if let Some(value) = value {
            finite(field, value)?;
        }
    }
    optional_at_least_zero("limits.effort", effort)?;
    optional_at_least_zero("limits.velocity", velocity)?;
    match (lower, upper) {
        (Some(lower), Some(upper)) if lower > upper => {
            Err(refuse("limits.lower", lower, format!("it must be at most the upper limit, {upper}")))
        }
        _ => Ok(()),
    }
}

/// Requires a shape with sizes within bounds.
pub(super) fn shape(field: &str, geometry: &Geometry) -> Result<(), Error> {
    let each = |kind: &str, sizes: &[(&str, f64)]| {
        sizes.iter().try_for_each(|(name, size)| {
            let checked = moderate(name, *size).map(drop);
            checked.map_err(|error| error.within(|| format!("{field}.{kind}")))
        })
    };
    match geometry {
        Geometry::Box { size } => moderate_point(&format!("{field}.box.size"), *size).map(drop),
        Geometry::Sphere { radius } => each("sphere", &[("radius", *radius)]),
        Geometry::Cylinder { radius, length } => {
            each("cylinder", &[("radius", *radius), ("length", *length)])
        }
        Geometry::Capsule { radius, length } => each("capsule", &[("radius", *radius), ("length", *length)]),
        Geometry::Cone { radius, length } => each("cone", &[("radius", *radius), ("length", *length)]),
        Geometry::Plane { .. } | Geometry::Mesh { .. } => Ok(()),
    }
}
