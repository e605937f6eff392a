//! SDF in the wild: merges, missing parts, and forms that other readers accept.

use super::*;
use crate::setup::{ConstraintOn, LinkConstraintKind};

const INERTIAL: &str =
    "<inertial><mass>1</mass><inertia><ixx>0.1</ixx><iyy>0.1</iyy><izz>0.1</izz></inertia></inertial>";

/// Returns a model of version 1.7.
fn sdf(content: &str) -> String {
    format!("<sdf version='1.7'><model name='m'>{content}</model></sdf>")
}

#[test]
fn an_include_that_is_not_there_leaves_the_rest_of_a_world() {
    let world = |uri: &str| {
        format!(
            "<sdf version='1.6'><world name='w'><include><uri>{uri}</uri></include>\n\
             <include><uri>model://sun</uri></include><include><uri>model://ground_plane</uri></include>\
             <model name='box'><link name='l'>{INERTIAL}</link></model></world></sdf>"
        )
    };
    for (uri, said) in [
        ("https://fuel.gazebosim.org/1.0/OpenRobotics/models/Depot", "nothing is fetched from the network"),
        ("model://nothing", "`--package NAME=FOLDER`"),
    ] {
        let translation = translated(&world(uri));
        let names: Vec<&str> = translation.models.iter().map(|model| model.name.as_str()).collect();
        assert_eq!(names, ["ground_plane", "box"]);
        let missing = translation.missing.as_ref().unwrap();
        assert!(missing.contains(uri) && missing.contains(said), "{missing}");
        assert!(find(&translation.report, "is not found").line == Some(1));
        assert!(translation.included.iter().any(|included| included.starts_with(uri)));
    }
    let translation = translated(&world("https://fuel.gazebosim.org/1.0/OpenRobotics/models/Ground Plane"));
    assert_eq!(translation.missing, None);
    assert!(translation.models.iter().filter(|model| model.fixed).count() == 2);
}

#[test]
fn an_include_by_name_alone_is_searched_as_a_model_and_may_stand_outside_of_worlds() {
    let files = Files::default().with("model://simple/model.sdf", SIMPLE);
    for text in [
        "<sdf version='1.9'><model name='m'><include merge='true'><uri>simple</uri></include></model></sdf>",
        "<sdf version='1.9'><include><uri>simple</uri></include></sdf>",
        "<sdf version='1.9'><include><uri>model://simple</uri></include></sdf>",
        "<sdf version='1.9'><world name='w'><include><uri>sun</uri></include><include><uri>simple</uri></include>\
         <include><uri>ground_plane</uri></include></world></sdf>",
    ] {
        let translation = translated_with(text, &files);
        assert_eq!(translation.missing, None, "{text}");
        assert!(translation.models.iter().any(|model| model.urdf.contains("<link name=\"base\"")), "{text}");
    }
    // A file beside the including one is nearer.
    let nearer = files
        .with("simple/model.sdf", SIMPLE.replace("name='base'", "name='near'").replace("'base'>", "'near'>"));
    let translation =
        translated_with("<sdf version='1.9'><include><uri>simple</uri></include></sdf>", &nearer);
    assert!(translation.models[0].urdf.contains("<link name=\"near\""));
}

const SIMPLE: &str = "<sdf version='1.9'><model name='simple'><link name='base'><pose>0 0 1 0 0 0</pose>\
    <inertial><mass>2</mass></inertial></link><frame name='tip' attached_to='base'><pose>0.5 0 0 0 0 0</pose></frame>\
    </model></sdf>";

#[test]
fn a_merged_model_gives_its_links_and_frames_their_own_names() {
    let files = Files::default().with("model://simple/model.sdf", SIMPLE);
    let text = "<sdf version='1.9'><model name='top'><link name='root'/>\
        <include merge='true'><uri>model://simple</uri><pose>0 3 0 0 0 0</pose></include>\
        <joint name='j' type='fixed'><parent>root</parent><child>base</child></joint>\
        <link name='hand'><pose relative_to='tip'/></link>\
        <joint name='k' type='fixed'><parent>tip</parent><child>hand</child></joint></model></sdf>";
    let (model, _) = robot_with(text, &files);
    assert!(near(root_from_link(&model, "base").translation, [0.0, 3.0, 1.0]));
    assert!(near(root_from_link(&model, "hand").translation, [0.5, 3.0, 1.0]));
    let twice = text.replace("name='hand'", "name='base'").replace(">hand<", ">base<");
    let refused = translate(twice.as_bytes(), &files, &LoadLimits::default()).unwrap_err().message;
    assert!(refused.contains("another element") || refused.contains("merges"), "{refused}");
}

