//! Messages that are decoded, and messages that are refused before.

use prost::Message as _;

use super::*;
use crate::v1;

fn target(joint: usize) -> v1::JointTarget {
    let position = v1::PositionTarget { position: 0.5, ..Default::default() };
    let target = Some(v1::joint_target::Target::Position(position));
    v1::JointTarget { joint: format!("a_joint_with_a_name_{joint}"), axis: 0, target }
}

#[test]
fn targets_of_a_thousand_robots_of_thirty_joints_are_decoded() {
    let joints: Vec<_> = (0..30).map(target).collect();
    let robot = |number| v1::RobotTargets {
        robot: format!("robot_{number}"),
        joints: joints.clone(),
        ..Default::default()
    };
    let request = v1::SetJointTargetsRequest { robots: (0..1000).map(robot).collect(), ..Default::default() };
    assert_eq!(decode(&request.encode_to_vec()), Ok(request));
}

#[test]
fn twenty_thousand_rays_are_decoded() {
    let vector = |x| Some(v1::Vector3 { x, y: 1.0, z: 2.0 });
    let ray = |number| v1::Ray { from: vector(f64::from(number)), to: vector(0.0) };
    let request = v1::CastRaysRequest { rays: (0..20_000).map(ray).collect(), collision_mask: None };
    assert_eq!(decode(&request.encode_to_vec()), Ok(request));
}

#[test]
fn files_and_names_of_many_files_are_decoded() {
    let upload = v1::UploadAssetRequest { data: vec![7; 15 << 20], ..Default::default() };
    assert_eq!(decode(&upload.encode_to_vec()), Ok(upload));
    let name = |number: u32| (format!("package://arm/meshes/part_{number}.stl"), "0".repeat(64));
    let prepare =
        v1::PrepareDescriptionRequest { urdf: vec![b' '; 8 << 20], assets: (0..10_000).map(name).collect() };
    assert_eq!(decode(&prepare.encode_to_vec()), Ok(prepare));
}

#[test]
fn millions_of_empty_elements_are_refused_before_they_are_decoded() {
    let mebibytes = 14 << 20;
    // Field 1 of each is a list of messages or of texts.
    let elements = [1 << 3 | 2, 0].repeat(mebibytes / 2);
    let refused = Err(Refused::TooMuch { bytes: mebibytes, most: most(mebibytes) });
    assert_eq!(decode::<v1::SetJointTargetsRequest>(&elements).map(drop), refused);
    assert_eq!(decode::<v1::GetLinkPosesRequest>(&elements).map(drop), refused);
    // The same list within one robot's targets.
    let mut nested = vec![1 << 3 | 2];
    prost::encoding::encode_varint(elements.len() as u64 - 6, &mut nested);
    nested.extend([4 << 3 | 2, 0].repeat(mebibytes / 2 - 3));
    let refusal = decode::<v1::SetJointTargetsRequest>(&nested).unwrap_err();
    assert!(matches!(refusal, Refused::TooMuch { .. }), "{refusal}");
}

#[test]
fn a_long_list_of_numbers_is_decoded() {
    let whole = v1::WholeRobotTarget { values: vec![0.5; 1 << 20], ..Default::default() };
    let robots = vec![v1::RobotTargets { whole: Some(whole), ..Default::default() }];
    let request = v1::SetJointTargetsRequest { robots, ..Default::default() };
    assert_eq!(decode(&request.encode_to_vec()), Ok(request));
}

#[test]
fn a_map_of_empty_entries_is_weighed_by_its_nodes() {
    let entries = [2 << 3 | 2, 0].repeat(1 << 20);
    let refusal = decode::<v1::PrepareDescriptionRequest>(&entries).unwrap_err();
    assert!(matches!(refusal, Refused::TooMuch { .. }), "{refusal}");
}

#[test]
fn invalid_bytes_are_refused_before_they_are_decoded() {
    let malformed: [&[u8]; 6] = [
        &[0x0a, 0xff, 0xff, 0xff, 0xff, 0x0f],
        // A list element that claims more bytes than its message has, with the rest after it.
        &[0x0a, 2, 0x12, 100, 0, 0, 0, 0],
        &[0x0b, 0x0c],
        &[0x0f],
        &[0x00, 0x00],
        &[0xff; 12],
    ];
    for bytes in malformed {
        assert_eq!(decode::<v1::SetJointTargetsRequest>(bytes), Err(Refused::Malformed), "{bytes:?}");
    }
}

#[test]
fn fields_of_a_newer_schema_are_skipped() {
    // Field 1000, of each wire type.
    let key = |wire: u8| [0xc0 | wire, 0x3e];
    let mut bytes = Vec::new();
    bytes.extend(key(0));
    bytes.push(7);
    bytes.extend(key(1));
    bytes.extend([0; 8]);
    bytes.extend(key(5));
    bytes.extend([0; 4]);
    bytes.extend(key(2));
    bytes.extend([3, 1, 2, 3]);
    assert_eq!(decode(&bytes), Ok(v1::SetJointTargetsRequest::default()));
}

/// Prost would put such a message into a separate allocation, whose size is not counted.
#[test]
fn no_message_contains_itself() {
    fn depth(shape: &Shape, left: usize) -> usize {
        assert!(left > 0, "a message contains itself, or {MAX_DEPTH} levels of others");
        let inside = shape.fields.iter().filter_map(|field| match field.inside {
            Inside::Message(shape) => Some(depth(shape, left - 1)),
            Inside::Bytes | Inside::Numbers(_) => None,
        });
        1 + inside.max().unwrap_or(0)
    }
    assert!(depth(v1::SpawnEntityWithProgressRequest::SHAPE, MAX_DEPTH) >= 4);
    assert!(requests().len() > 50);
}
