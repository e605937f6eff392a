//! Rows of a step.

use serde::{Deserialize, Serialize};

use super::{Constraints, ERROR_REDUCTION, Row, RowKey, WARM_START};
use crate::dynamics::actuator::Axis;
use crate::dynamics::bullet;
use crate::dynamics::integrator::Integrator;
use crate::dynamics::real::{MaskOf, Real};
use crate::dynamics::tree::{JointType, Tree};

/// Impulses of the last step, by purpose.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Impulses {
    /// Impulses of dry friction, one for each degree of freedom, N m s or N s.
    pub friction: Vec<f64>,
    /// Impulses of mimic joints, by pair, and then two of each tendon.
    pub mimic: Vec<f64>,
    /// Impulses of lower limits, one for each degree of freedom.
    pub lower: Vec<f64>,
    /// Impulses of upper limits, one for each degree of freedom.
    pub upper: Vec<f64>,
}

impl Impulses {
    /// Creates zero impulses for a tree.
    pub fn new(tree: &Tree) -> Self {
        let zeros = vec![0.0; tree.velocity_count];
        Self { friction: zeros.clone(), mimic: vec![0.0; coupled(tree)], lower: zeros.clone(), upper: zeros }
    }

    /// Returns all impulses.
    pub fn values(&self) -> impl Iterator<Item = f64> + '_ {
        let Self { friction, mimic, lower, upper } = self;
        [friction, mimic, lower, upper].into_iter().flatten().copied()
    }

    /// Returns for each list its name, its length, and its length for a tree.
    pub fn lengths(&self, tree: &Tree) -> [(&'static str, usize, usize); 4] {
        let (n, pairs) = (tree.velocity_count, coupled(tree));
        [
            ("impulses of friction", self.friction.len(), n),
            ("impulses of joints that follow others", self.mimic.len(), pairs),
            ("impulses of lower limits", self.lower.len(), n),
            ("impulses of upper limits", self.upper.len(), n),
        ]
    }

    /// Returns the impulse of a key; 0 if there is none.
    pub(in crate::dynamics) fn get(&self, key: RowKey) -> f64 {
        let impulse = match key {
            RowKey::Friction(i) => self.friction.get(i),
            RowKey::Mimic(i) => self.mimic.get(i),
            RowKey::Lower(i) => self.lower.get(i),
            RowKey::Upper(i) => self.upper.get(i),
            RowKey::Tendon(i, is_driven) => self.mimic.get(of_tendon(self.mimic.len(), i, is_driven)),
        };
        impulse.copied().unwrap_or(0.0)
    }

    fn slot(&mut self, key: RowKey) -> Option<&mut f64> {
        match key {
            RowKey::Friction(i) => self.friction.get_mut(i),
            RowKey::Mimic(i) => self.mimic.get_mut(i),
            RowKey::Lower(i) => self.lower.get_mut(i),
            RowKey::Upper(i) => self.upper.get_mut(i),
            RowKey::Tendon(i, is_driven) => {
                let at = of_tendon(self.mimic.len(), i, is_driven);
                self.mimic.get_mut(at)
            }
        }
    }

    /// Stores the final impulses of the rows; those without a row are cleared.
    pub fn keep(&mut self, rows: &[Row]) {
        for list in [&mut self.friction, &mut self.mimic, &mut self.lower, &mut self.upper] {
            list.fill(0.0);
        }
        for row in rows {
            if let Some(slot) = self.slot(row.key) {
                *slot = row.impulse;
            }
        }
    }
}

/// Returns the number of impulses of mimic joints and tendons.
fn coupled(tree: &Tree) -> usize {
    tree.mimics.len() + 2 * tree.tendons.len()
}

/// Returns the place of a tendon's impulse in a list of this length: from its end, so that those of mimic
/// joints keep theirs.
fn of_tendon(count: usize, tendon: usize, is_driven: bool) -> usize {
    count.wrapping_sub(2 * tendon + 1 + usize::from(is_driven))
}

