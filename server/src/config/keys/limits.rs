//! Limits of descriptions, of the service and of connections.

use simd_model::LoadLimits;

use crate::config::draft::Draft;
use crate::config::key::{Access, Key, MANY, Whole};

/// Range of configurable times, seconds.
const SECONDS: std::ops::RangeInclusive<f64> = 0.1..=604_800.0;

pub(super) fn keys() -> Vec<Key> {
    [descriptions(), service(), clients(), connections()].into_iter().flatten().collect()
}

/// Returns the limits of descriptions. Limits of meshes can be lowered but not raised: the readers are built
/// for them.
fn descriptions() -> Vec<Key> {
    let most = LoadLimits::default();
    let count = |path, range, meaning, field| Key::new(path, meaning, Access::Count(range, field));
    vec![
        // service.description_bytes also limits each description, even on the daemon's disk.
        count("limits.urdf_bytes", 1..=1 << 30, "bytes of a URDF", |draft| {
            &mut draft.config.limits.reading.urdf_bytes
        }),
        count("limits.xml_nodes", 1..=MANY, "elements, texts and comments of a URDF", |draft| {
            &mut draft.config.limits.reading.xml_nodes
        }),
        count("limits.xml_depth", 1..=1_000, "nesting depth of elements", |draft| {
            &mut draft.config.limits.reading.xml_depth
        }),
        count("limits.xml_attributes", 1..=MANY, "attributes of an element", |draft| {
            &mut draft.config.limits.reading.xml_attributes
        }),
        count("limits.xml_namespaces", 1..=MANY, "declarations of namespaces", |draft| {
            &mut draft.config.limits.reading.xml_namespaces
        }),
        count("limits.name_bytes", 1..=MANY, "bytes of a name or of a mesh's URI", |draft| {
            &mut draft.config.limits.reading.name_bytes
        }),
        count(
            "limits.links",
            1..=simd_model::MAX_LINKS as u64,
            "links of a robot, and its joints",
            |draft| &mut draft.config.limits.reading.links,
        ),
        count(
            "limits.shapes",
            0..=MANY,
            "visual and collision shapes of a robot, and its materials",
            |draft| &mut draft.config.limits.reading.shapes,
        ),
        count("limits.mesh_bytes", 0..=most.mesh_bytes as u64, "bytes of a mesh file", |draft| {
            &mut draft.config.limits.reading.mesh_bytes
        }),
        count("limits.mesh_triangles", 0..=most.mesh_triangles as u64, "triangles of a mesh file", |draft| {
            &mut draft.config.limits.reading.mesh_triangles
        }),
        count("limits.robot_triangles", 0..=MANY, "triangles of all meshes of a robot", |draft| {
            &mut draft.config.limits.reading.robot_triangles
        }),
        count("limits.findings", 0..=100_000, "findings of a load report, for each severity", |draft| {
            &mut draft.config.limits.reading.findings
        }),
        Key::new(
            "limits.seconds",
            "time from the first byte to the finished robot",
            Access::Seconds(0.0..=86_400.0, |draft| &mut draft.config.limits.reading.time),
        ),
    ]
}

