//! `simctl sensor`: sensors of robots.

mod definition;
mod lens;
mod noise;
mod reading;

use anyhow::bail;
use clap::{Args, Subcommand};
use serde::Serialize;
use simd_client::{
    Client, every_sensor,
    proto::{
        Pose, Sensor as Definition, SensorInfo, SensorNoise, SensorReadings, SensorSelection, Sweep,
        WrenchAxes, WrenchDirection,
    },
    some_sensors,
};

use self::definition::{Kind, Shape, backlash, limits, sweep};
use self::lens::Lens;
use self::reading::{ReadingView, list_readings};
use super::ended;
use crate::{
    complete,
    failure::{hint, warn},
    output::{Output, View, number::count, table::Page},
    pose,
};

/// Maximum number of hints about sensors without a reading.
const MAX_HINTS: usize = 8;

#[derive(Debug, Subcommand)]
pub(crate) enum Sensor {
    /// Adds a sensor to a robot
    Add(Box<Add>),
    /// Shows the sensors, their places and how often they measure
    List {
        /// Show only sensors of this robot
        #[arg(add = complete::robots())]
        robot: Option<String>,
    },
    /// Shows the newest readings of sensors
    Read(Chosen),
    /// Shows readings as they come, until Ctrl-C
    Watch(Watch),
    /// Deletes a sensor
    #[command(visible_alias = "remove")]
    Delete {
        /// Name of the robot
        #[arg(add = complete::robots())]
        robot: String,
        /// Name of the sensor
        #[arg(add = complete::sensors())]
        sensor: String,
    },
}

