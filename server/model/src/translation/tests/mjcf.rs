//! MJCF.

use super::*;
use crate::robot::{Geometry, Inertial, JointKind};
use crate::setup::{ConstraintOn, DriveMode, LinkConstraintKind};

fn mjcf(sections: &str, bodies: &str) -> String {
    format!("<mujoco model='m'>\n{sections}\n<worldbody>\n{bodies}\n</worldbody></mujoco>")
}

#[test]
fn degrees_are_the_default_and_classes_give_what_elements_leave_out() {
    let text = mjcf(
        "<default><joint damping='1'/><geom density='500'/><default class='arm'><joint damping='2' armature='0.3'/></default></default>",
        "<body name='a' childclass='arm' euler='90 0 0'><joint name='j' axis='0 0 2' range='-90 180'/>\
         <joint name='k' type='slide' class='main' axis='1 0 0' range='-0.5 0.5'/><geom type='box' size='0.1 0.2 0.3'/></body>",
    )
    .replace("<default><joint", "<default class='main'><joint");
    let (model, report) = robot(&text);
    assert_eq!(warnings(&report), []);
    let j = joint(&model, "j");
    assert!((j.limits.upper.unwrap() - std::f64::consts::PI).abs() < 1e-12 && j.kind == JointKind::Revolute);
    assert_eq!((j.damping, joint(&model, "k").damping), (2.0, 1.0));
    assert_eq!(model.setup.joints[0].armature, 0.3);
    assert_eq!(joint(&model, "k").limits.upper, Some(0.5));
    // 0.2 * 0.4 * 0.6 m^3 of 500 kg/m^3.
    assert!((link(&model, "a").inertial.mass - 24.0).abs() < 1e-9);
    assert!(near(root_from_link(&model, "a").rotation * glamx::DVec3::Y, [0.0, 0.0, 1.0]));
    assert_eq!(model.links[0].name, "world");
}

#[test]
fn several_joints_of_a_body_are_a_chain_of_links_without_mass_about_their_anchors() {
    let text = mjcf(
        "<compiler angle='radian'/>",
        "<body name='a' pos='1 0 0'><joint name='x' axis='1 0 0' pos='0 0 0.5'/><joint name='y' axis='0 1 0' pos='0 0 0.5'/>\
         <geom type='sphere' size='0.1'/></body>",
    );
    let (model, report) = robot(&text);
    assert_eq!(warnings(&report), []);
    assert!(near(joint(&model, "x").parent_from_joint.translation, [1.0, 0.0, 0.5]));
    assert!(near(joint(&model, "y").parent_from_joint.translation, [0.0, 0.0, 0.0]));
    assert!(near(root_from_link(&model, "a").translation, [1.0, 0.0, 0.0]));
    let masses: Vec<f64> = model.links.iter().map(|link| link.inertial.mass).collect();
    assert_eq!(masses.iter().filter(|mass| **mass > 0.0).count(), 1, "{masses:?}");
}

#[test]
fn free_bodies_and_static_ones_are_separate_robots() {
    let text = mjcf(
        "",
        "<geom name='floor' type='plane' size='5 5 1'/><body name='table' pos='0 0 1'><geom type='box' size='1 1 0.1'/></body>\
         <body name='ball' pos='0 0 2'><freejoint/><geom size='0.1'/></body>\
         <body name='arm' pos='3 0 0'><geom size='0.1'/><body name='fore' pos='0 0 1'><joint name='j'/><geom size='0.1'/></body></body>",
    );
    let translation = translated(&text);
    let models: Vec<(&str, bool, f64)> = translation
        .models
        .iter()
        .map(|model| (model.name.as_str(), model.fixed, model.pose.translation.x + model.pose.translation.z))
        .collect();
    assert_eq!(models, [("ball", false, 2.0), ("arm", true, 3.0), ("m_ground", true, 0.0)]);
    let ground = &translation.models[2];
    let (ground, _) = read(ground.urdf.as_bytes(), &Files::default(), &ReadOptions::default()).unwrap();
    assert_eq!(ground.links.iter().map(|link| link.name.as_str()).collect::<Vec<_>>(), ["world", "table"]);
    assert!(matches!(ground.links[0].collisions[0].geometry, Geometry::Plane { .. }));
}

