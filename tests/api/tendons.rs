//! Joints that are tendons, as clients see them.

use simd_client::proto::{self, JointType};
use simd_tests::daemon::{Daemon, Via};

use crate::over_every_transport;

const FINGER: &str = "<mujoco model='finger'><worldbody><body name='palm'><geom size='.05'/><body name='a' pos='0 0 .1'>\
    <joint name='knuckle' axis='0 1 0'/><geom size='.02'/><body name='b' pos='0 0 .1'><joint name='tip' axis='0 1 0'/>\
    <geom size='.02'/></body></body></body></worldbody><tendon><fixed name='pull'><joint joint='tip' coef='-0.01'/>\
    <joint joint='knuckle' coef='0.02'/></fixed></tendon><actuator><motor tendon='pull'/></actuator></mujoco>";

async fn a_joint_that_is_a_tendon_has_its_terms(via: Via) {
    let daemon = Daemon::paused_via(via).await;
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("finger.xml");
    std::fs::write(&file, FINGER).unwrap();
    let request = proto::SpawnEntityRequest { name: "finger".into(), ..Default::default() };
    daemon.client.load(&file, request).await.unwrap();
    let joints = daemon.client.joint_layout("finger").await.unwrap().joints;
    let (tendons, others): (Vec<_>, Vec<_>) = joints.into_iter().partition(|joint| joint.tendon.is_some());
    assert_eq!(others.iter().map(|joint| joint.name.as_str()).collect::<Vec<_>>(), ["knuckle", "tip"]);
    let [pull] = &tendons[..] else { panic!("{tendons:?}") };
    assert_eq!((pull.name.as_str(), pull.r#type()), ("pull", JointType::Prismatic));
    let term = |joint: &str, factor| proto::JointTendonTerm { joint: joint.into(), factor };
    let terms = vec![term("knuckle", 0.02), term("tip", -0.01)];
    assert_eq!(pull.tendon, Some(proto::JointTendon { terms, offset: 0.0 }));
}

over_every_transport! { a_joint_that_is_a_tendon_has_its_terms, }
