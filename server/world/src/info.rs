//! Identity of this daemon, and the limits of requests.

use std::time::Duration;

/// Maximum length of any name, bytes: names are repeated in messages and headers.
pub const MAX_NAME_BYTES: usize = 1024;

/// Identity and limits of this daemon.
#[derive(Clone, Debug)]
pub struct DaemonInfo {
    /// Name that the operator gave it.
    pub name: String,
    /// Release.
    pub version: &'static str,
    /// Limits.
    pub limits: DaemonLimits,
}

/// Limits beyond which a request is refused; see `RequestLimits` in the schema.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DaemonLimits {
    /// Maximum number of robots.
    pub robots: u32,
    /// Maximum number of links of one robot.
    pub links: u32,
    /// Maximum bytes of one URDF.
    pub description_bytes: u64,
    /// Maximum bytes of one mesh file.
    pub asset_bytes: u64,
    /// Maximum bytes of all stored uploads together.
    pub upload_store_bytes: u64,
    /// Maximum bytes of all robots' meshes in memory, each counted once.
    pub decoded_bytes: u64,
    /// Maximum time for reading a description, seconds, including the wait for a permit.
    pub reading_seconds: u64,
    /// Maximum bytes of one message on the wire.
    pub message_bytes: u64,
    /// Maximum steps of one call.
    pub steps: u64,
    /// Maximum number of saved states.
    pub saved_states: u32,
    /// Limits for reading a description and its meshes.
    pub reading: simd_model::LoadLimits,
    /// Maximum number of sliders and buttons.
    pub parameters: u32,
    /// Maximum number of claims.
    pub claims: usize,
    /// Maximum number of answers kept for retries, including requests in progress.
    pub answers: usize,
    /// Maximum bytes of these.
    pub answer_bytes: usize,
    /// Time for which each of these is kept.
    pub answer_time: Duration,
    /// Maximum number of uploads in progress.
    pub uploads: usize,
    /// Maximum bytes of these.
    pub partial_upload_bytes: usize,
    /// Time after which an upload is abandoned.
    pub abandoned_upload: Duration,
    /// Time after which a file that no robot uses is forgotten.
    pub unused_file: Duration,
    /// Maximum number of waiting calls for kinematics, rays and distances.
    pub waiting_reads: usize,
    /// Maximum number of rollouts that wait for a permit.
    pub waiting_rollouts: usize,
    /// Maximum bytes of the results of one rollout.
    pub rollout_bytes: u64,
    /// Maximum processor time of one rollout, seconds.
    pub rollout_seconds: u64,
    /// Maximum number of pictures that clients wait for.
    pub waiting_pictures: usize,
    /// Maximum bytes of these, and of the kept pictures of cameras.
    pub picture_bytes: u64,
    /// Time after which a task of a renderer goes to another one.
    pub drawing_time: Duration,
    /// Maximum bytes of answers that clients have yet to read, on all transports.
    pub unread_bytes: u64,
    /// Bytes that the daemon may allocate. 0: no limit.
    pub memory_limit: u64,
    /// Descriptions and files that wait to be read.
    pub waiting_descriptions: usize,
    /// Maximum number of Zenoh queries in progress.
    pub zenoh_queries: usize,
    /// Maximum number of streams among these.
    pub zenoh_streams: usize,
    /// Maximum duration of one Zenoh stream.
    pub zenoh_stream_time: Duration,
    /// Maximum duration of a Zenoh stream whose session is not known: its end is not noticed.
    pub zenoh_unnamed_stream_time: Duration,
    /// Maximum calls per second of one client; 0 disables the limit.
    pub calls_per_second_of_client: u32,
    /// Maximum number of streams of one client.
    pub streams_of_client: u32,
    /// Maximum number of one client's waiting calls for kinematics, rays and distances.
    pub waiting_reads_of_client: usize,
    /// Maximum number of one client's rollouts that wait for a permit.
    pub waiting_rollouts_of_client: usize,
    /// Maximum number of one client's descriptions and files that wait to be read.
    pub waiting_descriptions_of_client: usize,
    /// Maximum number of one client's uploads in progress.
    pub uploads_of_client: usize,
    /// Maximum number of sliders and buttons of one client.
    pub parameters_of_client: usize,
    /// Maximum bytes of their names, and of the names of their robots and joints.
    pub parameter_bytes_of_client: usize,
    /// Maximum number of saved states of one client.
    pub saved_states_of_client: usize,
    /// Maximum number of claims of one client.
    pub claims_of_client: usize,
}

impl Default for DaemonLimits {
    fn default() -> Self {
        Self {
            robots: 1_000,
            links: 1_000,
            description_bytes: 8 << 20,
            asset_bytes: 128 << 20,
            upload_store_bytes: 1 << 30,
            decoded_bytes: 2 << 30,
            reading_seconds: 120,
            // A description travels in one message.
            message_bytes: 16 << 20,
            steps: 100_000_000,
            saved_states: 48,
            reading: simd_model::LoadLimits::default(),
            parameters: 1_024,
            claims: 1_024,
            answers: 1_024,
            answer_bytes: 64 << 20,
            answer_time: Duration::from_secs(3_600),
            uploads: 64,
            partial_upload_bytes: 512 << 20,
            abandoned_upload: Duration::from_secs(60),
            unused_file: Duration::from_secs(600),
            waiting_reads: 64,
            waiting_rollouts: 16,
            rollout_bytes: 64 << 20,
            rollout_seconds: 60,
            waiting_pictures: 64,
            picture_bytes: 256 << 20,
            drawing_time: Duration::from_secs(5),
            unread_bytes: 160 << 20,
            memory_limit: 0,
            waiting_descriptions: 64,
            zenoh_queries: 1_024,
            zenoh_streams: 512,
            zenoh_stream_time: Duration::from_secs(3_600),
            zenoh_unnamed_stream_time: Duration::from_secs(30),
            calls_per_second_of_client: 20_000,
            streams_of_client: 256,
            waiting_reads_of_client: 32,
            waiting_rollouts_of_client: 4,
            waiting_descriptions_of_client: 32,
            uploads_of_client: 32,
            parameters_of_client: 768,
            parameter_bytes_of_client: 128 << 10,
            saved_states_of_client: 32,
            claims_of_client: 768,
        }
    }
}