#[test]
fn a_reference_is_where_the_joint_starts_and_the_file_puts_the_body() {
    let text = mjcf(
        "<compiler angle='radian'/>",
        "<body name='a'><joint name='j' type='slide' axis='0 0 1' ref='1.25'/><geom size='1'/></body>",
    );
    let (model, _) = robot(&text);
    assert!(near(joint(&model, "j").parent_from_joint.translation, [0.0, 0.0, -1.25]));
    assert_eq!(model.setup.joints[0].position, Some(1.25));
}

#[test]
fn actuators_are_modes_gains_and_limits() {
    let text = mjcf(
        "<default><position kp='100'/></default><actuator><position joint='p' kv='5' forcerange='-20 30'/><velocity joint='v' kv='3'/>\
         <motor joint='t' gear='10' ctrlrange='-2 2'/><general joint='g' gainprm='50' biastype='affine' biasprm='0 -50 -4'/>\
         <muscle joint='n'/><motor tendon='x'/></actuator>",
        "<body name='a'><joint name='p'/><geom size='1'/><body name='b'><joint name='v'/><geom size='1'/><body name='c'><joint name='t'/>\
         <geom size='1'/><body name='d'><joint name='g'/><geom size='1'/><body name='e'><joint name='n'/><geom size='1'/></body></body></body></body></body>",
    );
    let (model, report) = robot(&text);
    let of = |name: &str| {
        let index = model.joints.iter().position(|joint| joint.name == name).unwrap();
        let setup = model.setup.joints.iter().find(|setup| setup.joint == index).copied().unwrap();
        (setup.mode, setup.stiffness, setup.damping, model.joints[index].limits.effort)
    };
    assert_eq!(of("p"), (None, Some(100.0), Some(5.0), Some(30.0)));
    assert_eq!(of("v"), (Some(DriveMode::Velocity), None, Some(3.0), None));
    assert_eq!(of("t"), (Some(DriveMode::Effort), None, None, Some(20.0)));
    assert_eq!(of("g"), (None, Some(50.0), Some(4.0), None));
    assert_eq!(of("n").0, Some(DriveMode::Passive), "what has no actuator is not driven");
    let said = warnings(&report);
    assert!(
        said.iter().any(|(line, message)| *line == Some(2) && message.contains("no actuator muscle")),
        "{said:?}"
    );
    assert!(said.iter().any(|(_, message)| message.contains("there is no fixed tendon \"x\"")), "{said:?}");
}

#[test]
fn keyframes_are_named_states_and_equal_joints_follow_one_another() {
    let text = mjcf(
        "<compiler angle='radian'/><equality><joint joint1='b' joint2='a' polycoef='0.1 -2 0 0 0'/><weld body1='one'/></equality>\
         <keyframe><key name='home' qpos='0.5 0.7'/><key qpos='1'/></keyframe>",
        "<body name='one'><joint name='a'/><geom size='1'/><body name='two'><joint name='b'/><geom size='1'/></body></body>",
    );
    let (model, report) = robot(&text);
    let mimic = joint(&model, "b").mimic.unwrap();
    assert_eq!((mimic.multiplier, mimic.offset), (-2.0, 0.1));
    assert_eq!(model.setup.states.len(), 1);
    let state = &model.setup.states[0];
    assert_eq!(state.name, "home");
    let a = model.joints.iter().position(|joint| joint.name == "a").unwrap();
    assert_eq!(state.positions, [(a, 0.5)], "a joint that follows has no position of its own");
    let said = warnings(&report);
    assert!(
        said.iter().any(|(_, message)| message.contains("qpos has 1 numbers, but the joints have 2")),
        "{said:?}"
    );
    let [weld] = &model.setup.constraints[..] else { panic!("{:?}", model.setup.constraints) };
    assert_eq!((weld.kind, &weld.ends[1].on), (LinkConstraintKind::Weld, &ConstraintOn::World));
}

#[test]
fn bits_and_excludes_say_what_touches() {
    let text = mjcf(
        "<contact><exclude body1='a' body2='c'/></contact>",
        "<body name='a'><freejoint/><geom size='1' contype='1' conaffinity='0'/><body name='b'><joint/><geom size='1' contype='0' conaffinity='0'/>\
         <body name='c'><joint/><geom size='1' contype='4' conaffinity='2'/></body></body></body>",
    );
    let (model, _) = robot(&text);
    let bits: Vec<(usize, u32, u32)> =
        model.setup.groups.iter().map(|groups| (groups.link, groups.group, groups.mask)).collect();
    assert_eq!(bits, [(0, 1, 0), (2, 4, 2)]);
    assert_eq!(link(&model, "b").collisions.len(), 0, "what touches nothing is only seen");
    assert_eq!(link(&model, "b").visuals.len(), 1);
    assert!(model.setup.self_collision);
    assert_eq!(model.setup.pairs[0].links, [0, 2]);
}