#[test]
fn a_model_relative_to_a_frame_of_another_nested_model_may_come_before_it() {
    // The placed model's tip is at the other one's frame.
    let placed = "<include><uri>simple</uri><name>placed</name><placement_frame>tip</placement_frame>\
        <pose relative_to='other::f'/></include>";
    let other = "<model name='other'><frame name='f'><pose degrees='true'>0.25 0 0 0 0 -90</pose></frame>\
        <include merge='true'><uri>simple</uri></include></model>";
    let joints = "<joint name='j1' type='fixed'><parent>root</parent><child>other::base</child></joint>\
        <joint name='j2' type='fixed'><parent>other::f</parent><child>placed</child></joint>";
    let files = || Files::default().with("simple/model.sdf", SIMPLE);
    for (first, second) in [(placed, other), (other, placed)] {
        let text = format!(
            "<sdf version='1.9'><model name='top'><link name='root'/>{first}{second}{joints}</model></sdf>"
        );
        let (model, _) = robot_with(&text, &files());
        assert!(near(root_from_link(&model, "other::base").translation, [0.0, 0.0, 1.0]));
        // Half a metre from the base to its tip, rotated by -90 degrees; a metre down to the model's origin
        // and up again.
        assert!(near(root_from_link(&model, "placed::base").translation, [0.25, 0.5, 0.0]));
    }
}

#[test]
fn looks_that_cannot_be_read_refuse_no_model() {
    let text = sdf(&format!(
        "<link name='a'>{INERTIAL}<visual name='v'><pose>0 0</pose><geometry><sphere><radius>1</radius></sphere></geometry></visual></link>"
    ));
    let (model, report) = robot(&text);
    assert!(link(&model, "a").visuals.is_empty());
    assert_eq!(find(&report, "since it is only visual").severity, Severity::Warning);
}

#[test]
fn xml_that_is_not_well_formed_is_repaired_with_a_note() {
    let text = "<sdf version=\"1.9\"><!-- ----- base ----- -->\n<model name=\"m\"><link name=\"l\"><collision name=\"c\">\
        <geometry><box><size>1 1 1</size></box></geometry><surface><friction><ode><fdir1 gz:expressed_in=\"l\">1 -1 0</fdir1>\
        </ode></friction></surface></collision></link></model></sdf>";
    let (model, report) = robot(text);
    assert_eq!(link(&model, "l").collisions.len(), 1);
    assert_eq!(find(&report, "two dashes").line, Some(1));
    assert_eq!(find(&report, "the prefix \"gz\" is not declared").line, Some(2));
}

#[test]
fn unread_parts_of_a_file_are_named_by_element_and_attribute() {
    let text = "<sdf version='1.9'><model name='m' made_up='1'><enable_wind>1</enable_wind><link name='a'>\
        <inertial><mass>1</mass><fluid_added_mass><xx>1</xx></fluid_added_mass></inertial>\
        <collision name='c'><max_contacts>3</max_contacts><geometry><box><size>1 1 1</size></box></geometry><surface><friction><ode>\
        <mu>0.3</mu><mu2>0.9</mu2><slip1>0.1</slip1></ode></friction><contact><ode><kp>1e5</kp></ode></contact></surface></collision></link>\
        <link name='b'/><joint name='j' type='revolute'><parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz>\
        <initial_position>0.4</initial_position><limit><lower>-1</lower><upper>1</upper><stiffness>1e8</stiffness></limit></axis>\
        <physics><ode><limit><erp>0.1</erp></limit></ode></physics></joint></model></sdf>";
    let (_, report) = robot(text);
    for element in [
        "enable_wind",
        "fluid_added_mass",
        "max_contacts",
        "mu2",
        "slip1",
        "kp",
        "initial_position",
        "stiffness",
        "physics",
    ] {
        let is_named = |finding: &Finding| {
            (finding.element.ends_with(element) || finding.element.contains(&format!(" {element} ")))
                && finding.message.contains("not read")
                || finding.message.contains(element)
        };
        assert!(report.findings.iter().any(is_named), "{element}: {:#?}", report.findings);
    }
    find(&report, "attribute \"made_up\" is not read");
    assert!(!report.findings.iter().any(|finding| finding.element.ends_with("lower")));
}

