//! Rows of numbers at knots in time, and their interpolation.

use super::names::{moderate, sized};
use super::request::Interpolation;
use crate::simulation::Error;

/// Rows of numbers, one for each knot: for all copies, or for each copy.
#[derive(Clone, Debug)]
pub(super) struct Knots {
    values: Vec<f64>,
    /// Numbers in a row.
    width: usize,
    /// Number of rows.
    knots: usize,
    /// Steps from row to row.
    every: u64,
    /// Whether each copy has separate rows.
    is_of_each: bool,
    interpolation: Interpolation,
}

/// Times of rows, and their interpolation.
#[derive(Clone, Copy, Debug)]
pub(super) struct Timing {
    pub(super) copies: usize,
    pub(super) knots: usize,
    pub(super) every: u64,
    pub(super) interpolation: Interpolation,
}

impl Knots {
    /// Creates the rows from the numbers of the named field.
    pub(super) fn new(field: &str, values: Vec<f64>, width: usize, timing: Timing) -> Result<Self, Error> {
        let Timing { copies, knots, every, interpolation } = timing;
        let one = knots.saturating_mul(width);
        let each = one.saturating_mul(copies);
        sized(field, values.len(), &[(one, "one row a knot"), (each, "one row a knot for each copy")])?;
        moderate(field, &values)?;
        let is_of_each = values.len() == each && copies > 1;
        Ok(Self { values, width, knots, every, is_of_each, interpolation })
    }

    /// Like [`new`](Self::new), but also accepts one row for all steps.
    pub(super) fn constant_or(
        field: &str,
        values: Vec<f64>,
        width: usize,
        timing: Timing,
    ) -> Result<Self, Error> {
        let timing = if values.len() == width { Timing { knots: 1, ..timing } } else { timing };
        Self::new(field, values, width, Timing { interpolation: Interpolation::Hold, ..timing })
    }

    /// Creates rows of the start only: one row for all copies, or one for each. Returns `None` if empty.
    pub(super) fn of_start(
        field: &str,
        values: Vec<f64>,
        width: usize,
        copies: usize,
    ) -> Result<Option<Self>, Error> {
        let each = width.saturating_mul(copies);
        let lengths = [(0, "nothing"), (width, "a row for all copies"), (each, "a row for each copy")];
        sized(field, values.len(), &lengths)?;
        moderate(field, &values)?;
        let is_of_each = values.len() == each && copies > 1;
        let interpolation = Interpolation::Hold;
        let rows = Self { values, width, knots: 1, every: 1, is_of_each, interpolation };
        Ok(Some(rows).filter(|rows| !rows.values.is_empty()))
    }

    /// Returns whether the row of this step differs from the previous step's.
    pub(super) fn change_at(&self, step: u64) -> bool {
        let last = (self.knots as u64).saturating_sub(1).saturating_mul(self.every);
        match self.interpolation {
            Interpolation::Hold => step <= last && step.is_multiple_of(self.every),
            Interpolation::Linear | Interpolation::Cubic => step <= last,
        }
    }

    /// Returns all numbers.
    pub(super) fn numbers(&self) -> &[f64] {
        &self.values
    }

    /// Returns the rows of a copy.
    fn rows(&self, copy: usize) -> &[f64] {
        let length = self.knots * self.width;
        let first = if self.is_of_each { copy * length } else { 0 };
        &self.values[first..first + length]
    }