/// Collects the rows for a step of `h` from positions `q` at velocities `qd`, except those of tendons.
///
/// * limit: qd + distance / h >= 0 inside, so that the joint arrives and does not pass; qd >= ERROR_REDUCTION
///   depth / h beyond. Only if the joint could arrive within the step, by twice its present velocity and by
///   `velocities`, the new velocities without constraints. [Bullet's limits](bullet) act only beyond.
/// * friction: towards velocity 0, with an impulse of at most friction h.
/// * mimic: qd_follower - multiplier qd_leader = -ERROR_REDUCTION error / h.
pub fn collect(
    tree: &Tree,
    axes: &[Axis],
    (q, velocities): (&[f64], &[f64]),
    warm: &Impulses,
    (integrator, h): (Integrator, f64),
    Constraints { rows, .. }: &mut Constraints,
) {
    rows.clear();
    let mut add = |key, entries, bodies, bias, least: f64, most: f64| {
        let start = warm.get(key) * WARM_START;
        let impulse = start.clamp(least, most);
        rows.push(Row { key, entries, bodies, bias, least, most, impulse, effect: 0.0, sum: None });
    };
    let axes_of = |body: usize| {
        let body = &tree.bodies[body];
        (body.velocity, q[body.position])
    };
    for (i, body) in tree.bodies.iter().enumerate() {
        if matches!(body.joint_type, JointType::Free { .. }) || body.is_tendon {
            continue;
        }
        let (velocity, _) = axes_of(i);
        let friction = axes[velocity].settings.friction * h;
        if friction > 0.0 {
            add(
                RowKey::Friction(velocity),
                [(velocity, 1.0), (velocity, 0.0)],
                [i, i],
                0.0,
                -friction,
                friction,
            );
        }
    }
    for (index, pair) in tree.mimics.iter().enumerate() {
        let ((follower, q_follower), (leader, q_leader)) = (axes_of(pair.follower), axes_of(pair.leader));
        let error = q_follower - pair.multiplier * q_leader - pair.offset;
        let entries = [(follower, 1.0), (leader, -pair.multiplier)];
        let bias = ERROR_REDUCTION * error / h;
        let bodies = [pair.follower, pair.leader];
        add(RowKey::Mimic(index), entries, bodies, bias, f64::NEG_INFINITY, f64::INFINITY);
    }
    let is_bullets = integrator.bullet().is_some();
    // A joint at its limit has only the side that pushes back.
    let bias = |distance: f64| {
        if is_bullets { bullet::limit_bias(distance, h) } else { limit_bias(distance, h) }
    };
    let most = if is_bullets { bullet::MAX_LIMIT_IMPULSE } else { f64::INFINITY };
    for (i, body) in tree.bodies.iter().enumerate() {
        if matches!(body.joint_type, JointType::Free { .. } | JointType::Spherical { .. }) || body.is_tendon {
            continue;
        }
        let (velocity, position) = axes_of(i);
        let limits = &axes[velocity].settings.limits;
        // Other rows and joints may still change the velocity: look ahead twice as far as it moves, and a
        // little further.
        let reach =
            if is_bullets { f64::MIN_POSITIVE } else { 2.0 * h * velocities[velocity].abs() + LIMIT_MARGIN };
        if let Some(lower) = limits.lower {
            let distance = position - lower;
            if distance < reach {
                let entries = [(velocity, 1.0), (velocity, 0.0)];
                add(RowKey::Lower(velocity), entries, [i, i], bias(distance), 0.0, most);
            }
        }
        if let Some(upper) = limits.upper {
            let distance = upper - position;
            if distance < reach {
                let entries = [(velocity, -1.0), (velocity, 0.0)];
                add(RowKey::Upper(velocity), entries, [i, i], bias(distance), 0.0, most);
            }
        }
    }
}

/// Returns the bias of a limit's row: inside, the joint may move to the limit; beyond, it returns by a part
/// of the distance.
#[inline(always)]
pub(in crate::dynamics) fn limit_bias<R: Real>(distance: R, h: R) -> R {
    let mut bias = distance / h;
    let is_beyond = distance.lt(h.splat(0.0));
    if is_beyond.any() {
        bias = is_beyond.select(h.splat(ERROR_REDUCTION) * distance / h, bias);
    }
    bias
}

/// Distance from a limit within which a joint has a row whatever its velocity, rad or m.
pub(in crate::dynamics) const LIMIT_MARGIN: f64 = 1e-3;
