//! `joint set --wait`: waits until joints are at their position targets.

use std::time::Duration;

use anyhow::bail;
use simd_client::{
    Client, JointReading, RobotReading,
    proto::{JointMode, JointSelection, JointType, SimulationState},
};

use crate::{failure::Usage, output::number::exact};

/// Distance from its target at which a joint has arrived: radians for angles.
const ANGLE: f64 = 0.01;
/// The same in metres for lengths.
const LENGTH: f64 = 0.001;
/// Largest velocity of a joint that has arrived, in these distances per second.
const SPEED: f64 = 5.0;
/// Longest time between two looks.
const LOOK: Duration = Duration::from_millis(100);

/// Waits until the joints are at their position targets and nearly still. Returns the last state. `set_at` is the
/// sequence of the first state with the targets.
///
/// # Errors
/// Returns an error if they are not there after `seconds` of simulated time. Also if the world is paused, or a joint
/// has no position target.
pub(super) async fn until_there(
    client: &Client,
    selection: &JointSelection,
    seconds: f64,
    set_at: u64,
) -> anyhow::Result<RobotReading> {
    let layout = client.joint_layout(&selection.robot).await?;
    let (mut start, mut sequence) = (None, set_at.saturating_sub(1));
    loop {
        let states = client.next_states(sequence, LOOK, vec![selection.clone()]).await?;
        let reading = RobotReading::new(&layout, selection, &states)?;
        let is_new = reading.stamp.sequence > sequence;
        sequence = reading.stamp.sequence;
        let away: Vec<&JointReading> = reading.joints.iter().filter(|joint| !is_there(joint)).collect();
        if let Some(joint) = away.iter().find(|joint| joint.mode.first() != Some(&JointMode::Position)) {
            bail!(Usage(format!("--wait is for position targets, and joint {} has none", joint.name)));
        }
        if away.is_empty() {
            return Ok(reading);
        }
        let now = reading.stamp.sim_time;
        if now - *start.get_or_insert(now) >= seconds {
            let away: Vec<String> = away.into_iter().map(distance).collect();
            bail!("after {} s of simulated time {}", exact(seconds), away.join(", "));
        }
        if !is_new && client.world_statistics().await?.state() != SimulationState::Playing {
            bail!("the world is paused, so joints do not move: `simctl sim play` lets time run");
        }
    }
}

/// Returns the tolerance of a joint, and its unit.
fn tolerance(joint: &JointReading) -> (f64, &'static str) {
    if joint.kind == JointType::Prismatic { (LENGTH, "m") } else { (ANGLE, "rad") }
}

fn is_there(joint: &JointReading) -> bool {
    let (near, _unit) = tolerance(joint);
    let is_position = joint.mode.first() == Some(&JointMode::Position);
    let is_near =
        joint.position.iter().zip(&joint.target).all(|(position, target)| (target - position).abs() < near);
    is_position && is_near && joint.velocity.iter().all(|velocity| velocity.abs() < SPEED * near)
}

fn distance(joint: &JointReading) -> String {
    let (_near, unit) = tolerance(joint);
    let [position, target] =
        [&joint.position, &joint.target].map(|values| values.first().copied().unwrap_or_default());
    format!("joint {} is {position:.4} {unit} and not {target:.4} {unit}", joint.name)
}
