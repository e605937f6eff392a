//! `simctl sim`: the world, its time, its state.

use clap::{Args, Subcommand, ValueEnum};
use serde::Serialize;
use simd_client::{
    Client,
    proto::{self, PaceMode, Physics, ResetSimulationRequest, SetPhysicsRequest, Vector3, WorldStatistics},
};

use super::present;
use crate::{
    output::{
        Output, View,
        json::{self, Stamp},
        number::{count, exact, fixed},
        table::{Column, Page, Table},
    },
    pose,
};

#[derive(Debug, Subcommand)]
pub(crate) enum Sim {
    /// Shows whether the world plays, and how well it keeps time
    Status,
    /// Plays the world
    Play,
    /// Pauses the world
    Pause,
    /// Pauses the world, and resets time and robots to the start
    Stop,
    /// Does steps of a paused world
    Step {
        /// Number of steps
        #[arg(default_value_t = 1, value_parser = clap::value_parser!(u64).range(1..))]
        steps: u64,
    },
    /// Resets the world: time and state, if no scope is given
    Reset(Reset),
    /// Shows the physics settings, or changes those that are given
    Physics(Settings),
    /// Shows which clients step the world together
    Lockstep,
}

#[derive(Args, Debug)]
pub(crate) struct Reset {
    /// Sim time and step become zero
    #[arg(long)]
    time: bool,
    /// Robots return to the state at which they were spawned
    #[arg(long)]
    state: bool,
    /// Robots that were not loaded at the daemon's start are deleted
    #[arg(long)]
    spawned: bool,
}