#[test]
fn a_joint_that_is_called_world_is_not_what_hangs_on_the_world() {
    let text = sdf(&format!(
        "<link name='a'>{INERTIAL}</link><joint name='world' type='fixed'><parent>world</parent><child>a</child></joint>"
    ));
    assert!(translated(&text).models[0].fixed);
}

#[test]
fn joints_between_models_of_a_world_are_constraints_between_their_robots() {
    let model = |name: &str, x: f64| {
        format!(
            "<model name='{name}'><pose>{x} 0 0 0 0 0</pose><link name='base'>{INERTIAL}</link><link name='tip'><pose>0.5 0 0 0 0 0</pose>{INERTIAL}</link>\
                 <joint name='own' type='fixed'><parent>base</parent><child>tip</child></joint></model>\n"
        )
    };
    let world = |joint: &str| {
        format!(
            "<sdf version='1.10'><world name='w'>{}{}<frame name='there' attached_to='b::tip'><pose>0.1 0 0 0 0 0</pose></frame>\n\
             {joint}</world></sdf>",
            model("a", 0.0),
            model("b", 1.0)
        )
    };
    let joint = |kind: &str, parent: &str, child: &str, content: &str| {
        world(&format!(
            "<joint name='j' type='{kind}'><parent>{parent}</parent><child>{child}</child>{content}</joint>"
        ))
    };
    let constraints = |text: &str, robot: &str| {
        let translation = translated(text);
        let urdf = &translation.model(robot).unwrap_or_else(|refused| panic!("{refused}")).urdf;
        let (model, _) = read(urdf.as_bytes(), &Files::default(), &ReadOptions::default()).unwrap();
        (model.setup.constraints, translation.report)
    };
    // The child's frame has the constraint: 1 m from a's base, and 0.5 m from its tip.
    let (found, report) = constraints(&joint("fixed", "a::tip", "b", ""), "b");
    assert_eq!(warnings(&report), []);
    let [weld] = &found[..] else { panic!("{found:?}") };
    assert_eq!(weld.kind, LinkConstraintKind::Weld);
    assert!(matches!(&weld.ends[0].on, ConstraintOn::Other { robot, name } if robot == "a" && name == "tip"));
    assert!(near(weld.ends[0].pose.unwrap().translation, [0.5, 0.0, 0.0]));
    // A frame of the world, and an axis.
    let axis = "<axis><xyz>0 1 0</xyz></axis>";
    let (found, report) = constraints(&joint("revolute", "there", "a::base", axis), "a");
    assert_eq!(warnings(&report), []);
    assert_eq!(found[0].kind, LinkConstraintKind::Hinge(glamx::DVec3::Y));
    assert!(near(found[0].ends[0].pose.unwrap().translation, [-1.5, 0.0, 0.0]));
    let (found, _) = constraints(&joint("ball", "world", "a", ""), "a");
    assert_eq!(
        (found[0].kind, &found[0].ends[0].on),
        (LinkConstraintKind::PointToPoint, &ConstraintOn::World)
    );
    // Parts that a constraint lacks are named, with a remedy, and nothing refuses the world.
    let limited = "<axis><xyz>0 1 0</xyz><limit><lower>-1</lower><upper>1</upper></limit></axis>";
    for (text, count, words) in [
        (joint("revolute", "a", "b::base", limited), 1, "a model that includes both has all of the joint"),
        (joint("universal", "a", "b", ""), 0, "has two axes: left out"),
        (
            joint("fixed", "a::hand", "b", ""),
            0,
            "its parent \"a::hand\" is not a model, link or frame of the world",
        ),
        (joint("fixed", "a", "world", ""), 0, "its child \"world\" is not"),
        (joint("screw", "a", "b", ""), 0, "no joint of type \"screw\": left out"),
        (joint("fixed", "b", "b::base", ""), 0, "are the same link"),
    ] {
        let (found, report) = constraints(&text, "b");
        assert_eq!(found.len(), count, "{words}");
        assert_eq!(find(&report, words).line, Some(4), "{words}");
    }
    let lost = "<include><uri>model://nothing</uri><name>c</name></include>";
    let text = joint("fixed", "c::base", "b", "").replace("<frame", &format!("{lost}<frame"));
    find(&constraints(&text, "b").1, "belongs to an include that is not there");
}
