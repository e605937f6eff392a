//! Checks of numbers from files. Errors are fragments of a sentence.

use glamx::DPose3;
use simd_model::{LARGEST_GIVEN, shown};

/// Rejects NaN and infinite numbers.
pub(crate) fn finite(what: &str, values: impl IntoIterator<Item = f64>) -> Result<(), String> {
    match values.into_iter().find(|value| !value.is_finite()) {
        Some(value) => Err(format!("{what} with {value} among them")),
        None => Ok(()),
    }
}

/// Rejects NaN and numbers larger than [`LARGEST_GIVEN`].
pub(crate) fn moderate(what: &str, values: impl IntoIterator<Item = f64>) -> Result<(), String> {
    match values.into_iter().find(|value| value.is_nan() || value.abs() > LARGEST_GIVEN) {
        Some(value) => Err(format!(
            "{what} of {}, which is not between -{LARGEST_GIVEN:e} and {LARGEST_GIVEN:e}",
            shown(value)
        )),
        None => Ok(()),
    }
}

/// Rejects negative numbers, NaN and infinity.
pub(crate) fn sizes(what: &str, values: impl IntoIterator<Item = f64>) -> Result<(), String> {
    match values.into_iter().find(|value| !(value.is_finite() && *value >= 0.0)) {
        Some(value) => Err(format!("{what} with {value} among them")),
        None => Ok(()),
    }
}

/// Rejects poses that are not finite, or whose rotation is not of unit length.
pub(crate) fn pose(what: &str, pose: &DPose3) -> Result<(), String> {
    finite(what, pose.translation.to_array())?;
    unit(what, &pose.rotation.to_array())
}

pub(crate) fn unit(what: &str, quaternion: &[f64]) -> Result<(), String> {
    let square: f64 = quaternion.iter().map(|part| part * part).sum();
    if (square - 1.0).abs() < 1e-6 {
        Ok(())
    } else {
        Err(format!("{what} with a quaternion that is not of unit length"))
    }
}
