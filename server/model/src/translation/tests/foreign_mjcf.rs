//! MJCF in the wild: results of MuJoCo compared with simd's.

use super::*;

#[test]
fn a_ratio_of_damping_is_of_the_inertia_that_the_joint_moves() {
    // MuJoCo 4.0.0 computes these: 2 r sqrt(kp M), with 1 / M on the diagonal of the inverse, behind the gear.
    let text = "<mujoco><worldbody><body name='a'><joint name='j1' axis='0 1 0' armature='0.02'/>\
        <geom size='.05' mass='1' pos='0 0 -.2'/><body name='b' pos='0.1 0 -.4'>\
        <joint name='j2' axis='0 1 1' armature='0.01' pos='0 0.1 0'/><geom size='.05' mass='1' pos='0 0.1 -.2'/></body></body>\
        <body name='f' pos='1 0 0'><freejoint/><geom size='.1' mass='2'/><body name='g' pos='.2 0 0'>\
        <joint name='j3' type='slide' axis='1 0 0'/><geom size='.1' mass='3'/></body></body></worldbody>\
        <actuator><position joint='j1' kp='100' dampratio='0.7' gear='3'/><position joint='j2' kp='10' dampratio='1'/>\
        <general joint='j3' biastype='affine' gainprm='10' biasprm='0 -10 1'/></actuator></mujoco>";
    let translation = translated(text);
    let damping = |robot: &str, name: &str| {
        let urdf = translation.model(robot).unwrap().urdf.as_bytes();
        let (model, _) = read(urdf, &Files::default(), &ReadOptions::default()).unwrap();
        let joint = model.joints.iter().position(|joint| joint.name == name).unwrap();
        model.setup.joints.iter().find(|setup| setup.joint == joint).unwrap().damping.unwrap()
    };
    for (robot, name, expected) in [
        ("a", "j1", 2.065256195759225 * 9.0),
        ("a", "j2", 0.7497839194900928),
        // The free base also moves: 1 / (1 / 3 + 1 / 2) kg.
        ("f", "j3", 2.0 * (10.0_f64 * 1.2).sqrt()),
    ] {
        // Equal up to rounding.
        let found = damping(robot, name);
        assert!((found - expected).abs() < 1e-9, "{name}: {found} instead of {expected}");
    }
}

#[test]
fn properties_of_a_follower_belong_to_the_shared_motion() {
    let text = "<mujoco><worldbody><body name='palm'><geom size='.01' mass='1'/>\
        <body name='l'><joint name='l' type='slide' axis='0 1 0' armature='0.1' stiffness='5' springref='1'/><geom size='.01' mass='0.05'/></body>\
        <body name='r'><joint name='r' type='slide' axis='0 -1 0' armature='0.2' stiffness='20' springref='0.3' damping='1'/>\
        <geom size='.01' mass='0.05'/></body></body></worldbody>\
        <equality><joint joint1='r' joint2='l' polycoef='0.1 2 0 0 0'/></equality><actuator><motor joint='l'/><motor joint='r'/></actuator></mujoco>";
    let (model, report) = robot(text);
    let of = |name: &str| {
        let joint = model.joints.iter().position(|joint| joint.name == name).unwrap();
        model.setup.joints.iter().find(|setup| setup.joint == joint)
    };
    let leader = of("l").unwrap();
    // m^2 times the follower's: 0.1 + 4 0.2, and 5 + 4 20.
    assert!((leader.armature - 0.9).abs() < 1e-12);
    let spring = leader.spring.unwrap();
    assert!((spring.stiffness - 85.0).abs() < 1e-12);
    // Efforts of both springs at 0: 5 1 + 2 20 (0.3 - 0.1).
    assert!((spring.rest - 13.0 / 85.0).abs() < 1e-12);
    assert!(of("r").is_none_or(|setup| setup.armature == 0.0 && setup.spring.is_none()));
    assert!(
        find(&report, "through its follower \"r\", 2 times")
            .message
            .starts_with("joint \"l\": driven by effort")
    );
}

