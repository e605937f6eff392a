//! Projected Gauss-Seidel on the rates of one robot: its rows of joints.

use super::{Constraints, MAX_SWEEPS, SETTLED, respond};
use crate::dynamics::tree::Tree;
use crate::dynamics::work::Workspace;

/// Changes `rates` until every row holds, or the sweeps are used up.
///
/// Erleben, "Stable, robust, and versatile multibody dynamics animation" (2005),
/// chapter 5: each row in turn gets the impulse that makes J qd + bias vanish,
/// bounded in its sum.
pub fn solve(tree: &Tree, q: &[f64], constraints: &mut Constraints, work: &mut Workspace, rates: &mut [f64]) {
    if !constraints.rows.is_empty() {
        prepare(tree, q, constraints, work, rates);
        for _ in 0..MAX_SWEEPS {
            if sweep(constraints, rates) <= SETTLED {
                break;
            }
        }
    }
    keep(constraints);
}

/// Finds what each row's impulse does, and gives it the impulse that it starts from.
pub fn prepare(
    tree: &Tree,
    q: &[f64],
    constraints: &mut Constraints,
    work: &mut Workspace,
    rates: &mut [f64],
) {
    let n = rates.len();
    let Constraints { rows, responses, .. } = constraints;
    if responses.len() < rows.len() * n {
        responses.resize(rows.len() * n, 0.0);
    }
    if rows.is_empty() {
        return;
    }
    for (row, response) in rows.iter_mut().zip(responses.chunks_exact_mut(n)) {
        let [a, b] = row.entries;
        let joints = [(row.bodies[0], a.1), (row.bodies[1], b.1)];
        respond(tree, q, &joints, work, response);
        row.effect = a.1 * response[a.0] + b.1 * response[b.0];
        if row.effect > 0.0 {
            add_scaled(rates, response, row.impulse);
        } else {
            row.impulse = 0.0;
        }
    }
}

/// Once through all rows. The largest change of a row's own rate, rad/s or m/s.
pub fn sweep(constraints: &mut Constraints, rates: &mut [f64]) -> f64 {
    let Constraints { rows, responses, .. } = constraints;
    let mut largest = 0.0f64;
    if rows.is_empty() {
        return largest;
    }
    for (row, response) in rows.iter_mut().zip(responses.chunks_exact(rates.len())) {
        if row.effect <= 0.0 {
            continue;
        }
        let [a, b] = row.entries;
        let rate = a.1 * rates[a.0] + b.1 * rates[b.0] + row.bias;
        let impulse = (row.impulse - rate / row.effect).clamp(row.least, row.most);
        let change = impulse - row.impulse;
        if change != 0.0 {
            row.impulse = impulse;
            add_scaled(rates, response, change);
            largest = largest.max((change * row.effect).abs());
        }
    }
    largest
}

/// Keeps the impulses for the next step's start.
pub fn keep(constraints: &mut Constraints) {
    constraints.warm.keep(&constraints.rows);
}

/// rates += factor * response.
#[inline]
fn add_scaled(rates: &mut [f64], response: &[f64], factor: f64) {
    for (rate, response) in rates.iter_mut().zip(response) {
        *rate += factor * response;
    }
}
