//! Commands to and from their form in a recording. Descriptions and meshes of robots, and saved states, are
//! in separate files, each named by its SHA-256.

use std::collections::BTreeMap;

use simd_core::Command;
use simd_core::simulation::command::{ClaimId, ClaimRequest};
use simd_core::simulation::{RobotParts, Saved};
use simd_model::robot::Sha256;
use simd_proto::v1;

use crate::account::Account;
use crate::call_error::CallError;
use crate::driver::AppliedCommand;
use crate::loading::saved_state_file::{Content, RobotSource, open, seal};
use crate::loading::{Files, Loader};

/// Receiver of the files that a command needs.
pub(super) trait KeepFile {
    /// Error of a failed write.
    type Error: From<CallError>;

    /// Stores a file, unless it was stored before.
    fn keep(
        &mut self,
        sha256: Sha256,
        bytes: impl FnOnce() -> Result<Vec<u8>, CallError>,
    ) -> Result<(), Self::Error>;
}

/// Encodes a command with everything that its replay needs. The caller adds the moment and the number of
/// steps.
pub(super) fn encode<K: KeepFile>(
    applied: &AppliedCommand,
    loader: &Loader,
    files: &mut K,
) -> Result<v1::RecordedCommand, K::Error> {
    let AppliedCommand { at: _, command, claim, sender } = applied;
    let robot_sources = match command {
        Command::Spawn(spawn) => vec![loader.robot_source(&spawn.model)?],
        Command::SpawnAll(spawns) => {
            spawns.iter().map(|spawn| loader.robot_source(&spawn.model)).collect::<Result<_, CallError>>()?
        }
        Command::Reload(reload) => vec![loader.robot_source(&reload.model)?],
        _ => Vec::new(),
    };
    for source in &robot_sources {
        keep_robot(source, loader, files)?;
    }
    let state_sha256 = match command {
        Command::ImportSavedState { saved, .. } => keep_state(saved, loader, files)?.to_string(),
        _ => String::new(),
    };
    // If the call has no sender, the source of the targets names it.
    let source = match command {
        Command::SetTargets(targets) => targets.source.as_ref().map(|source| source.client.clone()),
        _ => None,
    };
    let json = serde_json::to_string(command).unwrap_or_default();
    Ok(v1::RecordedCommand {
        client: sender.clone().or(source).map(|client| client.to_string()).unwrap_or_default(),
        claim: claim.map_or(0, |claim| claim.0),
        kind: kind(&json).to_owned(),
        data: encoded(command)?,
        json,
        // Sources of several robots are concatenated: each contains its own end.
        robot_source: robot_sources.iter().map(encoded).collect::<Result<Vec<_>, CallError>>()?.concat(),
        state_sha256,
        ..v1::RecordedCommand::default()
    })
}

/// Returns the kind: `SetTargets` for `{"SetTargets":{...}}`.
fn kind(json: &str) -> &str {
    json.split('"').nth(1).unwrap_or_default()
}

fn encoded(value: &impl serde::Serialize) -> Result<Vec<u8>, CallError> {
    postcard::to_allocvec(value).map_err(|error| CallError::Internal { message: error.to_string() })
}

fn keep_robot<K: KeepFile>(source: &RobotSource, loader: &Loader, files: &mut K) -> Result<(), K::Error> {
    let named = std::iter::once(&source.description).chain(source.assets.values());
    for sha256 in named {
        files.keep(*sha256, || Ok(loader.file_of_robot(sha256)?.to_vec()))?;
    }
    Ok(())
}

/// Stores a state with the files of its robots; returns the hash of its encoding.
pub(super) fn keep_state<K: KeepFile>(
    saved: &Saved,
    loader: &Loader,
    files: &mut K,
) -> Result<Sha256, K::Error> {
    let sources = loader.robot_sources(saved)?;
    for source in &sources {
        keep_robot(source, loader, files)?;
    }
    let file = seal(&Content::new("", saved, sources, Vec::new()));
    let sha256 = Sha256::of(&file);
    files.keep(sha256, || Ok(file))?;
    Ok(sha256)
}