fn service() -> Vec<Key> {
    let count = |path, range, meaning, field: fn(&mut Draft) -> &mut dyn Whole| {
        Key::new(path, meaning, Access::Count(range, field))
    };
    let seconds = |path, meaning, field| Key::new(path, meaning, Access::Seconds(SECONDS, field));
    vec![
        count("service.robots", 1..=100_000, "robots at one time", |draft| &mut draft.config.limits.robots),
        count(
            "service.description_bytes",
            1..=1 << 30,
            "bytes of one description, sent or on the daemon's disk; never more than `limits.urdf_bytes`",
            |draft| &mut draft.config.limits.description_bytes,
        ),
        count(
            "service.asset_bytes",
            1..=1 << 30,
            "bytes of one uploaded mesh file, or of one exported saved state with all of its meshes",
            |draft| &mut draft.config.limits.asset_bytes,
        ),
        count(
            "service.upload_store_bytes",
            1..=MANY,
            "bytes of all stored URDFs and meshes together",
            |draft| &mut draft.config.limits.upload_store_bytes,
        ),
        count(
            "service.decoded_bytes",
            1..=MANY,
            "bytes of all robots' meshes in memory, each counted once",
            |draft| &mut draft.config.limits.decoded_bytes,
        ),
        count(
            "service.reading_seconds",
            1..=86_400,
            "seconds until a description is read, including its time in the queue",
            |draft| &mut draft.config.limits.reading_seconds,
        ),
        count("service.message_bytes", 65_536..=1 << 28, "bytes of one message", |draft| {
            &mut draft.config.limits.message_bytes
        }),
        count("service.steps", 1..=MANY, "steps of one call", |draft| &mut draft.config.limits.steps),
        count("service.saved_states", 0..=10_000, "saved states of the world", |draft| {
            &mut draft.config.limits.saved_states
        }),
        count("service.parameters", 0..=100_000, "sliders and buttons", |draft| {
            &mut draft.config.limits.parameters
        }),
        count("service.claims", 1..=100_000, "claims on joints, robots and the world", |draft| {
            &mut draft.config.limits.claims
        }),
        count(
            "service.events",
            16..=100_000,
            "events that are kept; readers learn how many they missed",
            |draft| &mut draft.config.driver.events,
        ),
        count(
            "service.answers",
            16..=1_000_000,
            "answers that are kept for retries, including requests in progress; one caller may have half of them. \
             At the limit, the caller with the most loses its oldest",
            |draft| &mut draft.config.limits.answers,
        ),
        count("service.answer_bytes", 65_536..=MANY, "bytes of these answers", |draft| {
            &mut draft.config.limits.answer_bytes
        }),
        seconds("service.answer_seconds", "time for which an answer is kept", |draft| {
            &mut draft.config.limits.answer_time
        }),
        count(
            "service.uploads",
            1..=65_536,
            "uploads in progress; at the limit, the longest untouched one is forgotten",
            |draft| &mut draft.config.limits.uploads,
        ),
        count(
            "service.partial_upload_bytes",
            1..=MANY,
            "bytes of these uploads; at least the bytes of one file",
            |draft| &mut draft.config.limits.partial_upload_bytes,
        ),
        seconds(
            "service.abandoned_upload_seconds",
            "time without a new part after which an upload is forgotten",
            |draft| &mut draft.config.limits.abandoned_upload,
        ),
        seconds(
            "service.unused_file_seconds",
            "time after which a file that no robot uses is forgotten",
            |draft| &mut draft.config.limits.unused_file,
        ),
        count(
            "service.waiting_descriptions",
            1..=65_536,
            "descriptions and files that wait to be read, two at a time",
            |draft| &mut draft.config.limits.waiting_descriptions,
        ),
        count(
            "service.waiting_reads",
            1..=65_536,
            "waiting calls for inverse kinematics, mass matrices, rays and distances; half of the processors work \
             on such calls, and clients are served round robin",
            |draft| &mut draft.config.limits.waiting_reads,
        ),
        count(
            "service.waiting_rollouts",
            1..=65_536,
            "waiting rollouts; two of different clients are computed at a time, on threads of low priority, and \
             clients are served round robin",
            |draft| &mut draft.config.limits.waiting_rollouts,
        ),
        count(
            "service.rollout_bytes",
            65_536..=200 << 20,
            "bytes of one rollout's results; four times as many are kept for clients to read",
            |draft| &mut draft.config.limits.rollout_bytes,
        ),
        count(
            "service.rollout_seconds",
            1..=86_400,
            "processor seconds of one rollout, for all its threads together",
            |draft| &mut draft.config.limits.rollout_seconds,
        ),
        count(
            "service.unread_bytes",
            16 << 20..=MANY,
            "bytes of answers that clients have yet to read, on all transports. A connection may have a \
             third, and a client as many as are free",
            |draft| &mut draft.config.limits.unread_bytes,
        ),
        count(
            "service.memory_limit",
            0..=MANY,
            "bytes that the daemon may allocate; 0 means no limit. Beyond seven eighths, calls that take memory are refused, and the world \
             is saved if `autosave` is on. Beyond the limit the daemon ends",
            |draft| &mut draft.config.limits.memory_limit,
        ),
        count("service.waiting_pictures", 1..=4_096, "pictures that clients wait for", |draft| {
            &mut draft.config.limits.waiting_pictures
        }),
        count(
            "service.picture_bytes",
            1 << 20..=1 << 32,
            "bytes of the pictures that clients wait for; the newest pictures of cameras may have as many again",
            |draft| &mut draft.config.limits.picture_bytes,
        ),
        seconds(
            "service.drawing_seconds",
            "time for a renderer to draw a picture; then the task goes to another one",
            |draft| &mut draft.config.limits.drawing_time,
        ),
        count("service.waiting_steps", 1..=65_536, "calls that wait for their steps", |draft| {
            &mut draft.config.driver.waiting_steps
        }),
        count("service.zenoh_queries", 8..=65_536, "queries of Zenoh in progress", |draft| {
            &mut draft.config.limits.zenoh_queries
        }),
        count("service.zenoh_streams", 1..=65_536, "streams among these", |draft| {
            &mut draft.config.limits.zenoh_streams
        }),
        seconds("service.zenoh_stream_seconds", "duration of a stream over Zenoh", |draft| {
            &mut draft.config.limits.zenoh_stream_time
        }),
        seconds(
            "service.zenoh_unnamed_stream_seconds",
            "duration of a stream over Zenoh whose query does not name its session",
            |draft| &mut draft.config.limits.zenoh_unnamed_stream_time,
        ),
        count(
            "service.waiting_commands",
            16..=65_536,
            "commands that wait for the physics thread",
            |draft| &mut draft.config.driver.mailbox,
        ),
    ]
}

