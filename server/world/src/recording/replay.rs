//! Repeats the run of a recording. It applies the recorded commands before the same steps, from a recorded
//! world on, and compares the result of each step with the recorded one.

mod changes;
mod difference;
mod variation;

use std::collections::VecDeque;
use std::io::Read;

use simd_core::simulation::WorldLimits;
use simd_core::{Command, PhysicsSettings, PublishedState, Simulation};
use simd_proto::v1;

use super::commands::{Decoder, invalid};
use super::reading::{Record, Recording, Unreadable};
use crate::blocking_threads::BlockingThreads;
use crate::call_error::CallError;
use crate::info::DaemonLimits;
use crate::loading::Loader;

pub use changes::Changes;
use difference::what_differs;
use variation::SecondRun;
pub use variation::{Comparison, Difference, Variation};

/// Maximum bytes of commands that wait for the steps before them.
const WAITING_BYTES: usize = 256 << 20;
/// Maximum number of saved states of a world.
const SAVED_STATES: usize = 100_000;

/// Result of a replay.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Replayed {
    /// Name of the recording.
    pub recording: String,
    /// Release of the daemon that made it.
    pub release: String,
    /// Simulated time at which the replay begins, seconds.
    pub from: f64,
    /// Number of replayed steps that are equal.
    pub steps: u64,
    /// Number of applied commands.
    pub commands: u64,
    /// Number of whole worlds that are equal.
    pub worlds: u64,
    /// First difference, as a sentence.
    pub difference: Option<String>,
    /// Reason why the recording is incomplete, as a sentence.
    pub ends_early: Option<String>,
    /// Reason why the rest is unreadable, as a sentence.
    pub damaged: Option<String>,
    /// Comparison with a second run, if anything was to be changed.
    pub comparison: Option<Comparison>,
}

/// Record that is due before a step.
#[derive(Debug)]
enum Due {
    Command(v1::RecordedCommand),
    World(v1::RecordedWorld),
}

impl Due {
    fn steps(&self) -> u64 {
        match self {
            Self::Command(command) => command.steps,
            Self::World(world) => world.steps,
        }
    }

    fn bytes(&self) -> usize {
        match self {
            Self::Command(command) => {
                256 + command.data.len() + command.json.len() + command.robot_source.len()
            }
            Self::World(world) => 256 + 128 * world.saved_states.len() + 128 * world.claims.len(),
        }
    }
}

/// Replays one file of a recording, from its first world on. With `from`, it begins at the last world whose
/// simulated time is not later. `open` opens the file for each pass.
///
/// # Errors
/// Returns a sentence if it is not a recording, or has no world to start from.
pub async fn replay<R: Read>(
    open: impl FnMut() -> std::io::Result<R>,
    from: Option<f64>,
) -> Result<Replayed, String> {
    replay_beside(open, from, Variation::default()).await
}

/// Like `replay`, with a second run beside it, in which something is changed. That run gets the recorded
/// commands at the same simulated time.
///
/// # Errors
/// As [`replay`], and if something cannot be changed or written.
pub async fn replay_beside<R: Read>(
    mut open: impl FnMut() -> std::io::Result<R>,
    from: Option<f64>,
    variation: Variation,
) -> Result<Replayed, String> {
    let mut input = || open().map_err(|error| format!("it cannot be read: {error}"));
    let skip = match from {
        None => 0,
        Some(from) => world_before(input()?, from)?,
    };
    let recording = Recording::open(input()?).map_err(|error| error.to_string())?;
    let loader = loader().map_err(|error| error.to_string())?;
    let text = |key: &str| recording.metadata.get(key).cloned().unwrap_or_default();
    let replayed = Replayed { recording: text("recording"), release: text("release"), ..Replayed::default() };
    let run = Run {
        recording,
        decoder: Decoder::new(loader),
        world: None,
        state: PublishedState::default(),
        second: None,
        failed: None,
        variation: (!variation.changes.is_empty()).then_some(variation),
        done: 0,
        due: VecDeque::new(),
        due_bytes: 0,
        replayed,
    };
    run.run_to_end(skip).await
}

/// Makes a loader with default limits: the limits of the recording's daemon are not known.
fn loader() -> std::io::Result<Loader> {
    let threads = BlockingThreads::computing()?;
    Loader::new(DaemonLimits::default(), &[], threads).map_err(|(_, error)| error)
}

/// Returns the number of worlds before the last one that is not later.
fn world_before(input: impl Read, from: f64) -> Result<usize, String> {
    let mut recording = Recording::open(input).map_err(|error| error.to_string())?;
    let (mut count, mut before, mut first) = (0, None, None);
    // The replay reports unreadable parts.
    while let Ok(Some(record)) = recording.next() {
        let Record::World(world) = record else { continue };
        recording.forget(&world.state_sha256);
        let time = world.stamp.map_or(0.0, |stamp| stamp.sim_time);
        first = first.or(Some(time));
        if time <= from {
            before = Some(count);
        }
        count += 1;
    }
    before.ok_or_else(|| match first {
        Some(first) => format!("it has no world before {from} s; the first is at {first} s"),
        None => "it has no world to start from".to_owned(),
    })
}

