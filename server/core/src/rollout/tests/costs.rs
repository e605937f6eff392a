//! Costs compared with results computed by hand from the states.

use glamx::DQuat;

use super::*;

const STEPS: usize = 25;

/// Returns the cost of each term and of each step, and the states.
fn weighed(of: Cost) -> (f64, Vec<f64>, Vec<Vec<f64>>) {
    let costs = vec![CostTerm { weight: 2.0, final_weight: 5.0, of }];
    let values = vec![0.4, -0.6];
    let request = RolloutRequest {
        controls: vec![control(ControlMode::Position, values, 1, 1)],
        costs,
        step_costs: true,
        ..all_of_it(1, STEPS as u64)
    };
    let BatchResult { states, costs, step_costs, .. } = roll(&world(), request).remove(0);
    let rows = states.chunks_exact(states.len() / STEPS).map(<[f64]>::to_vec).collect();
    (costs[0], step_costs, rows)
}

/// Checks that each step has twice the value, and the last one five times in addition.
fn check(of: Cost, value: impl Fn(&[f64]) -> f64) {
    let said = format!("{of:?}");
    let (total, step_costs, rows) = weighed(of);
    for (step, (cost, row)) in step_costs.iter().zip(&rows).enumerate() {
        let weight = if step + 1 == STEPS { 7.0 } else { 2.0 };
        let expected = weight * value(row);
        assert!((cost - expected).abs() <= 1e-12 * expected.abs().max(1.0), "{said}: {cost}, {expected}");
    }
    assert!(total > 0.0 && (total - step_costs.iter().sum::<f64>()).abs() <= 1e-12 * total, "{said}");
}

/// Offset of the links in [`all_of_it`]: two positions, two velocities, two efforts, 13 of the ball, then
/// three links.
const HAND: usize = 6 + 13 + 2 * 7;

#[test]
fn terms_of_joints_are_sums_of_squares() {
    let targets = vec![1.0, -0.5];
    let lack = |row: &[f64]| (row[0] - 1.0).powi(2) + (row[1] + 0.5).powi(2);
    check(Cost::JointPositions { joints: named("arm"), targets: targets.clone(), wrapped: false }, lack);
    let turned = targets.iter().map(|target| target + 3.0 * std::f64::consts::TAU).collect();
    check(Cost::JointPositions { joints: named("arm"), targets: turned, wrapped: true }, lack);
    check(Cost::JointVelocities { joints: named("arm"), targets }, |row| {
        (row[2] - 1.0).powi(2) + (row[3] + 0.5).powi(2)
    });
    let elbow = Named { robot: "arm".into(), names: vec!["elbow".into()] };
    check(Cost::JointEfforts(elbow), |row| row[5].powi(2));
}

#[test]
fn terms_of_links_are_of_a_point_and_of_an_angle() {
    let point = DVec3::new(0.4, 0.0, 0.0);
    let target = DVec3::new(0.3, 0.2, 0.4);
    let pose = |row: &[f64]| {
        let [x, y, z, i, j, k, w] = row[HAND..HAND + 7] else { panic!("it has no pose") };
        DPose3::from_parts(DVec3::new(x, y, z), DQuat::from_xyzw(i, j, k, w))
    };
    let (robot, link) = (String::from("arm"), String::from("hand"));
    check(Cost::LinkPosition { robot: robot.clone(), link: link.clone(), point, target }, |row| {
        pose(row).transform_point(point).distance_squared(target)
    });
    // Both turn only about y, by the sum of the joints' angles.
    let target = DQuat::from_rotation_y(1.2);
    check(Cost::LinkOrientation { robot, link, target }, |row| (row[0] + row[1] - 1.2).powi(2));
}

#[test]
fn forces_of_contacts_are_summed_and_what_is_too_near_costs_the_square_of_what_lacks() {
    check(Cost::ContactForce(named("ball")), |row| row[row.len() - 1]);
    // The hand's ball is 0.4 m from its link's origin and has a radius of 0.05 m.
    let hand_above = |row: &[f64]| {
        let (z, turned) = (row[HAND + 2], row[0] + row[1]);
        z - 0.4 * turned.sin() - 0.05
    };
    let nearness = Cost::Nearness {
        robot: "arm".into(),
        link: "hand".into(),
        other_robot: "floor".into(),
        other_link: String::new(),
        distance: 2.0,
    };
    check(nearness, |row| (2.0 - hand_above(row)).powi(2));
}
