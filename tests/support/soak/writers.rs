//! A client that sets claimed targets and reads each one back: an acknowledged target must hold.

use std::time::Duration;

use simd_client::proto::{
    ControlWait, JointStates, Pose, SetJointTargetsRequest, SpawnEntityRequest, Vector3,
};
use simd_client::{Client, ControlOptions, Error, Target, every_joint, joint_target, robot_targets};
use tokio::task::JoinSet;
use tokio::time::interval;

use super::Stage;
use crate::daemon::fixed;
use crate::robots::assets;

/// One over each transport that sets and then asks, and as many that exchange.
const WRITERS: usize = 6;
const PERIOD: Duration = Duration::from_millis(20);
const SECOND: Duration = Duration::from_secs(1);
const JOINT: &str = "shoulder";

fn robot(number: usize) -> String {
    format!("writer_{number}")
}

/// Brings their robots, and the ground.
pub(super) async fn prepare(stage: &Stage) -> Result<(), Error> {
    let client = Client::connect(&stage.endpoint).await?;
    for number in 0..WRITERS {
        // Side by side: overlapping robots are slow for the physics, which is not the load that is tested.
        let position = Some(Vector3 { x: -2.0 * number as f64, y: 0.0, z: 0.0 });
        let pose = Some(Pose { position, ..Default::default() });
        let request = SpawnEntityRequest { pose, ..fixed(&robot(number)) };
        client.load(assets().join("Bench_Arm-1.2 rev B"), request).await?;
    }
    Ok(())
}

pub(super) fn start(stage: &Stage, actors: &mut JoinSet<()>) {
    for number in 0..WRITERS {
        let stage = stage.clone();
        actors.spawn(async move {
            let Some(client) = stage.tally.note("connect", stage.client(number).await) else { return };
            let client = client.with_name(&robot(number));
            while stage.is_on() {
                // Whatever ends it, for instance that its claim went with a restored world: again.
                if number < WRITERS / 2 {
                    set_and_ask(&stage, &client, &robot(number)).await;
                } else {
                    exchange(&stage, &client, &robot(number)).await;
                }
            }
        });
    }
}

/// Positions that differ from turn to turn.
fn positions() -> impl Iterator<Item = f64> {
    (1..=1000).cycle().map(|turn| f64::from(turn) * 1e-3)
}

async fn claim(stage: &Stage, client: &Client, robot: &str) -> Option<String> {
    let claimed = client.claim_joints(vec![every_joint(robot)], robot, Duration::from_secs(20)).await;
    stage.tally.note("claim", claimed)
}

fn check(stage: &Stage, robot: &str, position: f64, states: &JointStates) {
    let found = states.robots.first().map(|robot| robot.target.as_slice());
    if found != Some(&[position]) {
        stage.tally.fail(format!("{robot}: the target {position} was acknowledged, and is {found:?}"));
    }
}

async fn set_and_ask(stage: &Stage, client: &Client, robot: &str) {
    let Some(secret) = claim(stage, client, robot).await else {
        return tokio::time::sleep(SECOND).await;
    };
    let mut ticks = interval(PERIOD);
    for position in positions().take(500) {
        ticks.tick().await;
        if !stage.is_on() {
            break;
        }
        let _no_restores = stage.world.read().await;
        let robots = vec![robot_targets(robot, [joint_target(JOINT, Target::position(position))])];
        let request = SetJointTargetsRequest { robots, claim: secret.clone(), ..Default::default() };
        let Some(set) = stage.tally.note("targets", client.set_targets(request).await) else { break };
        let sequence = set.stamp.map_or(0, |stamp| stamp.sequence);
        let read = client.next_states(sequence, SECOND, vec![every_joint(robot)]).await;
        let Some(states) = stage.tally.note("next states", read) else { break };
        check(stage, robot, position, &states);
    }
    stage.tally.note("release", client.release_joints(&secret).await);
}

async fn exchange(stage: &Stage, client: &Client, robot: &str) {
    let Some(claim) = claim(stage, client, robot).await else {
        return tokio::time::sleep(SECOND).await;
    };
    let options = ControlOptions {
        selections: vec![every_joint(robot)],
        wait: ControlWait::NewerState,
        timeout: Some(SECOND),
        claim: claim.clone(),
        ..ControlOptions::default()
    };
    let Some(mut control) = stage.tally.note("control", client.control(options).await) else { return };
    let mut ticks = interval(PERIOD);
    for position in positions().take(500) {
        ticks.tick().await;
        if !stage.is_on() {
            break;
        }
        let _no_restores = stage.world.read().await;
        let targets = [joint_target(JOINT, Target::position(position))];
        let reply = control.exchange(robot, targets).await.and_then(|reply| reply.accepted());
        let Some(states) = stage.tally.note("exchange", reply) else { break };
        check(stage, robot, position, &states);
    }
    drop(control);
    stage.tally.note("release", client.release_joints(&claim).await);
}