#[test]
fn a_body_that_never_sleeps_stays_awake() {
    let of = |attribute: &str| {
        let body = format!("<body name='a' {attribute}><freejoint/><geom size='1'/></body>");
        robot(&mjcf("", &body)).0.setup.stays_awake
    };
    assert!(of("sleep='never'"));
    assert!(!of("sleep='allowed'") && !of("sleep='init'") && !of(""));
}

#[test]
fn meshes_weigh_what_they_enclose_and_stand_where_their_reference_puts_them() {
    let cube = "v 0 0 0\nv 2 0 0\nv 2 2 0\nv 0 2 0\nv 0 0 2\nv 2 0 2\nv 2 2 2\nv 0 2 2\nf 4 3 2 1\nf 5 6 7 8\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n";
    let text = mjcf(
        "<compiler meshdir='assets'/><asset><mesh file='cube.obj' scale='0.5 0.5 0.5' refpos='1 1 1'/></asset>",
        "<body name='a'><freejoint/><geom type='mesh' mesh='cube' density='100'/></body>",
    );
    let files = Files::default().with("assets/cube.obj", cube);
    let (model, report) = robot_with(&text, &files);
    assert_eq!(warnings(&report), []);
    let a = link(&model, "a");
    assert!((a.inertial.mass - 100.0).abs() < 1e-9, "{}", a.inertial.mass);
    assert!(near(a.collisions[0].link_from_shape.translation, [-0.5, -0.5, -0.5]));
    assert!(a.inertial.center_of_mass.length() < 1e-9, "{:?}", a.inertial.center_of_mass);
}

#[test]
fn meshes_weigh_what_they_weigh_in_mujoco_of_every_kind() {
    // A U of 5 m^3, 1 m deep.
    let u = "v 0 0 0\nv 3 0 0\nv 3 0 2\nv 2 0 2\nv 2 0 1\nv 1 0 1\nv 1 0 2\nv 0 0 2\nv 0 1 0\nv 3 1 0\nv 3 1 2\nv 2 1 2\nv 2 1 1\nv 1 1 1\nv 1 1 2\nv 0 1 2\n\
             f 1 10 2\nf 1 9 10\nf 2 11 3\nf 2 10 11\nf 3 12 4\nf 3 11 12\nf 4 13 5\nf 4 12 13\nf 5 14 6\nf 5 13 14\nf 6 15 7\nf 6 14 15\nf 7 16 8\nf 7 15 16\nf 8 9 1\nf 8 16 9\n\
             f 1 2 5\nf 9 13 10\nf 1 5 6\nf 9 14 13\nf 2 3 4\nf 10 12 11\nf 2 4 5\nf 10 13 12\nf 1 6 7\nf 9 15 14\nf 1 7 8\nf 9 16 15\n";
    // Mass, height of the centre of mass, moments in MuJoCo 4.0.0.
    for (kind, mass, z, moments) in [
        (
            "legacy",
            566.666_666_666_666_7,
            0.954_545_454_545_454_1,
            [223.388_429_752_067_3, 630.055_096_418_736_3, 496.666_666_666_669_4],
        ),
        ("exact", 500.0, 0.9, [203.333_333_333_334_45, 603.333_333_333_336_6, 483.333_333_333_335_93]),
        ("convex", 600.0, 1.0, [250.0, 650.0, 500.0]),
        (
            "shell",
            2200.0,
            0.954_545_454_545_454_7,
            [1_378.787_878_787_886_5, 3_312.121_212_121_230_7, 2_633.333_333_333_347],
        ),
    ] {
        let text = mjcf(
            &format!("<asset><mesh name='u' file='u.obj' inertia='{kind}'/></asset>"),
            "<body name='a'><freejoint/><geom type='mesh' mesh='u' density='100'/></body>",
        );
        let (model, _) = robot_with(&text, &Files::default().with("u.obj", u));
        let Inertial { mass: found, center_of_mass: at, inertia } = link(&model, "a").inertial;
        assert!((found - mass).abs() < 1e-9 * mass, "{kind}: {found}");
        assert!((at - glamx::DVec3::new(1.5, 0.5, z)).length() < 1e-12, "{kind}: {at}");
        let diagonal = glamx::DVec3::new(inertia.x_axis.x, inertia.y_axis.y, inertia.z_axis.z);
        assert!((diagonal - glamx::DVec3::from_array(moments)).length() < 1e-9 * mass, "{kind}: {diagonal}");
    }
}

