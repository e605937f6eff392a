//! Links of one robot with coarse hulls touch each other by their meshes: an L and a C, whose hulls fill their openings.

use std::sync::Arc;

use fastrand::Rng;
use glamx::{DMat3, DPose3, DQuat, DVec3};
use simd_core::collision::{MeshShapes, Shapes};
use simd_core::simulation::command::{ContactSettings, PhysicsChange, Spawn};
use simd_core::{Command, Simulation};
use simd_model::RobotModel;
use simd_model::robot::{
    Collision, Geometry, Inertial, Joint, JointKind, JointLimits, Link, Material, MeshAsset, Sha256,
};
use simd_tests::scenes::{apply, contacts, go_to, look, robot, spawn};

use crate::saved_state_files::through_a_file_with;
use crate::seeds::{held, seeds};

/// Links push each other only below this distance, metres: they are held half of it apart, and a step moves them.
const HELD: f64 = 1e-3;

/// A box by its least and its greatest corner.
type Block = [DVec3; 2];

/// A profile in x and y, `height` thick along z: its corners in order, the triangles of a lid, and its boxes.
struct Profile {
    corners: Vec<[f64; 2]>,
    lid: Vec<[u32; 3]>,
    blocks: Vec<[[f64; 2]; 2]>,
    height: f64,
}

fn l_shape(rng: &mut Rng) -> Profile {
    let [a, b] = [0.08 + 0.08 * rng.f64(), 0.08 + 0.08 * rng.f64()];
    let t = 0.02 + 0.02 * rng.f64();
    Profile {
        corners: vec![[0.0, 0.0], [a, 0.0], [a, t], [t, t], [t, b], [0.0, b]],
        lid: vec![[3, 4, 5], [3, 5, 0], [3, 0, 1], [3, 1, 2]],
        blocks: vec![[[0.0, 0.0], [a, t]], [[0.0, 0.0], [t, b]]],
        height: 0.02 + 0.06 * rng.f64(),
    }
}

fn c_shape(rng: &mut Rng) -> Profile {
    let [a, b] = [0.1 + 0.08 * rng.f64(), 0.14 + 0.08 * rng.f64()];
    let t = 0.02 + 0.02 * rng.f64();
    Profile {
        corners: vec![[0.0, 0.0], [a, 0.0], [a, t], [t, t], [t, b - t], [a, b - t], [a, b], [0.0, b]],
        lid: vec![[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 7], [4, 5, 6], [4, 6, 7]],
        blocks: vec![[[0.0, 0.0], [a, t]], [[0.0, 0.0], [t, b]], [[0.0, b - t], [a, b]]],
        height: 0.02 + 0.06 * rng.f64(),
    }
}

impl Profile {
    fn mesh(&self, number: u8) -> Geometry {
        let count = self.corners.len() as u32;
        let at = |z: f64| self.corners.iter().map(move |[x, y]| DVec3::new(*x, *y, z));
        let vertices: Vec<DVec3> = at(0.0).chain(at(self.height)).collect();
        let mut triangles: Vec<[u32; 3]> = self.lid.iter().map(|[i, j, k]| [*i, *k, *j]).collect();
        triangles.extend(self.lid.iter().map(|lid| lid.map(|i| i + count)));
        for i in 0..count {
            let next = (i + 1) % count;
            triangles.extend([[i, next, next + count], [i, next + count, i + count]]);
        }
        let asset = MeshAsset {
            sha256: Sha256([number; 32]),
            vertices,
            triangles,
            paints: Vec::new(),
            files: Vec::new(),
            grid: None,
        };
        Geometry::Mesh { uri: format!("{number}.stl"), scale: DVec3::ONE, asset: Some(Arc::new(asset)) }
    }

    fn blocks(&self) -> Vec<Block> {
        let block =
            |[[x, y], [u, v]]: &[[f64; 2]; 2]| [DVec3::new(*x, *y, 0.0), DVec3::new(*u, *v, self.height)];
        self.blocks.iter().map(block).collect()
    }
}

const AXES: [DVec3; 3] = [DVec3::X, DVec3::Y, DVec3::Z];

const NAMES: [&str; 6] = ["x", "y", "z", "roll", "pitch", "yaw"];

