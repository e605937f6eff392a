//! Wheels that roll without slip keep their speed and their line, and turn a drive by the angle of their
//! speeds.

use fastrand::Rng;
use glamx::{DPose3, DQuat, DVec3};
use simd_core::Simulation;
use simd_core::simulation::command::{Spawn, Target};
use simd_model::robot::Geometry;
use simd_tests::contact_scene::keep_awake;
use simd_tests::robots::from_text;
use simd_tests::scenes::*;
use simd_tests::world::{at, run};

use crate::grounds::{field, ground, mesh};
use crate::holding::set_targets;
use crate::seeds::{held, seeds};

const RADIUS: f64 = 0.1;

/// Flat grounds from x = -2 to 60, 4 m wide.
#[derive(Clone, Copy, Debug)]
enum Ground {
    Plane,
    Box,
    /// Long triangles whose edges cross the wheel's path at random angles.
    Mesh(u64),
    Field,
}

fn lay(world: &mut Simulation, kind: Ground) {
    let spawned = match kind {
        Ground::Plane => robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true),
        Ground::Box => robot("ground", &cuboid(DVec3::new(64.0, 4.0, 0.2), 1.0), at(29.0, 0.0, -0.1), true),
        Ground::Mesh(seed) => {
            let mut rng = Rng::with_seed(seed);
            let rows = 63;
            let mut vertices = Vec::new();
            for row in 0..rows {
                for y in [-2.0, 0.6 * rng.f64() - 0.3, 2.0] {
                    let inner = row > 0 && row + 1 < rows;
                    let x = f64::from(row) - 2.0 + if inner { 0.6 * rng.f64() - 0.3 } else { 0.0 };
                    vertices.push(DVec3::new(x, y, 0.0));
                }
            }
            let quad = |row: u32, column: u32| {
                let q = row * 3 + column;
                [[q, q + 3, q + 4], [q, q + 4, q + 1]]
            };
            let triangles = (0..rows as u32 - 1).flat_map(|row| quad(row, 0).into_iter().chain(quad(row, 1)));
            ground(&mesh(vertices, triangles.collect(), None, DVec3::ONE))
        }
        Ground::Field => ground(&field(65, 128.0, |_, _| 0.0)),
    };
    spawn(world, spawned);
}

/// Rolls a wheel of this width for 10 s at 2 m/s. Returns its lateral deviation, and the lost part of its
/// speed.
fn roll(kind: Ground, width: f64, heading: f64) -> [f64; 2] {
    let mut world = world(1e-3);
    lay(&mut world, kind);
    let cylinder = Geometry::Cylinder { radius: RADIUS, length: width };
    let turn = DQuat::from_rotation_z(heading) * DQuat::from_rotation_x(std::f64::consts::FRAC_PI_2);
    let pose = DPose3::from_parts(DVec3::Z * RADIUS, turn);
    spawn(&mut world, robot("wheel", &solid(&[(DPose3::IDENTITY, cylinder)], 1.0), pose, false));
    keep_awake(&mut world, "wheel");
    let (ahead, aside) =
        (DVec3::new(heading.cos(), heading.sin(), 0.0), DVec3::new(-heading.sin(), heading.cos(), 0.0));
    throw(&mut world, "wheel", ahead * 2.0, aside * (2.0 / RADIUS));
    let root = run(&mut world, 10.0).roots[1].clone();
    [root.pose.translation.dot(aside).abs(), 1.0 - root.linear.dot(ahead) / 2.0]
}