#[derive(Args, Debug)]
pub(crate) struct Settings {
    /// Gravity, m/s^2 in world axes
    #[arg(long, value_name = "X,Y,Z", value_parser = pose::parse_vector, allow_hyphen_values = true)]
    gravity: Option<Vector3>,
    /// Seconds that a step advances
    #[arg(long, value_name = "SECONDS")]
    time_step: Option<f64>,
    /// Equal parts into which each step is divided
    #[arg(long, value_name = "N")]
    substeps: Option<u32>,
    /// Integration method of a step
    #[arg(long, value_enum)]
    integrator: Option<Integrator>,
    /// Combination of two touching surfaces' friction
    #[arg(long, value_enum)]
    surface_combination: Option<SurfaceCombination>,
    /// Whether free bodies at rest sleep: `true` or `false`
    #[arg(long, value_name = "BOOL")]
    sleeping: Option<bool>,
    /// Simulated seconds per wall second
    #[arg(id = "real_time_factor", long = "rtf", value_name = "FACTOR")]
    rtf: Option<f64>,
    /// Whether steps follow the wall clock
    #[arg(long, value_enum)]
    pace: Option<Pace>,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Integrator {
    /// Second order
    Leapfrog,
    /// Semi-implicit Euler, as in MuJoCo
    Euler,
    /// Bullet's step and laws of contacts
    Bullet,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SurfaceCombination {
    /// The smaller friction, as in Gazebo; the larger restitution
    Min,
    /// The product, as in Bullet, also for restitution
    Multiply,
    /// The larger value, as in MuJoCo
    Max,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Pace {
    /// At the real-time factor
    RealTime,
    /// As fast as possible
    Max,
}

pub(crate) async fn run(command: Sim, client: &Client, output: Output) -> anyhow::Result<()> {
    match command {
        Sim::Status => output.one(&Status::new(&client.world_statistics().await?)?),
        Sim::Play => output.one(&Changed::new("playing", client.play().await?)),
        Sim::Pause => output.one(&Changed::new("paused", client.pause().await?)),
        Sim::Stop => output.one(&Changed::new("stopped", client.stop().await?)),
        Sim::Step { steps } => {
            let stamp = client.step(steps).await?.into();
            output.one(&Stepped { steps, stamp })
        }
        Sim::Reset(Reset { time, state, spawned }) => {
            let request = ResetSimulationRequest { time, state, spawned, ..Default::default() };
            let answer = client.reset(request).await?;
            let stamp = present(answer.stamp, "stamp")?.into();
            output.one(&WasReset { stamp, deleted: answer.deleted })
        }
        Sim::Physics(settings) => physics(settings, client, output).await,
        Sim::Lockstep => {
            let members: Vec<Member> =
                client.lockstep_members().await?.into_iter().map(Member::from).collect();
            output.list(&members, members_page)
        }
    }
}

/// One of the clients that step the world together.
#[derive(Serialize)]
struct Member {
    client: String,
    /// Longest time in seconds from one step to its next request.
    timeout: f64,
    /// Steps that it waits for; 0 if the others wait for it.
    waits_for: u64,
}

impl From<proto::LockstepMember> for Member {
    fn from(member: proto::LockstepMember) -> Self {
        Self { client: member.client, timeout: member.timeout, waits_for: member.waits_for }
    }
}

fn members_page(members: &[Member]) -> Page {
    let columns = vec![Column::left("CLIENT"), Column::right("TIMEOUT S"), Column::right("WAITS FOR STEPS")];
    let row =
        |member: &Member| vec![member.client.clone(), exact(member.timeout), member.waits_for.to_string()];
    Page::new().table(Table::new(columns, members.iter().map(row).collect()))
}

async fn physics(settings: Settings, client: &Client, output: Output) -> anyhow::Result<()> {
    let request = SetPhysicsRequest {
        gravity: settings.gravity,
        time_step: settings.time_step,
        substeps: settings.substeps,
        real_time_factor: settings.rtf,
        pace: match settings.pace {
            None => PaceMode::Unspecified,
            Some(Pace::RealTime) => PaceMode::RealTime,
            Some(Pace::Max) => PaceMode::AsFastAsPossible,
        }
        .into(),
        integrator: match settings.integrator {
            None => proto::Integrator::Unspecified,
            Some(Integrator::Leapfrog) => proto::Integrator::Leapfrog,
            Some(Integrator::Euler) => proto::Integrator::Euler,
            Some(Integrator::Bullet) => proto::Integrator::Bullet,
        }
        .into(),
        surface_combination: match settings.surface_combination {
            None => proto::SurfaceCombination::Unspecified,
            Some(SurfaceCombination::Min) => proto::SurfaceCombination::Min,
            Some(SurfaceCombination::Multiply) => proto::SurfaceCombination::Multiply,
            Some(SurfaceCombination::Max) => proto::SurfaceCombination::Max,
        }
        .into(),
        sleeping: settings.sleeping,
        ..Default::default()
    };
    let physics = if request == SetPhysicsRequest::default() {
        client.physics().await?
    } else {
        present(client.set_physics(request).await?.physics, "physics")?
    };
    output.one(&PhysicsView::new(&physics)?)
}

/// `sim status`.
#[derive(Serialize)]
struct Status {
    state: String,
    stamp: Stamp,
    /// Null as fast as possible.
    target_real_time_factor: f64,
    real_time_factor: f64,
    overruns: u64,
    /// Wall seconds.
    dropped_lag: f64,
    iterations: u64,
    robots: u32,
    joints: u32,
    /// Wall seconds.
    step_duration: f64,
    mailbox_refusals: u64,
    /// Holder of a claim on the world.
    claimed_by: Option<String>,
}

impl Status {
    fn new(statistics: &WorldStatistics) -> anyhow::Result<Self> {
        Ok(Self {
            state: json::name("SIMULATION_STATE_", statistics.state().as_str_name()),
            stamp: present(statistics.stamp, "stamp")?.into(),
            target_real_time_factor: statistics.target_real_time_factor,
            real_time_factor: statistics.real_time_factor,
            overruns: statistics.overruns,
            dropped_lag: statistics.dropped_lag,
            iterations: statistics.iterations,
            robots: statistics.robots,
            joints: statistics.joints,
            step_duration: statistics.step_duration,
            mailbox_refusals: statistics.mailbox_refusals,
            claimed_by: Some(statistics.claimed_by.clone()).filter(|holder| !holder.is_empty()),
        })
    }
}

impl View for Status {
    fn page(&self) -> Page {
        let target = if self.target_real_time_factor.is_finite() {
            exact(self.target_real_time_factor)
        } else {
            "as fast as possible".to_owned()
        };
        Page::new().pairs([
            ("state", self.state.clone()),
            ("sim time", format!("{:.3} s", self.stamp.sim_time)),
            ("step", self.stamp.step.to_string()),
            ("epoch", self.stamp.epoch.to_string()),
            ("real-time factor", format!("{} (target {target})", fixed(self.real_time_factor, 3))),
            ("step duration", format!("{} us", fixed(self.step_duration * 1e6, 1))),
            ("overruns", format!("{} ({} s dropped)", self.overruns, fixed(self.dropped_lag, 3))),
            ("iterations", self.iterations.to_string()),
            ("robots", self.robots.to_string()),
            ("moving joints", self.joints.to_string()),
            ("mailbox refusals", self.mailbox_refusals.to_string()),
            ("claimed by", self.claimed_by.clone().unwrap_or_else(|| "-".to_owned())),
        ])
    }
}

/// `sim play`, `sim pause`, `sim stop`.
#[derive(Serialize)]
struct Changed {
    state: &'static str,
    stamp: Stamp,
}

impl Changed {
    fn new(state: &'static str, stamp: simd_client::proto::Stamp) -> Self {
        Self { state, stamp: stamp.into() }
    }
}

impl View for Changed {
    fn page(&self) -> Page {
        Page::of_line(format!("{} from {}", self.state, self.stamp))
    }
}

/// `sim step`.
#[derive(Serialize)]
struct Stepped {
    steps: u64,
    stamp: Stamp,
}

impl View for Stepped {
    fn page(&self) -> Page {
        let steps = count(usize::try_from(self.steps).unwrap_or(usize::MAX), "step");
        Page::of_line(format!("did {steps}; now at {}", self.stamp))
    }
}

/// `sim reset`.
#[derive(Serialize)]
struct WasReset {
    stamp: Stamp,
    deleted: Vec<String>,
}

impl View for WasReset {
    fn page(&self) -> Page {
        let mut line = format!("reset; now at {} of epoch {}", self.stamp, self.stamp.epoch);
        if !self.deleted.is_empty() {
            line.push_str(&format!("; gone: {}", self.deleted.join(", ")));
        }
        Page::of_line(line)
    }
}

/// Prefix of the schema's names of combinations.
pub(super) const COMBINATION: &str = "SURFACE_COMBINATION_";

/// `sim physics`.
#[derive(Serialize)]
struct PhysicsView {
    /// m/s^2.
    gravity: [f64; 3],
    /// Seconds.
    time_step: f64,
    substeps: u32,
    /// `leapfrog`, `euler` or `bullet`.
    integrator: String,
    /// `min`, `multiply` or `max`.
    surface_combination: String,
    /// Whether free bodies at rest sleep.
    sleeping: bool,
    real_time_factor: f64,
    /// `real_time` or `as_fast_as_possible`.
    pace: String,
}

impl PhysicsView {
    fn new(physics: &Physics) -> anyhow::Result<Self> {
        Ok(Self {
            gravity: json::vector(&present(physics.gravity, "gravity")?),
            time_step: physics.time_step,
            substeps: physics.substeps,
            integrator: json::name("INTEGRATOR_", physics.integrator().as_str_name()),
            surface_combination: json::name(COMBINATION, physics.surface_combination().as_str_name()),
            sleeping: physics.sleeping,
            real_time_factor: physics.real_time_factor,
            pace: json::name("PACE_MODE_", physics.pace().as_str_name()),
        })
    }
}

impl View for PhysicsView {
    fn page(&self) -> Page {
        let gravity: Vec<String> = self.gravity.iter().map(|value| exact(*value)).collect();
        Page::new().pairs([
            ("gravity", format!("{} m/s^2", gravity.join(" "))),
            ("time step", format!("{} s", exact(self.time_step))),
            ("substeps", self.substeps.to_string()),
            ("integrator", self.integrator.clone()),
            ("surfaces", self.surface_combination.clone()),
            ("sleeping", self.sleeping.to_string()),
            ("real-time factor", exact(self.real_time_factor)),
            ("pace", self.pace.replace('_', " ")),
        ])
    }
}
