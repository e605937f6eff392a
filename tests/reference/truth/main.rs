//! simd's part of `tests/reference/truth`: poses of the robots of a list of cases at some times, and the
//! course of scenes with contact. It also gives the precision with which their contacts are solved.
//!
//! The argument is a file with a list of [`Ask`]s. The answer is a line of JSON for each.

use std::error::Error;
use std::io::Write as _;

use serde::Deserialize;
use simd_core::Integrator;
use simd_core::simulation::SolverChoice;
use simd_tests::contact_scene::Scene;
use simd_tests::truth::Case;

#[derive(Deserialize)]
#[serde(untagged)]
enum Ask {
    /// The poses of a case without contact.
    At {
        case: Case,
        /// Seconds.
        time_step: f64,
        integrator: Integrator,
        /// Seconds, multiples of the time step.
        instants: Vec<f64>,
    },
    /// The residual of each step of a scene with contact.
    Residuals { scene: Scene, solver: SolverChoice },
    /// The course of a scene with contact.
    Over {
        scene: Scene,
        /// Steps from view to view.
        every: u64,
        /// By default a world's own integrator.
        #[serde(default)]
        integrator: Option<Integrator>,
        /// In rapier instead of simd. The answer is null if rapier cannot run the scene.
        #[serde(default)]
        in_rapier: bool,
    },
}

fn main() -> Result<(), Box<dyn Error>> {
    let Some(path) = std::env::args().nth(1).filter(|argument| argument != "--bench") else {
        return Ok(());
    };
    let asks: Vec<Ask> = serde_json::from_slice(&std::fs::read(path)?)?;
    let mut out = std::io::stdout().lock();
    for ask in asks {
        match ask {
            Ask::At { case, time_step, integrator, instants } => {
                serde_json::to_writer(&mut out, &case.run(integrator, time_step, &instants))?;
            }
            Ask::Residuals { scene, solver } => {
                serde_json::to_writer(&mut out, &scene.residuals(solver))?;
            }
            Ask::Over { scene, every, in_rapier: true, .. } => {
                serde_json::to_writer(&mut out, &scene.run_in_rapier(every))?;
            }
            Ask::Over { scene, every, integrator, in_rapier: false } => {
                serde_json::to_writer(&mut out, &scene.run(every, integrator))?;
            }
        }
        writeln!(out)?;
    }
    Ok(())
}
