//! `simctl marker` and `simctl camera`, against the process.

use serde_json::Value;

use crate::paused;

#[tokio::test]
async fn simctl_draws_lists_and_deletes_markers_and_moves_cameras() {
    let daemon = paused().await;
    let run = async |line: &str| {
        let said = daemon.simctl(line.split(' ')).await;
        assert_eq!((said.code, said.err.as_str()), (0, ""), "{line}");
        said.out
    };
    assert_eq!(run("marker add line 0,0,0 -1,0,0.5 --color 1,0,0 --width 3").await, "marker 1 added\n");
    assert_eq!(run("marker add point 0,0,0.1 --on bench_arm/arm --seconds 600").await, "marker 2 added\n");
    assert_eq!(run("marker add text here -0.5,0,1 --size 0.2").await, "marker 3 added\n");
    assert_eq!(run("marker add text there 0,0,1 --replace 3").await, "marker 3 added\n");
    let list: Value = serde_json::from_str(&run("marker list --json").await).unwrap();
    let seen: Vec<_> = list.as_array().unwrap().iter().collect();
    assert_eq!(
        (&seen[0]["kind"], &seen[0]["count"], &seen[0]["robot"]),
        (&"lines".into(), &1.into(), &Value::Null)
    );
    assert_eq!((&seen[1]["robot"], &seen[1]["link"]), (&"bench_arm".into(), &"arm".into()));
    let left = seen[1]["life_time"].as_f64().unwrap();
    assert!(left > 500.0 && left <= 600.0, "{left}");
    assert_eq!((&seen[2]["text"], &seen[2]["life_time"]), (&"there".into(), &Value::Null));
    let table = run("marker list").await;
    assert!(
        table.contains("1 line") && table.contains("bench_arm/arm") && table.contains("there"),
        "{table}"
    );
    assert_eq!(run("marker delete 1 77").await, "1 marker deleted\n");
    assert_eq!(run("marker delete --all").await, "2 markers deleted\n");
    assert_eq!(run("camera set 1,1,1 --target 0,0,0.5 --field-of-view 60").await, "cameras moved\n");
    assert_eq!(run("camera get --json").await.trim(), "[]");
    let set = daemon.client().await.cameras().await.unwrap().camera.unwrap();
    assert!((set.field_of_view - 60_f64.to_radians()).abs() < 1e-12, "{set:?}");

    let refused = daemon.simctl(["marker", "add", "point", "0,0,0", "--on", "moon"]).await;
    assert_eq!(refused.code, 69, "{}", refused.err);
    assert!(refused.err.contains("moon"), "{}", refused.err);
    // The end of another program's connection deletes no lasting markers.
    assert_eq!(run("marker add point 0,0,0").await, "marker 4 added\n");
    assert!(run("marker list").await.contains("1 point"));
}
