//! `simctl sensor`, from a terminal: each of its commands, and what it says where it is refused.

use serde_json::{Value, json};
use simd_tests::process::{Process, repository};

use crate::paused;

/// What a command writes as JSON.
async fn written(daemon: &Process, line: &str) -> Value {
    let said = daemon.shell(&format!("simctl {line} -o json"), &repository()).await;
    assert_eq!(said.code, 0, "{line}: {}", said.err);
    serde_json::from_str(&said.out).unwrap_or_else(|error| panic!("{line}: {error}: {}", said.out))
}

#[tokio::test]
async fn sensors_are_added_listed_read_watched_and_removed() {
    let daemon = paused().await;
    let made =
        written(&daemon, "sensor add imu bench_arm --rate 200 --noise angular-velocity.z:bias=0.5 --seed 3")
            .await;
    assert_eq!(made, json!({ "robot": "bench_arm", "added": "imu_1" }));
    for (add, name) in [
        ("force-torque bench_arm/shoulder --axes sensor --on-child --name wrist", "wrist"),
        ("contact bench_arm --threshold 2 --name foot", "foot"),
        ("range bench_arm --range 5cm,8m --pose 0,0,3 --name ray", "ray"),
        (
            "lidar bench_arm --range 0.1,8 --horizontal 5,-90deg,90deg --vertical 2,0,10deg --rolling --rate 10 --name scan",
            "scan",
        ),
        ("link-state bench_arm --name truth", "truth"),
        (
            "encoder bench_arm/shoulder --backlash 0.5deg --noise joint-position:quantum=0.001 --name dial",
            "dial",
        ),
        ("odometry bench_arm --name way", "way"),
        (
            "camera bench_arm --size 32x24 --field-of-view 60deg --clip 1cm,5m --picture depth --name eye",
            "eye",
        ),
    ] {
        let made = written(&daemon, &format!("sensor add {add}")).await;
        assert_eq!(made["added"], name, "{add}");
    }
    let all = written(&daemon, "sensor list bench_arm").await;
    let of = |name: &str| all.as_array().unwrap().iter().find(|of| of["name"] == name).unwrap().clone();
    assert_eq!(all.as_array().unwrap().len(), 9);
    assert_eq!((&of("imu_1")["rate"], &of("imu_1")["seed"]), (&json!(200.0), &json!(3)));
    assert_eq!(of("imu_1")["noise"][0]["bias_mean"], 0.5);
    assert_eq!(of("ray")["range"], json!([0.05, 8.0]));
    assert_eq!((&of("scan")["rolling"], &of("scan")["horizontal"]["samples"]), (&json!(true), &json!(5)));
    assert_eq!(
        (&of("dial")["backlash"], &of("dial")["joint"]),
        (&json!(0.5f64.to_radians()), &json!("shoulder"))
    );
    assert!(of("eye")["unavailable"].as_str().unwrap().contains("simctl camera view"), "{}", of("eye"));

    daemon.client().await.step(100).await.unwrap();
    let read = written(&daemon, "sensor read bench_arm imu_1 ray dial").await;
    let measured = |index: usize, kind: &str| read[index]["measurement"][kind].clone();
    assert_eq!((&read[0]["sample"], &read[0]["stamp"]["step"]), (&json!(20), &json!(100)), "{read}");
    assert_eq!(measured(0, "imu")["angular_velocity"], json!([0.0, 0.0, 0.5]));
    assert_eq!(measured(1, "range")["range"], "inf");
    assert!(measured(2, "encoder")["position"].is_number(), "{read}");
    let page = daemon.simctl(["sensor", "read", "bench_arm"]).await;
    assert!(page.code == 0 && page.out.contains("wrist") && page.out.contains("truth"), "{page:?}");

    let folder = repository();
    let watch = daemon.shell("simctl sensor watch bench_arm truth --count 5 -o jsonl", &folder);
    let client = daemon.client().await;
    let steps = async {
        // A watch has what comes after it: steps are done until it has enough.
        loop {
            client.step(1).await.unwrap();
        }
    };
    let watched = tokio::select! {
        watched = watch => watched,
        () = steps => unreachable!(),
    };
    assert_eq!(watched.code, 0, "{}", watched.err);
    let samples: Vec<u64> = watched
        .out
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap()["sample"].as_u64().unwrap())
        .collect();
    assert!(samples.len() == 5 && samples.windows(2).all(|pair| pair[1] == pair[0] + 1), "{samples:?}");

    let gone = written(&daemon, "sensor remove bench_arm truth").await;
    assert_eq!(gone, json!({ "robot": "bench_arm", "deleted": "truth" }));
    assert_eq!(written(&daemon, "sensor delete bench_arm way").await["deleted"], "way");
    assert_eq!(written(&daemon, "sensor list").await.as_array().unwrap().len(), 7);
}

#[tokio::test]
async fn what_is_wrong_with_a_sensor_is_said_in_a_sentence() {
    let daemon = paused().await;
    for (line, sentence) in [
        (
            "sensor add encoder bench_arm/shoulder --threshold 1",
            "--threshold is not for a sensor of the kind encoder",
        ),
        ("sensor add imu bench_arm --backlash 1deg", "--backlash is not for a sensor of the kind imu"),
        ("sensor add encoder bench_arm/shoulder --backlash -1", "sensor.encoder.backlash"),
        ("sensor add encoder bench_arm/elbow", "elbow"),
        ("sensor add range bench_arm", "needs --range MIN,MAX"),
        ("sensor read bench_arm ear", "ear"),
        ("sensor watch bench_arm", "sensor"),
        ("sensor remove bench_arm ear", "ear"),
    ] {
        let said = daemon.shell(&format!("simctl {line}"), &repository()).await;
        assert_ne!(said.code, 0, "{line}");
        assert!(said.err.contains(sentence), "{line}: {}", said.err);
    }
}
