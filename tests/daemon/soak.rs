//! `make soak`, for seconds: the guarantees for an hour hold for them.

use std::time::Duration;

use simd_tests::soak::{self, Options};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn no_acknowledged_command_is_lost_and_each_refusal_is_counted_while_everything_comes_and_goes() {
    let options = Options {
        quiet: Duration::from_secs(1),
        duration: Duration::from_secs(12),
        every: Duration::from_secs(4),
        readers: 20,
        stopped: 5,
        priority: 0,
        locks_memory: false,
        processor: None,
    };
    let report = soak::run(options).await;
    let tally = &report.tally;
    assert_eq!(tally.failures(), Vec::<String>::new());
    // It did something of each kind, and something was refused.
    for kind in ["targets", "exchange", "spawn", "delete", "save", "restore", "claim", "add parameter"] {
        assert!(tally.acknowledged(kind) > 0, "{kind}: {tally}");
    }
    assert!(tally.refused().len() > 5, "{tally}");
    // Whatever the machine is: steps had a lateness in both phases.
    assert!(report.quiet.lateness.count() > 0 && report.loaded.lateness.count() > 0);
}
