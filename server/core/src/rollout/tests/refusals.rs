//! Refused requests, and their messages.

use super::*;

fn said(request: RolloutRequest) -> String {
    Rollout::new(world().to_saved(), request, ROOM).unwrap_err().to_string()
}

#[test]
fn unknown_names_are_refused_with_their_field() {
    let unknown = |robot: &str, joint: &str| RolloutRequest {
        controls: vec![Control {
            robot: robot.into(),
            joints: vec![joint.into()],
            ..control(ControlMode::Position, vec![0.0], 1, 1)
        }],
        ..all_of_it(1, 1)
    };
    assert_eq!(
        said(unknown("leg", "knee")),
        "controls[0].robot: there is no robot \"leg\" in this world; robots are \"arm\", \"floor\", \"ball\""
    );
    assert_eq!(
        said(unknown("arm", "knee")),
        "controls[0].joints[0]: robot \"arm\" has no joint \"knee\"; its joints are \"shoulder\", \"elbow\""
    );
    let names = |robot: &str, names: &[&str]| Named {
        robot: robot.into(),
        names: names.iter().map(|&name| name.into()).collect(),
    };
    let read = |quantity| RolloutRequest { quantities: vec![quantity], ..all_of_it(1, 1) };
    let varied = |of| {
        let values = Values::Uniform { low: 1.0, high: 1.0 };
        RolloutRequest { variations: vec![Variation { of, values }], ..all_of_it(1, 1) }
    };
    let wrench = Varied::Wrench { robot: "arm".into(), link: "hook".into(), at: 0, steps: 1 };
    let started =
        Start { robot: "arm".into(), joints: vec!["elbow".into(), "knee".into()], ..Start::default() };
    let feedback = Feedback { joints: vec!["knee".into()], ..Feedback::default() };
    let fed = Control { feedback: Some(feedback), ..control(ControlMode::Position, vec![0.0; 2], 1, 1) };
    for (request, beginning) in [
        (
            read(Quantity::LinkPoses(names("arm", &["hand", "foot"]))),
            "quantities[0].names[1]: robot \"arm\" has",
        ),
        (read(Quantity::JointEfforts(names("arm", &["knee"]))), "quantities[0].names[0]: robot \"arm\" has"),
        (read(Quantity::RootPose("leg".into())), "quantities[0].robot: there is no robot \"leg\""),
        (varied(Varied::LinkMasses(names("leg", &[]))), "variations[0].robot: there is no robot"),
        (
            varied(Varied::Gains(names("arm", &["elbow", "knee"]))),
            "variations[0].names[1]: robot \"arm\" has",
        ),
        (varied(wrench), "variations[0].names[0]: robot \"arm\" has no link \"hook\""),
        (
            RolloutRequest { starts: vec![started], ..all_of_it(1, 1) },
            "starts[0].joints[1]: robot \"arm\" has no joint \"knee\"",
        ),
        (
            RolloutRequest { controls: vec![fed], ..all_of_it(1, 1) },
            "controls[0].feedback.joints[0]: robot \"arm\" has no joint \"knee\"",
        ),
    ] {
        let said = said(request);
        assert!(said.starts_with(beginning), "{beginning}: {said}");
    }
}

#[test]
fn unknown_names_in_a_term_of_the_cost_are_refused_with_their_field() {
    let efforts = Cost::JointEfforts(named("arm"));
    let on = |link: &str| Cost::LinkPosition {
        robot: "arm".into(),
        link: link.into(),
        point: DVec3::ZERO,
        target: DVec3::ZERO,
    };
    let near = |link: &str, other_robot: &str, other_link: &str| Cost::Nearness {
        robot: "arm".into(),
        link: link.into(),
        other_robot: other_robot.into(),
        other_link: other_link.into(),
        distance: 0.1,
    };
    let links = vec!["hand".into(), "hook".into()];
    let joints = Named { robot: "arm".into(), names: vec!["knee".into()] };
    for (of, beginning) in [
        (Cost::JointEfforts(joints), "costs[1].joints[0]: robot \"arm\" has no joint \"knee\""),
        (Cost::JointEfforts(named("leg")), "costs[1].robot: there is no robot \"leg\""),
        (on("hook"), "costs[1].link: robot \"arm\" has no link \"hook\""),
        (
            Cost::ContactForce(Named { robot: "arm".into(), names: links }),
            "costs[1].links[1]: robot \"arm\" has",
        ),
        (near("hook", "", ""), "costs[1].link: robot \"arm\" has no link \"hook\""),
        (near("hand", "post", ""), "costs[1].other_robot: there is no robot \"post\""),
        (near("hand", "ball", "hook"), "costs[1].other_link: robot \"ball\" has no link \"hook\""),
    ] {
        let term = |of| CostTerm { weight: 1.0, final_weight: 0.0, of };
        let costs = vec![term(efforts.clone()), term(of)];
        let said = said(RolloutRequest { costs, ..all_of_it(1, 1) });
        assert!(said.starts_with(beginning), "{beginning}: {said}");
    }
}

