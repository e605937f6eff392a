//! How exactly the contacts of an island are solved, for measurements: a world that is not asked to measures nothing.

use serde::Deserialize;

use super::Island;

/// How impulses are found, where that is measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
pub enum SolverChoice {
    /// As in every world: directly where that is cheap, else by sweeps.
    #[default]
    Automatic,
    /// By sweeps of projected Gauss-Seidel alone.
    Sweeps,
    /// Directly whatever it costs, where there are not too many robots; by sweeps where no direct solution is found.
    Direct,
}

impl Island {
    /// Has impulses found so from now on, and their residual measured.
    pub fn measure_solver(&mut self, choice: SolverChoice) {
        (self.choice, self.is_measured, self.residual) = (choice, true, None);
        self.direct.is_unbounded = choice == SolverChoice::Direct;
    }

    /// Whether impulses are measured.
    pub fn is_measured(&self) -> bool {
        self.is_measured
    }

    /// The largest residual of all contacts that were solved since this was last asked, m/s; `None` where there were none.
    pub fn take_residual(&mut self) -> Option<f64> {
        self.residual.take()
    }

    /// Measures the impulses that were found, where that is asked for.
    ///
    /// The residual of a contact is by how much its impulse would change its own velocity if it alone were solved once more: p minus
    /// the projection of p - D^-1 w on what the contact can do, times D, for the error w of its velocities and its part D of J M^-1 J'.
    /// It is 0 where the laws of all contacts hold, and how near to that sweeps stop is the same number.
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
