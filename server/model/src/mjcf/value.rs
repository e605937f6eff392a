//! Numbers in attributes, and the forms of an orientation in MJCF.

use glamx::{DMat3, DPose3, DQuat, DVec3};

use super::compiler::Compiler;
use super::defaults::Classed;
use crate::limits;
use crate::report::Disposition::Repaired;
use crate::translation::element::Element;
use crate::translation::notes::{Notes, Stop};
use crate::urdf::findings::quoted;

/// Returns the numbers of an element's attribute, at most `most`.
pub(super) fn list(at: Element, name: &str, text: &str, most: usize) -> Result<Vec<f64>, Stop> {
    let mut values = Vec::new();
    for word in text.split_whitespace() {
        if values.len() >= most {
            return Err(Stop::at(at, format!("{name} has more than {most} numbers")));
        }
        let value: f64 = word.parse().map_err(|_not_a_number| {
            Stop::at(at, format!("{name}={} has a word that is not a number: {}", quoted(text), quoted(word)))
        })?;
        if value.is_nan() || value.abs() > limits::MAGNITUDE {
            return Err(Stop::at(at, format!("{name} has a number beyond the range of simd: {value}")));
        }
        values.push(value);
    }
    Ok(values)
}

/// Returns exactly `N` numbers of an element's own attribute.
pub(super) fn numbers<const N: usize>(
    at: Element,
    name: &str,
    notes: &mut Notes,
) -> Result<Option<[f64; N]>, Stop> {
    at.word(name).map(|text| exactly(at, name, text, notes)).transpose()
}

fn exactly<const N: usize>(at: Element, name: &str, text: &str, notes: &mut Notes) -> Result<[f64; N], Stop> {
    let mut values = list(at, name, text, 1000)?;
    if values.len() > N {
        notes.warn(at, Repaired, format!("{name} has {} numbers: the first {N} are used", values.len()));
        values.truncate(N);
    }
    let count = values.len();
    values.try_into().map_err(|_few| Stop::at(at, format!("{name} has {count} numbers instead of {N}")))
}

impl Classed<'_, '_> {
    /// Returns exactly `N` numbers, from the class if the element has none.
    pub(super) fn numbers<const N: usize>(
        &self,
        name: &str,
        notes: &mut Notes,
    ) -> Result<Option<[f64; N]>, Stop> {
        self.get(name).map(|(at, text)| exactly(at, name, text, notes)).transpose()
    }

    /// Returns one number; the first of several.
    pub(super) fn number(&self, name: &str) -> Result<Option<f64>, Stop> {
        let Some((at, text)) = self.get(name) else { return Ok(None) };
        Ok(list(at, name, text, 1000)?.first().copied())
    }

    /// Returns at most `most` numbers.
    pub(super) fn list(&self, name: &str, most: usize) -> Result<Option<Vec<f64>>, Stop> {
        self.get(name).map(|(at, text)| list(at, name, text, most)).transpose()
    }

    /// Returns the pose from `pos` and one of the orientations.
    pub(super) fn pose(&self, compiler: &Compiler, notes: &mut Notes) -> Result<DPose3, Stop> {
        let translation = self.numbers("pos", notes)?.map_or(DVec3::ZERO, DVec3::from_array);
        Ok(DPose3::from_parts(translation, self.rotation(compiler, notes)?))
    }

    fn rotation(&self, compiler: &Compiler, notes: &mut Notes) -> Result<DQuat, Stop> {
        if let Some([w, x, y, z]) = self.numbers("quat", notes)? {
            let rotation = DQuat::from_xyzw(x, y, z, w);
            return unit(self.element, rotation);
        }
        if let Some([x, y, z, angle]) = self.numbers("axisangle", notes)? {
            let axis = direction(self.element, DVec3::new(x, y, z))?;
            return Ok(DQuat::from_axis_angle(axis, compiler.angle(angle)));
        }
        if let Some(angles) = self.numbers::<3>("euler", notes)? {
            return Ok(euler(angles, compiler));
        }
        if let Some([a, b, c, d, e, f]) = self.numbers("xyaxes", notes)? {
            let x = direction(self.element, DVec3::new(a, b, c))?;
            let y = DVec3::new(d, e, f);
            let y = direction(self.element, y - x * x.dot(y))?;
            return Ok(DQuat::from_mat3(&DMat3::from_cols(x, y, x.cross(y))).normalize());
        }
        if let Some(axis) = self.numbers("zaxis", notes)? {
            let axis = direction(self.element, DVec3::from_array(axis))?;
            return Ok(DQuat::from_rotation_arc(DVec3::Z, axis));
        }
        Ok(DQuat::IDENTITY)
    }
}

/// Returns a rotation from Euler angles, as the file writes them.
pub(super) fn euler(angles: [f64; 3], compiler: &Compiler) -> DQuat {
    let mut rotation = DQuat::IDENTITY;
    for (axis, angle) in compiler.euler.into_iter().zip(angles) {
        let about = match axis.to_ascii_lowercase() {
            b'x' => DVec3::X,
            b'y' => DVec3::Y,
            _ => DVec3::Z,
        };
        let turn = DQuat::from_axis_angle(about, compiler.angle(angle));
        // Lower-case letters are axes that turn with the frame.
        rotation = if axis.is_ascii_lowercase() { rotation * turn } else { turn * rotation };
    }
    rotation.normalize()
}

/// Returns a vector of length 1.
pub(super) fn direction(at: Element, vector: DVec3) -> Result<DVec3, Stop> {
    vector.try_normalize().filter(|unit| unit.is_finite()).ok_or_else(|| Stop::at(at, "an axis of it is 0"))
}

fn unit(at: Element, rotation: DQuat) -> Result<DQuat, Stop> {
    if rotation.length() < 1e-9 {
        return Err(Stop::at(at, "its quat is 0"));
    }
    Ok(rotation.normalize())
}