#[test]
fn numbers_that_cannot_be_are_named_by_their_fields() {
    let driven = |values: Vec<f64>| RolloutRequest {
        controls: vec![control(ControlMode::Position, values, 1, 1)],
        ..all_of_it(4, 5)
    };
    assert_eq!(
        said(driven(vec![0.0; 6])),
        "controls[0].values has 6 numbers, and needs 2 (one row a knot) or 8 (one row a knot for each copy)"
    );
    let short = Cost::JointVelocities { joints: named("arm"), targets: vec![0.5] };
    let costs = vec![CostTerm { weight: 1.0, final_weight: 0.0, of: short }];
    assert_eq!(
        said(RolloutRequest { costs, ..all_of_it(1, 1) }),
        "costs[0].targets has 1 number, and needs 0 (zero for all) or 2 (one a joint)"
    );
    assert!(said(driven(vec![0.0, f64::INFINITY])).starts_with("controls[0].values[1] is inf"));
    let varied = |values| RolloutRequest {
        variations: vec![Variation { of: Varied::LinkMasses(named("arm")), values }],
        ..all_of_it(2, 5)
    };
    let negative = said(varied(Values::Uniform { low: -1.0, high: 1.0 }));
    assert_eq!(negative, "variations[0].uniform.low is -1; a factor must be at least 0.01");
    let start = Start { robot: "ball".into(), roots: vec![0.0; 7], ..Start::default() };
    let turned = said(RolloutRequest { starts: vec![start], ..all_of_it(1, 1) });
    assert!(turned.contains("quaternion of unit length"), "{turned}");
    let fixed = Start { robot: "arm".into(), root_twists: vec![0.0; 6], ..Start::default() };
    let fixed = said(RolloutRequest { starts: vec![fixed], ..all_of_it(1, 1) });
    assert_eq!(fixed, "starts[0].root_twists is given; the base of robot \"arm\" is fixed");
    let weighed = |weight, final_weight| {
        let costs = vec![CostTerm { weight, final_weight, of: Cost::JointEfforts(named("arm")) }];
        said(RolloutRequest { costs, ..all_of_it(1, 1) })
    };
    let large = "it must be a number between -1e12 and 1e12";
    assert_eq!(weighed(1e308, 0.0), format!("costs[0].weight is 1e308; {large}"));
    assert_eq!(weighed(0.0, -2e12), format!("costs[0].final_weight is -2000000000000; {large}"));
    assert_eq!(weighed(f64::NAN, 0.0), format!("costs[0].weight is NaN; {large}"));
    assert_eq!(said(all_of_it(0, 1)), "copies is 0; it must be at least 1");
    assert_eq!(said(all_of_it(1, 0)), "steps is 0; it must be at least 1");
}

#[test]
fn too_much_is_refused_before_memory_is_taken_for_it() {
    let copies = MAX_COPIES + 1;
    assert_eq!(
        said(all_of_it(copies, 1)),
        format!("the number of copies would be {copies}, and the limit is {MAX_COPIES}")
    );
    let steps = MAX_STEPS + 1;
    assert!(said(all_of_it(1, steps)).contains("the number of steps would be 1000001"));
    let much = said(all_of_it(MAX_COPIES, MAX_STEPS));
    assert!(much.starts_with("the bytes of the rollout's answer would be "), "{much}");
    let quantities = vec![Quantity::ContactCount("arm".into()); 257];
    assert!(said(RolloutRequest { quantities, ..all_of_it(1, 1) }).contains("the number of quantities"));
}