#[test]
fn primitives_are_fitted_to_meshes_as_mujoco_fits_them() {
    const CORNERS: &str = "-1 -1.5 -2 1 -1.5 -2 1 1.5 -2 -1 1.5 -2 -1 -1.5 2 1 -1.5 2 1 1.5 2 -1 1.5 2";
    const EXTENT: &str = "<compiler fitaabb='true'/>";
    // MuJoCo 4.0.0: sizes of the inertia's box, and of the extent.
    for (settings, kind, mass) in [
        ("", "sphere", 14137.166941154077),
        ("", "capsule", 21680.26180211708),
        ("", "cylinder", 19634.95408493622),
        ("", "ellipsoid", 12566.370614359179),
        ("", "box", 24000.0),
        (EXTENT, "sphere", 33510.32163829113),
        (EXTENT, "capsule", 21205.750411731104),
        (EXTENT, "cylinder", 28274.33388230814),
        (EXTENT, "ellipsoid", 12566.370614359172),
        (EXTENT, "box", 24000.0),
    ] {
        let text = format!(
            "<mujoco>{settings}<asset><mesh name='m' vertex='{CORNERS}'/></asset><worldbody><body name='b'>\
             <freejoint/><geom type='{kind}' mesh='m' pos='0 0 1'/></body></worldbody></mujoco>"
        );
        let (model, _) = robot(&text);
        let body = link(&model, "b");
        assert!((body.inertial.mass - mass).abs() < 1e-6 * mass, "{kind}: {}", body.inertial.mass);
        assert!(near(body.inertial.center_of_mass, [0.0, 0.0, 1.0]));
        assert_eq!(body.collisions.len(), 1);
    }
    let (_, report) = robot(
        "<mujoco><worldbody><body><geom size='1'/><geom type='box' mesh='none'/></body></worldbody></mujoco>",
    );
    assert!(find(&report, "fitted to the mesh \"none\"").severity == Severity::Warning);
}

#[test]
fn files_are_included_from_the_main_files_folder_else_from_that_of_the_file_that_includes() {
    let body = |name: &str| {
        format!(
            "<mujoco><worldbody><body name='{name}'><freejoint/><geom size='.1'/></body></worldbody></mujoco>"
        )
    };
    let arm = "<mujoco><include file='grip/grip.xml'/><asset><mesh name='m' file='m.obj'/></asset><worldbody><body name='arm'>\
        <freejoint/><geom type='mesh' mesh='m'/></body></worldbody></mujoco>";
    let main = "<mujoco><include file='arm/arm.xml'/></mujoco>";
    let names = |files: &Files| -> Vec<String> {
        translated_with(main, files).models.iter().map(|model| model.name.clone()).collect()
    };
    let nested = Files::default().with("arm/arm.xml", arm).with("arm/grip/grip.xml", body("grip"));
    assert_eq!(names(&nested), ["grip", "arm"]);
    let both = nested.with("grip/grip.xml", body("of_main"));
    assert_eq!(names(&both), ["of_main", "arm"]);
    let with_mesh =
        both.with("arm/m.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n");
    let translation = translated_with(main, &with_mesh);
    assert!(translation.model("arm").unwrap().urdf.contains("filename=\"arm/m.obj\""));
    let described = crate::describe_with(
        main.as_bytes(),
        &Files::default().with("arm/arm.xml", arm).with("arm/grip/grip.xml", body("g")),
        &LoadLimits::default(),
    );
    let uris = described.unwrap().asset_uris;
    assert!(["m.obj", "arm/m.obj"].iter().all(|uri| uris.iter().any(|known| known == uri)), "{uris:?}");
}

#[test]
fn colours_that_cannot_be_read_refuse_no_model() {
    let text = "<mujoco><asset><material name='m' rgba='1 x'/></asset><worldbody><body><geom size='1' rgba='0.1 0.1'/>\
        <geom size='1' material='m'/></body></worldbody></mujoco>";
    let (_, report) = robot(text);
    let said = report.findings.iter().filter(|finding| finding.message.contains("since it is only visual"));
    assert_eq!(said.count(), 2);
}

