//! SDF.

use glamx::DVec3;

use super::*;
use crate::robot::{Geometry, JointKind};
use crate::setup::LinkConstraintKind;
use crate::setup::{DriveMode, Spring};

fn sdf(content: &str) -> String {
    format!("<sdf version='1.9'>\n<model name='m'>\n{content}\n</model></sdf>")
}

const INERTIAL: &str =
    "<inertial><mass>2</mass><inertia><ixx>0.1</ixx><iyy>0.2</iyy><izz>0.25</izz></inertia></inertial>";

#[test]
fn links_stand_where_their_poses_say_whatever_they_are_relative_to() {
    let text = sdf(&format!(
        "<link name='a'><pose>0 0 1 0 0 0</pose>{INERTIAL}</link>\
         <frame name='f' attached_to='a'><pose degrees='true'>1 0 0 0 0 90</pose></frame>\
         <link name='b'><pose relative_to='f'>1 0 0 0 0 0</pose>{INERTIAL}</link>\
         <joint name='j' type='revolute'><parent>a</parent><child>b</child><axis><xyz>0 1 0</xyz>\
         <limit><lower>-1</lower><upper>2</upper><effort>-1</effort></limit></axis></joint>"
    ));
    let translation = translated(&text);
    assert!(near(translation.models[0].pose.translation, [0.0, 0.0, 1.0]), "the root is the first link");
    let (model, report) = robot(&text);
    assert_eq!(warnings(&report), []);
    assert!(
        near(root_from_link(&model, "b").translation, [1.0, 1.0, 0.0]),
        "{:?}",
        root_from_link(&model, "b")
    );
    let j = joint(&model, "j");
    assert_eq!(
        (j.kind, j.limits.lower, j.limits.upper, j.limits.effort),
        (JointKind::Revolute, Some(-1.0), Some(2.0), None)
    );
    assert!(near(j.axis, [0.0, 1.0, 0.0]), "an axis is in the joint's frame, which is the child's");
    assert_eq!(link(&model, "b").inertial.mass, 2.0);
}

#[test]
fn a_model_without_auto_disable_stays_awake() {
    let of = |says: &str| robot(&sdf(&format!("{says}<link name='a'>{INERTIAL}</link>"))).0.setup.stays_awake;
    assert!(of("<allow_auto_disable>false</allow_auto_disable>"));
    assert!(of("<allow_auto_disable>0</allow_auto_disable>"));
    assert!(!of("<allow_auto_disable>true</allow_auto_disable>") && !of(""));
}

#[test]
fn a_joint_apart_from_its_child_leaves_the_childs_frame_where_it_is() {
    let text = sdf(&format!(
        "<link name='a'>{INERTIAL}</link><link name='b'><pose>1 0 0 0 0 0</pose>{INERTIAL}</link>\
         <joint name='j' type='prismatic'><pose>0 0 0.5 0 0 0</pose><parent>a</parent><child>b</child>\
         <axis><xyz expressed_in='__model__'>1 0 0</xyz></axis></joint>"
    ));
    let (model, _) = robot(&text);
    assert!(near(joint(&model, "j").parent_from_joint.translation, [1.0, 0.0, 0.5]));
    assert!(near(root_from_link(&model, "b").translation, [1.0, 0.0, 0.0]));
    assert_eq!(link(&model, "j_frame").inertial.mass, 0.0);
}

#[test]
fn a_joint_on_the_world_makes_a_robot_that_stands_on_it() {
    let text = sdf(&format!(
        "<pose>1 2 3 0 0 0</pose><link name='a'><pose>0 0 1 0 0 0</pose>{INERTIAL}</link>\
         <joint name='j' type='continuous'><parent>world</parent><child>a</child><axis><xyz>0 0 2</xyz>\
         <dynamics><damping>0.5</damping><friction>0.1</friction><spring_stiffness>3</spring_stiffness>\
         <spring_reference>0.2</spring_reference></dynamics></axis></joint>"
    ));
    let translation = translated(&text);
    let only = &translation.models[0];
    assert!(only.fixed && near(only.pose.translation, [1.0, 2.0, 3.0]));
    let (model, _) = robot(&text);
    assert_eq!(model.links[0].name, "world");
    let j = joint(&model, "j");
    assert_eq!((j.kind, j.damping, j.friction), (JointKind::Continuous, 0.5, 0.1));
    assert!(near(j.axis, [0.0, 0.0, 1.0]));
    let setup = model.setup.joints[0];
    assert_eq!(setup.mode, Some(DriveMode::Passive));
    assert_eq!(setup.spring, Some(Spring { stiffness: 3.0, rest: 0.2 }));
}

