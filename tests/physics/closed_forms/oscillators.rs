//! Pendulum, damped and driven oscillator.

use std::f64::consts::{FRAC_PI_2, TAU};

use simd_model::robot::JointKind;

use super::elliptic::complete;
use super::{met, put, spring, steps, tell, with};
use crate::chains::{chain, rod};

/// T = 4 K(sin(amplitude / 2)) / w0, w0^2 = m g (l / 2) / I = 3 g / (2 l) of a rod (Landau and Lifshitz,
/// Mechanics, paragraph 11). Semi-implicit Euler is the leapfrog method seen half a step later, so the period
/// is of second order. The error is T / 24 (w0 h)^2 for small swings (Hairer, Lubich, Wanner, Geometric
/// Numerical Integration, I.1.4). Larger swings were found to have no more than that; a fifth is added.
#[test]
fn a_pendulum_has_the_period_of_the_elliptic_integral() {
    const SWINGS: usize = 5;
    let slow = (1.5f64 * 9.81).sqrt();
    for degrees in [5.0f64, 90.0, 170.0] {
        let amplitude = degrees.to_radians();
        let expected = 4.0 * complete((amplitude / 2.0).sin()) / slow;
        for time_step in [4e-3, 1e-3, 2.5e-4] {
            let mut world = with(chain(1), false, 9.81, time_step);
            // Positive is down; it hangs at a quarter turn.
            put(&mut world, "joint-1", FRAC_PI_2 - amplitude, 0.0);
            let count = ((SWINGS + 1) as f64 * expected / time_step) as usize;
            let mut before = f64::NAN;
            let mut upwards = Vec::new();
            for (step, seen) in steps(&mut world, count).enumerate() {
                let angle = seen.positions[0] - FRAC_PI_2;
                if before < 0.0 && angle >= 0.0 {
                    // No acceleration at the bottom: a straight line is exact to third order.
                    upwards.push((step as f64 - angle / (angle - before)) * time_step);
                }
                before = angle;
            }
            let found = (upwards[SWINGS] - upwards[0]) / SWINGS as f64;
            let form = format!("pendulum, amplitude {degrees} deg: period, s");
            let tolerance = 1.2 * expected / 24.0 * (slow * time_step).powi(2) + 1e-9;
            met(&form, time_step, expected, found, tolerance);
        }
    }
}

/// Returns a mass of 1 kg on a slide.
fn slider(gravity: f64, time_step: f64) -> simd_core::Simulation {
    let mut model = chain(1);
    model.joints[0].kind = JointKind::Prismatic;
    model.links[1].inertial = rod(1.0);
    with(model, false, gravity, time_step)
}

/// `x'' + c x' + k x = 0` from x0 at rest. Underdamped, `x = x0 e^(-d t) (cos w t + d / w sin w t)`, d = c /
/// 2. Overdamped, `x = x0 (b e^(-a t) - a e^(-b t)) / (b - a)`, a and b the roots (Landau and Lifshitz,
/// Mechanics, paragraph 25). The actuator's spring and damper are implicit, so a mode `e^(l t)` becomes `1 /
/// (1 - l h)^n`. That is `e^(l t + l^2 h t / 2 + ...)`: an error of `|l|^2 h t / 2` of the mode.
#[test]
fn a_spring_with_a_damper_is_a_damped_oscillator() {
    let (start, time) = (0.1, 1.0f64);
    for (name, k, c) in [("underdamped", 50.0, 1.0), ("overdamped", 50.0, 30.0)] {
        for time_step in [1e-3, 1e-4] {
            let mut world = slider(0.0, time_step);
            put(&mut world, "joint-1", start, 0.0);
            tell(&mut world, "joint-1", spring(k, c, 0.0));
            let found = steps(&mut world, (time / time_step).round() as usize).last().unwrap().positions[0];
            let d: f64 = c / 2.0;
            let root = (d * d - k).abs().sqrt();
            let (expected, slower) = if d * d < k {
                let wave = (root * time).cos() + d / root * (root * time).sin();
                (start * (-d * time).exp() * wave, k / (1.0 - d * d / k).sqrt() * (-d * time).exp())
            } else {
                let (a, b) = (d - root, d + root);
                let sum = b * (-a * time).exp() - a * (-b * time).exp();
                (start * sum / (b - a), a * a * b / (b - a) * (-a * time).exp())
            };
            let tolerance = 1.05 * start * slower * time_step * time / 2.0;
            met(&format!("{name} oscillator: place after 1 s, m"), time_step, expected, found, tolerance);
        }
    }
}

/// `x'' + c x' + k x = F cos w t` settles to `|X| = F / |D|`, `D = k - w^2 + i c w`, behind the force by arg
/// D (Landau and Lifshitz, Mechanics, paragraph 26). One step is `X / F = 1 / (D + h (i w k - c w^2 / 2) +
/// ...)`. The added terms come from a client's force, which is constant for a step, and from the implicit
/// spring. Hence the tolerance, with a tenth more for h^2. Tested at resonance, where the damper alone
/// decides, and beside it.
#[test]
fn a_driven_oscillator_settles_to_the_amplitude_and_phase_of_resonance() {
    let (k, c, force) = (25.0, 2.0, 1.0);
    for w in [5.0f64, 8.0] {
        for time_step in [1e-3, 1e-4] {
            let mut world = slider(0.0, time_step);
            let period = (TAU / w / time_step).round() as usize;
            // The drive has a whole number of steps a period, as near to w as that allows.
            let w = TAU / (period as f64 * time_step);
            let (mut cosine, mut sine) = (0.0, 0.0);
            // e^-(c / 2 t) is 1e-7 after 16 s.
            let settle = (16.0 / time_step) as usize / period * period;
            for step in 0..settle + period {
                let phase = TAU * (step % period) as f64 / period as f64;
                tell(&mut world, "joint-1", spring(k, c, force * phase.cos()));
                if step >= settle {
                    let x = simd_tests::world::look(&world).positions[0];
                    cosine += x * phase.cos() * 2.0 / period as f64;
                    sine += x * phase.sin() * 2.0 / period as f64;
                }
                world.step();
            }
            let (real, imaginary) = (k - w * w, c * w);
            let stiff = real.hypot(imaginary);
            let relative = 1.1 * time_step * (w * k).hypot(c * w * w / 2.0) / stiff;
            let amplitude = cosine.hypot(sine);
            let name = format!("driven oscillator at {w:.3} rad/s");
            met(
                &format!("{name}: amplitude, m"),
                time_step,
                force / stiff,
                amplitude,
                relative * force / stiff,
            );
            let lag = sine.atan2(cosine);
            met(&format!("{name}: lag, rad"), time_step, imaginary.atan2(real), lag, relative);
        }
    }
}
