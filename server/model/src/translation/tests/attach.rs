//! Attached parts of other MJCFs.

use super::*;

const LEG: &str = "<mujoco model='leg'><compiler angle='radian' meshdir='m'/><default><geom density='500'/>\
    <default class='thin'><geom size='0.1'/></default></default>\
    <asset><mesh name='foot' vertex='0 0 0 1 0 0 0 1 0 0 0 1'/></asset>\
    <worldbody><body name='hip' pos='0 0 1' childclass='thin'><freejoint/><geom/>\
    <body name='shin' pos='1 0 0'><joint name='knee' range='-0.5 0.5'/><geom/><geom type='mesh' mesh='foot'/></body></body>\
    <frame name='rack' pos='0 0 5'><body name='ball'><freejoint/><geom size='0.2'/></body></frame></worldbody>\
    <actuator><motor joint='knee'/></actuator></mujoco>";

fn main_file(bodies: &str) -> String {
    format!(
        "<mujoco model='main'><default><geom density='7'/></default><asset>\n\
         <model file='parts/leg.xml'/><model name='second' file='parts/leg.xml'/></asset><worldbody>\n{bodies}\n</worldbody></mujoco>"
    )
}

fn files() -> Files {
    Files::default().with("parts/leg.xml", LEG)
}

fn names(translation: &Translation) -> Vec<&str> {
    translation.models.iter().map(|model| model.name.as_str()).collect()
}

#[test]
fn a_body_is_attached_with_a_prefix_and_the_settings_of_its_file() {
    let text = main_file(
        "<frame pos='3 0 0'><attach model='leg' body='hip' prefix='left_'/></frame>\
         <body name='hip'><freejoint/><geom size='1'/></body>",
    );
    let translation = translated_with(&text, &files());
    assert_eq!(names(&translation), ["left_hip", "hip"]);
    assert_eq!(translation.included, ["parts/leg.xml"]);
    assert_eq!(translation.models[0].pose.translation, glamx::DVec3::new(3.0, 0.0, 1.0));
    let (left, _) =
        read(translation.models[0].urdf.as_bytes(), &translation.files(&files()), &ReadOptions::default())
            .unwrap();
    assert_eq!(left.joints[0].limits.upper, Some(0.5), "radians, as its own compiler says");
    let ball = 4.0 / 3.0 * std::f64::consts::PI * 0.001 * 500.0;
    assert!((link(&left, "left_hip").inertial.mass - ball).abs() < 1e-12);
    assert!((link(&left, "left_shin").inertial.mass - ball - 500.0 / 6.0).abs() < 1e-9);
    let left_out: Vec<_> = warnings(&translation.report);
    assert_eq!(left_out, [(Some(1), "not read by simd in an attached file: left out")]);
}

#[test]
fn frames_whole_worlds_and_parts_of_the_file_itself_are_attached() {
    let text = main_file(
        "<attach model='second' prefix='all_'/><attach model='leg' frame='rack' prefix='one_'/>\
         <frame name='own' pos='0 1 0'><body name='b'><freejoint/><geom size='1'/></body></frame>\
         <replicate count='2' offset='0 2 0'><attach frame='own' prefix='again_'/></replicate>",
    );
    let translation = translated_with(&text, &files());
    assert_eq!(names(&translation), ["all_hip", "all_ball", "one_ball", "b", "again_b0", "again_b1"]);
    let at = |index: usize| translation.models[index].pose.translation.to_array();
    assert_eq!((at(2), at(5)), ([0.0, 0.0, 5.0], [0.0, 3.0, 0.0]));
}

#[test]
fn impossible_attachments_are_refused_with_their_line() {
    let refused =
        |bodies: &str| match translate(main_file(bodies).as_bytes(), &files(), &LoadLimits::default()) {
            Err(refused) => refused.message,
            other => panic!("it should be refused: {other:?}"),
        };
    assert!(refused("<attach model='no' body='hip'/>").contains("(line 3): there is no model \"no\""));
    assert!(refused("<attach model='leg' body='no'/>").contains("there is no body \"no\" to attach"));
    assert!(refused("<attach prefix='x'/>").contains("no model, no body and no frame"));
    let twice = "<attach model='leg' body='hip'/><attach model='leg' body='hip'/>";
    assert!(refused(twice).contains("another body has this name"), "{}", refused(twice));
    let itself = "<body name='a'><attach body='a' prefix='x'/></body>";
    assert!(refused(itself).contains("deeper than"), "{}", refused(itself));
    let many = "<frame name='a'><attach frame='a' prefix='x'/><attach frame='a' prefix='y'/></frame>";
    let said = refused(many);
    assert!(said.contains("elements") || said.contains("deeper than"), "{said}");
    match translate(
        main_file("<attach model='leg' body='hip'/>").as_bytes(),
        &Files::default(),
        &LoadLimits::default(),
    ) {
        Err(refused) => assert!(refused.message.contains("\"parts/leg.xml\" is not found"), "{refused}"),
        other => panic!("{other:?}"),
    }
}
