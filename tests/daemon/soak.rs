//! `make soak`, for seconds: what must hold for an hour holds for them.

use std::time::Duration;

use simd_tests::soak::{self, Options};

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn no_acknowledged_command_is_lost_while_everything_comes_and_goes() {
    let options = Options { duration: Duration::from_secs(12), every: Duration::from_secs(4) };
    let tally = soak::run(options).await;
    assert_eq!(tally.failures(), Vec::<String>::new());
    // It did something of each kind, and something was refused.
    for kind in ["targets", "exchange", "spawn", "delete", "save", "restore", "claim", "add parameter"] {
        assert!(tally.acknowledged(kind) > 0, "{kind}: {tally}");
    }
    assert!(tally.totals().1 > 0, "{tally}");
}
