//! What is refused, and in which words.

use super::*;

fn said(request: RolloutRequest) -> String {
    Rollout::new(world().to_saved(), request, ROOM).unwrap_err().to_string()
}

#[test]
fn what_is_not_there_is_named() {
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
        "there is no robot \"leg\" in this world; robots are \"arm\", \"floor\", \"ball\""
    );
    assert_eq!(
        said(unknown("arm", "knee")),
        "robot \"arm\" has no joint \"knee\"; its joints are \"shoulder\", \"elbow\""
    );
    let quantities = vec![Quantity::LinkPoses(Named { robot: "arm".into(), names: vec!["foot".into()] })];
    assert!(said(RolloutRequest { quantities, ..all_of_it(1, 1) }).contains("no link \"foot\""));
}

#[test]
fn numbers_that_cannot_be_are_named_by_their_fields() {
    let driven = |values: Vec<f64>| RolloutRequest {
        controls: vec![control(ControlMode::Position, values, 1, 1)],
        ..all_of_it(4, 5)
    };
    assert_eq!(
        said(driven(vec![0.0; 6])),
        "controls[0].values is 6 numbers; it must have 2 (one row a knot) or 8 (one row a knot for each copy)"
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
    let copies = MOST_COPIES + 1;
    assert_eq!(
        said(all_of_it(copies, 1)),
        format!("the number of copies would be {copies}, and the limit is {MOST_COPIES}")
    );
    let steps = MOST_STEPS + 1;
    assert!(said(all_of_it(1, steps)).contains("the number of steps would be 1000001"));
    let much = said(all_of_it(MOST_COPIES, MOST_STEPS));
    assert!(much.starts_with("the bytes of the rollout's answer would be "), "{much}");
    let quantities = vec![Quantity::ContactCount("arm".into()); 257];
    assert!(said(RolloutRequest { quantities, ..all_of_it(1, 1) }).contains("the number of quantities"));
}