#[test]
fn comments_with_dashes_are_read() {
    let (_, report) = robot(
        "<mujoco><!-- ----- base ----- --><worldbody><body name='l'><geom size='.1'/></body></worldbody></mujoco>",
    );
    assert_eq!(find(&report, "two dashes").line, Some(1));
}

/// Elements and attributes of MuJoCo's XML reference that simd does not use, and that a file may have without
/// effect.
const WITHOUT_USE: &[(&str, &str)] = &[
    ("joint", "solreflimit solimplimit solreffriction solimpfriction actuatorgravcomp user"),
    ("geom", "priority solmix solref solimp margin gap fluidshape fluidcoef user"),
    ("site", "type group material size rgba user"),
    ("motor", "lengthrange actlimited actrange user"),
    ("position", "timeconst inheritrange ctrlrange"),
    ("general", "dynprm actearly actdim"),
    ("key", "time qvel act ctrl mpos mquat"),
];

#[test]
fn unread_parts_of_a_file_are_named_by_element_and_attribute() {
    let said = |tag: &str| {
        let names = WITHOUT_USE.iter().find(|(of, _)| *of == tag).map_or("", |(_, names)| names);
        names.split_whitespace().map(|name| format!(" {name}='1'")).collect::<String>()
    };
    let text = format!(
        "<mujoco><worldbody><body name='a' made_up='1'><joint name='j'{}/><geom size='1'{}/><site name='tip'{}/><camera name='c'/>\
         <light pos='0 0 1'/></body></worldbody><actuator><motor joint='j'{}/><position joint='j'{}/><general joint='j'{}/></actuator>\
         <keyframe><key name='k' qpos='0'{}/></keyframe><visual><map znear='1'/></visual></mujoco>",
        said("joint"),
        said("geom"),
        said("site"),
        said("motor"),
        said("position"),
        said("general"),
        said("key"),
    );
    let (_, report) = robot(&text);
    let mut missing = Vec::new();
    for (tag, names) in WITHOUT_USE.iter().chain(&[("body", "made_up")]) {
        for name in names.split_whitespace() {
            let is_named = |finding: &Finding| {
                finding.message.contains(&format!("\"{name}\" is not read"))
                    || finding.message.starts_with(&format!("{name} "))
            };
            if !report.findings.iter().any(|finding| finding.element.contains(tag) && is_named(finding)) {
                missing.push(format!("{tag} {name}"));
            }
        }
    }
    assert!(missing.is_empty(), "{missing:?}");
    for element in ["camera \"c\"", "light", "visual"] {
        let is_named =
            |finding: &Finding| finding.element.ends_with(element) && finding.message == "not read by simd";
        assert!(report.findings.iter().any(is_named), "{element}: {:#?}", report.findings);
    }
    // Attributes that are read are not reported.
    assert!(!report.findings.iter().any(|finding| finding.message.contains("\"qpos\"")));
}

/// MuJoCo 4.0.0 computes masses before it discards geoms.
#[test]
fn a_discarded_geom_leaves_its_weight() {
    let text = "<mujoco><compiler discardvisual='true'/><worldbody><body name='b'><freejoint/>\
                <geom type='box' size='1 1 1'/><geom type='box' size='1 1 1' contype='0' conaffinity='0'/></body></worldbody></mujoco>";
    let (model, _) = robot(text);
    let body = link(&model, "b");
    assert_eq!((body.inertial.mass, body.visuals.len(), body.collisions.len()), (16000.0, 1, 1));
}

#[test]
fn a_height_field_without_a_name_has_that_of_its_file() {
    let text = "<mujoco><asset><hfield file='dir/hills.png' size='1 2 0.3 0.1'/></asset>\
        <worldbody><geom type='hfield' hfield='hills'/></worldbody></mujoco>";
    let translation = translated(text);
    assert!(translation.models[0].urdf.contains("dir/hills.png"), "{:?}", translation.report);
}
