//! Robots that are spawned with progress, and the accounts they count for.

use futures_util::StreamExt as _;
use simd_proto::v1::spawn_entity_with_progress_response::Event;

use super::*;
use simd_world::account::Account;
use simd_world::handle::CallContext;
use simd_world::handle::testing::paused;
use simd_world::handle::testing::reading;

type Answers = BoxStream<v1::SpawnEntityWithProgressResponse>;

/// Spawns a robot for a client.
async fn asked(service: &Service, client: &str) -> Answers {
    let urdf = br#"<robot name="box"><link name="base"/></robot>"#.to_vec();
    let source = v1::DescriptionSource {
        source: Some(v1::description_source::Source::Urdf(urdf)),
        ..Default::default()
    };
    let spawn = v1::SpawnEntityRequest { source: Some(source), ..Default::default() };
    let mut request = Request::new(v1::SpawnEntityWithProgressRequest { spawn: Some(spawn) });
    request.extensions_mut().insert(CallContext::of(Account::Session(client.into())));
    service.spawn_entity_with_progress(request).await.unwrap().into_inner()
}

async fn end(mut answers: Answers) -> Result<v1::SpawnEntityResponse, Status> {
    while let Some(answer) = answers.next().await {
        if let Some(Event::Spawned(spawned)) = answer?.event {
            return Ok(spawned);
        }
    }
    panic!("it ended without its robot");
}

#[tokio::test]
async fn robots_of_one_client_that_wait_to_be_read_leave_room_for_those_of_others() {
    let handle = paused();
    let service = Service::new(handle.clone());
    let reading = reading(&handle).await;
    let mut waiting = Vec::new();
    for _ in 0..handle.info().limits.waiting_descriptions_of_client {
        waiting.push(asked(&service, "busy").await);
    }
    let beyond = asked(&service, "busy").await;
    let other = asked(&service, "other").await;
    let refused = end(beyond).await.unwrap_err();
    let expected = "of one client would be 33, and the limit is 32";
    assert!(refused.message().contains(expected), "{refused}");
    drop(reading);
    // This world keeps no robots.
    for one in waiting.into_iter().chain([other]) {
        let gone = end(one).await.unwrap_err();
        let expected = "robot \"box\" was loaded at step 0 and no longer exists: it was deleted, or the \
                        world was reset or restored";
        assert_eq!(gone.message(), expected);
    }
}
