//! For tests of robots: waiting in simulated time, and errors that say how far off a joint is.
//!
//! ```no_run
//! use simd_client::testing::{NotYet, positions, until};
//!
//! # async fn example(client: simd_client::Client) -> Result<(), NotYet> {
//! // joint shoulder of arm is at 0.480 rad, wanted 0.500 within 0.010 rad (waited for it for 2 simulated seconds)
//! until(&client, 2.0, async || positions(&client, "arm", &[("shoulder", 0.5)], 0.01).await).await?;
//! # Ok(())
//! # }
//! ```

use std::time::Duration;

use simd_proto::v1::{JointType, SimulationState, Stamp};

use crate::{Client, Error, RobotReading, some_joints};

/// Steps of a paused world between two looks.
const STEPS: u64 = 10;
/// Wall time without a newer state after which a playing world is asked whether it still plays.
const NEWER: Duration = Duration::from_secs(1);

/// Reason why a condition does not hold.
#[derive(Debug, thiserror::Error)]
pub enum NotYet {
    /// It may hold later.
    #[error("{0}")]
    Off(String),
    /// A call failed: waiting does not help.
    #[error(transparent)]
    Failed(#[from] Error),
}

/// Waits until `condition` returns a value, and returns it. A paused world makes ten steps between two looks; a
/// playing world is waited for.
///
/// # Errors
/// After `seconds` of simulated time the condition's [`NotYet::Off`], with the time added. [`NotYet::Failed`] at
/// once if a call fails. [`NotYet::Off`] if the world is reset, or paused while it is waited for.
pub async fn until<T>(
    client: &Client,
    seconds: f64,
    condition: impl AsyncFn() -> Result<T, NotYet>,
) -> Result<T, NotYet> {
    let statistics = client.world_statistics().await?;
    let plays = statistics.state() == SimulationState::Playing;
    let begin = statistics.stamp.unwrap_or_default();
    let mut now = begin;
    loop {
        let off = match condition().await {
            Err(NotYet::Off(off)) => off,
            decided => return decided,
        };
        let passed = now.sim_time - begin.sim_time;
        // Half a step for the rounding of times.
        if passed >= seconds * (1.0 - 1e-9) {
            return Err(NotYet::Off(format!("{off} (waited for it for {passed:.4} simulated seconds)")));
        }
        now = if plays { newer(client, now).await? } else { client.step(STEPS).await? };
        if now.epoch != begin.epoch {
            return Err(NotYet::Off(format!("{off}; the world was reset or restored meanwhile")));
        }
    }
}

/// Returns the stamp of a newer state of a playing world.
async fn newer(client: &Client, now: Stamp) -> Result<Stamp, NotYet> {
    loop {
        let found = client.next_states(now.sequence, NEWER, Vec::new()).await?.stamp.unwrap_or_default();
        if found.sequence > now.sequence {
            return Ok(found);
        }
        if client.world_statistics().await?.state() != SimulationState::Playing {
            return Err(NotYet::Off("the world was paused while a condition was waited for".to_owned()));
        }
    }
}

/// Asserts that joints are within a distance of positions, rad or m. Returns the state.
///
/// # Errors
/// [`NotYet::Off`] names each joint that is farther off, with both values. `ROBOT_NOT_FOUND`, `JOINT_NOT_FOUND`.
pub async fn positions(
    client: &Client,
    robot: &str,
    wanted: &[(&str, f64)],
    within: f64,
) -> Result<RobotReading, NotYet> {
    let selection = some_joints(robot, wanted.iter().map(|(joint, _)| *joint));
    let reading = client.read_joints(&selection).await?;
    let mut off = Vec::new();
    for (joint, (name, position)) in reading.joints.iter().zip(wanted) {
        let found = joint.position.first().copied().unwrap_or(f64::NAN);
        // A value that is not a number is never within.
        if (found - position).abs() <= within {
            continue;
        }
        let unit = if joint.kind == JointType::Prismatic { "m" } else { "rad" };
        off.push(format!(
            "joint {name} of {robot} is at {found:.4} {unit}, wanted {position:.4} within {within} {unit}"
        ));
    }
    if off.is_empty() { Ok(reading) } else { Err(NotYet::Off(off.join("; "))) }
}