    /// Returns the row of a knot; after the last one, the last row.
    fn row<'r>(&self, rows: &'r [f64], knot: usize) -> &'r [f64] {
        let knot = knot.min(self.knots - 1);
        &rows[knot * self.width..(knot + 1) * self.width]
    }

    /// Returns the row that holds at a step, without interpolation.
    pub(super) fn held(&self, copy: usize, step: u64) -> &[f64] {
        self.row(self.rows(copy), self.knot(step))
    }

    /// Returns the knot at a step or before it.
    fn knot(&self, step: u64) -> usize {
        usize::try_from(step / self.every).unwrap_or(usize::MAX)
    }

    /// Writes the row of a step of a copy.
    pub(super) fn write(&self, copy: usize, step: u64, into: &mut Vec<f64>) {
        into.clear();
        let rows = self.rows(copy);
        let knot = self.knot(step);
        // Part of the interval to the next knot, 0 to 1.
        let part = (step % self.every) as f64 / self.every as f64;
        let [one, next] = [knot, knot.saturating_add(1)].map(|knot| self.row(rows, knot));
        if knot >= self.knots - 1 || self.interpolation == Interpolation::Hold || part == 0.0 {
            into.extend_from_slice(one);
            return;
        }
        if self.interpolation == Interpolation::Linear {
            into.extend(one.iter().zip(next).map(|(a, b)| a + (b - a) * part));
            return;
        }
        let before = self.row(rows, knot.saturating_sub(1));
        let after = self.row(rows, knot.saturating_add(2));
        // Half of the difference of two neighbours; at an end, the difference to the only one.
        let share = |has_both: bool| if has_both { 0.5 } else { 1.0 };
        let (at_one, at_next) = (share(knot > 0), share(knot + 2 < self.knots));
        let (s, s2, s3) = (part, part * part, part * part * part);
        into.extend((0..self.width).map(|i| {
            let slopes = [(next[i] - before[i]) * at_one, (after[i] - one[i]) * at_next];
            (2.0 * s3 - 3.0 * s2 + 1.0) * one[i]
                + (s3 - 2.0 * s2 + s) * slopes[0]
                + (3.0 * s2 - 2.0 * s3) * next[i]
                + (s3 - s2) * slopes[1]
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn knots(values: &[f64], interpolation: Interpolation) -> Knots {
        let timing = Timing { copies: 1, knots: values.len(), every: 4, interpolation };
        Knots::new("values", values.to_vec(), 1, timing).unwrap()
    }

    fn at(knots: &Knots, step: u64) -> f64 {
        let mut row = Vec::new();
        knots.write(0, step, &mut row);
        row[0]
    }

    #[test]
    fn every_curve_goes_through_its_knots_and_holds_the_last() {
        let given = [1.0, -2.0, 0.5, 7.0];
        for interpolation in [Interpolation::Hold, Interpolation::Linear, Interpolation::Cubic] {
            let knots = knots(&given, interpolation);
            for (index, value) in given.iter().enumerate() {
                assert_eq!(at(&knots, 4 * index as u64), *value, "{interpolation:?}");
            }
            assert_eq!(at(&knots, 1000), 7.0);
            assert!(!knots.change_at(13) && knots.change_at(12));
        }
    }

    #[test]
    fn a_straight_line_stays_one_and_a_parabola_stays_one_between_its_inner_knots() {
        let line = [0.0, 2.0, 4.0, 6.0];
        for interpolation in [Interpolation::Linear, Interpolation::Cubic] {
            let knots = knots(&line, interpolation);
            for step in 0..12 {
                assert!((at(&knots, step) - step as f64 / 2.0).abs() < 1e-14);
            }
        }
        // (t - 1)^2 at t = 0, 1, 2, 3.
        let parabola = knots(&[1.0, 0.0, 1.0, 4.0], Interpolation::Cubic);
        for step in 4..8 {
            let t = step as f64 / 4.0;
            assert!((at(&parabola, step) - (t - 1.0).powi(2)).abs() < 1e-14, "{t}");
        }
    }

    #[test]
    fn a_hold_changes_at_its_knots_alone_and_each_copy_has_its_own_rows() {
        let timing = Timing { copies: 2, knots: 2, every: 3, interpolation: Interpolation::Hold };
        let knots = Knots::new("values", vec![1.0, 2.0, 3.0, 4.0], 1, timing).unwrap();
        assert_eq!((0..9).filter(|step| knots.change_at(*step)).collect::<Vec<_>>(), [0, 3]);
        assert_eq!([0, 2, 3, 8].map(|step| knots.held(1, step)[0]), [3.0, 3.0, 4.0, 4.0]);
        let shared = Knots::new("values", vec![1.0, 2.0], 1, timing).unwrap();
        assert_eq!([0, 1].map(|copy| shared.held(copy, 3)[0]), [2.0, 2.0]);
    }

    #[test]
    fn numbers_that_do_not_fit_are_refused_by_what_would_fit() {
        let timing = Timing { copies: 3, knots: 2, every: 1, interpolation: Interpolation::Hold };
        let said = Knots::new("controls[0].values", vec![0.0; 5], 2, timing).unwrap_err().to_string();
        assert_eq!(
            said,
            "controls[0].values has 5 numbers, and needs 4 (one row a knot) or 12 (one row a knot for each copy)"
        );
        let of_one = Timing { copies: 1, ..timing };
        let said = Knots::new("v", vec![0.0], 2, of_one).unwrap_err().to_string();
        assert_eq!(said, "v has 1 number, and needs 4 (one row a knot)");
        let said = Knots::new("v", vec![0.0, 1.0, f64::NAN, 2.0], 2, timing).unwrap_err().to_string();
        assert!(said.starts_with("v[2] is NaN"), "{said}");
    }
}
