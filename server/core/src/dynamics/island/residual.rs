//! Accuracy of an island's contact solution, for measurements. A world measures nothing unless asked to.

use serde::Deserialize;

use super::Island;

/// Solver for impulses, for measurements.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub enum SolverChoice {
    /// As in every world: directly if that is cheap, else by sweeps.
    #[default]
    Automatic,
    /// Only sweeps of projected Gauss-Seidel.
    Sweeps,
    /// Directly at any cost, unless there are too many robots; by sweeps if no direct solution is found.
    Direct,
}

impl Island {
    /// Selects the solver from now on, and measures its residuals.
    pub fn measure_solver(&mut self, choice: SolverChoice) {
        (self.choice, self.is_measured, self.residual) = (choice, true, None);
        self.direct.is_unbounded = choice == SolverChoice::Direct;
    }

    /// Returns whether residuals are measured.
    pub fn is_measured(&self) -> bool {
        self.is_measured
    }

    /// Returns and clears the largest residual of all contacts solved since the last call, m/s; `None` if
    /// there were none.
    pub fn take_residual(&mut self) -> Option<f64> {
        self.residual.take()
    }

    /// Measures the impulses that were found, if requested.
    ///
    /// The residual of a contact is the change of its velocity if only it were solved once more. It is p
    /// minus the projection of p - D^-1 w on the possible impulses, times D. w is the error of its
    /// velocities, and D its part of J M^-1 J'. It is 0 if the laws of all contacts hold; the threshold at
    /// which sweeps end is the same quantity.
    pub(super) fn measure_residual(&mut self) {
        if !self.is_measured || !self.rows.iter().any(|rows| rows.acts()) {
            return;
        }
        let Self { rows, blocks, velocities, .. } = &*self;
        let (mut trial, mut largest) = (velocities.clone(), 0.0f64);
        for rows in rows.iter().filter(|rows| rows.acts()) {
            let mut alone = *rows;
            largest = largest.max(alone.solve(blocks, &mut trial));
            for side in &rows.sides {
                let own = side.first..side.first + side.len;
                trial[own.clone()].copy_from_slice(&velocities[own]);
            }
        }
        self.residual = Some(self.residual.unwrap_or(0.0).max(largest));
    }
}
