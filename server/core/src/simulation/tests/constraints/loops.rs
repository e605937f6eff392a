//! Loops within one robot.

use super::*;

const CRANK: f64 = 0.1;
const COUPLER: f64 = 0.3;
const ROCKER: f64 = 0.25;
const GROUND: f64 = 0.3;

/// Returns a four-bar linkage as a tree: a crank with the coupler on it, and a rocker; axes along y.
fn four_bar() -> Arc<RobotModel> {
    Arc::new(RobotModel {
        name: "four_bar".into(),
        links: vec![
            link("base", Inertial::ZERO),
            bar("crank", 0.5, CRANK),
            bar("coupler", 1.0, COUPLER),
            bar("rocker", 0.8, ROCKER),
        ],
        joints: vec![
            hinge_at("crank_joint", (0, 1), DVec3::ZERO, DVec3::Y),
            hinge_at("coupler_joint", (1, 2), DVec3::X * CRANK, DVec3::Y),
            hinge_at("rocker_joint", (0, 3), DVec3::X * GROUND, DVec3::Y),
        ],
        ..RobotModel::default()
    })
}

/// Returns the joint positions that close the loop for a position of the crank: links point along (cos, 0,
/// -sin).
fn closed(crank: f64) -> [f64; 3] {
    let at = |angle: f64| DVec3::new(angle.cos(), 0.0, -angle.sin());
    let (from, to) = (CRANK * at(crank), DVec3::X * GROUND);
    let across = to - from;
    let distance = across.length();
    let way = (-across.z).atan2(across.x);
    let inner =
        ((COUPLER * COUPLER + distance * distance - ROCKER * ROCKER) / (2.0 * COUPLER * distance)).acos();
    let coupler = way - inner;
    let end = from + COUPLER * at(coupler);
    let rocker = (-(end - to).z).atan2((end - to).x);
    [crank, coupler - crank, rocker]
}

fn loop_world(integrator: Integrator, kind: RequestedConstraint) -> Simulation {
    let mut world = world_of(integrator, GRAVITY);
    let [a, b, c] = closed(0.3);
    let joint_positions = [("crank_joint", a), ("coupler_joint", b), ("rocker_joint", c)];
    let joint_positions = joint_positions.map(|(name, q)| (name.into(), q)).to_vec();
    let spawn = Spawn { passive: true, joint_positions, ..spawn("four_bar", four_bar()) };
    world.apply(&Command::Spawn(Box::new(spawn))).unwrap();
    let ends = (end("four_bar", "coupler", DVec3::X * COUPLER), end("four_bar", "rocker", DVec3::X * ROCKER));
    create(&mut world, constraint(kind, ends.0, ends.1));
    world
}

fn drive(world: &mut Simulation, target: Target) {
    let target = JointTarget { joint: "crank_joint".into(), axis: 0, target };
    let robots =
        vec![RobotTargets { robot: "four_bar".into(), joints: vec![target], ..RobotTargets::default() }];
    world.apply(&Command::SetTargets(SetTargets { robots, ..SetTargets::default() })).unwrap();
}

/// Returns the distance of the two ends.
fn gap(state: &PublishedState) -> f64 {
    let poses = state.link_poses(0).unwrap();
    poses[2].transform_point(DVec3::X * COUPLER).distance(poses[3].transform_point(DVec3::X * ROCKER))
}

#[test]
fn a_driven_four_bar_stays_closed() {
    let hinge = RequestedConstraint::Hinge { axis: DVec3::Y };
    for integrator in [Integrator::Leapfrog, Integrator::Euler] {
        for kind in [RequestedConstraint::PointToPoint, hinge] {
            let mut world = loop_world(integrator, kind);
            drive(&mut world, Target::velocity(2.0));
            let (mut largest, mut steady) = (0.0f64, 0.0f64);
            let mut state = PublishedState::default();
            for step in 0..60_000 {
                world.step();
                world.observe(&mut state);
                largest = largest.max(gap(&state));
                if step > 1_000 {
                    steady = steady.max(gap(&state));
                }
            }
            assert!(steady < 1e-7, "{integrator:?} {kind:?}: {steady:e}");
            assert!(largest < 1e-6, "{integrator:?} {kind:?}: {largest:e}");
        }
    }
}

/// By virtual work, the effort that holds the crank is the sum of the weights times the change of their
/// heights. The change is a central difference over the closed loop.
#[test]
fn a_four_bar_at_rest_carries_its_weight() {
    for integrator in [Integrator::Leapfrog, Integrator::Euler] {
        let mut world = loop_world(integrator, RequestedConstraint::PointToPoint);
        drive(&mut world, Target::position(0.3));
        let state = run(&mut world, 4.0);
        let q = state.positions[0];
        let height = |q: f64| {
            let [crank, coupler, rocker] = closed(q);
            let down = |angle: f64| -angle.sin();
            let coupler = crank + coupler;
            0.5 * 0.5 * CRANK * down(crank)
                + (CRANK * down(crank) + 0.5 * COUPLER * down(coupler))
                + 0.8 * 0.5 * ROCKER * down(rocker)
        };
        let wanted = GRAVITY * (height(q + 1e-5) - height(q - 1e-5)) / 2e-5;
        // Torque of the rocker about its own axis.
        let poses = state.link_poses(0).unwrap();
        let (from, to) = (poses[3].translation, poses[3].transform_point(DVec3::X * ROCKER));
        let reading = state_of(&state, "constraint_1");
        let weight = (0.5 * (to - from)).cross(DVec3::Z * (-0.8 * GRAVITY)).y;
        let moment = (to - from).cross(reading.force).y;
        assert!((state.efforts[0] - wanted).abs() < 1e-6 * wanted.abs(), "{}", state.efforts[0]);
        assert!((moment + weight).abs() < 1e-6 * weight.abs(), "{moment} {weight}");
        assert!(gap(&state) < 1e-8, "{:e}", gap(&state));
    }
}