/// A root of one mesh, and a link of another one on six joints: three that slide, and three that turn.
fn pair(first: Geometry, second: Geometry) -> Arc<RobotModel> {
    let link = |name: &str, geometry: Option<Geometry>| Link {
        name: name.into(),
        inertial: Inertial {
            mass: 1.0,
            center_of_mass: DVec3::ZERO,
            inertia: DMat3::from_diagonal(DVec3::splat(2e-3)),
        },
        visuals: Vec::new(),
        collisions: geometry
            .map(|geometry| Collision {
                link_from_shape: DPose3::IDENTITY,
                geometry,
                material: Material::default(),
            })
            .into_iter()
            .collect(),
    };
    let joint = |i: usize| Joint {
        name: NAMES[i].into(),
        kind: if i < 3 { JointKind::Prismatic } else { JointKind::Continuous },
        parent: i,
        child: i + 1,
        parent_from_joint: DPose3::IDENTITY,
        axis: AXES[i % 3],
        limits: JointLimits { effort: Some(if i < 3 { 50.0 } else { 5.0 }), ..JointLimits::default() },
        damping: 0.0,
        friction: 0.0,
        mimic: None,
    };
    let mut links = vec![link("first", Some(first))];
    links.extend(NAMES[..5].iter().map(|name| link(name, None)));
    links.push(link("second", Some(second)));
    let mut model = RobotModel {
        name: "pair".into(),
        links,
        joints: (0..6).map(joint).collect(),
        ..RobotModel::default()
    };
    model.setup.self_collision = true;
    Arc::new(model)
}

fn load(model: &Arc<RobotModel>, (fixed, shapes): (bool, MeshShapes), positions: [f64; 6]) -> Simulation {
    let mut world = simd_tests::scenes::world(1e-3);
    let weightless = PhysicsChange { gravity: Some(DVec3::ZERO), ..PhysicsChange::default() };
    apply(&mut world, Command::SetPhysics(weightless));
    let joint_positions = NAMES.iter().map(|name| (*name).to_owned()).zip(positions).collect();
    let shapes = Arc::new(Shapes::reusing(model, fixed, shapes, &[]));
    let contact_settings = ContactSettings { self_collision: true, ..ContactSettings::default() };
    let of = robot("pair", model, DPose3::IDENTITY, fixed);
    spawn(&mut world, Spawn { shapes, passive: false, joint_positions, contact_settings, ..of });
    world
}

/// The second mesh in the axes of the first.
fn pose([x, y, z, roll, pitch, yaw]: [f64; 6]) -> DPose3 {
    let turn = DQuat::from_rotation_x(roll) * DQuat::from_rotation_y(pitch) * DQuat::from_rotation_z(yaw);
    DPose3::from_parts(DVec3::new(x, y, z), turn)
}

fn joints(world: &Simulation) -> [f64; 6] {
    let seen = look(world);
    let start = seen.positions.len() - 6;
    std::array::from_fn(|i| seen.positions[start + i])
}

/// How far two boxes are apart: of convex sets alternate projections come to the nearest points (Cheney and Goldstein, 1959).
fn distance([least, most]: Block, [from, to]: Block, pose: &DPose3) -> f64 {
    let mut on_a = 0.5 * (least + most);
    let mut apart = f64::INFINITY;
    for _ in 0..20_000 {
        let on_b = pose.transform_point(pose.inverse_transform_point(on_a).clamp(from, to));
        on_a = on_b.clamp(least, most);
        let now = on_a.distance(on_b);
        if now == 0.0 || apart - now < 1e-9 {
            return now;
        }
        apart = now;
    }
    apart
}

fn apart(first: &Profile, second: &Profile, positions: [f64; 6]) -> f64 {
    let (pose, second) = (pose(positions), second.blocks());
    let blocks = first.blocks();
    let each = blocks.iter().flat_map(|a| second.iter().map(|b| distance(*a, *b, &pose)));
    each.fold(f64::INFINITY, f64::min)
}

fn force(world: &Simulation) -> f64 {
    contacts(world, None).iter().map(|contact| contact.normal_force).sum()
}

fn drive(world: &mut Simulation, positions: [f64; 6]) {
    let targets: Vec<(&str, f64)> = NAMES.into_iter().zip(positions).collect();
    go_to(world, "pair", &targets);
}

/// Random profiles, loaded apart and driven to random poses near each other, where most would overlap. A corner that
/// moves by more than half a millimetre in a step may pass an edge: of 200 pairs one crosses.
#[test]
fn links_push_each_other_where_their_meshes_meet_and_nowhere_else() {
    let count = seeds("MESH_PAIRS", 40);
    let (mut largest, mut failed, mut touched, mut crossed) = (0.0f64, Vec::new(), 0, 0);
    for seed in 0..count {
        let rng = &mut Rng::with_seed(seed);
        let first = if rng.bool() { l_shape(rng) } else { c_shape(rng) };
        let second = if rng.bool() { l_shape(rng) } else { c_shape(rng) };
        let model = pair(first.mesh(1), second.mesh(2));
        let mut number = |by: f64| by * (2.0 * rng.f64() - 1.0);
        let away = [0.5 + number(0.1), number(0.2), number(0.2), number(2.0), number(1.0), number(2.0)];
        let near = [number(0.15), number(0.15), number(0.06), number(2.0), number(1.0), number(2.0)];
        let mut world = load(&model, (seed % 2 == 0, MeshShapes::Mesh), away);
        let (mut holds, mut pushed, mut crosses) = (true, false, false);
        for part in 0..150 {
            // At a speed of up to a metre a second; then it presses.
            let way = (f64::from(part) / 100.0).min(1.0);
            drive(&mut world, std::array::from_fn(|i| away[i] + way * (near[i] - away[i])));
            (0..5).for_each(|_| world.step());
            let (apart, force) = (apart(&first, &second, joints(&world)), force(&world));
            pushed |= force > 0.0;
            if force > 0.0 {
                largest = largest.max(apart / HELD);
            }
            holds &= force == 0.0 || apart < HELD;
            crosses |= apart < 1e-6;
        }
        touched += u64::from(pushed);
        crossed += u64::from(crosses);
        if !holds {
            failed.push(seed);
        }
    }
    held("links push each other only where their meshes meet", count, largest, &failed);
    assert!(touched > count / 3, "{touched} of {count} pairs touched");
    assert!(crossed <= 1 + count / 40, "{crossed} of {count} pairs crossed");
}