#[test]
fn shapes_between_two_points_lie_along_the_line() {
    let text =
        mjcf("", "<body name='a'><freejoint/><geom type='capsule' fromto='0 0 0 2 0 0' size='0.1'/></body>");
    let (model, _) = robot(&text);
    let shape = &link(&model, "a").collisions[0];
    assert_eq!(shape.geometry, Geometry::Capsule { radius: 0.1, length: 2.0 });
    assert!(near(shape.link_from_shape.translation, [1.0, 0.0, 0.0]));
    assert!((shape.link_from_shape.rotation * glamx::DVec3::Z).x.abs() > 1.0 - 1e-12);
}

#[test]
fn unread_parts_are_named_by_line() {
    let text = mjcf(
        "<tendon>\n<spatial name='t' stiffness='3'/></tendon>",
        "<body name='a'><freejoint/><geom size='1'/>\n<composite/></body>",
    );
    let (_, report) = robot(&text);
    assert_eq!(
        warnings(&report),
        [
            (Some(6), "not read by simd: left out"),
            (Some(3), "only tendons of joints are read by simd: the robot is without its spring")
        ]
    );
}

#[test]
fn further_properties_of_a_free_joint_are_named() {
    let sections = "<default><joint armature='0.04' damping='0'/></default>";
    let body = |joint: &str| mjcf(sections, &format!("<body name='a'>{joint}<geom size='1'/></body>"));
    let (_, report) = robot(&body("<joint type='free'/>"));
    let message = "the armature of a free joint is not read: left out";
    assert_eq!(warnings(&report), [(Some(4), message)]);
    let (_, report) = robot(&body("<freejoint/>"));
    assert_eq!(warnings(&report), []);
}

#[test]
fn meaningless_elements_are_refused_with_their_line() {
    let of = |bodies: &str| refusal(&mjcf("", bodies));
    assert!(of("").contains("no body"));
    assert!(
        of("<body><joint type='screw'/></body>").contains("(line 4): simd knows no joint of type \"screw\""),
        "{}",
        of("<body><joint type='screw'/></body>")
    );
    assert!(of("<joint/>").contains("the world has no joints"));
    assert!(of("<body pos='1 2'/>").contains("pos has 2 numbers instead of 3"));
    assert!(of("<body name='a'/><body name='a'/>").contains("another body has this name"));
    assert!(of("<body><body><freejoint/></body></body>").contains("a free joint is for a body of the world"));
    assert!(refusal("<mujoco><compiler coordinate='global'/></mujoco>").contains("2.3.3"));
    assert!(refusal("<mujoco><include file='x.xml'/></mujoco>").contains("\"x.xml\" is not found"));
}

#[test]
fn files_that_include_one_another_are_refused() {
    let text = "<mujoco><include file='a.xml'/></mujoco>";
    let files = Files::default().with("a.xml", "<mujoco><include file='a.xml'/></mujoco>");
    let refused = translate(text.as_bytes(), &files, &LoadLimits::default()).unwrap_err().message;
    assert!(refused.contains("included twice"), "{refused}");
}

