//! Limits: of descriptions, of the service, of connections.

use simd_model::LoadLimits;

use crate::config::draft::Draft;
use crate::config::key::{Access, Key, Whole};

/// Beyond any that a machine could keep.
const MANY: u64 = 1 << 40;
/// Times that can be configured.
const SECONDS: std::ops::RangeInclusive<f64> = 0.1..=604_800.0;

pub(super) fn keys() -> Vec<Key> {
    [descriptions(), service(), connections()].into_iter().flatten().collect()
}

/// What descriptions are held to. What a mesh may be can be made less, not more: its readers are built for that.
fn descriptions() -> Vec<Key> {
    let most = LoadLimits::default();
    let count = |path, range, meaning, field| Key::new(path, meaning, Access::Count(range, field));
    vec![
        // Two defaults in one: a request may have 8 MiB, and a file on the disk twice that.
        count("limits.urdf_bytes", 1..=1 << 30, "bytes of a URDF", |draft| &mut draft.config.limits.reading.urdf_bytes),
        count("limits.xml_nodes", 1..=MANY, "elements, texts and comments of a URDF", |draft| {
            &mut draft.config.limits.reading.xml_nodes
        }),
        count("limits.xml_depth", 1..=1_000, "elements inside one another", |draft| {
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
        count("limits.links", 1..=simd_model::MOST_LINKS as u64, "links of a robot, and its joints", |draft| {
            &mut draft.config.limits.reading.links
        }),
        count("limits.shapes", 0..=MANY, "visual and collision shapes of a robot, and its materials", |draft| {
            &mut draft.config.limits.reading.shapes
        }),
        count("limits.mesh_bytes", 0..=most.mesh_bytes as u64, "bytes of a mesh file", |draft| {
            &mut draft.config.limits.reading.mesh_bytes
        }),
        count("limits.mesh_triangles", 0..=most.mesh_triangles as u64, "triangles of a mesh file", |draft| {
            &mut draft.config.limits.reading.mesh_triangles
        }),
        count("limits.robot_triangles", 0..=MANY, "triangles of all meshes of a robot", |draft| {
            &mut draft.config.limits.reading.robot_triangles
        }),
        count("limits.findings", 0..=100_000, "findings of a load report, of each severity", |draft| {
            &mut draft.config.limits.reading.findings
        }),
        Key::new(
            "limits.seconds",
            "from the first byte to the finished robot",
            Access::Seconds(0.0..=86_400.0, |draft| &mut draft.config.limits.reading.time),
        ),
    ]
}

fn service() -> Vec<Key> {
    let count = |path, range, meaning, field: fn(&mut Draft) -> &mut dyn Whole| {
        Key::new(path, meaning, Access::Count(range, field))
    };
    vec![
        count("service.robots", 1..=100_000, "robots at one time", |draft| &mut draft.config.limits.robots),
        count("service.description_bytes", 1..=1 << 30, "bytes of one URDF in a request", |draft| {
            &mut draft.config.limits.description_bytes
        }),
        count(
            "service.asset_bytes",
            1..=1 << 30,
            "bytes of one uploaded mesh file, or of one exported saved state with all of its meshes",
            |draft| &mut draft.config.limits.asset_bytes,
        ),
        count("service.upload_store_bytes", 1..=MANY, "bytes of all kept URDFs and meshes together", |draft| {
            &mut draft.config.limits.upload_store_bytes
        }),
        count(
            "service.decoded_bytes",
            1..=MANY,
            "bytes of all robots' meshes in memory, each counted once",
            |draft| &mut draft.config.limits.decoded_bytes,
        ),
        count(
            "service.reading_seconds",
            1..=86_400,
            "seconds until a description is read, its time in the queue included",
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
        count("service.waiting_commands", 16..=65_536, "commands that wait for the physics thread", |draft| {
            &mut draft.config.driver.mailbox
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
            "of them, of one peer: an IPv4 address, or an IPv6 network of 64 bits; at most `max`",
            |draft| &mut draft.config.connections.max_per_peer,
        ),
        count(
            "connections.loopback_reserve",
            0..=65_535,
            "of them, only for 127.0.0.1 and ::1; less than `max`",
            |draft| &mut draft.config.connections.loopback_reserve,
        ),
        count(
            "connections.max_http1",
            1..=65_536,
            "of them, of HTTP/1.1, at most `max`. A peer's share and the reserve are in proportion",
            |draft| &mut draft.config.connections.max_http1,
        ),
        seconds("connections.begin_seconds", "until a connection says which HTTP it speaks", |draft| {
            &mut draft.config.connections.begin
        }),
        seconds("connections.idle_seconds", "how long a connection may have no call at work", |draft| {
            &mut draft.config.connections.idle
        }),
        seconds(
            "connections.http1_silence_seconds",
            "with nothing over a connection of HTTP/1.1, in either direction. One ends after 30 s between two requests",
            |draft| &mut draft.config.connections.http1_silence,
        ),
        seconds("connections.body_seconds", "from the head of a request to its last byte", |draft| {
            &mut draft.config.connections.body
        }),
        count(
            "connections.body_bytes_per_second",
            1..=1 << 40,
            "a request that takes longer must come this fast: each byte that came earns its time",
            |draft| &mut draft.config.connections.body_bytes_per_second,
        ),
        seconds(
            "connections.stream_silence_seconds",
            "without a message of the client's in a stream of requests (`Control` over HTTP/2)",
            |draft| &mut draft.config.connections.stream_silence,
        ),
    ]
}
