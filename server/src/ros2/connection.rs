//! The session of the node: a client of the graph's router, since routers of `rmw_zenoh` forward only between
//! clients and peers. It is independent of the daemon's own session.

use std::time::Duration;

use serde_json::json;
use zenoh::Session;

use crate::config::Ros2;

/// Longest time of one attempt.
const CONNECT_MS: u64 = 2_000;
/// Time between two attempts.
const RETRY: Duration = Duration::from_secs(1);
/// Maximum message size, bytes; larger ones are refused before they are read. Descriptions to spawn are the
/// longest.
const MAX_MESSAGE_BYTES: u64 = 16 * 1024 * 1024;

/// Waits for the router without a limit. After that, Zenoh reconnects automatically.
///
/// # Errors
/// Returns an error if the settings are invalid.
pub(super) async fn open(settings: &Ros2) -> Result<Session, String> {
    let mut said = false;
    loop {
        let config = config(&settings.router)?;
        match zenoh::open(config).await {
            Ok(session) => return Ok(session),
            Err(error) if !said => {
                said = true;
                let router = &settings.router;
                tracing::warn!(
                    "no router of ROS 2 answers at {router}; the daemon keeps trying. `ros2 run rmw_zenoh_cpp rmw_zenohd` \
                     starts one"
                );
                tracing::debug!("{error}");
            }
            Err(error) => tracing::debug!("{error}"),
        }
        tokio::time::sleep(RETRY).await;
    }
}

fn config(router: &str) -> Result<zenoh::Config, String> {
    let settings = json!({
        "mode": "client",
        "connect": {
            "endpoints": [router], "timeout_ms": CONNECT_MS, "exit_on_failure": true,
            "retry": { "period_init_ms": 100, "period_max_ms": 1000 },
        },
        "listen": { "endpoints": [] },
        "scouting": { "multicast": { "enabled": false }, "gossip": { "enabled": false } },
        "adminspace": { "enabled": false },
        // Late subscribers use them to distinguish known messages from newer ones.
        "timestamping": { "enabled": true },
        "transport": {
            "link": { "rx": { "max_message_size": MAX_MESSAGE_BYTES } },
            "shared_memory": { "enabled": false },
        },
    });
    zenoh::Config::from_json5(&settings.to_string()).map_err(|error| error.to_string())
}
