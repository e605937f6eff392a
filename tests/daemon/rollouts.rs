//! `simctl rollout`, from a terminal: copies that differ, their costs, and errors.

use std::path::Path;

use serde_json::Value;
use simd_client::packed;
use simd_client::proto::{
    RolloutControl, RolloutCost, RolloutJointTerm, RolloutLinkTerm, RolloutQuantity, RolloutQuantityKind,
    RolloutRequest, RolloutUniform, RolloutVariation, RolloutVaried, Vector3, rollout_cost::Term,
    rollout_variation::Values,
};
use simd_tests::process::{Home, Process, Said, repository};

use crate::operator::json;
use crate::paused;

const COSTS: &str = r#"[
    {"weight": 0.5, "joint_efforts": {}},
    {"weight": 0, "final_weight": 10, "link_position": {"link": "arm", "point": [0.2, 0, 0], "position": [0.25, 0, 0.125]}}
]"#;

const VARIATIONS: &str = r#"[
    {"of": "gains", "names": ["shoulder"], "given": [[1], [0.5], [2], [1.5]]},
    {"of": "wrench", "names": ["arm"], "uniform": {"low": -4, "high": 4}, "wrench_step": 10, "wrench_steps": 20}
]"#;

fn file(folder: &Path, name: &str, text: &str) -> String {
    let path = folder.join(name);
    std::fs::write(&path, text).unwrap();
    path.display().to_string()
}

async fn rollout(daemon: &Process, arguments: &[&str]) -> Said {
    daemon.simctl(["rollout", "bench_arm"].iter().chain(arguments)).await
}

/// Returns the same rollout as a request.
fn request() -> RolloutRequest {
    let uniform = |low, high| Some(Values::Uniform(RolloutUniform { low, high }));
    let varied = |of: RolloutVaried, names: &[&str], values| RolloutVariation {
        of: of.into(),
        robot: "bench_arm".into(),
        names: names.iter().map(|&name| name.to_owned()).collect(),
        values,
        ..Default::default()
    };
    let given = Some(Values::Given(packed(&[1.0, 0.5, 2.0, 1.5])));
    let wrench = varied(RolloutVaried::Wrench, &["arm"], uniform(-4.0, 4.0));
    let efforts = RolloutJointTerm { robot: "bench_arm".into(), ..Default::default() };
    let place = RolloutLinkTerm {
        robot: "bench_arm".into(),
        link: "arm".into(),
        point: Some(Vector3 { x: 0.2, y: 0.0, z: 0.0 }),
        position: Some(Vector3 { x: 0.25, y: 0.0, z: 0.125 }),
        orientation: None,
    };
    RolloutRequest {
        copies: 4,
        steps: 200,
        controls: vec![RolloutControl {
            robot: "bench_arm".into(),
            joints: vec!["shoulder".into()],
            values: packed(&[0.3]),
            ..Default::default()
        }],
        variations: vec![
            varied(RolloutVaried::LinkMasses, &[], uniform(0.5, 1.5)),
            varied(RolloutVaried::Gains, &["shoulder"], given),
            RolloutVariation { wrench_step: 10, wrench_steps: 20, ..wrench },
        ],
        seed: 7,
        quantities: vec![RolloutQuantity {
            kind: RolloutQuantityKind::JointPositions.into(),
            robot: "bench_arm".into(),
            names: vec!["shoulder".into()],
        }],
        costs: vec![
            RolloutCost { weight: 0.5, final_weight: 0.0, term: Some(Term::JointEfforts(efforts)) },
            RolloutCost { weight: 0.0, final_weight: 10.0, term: Some(Term::LinkPosition(place)) },
        ],
        ..Default::default()
    }
}

/// Returns the cost of each copy and the final position of its joint.
fn ends(document: &Value) -> Vec<[f64; 2]> {
    let copies = document["copies"].as_array().unwrap().iter();
    copies.map(|copy| [&copy["cost"], &copy["positions"][0]].map(|value| value.as_f64().unwrap())).collect()
}

#[tokio::test]
async fn copies_with_the_same_targets_differ_and_are_weighed() {
    let daemon = paused().await;
    let home = Home::new();
    let tried = file(home.path(), "tried.csv", "shoulder\n0.3\n");
    let costs = file(home.path(), "costs.json", COSTS);
    let variations = file(home.path(), "variations.json", VARIATIONS);
    let run = async |seed: &str| {
        let varied = ["--vary", "link-masses=0.5..1.5", "--variations", &variations, "--seed", seed];
        let others = [tried.as_str(), "--copies", "4", "--steps", "200", "--costs", &costs, "-o", "json"];
        let said = rollout(&daemon, &[&others[..], &varied[..]].concat()).await;
        assert_eq!(said.code, 0, "{}", said.err);
        ends(&json(&said))
    };
    let found = run("7").await;
    assert_eq!(run("7").await, found);
    assert_ne!(run("8").await, found);

    let expected = daemon.client().await.rollout(request(), |_| ()).await.unwrap();
    assert_eq!(found.len(), 4);
    for (found, expected) in found.iter().zip(expected.total_costs().into_iter().zip(&expected.states)) {
        let (cost, position) = expected;
        // Decimals are read to the last bits but one.
        assert!((found[0] - cost).abs() <= 1e-12 * cost, "{found:?} {cost}");
        assert!((found[1] - position).abs() < 1e-12, "{found:?} {position}");
    }
    assert!(found[1..].iter().all(|copy| *copy != found[0]), "copies differ: {found:?}");
}