#[test]
fn a_wheel_keeps_its_speed_and_its_line_on_whatever_is_flat() {
    let count = seeds("WHEELS", 3);
    let (mut largest, mut failed) = (0.0f64, Vec::new());
    for seed in 0..count {
        let mut rng = Rng::with_seed(seed);
        let width = 0.02 + 0.1 * rng.f64();
        for kind in [Ground::Plane, Ground::Box, Ground::Mesh(seed), Ground::Field] {
            let heading = if seed == 0 { 0.0 } else { 0.05 * (rng.f64() - 0.5) };
            let [aside, lost] = roll(kind, width, heading);
            // 1 mm in 120 m, and a thousandth of the speed.
            let part = (aside / (1e-3 / 6.0)).max(lost.abs() / 1e-3);
            largest = largest.max(part);
            if part.is_nan() || part > 1.0 {
                println!(
                    "seed {seed}, {kind:?}, {width} m wide: {aside} m aside in 20 m, {lost} of the speed lost"
                );
                failed.push(seed);
            }
        }
    }
    held("wheels keep their speed and their line", count, largest, &failed);
}

/// Returns a base of 4 kg on two wheels 0.2 m apart and a ball without friction.
fn drive(width: f64) -> String {
    let wheel = |name: &str, y: f64| {
        format!(
            r#"<link name="{name}"><inertial><mass value="0.3"/>
            <inertia ixx="4e-4" iyy="4e-4" izz="4e-4" ixy="0" ixz="0" iyz="0"/></inertial>
            <collision><origin rpy="1.5707963267948966 0 0"/><geometry><cylinder radius="0.05" length="{width}"/></geometry>
            </collision></link>
            <joint name="{name}" type="continuous"><parent link="base"/><child link="{name}"/><origin xyz="0 {y} 0"/>
            <axis xyz="0 1 0"/></joint>"#
        )
    };
    format!(
        r#"<robot name="drive"><link name="base"><inertial><origin xyz="0.03 0 0"/><mass value="4"/>
        <inertia ixx="0.02" iyy="0.02" izz="0.03" ixy="0" ixz="0" iyz="0"/></inertial></link>
        {}{}
        <link name="caster"><inertial><mass value="0.05"/><inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/>
        </inertial><collision><geometry><sphere radius="0.02"/></geometry></collision></link>
        <joint name="caster" type="fixed"><parent link="base"/><child link="caster"/><origin xyz="0.12 0 -0.03"/></joint>
        <gazebo reference="caster"><mu1>0</mu1></gazebo></robot>"#,
        wheel("left", 0.1),
        wheel("right", -0.1)
    )
}

/// Wheels that roll without slip turn the base by r (right - left) / track. A line of contact resists turning
/// by `m w N / 4`, which moves the point of rolling by at most `w^2 / 4 track`. That is 0.5 mm of 100 for a
/// width of 20 mm.
#[test]
fn a_differential_drive_turns_as_far_as_its_wheels_say() {
    let mut misses = Vec::new();
    for width in [0.005, 0.02, 0.04] {
        for (left, right) in [(-4.0, 4.0), (2.0, 6.0), (0.0, 5.0)] {
            let mut world = world(1e-3);
            spawn(&mut world, robot("ground", &plane(DVec3::Z), DPose3::IDENTITY, true));
            let base = robot("drive", &from_text(&drive(width)), at(0.0, 0.0, 0.05), false);
            spawn(&mut world, Spawn { passive: false, ..base });
            run(&mut world, 0.2);
            set_targets(
                &mut world,
                "drive",
                &[("left", Target::velocity(left)), ("right", Target::velocity(right))],
            );
            run(&mut world, 1.0);
            // The mean rate of the next four seconds, by the angle turned in each step.
            let (mut turned, mut before) = (0.0, look(&world).roots[1].pose.rotation);
            for _ in 0..400 {
                let now = run(&mut world, 0.01).roots[1].pose.rotation;
                turned += (now * before.inverse()).to_scaled_axis().z;
                before = now;
            }
            let ideal = 0.05 * (right - left) / 0.2;
            let miss = turned / 4.0 / ideal - 1.0;
            println!("{width} m wide, {left} and {right} rad/s: {miss:+.4} of the turn");
            if miss.is_nan() || miss.abs() >= 0.02 {
                misses.push((width, left, right, miss));
            }
        }
    }
    assert!(misses.is_empty(), "{misses:?}");
}
