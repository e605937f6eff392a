//! Daemons as processes on one Zenoh network, behind a router.

use std::time::{Duration, Instant};

use simd_client::proto::ControlWait;
use simd_client::{Client, ControlOptions, Error};
use simd_tests::network::{Router, session};
use simd_tests::process::{Home, Process, soon};
use zenoh::sample::SampleKind;

async fn daemon(name: &str, router: &Router) -> Process {
    let config = ["--name", name, "--config", "tests/assets/demo.toml"];
    Process::start_with(["--zenoh-connect", &router.locator], config).await
}

async fn client(name: &str, router: &Router) -> Client {
    Client::connect(&format!("{}#{name}", router.locator)).await.unwrap()
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn daemons_behind_a_router_are_addressed_by_name() {
    let router = Router::start().await;
    let (one, _two) = tokio::join!(daemon("one", &router), daemon("two", &router));
    for name in ["one", "two"] {
        assert_eq!(client(name, &router).await.simulator_info().await.unwrap().name, name);
    }
    let error = Client::connect(&router.locator).await.unwrap_err();
    let said = one.simctl(["sim", "status", "--endpoint", &router.locator]).await;
    let sentence =
        format!("several daemons answer at {0}: choose one of one, two, as {0}#one", router.locator);
    assert_eq!(error.to_string(), sentence);
    assert_eq!((said.code, said.out.as_str()), (2, ""));
    assert!(said.err.contains(&sentence), "{}", said.err);
    let Err(Error::Unreachable { reason, .. }) = Client::connect(&format!("{}#six", router.locator)).await
    else {
        panic!()
    };
    assert!(reason.contains("one, two"), "{reason}");

    let list = ["daemon", "list", "--endpoint", &router.locator, "-o", "json"];
    let said = one.simctl(list).await;
    assert_eq!(said.code, 0, "{}", said.err);
    let list: serde_json::Value = serde_json::from_str(&said.out).unwrap();
    let names: Vec<&str> = list.as_array().unwrap().iter().filter_map(|it| it["name"].as_str()).collect();
    assert_eq!(names, ["one", "two"]);
    assert_eq!((&list[0]["robots"], &list[0]["state"]), (&1.into(), &"playing".into()));
    let place = format!("{}#two", router.locator);
    let said = one.simctl(["joint", "set", "bench_arm", "shoulder=0.5", "-e", &place]).await;
    assert_eq!(said.code, 0, "{}", said.err);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_second_daemon_of_a_name_does_not_start_and_says_how_to_name_it() {
    let router = Router::start().await;
    let _first = daemon("lab", &router).await;
    let arguments = ["--listen", "127.0.0.1:0", "--name", "lab", "--zenoh-connect", router.locator.as_str()];
    let said = Home::new().run("simd", arguments).await;
    assert_eq!(said.code, 6, "{}", said.err);
    assert!(said.err.contains("a daemon called `lab` is on this Zenoh network already"), "{}", said.err);
    assert!(said.err.contains("--name") && said.out.is_empty(), "{}", said.err);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_taken_locator_exits_with_4_and_says_how_to_choose_another() {
    let router = Router::start().await;
    let arguments = ["--listen", "127.0.0.1:0", "--zenoh", router.locator.as_str()];
    let said = Home::new().run("simd", arguments).await;
    assert_eq!(said.code, 4, "{}", said.err);
    assert!(said.err.contains(&router.locator) && said.err.contains("--zenoh tcp/"), "{}", said.err);
}

/// The other's clients get every state meanwhile, and the dead one is reported as gone.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_killed_daemon_is_missed_and_disturbs_no_other() {
    let router = Router::start().await;
    let (mut one, _two) = tokio::join!(daemon("one", &router), daemon("two", &router));
    let (to_one, to_two) = tokio::join!(client("one", &router), client("two", &router));
    let watcher = session("client", &router.locator).await;
    let tokens = watcher.liveliness().declare_subscriber("@simd/daemons/one/*").await.unwrap();
    to_one.simulator_info().await.unwrap();

    let wait = ControlWait::NewerState;
    let options = ControlOptions { wait, ..ControlOptions::default() };
    let mut control = to_two.control(options).await.unwrap();
    let (mut last, mut newer) = (0, 0);
    let mut gone = None;
    let killed = Instant::now();
    one.kill().await;
    while newer < 500 {
        let states = soon("a state of the other", control.next()).await.unwrap().accepted().unwrap();
        let sequence = states.stamp.unwrap().sequence;
        // On a busy machine there may be no newer state in time.
        assert!(sequence >= last, "{sequence} after {last}");
        newer += usize::from(sequence > last);
        last = sequence;
        if gone.is_none() && tokens.try_recv().is_ok_and(|sample| sample.is_some()) {
            gone = Some(killed.elapsed());
        }
    }
    if gone.is_none() {
        let sample = soon("the end of the token", tokens.recv_async()).await.unwrap();
        assert_eq!(sample.kind(), SampleKind::Delete);
    }
    println!("the token ended {gone:?} after the kill");
    let error = to_one.simulator_info().await.unwrap_err();
    assert!(matches!(error, Error::Unreachable { .. }), "{error:?}");
    to_two.simulator_info().await.unwrap();
}

/// A process that hangs keeps its connection: it counts as gone once it was silent for its lease, here a
/// second instead of five.
#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_daemon_that_hangs_is_missed_after_its_lease() {
    let router = Router::start().await;
    let home = Home::new();
    let settings = home.path().join("zenoh.json5");
    std::fs::write(&settings, "{ transport: { link: { tx: { lease: 1000 } } } }").unwrap();
    let settings = settings.display().to_string();
    let one = Process::start_with(["--zenoh-connect", &router.locator], ["--zenoh-config", &settings]).await;
    let watcher = session("client", &router.locator).await;
    let tokens = watcher.liveliness().declare_subscriber("@simd/daemons/*/*").history(true).await.unwrap();
    assert_eq!(soon("the token", tokens.recv_async()).await.unwrap().kind(), SampleKind::Put);
    let stopped = Instant::now();
    one.signal("STOP").await;
    let sample = soon("the end of the token", tokens.recv_async()).await.unwrap();
    assert_eq!(sample.kind(), SampleKind::Delete);
    println!("the token ended {:?} after the process was stopped", stopped.elapsed());
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_client_survives_a_restart_of_the_router() {
    let router = Router::start().await;
    let _one = daemon("one", &router).await;
    let client = client("one", &router).await.with_timeout(Duration::from_secs(5));
    client.simulator_info().await.unwrap();
    let locator = router.locator.clone();
    router.stop().await;
    let error = client.simulator_info().await.unwrap_err();
    assert!(matches!(error, Error::Unreachable { .. }), "{error:?}");
    let _router = Router::start_at(&locator).await;
    let back = async {
        let mut again = tokio::time::interval(Duration::from_millis(20));
        while client.simulator_info().await.is_err() {
            again.tick().await;
        }
    };
    soon("the way to the daemon", back).await;
}
