//! Sensors compared with closed forms and with MuJoCo's.

mod forces;
mod grips;
mod imu;
mod mujoco;
mod noise;
mod noisy_kinds;
mod rays;
mod replays;
mod states;
mod touch;

use glamx::DPose3;
use simd_core::simulation::command::CreateSensor;
use simd_core::simulation::measure::{Measurement, SensorReading};
use simd_core::{Command, Simulation};
use simd_model::sensor::SensorKind;
use simd_tests::scenes::apply;

use simd_tests::world::look;

/// Returns a sensor without noise on a link, or on a joint for kinds that are on joints; one sample each
/// step.
fn create(robot: &str, on: &str, pose: DPose3, kind: SensorKind) -> CreateSensor {
    let (link, joint) = if kind.is_of_joint() { ("", on) } else { (on, "") };
    CreateSensor {
        robot: robot.into(),
        name: String::new(),
        link: link.into(),
        joint: joint.into(),
        pose,
        rate: None,
        kind,
        noise: Vec::new(),
        seed: None,
    }
}

fn add(world: &mut Simulation, create: CreateSensor) {
    apply(world, Command::CreateSensor(Box::new(create)));
}

/// Does one step and returns its readings.
fn sample(world: &mut Simulation) -> Vec<SensorReading> {
    world.step();
    let (state, mut due, mut readings) = (look(world), Vec::new(), Vec::new());
    world.take_due_samples(&mut due);
    state.readings(&due, &mut readings);
    readings
}

/// Returns the measurements of one step, by the order of the sensors.
fn measured(world: &mut Simulation) -> Vec<Measurement> {
    sample(world).into_iter().map(|reading| reading.measurement).collect()
}
