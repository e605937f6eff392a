//! Sites and frames, which are links without mass.

use super::*;
use crate::robot::{Inertial, JointKind};
use crate::sensor::SensorMount;

fn mjcf(sections: &str, bodies: &str) -> String {
    format!("<mujoco model='m'>{sections}<worldbody>{bodies}</worldbody></mujoco>")
}

const PIVOT: &str = "<body name='arm' pos='0 0 1'><joint name='tip' axis='0 1 0'/><geom size='.1'/>\
    <site name='tip' pos='0 0 .5'/><site name='arm'/><site/><body name='hand' pos='0 0 1'><geom size='.1'/></body></body>";

fn names(model: &RobotModel) -> Vec<&str> {
    model.links.iter().map(|link| link.name.as_str()).collect()
}

#[test]
fn a_site_is_a_link_on_a_fixed_joint_and_has_another_name_if_a_body_has_its_name() {
    let (model, report) = robot(&mjcf("", PIVOT));
    assert_eq!(warnings(&report), []);
    // As a joint, it may have the name of a site.
    assert_eq!(names(&model), ["world", "arm", "hand", "tip", "arm_site"]);
    let site = model.joints.iter().find(|joint| joint.name == "tip_fixed").unwrap();
    assert_eq!((site.kind, names(&model)[site.parent]), (JointKind::Fixed, "arm"));
    assert!(near(site.parent_from_joint.translation, [0.0, 0.0, 0.5]));
    let tip = link(&model, "tip");
    assert_eq!((&tip.inertial, tip.visuals.len(), tip.collisions.len()), (&Inertial::ZERO, 0, 0));
    let said: Vec<&str> =
        report.findings.iter().map(|it| it.message.as_str()).filter(|it| it.contains("site")).collect();
    assert_eq!(
        said,
        ["2 sites are links without mass", "other links have the names of 1 site: \"arm\" is \"arm_site\""]
    );
}

#[test]
fn sites_of_the_world_are_on_the_robot_that_stands_still_or_named_as_left_out() {
    let sites = "<site name='a' pos='1 2 3'/><site name='b'/>";
    let ball = "<body name='ball'><freejoint/><geom size='1'/></body>";
    let (model, report) = robot(&mjcf("", &format!("{sites}{ball}")));
    assert_eq!(names(&model), ["ball"]);
    find(&report, "2 sites of the world left out: no robot stands still");
    let translation = translated(&mjcf("", &format!("{sites}{ball}<geom type='plane' size='1 1 1'/>")));
    let ground = &translation.model("m_ground").unwrap().urdf;
    let (model, _) = read(ground.as_bytes(), &Files::default(), &ReadOptions::default()).unwrap();
    assert_eq!(names(&model), ["world", "a", "b"]);
    assert!(near(root_from_link(&model, "a").translation, [1.0, 2.0, 3.0]));
}

#[test]
fn sites_of_copies_and_of_attached_files_have_the_names_of_mujoco() {
    let leg = "<mujoco><worldbody><body name='leg'><geom size='1'/><site name='foot' pos='0 0 -1'/></body></worldbody></mujoco>";
    let text = mjcf(
        "<asset><model name='leg' file='leg.xml'/></asset>",
        "<body name='trunk'><freejoint/><geom size='1'/><replicate count='2' offset='1 0 0' sep='_'><site name='s'/></replicate>\
         <frame pos='0 1 0'><attach model='leg' body='leg' prefix='left_'/></frame></body>",
    );
    let (model, _) = robot_with(&text, &Files::default().with("leg.xml", leg));
    assert_eq!(names(&model), ["trunk", "left_leg", "left_foot", "s_0", "s_1"]);
    assert!(near(root_from_link(&model, "left_foot").translation, [0.0, 1.0, -1.0]));
    assert!(near(root_from_link(&model, "s_1").translation, [1.0, 0.0, 0.0]));
}

#[test]
fn sites_beyond_the_limits_are_left_out_with_one_line() {
    let copies = |count: usize| {
        mjcf(
            "",
            &format!(
                "<body name='b'><freejoint/><geom size='1'/><replicate count='{count}'><site name='s'/></replicate></body>"
            ),
        )
    };
    let (model, report) = robot(&copies(999));
    assert_eq!((model.links.len(), warnings(&report).len()), (1000, 0));
    let (model, report) = robot(&copies(20_000));
    assert_eq!(model.links.len(), 1000);
    let message = "19001 sites left out: a robot has at most 1000 links, and a file 10000";
    assert_eq!(warnings(&report), [(Some(1), message)]);
    // Many robots share the limit of the file.
    let body = "<body name='b'><freejoint/><geom size='1'/><replicate count='900'><site name='s'/></replicate></body>";
    let text = mjcf("", &format!("<replicate count='20' sep='_'>{body}</replicate>"));
    let translation = translated(&text);
    let links: usize = translation.models.iter().map(|model| model.urdf.matches("<link ").count()).sum();
    assert_eq!((translation.models.len(), links), (20, 10_000));
}

