//! Impulses of a block: their bounds, the soft impulses of the direct solver, and those of sweeps.

use glamx::DVec3;

use super::{LinkRows, LinkState};
use crate::dynamics::constraint::three_rows::weigh;

impl LinkRows {
    /// Returns an impulse within its bounds.
    pub fn bounded(&self, [n, t, u]: [f64; 3]) -> ([f64; 3], LinkState) {
        if self.is_one_sided && n <= 0.0 {
            return ([0.0; 3], LinkState::Open);
        }
        let size = DVec3::new(n, t, u).length();
        if size <= self.most {
            return ([n, t, u], LinkState::Holds);
        }
        let part = self.most / size;
        ([n * part, t * part, u * part], LinkState::Saturated)
    }

    /// Returns target - J v - R p, at these velocities of the rows.
    pub fn residual(&self, velocities: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| self.targets[k] - velocities[k] - self.compliance * self.rows.impulse[k])
    }

    /// Returns the impulse of the soft block at these velocities, and the weights of its derivative.
    pub fn soft(&self, velocities: [f64; 3]) -> ([f64; 3], [f64; 6], LinkState) {
        let hardness = 1.0 / self.compliance;
        let raw = [0, 1, 2].map(|k| (self.targets[k] - velocities[k]) * hardness);
        let (impulse, state) = self.bounded(raw);
        let weights = match state {
            LinkState::Open => [0.0; 6],
            LinkState::Holds => [hardness, 0.0, 0.0, hardness, 0.0, hardness],
            LinkState::Saturated => {
                let size = DVec3::from_array(raw).length();
                let (w, [n, t, u]) = (hardness * self.most / size, raw.map(|raw| raw / size));
                let [nt, nu, tu] = [-w * n * t, -w * n * u, -w * t * u];
                [w * (1.0 - n * n), nt, nu, w * (1.0 - t * t), tu, w * (1.0 - u * u)]
            }
        };
        (impulse, weights, state)
    }

    /// Like [`soft`](Self::soft), for known active rows; a saturated block keeps its impulse.
    pub fn given(&self, velocities: [f64; 3]) -> ([f64; 3], [f64; 6]) {
        let hardness = 1.0 / self.compliance;
        match self.state {
            LinkState::Open => ([0.0; 3], [0.0; 6]),
            LinkState::Saturated => (self.rows.impulse, [0.0; 6]),
            LinkState::Holds => (
                [0, 1, 2].map(|k| (self.targets[k] - velocities[k]) * hardness),
                [hardness, 0.0, 0.0, hardness, 0.0, hardness],
            ),
        }
    }

    /// Returns the weights times changes of velocities.
    pub fn weighted(&self, [n, t, u]: [f64; 3]) -> [f64; 3] {
        weigh(self.weights, [n, t, u])
    }

    /// Applies the impulse that makes the block's rows hold, within its bounds. Returns the largest change of
    /// a row's velocity.
    pub fn solve(&mut self, blocks: &[f64], velocities: &mut [f64]) -> f64 {
        let residual = self.residual(self.rows.velocities(blocks, velocities));
        let step = weigh(self.inverse, residual);
        let before = self.rows.impulse;
        let (mut impulse, mut state) = self.bounded([0, 1, 2].map(|k| before[k] + step[k]));
        let [nn, _, _, tt, _, uu] = self.rows.effect;
        if state == LinkState::Saturated && !self.is_one_sided {
            // As for slipping friction: a step against the motion.
            let length = 1.0 / (nn + tt + uu + self.compliance);
            (impulse, state) = self.bounded([0, 1, 2].map(|k| before[k] + length * residual[k]));
        }
        self.state = state;
        let change = [0, 1, 2].map(|k| impulse[k] - before[k]);
        if change == [0.0; 3] {
            return 0.0;
        }
        self.rows.impulse = impulse;
        self.rows.apply_impulse(blocks, change, velocities);
        (change[0] * nn).abs().max((change[1] * tt).abs()).max((change[2] * uu).abs())
    }
}
