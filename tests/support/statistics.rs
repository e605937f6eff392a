//! Medians and spreads of figures.

use std::fmt;

/// Median, and the range that holds nine tenths.
#[derive(Clone, Copy, Debug)]
pub struct Spread {
    /// Half lie below.
    pub median: f64,
    /// A twentieth lies below.
    pub low: f64,
    /// A twentieth lies above.
    pub high: f64,
}

impl Spread {
    /// Returns the spread of figures in any order.
    pub fn of(mut figures: Vec<f64>) -> Self {
        figures.sort_by(f64::total_cmp);
        let at = |part| percentile(&figures, part);
        Self { median: at(0.5), low: at(0.05), high: at(0.95) }
    }
}

impl fmt::Display for Spread {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:8.2}  (90 % within {:.2} to {:.2})", self.median, self.low, self.high)
    }
}

/// Returns the one of sorted figures below which this part lies; NaN if there are none.
pub fn percentile(sorted: &[f64], part: f64) -> f64 {
    let index = (sorted.len().saturating_sub(1) as f64 * part).round() as usize;
    sorted.get(index).copied().unwrap_or(f64::NAN)
}
