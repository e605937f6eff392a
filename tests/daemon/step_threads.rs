//! A daemon with two step threads computes the same as one with a single thread, to the bit.

use std::path::Path;

use simd_client::proto::{self, ConstraintKind};
use simd_client::{Client, Package, Target, joint_target};
use simd_tests::daemon::fixed;
use simd_tests::process::Process;
use simd_tests::robots::assets;

/// Arms of seven joints each. Threads pay off for a step from 500 degrees of freedom and rows on. Those of
/// the largest group of robots do not count: here, of the two that are held together.
const ARMS: usize = 90;

/// Result of a run.
#[derive(PartialEq)]
struct Run {
    /// Saved states as files, halfway and at the end: worlds are equal where their files are.
    files: [Vec<u8>; 2],
    /// Joints in the middle, at the end, and at the end once more after the state of the middle was restored.
    joints: [Vec<f64>; 3],
}

/// Arms in rows, too far apart to touch each other. The first two are held together at their last links.
async fn fill(client: &Client) {
    let package = Package::open(assets().join("seven_arm")).unwrap();
    let source = Some(client.upload(&package).await.unwrap());
    for index in 0..ARMS {
        let position = proto::Vector3 { x: 3.0 * (index % 10) as f64, y: 3.0 * (index / 10) as f64, z: 0.0 };
        let pose = Some(proto::Pose { position: Some(position), orientation: None });
        let request = proto::SpawnEntityRequest { source: source.clone(), pose, ..fixed(&arm(index)) };
        client.spawn(request).await.unwrap();
    }
    let end =
        |index| Some(proto::ConstraintEnd { robot: arm(index), link: "link_7".into(), ..Default::default() });
    let rod = proto::CreateConstraintRequest {
        name: "held".into(),
        kind: ConstraintKind::Distance.into(),
        parent: end(0),
        child: end(1),
        ..Default::default()
    };
    client.create_constraint(rod).await.unwrap();
}

fn arm(index: usize) -> String {
    format!("arm-{index}")
}

/// Gives each arm different targets, and its neighbour targets on the other side: the two that are held
/// together pull at each other.
async fn move_all(client: &Client, share: f64) {
    for index in 0..ARMS {
        let side = if index % 2 == 0 { share } else { -share };
        let goal = |joint: usize| side * (0.2 + 0.01 * index as f64 - 0.01 * joint as f64);
        let targets =
            (1..=7).map(|joint| joint_target(format!("joint_{joint}"), Target::position(goal(joint))));
        client.set_robot_targets(&arm(index), targets).await.unwrap();
    }
}

/// Positions and velocities of all joints.
async fn joints(client: &Client) -> Vec<f64> {
    let robots = client.joint_states(Vec::new()).await.unwrap().robots;
    robots.into_iter().flat_map(|robot| robot.position.into_iter().chain(robot.velocity)).collect()
}

async fn file(client: &Client, folder: &Path, name: &str) -> Vec<u8> {
    let path = folder.join(name);
    client.save_state(name).await.unwrap();
    client.export_saved_state(name, &path).await.unwrap();
    std::fs::read(path).unwrap()
}

async fn run(threads: usize) -> Run {
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("simd.toml");
    std::fs::write(&config, format!("[realtime]\nthreads = {threads}\n")).unwrap();
    let daemon = Process::start([Path::new("--paused"), Path::new("--config"), &config]).await;
    let client = daemon.client().await;
    fill(&client).await;
    move_all(&client, 1.0).await;
    client.step(200).await.unwrap();
    let (in_its_midst, middle) = (file(&client, folder.path(), "middle").await, joints(&client).await);
    move_all(&client, -1.0).await;
    client.step(200).await.unwrap();
    let (at_its_end, end) = (file(&client, folder.path(), "end").await, joints(&client).await);
    let held = client.constraints(None).await.unwrap().remove(0);
    assert!(held.force.is_some_and(|force| force.x.abs() > 1e-3), "{held:?}");

    client.restore_state("middle").await.unwrap();
    assert!(joints(&client).await == middle, "the state is there again");
    move_all(&client, -1.0).await;
    client.step(200).await.unwrap();
    let again = joints(&client).await;
    #[cfg(target_os = "linux")]
    {
        // The physics thread is one of them, under its own name.
        let names = crate::threads::threads(daemon.pid().unwrap());
        let beside = names.iter().filter(|(_, name)| name.starts_with("simd-step-")).count();
        assert_eq!(beside, threads - 1, "{names:?}");
    }
    Run { files: [in_its_midst, at_its_end], joints: [middle, end, again] }
}

#[tokio::test]
async fn a_daemon_on_two_threads_is_equal_to_one_on_one_to_the_bit() {
    let (one, two) = tokio::join!(run(1), run(2));
    for run in [&one, &two] {
        let [middle, end, again] = &run.joints;
        assert!(middle != end, "the arms move");
        assert!(end == again, "a restored world runs on to the same bits");
    }
    assert!(one.joints == two.joints, "the joints of all arms are equal to the bit");
    assert!(one == two, "the worlds are equal to the bit");
}
