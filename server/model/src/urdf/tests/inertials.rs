//! Mass and inertia: from the file, or from the shapes.

use glamx::{DMat3, DVec3};

use super::*;
use crate::robot::Inertial;

fn inertial(content: &str) -> (Inertial, LoadReport) {
    let (model, report) = robot(&moving_link(content));
    (model.links[1].inertial, report)
}

fn moments(ixx: f64, iyy: f64, izz: f64) -> String {
    format!("<inertia ixx='{ixx}' ixy='0' ixz='0' iyy='{iyy}' iyz='0' izz='{izz}'/>")
}

/// 2 x 4 x 6 m of water about a point 1 m up: 48 t, Ixx = m (16 + 36) / 12.
const BOX: &str = "<collision><origin xyz='0 0 1'/><geometry><box size='2 4 6'/></geometry></collision>";

fn assert_near(found: DMat3, diagonal: [f64; 3], tolerance: f64) {
    let off = (found - DMat3::from_diagonal(DVec3::from_array(diagonal))).to_cols_array();
    assert!(off.iter().all(|part| part.abs() <= tolerance), "{found:?} is not diagonal {diagonal:?}");
}

#[test]
fn inertia_comes_from_the_file_whatever_the_shapes_weigh() {
    let content =
        format!("<inertial><origin xyz='1 2 3'/><mass value='5'/>{}</inertial>{BOX}", moments(1.0, 2.0, 2.5));
    let (found, report) = inertial(&content);
    assert_eq!((found.mass, found.center_of_mass.to_array()), (5.0, [1.0, 2.0, 3.0]));
    assert_eq!(found.inertia, DMat3::from_diagonal(DVec3::new(1.0, 2.0, 2.5)));
    assert_eq!(warnings(&report), [""; 0]);
}

#[test]
fn products_of_inertia_stand_where_they_belong() {
    let inertia = "<inertia ixx='4' ixy='0.1' ixz='0.2' iyy='5' iyz='0.3' izz='6'/>";
    let (found, _) = inertial(&format!("<inertial><mass value='1'/>{inertia}</inertial>"));
    assert_eq!(found.inertia.to_cols_array(), [4.0, 0.1, 0.2, 0.1, 5.0, 0.3, 0.2, 0.3, 6.0]);
}

#[test]
fn a_turned_inertial_frame_turns_the_tensor_into_the_links_axes() {
    // A quarter turn about z exchanges the moments about x and y.
    let content = format!(
        "<inertial><origin rpy='0 0 1.5707963267948966'/><mass value='1'/>{}</inertial>",
        moments(1.0, 2.0, 2.5)
    );
    assert_near(inertial(&content).0.inertia, [2.0, 1.0, 2.5], 1e-15);
}

#[test]
fn rounding_noise_is_not_a_warning() {
    // A flat plate in five digits, and products of 1e-19.
    let inertia =
        "<inertia ixx='0.0012346' ixy='3.1E-19' ixz='-1E-21' iyy='0.0023456' iyz='0' izz='0.0035803'/>";
    let (found, report) = inertial(&format!("<inertial><mass value='1'/>{inertia}</inertial>"));
    assert_eq!(found.inertia.z_axis.z, 0.0035803);
    assert_eq!(warnings(&report), [""; 0]);
}

#[test]
fn a_moment_a_hair_below_zero_is_lifted_to_it_in_silence() {
    let (found, report) =
        inertial(&format!("<inertial><mass value='1'/>{}</inertial>", moments(-1e-7, 0.1, 0.1)));
    assert!(found.inertia.x_axis.x >= 0.0);
    assert_eq!(warnings(&report), [""; 0]);
}

#[test]
fn a_tensor_of_no_body_is_taken_from_the_shapes_with_the_files_mass() {
    for (tensor, why) in [
        (moments(1.0, 1.0, 5.0), "no body has the principal moments"),
        (moments(-1.0, 1.0, 1.0), "a principal moment of its inertia is negative"),
        (
            "<inertia ixx='1' ixy='2' ixz='0' iyy='1' iyz='0' izz='1'/>".to_owned(),
            "a principal moment of its inertia is negative",
        ),
        (moments(0.0, 0.0, 0.0), "no inertia is given"),
        (String::new(), "no inertia is given"),
    ] {
        let content = format!("<inertial><origin xyz='0.5 0 0'/><mass value='12'/>{tensor}</inertial>{BOX}");
        let (found, report) = inertial(&content);
        assert_eq!((found.mass, found.center_of_mass.to_array()), (12.0, [0.5, 0.0, 0.0]));
        assert_near(found.inertia, [52.0, 40.0, 20.0], 1e-9);
        let finding = find(&report, why);
        assert_eq!((finding.severity, finding.disposition), (Severity::Warning, Disposition::Repaired));
        assert_eq!(finding.element, "link \"arm\" inertial");
    }
}

