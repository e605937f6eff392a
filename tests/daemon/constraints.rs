//! `simctl constraint`, from a terminal: each of its commands, and their errors.

use serde_json::{Value, json};
use simd_tests::process::{Process, repository};

use crate::{paused, written};

/// Returns a world with two boxes of a kilogram in the air beside the demo's arm.
async fn boxes() -> Process {
    let daemon = paused().await;
    for (name, x) in [("left", 2.0), ("right", 2.5)] {
        written(&daemon, &format!("robot shape box:0.1,0.1,0.1 --name {name} --mass 1 --pose {x},0,1")).await;
    }
    daemon
}

#[tokio::test]
async fn constraints_are_created_listed_changed_and_deleted() {
    let daemon = boxes().await;
    let made = written(&daemon, "constraint create weld world left --parent-pose 2,0,1").await;
    assert_eq!(made, json!({ "created": "constraint_1" }));
    for (create, name) in [
        ("weld left right --name pair", "pair"),
        ("point-to-point left right --name ball", "ball"),
        ("hinge left right --axis 0,0,1 --name door", "door"),
        ("slide left right --axis 1,0,0 --name rail", "rail"),
        ("distance left right --length 0.5 --rope --max-force 20 --name rope", "rope"),
        ("weld bench_arm left --disable-collisions --max-torque 5 --name tool", "tool"),
    ] {
        assert_eq!(
            written(&daemon, &format!("constraint create {create}")).await["created"],
            name,
            "{create}"
        );
    }
    let all = written(&daemon, "constraint list").await;
    let of = |name: &str| all.as_array().unwrap().iter().find(|of| of["name"] == name).unwrap().clone();
    assert_eq!(all.as_array().unwrap().len(), 7);
    assert_eq!((&of("pair")["kind"], &of("pair")["child"]["robot"]), (&json!("weld"), &json!("right")));
    assert_eq!((&of("door")["axis"], &of("pair")["axis"]), (&json!([0.0, 0.0, 1.0]), &Value::Null));
    assert_eq!((&of("rope")["rope"], &of("rope")["length"]), (&json!(true), &json!(0.5)));
    assert_eq!((&of("rope")["max_force"], &of("tool")["max_torque"]), (&json!(20.0), &json!(5.0)));
    assert_eq!(of("tool")["disable_collisions"], json!(true));
    assert_eq!(of("constraint_1")["parent"]["robot"], Value::Null);
    // Those on one robot.
    assert_eq!(written(&daemon, "constraint list right").await.as_array().unwrap().len(), 5);

    for name in ["ball", "door", "rail", "rope", "tool"] {
        assert_eq!(written(&daemon, &format!("constraint delete {name}")).await, json!({ "deleted": name }));
    }
    daemon.client().await.step(500).await.unwrap();
    // The first one carries both, and the second one the right box.
    let held = written(&daemon, "constraint list").await;
    for (index, weight) in [(0, 2.0 * 9.81), (1, 9.81)] {
        let force = held[index]["force"][2].as_f64().unwrap();
        assert!((force - weight).abs() < 1e-4, "{held}");
    }
    let page = daemon.simctl(["constraint", "list"]).await;
    assert!(page.code == 0 && page.out.contains("pair") && page.out.contains("holds"), "{page:?}");

    // Two contradictory ones, neither of which claims to hold.
    for (name, z) in [("low", 3), ("high", 4)] {
        let create = format!(
            "constraint create weld world left --name {name} --parent-pose 2,0,{z} --child-pose 0,0,0"
        );
        assert_eq!(written(&daemon, &create).await["created"], name);
    }
    daemon.client().await.step(500).await.unwrap();
    let page = daemon.simctl(["constraint", "list"]).await.out;
    let of = |name: &str| page.lines().find(|line| line.starts_with(name)).unwrap_or_default();
    assert!(of("low").ends_with("is off") && of("high").ends_with("is off"), "{page}");
    for name in ["low", "high"] {
        assert_eq!(written(&daemon, &format!("constraint delete {name}")).await, json!({ "deleted": name }));
    }
    daemon.client().await.step(500).await.unwrap();

    let changed =
        written(&daemon, "constraint change pair --max-force 5 --max-torque inf --breaks true").await;
    assert_eq!(changed, json!({ "changed": "pair" }));
    daemon.client().await.step(1).await.unwrap();
    // It would need 9.81 N.
    let left = written(&daemon, "constraint list").await;
    assert_eq!(left.as_array().unwrap().len(), 1, "{left}");
}