#[test]
fn several_models_and_unjoined_links_are_robots_with_separate_names() {
    let text = format!(
        "<sdf version='1.6'><world name='w'><light name='l'/><physics type='ode'><max_step_size>0.001</max_step_size></physics>\
         <model name='box'><static>true</static><link name='l'><collision name='c'><geometry><box><size>1 2 3</size></box>\
         </geometry></collision></link></model>\
         <model name='two'><pose>5 0 0 0 0 0</pose><link name='a'>{INERTIAL}</link><link name='b'>{INERTIAL}</link></model>\
         <model name='box'><link name='l'>{INERTIAL}</link></model></world></sdf>"
    );
    let translation = translated(&text);
    let names: Vec<(&str, bool)> =
        translation.models.iter().map(|model| (model.name.as_str(), model.fixed)).collect();
    assert_eq!(names, [("box", true), ("two", false), ("two_b", false), ("box_2", false)]);
    assert!(near(translation.models[1].pose.translation, [5.0, 0.0, 0.0]));
    let refused = translation.model("").unwrap_err().message;
    assert!(refused.contains("4 robots") && refused.contains("\"two_b\""), "{refused}");
    assert!(translation.model("box_2").is_ok());
}

#[test]
fn included_and_nested_models_are_found_placed_and_named() {
    let wheel = format!(
        "<sdf version='1.7'><model name='wheel'><link name='rim'>{INERTIAL}<visual name='v'><geometry>\
        <mesh><uri>meshes/rim.stl</uri></mesh></geometry></visual></link></model></sdf>"
    );
    let text = sdf(&format!(
        "<link name='body'>{INERTIAL}</link><include><uri>model://wheel</uri><name>left</name><pose>0 1 0 0 0 0</pose></include>\
         <include><uri>model://wheel</uri><name>right</name><pose>0 -1 0 0 0 0</pose></include>\
         <joint name='l' type='revolute'><parent>body</parent><child>left::rim</child><axis><xyz>0 1 0</xyz></axis></joint>\
         <joint name='r' type='revolute'><parent>body</parent><child>right</child><axis><xyz>0 1 0</xyz></axis></joint>"
    ));
    let files = Files::default().with("model://wheel/model.sdf", wheel);
    let (model, _) = robot_with(&text, &files);
    assert!(near(root_from_link(&model, "left::rim").translation, [0.0, 1.0, 0.0]));
    assert!(near(root_from_link(&model, "right::rim").translation, [0.0, -1.0, 0.0]));
    let Geometry::Mesh { uri, .. } = &link(&model, "left::rim").visuals[0].geometry else { panic!() };
    assert_eq!(uri, "model://wheel/meshes/rim.stl");
    // Without the file, the joints to it are left out too.
    let without = translated(&text);
    find(&without.report, "\"left::rim\" belongs to an include that is not there");
    assert_eq!(without.models.len(), 1);
}

#[test]
fn a_model_that_includes_itself_is_refused() {
    let text = "<sdf version='1.7'><model name='m'><include><uri>model://m</uri></include></model></sdf>";
    let files = Files::default().with("model://m/model.sdf", text);
    let refused = translate(text.as_bytes(), &files, &LoadLimits::default()).unwrap_err().message;
    assert!(refused.contains("deeper than 20"), "{refused}");
}

#[test]
fn surfaces_shapes_and_colours_are_the_files() {
    let text = sdf(&format!(
        "<link name='a'>{INERTIAL}<collision name='c'><pose>0 0 1 0 0 0</pose><geometry><capsule><radius>0.1</radius><length>0.5</length>\
         </capsule></geometry><surface><friction><ode><mu>0.7</mu></ode></friction><bounce><restitution_coefficient>0.4\
         </restitution_coefficient></bounce></surface></collision><visual name='v'><geometry><ellipsoid><radii>1 2 3</radii>\
         </ellipsoid></geometry><material><diffuse>1 0 0 1</diffuse></material></visual><sensor name='s' type='camera'/></link>"
    ));
    let (model, report) = robot(&text);
    let a = link(&model, "a");
    assert_eq!(a.collisions[0].geometry, Geometry::Capsule { radius: 0.1, length: 0.5 });
    assert_eq!(
        (a.collisions[0].material.friction, a.collisions[0].material.restitution),
        (Some(0.7), Some(0.4))
    );
    assert_eq!(a.visuals[0].color, Some([1.0, 0.0, 0.0, 1.0]));
    assert_eq!(a.visuals[0].geometry, Geometry::Capsule { radius: 1.5, length: 3.0 });
    let said = "simd has no ellipsoids: a capsule along its longest axis is used instead; \
                the largest distance between the two is 0.6522 m";
    assert_eq!(warnings(&report), [(Some(3), said)]);
}

