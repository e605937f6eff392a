//! Saved states whose messages are whole and whose numbers, lengths and places are not: each is refused, or
//! is a world that can be stepped. A seed makes each run the same; `SIMD_MUTATIONS` asks for more of each file.
#![cfg(test)]

use std::fs;
use std::path::Path;

use fastrand::Rng;
use prost::Message as _;
use simd_fuzz_targets::saved_states;
use simd_proto::v1;

const NUMBERS: &[f64] = &[
    f64::NAN,
    f64::INFINITY,
    f64::NEG_INFINITY,
    -1.0,
    0.0,
    -0.0,
    1e-300,
    1e12,
    1e60,
    1e150,
    1e300,
    f64::MAX,
];

fn of_body(body: &mut v1::SavedStateBody) -> [&mut Vec<f64>; 12] {
    [
        &mut body.base,
        &mut body.positions,
        &mut body.rates,
        &mut body.rates_before,
        &mut body.axes,
        &mut body.laws,
        &mut body.efforts,
        &mut body.external,
        &mut body.friction_impulses,
        &mut body.mimic_impulses,
        &mut body.lower_impulses,
        &mut body.upper_impulses,
    ]
}

/// All lists of numbers that there are.
fn numbers(file: &mut v1::SavedStateFile) -> Vec<&mut Vec<f64>> {
    let mut lists = vec![&mut file.gravity];
    lists.extend(file.contacts.iter_mut().map(|contacts| &mut contacts.values));
    for robot in &mut file.robots {
        lists.extend([&mut robot.surfaces, &mut robot.colliders, &mut robot.last_positions]);
        lists.push(&mut robot.last_rates);
        lists.extend([&mut robot.body, &mut robot.spawned].into_iter().flatten().flat_map(of_body));
        let pushes = [&mut robot.pushes, &mut robot.passed].into_iter().flatten();
        lists.extend(pushes.map(|pushes| &mut pushes.values));
    }
    lists
}

/// All lists of places and bits.
fn places(file: &mut v1::SavedStateFile) -> Vec<&mut Vec<u32>> {
    let mut lists = vec![&mut file.merged];
    lists.extend(file.contacts.iter_mut().map(|contacts| &mut contacts.pairs));
    for robot in &mut file.robots {
        let bodies = [&mut robot.body, &mut robot.spawned].into_iter().flatten();
        lists.extend(bodies.map(|body| &mut body.given));
        let pushes = [&mut robot.pushes, &mut robot.passed].into_iter().flatten();
        lists.extend(pushes.flat_map(|pushes| [&mut pushes.links, &mut pushes.flags]));
    }
    lists
}

/// Changes an entry of a list, takes some out, or doubles some.
fn change<T: Copy>(rng: &mut Rng, list: &mut Vec<T>, value: T) {
    let at = rng.usize(0..=list.len());
    let end = (at + rng.usize(0..20)).min(list.len());
    match rng.u8(0..8) {
        0 => drop(list.drain(at..end)),
        1 => list.extend_from_within(at..end),
        _ => list.iter_mut().skip(at).take(1).for_each(|entry| *entry = value),
    }
}

fn mutate(rng: &mut Rng, file: &mut v1::SavedStateFile) {
    for _ in 0..rng.usize(1..4) {
        match rng.u8(0..8) {
            0..5 => {
                let mut lists = numbers(file);
                let place = rng.usize(..lists.len());
                let value = match rng.u8(0..3) {
                    0 => rng.f64() * 2.0 - 1.0,
                    _ => NUMBERS[rng.usize(..NUMBERS.len())],
                };
                change(rng, lists[place], value);
            }
            5 => {
                let mut lists = places(file);
                let place = rng.usize(..lists.len());
                let value = *rng.choice(&[0, 1, 2, 511, u32::MAX]).unwrap();
                change(rng, lists[place], value);
            }
            6 => {
                let value = NUMBERS[rng.usize(..NUMBERS.len())];
                let fields = [&mut file.sim_time, &mut file.time_base, &mut file.time_step];
                let robots = file.robots.iter_mut().flat_map(|it| [&mut it.scale, &mut it.still_for]);
                let mut fields: Vec<&mut f64> = fields.into_iter().chain(robots).collect();
                let place = rng.usize(..fields.len());
                *fields[place] = value;
                (file.step, file.time_base_step) = *rng
                    .choice(&[(file.step, file.time_base_step), (0, 1), (u64::MAX, 0), (1 << 53, 1 << 53)])
                    .unwrap();
            }
            _ => {
                let count = file.robots.len();
                let Some(robot) = rng.choice(&mut file.robots) else { continue };
                match rng.u8(0..6) {
                    0 => robot.fixed_base ^= true,
                    1 => robot.asleep ^= true,
                    2 => robot.body = robot.spawned.clone(),
                    3 => robot.disabled_reason = Some("because".into()),
                    4 => robot.self_collision ^= true,
                    _ => {
                        let (a, b) = (rng.usize(..count), rng.usize(..count));
                        file.robots.swap(a, b);
                    }
                }
            }
        }
    }
}

#[test]
fn no_number_of_a_saved_state_breaks_a_promise() {
    let each: u32 = std::env::var("SIMD_MUTATIONS").ok().and_then(|text| text.parse().ok()).unwrap_or(400);
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus/saved_states");
    let mut paths: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    let rng = &mut Rng::with_seed(7);
    let mut accepted = 0;
    for path in &paths {
        let file = v1::SavedStateFile::decode(&fs::read(path).unwrap()[..]).unwrap();
        for _ in 0..each {
            let mut mutated = file.clone();
            mutate(rng, &mut mutated);
            let bytes = mutated.encode_to_vec();
            match std::panic::catch_unwind(|| saved_states(&bytes)) {
                Ok(stepped) => accepted += u32::from(stepped),
                Err(_panic) => {
                    let found = std::env::temp_dir().join("simd_saved_states_found");
                    fs::write(&found, &bytes).unwrap();
                    panic!("a saved state breaks on the bytes in {}", found.display());
                }
            }
        }
    }
    let all = each * u32::try_from(paths.len()).unwrap();
    println!("{accepted} of {all} were stepped");
    assert!(accepted > all / 10 && accepted < all * 9 / 10);
}