#[test]
fn bodies_that_are_welded_or_connected_are_held_by_constraints() {
    let text = mjcf(
        "<equality><weld name='w' body1='one' body2='two'/><connect body1='one' anchor='0 0 1'/>\
         <connect site1='s' site2='t'/><weld body1='two' body2='still' relpose='0 0 0.5 1 0 0 0'/>\
         <weld body1='one' body2='gone'/><weld body1='still'/></equality>",
        "<body name='still' pos='0 0 3'><geom size='1'/></body>\
         <body name='one' pos='1 0 0'><freejoint/><geom size='1'/><site name='s' pos='0 1 0'/>\
         <body name='two' pos='0 2 0' euler='0 0 90'><joint name='j'/><geom size='1'/><site name='t' pos='0 1 0'/></body></body>",
    );
    let translation = translated(&text);
    let urdf = &translation.model("m").unwrap().urdf;
    let (model, _) = read(urdf.as_bytes(), &Files::default(), &ReadOptions::default()).unwrap();
    let [weld, connect, sites, to_still] = &model.setup.constraints[..] else {
        panic!("{:#?}", model.setup.constraints)
    };
    let place = |constraint: &crate::setup::LinkConstraint, end: usize| {
        constraint.ends[end].pose.unwrap().translation
    };
    assert_eq!((weld.name.as_str(), weld.kind, weld.collisions), ("w", LinkConstraintKind::Weld, true));
    // The second body has its pose from the file.
    assert!(near(place(weld, 0), [0.0, 2.0, 0.0]) && near(place(weld, 1), [0.0; 3]));
    assert_eq!(connect.kind, LinkConstraintKind::PointToPoint);
    assert_eq!(connect.ends[1].on, ConstraintOn::World);
    // The world's end is in the frame of the root, which is the body itself.
    assert!(near(place(connect, 0), [0.0, 0.0, 1.0]) && near(place(connect, 1), [0.0, 0.0, 1.0]));
    assert!(near(place(sites, 0), [0.0, 1.0, 0.0]) && near(place(sites, 1), [0.0, 1.0, 0.0]));
    // In the world, the fixed body is at z = 3, and the root at x = 1.
    assert!(near(place(to_still, 0), [0.0, 0.0, 0.5]) && near(place(to_still, 1), [-1.0, 0.0, 3.0]));
    let said = warnings(&translation.report);
    assert!(said.iter().any(|(_, message)| message.contains("a body that does not exist")), "{said:?}");
    assert!(said.iter().any(|(_, message)| message.contains("both ends of")), "{said:?}");
}

#[test]
fn joints_of_two_robots_are_geared_and_a_joint_alone_is_kept() {
    let text = mjcf(
        "<compiler angle='radian'/><equality><joint joint1='k' joint2='j' polycoef='0.1 2 0 0 0'/>\
         <joint joint1='j' joint2='i' polycoef='0 1 0 0 0'/><joint joint1='i' joint2='j'/><joint joint1='s' polycoef='0.25'/></equality>",
        "<body name='a'><joint name='i'/><geom size='1'/><body name='b'><joint name='j'/><geom size='1'/></body></body>\
         <body name='c'><joint name='k'/><geom size='1'/><body name='d'><joint name='s' type='slide'/><geom size='1'/></body></body>",
    );
    let translation = translated(&text);
    let model = |name: &str| {
        let urdf = &translation.model(name).unwrap().urdf;
        read(urdf.as_bytes(), &Files::default(), &ReadOptions::default()).unwrap().0
    };
    let (first, second) = (model("a"), model("c"));
    assert_eq!(joint(&first, "j").mimic.map(|mimic| mimic.multiplier), Some(1.0));
    let kinds: Vec<LinkConstraintKind> = first.setup.constraints.iter().map(|of| of.kind).collect();
    let gear = |ratio, offset| LinkConstraintKind::Gear { ratio, offset: Some(offset) };
    assert_eq!(kinds, [gear(2.0, 0.1), gear(1.0, 0.0)], "to the other robot, and round in a circle");
    assert_eq!(
        first.setup.constraints[0].ends[1].on,
        ConstraintOn::Other { robot: "c".into(), name: "k".into() }
    );
    let [kept] = &second.setup.constraints[..] else { panic!("{:?}", second.setup.constraints) };
    assert_eq!(kept.kind, LinkConstraintKind::Weld);
    assert!(near(kept.ends[0].pose.unwrap().translation, [0.0, 0.0, 0.25]));
}

#[test]
fn hostile_equalities_are_bounded_and_refused_in_a_sentence() {
    let bodies = "<body name='a'><freejoint/><geom size='1'/></body><body name='b'><freejoint/><geom size='1'/></body>";
    let many = "<weld body1='a' body2='b'/>".repeat(5_000);
    let translation = translated(&mjcf(&format!("<equality>{many}</equality>"), bodies));
    let count: usize =
        translation.models.iter().map(|model| model.urdf.matches("<constraint ").count()).sum();
    assert_eq!(count, 1024);
    assert!(warnings(&translation.report).iter().any(|(_, said)| said.contains("more than 1024 equalities")));
    for (equality, why) in [
        ("<connect body1='a' body2='b' anchor='nan 0 0'/>", "beyond the range of simd"),
        ("<connect body1='a' body2='b' anchor='1 2'/>", "anchor has 2 numbers"),
        ("<weld body1='a' body2='b' relpose='0 0 inf 1 0 0 0'/>", "beyond the range of simd"),
        ("<weld body1='a' body2='b'", ""),
    ] {
        let said = refusal(&mjcf(&format!("<equality>{equality}</equality>"), bodies));
        assert!(said.contains(why) && said.len() < 500, "{said}");
    }
}