/// Returns the limits of one client, which leave room for others.
fn clients() -> Vec<Key> {
    let count = |path, range, meaning, field: fn(&mut Draft) -> &mut dyn Whole| {
        Key::new(path, meaning, Access::Count(range, field))
    };
    vec![
        count(
            "clients.calls_per_second",
            0..=10_000_000,
            "calls per second, with as many in one burst; 0 disables the limit",
            |draft| &mut draft.config.limits.calls_per_second_of_client,
        ),
        count("clients.streams", 1..=65_536, "streams at one time", |draft| {
            &mut draft.config.limits.streams_of_client
        }),
        count(
            "clients.uploads",
            1..=65_536,
            "uploads in progress; at the limit, the longest untouched one is forgotten",
            |draft| &mut draft.config.limits.uploads_of_client,
        ),
        count(
            "clients.waiting_descriptions",
            1..=65_536,
            "descriptions and files that wait to be read",
            |draft| &mut draft.config.limits.waiting_descriptions_of_client,
        ),
        count(
            "clients.waiting_reads",
            1..=65_536,
            "waiting calls for inverse kinematics, mass matrices, rays and distances",
            |draft| &mut draft.config.limits.waiting_reads_of_client,
        ),
        count("clients.waiting_rollouts", 1..=65_536, "waiting rollouts", |draft| {
            &mut draft.config.limits.waiting_rollouts_of_client
        }),
        count("clients.parameters", 0..=100_000, "sliders and buttons", |draft| {
            &mut draft.config.limits.parameters_of_client
        }),
        count(
            "clients.parameter_bytes",
            0..=MANY,
            "bytes of their names, and of the names of their robots and joints",
            |draft| &mut draft.config.limits.parameter_bytes_of_client,
        ),
        count("clients.saved_states", 0..=10_000, "saved states of the world", |draft| {
            &mut draft.config.limits.saved_states_of_client
        }),
        count("clients.claims", 0..=100_000, "claims on joints, robots and the world", |draft| {
            &mut draft.config.limits.claims_of_client
        }),
    ]
}

fn connections() -> Vec<Key> {
    let count = |path, range, meaning, field: fn(&mut Draft) -> &mut dyn Whole| {
        Key::new(path, meaning, Access::Count(range, field))
    };
    let seconds = |path, meaning, field| Key::new(path, meaning, Access::Seconds(SECONDS, field));
    vec![
        count(
            "connections.max",
            2..=65_536,
            "connections at one time. Each is an open file of the process",
            |draft| &mut draft.config.connections.max,
        ),
        count(
            "connections.max_per_peer",
            1..=65_536,
            "connections of one peer: an IPv4 address, or an IPv6 network of 64 bits; at most `max`",
            |draft| &mut draft.config.connections.max_per_peer,
        ),
        count(
            "connections.loopback_reserve",
            0..=65_535,
            "connections reserved for 127.0.0.1 and ::1; less than `max`",
            |draft| &mut draft.config.connections.loopback_reserve,
        ),
        count(
            "connections.max_http1",
            1..=65_536,
            "HTTP/1.1 connections, at most `max`. A peer's share and the reserve are in proportion",
            |draft| &mut draft.config.connections.max_http1,
        ),
        seconds("connections.begin_seconds", "time until a connection shows its HTTP version", |draft| {
            &mut draft.config.connections.begin
        }),
        seconds(
            "connections.idle_seconds",
            "time for which a connection may have no call at work",
            |draft| &mut draft.config.connections.idle,
        ),
        seconds(
            "connections.http1_silence_seconds",
            "time without bytes in either direction on an HTTP/1.1 connection. Between two requests it ends after \
             30 s",
            |draft| &mut draft.config.connections.http1_silence,
        ),
        seconds("connections.body_seconds", "time from the head of a request to its last byte", |draft| {
            &mut draft.config.connections.body
        }),
        count(
            "connections.body_bytes_per_second",
            1..=MANY,
            "minimum rate of a request that takes longer: each received byte earns its time",
            |draft| &mut draft.config.connections.body_bytes_per_second,
        ),
        count("connections.calls", 1..=65_536, "calls of one connection in progress; more wait", |draft| {
            &mut draft.config.connections.calls
        }),
        count(
            "connections.open_calls",
            1..=65_536,
            "open calls of one connection; clients queue more",
            |draft| &mut draft.config.connections.open_calls,
        ),
        seconds(
            "connections.stream_silence_seconds",
            "time without a message of the client in a stream of requests (`Control` over HTTP/2)",
            |draft| &mut draft.config.connections.stream_silence,
        ),
    ]
}