struct Run<R> {
    recording: Recording<R>,
    decoder: Decoder,
    world: Option<Simulation>,
    state: PublishedState,
    second: Option<SecondRun>,
    /// Variation that starts the second run.
    variation: Option<Variation>,
    /// Reason why the second run cannot continue.
    failed: Option<String>,
    /// Steps since the file began.
    done: u64,
    /// Due records, in recorded order.
    due: VecDeque<Due>,
    due_bytes: usize,
    replayed: Replayed,
}

impl<R: Read> Run<R> {
    async fn run_to_end(mut self, mut skip: usize) -> Result<Replayed, String> {
        let ended = loop {
            let record = match self.recording.next() {
                Ok(Some(record)) => record,
                Ok(None) => break self.come_due(u64::MAX).await.map_err(Unreadable::from).map(|_| true),
                // Records from before the end are still due.
                Err(error) => match self.come_due(self.done).await {
                    Ok(_) => break Err(error),
                    Err(worse) => break Err(worse.into()),
                },
            };
            let goes_on = match record {
                Record::World(world) if self.world.is_none() => {
                    if skip > 0 {
                        skip -= 1;
                        continue;
                    }
                    self.begin(world).await
                }
                // Records before the first world of the replay.
                _ if self.world.is_none() => continue,
                Record::World(world) => self.wait(Due::World(world)),
                Record::Command(command) => self.wait(Due::Command(command)),
                Record::Steps(steps) => self.steps(steps).await,
            };
            match goes_on {
                Ok(true) => {}
                Ok(false) => break Ok(false),
                Err(error) => break Err(error.into()),
            }
        };
        match ended {
            Ok(_) => {}
            Err(Unreadable::Mcap(error @ simd_mcap::Error::EndsEarly { .. })) => {
                self.replayed.ends_early = Some(error.to_string());
            }
            Err(error) => self.replayed.damaged = Some(error.to_string()),
        }
        if let Some(why) = self.failed {
            return Err(why);
        }
        if let Some(second) = self.second {
            self.replayed.comparison = Some(second.end()?);
        }
        match (self.world, &self.replayed.damaged) {
            (None, Some(damaged)) => Err(damaged.clone()),
            (None, None) => Err("it has no world to start from".to_owned()),
            (Some(_), _) => Ok(self.replayed),
        }
    }

    /// Begins the replay with this world.
    async fn begin(&mut self, recorded: v1::RecordedWorld) -> Result<bool, CallError> {
        let world = self.fresh(&recorded).await?;
        if let Some(variation) = self.variation.take() {
            let world = self.fresh(&recorded).await?;
            let claims = recorded.claims.iter().map(Decoder::claim).collect::<Result<Vec<_>, _>>()?;
            let claims = claims.into_iter().map(|request| request.claim);
            match SecondRun::begin(world, variation, claims.collect()) {
                Ok(second) => self.second = Some(second),
                Err(why) => return Ok(self.fail(why)),
            }
        }
        self.done = recorded.steps;
        self.replayed.from = recorded.stamp.map_or(0.0, |stamp| stamp.sim_time);
        let is_equal = world.fingerprint() == recorded.fingerprint;
        if !is_equal {
            self.replayed.difference = Some(
                "the world that the recording begins with is another one than it was: the file was written by another build of simd"
                    .into(),
            );
        }
        self.replayed.worlds += u64::from(is_equal);
        world.observe(&mut self.state);
        self.world = Some(world);
        Ok(is_equal)
    }

    /// Makes a world as it was recorded.
    async fn fresh(&mut self, recorded: &v1::RecordedWorld) -> Result<Simulation, CallError> {
        let limits = WorldLimits { robots: self.decoder.loader.most_robots(), saved_states: SAVED_STATES };
        let mut world = Simulation::new(PhysicsSettings::default(), limits);
        let (saved, _) = self.decoder.state(&recorded.state_sha256, &self.recording.files).await?;
        let name = "recorded".to_owned();
        world.apply(&Command::ImportSavedState { name: name.clone(), saved })?;
        world.apply(&Command::RestoreState { name: name.clone() })?;
        world.apply(&Command::DeleteSavedState { name })?;
        for kept in &recorded.saved_states {
            let (saved, _) = self.decoder.state(&kept.state_sha256, &self.recording.files).await?;
            world.apply(&Command::ImportSavedState { name: kept.name.clone(), saved })?;
        }
        for claim in &recorded.claims {
            world.restore_claim(&Decoder::claim(claim)?)?;
        }
        Ok(world)
    }