#[test]
fn a_joint_of_two_axes_is_two_joints_and_a_ball_one() {
    let two = sdf(&format!(
        "<link name='a'>{INERTIAL}</link><link name='b'>{INERTIAL}</link><joint name='j' type='universal'><parent>a</parent>\
         <child>b</child><axis><xyz>1 0 0</xyz></axis><axis2><xyz>0 1 0</xyz></axis2></joint>"
    ));
    let (model, _) = robot(&two);
    assert!(
        near(joint(&model, "j").axis, [1.0, 0.0, 0.0])
            && near(joint(&model, "j_axis2").axis, [0.0, 1.0, 0.0])
    );
    assert_eq!(model.joints.len(), 2);
    let ball = two.replace("universal", "ball");
    assert!(translated(&ball).models[0].urdf.contains("type=\"spherical\""));
}

#[test]
fn meaningless_elements_are_refused_with_their_line() {
    let of = |content: &str| refusal(&sdf(content));
    assert!(of("").contains("no model"));
    assert!(of("<link/>").starts_with("model \"m\" link (line 3): it has no name"), "{}", of("<link/>"));
    let joined = |joint: &str| of(&format!("<link name='a'/><link name='b'/>\n{joint}"));
    assert!(
        joined("<joint name='j' type='fixed'><parent>a</parent><child>x</child></joint>")
            .contains("(line 4): its child \"x\"")
    );
    assert!(
        joined("<joint name='j' type='screw'><parent>a</parent><child>b</child></joint>")
            .contains("no joint of type \"screw\"")
    );
    assert!(joined("<joint name='j' type='fixed'><parent>a</parent></joint>").contains("it has no child"));
    let circle = "<frame name='f'><pose relative_to='g'/></frame><frame name='g'><pose relative_to='f'/></frame><link name='a'><pose relative_to='f'/></link>";
    assert!(of(circle).contains("relative to itself"), "{}", of(circle));
    assert!(of("<link name='a'><pose>1 2 x 0 0 0</pose></link>").contains("not a number"));
    assert!(refusal("<sdf version='1.6'><model").contains("the XML is broken"));
}

#[test]
fn a_joint_that_closes_a_loop_becomes_a_constraint() {
    let text = sdf(&format!(
        "<link name='a'>{INERTIAL}</link><link name='b'><pose>1 0 0 0 0 0</pose>{INERTIAL}</link>\n\
         <link name='c'><pose>0 1 0 0 0 0</pose>{INERTIAL}</link>\n\
         <joint name='j' type='revolute'><parent>a</parent><child>b</child><axis><xyz>0 0 1</xyz></axis></joint>\n\
         <joint name='k' type='revolute'><parent>a</parent><child>c</child><axis><xyz>0 0 1</xyz></axis></joint>\n\
         <joint name='l' type='revolute'><pose>0 0.5 0 0 0 0</pose><parent>b</parent><child>c</child>\
         <axis><xyz>0 0 1</xyz></axis></joint>\n\
         <joint name='m' type='universal'><parent>b</parent><child>c</child><axis><xyz>0 0 1</xyz></axis>\
         <axis2><xyz>0 1 0</xyz></axis2></joint>"
    ));
    let (model, report) = robot(&text);
    assert_eq!(model.joints.len(), 2);
    let [constraint] = &model.setup.constraints[..] else { panic!("{:?}", model.setup.constraints) };
    assert_eq!(constraint.kind, LinkConstraintKind::Hinge(glamx::DVec3::Z));
    let places = constraint.ends.each_ref().map(|end| end.pose.unwrap().translation);
    assert!(near(places[0], [-1.0, 1.5, 0.0]) && near(places[1], [0.0, 0.5, 0.0]), "{places:?}");
    let [(line, message)] = warnings(&report)[..] else { panic!("{:?}", warnings(&report)) };
    assert_eq!(line, Some(8));
    assert!(message.contains("\"m\" closes a loop, and has two axes"), "{message}");
}

