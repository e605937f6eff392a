//! Momentum of sweeps: each starts further in the direction of the last one.

use super::contact::ContactRows;

/// Nesterov's momentum, restarted when the residual grows.
///
/// Beck and Teboulle, "A fast iterative shrinkage-thresholding algorithm for linear inverse problems" (2009);
/// O'Donoghue and Candès, "Adaptive restart for accelerated gradient schemes" (2015). For contacts: Mazhar,
/// Heyn, Negrut and Tasora, "Using Nesterov's method to accelerate multibody dynamics with friction and
/// contact" (2015). That article uses gradient steps in place of sweeps.
#[derive(Debug, Default)]
pub struct Momentum {
    t: f64,
    residual: f64,
    /// Velocities before the last sweep.
    before: Vec<f64>,
}

impl Momentum {
    /// Starts with a sweep from the present velocities.
    pub fn begin(&mut self, velocities: &[f64]) {
        (self.t, self.residual) = (1.0, f64::INFINITY);
        self.before.clear();
        self.before.extend_from_slice(velocities);
    }

    /// Extrapolates velocities before a sweep. Returns the part of the last sweep's change by which all
    /// impulses must be extrapolated too. It is 0 before the last sweep, which therefore ends with possible
    /// contact impulses.
    pub fn carry(&mut self, velocities: &mut [f64], is_last: bool) -> f64 {
        let next = 0.5 * (1.0 + (1.0 + 4.0 * self.t * self.t).sqrt());
        let part = if is_last { 0.0 } else { (self.t - 1.0) / next };
        self.t = next;
        for (velocity, before) in velocities.iter_mut().zip(&mut self.before) {
            let now = *velocity;
            *velocity = carried(now, *before, part);
            *before = now;
        }
        part
    }

    /// Records the largest change by a sweep.
    pub fn note(&mut self, residual: f64) {
        if residual > self.residual {
            self.t = 1.0;
        }
        self.residual = residual;
    }
}

/// Sweeps once over contacts. It first extrapolates their impulses by a part, as velocities already are.
/// `before` has the impulses before the last sweep. Returns the largest change of a contact's own velocity,
/// m/s.
pub fn sweep_carried(
    (rows, before): (&mut [ContactRows], &mut [[f64; 3]]),
    part: f64,
    blocks: &[f64],
    velocities: &mut [f64],
) -> f64 {
    let mut largest = 0.0f64;
    for (rows, before) in rows.iter_mut().zip(before).filter(|(rows, _)| rows.acts()) {
        let now = rows.impulse;
        rows.impulse = [0, 1, 2].map(|k| carried(now[k], before[k], part));
        *before = now;
        largest = largest.max(rows.solve(blocks, velocities));
    }
    largest
}

/// Returns a number, extrapolated by a part of its change.
fn carried(now: f64, before: f64, part: f64) -> f64 {
    now + part * (now - before)
}