    fn wait(&mut self, due: Due) -> Result<bool, CallError> {
        let latest = self.due.back().map_or(self.done, Due::steps);
        if due.steps() < latest {
            return Err(invalid("its entries are out of order"));
        }
        self.due_bytes = self.due_bytes.saturating_add(due.bytes());
        if self.due_bytes > WAITING_BYTES {
            return Err(invalid("too many commands have no step"));
        }
        self.due.push_back(due);
        Ok(true)
    }

    /// Applies the records that are due after this many steps.
    async fn come_due(&mut self, steps: u64) -> Result<bool, CallError> {
        while self.due.front().is_some_and(|due| due.steps() <= steps) {
            let Some(due) = self.due.pop_front() else { break };
            self.due_bytes = self.due_bytes.saturating_sub(due.bytes());
            if due.steps() != self.done {
                return Err(invalid(&format!("the steps after {} are missing", self.done)));
            }
            let goes_on = match due {
                Due::Command(command) => self.apply(&command).await?,
                Due::World(world) => self.compare(&world).await?,
            };
            if !goes_on {
                return Ok(false);
            }
        }
        Ok(true)
    }

    async fn apply(&mut self, recorded: &v1::RecordedCommand) -> Result<bool, CallError> {
        let (command, claim) = self.decoder.command(recorded, &self.recording.files).await?;
        let Some(world) = &mut self.world else { return Ok(false) };
        let command = without_versions(command);
        if let Err(refused) = world.apply_for(&command, claim) {
            let kind: String = recorded.kind.chars().take(40).collect();
            let at = world.now();
            self.differs(format!(
                "at step {} ({:.6} s), {kind} was applied when it was recorded, and is refused now: {refused}",
                at.step, at.sim_time
            ));
            return Ok(false);
        }
        self.replayed.commands += 1;
        match self.second.as_mut().map(|second| second.apply(command, claim)) {
            Some(Err(why)) => Ok(self.fail(why)),
            Some(Ok(())) | None => Ok(true),
        }
    }

    /// Ends the replay because the second run cannot continue.
    fn fail(&mut self, why: String) -> bool {
        self.failed.get_or_insert(why);
        false
    }

    fn differs(&mut self, sentence: String) {
        self.replayed.difference.get_or_insert(sentence);
    }

    async fn steps(&mut self, recorded: v1::RecordedSteps) -> Result<bool, CallError> {
        if recorded.steps != self.done {
            // Steps before the first world of the replay.
            let ended = recorded.steps.saturating_add(recorded.fingerprints.len() as u64) <= self.done;
            let lacking = || invalid(&format!("the steps after {} are missing", self.done));
            return if ended { Ok(true) } else { Err(lacking()) };
        }
        for fingerprint in recorded.fingerprints {
            if !self.come_due(self.done).await? {
                return Ok(false);
            }
            let Some(world) = &mut self.world else { return Ok(false) };
            world.step();
            world.observe(&mut self.state);
            self.done = self.done.saturating_add(1);
            if let Some(Err(why)) = self.second.as_mut().map(|second| second.follow(&self.state)) {
                return Ok(self.fail(why));
            }
            let is_equal = self.state.fingerprint() == fingerprint;
            if self.replayed.difference.is_none() {
                if is_equal {
                    self.replayed.steps += 1;
                } else {
                    let at = self.state.at;
                    self.differs(format!(
                        "step {} ({:.6} s) is the first that differs",
                        at.step, at.sim_time
                    ));
                }
            }
        }
        Ok(true)
    }

    /// Compares a recorded world with the present one. The first world after a differing step shows the
    /// differences.
    async fn compare(&mut self, recorded: &v1::RecordedWorld) -> Result<bool, CallError> {
        let Some(world) = &self.world else { return Ok(false) };
        let is_equal = world.fingerprint() == recorded.fingerprint;
        let present = (!is_equal).then(|| world.to_saved());
        if let Some(present) = present {
            let (saved, _) = self.decoder.state(&recorded.state_sha256, &self.recording.files).await?;
            let at = self.state.at;
            let what = what_differs(&saved, present.world_state(), &self.state);
            let seen = format!("at step {} ({:.6} s), {what}", at.step, at.sim_time);
            let sentence =
                self.replayed.difference.take().map_or(seen.clone(), |first| format!("{first}; {seen}"));
            self.differs(sentence);
        }
        if !recorded.saved_states.iter().any(|kept| kept.state_sha256 == recorded.state_sha256) {
            self.recording.forget(&recorded.state_sha256);
        }
        if self.replayed.difference.is_some() {
            return Ok(false);
        }
        self.replayed.worlds += 1;
        Ok(true)
    }
}

/// Removes versions of robots, which differ in the replay.
fn without_versions(mut command: Command) -> Command {
    if let Command::SetTargets(targets) = &mut command {
        targets.robots.iter_mut().for_each(|robot| robot.layout_version = 0);
    }
    command
}
