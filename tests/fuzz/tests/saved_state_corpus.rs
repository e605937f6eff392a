//! The corpus of saved states: its sources, and that it is still accepted.
#![cfg(test)]

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glamx::{DPose3, DQuat, DVec3};
use simd_core::collision::{MeshShapes, Shapes};
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::{
    CollisionFilterChange, CollisionPair, ContactSettings, CreateConstraint, CreateSensor, JointTarget,
    LinkPull, LinkWrench, RequestedConstraint, RequestedEnd, RobotTargets, SetTargets, Spawn, Target,
    WrenchDuration,
};
use simd_core::{Command, PhysicsSettings, PublishedState, Simulation};
use simd_fuzz_targets::saved_states;
use simd_model::robot::Sha256;
use simd_model::sensor::{
    Camera, ChannelNoise, Channels, Noise, Picture, RangeLimits, Scan, SensorKind, Sweep, WrenchAxes,
    WrenchDirection,
};
use simd_model::{Asset, Assets, ReadOptions};
use simd_world::loading::saved_state_file::{Content, RobotSource, open, seal_encoded};

const PLANE: &str = "<robot name='p'><link name='l'><collision><geometry><plane normal='0 0 1'/></geometry>\
    </collision></link></robot>";
const BALL: &str = "<robot name='b'><link name='l'><inertial><mass value='1'/><inertia ixx='.1' ixy='0' ixz='0' \
    iyy='.1' iyz='0' izz='.1'/></inertial><collision><geometry><sphere radius='.1'/></geometry></collision></link>\
    </robot>";
const MESH: &str = "<robot name='m'><link name='l'><inertial><mass value='1'/><inertia ixx='.1' ixy='0' ixz='0' \
    iyy='.1' iyz='0' izz='.1'/></inertial><collision><geometry><mesh filename='a.obj'/></geometry></collision>\
    </link></robot>";
const PYRAMID: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
/// A joint of each kind.
const KINDS: &[(&str, &str)] = &[
    (
        "revolute",
        "<limit lower='-1' upper='1' effort='2' velocity='5'/><dynamics friction='.1' damping='.1'/>",
    ),
    ("continuous", "<mimic joint='j0' multiplier='2'/>"),
    ("prismatic", "<limit lower='-1' upper='1' effort='5' velocity='1'/>"),
    ("planar", ""),
    ("floating", ""),
    ("fixed", ""),
    ("spherical", "<dynamics friction='.1' damping='.1'/>"),
];

fn every_kind() -> String {
    let link = |i: usize| {
        format!(
            "<link name='l{i}'><inertial><mass value='1'/><inertia ixx='.1' ixy='0' ixz='0' iyy='.1' iyz='0' \
             izz='.1'/></inertial><collision><geometry><box size='.2 .2 .2'/></geometry></collision></link>"
        )
    };
    let joint = |(i, (kind, inside)): (usize, &(&str, &str))| {
        format!(
            "<joint name='j{i}' type='{kind}'><origin xyz='.3 0 0'/><parent link='l{i}'/><child link='l{}'/>\
             <axis xyz='0 1 0'/>{inside}</joint>",
            i + 1
        )
    };
    let joints = KINDS.iter().enumerate().map(joint);
    format!("<robot name='k'>{}</robot>", (0..=KINDS.len()).map(link).chain(joints).collect::<String>())
}

/// A world and the sources of its robots.
struct Scene {
    world: Simulation,
    sources: Vec<RobotSource>,
    files: BTreeMap<Sha256, Vec<u8>>,
}

struct Pyramid;

impl Assets for Pyramid {
    fn find(&self, _uri: &str) -> Result<Asset, Vec<String>> {
        Ok(Asset { sha256: Sha256::of(PYRAMID), bytes: Arc::from(PYRAMID) })
    }
}

impl Scene {
    fn new() -> Self {
        let world = Simulation::new(PhysicsSettings::default(), WorldLimits { robots: 20, saved_states: 2 });
        Self { world, sources: Vec::new(), files: BTreeMap::new() }
    }