#[tokio::test]
async fn faults_of_costs_and_variations_are_one_sentence() {
    let daemon = paused().await;
    let home = Home::new();
    let tried = file(home.path(), "tried.csv", "shoulder\n0.3\n");
    let two = file(home.path(), "two.csv", "copy,shoulder\n0,0.3\n1,0.4\n");
    let knee = file(home.path(), "knee.csv", "shoulder,knee\n0.3,0.1\n");
    let list = file(home.path(), "list.json", "[[[0.3]]]");
    let positional = file(home.path(), "positional.json", r#"[{"joint_efforts": []}]"#);
    let term = file(home.path(), "term.json", r#"[{"joint_effort": {}}]"#);
    let none = file(home.path(), "none.json", r#"[{"joint_efforts": {}}, {"weight": 2}]"#);
    let link = file(home.path(), "link.json", r#"[{"contact_force": {"links": ["hook"]}}]"#);
    let twice = file(home.path(), "twice.json", r#"[{"of": "gains"}]"#);
    let rows = file(home.path(), "rows.json", r#"[{"of": "gains", "given": [[1], [2], [3]]}]"#);
    let far = r#"[{"joint_efforts": {}}, {"link_position": {"link": "arm", "position": [0, 0, 1e300]}}]"#;
    let far = file(home.path(), "far.json", far);
    let words = file(home.path(), "words.json", r#"[{"weight": "far", "joint_efforts": {}}]"#);
    let high = file(home.path(), "high.csv", "copy,shoulder\n0,0.3\n1,1e300\n");
    let latin = home.path().join("latin.csv").display().to_string();
    std::fs::write(&latin, b"shoulder\n0.3\xb0\n").unwrap();
    let missing = home.path().join("missing.json").display().to_string();
    for (arguments, code, part) in [
        (vec![tried.as_str(), "--vary", "mass=0.5..2"], 2, "link-masses"),
        (vec![tried.as_str(), "--vary", "gains=2"], 2, "LOW..HIGH"),
        (vec![tried.as_str(), "--vary", "wrench:arm=0..1"], 2, "--variations"),
        (vec![tried.as_str(), "--vary", "gains=2..1"], 67, "--vary gains: low is 2; it must be"),
        (
            vec![tried.as_str(), "--vary", "link-masses:hook=1..2"],
            69,
            "--vary link-masses: names[0]: robot \"bench_arm\" has no link \"hook\"",
        ),
        (vec![knee.as_str()], 69, "knee.csv: joints[1]: robot \"bench_arm\" has no joint \"knee\""),
        (vec![tried.as_str(), "--goal", "knee=1"], 69, "--goal: joints[0]: robot \"bench_arm\" has no joint"),
        (vec![list.as_str()], 1, "list.json: it is a list; it must be a JSON object, as {\"joints\": "),
        (vec![two.as_str(), "--copies", "3"], 1, "targets of 2 copies, and --copies says 3"),
        (vec![tried.as_str(), "--costs", &term], 1, "unknown field `joint_effort`"),
        (vec![tried.as_str(), "--costs", &none], 1, "none.json: term 1: it must have one of"),
        (
            vec![tried.as_str(), "--costs", &link],
            69,
            "link.json: term 0: links[0]: robot \"bench_arm\" has no link",
        ),
        (vec![tried.as_str(), "--costs", &positional], 1, "sequence, expected an object at line 1"),
        (vec![tried.as_str(), "--costs", &missing], 1, "missing.json"),
        (vec![tried.as_str(), "--variations", &twice], 1, "twice.json: variation 0: it must have one of"),
        (
            vec![tried.as_str(), "--copies", "2", "--variations", &rows],
            67,
            "variation 0: given has 3 numbers, and needs 2",
        ),
        (vec![tried.as_str(), "--effort-weight", "1", "--costs", &far], 67, "json: term 1: position[2] is"),
        (vec![high.as_str()], 67, "high.csv: targets[1][0][0] (copy, knot, joint) is"),
        (vec![tried.as_str(), "--costs", &words], 1, "string \"far\", expected a number at line 1"),
        (vec![latin.as_str()], 1, "latin.csv is not text in UTF-8: see line 2"),
    ] {
        let said = rollout(&daemon, &arguments).await;
        assert_eq!(said.code, code, "{arguments:?}: {}", said.err);
        assert!(said.err.contains(part), "{arguments:?}: {}", said.err);
    }
}

#[tokio::test]
async fn the_line_and_the_documents_of_the_guide_are_taken() {
    let guide = std::fs::read_to_string(repository().join("docs/rollouts.md")).unwrap();
    let block = |rest: &str| rest.split("```").next().unwrap().to_owned();
    let documents: Vec<String> = guide.split("```json\n").skip(1).map(block).collect();
    let line = guide.lines().find(|line| line.starts_with("simctl rollout ")).unwrap();
    assert_eq!(documents.len(), 2, "those of costs and of variations");

    let daemon = Process::start(["--paused"]).await;
    for arguments in [
        &["robot", "load", "tests/assets/seven_arm", "--name", "arm", "--fixed"][..],
        &["robot", "shape", "plane", "--name", "floor"],
    ] {
        let made = daemon.simctl(arguments).await;
        assert_eq!(made.code, 0, "{}", made.err);
    }
    let home = Home::new();
    for (name, text) in [
        ("costs.json", &documents[0]),
        ("varied.json", &documents[1]),
        ("one.csv", &"joint_1\n0.2\n".to_owned()),
    ] {
        file(home.path(), name, text);
    }
    let said = daemon.shell(&format!("{line} -o json"), home.path()).await;
    assert_eq!(said.code, 0, "{}", said.err);
    assert_eq!(ends(&json(&said)).len(), 100);
}
