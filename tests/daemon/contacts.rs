//! `simctl contact`, from a terminal: rays, distances, and their errors.

use serde_json::{Value, json};
use simd_tests::process::{Home, Process, repository};

use crate::{paused, written};

/// Two balls of 0.1 m, one above the other, far from the demo's arm. The lower one is only in group 4.
async fn balls() -> Process {
    let daemon = paused().await;
    for (name, z) in [("low", 1), ("high", 2)] {
        written(&daemon, &format!("robot shape sphere:0.1 --fixed --name {name} --pose 5,0,{z}")).await;
    }
    written(&daemon, "robot filter low --group 4").await;
    daemon
}

#[tokio::test]
async fn rays_are_cast_one_by_one_or_by_a_file_and_pass_what_a_mask_leaves_out() {
    let daemon = balls().await;
    let down = "contact ray 5,0,4 5,0,0";
    let hit = written(&daemon, down).await;
    assert_eq!((&hit["hit"], &hit["robot"], &hit["link"]), (&json!(true), &json!("high"), &json!("link")));
    assert!((hit["fraction"].as_f64().unwrap() - 1.9 / 4.0).abs() < 1e-9, "{hit}");
    for (mask, robot) in
        [("4", json!("low")), ("0x4", json!("low")), ("5", json!("high")), ("8", Value::Null)]
    {
        assert_eq!(written(&daemon, &format!("{down} --mask {mask}")).await["robot"], robot, "{mask}");
    }

    let folder = Home::new();
    let file = folder.path().join("rays.txt").display().to_string();
    std::fs::write(&file, "# down, and beside\n5 0 4  5 0 0\n5,0,4, 5,0,2.5\n\n4 0 1 6 0 1\n").unwrap();
    let hits = written(&daemon, &format!("contact ray --rays {file}")).await;
    let robots: Vec<&Value> = hits.as_array().unwrap().iter().map(|hit| &hit["robot"]).collect();
    assert_eq!(robots, [&json!("high"), &Value::Null, &json!("low")]);
    assert_eq!(hits[0], hit, "a ray of a file is as one alone");
    assert!(hits[2]["normal"][0].as_f64().unwrap() < -1.0 + 1e-9, "{hits}");
    // Standard input gives the same, for people.
    let said = daemon.shell(&format!("simctl contact ray --rays - --mask 4 < {file}"), &repository()).await;
    assert_eq!((said.code, said.err.as_str()), (0, ""));
    let lines: Vec<Vec<&str>> = said.out.lines().map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(lines[0], ["RAY", "HITS", "FRACTION", "POINT", "m", "NORMAL"]);
    assert_eq!(lines[1][..3], ["0", "low/link", "0.7250"]);
    assert_eq!(lines[2], ["1", "-", "-", "-", "-"]);
    assert_eq!(lines[3][..3], ["2", "low/link", "0.4500"]);
    assert_eq!(lines.len(), 4, "{}", said.out);
}