#[tokio::test]
async fn a_gear_turns_one_arm_by_the_other_and_is_shown() {
    let daemon = paused().await;
    let arm = "'tests/assets/Bench_Arm-1.2 rev B' --name second --fixed --passive --pose 0,2,0";
    written(&daemon, &format!("robot load {arm}")).await;
    let create = "constraint create gear bench_arm/shoulder second/shoulder --ratio -2 --name teeth";
    assert_eq!(written(&daemon, create).await, json!({ "created": "teeth" }));
    let set = daemon.simctl(["joint", "set", "bench_arm", "shoulder=0.2"]).await;
    assert_eq!(set.code, 0, "{}", set.err);
    daemon.client().await.step(3000).await.unwrap();
    let all = written(&daemon, "constraint list").await;
    let gear = &all[0];
    assert_eq!((&gear["kind"], &gear["ratio"]), (&json!("gear"), &json!(-2.0)));
    for (end, robot) in [("parent", "bench_arm"), ("child", "second")] {
        assert_eq!((&gear[end]["robot"], &gear[end]["joint"]), (&json!(robot), &json!("shoulder")));
    }
    let positions = shoulders(&daemon).await;
    assert!(positions[0] > 0.1 && (positions[1] + 2.0 * positions[0]).abs() < 1e-6, "{positions:?}");
    // The gear carries the second arm, about its axis.
    assert!(gear["torque"][1].as_f64().unwrap().abs() > 0.1, "{gear}");
    let page = daemon.simctl(["constraint", "list"]).await.out;
    let row = page.lines().find(|line| line.starts_with("teeth")).unwrap_or_default();
    for cell in [" gear ", " bench_arm/shoulder ", " second/shoulder ", " holds"] {
        assert!(row.contains(cell), "{cell}: {page}");
    }
    let change = "constraint change teeth --ratio 1.5 --offset 0.1";
    assert_eq!(written(&daemon, change).await, json!({ "changed": "teeth" }));
    daemon.client().await.step(3000).await.unwrap();
    let changed = written(&daemon, "constraint list").await[0].clone();
    assert_eq!((&changed["ratio"], &changed["offset"]), (&json!(1.5), &json!(0.1)));
    let [first, second] = shoulders(&daemon).await;
    assert!(first > 0.1 && (second - 1.5 * first - 0.1).abs() < 1e-6, "{first} {second}");
    let said = daemon.simctl(["constraint", "change", "teeth", "--max-torque", "5"]).await;
    assert!(said.code == 2 && said.err.contains("a gear has no use for --max-torque"), "{said:?}");
    assert_eq!(written(&daemon, "constraint delete teeth").await, json!({ "deleted": "teeth" }));
    assert_eq!(written(&daemon, "constraint list").await, json!([]));
}

/// Returns the shoulder positions of both arms.
async fn shoulders(daemon: &Process) -> [f64; 2] {
    let mut positions = [0.0; 2];
    for (position, robot) in positions.iter_mut().zip(["bench_arm", "second"]) {
        let joint = written(daemon, &format!("joint get {robot}")).await["joints"][0].clone();
        *position = joint["position"].as_f64().unwrap();
    }
    positions
}

#[tokio::test]
async fn faults_of_a_constraint_are_one_sentence() {
    let daemon = boxes().await;
    written(&daemon, "constraint create weld left right --name pair").await;
    for (line, sentence) in [
        ("constraint create weld left right --name pair", "pair"),
        ("constraint create weld left moon", "moon"),
        ("constraint create weld left left", "link of CHILD is fixed to the parent"),
        ("constraint create weld left/handle right", "handle"),
        ("constraint create gear left right", "each as ROBOT/JOINT: \"left\" names none"),
        ("constraint create gear bench_arm/shoulder world", "the world has no joints"),
        ("constraint create distance left right --max-torque 1", "a distance has no use for --max-torque"),
        ("constraint create hinge left right --axis 0,0,0", "axis"),
        ("constraint create weld left right --max-force=-1", "--max-force"),
        ("constraint create weld left right --rope", "rope"),
        ("constraint change pair --ratio 2", "only a gear"),
        ("constraint change pair", "give at least one of: --parent-pose, "),
        ("constraint change none --max-force 2", "none"),
        ("constraint delete none", "none"),
        ("constraint list moon", "moon"),
    ] {
        let said = daemon.shell(&format!("simctl {line}"), &repository()).await;
        assert_ne!(said.code, 0, "{line}");
        assert!(said.err.contains(sentence), "{line}: {}", said.err);
    }
    assert_eq!(written(&daemon, "constraint list").await.as_array().unwrap().len(), 1);
}
