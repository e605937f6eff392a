//! Sways one joint and prints the delay of the daemon's answers: `cargo run -p simd-client --example sway --
//! 127.0.0.1:7400 ROBOT JOINT`.

use std::{
    env,
    error::Error,
    io::{Write as _, stdout},
    time::{Duration, Instant},
};

use simd_client::{Client, ControlOptions, RobotReading, Target, joint_target, some_joints};

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [endpoint, robot, joint] = arguments.as_slice() else {
        return Err("say ENDPOINT ROBOT JOINT".into());
    };
    let client = Client::connect(endpoint).await?;
    let layout = client.joint_layout(robot).await?;
    let selection = some_joints(robot, [joint]);
    let options = ControlOptions { selections: vec![selection.clone()], ..ControlOptions::default() };
    let mut control = client.control(options).await?;

    let mut round_trips = Vec::new();
    let begin = Instant::now();
    let mut sim_time = 0.0_f64;
    while begin.elapsed() < Duration::from_secs(3) {
        let sent = Instant::now();
        let target = Target::position(0.5 * (2.0 * sim_time).sin());
        let states = control.exchange(robot, [joint_target(joint, target)]).await?.accepted()?;
        round_trips.push(sent.elapsed());
        let reading = RobotReading::new(&layout, &selection, &states)?;
        sim_time = reading.stamp.sim_time;
    }
    round_trips.sort();
    let median = round_trips.get(round_trips.len() / 2).copied().unwrap_or_default();
    writeln!(stdout(), "{} answers, median round trip {median:?}", round_trips.len())?;
    Ok(())
}