    fn add(&mut self, name: &str, urdf: &str, z: f64, fixed: bool) {
        let options = ReadOptions { scale: 0.5, ..ReadOptions::default() };
        let (model, _) = simd_model::read(urdf.as_bytes(), &Pyramid, &options).unwrap();
        let description = Sha256::of(urdf.as_bytes());
        self.files.insert(description, urdf.into());
        let mut assets = BTreeMap::new();
        if urdf == MESH {
            assets.insert("a.obj".to_owned(), Sha256::of(PYRAMID));
            self.files.insert(Sha256::of(PYRAMID), PYRAMID.into());
        }
        let mesh_shapes = MeshShapes::Hull;
        self.sources.push(RobotSource {
            description,
            assets,
            scale: options.scale.to_bits(),
            mesh_shapes,
            fixed_base: fixed,
        });
        self.apply(Command::Spawn(Box::new(Spawn {
            name: name.into(),
            allow_renaming: false,
            shapes: Arc::new(Shapes::new(&model)),
            model: Arc::new(model),
            pose: DPose3::from_translation(DVec3::Z * z),
            fixed_base: Some(fixed),
            passive: false,
            joint_positions: Vec::new(),
            joint_orientations: Vec::new(),
            contact_settings: ContactSettings { self_collision: true, ..ContactSettings::default() },
            collision_pairs: Vec::new(),
            free_place: Default::default(),
            loaded_at_start: fixed,
        })));
    }

    fn apply(&mut self, command: Command) {
        self.world.apply(&command).unwrap();
    }

    fn target(&mut self, joint: &str, target: Target) {
        let joints = vec![JointTarget { joint: joint.into(), axis: 0, target }];
        let robots = vec![RobotTargets { robot: "kinds".into(), joints, ..Default::default() }];
        self.apply(Command::SetTargets(SetTargets { robots, ..Default::default() }));
    }

    fn content(mut self, steps: usize) -> Vec<u8> {
        (0..steps).for_each(|_| self.world.step());
        self.apply(Command::SaveState { name: "it".into() });
        let mut seen = PublishedState::default();
        self.world.observe(&mut seen);
        let saved = seen.saved("it").unwrap().saved();
        let files = self.files.into_values().map(Arc::from).collect();
        Content::new("it", saved, self.sources, files).encode()
    }
}

/// Returns all that the corpus has, by name.
fn scenes() -> Vec<(&'static str, Vec<u8>)> {
    let mut rest = Scene::new();
    rest.add("ground", PLANE, 0.0, true);
    rest.add("ball", BALL, 0.05, false);
    let mut meshes = Scene::new();
    meshes.add("ground", PLANE, 0.0, true);
    meshes.add("one", MESH, 0.1, false);
    meshes.add("other", MESH, 0.9, false);
    let mut kinds = Scene::new();
    kinds.add("kinds", &every_kind(), 1.0, true);
    kinds.target("j0", Target::position(0.8));
    kinds.target("j2", Target::velocity(0.2));
    kinds.target("j6", Target::orientation(DQuat::from_rotation_z(2.0)));
    for (link, duration) in [
        ("l5", WrenchDuration::UntilCleared),
        ("l5", WrenchDuration::For(0.5)),
        ("l6", WrenchDuration::NextStep),
    ] {
        kinds.apply(Command::ApplyWrench(LinkWrench {
            robot: "kinds".into(),
            link: link.into(),
            force: DVec3::new(1.0, -0.0, 3.0),
            torque: DVec3::X,
            in_link_axes: true,
            point: DVec3::splat(0.1),
            duration,
        }));
    }
    kinds.apply(Command::PullLink(LinkPull {
        robot: "kinds".into(),
        link: "l6".into(),
        target: Some(DVec3::new(0.5, -0.25, 1.0)),
        ..LinkPull::default()
    }));
    let mut overlapping = Scene::new();
    overlapping.add("kinds", &every_kind(), 0.0, true);
    overlapping.add("second", &every_kind(), 0.01, true);
    overlapping.add("ball", BALL, 0.5, false);
    let pair = |link: &str, other_robot: &str, other_link: &str, enabled| CollisionPair {
        link: link.into(),
        other_robot: other_robot.into(),
        other_link: other_link.into(),
        enabled: Some(enabled),
    };
    overlapping.apply(Command::SetCollisionFilter(CollisionFilterChange {
        robot: "second".into(),
        self_collision: None,
        pairs: vec![
            pair("l1", "", "l3", false),
            pair("l2", "", "l3", true),
            pair("l1", "kinds", "l2", false),
            pair("l5", "ball", "l", true),
        ],
    }));
    let mut constrained = Scene::new();
    constrained.add("kinds", &every_kind(), 1.0, true);
    constrained.add("ball", BALL, 1.5, false);
    let end = |robot: &str, link: &str, joint: &str| RequestedEnd {
        robot: robot.into(),
        link: link.into(),
        joint: joint.into(),
        pose: None,
    };
    for (kind, parent, child) in [
        (RequestedConstraint::Weld, end("kinds", "l4", ""), end("ball", "l", "")),
        (RequestedConstraint::Hinge { axis: DVec3::Y }, end("", "", ""), end("ball", "", "")),
        (
            RequestedConstraint::Gear { ratio: 0.5, offset: None },
            end("kinds", "", "j0"),
            end("kinds", "", "j2"),
        ),
        (
            RequestedConstraint::Distance { length: None, is_rope: true },
            end("kinds", "l6", ""),
            end("ball", "", ""),
        ),
    ] {
        constrained.apply(Command::CreateConstraint(Box::new(CreateConstraint {
            name: String::new(),
            kind,
            parent,
            child,
            max_force: Some(50.0),
            max_torque: None,
            breaks: false,
            disable_collisions: true,
        })));
    }
    let free = |steps| {
        let mut free = Scene::new();
        free.add("ground", PLANE, 0.0, true);
        free.add("kinds", &every_kind(), 0.2, false);
        free.content(steps)
    };
    vec![
        ("empty", Scene::new().content(3)),
        ("asleep", rest.content(2_500)),
        ("meshes", meshes.content(300)),
        ("kinds", kinds.content(60)),
        ("overlapping", overlapping.content(40)),
        ("constrained", constrained.content(60)),
        ("sensing", sensing().content(60)),
        ("spawned", free(0)),
        ("fallen", free(200)),
    ]
}