#[tokio::test]
async fn distances_are_measured_to_shapes_of_no_robot() {
    let daemon = balls().await;
    let pairs = written(&daemon, "contact distance sphere:0.2@5,0,3 high").await;
    assert_eq!((&pairs[0]["robot_a"], &pairs[0]["link_a"]), (&Value::Null, &Value::Null));
    assert_eq!((&pairs[0]["robot_b"], &pairs[0]["link_b"]), (&json!("high"), &json!("link")));
    assert!((pairs[0]["distance"].as_f64().unwrap() - 0.7).abs() < 1e-9, "{pairs}");
    assert!(pairs[0]["normal"][2].as_f64().unwrap() < -1.0 + 1e-9, "{pairs}");
    // In the other order, and with the pose in an option.
    let back = written(&daemon, "contact distance high/link sphere:0.2@5,0,3").await;
    assert_eq!((&back[0]["robot_b"], &back[0]["distance"]), (&Value::Null, &pairs[0]["distance"]));
    assert_eq!(written(&daemon, "contact distance sphere:0.2 high --pose 5,0,3").await, pairs);
    // Every robot, and no robot at all.
    let near = written(&daemon, "contact distance box:0.2,0.2,0.2@5,0,1.5 --within 1").await;
    let mut robots: Vec<_> = near.as_array().unwrap().iter().map(|pair| pair["robot_b"].as_str()).collect();
    robots.sort_unstable();
    assert_eq!(robots, [Some("high"), Some("low")]);
    let shapes = written(&daemon, "contact distance sphere:0.2@5,0,9 sphere:0.2@5,0,8").await;
    assert!((shapes[0]["distance"].as_f64().unwrap() - 0.6).abs() < 1e-9, "{shapes}");
    // Overlaps and hits of a shape, with its place after it or in an option.
    let there = written(&daemon, "contact overlaps sphere:0.2@5,0,2.1").await;
    assert_eq!(there, json!([{ "robot": "high", "link": "link" }]));
    assert_eq!(written(&daemon, "contact overlaps sphere:0.2 --pose 5,0,2.1").await, there);
    let met = written(&daemon, "contact cast sphere:0.2@5,0,4 0,0,-4").await;
    assert_eq!((&met["hit"], &met["robot"]), (&json!(true), &json!("high")));
    let page = daemon.simctl(["contact", "distance", "sphere:0.2@5,0,3", "high"]).await;
    assert_eq!((page.code, page.err.as_str()), (0, ""));
    assert!(page.out.contains("the shape") && page.out.contains("high/link"), "{}", page.out);
}

#[tokio::test]
async fn faults_of_a_ray_or_a_distance_are_one_sentence() {
    let daemon = balls().await;
    let folder = Home::new();
    let file = folder.path().join("rays.txt").display().to_string();
    std::fs::write(&file, "5 0 4 5 0 0\n5 0 4\n").unwrap();
    let many = folder.path().join("many.txt").display().to_string();
    std::fs::write(&many, "5 0 4 5 0 0\n".repeat(20_001)).unwrap();
    for (line, code, sentence) in [
        ("contact ray 5,0,4".to_owned(), 2, "required"),
        ("contact ray".to_owned(), 2, "simctl contact ray [OPTIONS] --rays <FILE>"),
        ("contact ray 5,0,4 5,0,0 --mask=-1".to_owned(), 2, "hexadecimal digits"),
        (format!("contact ray 5,0,4 5,0,0 --rays {file}"), 2, "cannot be used with"),
        (format!("contact ray --rays {file}"), 1, "rays.txt: line 2 has 3 numbers"),
        (format!("contact ray --rays {many}"), 72, "the number of rays of one query"),
        ("contact ray --rays nowhere.txt".to_owned(), 1, "nowhere.txt"),
        ("contact ray --rays - < /dev/null".to_owned(), 1, "it has no rays"),
        ("contact ray nan,0,4 5,0,0".to_owned(), 67, "x of FROM is NaN"),
        ("contact distance plane:1".to_owned(), 2, "must be box:X,Y,Z"),
        ("contact distance sphere:-1".to_owned(), 67, "radius"),
        ("contact distance high sphere:1@nan,0,0".to_owned(), 67, "x of B is NaN"),
        ("contact distance sphere:1@1,0,0 --pose 2,0,0".to_owned(), 2, "once"),
        ("contact distance sphere:1 --position shoulder=1".to_owned(), 2, "--position"),
        ("contact overlaps sphere:0.2@1,0".to_owned(), 2, "the pose after @ is wrong: must be x,y,z or"),
        ("contact cast sphere:0.2@1,0,big 0,0,-1".to_owned(), 2, "the pose after @ is wrong: `big`"),
        ("contact overlaps sphere:0.2@1,0,0 --pose 2,0,0".to_owned(), 2, "once"),
        ("contact distance missing".to_owned(), 69, "there is no robot \"missing\""),
    ] {
        let said = daemon.shell(&format!("simctl {line}"), &repository()).await;
        assert_eq!(said.code, code, "{line}: {}", said.err);
        assert!(said.err.contains(sentence), "{line}: {}", said.err);
    }
}
