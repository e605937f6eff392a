//! Who this daemon is, and the limits that requests must stay within.

use std::time::Duration;

/// Longest name of anything, in bytes: names come back in messages and headers.
pub const MAX_NAME_BYTES: usize = 1024;

/// Who this daemon is.
#[derive(Clone, Debug)]
pub struct DaemonInfo {
    /// What the operator calls it.
    pub name: String,
    /// Its release.
    pub version: &'static str,
    /// What it allows.
    pub limits: DaemonLimits,
}

/// Beyond one of these a request is refused; see `RequestLimits` in the schema.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DaemonLimits {
    /// Robots at one time.
    pub robots: u32,
    /// Links of one robot.
    pub links: u32,
    /// Of one URDF.
    pub description_bytes: u64,
    /// Of one mesh file.
    pub asset_bytes: u64,
    /// Of all kept uploads together.
    pub upload_store_bytes: u64,
    /// Of all robots' meshes in memory, each counted once.
    pub decoded_bytes: u64,
    /// Of the time in which a description is read, waiting for a permit included.
    pub reading_seconds: u64,
    /// Of one message on the wire.
    pub message_bytes: u64,
    /// Of one call that steps.
    pub steps: u64,
    /// States of the world that are kept.
    pub saved_states: u32,
    /// What a description and its meshes must stay within while they are read.
    pub reading: simd_model::LoadLimits,
    /// Sliders and buttons at one time.
    pub parameters: u32,
    /// Claims at one time.
    pub claims: usize,
    /// Answers that are kept for retries, requests under way included.
    pub answers: usize,
    /// Bytes of these.
    pub answer_bytes: usize,
    /// How long one is kept.
    pub answer_time: Duration,
    /// Uploads under way at one time.
    pub uploads: usize,
    /// Bytes of these.
    pub partial_upload_bytes: usize,
    /// After which an upload is abandoned.
    pub abandoned_upload: Duration,
    /// After which a file that no robot uses is forgotten.
    pub unused_file: Duration,
    /// Calls for kinematics, rays and distances that wait.
    pub waiting_reads: usize,
    /// Rollouts that wait for a permit.
    pub waiting_rollouts: usize,
    /// Of the numbers that one rollout gives.
    pub rollout_bytes: u64,
    /// Processor time of one rollout.
    pub rollout_seconds: u64,
    /// Pictures that clients wait for.
    pub waiting_pictures: usize,
    /// Bytes of these, and of the pictures of cameras that are kept.
    pub picture_bytes: u64,
    /// After which a picture that a renderer was given goes to another.
    pub drawing_time: Duration,
    /// Bytes of answers that clients have yet to read, on all transports.
    pub unread_bytes: u64,
    /// Descriptions and files that wait to be read.
    pub waiting_descriptions: usize,
    /// Queries of Zenoh that are being answered.
    pub zenoh_queries: usize,
    /// Of these, streams.
    pub zenoh_streams: usize,
    /// How long one stream of Zenoh goes on.
    pub zenoh_stream_time: Duration,
    /// Calls a second of one client; 0 is any number.
    pub calls_per_second_of_client: u32,
    /// Streams of one client.
    pub streams_of_client: u32,
    /// Calls for kinematics, rays and distances of one client that wait.
    pub waiting_reads_of_client: usize,
    /// Rollouts of one client that wait for a permit.
    pub waiting_rollouts_of_client: usize,
    /// Descriptions and files of one client that wait to be read.
    pub waiting_descriptions_of_client: usize,
    /// Uploads of one client under way.
    pub uploads_of_client: usize,
    /// Sliders and buttons of one client.
    pub parameters_of_client: usize,
    /// Bytes of their names, and of the names of the robots and joints that they move.
    pub parameter_bytes_of_client: usize,
    /// States of the world that are kept for one client.
    pub saved_states_of_client: usize,
    /// Claims of one client.
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
            waiting_descriptions: 64,
            zenoh_queries: 1_024,
            zenoh_streams: 512,
            zenoh_stream_time: Duration::from_secs(3_600),
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