/// Values of MuJoCo 4.0.0 (`jnt_stiffness`, `dof_damping`) for the same file. It has a chain with a slide and
/// a ball joint and a fixed branch, off axes and with an armature. It also has a joint on a free body.
#[test]
fn springs_by_time_constant_and_damping_ratio_are_those_of_mujocos_compiler() {
    let text = mjcf(
        "<compiler angle='radian'/>",
        "<body name='a' pos='0.1 0.2 1' euler='0.3 0.2 0.1'>\
         <joint name='j' axis='1 2 3' pos='0.1 0 0.05' springdamper='0.5 0.7' springref='0.2' armature='0.01' stiffness='3'/>\
         <inertial pos='0.1 0.05 0.2' mass='2' diaginertia='0.02 0.03 0.04'/>\
         <body name='b' pos='0.3 0 0.1' euler='0.5 0 0.4'>\
         <joint name='k' type='slide' axis='0 1 1' springdamper='0.1 1'/>\
         <joint name='l' axis='1 0 0' pos='0 0.1 0' ref='0.4' springdamper='0.2 0.3'/>\
         <inertial pos='0.1 0 0' mass='1.5' diaginertia='0.01 0.02 0.015'/>\
         <body name='c' pos='0 0.2 0'><joint name='m' type='ball' springdamper='0.3 1'/>\
         <inertial pos='0 0.1 0.1' mass='0.5' diaginertia='0.001 0.002 0.0015'/></body></body>\
         <body name='d' pos='0 0 0.4'><inertial pos='0 0 0.1' mass='0.3' diaginertia='0.001 0.001 0.001'/></body></body>\
         <body name='f' pos='3 0 1' euler='0.1 0.2 0.3'><freejoint/>\
         <inertial pos='0.02 0.03 0' mass='1' diaginertia='0.01 0.02 0.015'/>\
         <body name='g' pos='0.2 0 0'><joint name='n' axis='0 1 0' springdamper='0.25 0.5'/>\
         <inertial pos='0 0 -0.2' mass='0.4' diaginertia='0.004 0.003 0.002'/></body></body>",
    );
    let translation = translated(&text);
    let expected = [
        ("a", "j", 1.1597564211744054, 0.5682806463754585, 0.2),
        ("a", "k", 181.4957891088368, 36.299157821767366, 0.0),
        ("a", "l", 5.13615760671409, 0.18490167384170728, 0.0),
        ("a", "m", 0.03847226426843079, 0.023083358561058472, 0.0),
        ("f", "n", 0.6152368814846197, 0.07690461018557747, 0.0),
    ];
    for (name, of, stiffness, damping, rest) in expected {
        let urdf = &translation.model(name).unwrap_or_else(|refused| panic!("{refused}")).urdf;
        let (model, _) = read(urdf.as_bytes(), &Files::default(), &ReadOptions::default()).unwrap();
        let index = model.joints.iter().position(|joint| joint.name == of).unwrap();
        let spring = model.setup.joints.iter().find(|setup| setup.joint == index).unwrap().spring.unwrap();
        let near = |measured: f64, expected: f64| (measured / expected - 1.0).abs() < 1e-12;
        assert!(near(spring.stiffness, stiffness), "{of}: {}, not {stiffness}", spring.stiffness);
        assert!(near(model.joints[index].damping, damping), "{of}: {}", model.joints[index].damping);
        assert_eq!(spring.rest, rest, "{of}");
    }
}

#[test]
fn a_springdamper_of_a_joint_that_moves_no_mass_is_left_out() {
    let text = mjcf(
        "<compiler inertiafromgeom='false'/>",
        "<body name='a'><joint name='j' springdamper='1 1'/><geom size='0.1'/></body>",
    );
    let (model, report) = robot(&text);
    assert!(model.setup.joints.iter().all(|setup| setup.spring.is_none()));
    assert!(report.findings.iter().any(|finding| finding.message.contains("needs a mass that it moves")));
}
