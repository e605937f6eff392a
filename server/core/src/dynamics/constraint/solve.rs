//! Projected Gauss-Seidel on the velocities of one robot: its rows of joints.

use super::{
    Constraints, MAX_LIMIT_START, MAX_SWEEPS, Row, RowKey, SETTLED, Sums, respond, respond_to_joints,
};
use crate::dynamics::scratch::{MAX_RHS, Scratch};
use crate::dynamics::tree::Tree;

/// Changes `velocities` until every row holds, or the maximum number of sweeps is reached.
///
/// Erleben, "Stable, robust, and versatile multibody dynamics animation" (2005), chapter 5. Each row in turn
/// gets the impulse that makes J qd + bias vanish, bounded in its sum.
pub fn solve(
    tree: &Tree,
    q: &[f64],
    constraints: &mut Constraints,
    scratch: &mut Scratch,
    velocities: &mut [f64],
) {
    if !constraints.rows.is_empty() {
        find_responses(tree, q, constraints, scratch, velocities.len());
        drop_useless_starts(constraints, velocities);
        start(constraints, velocities);
        for _ in 0..MAX_SWEEPS {
            if sweep(constraints, velocities) <= SETTLED {
                break;
            }
        }
    }
}

/// Computes the effect of each row's impulse, and applies its initial impulse.
pub fn prepare(
    tree: &Tree,
    q: &[f64],
    constraints: &mut Constraints,
    scratch: &mut Scratch,
    velocities: &mut [f64],
) {
    find_responses(tree, q, constraints, scratch, velocities.len());
    start(constraints, velocities);
}

/// Computes the effect of each row's impulse on all `n` velocities.
fn find_responses(tree: &Tree, q: &[f64], constraints: &mut Constraints, scratch: &mut Scratch, n: usize) {
    let Constraints { rows, responses, sums } = constraints;
    if responses.len() < rows.len() * n {
        responses.resize(rows.len() * n, 0.0);
    }
    if rows.is_empty() {
        return;
    }
    if scratch.rhs.is_empty() {
        for (row, response) in rows.iter().zip(responses.chunks_exact_mut(n)) {
            let [a, b] = row.entries;
            let joints = [(row.bodies[0], a.1), (row.bodies[1], b.1)];
            respond(tree, q, &joints, scratch, response);
        }
    } else {
        for (rows, responses) in rows.chunks(MAX_RHS).zip(responses.chunks_mut(MAX_RHS * n)) {
            respond_to_joints(tree, q, (rows, sums), scratch, &mut responses[..rows.len() * n]);
        }
    }
    for (row, response) in rows.iter_mut().zip(responses.chunks_exact(n)) {
        if let Some(sum) = row.sum {
            row.effect = sums.velocity(sum, response);
            row.bias = sums.soften(sum, row.effect, row.bias);
            continue;
        }
        let [a, b] = row.entries;
        row.effect = a.1 * response[a.0] + b.1 * response[b.0];
    }
}

/// Clears initial impulses of limits that would change their own velocities far more than any row asks for.
/// They come from another round, in which an actuator did not yet count as saturated. Sweeps would take too
/// long to undo them, since both limits of a joint alternate.
fn drop_useless_starts(Constraints { rows, sums, .. }: &mut Constraints, velocities: &[f64]) {
    // A soft row asks for no velocity.
    let asked = rows.iter().filter(|row| !matches!(row.key, RowKey::Tendon(..)));
    let asked = asked.map(|row| row.velocity(sums, velocities).abs() + row.bias.abs());
    let most = MAX_LIMIT_START * asked.fold(0.0, f64::max);
    for row in rows.iter_mut().filter(|row| matches!(row.key, RowKey::Lower(_) | RowKey::Upper(_))) {
        if row.impulse * row.effect > most {
            row.impulse = 0.0;
        }
    }
}

/// Applies the rows' initial impulses.
fn start(Constraints { rows, responses, .. }: &mut Constraints, velocities: &mut [f64]) {
    if rows.is_empty() {
        return;
    }
    for (row, response) in rows.iter_mut().zip(responses.chunks_exact(velocities.len())) {
        if row.effect > 0.0 {
            add_scaled(velocities, response, row.impulse);
        } else {
            row.impulse = 0.0;
        }
    }
}

/// Sweeps once through all rows. Returns the largest change of a row's own velocity, rad/s or m/s.
pub fn sweep(constraints: &mut Constraints, velocities: &mut [f64]) -> f64 {
    let Constraints { rows, responses, sums } = constraints;
    let mut largest = 0.0f64;
    if rows.is_empty() {
        return largest;
    }
    for (row, response) in rows.iter_mut().zip(responses.chunks_exact(velocities.len())) {
        if row.effect <= 0.0 {
            continue;
        }
        if let Some(sum) = row.sum {
            largest = largest.max(sweep_sum(row, (sum, sums), response, velocities));
            continue;
        }
        let [a, b] = row.entries;
        let velocity = a.1 * velocities[a.0] + b.1 * velocities[b.0] + row.bias;
        let impulse = (row.impulse - velocity / row.effect).clamp(row.least, row.most);
        let change = impulse - row.impulse;
        if change != 0.0 {
            row.impulse = impulse;
            add_scaled(velocities, response, change);
            largest = largest.max((change * row.effect).abs());
        }
    }
    largest
}

/// Solves a row on a sum of joints. Returns the change of its velocity.
#[cold]
fn sweep_sum(row: &mut Row, (sum, sums): (u32, &Sums), response: &[f64], velocities: &mut [f64]) -> f64 {
    let compliance = sums.compliance(sum);
    let residual = sums.velocity(sum, velocities) + row.bias + compliance * row.impulse;
    let impulse = (row.impulse - residual / (row.effect + compliance)).clamp(row.least, row.most);
    let change = impulse - row.impulse;
    row.impulse = impulse;
    add_scaled(velocities, response, change);
    (change * row.effect).abs()
}

/// Computes velocities += factor * response.
#[inline]
fn add_scaled(velocities: &mut [f64], response: &[f64], factor: f64) {
    for (velocity, response) in velocities.iter_mut().zip(response) {
        *velocity += factor * response;
    }
}
