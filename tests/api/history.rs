//! The history agrees with the answers: random clients over every transport, with claims, compared with the
//! daemon's list of applied commands.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::sync::{Arc, Mutex};

use fastrand::Rng;
use simd_client::proto::{
    ClaimJointsRequest, ErrorReason, JointProperties, JointReset, SetJointTargetsRequest,
};
use simd_client::{Client, Error, Target, every_joint, joint_target, robot_targets};
use simd_server::config::Zenoh;
use simd_tests::daemon::Daemon;
use simd_tests::web;
use simd_world::handle::RunState;
use tracing_subscriber::EnvFilter;
use tracing_subscriber::fmt::MakeWriter;

const ROBOTS: [&str; 2] = ["left", "right"];
const CLIENTS: usize = 6;
const TURNS: usize = 60;

/// The lines of the daemon's log.
#[derive(Clone, Default)]
struct Lines(Arc<Mutex<Vec<u8>>>);

impl Write for Lines {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().unwrap().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl<'a> MakeWriter<'a> for Lines {
    type Writer = Self;

    fn make_writer(&'a self) -> Self {
        self.clone()
    }
}

/// The result of a command with a unique number.
#[derive(Clone, Debug)]
struct Answered {
    /// The unique number of the command, as `Debug` writes it.
    number: String,
    robot: &'static str,
    /// Epoch and step of the answer, or why it was refused.
    outcome: Result<(u64, u64), Option<ErrorReason>>,
}

/// Does random things to the robots, one after the other.
async fn act(client: Client, name: String, seed: u64) -> Vec<Answered> {
    let mut random = Rng::with_seed(seed);
    let (free, mut claim) = (client.clone(), None::<String>);
    let mut answers = Vec::new();
    for turn in 0..TURNS {
        let robot = ROBOTS[random.usize(..ROBOTS.len())];
        let sender = match &claim {
            // A holder that comes without its claim is refused like any other.
            Some(secret) if random.u8(..5) > 0 => free.clone().with_claim(secret),
            Some(_) | None => free.clone(),
        };
        let value = 1e-3 + (seed as f64 * 1000.0 + turn as f64) * 1e-7;
        let stamp = match random.u8(..6) {
            0 => {
                let priority = random.u32(..3);
                let request = ClaimJointsRequest {
                    selections: vec![every_joint(robot)],
                    holder: name.clone(),
                    lease: if random.u8(..4) == 0 { 0.1 } else { 60.0 },
                    priority,
                    ..Default::default()
                };
                if let Ok(secret) = free.claim(request).await {
                    claim = Some(secret);
                }
                continue;
            }
            1 => {
                if let Some(secret) = claim.take() {
                    // It may have lapsed, or been taken over.
                    let _ = free.release_joints(&secret).await;
                }
                continue;
            }
            2 => {
                let reset = JointReset { joint: "shoulder".into(), position: value, ..Default::default() };
                sender.reset_joints(robot, vec![reset]).await
            }
            3 => {
                let damping =
                    JointProperties { joint: "shoulder".into(), damping: Some(value), ..Default::default() };
                sender.set_joint_properties(robot, vec![damping]).await
            }
            _ => {
                let targets = robot_targets(robot, [joint_target("shoulder", Target::position(value))]);
                let request = SetJointTargetsRequest { robots: vec![targets], ..Default::default() };
                sender.set_targets(request).await.map(|answer| answer.stamp.unwrap_or_default())
            }
        };
        let outcome = match stamp {
            Ok(stamp) => Ok((stamp.epoch, stamp.step)),
            Err(Error::Refused(refusal)) => Err(Some(refusal.reason)),
            Err(error) => panic!("{name}: {error}"),
        };
        answers.push(Answered { number: format!("{value:?}"), robot, outcome });
    }
    answers
}

/// Returns the number after a word in a line.
fn after(line: &str, word: &str) -> Option<u64> {
    let rest = line.split_once(word)?.1;
    rest.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn each_acknowledged_command_is_in_the_history_once_in_order_and_no_refused_one_is() {
    let lines = Lines::default();
    let filter = EnvFilter::new("simd_world::driver=trace");
    tracing_subscriber::fmt().with_env_filter(filter).with_ansi(false).with_writer(lines.clone()).init();
    let daemon = Daemon::start(|config| {
        config.zenoh = Zenoh::on_free_port();
        config.driver.state = RunState::Playing;
    })
    .await;
    for robot in ROBOTS {
        crate::load_arm(&daemon.client, robot).await;
    }
    let locator = daemon.running.locators()[0].clone();
    let mut actors = Vec::new();
    for number in 0..CLIENTS {
        let client = match number % 3 {
            0 => daemon.another_client().await,
            1 => web::client(daemon.address),
            _ => Client::connect(&locator).await.unwrap(),
        };
        actors.push(tokio::spawn(act(client, format!("client-{number}"), number as u64 + 1)));
    }
    let mut answers = Vec::new();
    for actor in actors {
        answers.push(actor.await.unwrap());
    }
    daemon.running.drain().await;

    let text = String::from_utf8(lines.0.lock().unwrap().clone()).unwrap();
    let history: Vec<&str> = text.lines().filter(|line| line.contains(" applied ")).collect();
    assert!(history.len() > CLIENTS * 10, "{}", history.len());
    // Each number, with where in the history it is.
    let lines_of = |number: &str| -> Vec<usize> {
        let quoted = [format!(": {number},"), format!(": {number} "), format!("({number})")];
        let is_in = |line: &str| quoted.iter().any(|text| line.contains(text.as_str()));
        history.iter().enumerate().filter(|(_, line)| is_in(line)).map(|(index, _)| index).collect()
    };
    let mut senders = BTreeMap::new();
    let (mut acknowledged, mut refused) = (0, 0);
    for (client, answers) in answers.iter().enumerate() {
        let mut last = None;
        for answer in answers {
            let lines = lines_of(&answer.number);
            let Ok((epoch, step)) = answer.outcome else {
                assert!(lines.is_empty(), "refused, and in the history: {answer:?}");
                refused += 1;
                continue;
            };
            assert_eq!(lines.len(), 1, "{answer:?}");
            let line = history[lines[0]];
            assert_eq!(
                (after(line, "epoch="), after(line, "step=")),
                (Some(epoch), Some(step)),
                "{answer:?}: {line}"
            );
            assert!(last < Some(lines[0]), "client {client} was overtaken by itself: {answer:?}");
            last = Some(lines[0]);
            senders.insert(lines[0], (client, answer.robot));
            acknowledged += 1;
        }
    }
    // Holder of each robot when a command was applied there.
    let mut holders: BTreeMap<&str, (u64, usize)> = BTreeMap::new();
    for (index, line) in history.iter().enumerate() {
        if line.contains("Claim(ClaimRequest") {
            let (Some(claim), Some(client)) = (after(line, "ClaimId("), after(line, "client-")) else {
                continue;
            };
            let robot = ROBOTS.into_iter().find(|robot| line.contains(&format!("\"{robot}\""))).unwrap();
            holders.insert(robot, (claim, usize::try_from(client).unwrap()));
        } else if line.contains("Release {") {
            let claim = after(line, "ClaimId(");
            holders.retain(|_, (held, _)| Some(*held) != claim);
        } else if let Some((client, robot)) = senders.get(&index) {
            let holder = holders.get(robot).map(|(_, holder)| holder);
            assert!(
                holder.is_none_or(|holder| holder == client),
                "client {client} changed what {holder:?} held: {line}"
            );
        }
    }
    // It was not quiet: both happened.
    assert!(acknowledged > 20 && refused > 20, "{acknowledged} acknowledged, {refused} refused");
}