#[test]
fn a_name_that_a_urdf_cannot_have_refuses_no_file() {
    let long = "n".repeat(5000);
    let text = mjcf(
        "",
        &format!(
            "<body name='b'><freejoint/><geom size='1'/><site name='{long}'/><site name='{long}'/><site name='a&#x85;b'/><site name='&#x85;'/></body>"
        ),
    );
    let (model, report) = robot(&text);
    let lengths: Vec<usize> = model.links.iter().map(|link| link.name.len()).collect();
    assert_eq!(lengths, [1, 984, 984 + "_site".len(), 2]);
    assert_eq!(warnings(&report), []);
}

#[test]
fn sensors_stay_on_their_bodies_whatever_sites_are_called() {
    // The site of one robot has the name of a body of another.
    let text = mjcf(
        "",
        "<body name='one'><freejoint/><geom size='1'/></body><body name='two'><freejoint/><geom size='1'/><site name='one' pos='0 0 1'/></body>",
    )
    .replace("</mujoco>", "<sensor><framepos objtype='xbody' objname='one'/><gyro site='one'/></sensor></mujoco>");
    let translation = translated(&text);
    for (name, count) in [("one", 1), ("two", 1)] {
        let urdf = &translation.model(name).unwrap().urdf;
        let (model, _) = read(urdf.as_bytes(), &Files::default(), &ReadOptions::default()).unwrap();
        assert_eq!(model.setup.sensors.len(), count);
        assert_eq!(model.setup.sensors[0].on, SensorMount::Link(0), "{urdf}");
    }
}

#[test]
fn frames_of_nested_and_merged_models_have_the_names_that_sdf_gives_them() {
    let inner = "<link name='l'/><frame name='f' attached_to='l'><pose>0 0 1 0 0 0</pose></frame>";
    let file = format!("<sdf version='1.9'><model name='file'>{inner}</model></sdf>")
        .replace("'l'", "'k'")
        .replace("'f'", "'g'");
    let text = format!(
        "<sdf version='1.9'><model name='m'><link name='a'/><model name='n'><pose>1 0 0 0 0 0</pose>{inner}</model>\
         <include merge='true'><uri>file</uri></include>\
         <joint name='i' type='fixed'><parent>a</parent><child>n::l</child></joint>\
         <joint name='j' type='revolute'><parent>n::l</parent><child>k</child><axis><xyz>0 0 1</xyz></axis></joint>\
         <frame name='on_joint' attached_to='j'/><frame name='on_frame' attached_to='n::f'/><frame name='on_model' attached_to='n'/>\
         <frame name='own'/></model></sdf>"
    );
    let (model, report) = robot_with(&text, &Files::default().with("file/model.sdf", file));
    assert_eq!(warnings(&report), []);
    let hangs: Vec<(&str, &str)> = ["n::f", "g", "on_joint", "on_frame", "on_model", "own"]
        .into_iter()
        .map(|name| {
            let at = model.links.iter().position(|link| link.name == name).unwrap();
            (name, names(&model)[model.joints[at - 1].parent])
        })
        .collect();
    let expected = [
        ("n::f", "n::l"),
        ("g", "k"),
        ("on_joint", "k"),
        ("on_frame", "n::l"),
        ("on_model", "n::l"),
        ("own", "a"),
    ];
    assert_eq!(hangs, expected);
    assert_eq!(model.links[0].name, "a");
    assert!(near(root_from_link(&model, "on_frame").translation, [1.0, 0.0, 1.0]));
    find(&report, "6 frames are links without mass");
}

#[test]
fn frames_of_a_world_and_frames_on_nothing_are_named_in_the_report() {
    let text = "<sdf version='1.9'><world name='w'><frame name='f'><pose>1 0 0 0 0 0</pose></frame>\n\
        <model name='m'><pose relative_to='f'/><link name='a'/><frame name='g' attached_to='b'><pose relative_to='a'/></frame></model></world></sdf>";
    let (model, report) = robot(text);
    assert_eq!(names(&model), ["a"]);
    find(&report, "1 frame of the world only for poses");
    assert_eq!(find(&report, "the frame \"g\" is attached to no link: left out").line, Some(2));
}
