//! Numbers as arguments: with units, `0.5`, `90deg`, `12mm`, `30rpm`, and as bits, `5`, `0x5`.

use std::f64::consts::{PI, TAU};

/// Type of a joint's motion, if a unit determines it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Motion {
    Turns,
    Slides,
}

/// A number in SI units, and the motion that its unit implies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Quantity {
    pub(crate) value: f64,
    pub(crate) motion: Option<Motion>,
}

/// Kind of a number, which determines its units.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    Position,
    Velocity,
    Effort,
    /// A gain: SI, without a unit.
    Plain,
}

type Unit = (&'static str, f64, Motion);

// The longer of two suffixes comes first if one ends in the other.
const POSITIONS: &[Unit] = &[
    ("deg", PI / 180.0, Motion::Turns),
    ("rad", 1.0, Motion::Turns),
    ("mm", 1e-3, Motion::Slides),
    ("cm", 1e-2, Motion::Slides),
    ("m", 1.0, Motion::Slides),
];
const VELOCITIES: &[Unit] = &[
    ("deg/s", PI / 180.0, Motion::Turns),
    ("rad/s", 1.0, Motion::Turns),
    ("rpm", TAU / 60.0, Motion::Turns),
    ("mm/s", 1e-3, Motion::Slides),
    ("cm/s", 1e-2, Motion::Slides),
    ("m/s", 1.0, Motion::Slides),
];
const EFFORTS: &[Unit] = &[("Nm", 1.0, Motion::Turns), ("N", 1.0, Motion::Slides)];

/// A number with special units, by its placeholder in the help.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scalar(&'static [(&'static str, f64)]);

/// A time.
pub(crate) const SECONDS: Scalar =
    Scalar(&[("ms", 1e-3), ("us", 1e-6), ("min", 60.0), ("h", 3600.0), ("s", 1.0)]);

const SCALARS: &[(&[&str], Scalar)] = &[
    (&["SECONDS"], SECONDS),
    (&["HZ"], Scalar(&[("kHz", 1e3), ("Hz", 1.0)])),
    (&["METRES", "M", "DISTANCE"], Scalar(&[("mm", 1e-3), ("cm", 1e-2), ("m", 1.0)])),
    (&["KG"], Scalar(&[("kg", 1.0), ("g", 1e-3)])),
    (&["NEWTON"], Scalar(&[("kN", 1e3), ("N", 1.0)])),
    (&["NEWTON_METRE"], Scalar(&[("Nm", 1.0)])),
];

impl Scalar {
    /// Returns the scalar of a placeholder, such as `SECONDS` or `HZ`.
    pub(crate) fn of_name(name: &str) -> Option<Self> {
        SCALARS.iter().find(|(names, _)| names.contains(&name)).map(|(_, scalar)| *scalar)
    }

    /// Parses a number with or without a unit, in SI.
    pub(crate) fn read(self, text: &str) -> Result<f64, String> {
        let text = text.trim();
        if let Ok(value) = text.parse() {
            return Ok(value);
        }
        for (suffix, factor) in self.0 {
            let number = text.strip_suffix(suffix).map(str::trim_end);
            if let Some(value) = number.and_then(|number| number.parse::<f64>().ok()) {
                return Ok(value * factor);
            }
        }
        let units: Vec<&str> = self.0.iter().map(|(suffix, _)| *suffix).collect();
        Err(format!("`{text}` is not a number without a unit or with one of {}", units.join(", ")))
    }
}

impl Kind {
    fn units(self) -> &'static [Unit] {
        match self {
            Self::Position => POSITIONS,
            Self::Velocity => VELOCITIES,
            Self::Effort => EFFORTS,
            Self::Plain => &[],
        }
    }
}

/// Parses a number with or without a unit of its kind. The daemon checks the number, and refuses NaN and the
/// like by name.
pub(crate) fn parse(text: &str, kind: Kind) -> Result<Quantity, String> {
    let text = text.trim();
    if let Ok(value) = text.parse() {
        return Ok(Quantity { value, motion: None });
    }
    for (suffix, factor, motion) in kind.units() {
        if let Some(Ok(value)) = text.strip_suffix(suffix).map(|number| number.trim_end().parse::<f64>()) {
            return Ok(Quantity { value: value * factor, motion: Some(*motion) });
        }
    }
    let units: Vec<&str> = kind.units().iter().map(|(suffix, ..)| *suffix).collect();
    if units.is_empty() {
        Err(format!("`{text}` is not a number"))
    } else {
        Err(format!("`{text}` is not a number without a unit or with one of {}", units.join(", ")))
    }
}

/// Parses numbers between commas.
pub(crate) fn parse_list(text: &str) -> Result<Vec<f64>, String> {
    text.split(',').map(|part| parse(part, Kind::Plain).map(|quantity| quantity.value)).collect()
}

/// Parses 32 bits, decimal or hexadecimal.
pub(crate) fn bits(text: &str) -> Result<u32, String> {
    let parsed = match text.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16),
        None => text.parse(),
    };
    parsed.map_err(|_| format!("must be a number from 0 to {}, or 0x and hexadecimal digits", u32::MAX))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_become_si_and_say_how_the_joint_moves() {
        for (text, kind, value, motion) in [
            ("0.5", Kind::Position, 0.5, None),
            ("-1e-3", Kind::Position, -1e-3, None),
            ("180deg", Kind::Position, PI, Some(Motion::Turns)),
            ("2 rad", Kind::Position, 2.0, Some(Motion::Turns)),
            ("12mm", Kind::Position, 0.012, Some(Motion::Slides)),
            ("3m", Kind::Position, 3.0, Some(Motion::Slides)),
            ("60rpm", Kind::Velocity, TAU, Some(Motion::Turns)),
            ("2m/s", Kind::Velocity, 2.0, Some(Motion::Slides)),
            ("4Nm", Kind::Effort, 4.0, Some(Motion::Turns)),
            ("4N", Kind::Effort, 4.0, Some(Motion::Slides)),
        ] {
            assert_eq!(parse(text, kind), Ok(Quantity { value, motion }), "{text}");
        }
    }

    #[test]
    fn bits_are_a_number_or_hexadecimal_digits() {
        assert_eq!((bits("5"), bits("0xff")), (Ok(5), Ok(255)));
        assert!(bits("-1").is_err() && bits("4294967296").is_err());
    }

    #[test]
    fn a_unit_of_another_kind_is_refused_with_those_that_fit() {
        let refused = parse("90deg", Kind::Velocity).unwrap_err();
        assert!(refused.contains("`90deg`") && refused.contains("deg/s"), "{refused}");
        assert_eq!(parse("5deg", Kind::Plain).unwrap_err(), "`5deg` is not a number");
        assert!(parse("", Kind::Position).is_err());
    }
}