/// Returns a robot with a sensor of each kind, with all kinds of noise.
fn sensing() -> Scene {
    let mut scene = Scene::new();
    scene.add("kinds", &every_kind(), 1.0, true);
    let range = RangeLimits { least: 0.1, most: 9.0 };
    let horizontal = Sweep { samples: 5, least: -1.0, most: 1.0 };
    let camera = Camera {
        picture: Picture::Depth,
        width: 64,
        height: 48,
        horizontal_field_of_view: 1.0,
        near: 0.1,
        far: 10.0,
    };
    for kind in [
        SensorKind::Imu,
        SensorKind::ForceTorque { axes: WrenchAxes::Parent, direction: WrenchDirection::ParentOnChild },
        SensorKind::Contact { threshold: 1.0 },
        SensorKind::Range(range),
        SensorKind::Lidar(Scan { horizontal, vertical: Sweep::one(0.1), range, rolling: true }),
        SensorKind::LinkState,
        SensorKind::Encoder { backlash: 0.01 },
        SensorKind::Odometry,
        SensorKind::Camera(camera),
    ] {
        let noise = Noise {
            standard_deviation: 0.1,
            bias_mean: 0.2,
            bias_standard_deviation: 0.3,
            random_walk: 0.4,
            correlation_time: Some(0.5),
            quantum: 0.0,
            dropout: 0.1,
        };
        let of =
            |(channels, _): &(Channels, usize)| ChannelNoise { channels: *channels, axis: Some(0), noise };
        let (link, joint) = if kind.is_of_joint() { ("", "j0") } else { ("l5", "") };
        scene.apply(Command::CreateSensor(Box::new(CreateSensor {
            robot: "kinds".into(),
            name: String::new(),
            link: link.into(),
            joint: joint.into(),
            pose: DPose3::from_translation(DVec3::X),
            rate: Some(200.0),
            kind,
            noise: kind.channels().iter().map(of).collect(),
            seed: Some(7),
        })));
    }
    scene
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus/saved_states")
}

/// The corpus is meant for the code after the first checks: each of its files must get there.
#[test]
fn the_corpus_of_saved_states_is_what_daemons_write() {
    for (name, content) in scenes() {
        let kept = fs::read(folder().join(name)).unwrap();
        let [kept, now] = [&kept, &content].map(|bytes| open(&seal_encoded(bytes), 20).unwrap().content);
        // The numbers are those of the machine that wrote it.
        assert_eq!(kept.files, now.files, "{name}");
        let robots = |file: &Content| -> Vec<_> {
            let entities = file.robots.iter().map(|robot| (robot.layout, &robot.state.entity));
            entities.map(|(layout, it)| (it.name.clone(), layout, it.surfaces.clone())).collect()
        };
        assert_eq!(robots(&kept), robots(&now), "{name}: write it again, see `write_the_corpus`");
        assert!(saved_states(&content), "{name} is accepted");
    }
}

/// Run by hand if the format changes.
#[test]
#[ignore = "writes tests/fuzz/corpus/saved_states"]
fn write_the_corpus() {
    for (name, content) in scenes() {
        fs::write(folder().join(name), content).unwrap();
    }
}
