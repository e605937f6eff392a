//! Calls without a context have the limits of a client.

use simd_world::handle::testing::paused;
use tonic::Request;

use super::*;

#[tokio::test]
async fn a_call_without_a_context_counts_for_an_unknown_client_and_not_for_the_process() {
    let handle = paused();
    assert_eq!(handle.call().account, Account::Process, "the handle of a test is the process's");
    let unknown = handle_of(&handle, &Request::new(()));
    assert_eq!(unknown.call().account, Account::Unknown);
    let streams = handle.info().limits.streams_of_client;
    let kept: Vec<_> = (0..streams).map(|_| unknown.count_stream().unwrap()).collect();
    assert!(kept.iter().all(Option::is_some));
    let refused = unknown.count_stream().unwrap_err().to_string();
    assert!(refused.contains("the number of streams of unknown clients"), "{refused}");
    assert!(handle.count_stream().unwrap().is_none(), "the process has no limit");
}