/// Encodes an active claim.
pub(super) fn encode_claim(request: &ClaimRequest) -> Result<v1::RecordedClaim, CallError> {
    Ok(v1::RecordedClaim { data: encoded(request)?, holder: request.holder.clone() })
}

/// Decodes a recording's contents for a world.
#[derive(Debug)]
pub(super) struct Decoder {
    pub(super) loader: Loader,
    /// Robots that were made before.
    known: BTreeMap<RobotSource, RobotParts>,
}

impl Decoder {
    pub(super) fn new(loader: Loader) -> Self {
        Self { loader, known: BTreeMap::new() }
    }

    /// Returns a command, and the claim of its sender.
    pub(super) async fn command(
        &mut self,
        recorded: &v1::RecordedCommand,
        files: &Files,
    ) -> Result<(Command, Option<ClaimId>), CallError> {
        let mut command: Command = decoded(&recorded.data, "a command")?;
        match &mut command {
            Command::Spawn(spawn) => {
                (spawn.model, spawn.shapes) = self.robot(&recorded.robot_source, &spawn.name, files).await?;
            }
            Command::SpawnAll(spawns) => {
                let mut rest: &[u8] = &recorded.robot_source;
                for spawn in spawns {
                    let (source, after) =
                        postcard::take_from_bytes::<RobotSource>(rest).map_err(|error| {
                            invalid(&format!("what a robot is made from cannot be read: {error}"))
                        })?;
                    let made = self
                        .loader
                        .made_again(&Account::Process, &source, files, &spawn.name, &mut self.known)
                        .await?;
                    (spawn.model, spawn.shapes) = made;
                    rest = after;
                }
                if !rest.is_empty() {
                    return Err(invalid("there is more after the end of what robots are made from"));
                }
            }
            Command::Reload(reload) => {
                (reload.model, reload.shapes) =
                    self.robot(&recorded.robot_source, &reload.robot, files).await?;
            }
            Command::ImportSavedState { saved, .. } => {
                *saved = self.state(&recorded.state_sha256, files).await?.0;
            }
            _ => {}
        }
        Ok((command, (recorded.claim != 0).then_some(ClaimId(recorded.claim))))
    }

    async fn robot(&mut self, source: &[u8], name: &str, files: &Files) -> Result<RobotParts, CallError> {
        let source: RobotSource = decoded(source, "what a robot is made from")?;
        self.loader.made_again(&Account::Process, &source, files, name, &mut self.known).await
    }

    /// Returns a state by its hash, and the release that wrote it.
    pub(super) async fn state(&mut self, sha256: &str, files: &Files) -> Result<(Saved, String), CallError> {
        let file = Sha256::parse(sha256).and_then(|sha256| files.get(&sha256).cloned());
        let lacking: String = sha256.chars().take(64).collect();
        let file = file.ok_or_else(|| invalid(&format!("the state {lacking:?} is not in it")))?;
        let opened = open(&file, self.loader.most_robots())?;
        let saved = self.loader.saved(&Account::Process, opened.content, files, &mut self.known).await?;
        Ok((saved, opened.written_by))
    }

    pub(super) fn claim(recorded: &v1::RecordedClaim) -> Result<ClaimRequest, CallError> {
        decoded(&recorded.data, "a claim")
    }
}

fn decoded<T: serde::de::DeserializeOwned>(bytes: &[u8], what: &str) -> Result<T, CallError> {
    let damaged = |error: &dyn std::fmt::Display| invalid(&format!("{what} cannot be read: {error}"));
    let (value, rest) = postcard::take_from_bytes(bytes).map_err(|error| damaged(&error))?;
    if rest.is_empty() { Ok(value) } else { Err(damaged(&"there is more after its end")) }
}

/// Decodes a message of a recording.
pub(super) fn message<M: simd_proto::checked::Known>(bytes: &[u8]) -> Result<M, CallError> {
    simd_proto::checked::check(M::SHAPE, bytes)
        .map_err(|refused| invalid(&format!("a message cannot be read: {refused}")))?;
    M::decode(bytes).map_err(|error| invalid(&format!("a message cannot be read: {error}")))
}

/// Makes a refusal of a recording.
pub(super) fn invalid(message: &str) -> CallError {
    CallError::InvalidSavedState { message: format!("the recording is damaged: {message}") }
}
