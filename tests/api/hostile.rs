//! Untrusted files: whatever their content, the daemon answers and its other robots continue undisturbed.

use fastrand::Rng;
use simd_client::proto::description_source::Source;
use simd_client::proto::{DescriptionSource, SpawnEntityRequest};
use simd_client::{Client, Target};
use simd_tests::daemon::{Daemon, Via, fixed};
use simd_tests::robots::assets;

use crate::{arm, set, shoulder};

fn source(urdf: Vec<u8>) -> Option<DescriptionSource> {
    Some(DescriptionSource { source: Some(Source::Urdf(urdf)), ..Default::default() })
}

/// Spawns the robot and removes it again. Returns true if it was spawned.
async fn throw(client: &Client, urdf: Vec<u8>) -> bool {
    let request = SpawnEntityRequest { source: source(urdf), allow_renaming: true, ..fixed("untrusted") };
    match client.spawn(request).await {
        Ok(spawned) => {
            client.delete_robot(&spawned.entity.name).await.unwrap();
            true
        }
        Err(error) => {
            assert!(error.reason().is_some(), "{error}");
            false
        }
    }
}

/// Returns the arm on its way, and after it.
async fn trajectory(daemon: &Daemon) -> Vec<u64> {
    let mut bits = Vec::new();
    for _ in 0..20 {
        daemon.pass(0.02).await;
        let seen = shoulder(daemon).await;
        bits.extend([seen.position.to_bits(), seen.velocity.to_bits(), seen.effort.to_bits()]);
    }
    bits
}

async fn harmful_files_are_refused_and_disturb_no_client(via: Via) {
    let (calm, troubled) = (arm(via).await, arm(via).await);
    set(&calm, Target::position(0.7)).await;
    set(&troubled, Target::position(0.7)).await;
    let link = "<robot name='r'><link name='a'/>";
    let laughs = "<!DOCTYPE r [<!ENTITY a 'ha'><!ENTITY b '&a;&a;'>]><robot name='&b;'/>";
    for file in [
        format!("{link}{}{}</robot>", "<x>".repeat(100_000), "</x>".repeat(100_000)),
        "<robot>".repeat(500_000),
        "<".repeat(8_000_000),
        laughs.to_owned(),
        format!(
            "<robot name='r'>{}</robot>",
            (0..20_000).map(|i| format!("<link name='l{i}'/>")).collect::<String>()
        ),
        format!("{link}<joint name='j' type='fixed'><parent link='a'/><child link='a'/></joint></robot>"),
        format!("{link}<visual><geometry><mesh filename='/etc/passwd'/></geometry></visual>"),
    ] {
        assert!(!throw(&troubled.client, file.into_bytes()).await);
    }
    assert_eq!(trajectory(&troubled).await, trajectory(&calm).await);
}

/// Seven megabytes are within the limit of a description, and come whole over every transport.
async fn a_large_description_comes_whole(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let comment = "y".repeat(7_000_000);
    let file = format!("<robot name='r'><link name='a'/><!-- {comment} --></robot>");
    assert!(throw(&daemon.client, file.into_bytes()).await);
}

/// Bytes of a good robot changed, cut and doubled: it loads or is refused, a hundred times.
async fn damaged_files_are_answered_and_disturb_no_client(via: Via) {
    let (calm, troubled) = (arm(via).await, arm(via).await);
    set(&calm, Target::velocity(0.5)).await;
    set(&troubled, Target::velocity(0.5)).await;
    let good = std::fs::read(assets().join("seven_arm/urdf/seven_arm.urdf")).unwrap();
    let mut random = Rng::with_seed(11);
    let mut came = 0;
    for _ in 0..100 {
        let mut file = good.clone();
        for _ in 0..random.usize(1..4) {
            let at = random.usize(0..file.len());
            let end = (at + random.usize(1..30)).min(file.len());
            match random.u8(0..3) {
                0 => file[at] = random.u8(..),
                1 => drop(file.drain(at..end)),
                _ => {
                    let part = file[at..end].to_vec();
                    file.splice(at..at, part);
                }
            }
        }
        came += usize::from(throw(&troubled.client, file).await);
    }
    assert!((5..95).contains(&came), "{came} of 100 came");
    assert_eq!(trajectory(&troubled).await, trajectory(&calm).await);
}

crate::over_every_transport![
    harmful_files_are_refused_and_disturb_no_client,
    a_large_description_comes_whole,
    damaged_files_are_answered_and_disturb_no_client,
];
