//! The truth table: simd's results with its usual time steps, compared with the exact motion of robots.
//!
//! `tests/reference/truth.json` has the cases, the reference and MuJoCo's errors; `tests/reference/exact.py`
//! documents how the reference was made. `make truth` draws them.

use serde::Deserialize;
use simd_core::Integrator;
use simd_tests::truth::Case;

#[derive(Deserialize)]
struct Reference {
    cases: Vec<Known>,
}

#[derive(Deserialize)]
struct Known {
    #[serde(flatten)]
    case: Case,
    instants: Vec<f64>,
    /// Change of the reference when its own step is halved.
    accuracy: f64,
    /// Positions at each time.
    positions: Vec<Vec<f64>>,
    #[serde(default)]
    root: Vec<[f64; 7]>,
    mujoco: Vec<Error>,
}

/// The largest over joints and instants, rad or m; `None` if it was not stable.
#[derive(Deserialize)]
struct Error {
    time_step: f64,
    error: Option<f64>,
}

/// Rounding over thousands of steps: smaller errors are not those of a method.
const ROUNDING: f64 = 1e-11;

fn known() -> Vec<Known> {
    let text = include_str!("../reference/truth.json");
    let reference: Reference = serde_json::from_str(text).unwrap();
    assert!(reference.cases.len() > 20);
    reference.cases
}

/// Returns the cases without their results.
pub(crate) fn cases() -> Vec<Case> {
    known().into_iter().map(|known| known.case).collect()
}

impl Known {
    fn error(&self, integrator: Integrator, time_step: f64) -> f64 {
        let views = self.case.run(integrator, time_step, &self.instants);
        let differences = views
            .iter()
            .enumerate()
            .map(|(look, view)| view.difference(&self.positions[look], self.root.get(look)));
        differences.fold(0.0, |most, next| if next.is_nan() { next } else { most.max(next) })
    }
}

/// Both codes do semi-implicit Euler, so both make the same error; the requirement is 5 %. Simulators that
/// differ by more than rounding differ in the model, and then by far more than that.
#[test]
fn passive_smooth_robots_are_as_near_the_truth_as_in_mujocos_euler() {
    for known in known().iter().filter(|known| known.case.subject == "smooth") {
        for peer in &known.mujoco {
            let error = known.error(Integrator::Euler, peer.time_step);
            let bound = peer.error.unwrap() * 1.05 + ROUNDING;
            println!("{:35} {:7} s: {error:.3e}, bound {bound:.3e}", known.case.name, peer.time_step);
            assert!(error <= bound, "{} at {} s: {error:e} {bound:e}", known.case.name, peer.time_step);
        }
    }
}

/// Euler's method is of first order, and exact in the limit: the error is proportional to the time step. This
/// holds even if joints stick, stop, follow others or have actuators at their limits. A tolerance of 30 %
/// allows for terms of second order at 4 ms. It also allows for the time within a step at which a joint meets
/// its limit.
#[test]
fn the_error_falls_in_proportion_to_the_time_step() {
    for known in known() {
        let steps: Vec<f64> = known.mujoco.iter().map(|peer| peer.time_step).collect();
        let errors: Vec<f64> =
            steps.iter().map(|&time_step| known.error(Integrator::Euler, time_step)).collect();
        println!("{:35} {errors:?}", known.case.name);
        assert!(errors[0] < 3e-3, "{}: {errors:?}", known.case.name);
        if errors.iter().all(|&error| error < ROUNDING) {
            continue;
        }
        // The reference must be far more accurate than the errors that it measures.
        assert!(known.accuracy < errors[0] / 100.0, "{}: {errors:?}", known.case.name);
        for (steps, errors) in steps.windows(2).zip(errors.windows(2)) {
            let order = (errors[1] / errors[0]) / (steps[1] / steps[0]);
            assert!((1.0 / 1.3..1.3).contains(&order), "{}: {errors:?} at {steps:?}", known.case.name);
        }
    }
}

/// Leapfrog is of second order for smooth motion: with a quarter of the time step the error is a sixteenth.
/// At 1 ms it is at most a twentieth of the error of MuJoCo's Euler. The slope is taken from 0.25 to 1 ms; at
/// 4 ms terms of higher order show. The reference is no more accurate than 1e-9, so smaller errors are left
/// out.
#[test]
fn leapfrog_is_of_second_order_on_passive_smooth_robots() {
    let mut failures = Vec::new();
    for known in known().iter().filter(|known| known.case.subject == "smooth") {
        let [fine, coarse] = [2.5e-4, 1e-3].map(|time_step| known.error(Integrator::Leapfrog, time_step));
        let peer =
            known.mujoco.iter().find(|peer| peer.time_step == 1e-3).and_then(|peer| peer.error).unwrap();
        let slope = (coarse / fine).log2() / 2.0;
        println!("{:35} {coarse:.3e} at 1 ms, slope {slope:.3}, MuJoCo's Euler {peer:.3e}", known.case.name);
        let is_known = coarse > 1e-9;
        if is_known && !(1.9..2.1).contains(&slope) {
            failures.push(format!("{}: slope {slope}", known.case.name));
        }
        if coarse.is_nan() || coarse > peer / 20.0 + ROUNDING {
            failures.push(format!("{}: {coarse:e}, MuJoCo's Euler {peer:e}", known.case.name));
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}

/// If joints stick, stop, follow others or have actuators, leapfrog is no worse than Euler at any time step.
#[test]
fn leapfrog_is_nowhere_worse_than_euler() {
    let mut failures = Vec::new();
    for known in known() {
        for peer in &known.mujoco {
            let [leapfrog, euler] =
                [Integrator::Leapfrog, Integrator::Euler].map(|method| known.error(method, peer.time_step));
            println!("{:35} {:7} s: {leapfrog:.3e}, Euler {euler:.3e}", known.case.name, peer.time_step);
            if leapfrog.is_nan() || leapfrog > 1.02 * euler + 1e-9 {
                failures.push(format!("{} at {}: {leapfrog:e} {euler:e}", known.case.name, peer.time_step));
            }
        }
    }
    assert!(failures.is_empty(), "{failures:#?}");
}
