//! `simctl sensor`, from a terminal: each of its commands, and their errors.

use serde_json::{Value, json};
use simd_tests::process::repository;

use crate::{paused, written};

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
    assert_eq!((&of("foot")["threshold"], &of("imu_1")["threshold"]), (&json!(2.0), &Value::Null));
    assert_eq!((&of("wrist")["axes"], &of("wrist")["on_child"]), (&json!("sensor"), &json!(true)));
    let lens = json!({
        "picture": "depth", "width": 32, "height": 24, "field_of_view": 60f64.to_radians(), "clip": [0.01, 5.0]
    });
    assert_eq!((&of("eye")["camera"], &of("foot")["camera"]), (&lens, &Value::Null));
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
        // A watch has only later readings: step until it has enough.
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
async fn faults_of_a_sensor_are_one_sentence() {
    let daemon = paused().await;
    for (line, sentence) in [
        (
            "sensor add encoder bench_arm/shoulder --threshold 1",
            "--threshold is not for a sensor of the kind encoder",
        ),
        ("sensor add imu bench_arm --backlash 1deg", "--backlash is not for a sensor of the kind imu"),
        ("sensor add encoder bench_arm/shoulder --backlash -1", "--backlash is -1"),
        ("sensor add encoder bench_arm/elbow", "elbow"),
        ("sensor add range bench_arm", "needs --range MIN,MAX"),
        ("sensor read bench_arm ear", "ear"),
        ("sensor watch bench_arm", "sensor"),
        ("sensor remove bench_arm ear", "ear"),
        ("sensor add range bench_arm --range 0,1e300", "max of --range is 1e300; it must be more than 0"),
        ("sensor add range bench_arm --range 0,-1", "max of --range is -1"),
        ("sensor add lidar bench_arm --range 0,9 --horizontal 4000000000,0,1", "131072 rays"),
        ("sensor add imu bench_arm --rate -1", "--rate is -1"),
        ("sensor add imu bench_arm --rate inf", "--rate is inf"),
        ("sensor add imu bench_arm --pose 1e300,0,0", "x of --pose is 1e300"),
        ("sensor add imu bench_arm --noise orientation:dropout=2", "dropout of --noise is 2"),
        ("sensor add imu bench_arm --noise joint-position:bias=1", "channel of --noise is joint position"),
        ("sensor add contact bench_arm --threshold nan", "--threshold is NaN"),
        ("sensor add camera bench_arm --clip 1e-300,1", "near is 1e-300"),
        ("sensor add camera bench_arm --clip 1,1e300", "far is 1e300"),
        ("sensor add camera bench_arm --field-of-view 1e-9", "field of view"),
        ("sensor add camera bench_arm --size 0x5", "width is 0"),
        ("sensor add imu missing", "there is no robot \"missing\""),
        ("sensor list missing", "there is no robot \"missing\""),
        ("sensor read missing", "there is no robot \"missing\""),
        ("sensor watch missing", "there is no robot \"missing\""),
        ("sensor remove missing imu", "there is no robot \"missing\""),
        ("camera view missing", "there is no robot \"missing\""),
        ("camera view bench_arm", "has no camera"),
        ("camera view bench_arm ear", "ear"),
    ] {
        let said = daemon.shell(&format!("simctl {line}"), &repository()).await;
        assert_ne!(said.code, 0, "{line}");
        assert!(said.err.contains(sentence), "{line}: {}", said.err);
    }
}

/// A camera has pictures and no readings; a sensor without a reading yet says when the first is due.
#[tokio::test]
async fn sensors_without_a_reading_say_why() {
    let daemon = paused().await;
    for add in ["camera bench_arm --name eye", "imu bench_arm --name imu"] {
        written(&daemon, &format!("sensor add {add}")).await;
    }
    let read = daemon.shell("simctl sensor read bench_arm -o json", &repository()).await;
    assert_eq!((read.code, read.out.trim()), (0, "[]"), "{}", read.err);
    assert!(read.err.contains("bench_arm/eye has no reading: a camera has pictures"), "{}", read.err);
    assert!(read.err.contains("bench_arm/imu has no reading: the first comes after steps"), "{}", read.err);
    daemon.client().await.step(1).await.unwrap();
    let read = daemon.simctl(["sensor", "read", "bench_arm", "imu"]).await;
    assert_eq!((read.code, read.err.as_str()), (0, ""), "{}", read.out);
    written(&daemon, "sensor remove bench_arm imu").await;
    for line in ["sensor watch bench_arm eye", "sensor watch bench_arm", "sensor watch"] {
        let watch = daemon.shell(&format!("simctl {line}"), &repository()).await;
        assert_eq!(watch.code, 1, "{line}");
        assert!(watch.err.contains("bench_arm/eye has no readings: a camera has pictures"), "{}", watch.err);
    }
}

/// With ten cameras and no renderer: the picture is refused, and the list says which program to start.
#[tokio::test]
async fn a_world_with_ten_cameras_and_no_renderer_says_what_to_start() {
    let daemon = paused().await;
    for number in 0..10 {
        written(&daemon, &format!("sensor add camera bench_arm --name eye-{number}")).await;
    }
    let list = daemon.simctl(["camera", "list"]).await;
    assert_eq!(list.code, 0, "{}", list.err);
    assert_eq!(list.out.matches("eye-").count(), 10, "{}", list.out);
    assert!(list.out.contains("no renderer draws this world: start `simd-camera"), "{}", list.out);
    let view = daemon.simctl(["camera", "view", "bench_arm", "eye-7"]).await;
    assert!(view.code != 0 && view.err.contains("no renderer draws this world"), "{view:?}");
    let doctor = daemon.simctl(["doctor"]).await;
    assert!(doctor.out.contains("10 cameras, and no renderer"), "{}", doctor.out);
    let several = daemon.simctl(["camera", "view", "bench_arm"]).await;
    assert!(several.err.contains("has 10 cameras: name one"), "{}", several.err);
}