#[derive(Args, Debug)]
pub(crate) struct Add {
    /// Kind of the sensor
    kind: Kind,
    /// Link or joint of the sensor; encoders and force-torque sensors are on a joint
    #[arg(value_name = "ROBOT[/LINK]|ROBOT/JOINT")]
    place: String,
    /// Name of the sensor; chosen by the daemon if left out
    #[arg(long, default_value = "", hide_default_value = true)]
    name: String,
    /// Pose on the link, or on the joint's child: metres, and radians about the fixed axes; its origin if
    /// left out
    #[arg(long, value_name = "X,Y,Z[,ROLL,PITCH,YAW]", value_parser = pose::parse, allow_hyphen_values = true)]
    pose: Option<Pose>,
    /// Samples per simulated second; one each step if left out
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    rate: Option<f64>,
    /// Noise of a channel, such as `linear-acceleration.z:deviation=0.02,bias=0.1`; may be repeated
    #[arg(long, value_name = "CHANNEL[.AXIS]:WHAT=VALUE,...", value_parser = noise::parse)]
    noise: Vec<SensorNoise>,
    /// Seed of its noise, with the names of robot and sensor
    #[arg(long, default_value_t = 0, hide_default_value = true)]
    seed: u64,
    /// For a range finder or lidar: limits, metres
    #[arg(long, value_name = "MIN,MAX", value_parser = limits, allow_hyphen_values = true)]
    range: Option<[f64; 2]>,
    /// For a lidar: number of angles about z, and their range
    #[arg(long, value_name = "SAMPLES,MIN,MAX", value_parser = sweep, allow_hyphen_values = true)]
    horizontal: Option<Sweep>,
    /// For a lidar: number of rows, and the range of their angles; one row in the plane if left out
    #[arg(long, value_name = "SAMPLES,MIN,MAX", value_parser = sweep, allow_hyphen_values = true)]
    vertical: Option<Sweep>,
    /// For a lidar: turn once in a period, so that each column has a different time
    #[arg(long)]
    rolling: bool,
    /// For a force-torque sensor: axes of the result
    #[arg(long, value_enum)]
    axes: Option<Axes>,
    /// For a force-torque sensor: measure the force of the parent on the child
    #[arg(long)]
    on_child: bool,
    /// For a contact sensor: force above which it counts as touched
    #[arg(long, value_name = "NEWTON", allow_negative_numbers = true)]
    threshold: Option<f64>,
    /// For an encoder: motion of its joint after it reverses until the encoder follows
    #[arg(long, value_name = "ANGLE|LENGTH", value_parser = backlash, allow_negative_numbers = true)]
    backlash: Option<f64>,
    #[command(flatten)]
    lens: Lens,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
pub(crate) enum Axes {
    /// Axes of the joint's child
    Child,
    /// Axes of the joint's parent
    Parent,
    /// Axes of the sensor
    Sensor,
}

#[derive(Args, Debug)]
pub(crate) struct Chosen {
    /// Name of the robot; all robots if left out
    #[arg(add = complete::robots())]
    robot: Option<String>,
    /// Names of its sensors; all if left out
    #[arg(add = complete::sensors())]
    sensors: Vec<String>,
}

#[derive(Args, Debug)]
pub(crate) struct Watch {
    #[command(flatten)]
    chosen: Chosen,
    /// Rate of messages, per wall second: 0.1 to 1000; no reading is skipped
    #[arg(short, long, default_value_t = 50.0, value_name = "HZ", allow_negative_numbers = true)]
    rate: f64,
    /// End after this number of readings
    #[arg(short, long, value_name = "N")]
    count: Option<u64>,
}

impl Chosen {
    fn selections(self) -> Vec<SensorSelection> {
        let Self { robot, sensors } = self;
        let Some(robot) = robot else { return Vec::new() };
        vec![if sensors.is_empty() { every_sensor(&robot) } else { some_sensors(&robot, sensors) }]
    }
}

pub(crate) async fn run(command: Sensor, client: &Client, output: Output) -> anyhow::Result<()> {
    match command {
        Sensor::Add(add) => {
            let definition = request(*add)?;
            let robot = definition.robot.clone();
            let added = client.create_sensor(definition).await?;
            output.one(&Added { robot, added })
        }
        Sensor::List { robot } => {
            let all = client.sensors(robot.as_deref()).await?;
            let views: Vec<_> = all.into_iter().map(definition::SensorView::new).collect();
            output.list(&views, definition::list)
        }
        Sensor::Read(chosen) => {
            let all = client.sensor_readings(chosen.selections()).await?;
            let silent: Vec<_> = all.iter().filter(|of| of.readings.is_empty()).map(named).collect();
            let views: Vec<ReadingView> = all.into_iter().flat_map(views).collect();
            output.list(&views, list_readings)?;
            let more = silent.len().saturating_sub(MAX_HINTS);
            for (robot, sensor, why) in why_silent(client, silent).await?.into_iter().take(MAX_HINTS) {
                let why =
                    if why.is_empty() { "the first comes after steps of one period" } else { why.as_str() };
                hint(&format!("{robot}/{sensor} has no reading: {why}"));
            }
            if more > 0 {
                hint(&format!("{} more have none", count(more, "sensor")));
            }
            Ok(())
        }
        Sensor::Watch(arguments) => {
            tokio::select! {
                done = watch(arguments, client, output) => done,
                _ = tokio::signal::ctrl_c() => Ok(()),
            }
        }
        Sensor::Delete { robot, sensor } => {
            client.delete_sensor(&robot, &sensor).await?;
            output.one(&Deleted { robot, deleted: sensor })
        }
    }
}

async fn watch(arguments: Watch, client: &Client, output: Output) -> anyhow::Result<()> {
    let Watch { chosen, rate, count: limit } = arguments;
    refuse_the_silent(client, &chosen).await?;
    let mut watch = client.watch_sensors(chosen.selections(), rate).await?;
    let mut shown = 0;
    while limit.is_none_or(|limit| shown < limit) {
        for of in watch.next().await?.ok_or_else(|| ended(client))? {
            if of.missed > 0 {
                let missed = usize::try_from(of.missed).unwrap_or(usize::MAX);
                let which = format!("{}/{}", of.robot, of.sensor);
                warn(&format!(
                    "{} of {which} were lost: they came faster than simctl read them",
                    count(missed, "reading")
                ));
            }
            for view in views(of) {
                if limit.is_some_and(|limit| shown >= limit) {
                    return Ok(());
                }
                output.item(&view)?;
                shown += 1;
            }
        }
    }
    Ok(())
}

/// Refuses a watch without any readings: named sensors that never have one, or only such sensors.
async fn refuse_the_silent(client: &Client, chosen: &Chosen) -> anyhow::Result<()> {
    let all = client.sensors(chosen.robot.as_deref()).await?;
    let is_named = |info: &SensorInfo| {
        let name = info.sensor.as_ref().map(|sensor| &sensor.name);
        name.is_some_and(|name| chosen.sensors.contains(name))
    };
    let is_any_heard = chosen.sensors.is_empty() && all.iter().any(|info| info.unavailable.is_empty());
    let mut silent = all.into_iter().filter(|info| !info.unavailable.is_empty());
    match silent.find(|info| !is_any_heard && (chosen.sensors.is_empty() || is_named(info))) {
        Some(SensorInfo { sensor, unavailable, .. }) => {
            let Definition { robot, name, .. } = sensor.unwrap_or_default();
            bail!("{robot}/{name} has no readings: {unavailable}")
        }
        None => Ok(()),
    }
}

/// Returns these sensors by robot and name, as far as they exist, each with the reason why it has no
/// readings. The reason is empty if it will have some.
async fn why_silent(
    client: &Client,
    wanted: Vec<(String, String)>,
) -> anyhow::Result<Vec<(String, String, String)>> {
    if wanted.is_empty() {
        return Ok(Vec::new());
    }
    let all = client.sensors(None).await?;
    let why = |info: SensorInfo| {
        let Definition { robot, name, .. } = info.sensor.unwrap_or_default();
        let is_wanted = wanted.iter().any(|(of, sensor)| (of, sensor) == (&robot, &name));
        is_wanted.then_some((robot, name, info.unavailable))
    };
    Ok(all.into_iter().filter_map(why).collect())
}

fn named(of: &SensorReadings) -> (String, String) {
    (of.robot.clone(), of.sensor.clone())
}

fn views(of: SensorReadings) -> Vec<ReadingView> {
    let SensorReadings { robot, sensor, readings, missed: _, after_sequence: _ } = of;
    readings.into_iter().map(|reading| ReadingView::new(&robot, &sensor, reading)).collect()
}

fn request(add: Add) -> anyhow::Result<Definition> {
    let Add {
        kind,
        place,
        name,
        pose,
        rate,
        noise,
        seed,
        range,
        horizontal,
        vertical,
        rolling,
        axes,
        on_child,
        threshold,
        backlash,
        lens,
    } = add;
    let axes = axes.map(|axes| match axes {
        Axes::Child => WrenchAxes::Child,
        Axes::Parent => WrenchAxes::Parent,
        Axes::Sensor => WrenchAxes::Sensor,
    });
    let direction = on_child.then_some(WrenchDirection::ParentToChild);
    let shape = Shape { range, horizontal, vertical, rolling, axes, direction, threshold, backlash, lens };
    let (robot, part) = place.split_once('/').unwrap_or((&place, ""));
    let (link, joint) = if kind.is_of_joint() { ("", part) } else { (part, "") };
    Ok(Definition {
        robot: robot.to_owned(),
        name,
        link: link.to_owned(),
        joint: joint.to_owned(),
        pose,
        rate,
        seed,
        noise,
        kind: Some(shape.of(kind)?),
    })
}

#[derive(Serialize)]
struct Added {
    robot: String,
    added: String,
}

impl View for Added {
    fn page(&self) -> Page {
        Page::of_line(format!("sensor {} added to {}", self.added, self.robot))
    }
}

#[derive(Serialize)]
struct Deleted {
    robot: String,
    deleted: String,
}

impl View for Deleted {
    fn page(&self) -> Page {
        Page::of_line(format!("sensor {} of {} deleted", self.deleted, self.robot))
    }
}