#[test]
fn a_negative_mass_is_replaced_by_that_of_the_shapes() {
    let content = format!("<inertial><mass value='-1'/>{}</inertial>{BOX}", moments(1.0, 1.0, 1.0));
    let (found, report) = inertial(&content);
    assert!((found.mass - 48_000.0).abs() < 1e-6);
    assert_eq!(found.center_of_mass.to_array(), [0.0, 0.0, 1.0]);
    find(&report, "mass -1 is negative: 48000 kg");
    let (found, report) =
        inertial(&format!("<inertial><mass value='-1'/>{}</inertial>", moments(1.0, 1.0, 1.0)));
    assert_eq!(found, Inertial::ZERO);
    find(&report, "no shape to take one from");
}

#[test]
fn a_mass_that_is_not_finite_is_refused() {
    let urdf = moving_link("<inertial><mass value='NaN'/></inertial>");
    assert_eq!(refusal(&urdf), "link \"arm\" inertial mass (line 2): value=\"NaN\" is not finite");
}

#[test]
fn a_moving_link_without_inertial_weighs_what_its_shapes_do() {
    let (found, report) = inertial(BOX);
    assert!((found.mass - 48_000.0).abs() < 1e-6);
    assert_near(found.inertia, [208_000.0, 160_000.0, 80_000.0], 1e-6);
    assert_eq!(find(&report, "it has no mass").severity, Severity::Warning);
    let visual = "<visual><geometry><sphere radius='0.5'/></geometry></visual>";
    let (found, _) = inertial(visual);
    let mass = 1000.0 * 4.0 / 3.0 * std::f64::consts::PI * 0.125;
    assert!((found.mass - mass).abs() < 1e-9);
    assert_near(found.inertia, [0.4 * mass * 0.25; 3], 1e-9);
}

#[test]
fn shapes_about_the_z_axis_weigh_as_such() {
    use std::f64::consts::PI;
    let (found, _) =
        inertial("<collision><geometry><cylinder radius='0.1' length='2'/></geometry></collision>");
    let mass = 1000.0 * PI * 0.01 * 2.0;
    let across = mass * (3.0 * 0.01 + 4.0) / 12.0;
    assert!((found.mass - mass).abs() < 1e-9);
    assert_near(found.inertia, [across, across, mass * 0.01 / 2.0], 1e-9);
    let (found, _) =
        inertial("<collision><geometry><capsule radius='0.1' length='2'/></geometry></collision>");
    let ball = 1000.0 * 4.0 / 3.0 * PI * 0.001;
    assert!((found.mass - mass - ball).abs() < 1e-9);
    assert!((found.inertia.z_axis.z - (mass * 0.01 / 2.0 + ball * 0.4 * 0.01)).abs() < 1e-9);
}

#[test]
fn a_frame_held_to_a_link_with_mass_stays_without_and_says_so() {
    let urdf = format!(
        "<robot name='r'><link name='base'/><link name='arm'>{BODY}</link><link name='tool'>{BOX}</link>\
         <joint name='j' type='continuous'><parent link='base'/><child link='arm'/><axis xyz='0 0 1'/></joint>\
         <joint name='t' type='fixed'><parent link='arm'/><child link='tool'/></joint></robot>"
    );
    let (model, report) = robot(&urdf);
    assert_eq!(model.links[2].inertial, Inertial::ZERO);
    assert_eq!(warnings(&report), [""; 0]);
    assert_eq!(report.findings.iter().filter(|it| it.message.contains("no inertial")).count(), 2);
}

#[test]
fn a_moving_end_without_any_mass_is_warned_of_but_not_a_massless_link_between() {
    let urdf = |tip: &str| {
        format!(
            "<robot name='r'><link name='base'/><link name='slide'/><link name='tip'>{tip}</link>\
             <joint name='x' type='prismatic'><parent link='base'/><child link='slide'/><axis xyz='1 0 0'/></joint>\
             <joint name='y' type='prismatic'><parent link='slide'/><child link='tip'/><axis xyz='0 1 0'/></joint></robot>"
        )
    };
    assert_eq!(warnings(&robot(&urdf(BODY)).1), [""; 0]);
    let (_, report) = robot(&urdf(""));
    assert_eq!(warnings(&report), ["it hangs on a moving joint, but nothing on it has mass"]);
    assert_eq!(find(&report, "nothing on it has mass").element, "link \"tip\"");
}

#[test]
fn a_root_without_mass_causes_no_warning_and_gets_a_mass_for_a_free_base() {
    let (model, report) = robot(&format!("<robot name='r'><link name='crate'>{BOX}</link></robot>"));
    assert!((model.links[0].inertial.mass - 48_000.0).abs() < 1e-6);
    assert_eq!(warnings(&report), [""; 0]);
}

#[test]
fn inertials_are_finite_for_shapes_of_any_size() {
    for radius in ["1e-320", "1e-100", "1e-18", "1e18"] {
        for mass in ["-1", "0", "1e-300", "1e18"] {
            let shape = format!("<collision><geometry><sphere radius='{radius}'/></geometry></collision>");
            let (found, _) = inertial(&format!("<inertial><mass value='{mass}'/></inertial>{shape}"));
            assert!(found.mass.is_finite() && found.inertia.is_finite(), "{radius} {mass} {found:?}");
        }
    }
}
