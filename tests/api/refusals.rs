//! Bad input: a clear error that names the element, and the world unchanged.

use simd_client::proto::{self, ErrorReason};
use simd_client::{Client, Target, joint_target};
use simd_tests::daemon::{Daemon, Via, fixed};
use simd_tests::process::soon;

use crate::{arm, load_arm, shoulder};

/// Returns the refusal of a URDF, its reason and its sentence.
async fn refused(client: &Client, urdf: &str) -> (Option<ErrorReason>, String) {
    let source = proto::DescriptionSource {
        source: Some(proto::description_source::Source::Urdf(urdf.as_bytes().to_vec())),
        ..Default::default()
    };
    let request = proto::SpawnEntityRequest { source: Some(source), ..fixed("bad") };
    let error = client.spawn(request).await.unwrap_err();
    (error.reason(), error.to_string())
}

async fn a_description_that_cannot_be_is_refused_by_the_element(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let joint = |name: &str, parent: &str, child: &str| {
        format!(
            r#"<joint name="{name}" type="fixed"><parent link="{parent}"/><child link="{child}"/></joint>"#
        )
    };
    let (a, b) = (r#"<link name="a"/>"#, r#"<link name="b"/>"#);
    let cases = [
        ("<robot name='r'><link name='a'></robot>".to_owned(), "link"),
        ("<sdf><model/></sdf>".into(), "no model"),
        ("<robot name='r'/>".into(), "no link"),
        (format!("<robot name='r'>{a}{b}</robot>"), "root"),
        (format!("<robot name='r'>{a}{b}{}{}</robot>", joint("j", "a", "b"), joint("k", "b", "a")), "loop"),
        (format!("<robot name='r'>{a}{}</robot>", joint("j", "a", "nowhere")), "nowhere"),
    ];
    for (urdf, named) in cases {
        let (reason, sentence) = refused(&daemon.client, &urdf).await;
        println!("{sentence}");
        assert_eq!(reason, Some(ErrorReason::InvalidDescription), "{urdf}: {sentence}");
        assert!(sentence.contains(named), "{urdf}: {sentence}");
    }
    assert!(daemon.client.robots().await.unwrap().is_empty());
}

async fn refusals_name_what_is_wrong_and_leave_the_world_as_it_was(via: Via) {
    let daemon = arm(via).await;
    let client = &daemon.client;
    let before = shoulder(&daemon).await;
    let target = |joint: &str, target| [joint_target(joint, target)];
    let errors = [
        client.set_robot_targets("leg", target("shoulder", Target::Hold)).await.unwrap_err(),
        client.set_robot_targets("arm", target("elbow", Target::Hold)).await.unwrap_err(),
        client.set_robot_targets("arm", target("shoulder", Target::position(f64::NAN))).await.unwrap_err(),
        client.joint_layout("leg").await.unwrap_err(),
        client.delete_robot("leg").await.unwrap_err(),
        client.step(0).await.unwrap_err(),
        client.restore_state("never").await.unwrap_err(),
        client.release_joints("unknown").await.unwrap_err(),
        client
            .set_physics(proto::SetPhysicsRequest { time_step: Some(-1.0), ..Default::default() })
            .await
            .unwrap_err(),
    ];
    use ErrorReason::*;
    let reasons = [
        RobotNotFound,
        JointNotFound,
        InvalidValue,
        RobotNotFound,
        RobotNotFound,
        InvalidValue,
        SavedStateNotFound,
        ClaimNotFound,
        InvalidValue,
    ];
    for (error, reason) in errors.iter().zip(reasons) {
        println!("{error}");
        assert_eq!(error.reason(), Some(reason), "{error}");
    }
    assert_eq!(shoulder(&daemon).await, before);
}

async fn a_taken_name_is_refused_unless_renaming_is_allowed(via: Via) {
    let daemon = arm(via).await;
    let package = simd_tests::robots::assets().join("Bench_Arm-1.2 rev B");
    let error = daemon.client.load(&package, fixed("arm")).await.unwrap_err();
    assert_eq!(error.reason(), Some(ErrorReason::RobotExists));
    let renamed = proto::SpawnEntityRequest { allow_renaming: true, ..fixed("arm") };
    assert_eq!(daemon.client.load(&package, renamed).await.unwrap().entity.name, "arm_1");
}

async fn a_spawn_whose_upload_is_missing_says_what_to_send(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let never = "0".repeat(64);
    let source = proto::DescriptionSource {
        source: Some(proto::description_source::Source::Description(never)),
        ..Default::default()
    };
    let request = proto::SpawnEntityRequest { source: Some(source), ..fixed("ghost") };
    let error = daemon.client.spawn(request).await.unwrap_err();
    assert_eq!(error.reason(), Some(ErrorReason::DescriptionNotUploaded), "{error}");
}

async fn a_claimed_joint_is_refused_to_others_by_the_holders_name(via: Via) {
    let daemon = arm(via).await;
    let lease = std::time::Duration::from_secs(60);
    let joints = vec![simd_client::every_joint("arm")];
    let secret = daemon.client.claim_joints(joints, "planner", lease).await.unwrap();
    let error =
        daemon.client.set_robot_targets("arm", [joint_target("shoulder", Target::Hold)]).await.unwrap_err();
    assert_eq!(error.reason(), Some(ErrorReason::JointClaimed));
    assert!(error.to_string().contains("planner"), "{error}");
    daemon.client.release_joints(&secret).await.unwrap();
    daemon.client.set_robot_targets("arm", [joint_target("shoulder", Target::Hold)]).await.unwrap();
}

/// A thousand simultaneous calls on a mailbox of one: each is done or refused with the reason, none hangs,
/// and the refusals are counted. Whether a call finds it full depends on the system, so the test repeats
/// until one does. (A test of the driver covers the refusal itself.)
async fn a_small_mailbox_answers_or_refuses_every_call(via: Via) {
    let daemon = Daemon::start_via(via, |config| config.driver.mailbox = 1).await;
    load_arm(&daemon.client, "arm").await;
    let (mut done, mut full) = (0, 0);
    let volleys = async {
        while done == 0 || full == 0 {
            let calls = (0..1000).map(|_| {
                let client = daemon.client.clone();
                tokio::spawn(async move {
                    client.set_robot_targets("arm", [joint_target("shoulder", Target::position(0.1))]).await
                })
            });
            for call in calls.collect::<Vec<_>>() {
                match call.await.unwrap() {
                    Ok(_) => done += 1,
                    Err(error) => {
                        assert_eq!(error.reason(), Some(ErrorReason::MailboxFull), "{error}");
                        full += 1;
                    }
                }
            }
        }
    };
    soon("a call that finds the mailbox full", volleys).await;
    println!("{done} done, {full} refused");
    let statistics = daemon.client.world_statistics().await.unwrap();
    assert_eq!(statistics.mailbox_refusals, full);
}

crate::over_every_transport![
    a_description_that_cannot_be_is_refused_by_the_element,
    refusals_name_what_is_wrong_and_leave_the_world_as_it_was,
    a_taken_name_is_refused_unless_renaming_is_allowed,
    a_spawn_whose_upload_is_missing_says_what_to_send,
    a_claimed_joint_is_refused_to_others_by_the_holders_name,
    a_small_mailbox_answers_or_refuses_every_call,
];
