//! Bad requests in bursts, over every transport, and connections that send garbage.

use std::time::Duration;

use simd_client::proto::{ControlWait, SetJointTargetsRequest};
use simd_client::{Client, ControlOptions, Target, joint_target, robot_targets, slide};
use tokio::io::AsyncWriteExt as _;
use tokio::net::TcpStream;
use tokio::task::JoinSet;
use tokio::time::{MissedTickBehavior, interval};

use super::Stage;

/// Requests over one transport.
const BURST: usize = 20;
const PERIOD: Duration = Duration::from_millis(100);
/// Garbage in place of an HTTP request.
const NOISE: [&[u8]; 3] =
    [b"\0\x01\x02 simd", b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\nxxxxxxxxxxxx", b"GET /\r\n\r\n\r\n"];

pub(super) fn start(stage: &Stage, actors: &mut JoinSet<()>) {
    for transport in 0..3 {
        let stage = stage.clone();
        actors.spawn(async move {
            let Some(client) = stage.tally.note("connect", stage.client(transport).await) else { return };
            let mut ticks = interval(PERIOD);
            ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
            while stage.is_on() {
                ticks.tick().await;
                let mut burst = JoinSet::new();
                for number in 0..BURST {
                    let (stage, client) = (stage.clone(), client.clone());
                    burst.spawn(async move { refused(&stage, &client, number).await });
                }
                burst.join_all().await;
            }
        });
    }
    let stage = stage.clone();
    actors.spawn(async move {
        let mut ticks = interval(PERIOD);
        for noise in NOISE.into_iter().cycle() {
            ticks.tick().await;
            if !stage.is_on() {
                break;
            }
            if let Ok(mut stream) = TcpStream::connect(stage.address).await {
                let _ = stream.write_all(noise).await;
            }
        }
    });
}

/// One request that is refused, each for another reason.
async fn refused(stage: &Stage, client: &Client, number: usize) {
    let (tally, missing) = (&stage.tally, "missing");
    let target = |joint: &str, value: f64| vec![joint_target(joint, Target::position(value))];
    let accepted = match number % 8 {
        0 => tally.note("flood", client.delete_robot(missing).await).is_some(),
        1 => {
            tally.note("flood", client.set_robot_targets("writer_0", target("no joint", 0.0)).await).is_some()
        }
        2 => tally
            .note("flood", client.set_robot_targets("writer_0", target("shoulder", f64::NAN)).await)
            .is_some(),
        3 => tally.note("flood", client.step(u64::MAX).await).is_some(),
        4 => tally.note("flood", client.restore_state(missing).await).is_some(),
        5 => tally.note("flood", client.release_joints("1.missing").await).is_some(),
        6 => tally.note("flood", client.set_parameters([slide(missing, 1.0)]).await).is_some(),
        _ => {
            let robots = vec![robot_targets("writer_0", target("shoulder", 0.1))];
            let request = SetJointTargetsRequest { robots, claim: "1.missing".into(), ..Default::default() };
            tally.note("flood", client.set_targets(request).await).is_some()
                || in_a_stream(stage, client).await
        }
    };
    if accepted {
        tally.fail(format!("the bad request {number} of the flood was taken"));
    }
}

/// Sends a request of a stream that continues.
async fn in_a_stream(stage: &Stage, client: &Client) -> bool {
    let options = ControlOptions { wait: ControlWait::None, ..ControlOptions::default() };
    let Some(mut control) = stage.tally.note("control", client.control(options).await) else { return false };
    let targets = [joint_target("no joint", Target::position(0.1))];
    let answer = control.exchange("writer_0", targets).await.and_then(|reply| reply.accepted());
    stage.tally.note("flood", answer).is_some()
}