#[test]
fn a_tensor_in_a_turned_frame_is_turned_into_the_links() {
    let text = sdf(
        "<link name='a'><inertial><pose degrees='true'>0.1 0 0 0 0 90</pose><mass>1</mass><inertia><ixx>1</ixx><iyy>2</iyy>\
        <izz>2.5</izz></inertia></inertial></link>",
    );
    let (model, _) = robot(&text);
    let inertial = link(&model, "a").inertial;
    assert!(
        (inertial.inertia.x_axis.x - 2.0).abs() < 1e-12 && (inertial.inertia.y_axis.y - 1.0).abs() < 1e-12
    );
    assert_eq!(inertial.center_of_mass, DVec3::new(0.1, 0.0, 0.0));
}

#[test]
fn models_of_a_world_stand_relative_to_its_frames_and_other_models() {
    let model = |name: &str, pose: &str| {
        format!("<model name='{name}'>{pose}<link name='l'><pose>0 0 1 0 0 0</pose>{INERTIAL}</link></model>")
    };
    let world = |first: &str| {
        let models = model("a", first)
            + &model("b", "<pose>0 5 0 0 0 0</pose>")
            + &model("c", "<pose relative_to='b::l'>2 0 0 0 0 0</pose>");
        format!(
            "<sdf version='1.9'><world name='w'><frame name='table'><pose>0 0 3 0 0 0</pose></frame>\
             <frame name='plate' attached_to='table'><pose>0 1 0 0 0 0</pose></frame>{models}</world></sdf>"
        )
    };
    let text = world("<pose relative_to='plate'>1 0 0 0 0 0</pose>");
    let translation = translated(&text);
    let at = |index: usize| translation.models[index].pose.translation;
    assert!(near(at(0), [1.0, 1.0, 4.0]) && near(at(2), [2.0, 5.0, 2.0]), "{:?} {:?}", at(0), at(2));
    for frame in ["chair", "a"] {
        let refused = refusal(&world(&format!("<pose relative_to='{frame}'/>")));
        assert!(refused.contains(frame), "{refused}");
    }
}

#[test]
fn an_included_file_with_a_light_alone_does_no_harm_and_one_without_a_model_is_a_warning() {
    let text = "<sdf version='1.6'><world name='w'><include><uri>model://sun</uri></include>\
                <include>\n<uri>model://other</uri></include><model name='m'><link name='l'/></model></world></sdf>";
    let files = Files::default()
        .with("model://sun/model.sdf", "<sdf version='1.5'><light type='directional' name='sun'/></sdf>")
        .with("model://other/model.sdf", "<sdf version='1.5'><world name='w'><physics/></world></sdf>");
    let translation = translated_with(text, &files);
    assert_eq!(translation.models.len(), 1);
    let said = warnings(&translation.report);
    assert_eq!(said, [(Some(1), "the file holds no model: left out")]);
    assert!(translation.missing.is_some(), "a strict load refuses it");
}

#[test]
fn joints_to_an_include_that_is_not_there_are_left_out_with_it() {
    let text = "<sdf version='1.6'><model name='drone'><include><uri>model://iris</uri></include>\
                <include><uri>model://frame.sdf</uri><name>f</name></include><link name='camera'/><link name='mount'/>\n\
                <joint name='j' type='fixed'><parent>iris::base_link</parent><child>camera</child></joint>\
                <joint name='k' type='fixed'><parent>f::base</parent><child>camera</child></joint>\
                <joint name='m' type='fixed'><parent>mount</parent><child>camera</child></joint></model></sdf>";
    let translation = translated(text);
    let said = warnings(&translation.report);
    for end in ["iris::base_link", "f::base"] {
        let words = format!("{end:?} belongs to an include that is not there: left out");
        assert!(said.iter().any(|(line, message)| *line == Some(2) && *message == words), "{said:#?}");
    }
    assert!(translation.models.iter().any(|model| model.urdf.contains("name=\"m\"")));
    let wrong = text.replace("iris::base_link", "wing::base");
    assert!(refusal(&wrong).contains("is not a link or frame of the model"));
}
