//! Rows on sums of joints: tendons.
//!
//! A tendon is a joint that moves no body itself. Its position is a sum of the positions of others, and each
//! of its forces acts on these with their factors:
//!
//! * limits and dry friction, as those of a joint;
//! * its spring, damper and armature, and its actuator. Their impulse is `p - r J qd+`, where r is what the
//!   law adds to D of an ordinary joint, and p its impulse at J qd+ = 0. As a row with a compliance it is
//!   `J qd+ + 1/r impulse = p / r`, and the actuator's limit bounds the impulse.

use std::ops::Range;

use super::{Constraints, Impulses, LIMIT_MARGIN, Row, RowKey, WARM_START, limit_bias};
use crate::dynamics::actuator::{Axis, Drive};
use crate::dynamics::integrator::Integrator;
use crate::dynamics::tendon::implicitness;
use crate::dynamics::tree::{Tendon, Tree};

/// Smallest resistance of a law as a part of 1 / (J M^-1 J'): a constant effort has none.
const LEAST_RESISTANCE: f64 = 1e-9;

/// J of rows on sums of joints: scratch of a step.
#[derive(Clone, Debug, Default)]
pub struct Sums {
    rows: Vec<Sum>,
    terms: Vec<Term>,
}

/// A joint of a sum.
#[derive(Clone, Copy, Debug)]
pub struct Term {
    /// Its body.
    pub body: usize,
    /// Index of its velocity.
    pub velocity: usize,
    /// Its factor.
    pub factor: f64,
}

/// J of a row, and its law.
#[derive(Clone, Debug)]
struct Sum {
    terms: Range<usize>,
    law: Option<Law>,
    /// 1 / r; 0 without a law.
    compliance: f64,
}

/// impulse = push - resistance J qd+.
#[derive(Clone, Copy, Debug)]
struct Law {
    push: f64,
    resistance: f64,
}

impl Sums {
    /// Returns the joints of a row.
    pub fn terms(&self, sum: u32) -> &[Term] {
        &self.terms[self.rows[sum as usize].terms.clone()]
    }

    /// Returns J qd.
    pub fn velocity(&self, sum: u32, velocities: &[f64]) -> f64 {
        self.terms(sum).iter().map(|term| term.factor * velocities[term.velocity]).sum()
    }

    /// Returns the compliance of a row.
    pub fn compliance(&self, sum: u32) -> f64 {
        self.rows[sum as usize].compliance
    }

    /// Sets the compliance of a row whose J M^-1 J' is known. Returns its bias, which is the given one
    /// without a law.
    pub fn soften(&mut self, sum: u32, effect: f64, bias: f64) -> f64 {
        let row = &mut self.rows[sum as usize];
        let Some(Law { push, resistance }) = row.law.filter(|_| effect > 0.0) else { return bias };
        row.compliance = 1.0 / resistance.max(LEAST_RESISTANCE / effect);
        -push * row.compliance
    }

    fn clear(&mut self) {
        self.rows.clear();
        self.terms.clear();
    }

    /// Adds the joints of a row, with their factors multiplied by `sign`. Returns its index.
    fn add(&mut self, tree: &Tree, tendon: &Tendon, sign: f64, law: Option<Law>) -> Option<u32> {
        let first = self.terms.len();
        self.terms.extend(tendon.terms.iter().map(|&(body, factor)| Term {
            body,
            velocity: tree.bodies[body].velocity,
            factor: sign * factor,
        }));
        self.rows.push(Sum { terms: first..self.terms.len(), law, compliance: 0.0 });
        u32::try_from(self.rows.len() - 1).ok()
    }
}

/// State of a robot from which the rows of its tendons follow.
#[derive(Clone, Copy, Debug)]
pub struct OfTendons<'a> {
    /// Settings and targets.
    pub axes: &'a [Axis],
    /// Laws of this step.
    pub drives: &'a [Drive],
    /// Positions q.
    pub positions: &'a [f64],
    /// Velocities that the step changes.
    pub half_velocities: &'a [f64],
    /// New velocities without constraints.
    pub new_velocities: &'a [f64],
    /// Impulses of the last step.
    pub warm: &'a Impulses,
}

/// Adds the rows of tendons for a step of `h`.
pub fn collect_tendons(
    tree: &Tree,
    OfTendons { axes, drives, positions, half_velocities, new_velocities, warm }: OfTendons<'_>,
    (h, integrator): (f64, Integrator),
    Constraints { rows, sums, .. }: &mut Constraints,
) {
    sums.clear();
    for (index, tendon) in tree.tendons.iter().enumerate() {
        let body = &tree.bodies[tendon.body];
        let (dof, q) = (body.velocity, positions[body.position]);
        let (settings, drive) = (&axes[dof].settings, &drives[dof]);
        let mut add = |key, sign: f64, law, (bias, least, most): (f64, f64, f64)| {
            let impulse = (warm.get(key) * WARM_START).clamp(least, most);
            let sum = sums.add(tree, tendon, sign, law);
            let (entries, bodies) = ([(0, 0.0); 2], [0; 2]);
            rows.push(Row { key, entries, bodies, bias, least, most, impulse, effect: 0.0, sum });
        };
        let friction = settings.friction * h;
        if friction > 0.0 {
            add(RowKey::Friction(dof), 1.0, None, (0.0, -friction, friction));
        }
        let velocity = tendon.velocity(tree, new_velocities);
        let reach = 2.0 * h * velocity.abs() + LIMIT_MARGIN;
        let both = [
            (RowKey::Lower(dof), 1.0, settings.limits.lower.map(|lower| q - lower)),
            (RowKey::Upper(dof), -1.0, settings.limits.upper.map(|upper| upper - q)),
        ];
        for (key, sign, distance) in both {
            if let Some(distance) = distance.filter(|distance| *distance < reach) {
                add(key, sign, None, (limit_bias(distance, h), 0.0, f64::INFINITY));
            }
        }
        let before = tendon.velocity(tree, half_velocities);
        let at = implicitness((&axes[dof], drive), (h, integrator));
        let own = settings.own_forces();
        let resistance = own.resistance(h, at);
        let unbounded = (0.0, f64::NEG_INFINITY, f64::INFINITY);
        if resistance > 0.0 {
            let push = h * own.steady_effort(q, before, h, at) + resistance * before;
            add(RowKey::Tendon(index, false), 1.0, Some(Law { push, resistance }), unbounded);
        }
        let resistance = drive.resistance_of_law(h, at);
        let push = h * drive.steady_law(q, before, h, at) + resistance * before;
        if (resistance > 0.0 || push != 0.0) && drive.limit > 0.0 {
            let most = drive.limit * h;
            add(RowKey::Tendon(index, true), 1.0, Some(Law { push, resistance }), (0.0, -most, most));
        }
    }
}
