//! Who this daemon is, and the limits that requests must stay within.

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

/// Beyond one of these a request is refused; see `Limits` in the schema.
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
    /// Of the time in which a description is read, waiting for its turn included.
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
            saved_states: 32,
            reading: simd_model::LoadLimits::default(),
            parameters: 1_024,
        }
    }
}
