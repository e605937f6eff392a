//! Meshes with their numbers in an MJCF.

use super::*;

/// Four vertices of 1 m^3, and one inside.
const POINTS: &str = "0 0 0  2 0 0  0 3 0  0 0 1  0.2 0.3 0.1";

fn with_mesh(attributes: &str) -> String {
    format!(
        "<mujoco model='m'><asset>\n<mesh name='m' {attributes}/></asset><worldbody>\
         <body name='a'><freejoint/><geom type='mesh' mesh='m' density='100'/></body></worldbody></mujoco>"
    )
}

#[test]
fn corners_alone_are_their_convex_hull_as_in_mujoco() {
    let (model, report) = robot(&with_mesh(&format!("vertex='{POINTS}'")));
    assert_eq!(warnings(&report), []);
    let inertial = &link(&model, "a").inertial;
    // Values of MuJoCo 4.0.0.
    assert!((inertial.mass - 100.0).abs() < 1e-9, "{}", inertial.mass);
    assert!((inertial.center_of_mass - glamx::DVec3::new(0.5, 0.75, 0.25)).length() < 1e-12, "{inertial:?}");
    let inertia = inertial.inertia;
    let trace = inertia.x_axis.x + inertia.y_axis.y + inertia.z_axis.z;
    assert!((trace - 105.0).abs() < 1e-9, "{trace}");
}

#[test]
fn corners_and_faces_weigh_what_they_weigh_in_mujoco() {
    let corners =
        "0 0 0 3 0 0 3 0 2 2 0 2 2 0 1 1 0 1 1 0 2 0 0 2 0 1 0 3 1 0 3 1 2 2 1 2 2 1 1 1 1 1 1 1 2 0 1 2";
    let faces = "0 9 1 0 8 9 1 10 2 1 9 10 2 11 3 2 10 11 3 12 4 3 11 12 4 13 5 4 12 13 5 14 6 5 13 14 6 15 7 6 14 15 7 8 0 7 15 8 \
                 0 1 4 8 12 9 0 4 5 8 13 12 1 2 3 9 11 10 1 3 4 9 12 11 0 5 6 8 14 13 0 6 7 8 15 14";
    let (model, report) = robot(&with_mesh(&format!("vertex='{corners}' face='{faces}'")));
    assert_eq!(warnings(&report), []);
    let inertial = &link(&model, "a").inertial;
    // A U of MuJoCo's legacy kind.
    assert!((inertial.mass - 566.666_666_666_666_7).abs() < 1e-9, "{}", inertial.mass);
    assert!((inertial.center_of_mass.z - 0.954_545_454_545_454_1).abs() < 1e-12, "{inertial:?}");
}

#[test]
fn two_meshes_of_names_that_make_one_file_name_stay_two() {
    let text = "<mujoco model='m'><asset><mesh name='a b' vertex='0 0 0 1 0 0 0 1 0 0 0 1'/>\
                <mesh name='a_b' vertex='0 0 0 2 0 0 0 2 0 0 0 2'/></asset><worldbody><body name='a'><freejoint/>\
                <geom type='mesh' mesh='a b'/><geom type='mesh' mesh='a_b'/></body></worldbody></mujoco>";
    let files = translated(text).meshes;
    assert_eq!(files.len(), 2, "{:?}", files.keys());
    let (model, _) = robot(text);
    // A sixth of a cubic metre and eight of them, at 1,000 kg each.
    assert!((link(&model, "a").inertial.mass - 1500.0).abs() < 1e-9);
}

#[test]
fn flat_corners_are_left_out_with_a_warning() {
    let text = "<mujoco model='m'><asset>\n<mesh name='m' vertex='0 0 0 1 0 0 0 1 0 1 1 0'/></asset><worldbody>\
                <body name='a'><freejoint/><geom size='1'/><geom type='mesh' mesh='m'/></body></worldbody></mujoco>";
    let (model, report) = robot(text);
    assert!(warnings(&report)[0].1.contains("no convex hull that has a volume"), "{:?}", warnings(&report));
    assert_eq!(link(&model, "a").collisions.len(), 1);
}

