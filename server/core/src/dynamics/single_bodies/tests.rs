//! Comparison of several contacts at once with one after the other.

use glamx::DQuat;
use pulp::Arch;

use super::*;
use crate::dynamics::constraint::momentum::sweep_carried;
use crate::dynamics::constraint::side::Side;

const BODIES: usize = 60;

/// Random numbers: Marsaglia, "Xorshift RNGs" (2003).
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn index(&mut self, count: usize) -> usize {
        self.next() as usize % count
    }

    fn between(&mut self, least: f64, most: f64) -> f64 {
        least + (most - least) * (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Returns bodies whose resistance to turning is equal about any axis, or is not.
fn bodies(random: &mut Random, alike: bool) -> Vec<SingleBody> {
    let body = |_| {
        let [x, y, z] = [0, 1, 2].map(|_| random.between(0.5, 20.0));
        let mut inverse_moment =
            DMat3::from_diagonal(if alike { DVec3::splat(x) } else { DVec3::new(x, y, z) });
        if !alike {
            let turn = DMat3::from_quat(DQuat::from_rotation_x(1.0) * DQuat::from_rotation_y(0.5));
            inverse_moment = turn * inverse_moment * turn.transpose();
        }
        SingleBody { inverse_mass: random.between(0.1, 3.0), center: DVec3::ZERO, inverse_moment }
    };
    (0..BODIES).map(body).collect()
}

/// Returns contacts between random bodies, or with immovable ones; some do not act.
fn contacts(random: &mut Random, bodies: &[SingleBody], count: usize) -> (Vec<ContactRows>, Vec<f64>) {
    let (mut all, mut blocks) = (Vec::new(), Vec::new());
    for contact in 0..count {
        let first = random.index(BODIES);
        let second = (first + 1 + random.index(BODIES - 1)) % BODIES;
        let mut rows = ContactRows { contact, ..ContactRows::default() };
        let mut vector = || DVec3::from_array([0, 1, 2].map(|_| random.between(-1.0, 1.0)));
        let normal = vector().normalize();
        let (t, u) = normal.any_orthonormal_pair();
        let (touched, from) =
            if contact % 5 == 0 { (vec![first], contact % 2) } else { (vec![first, second], 0) };
        for ((side, body), sign) in rows.sides.iter_mut().zip(touched).zip([-1.0, 1.0].into_iter().skip(from))
        {
            let at = blocks.len();
            *side = Side { member: body, first: SIX * body, len: SIX, at, ..Side::default() }.with_all();
            let arm = vector();
            let axes = [normal, t, u].map(|axis| axis * sign);
            let moments = axes.map(|axis| arm.cross(axis));
            for pair in 0..3 {
                for k in 0..3 {
                    let six = [axes[k].to_array(), moments[k].to_array()];
                    blocks.extend(&six.as_flattened()[2 * pair..2 * pair + 2]);
                }
            }
            let SingleBody { inverse_mass, inverse_moment, .. } = bodies[body];
            for k in 0..3 {
                blocks.extend((axes[k] * inverse_mass).to_array());
                blocks.extend((inverse_moment * moments[k]).to_array());
            }
        }
        if contact % 11 != 0 {
            rows.measure(&blocks);
        }
        rows.target = random.between(-0.1, 0.3);
        rows.correction_velocity = if contact % 4 == 0 { 0.0 } else { random.between(0.0, 0.2) };
        rows.friction = if contact % 7 == 0 { 0.0 } else { random.between(0.0, 1.0) };
        rows.compliance = if contact % 13 == 0 { 0.1 } else { 0.0 };
        rows.drift = if contact % 3 == 0 { [0.01, -0.02] } else { [0.0; 2] };
        rows.impulse = if contact % 2 == 0 { [0.1, 0.02, -0.03] } else { [0.0; 3] };
        all.push(rows);
    }
    (all, blocks)
}

#[test]
fn several_contacts_at_once_have_the_bits_of_one_after_the_other() {
    let mut random = Random(0x9E37_79B9);
    let mut memory = SingleBodies::default();
    for (count, sweeps, alike) in
        [(300, 50, true), (300, 50, false), (120, 3, false), (40, 1, true), (300, 50, true)]
    {
        let bodies = bodies(&mut random, alike);
        let (mut rows, blocks) = contacts(&mut random, &bodies, count);
        let start: Vec<f64> = (0..SIX * BODIES).map(|_| random.between(-1.0, 1.0)).collect();
        let (mut expected, mut velocities) = (rows.clone(), start.clone());
        let mut before: Vec<_> = rows.iter().map(|rows| rows.impulse).collect();
        let mut momentum = Momentum::default();
        momentum.begin(&velocities);
        for sweep in 0..sweeps {
            let part = momentum.carry(&mut velocities, sweep + 1 == sweeps);
            momentum.note(sweep_carried((&mut expected, &mut before), part, &blocks, &mut velocities));
        }
        let mut found = start.clone();
        assert!(memory.take(bodies.into_iter().map(Some)));
        momentum.begin(&found);
        let with_momentum = (&mut found, &mut momentum);
        let swept = memory.sweep((&mut rows, &blocks), with_momentum, (sweeps, -1.0), &|| false);
        if Arch::new().dispatch(Width) < 2 {
            assert_eq!(swept, None);
            return;
        }
        assert_eq!(swept, Some(true));
        let bits = |values: &[f64]| values.iter().map(|value| value.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&found), bits(&velocities), "{count} contacts");
        let impulses = |rows: &[ContactRows]| rows.iter().map(|rows| bits(&rows.impulse)).collect::<Vec<_>>();
        assert_eq!(impulses(&rows), impulses(&expected), "{count} contacts");
        assert_ne!(bits(&found), bits(&start));

        let mut split = vec![0.0; SIX * BODIES];
        assert!(memory.correct(&rows, &mut split, 5));
        let mut expected_split = vec![0.0; SIX * BODIES];
        for _ in 0..5 {
            for rows in expected.iter_mut().filter(|rows| rows.acts()) {
                rows.correct_position(&blocks, &mut expected_split);
            }
        }
        assert_eq!(bits(&split), bits(&expected_split), "{count} contacts");
        assert!(split.iter().any(|velocity| *velocity != 0.0));
    }
}

/// Number of lanes of the processor.
struct Width;

impl WithSimd for Width {
    type Output = usize;

    fn with_simd<S: Simd>(self, _: S) -> usize {
        S::F64_LANES
    }
}

#[test]
fn contacts_that_follow_from_each_other_are_left_to_sweeps_one_after_the_other() {
    let mut random = Random(0x9E37_79B9);
    let bodies = bodies(&mut random, true);
    let (mut rows, blocks) = contacts(&mut random, &bodies, 100);
    for rows in &mut rows {
        // All of one body.
        (rows.sides[0].first, rows.sides[1].len) = (0, 0);
    }
    let mut velocities = vec![0.5; SIX * BODIES];
    let mut memory = SingleBodies::default();
    assert!(memory.take(bodies.into_iter().map(Some)));
    let with_momentum = (&mut velocities, &mut Momentum::default());
    assert_eq!(memory.sweep((&mut rows, &blocks), with_momentum, (50, 0.0), &|| false), None);
    assert_eq!(velocities, vec![0.5; SIX * BODIES]);
}

#[test]
fn contacts_of_other_bodies_are_left_to_serial_sweeps() {
    let mut random = Random(0x9E37_79B9);
    let mut bodies = bodies(&mut random, true);
    let (mut rows, blocks) = contacts(&mut random, &bodies, 100);
    for body in &mut bodies {
        body.inverse_mass *= 2.0;
    }
    let mut velocities = vec![0.5; SIX * BODIES];
    let mut memory = SingleBodies::default();
    assert!(memory.take(bodies.iter().copied().map(Some)));
    let with_momentum = (&mut velocities, &mut Momentum::default());
    assert_eq!(memory.sweep((&mut rows, &blocks), with_momentum, (50, 0.0), &|| false), None);
    assert_eq!(velocities, vec![0.5; SIX * BODIES]);
    bodies[0].center = DVec3::X;
    assert!(!memory.take(bodies.into_iter().map(Some)));
    assert!(!memory.take([None].into_iter()));
}

#[test]
fn sweeps_end_where_they_are_interrupted() {
    let mut random = Random(0x9E37_79B9);
    let bodies = bodies(&mut random, true);
    let (mut rows, blocks) = contacts(&mut random, &bodies, 300);
    let mut velocities = vec![0.5; SIX * BODIES];
    let mut memory = SingleBodies::default();
    assert!(memory.take(bodies.into_iter().map(Some)));
    let with_momentum = (&mut velocities, &mut Momentum::default());
    let swept = memory.sweep((&mut rows, &blocks), with_momentum, (50, 0.0), &|| true);
    assert!(swept.is_none_or(|is_whole| !is_whole));
    assert_eq!(velocities, vec![0.5; SIX * BODIES]);
}