/// A bar slides into a C: its hull would stop it at the mouth, its walls do where they are.
#[test]
fn a_bar_goes_into_the_mouth_of_a_c_and_is_stopped_by_its_walls() {
    let corners = [[0.0, 0.0], [0.1, 0.0], [0.1, 0.02], [0.0, 0.02]].to_vec();
    let bar = Profile { corners, lid: vec![[0, 1, 2], [0, 2, 3]], blocks: Vec::new(), height: 0.04 };
    let c = Profile {
        corners: [
            [0.0, 0.0],
            [0.1, 0.0],
            [0.1, 0.02],
            [0.02, 0.02],
            [0.02, 0.08],
            [0.1, 0.08],
            [0.1, 0.1],
            [0.0, 0.1],
        ]
        .to_vec(),
        lid: vec![[0, 1, 2], [0, 2, 3], [0, 3, 4], [0, 4, 7], [4, 5, 6], [4, 6, 7]],
        blocks: Vec::new(),
        height: 0.04,
    };
    let model = pair(c.mesh(1), bar.mesh(2));
    let start = [0.11, 0.04, 0.0, 0.0, 0.0, 0.0];
    // A root that cannot move touches with its triangles: no shell is around them.
    for (fixed, shapes, stop) in
        [(true, MeshShapes::Mesh, 0.02), (false, MeshShapes::Mesh, 0.0205), (false, MeshShapes::Hull, 0.1)]
    {
        let mut world = load(&model, (fixed, shapes), start);
        for part in 0..200 {
            drive(&mut world, [0.11 - 0.1 * (f64::from(part) / 100.0).min(1.0), 0.04, 0.0, 0.0, 0.0, 0.0]);
            (0..5).for_each(|_| world.step());
        }
        let x = joints(&world)[0];
        assert!((x - stop).abs() < 1e-4, "{shapes:?} at {x}");
        assert!(force(&world) > 1.0, "{shapes:?}");
        if shapes == MeshShapes::Hull {
            continue;
        }
        // A saved state continues with the same bits, here and through a file.
        apply(&mut world, Command::SaveState { name: "touching".into() });
        let saved = through_a_file_with(&world, "touching", MeshShapes::Mesh);
        let mut again = simd_tests::scenes::world(1e-3);
        apply(&mut again, Command::ImportSavedState { name: "touching".into(), saved });
        apply(&mut again, Command::RestoreState { name: "touching".into() });
        for world in [&mut world, &mut again] {
            drive(world, [0.03, 0.07, 0.0, 0.0, 0.0, 0.0]);
            (0..500).for_each(|_| world.step());
        }
        assert_eq!(look(&world).positions, look(&again).positions);
        // Its upper face is below the upper wall.
        let y = joints(&world)[1];
        let below = if fixed { 0.06 } else { 0.0595 };
        assert!((y - below).abs() < 1e-4 && force(&world) > 1.0, "{shapes:?} at {y}");
    }
}

/// If a description asks for self-collision, its report names links that touch with a coarse hull. It gives the distance
/// by which the hull exceeds the mesh.
#[test]
fn hulls_that_are_too_coarse_are_named_with_their_links_and_their_distance() {
    let rng = &mut Rng::with_seed(1);
    let model = pair(c_shape(rng).mesh(1), l_shape(rng).mesh(2));
    let of = |model: &RobotModel, shapes| {
        Arc::new(Shapes::reusing(model, false, shapes, &[])).coarse_pairs(model, false)
    };
    let found = of(&model, MeshShapes::Hull);
    assert_eq!(found.iter().map(|pair| pair.links).collect::<Vec<_>>(), [[0, 6]]);
    assert!((0.01..0.1).contains(&found[0].distance), "{found:?}");
    assert_eq!(of(&model, MeshShapes::Mesh), []);
    let mut alone = (*model).clone();
    alone.setup.self_collision = false;
    assert_eq!(of(&alone, MeshShapes::Hull), []);
}