#[test]
fn numbers_that_make_no_mesh_are_refused_with_the_line() {
    let square = "vertex='0 0 0 1 0 0 0 1 0 0 0 1'";
    for (attributes, message) in [
        ("vertex='0 0 0 1 0 0 0 1 0'".to_owned(), "(line 2): vertex has 3 corners; a mesh has at least 4"),
        ("vertex='0 0 0 1 0 0 0 1 0 0 0'".to_owned(), "vertex has 11 numbers, which are not rows of 3"),
        (format!("{square} face='0 1 4'"), "face names 4, and there are 4, counted from 0"),
        (format!("{square} face='0 1 -1'"), "face names -1"),
        (format!("{square} face='0 1 1.5'"), "face names 1.5"),
        (format!("{square} face='0 1'"), "face has 2 numbers"),
        (
            format!("vertex='{}'", "1 2 3 ".repeat(3_001)),
            "it has 3001 corners and no face; the limit is 3000",
        ),
    ] {
        let refused = refusal(&with_mesh(&attributes));
        assert!(refused.contains(message), "{refused}");
    }
}

#[test]
fn a_picture_that_does_not_fit_the_faces_is_left_out() {
    let mesh = "vertex='0 0 0 1 0 0 0 1 0 0 0 1' face='0 2 1 0 1 3 0 3 2 1 2 3' texcoord='0 0'";
    let (model, report) = robot(&with_mesh(mesh));
    assert!(
        warnings(&report)[0].1.contains("texcoord does not have as many rows"),
        "{:?}",
        warnings(&report)
    );
    assert!((link(&model, "a").inertial.mass - 100.0 / 6.0).abs() < 1e-9);
}

/// Hulls of vertices on circles cost the square of their number: a few lines could ask for hours.
#[test]
fn hulls_of_many_meshes_are_refused_and_one_for_many_geoms_is_computed_once() {
    let ring = |count: usize| -> String {
        let corner = |i: usize| {
            let angle = std::f64::consts::TAU * i as f64 / count as f64;
            format!("{:.9} {:.9} 0 ", angle.cos(), angle.sin())
        };
        (0..count).map(corner).collect::<String>() + "0 0 1"
    };
    let ring = ring(1_500);
    let meshes: String = (0..15).map(|i| format!("<mesh name='m{i}' vertex='{ring}'/>")).collect();
    let text = |assets: &str, geoms: &str| {
        format!(
            "<mujoco><asset>{assets}</asset><worldbody><body><freejoint/>{geoms}</body></worldbody></mujoco>"
        )
    };
    let refused = refusal(&text(&meshes, "<geom type='mesh' mesh='m0'/>"));
    assert!(refused.contains("too large to compute masses and hulls of"), "{refused}");
    let many = "<geom type='mesh' mesh='m' mass='1'/>".repeat(1_000);
    let (model, _) = robot(&text(&format!("<mesh name='m' inertia='convex' vertex='{ring}'/>"), &many));
    assert!((model.links[0].inertial.mass - 1_000.0).abs() < 1e-9);
}

#[test]
fn a_hull_for_an_inertia_is_that_of_the_farthest_of_many_corners() {
    use std::fmt::Write as _;
    // Two circles of 10,000 vertices: took a minute and 14 GB.
    let count = 10_000;
    let mut mesh = String::new();
    for i in 0..count {
        let angle = std::f64::consts::TAU * f64::from(i) / f64::from(count);
        let _ = writeln!(mesh, "v {x:.9} {y:.9} 0\nv {x:.9} {y:.9} 1", x = angle.cos(), y = angle.sin());
    }
    let text = "<mujoco><asset><mesh file='c.obj' inertia='convex'/></asset><worldbody><body name='a'><freejoint/>\
                <geom type='mesh' mesh='c' density='1'/></body></worldbody></mujoco>";
    // Vertices without triangles are left out.
    let fan: String = (1..count).map(|i| format!("f 1 {} {}\n", 2 * i + 1, 2 * i + 2)).collect();
    let (model, report) = robot_with(text, &Files::default().with("c.obj", mesh + &fan));
    let said = warnings(&report).into_iter().find(|(_, said)| said.contains("farthest in 1000 directions"));
    let error = said.and_then(|(_, said)| said.split("lie at most ").nth(1)?.strip_suffix(" m outside"));
    let error = error.and_then(|error| error.parse::<f64>().ok());
    // 0.5 mm between vertices of a circle of 1 m that are a hundredth of it apart; some are farther.
    assert!(error.is_some_and(|error| error > 0.0 && error < 1e-2), "{report:?}");
    let mass = link(&model, "a").inertial.mass;
    assert!((mass / std::f64::consts::PI - 1.0).abs() < 2e-2, "{mass}");
}
