//! Sensors as arguments, and their output.

use anyhow::bail;
use clap::ValueEnum;
use serde::Serialize;
use simd_client::proto::{
    ContactSensor, EncoderSensor, ForceTorqueSensor, ImuSensor, LidarSensor, LinkStateSensor, OdometrySensor,
    RangeLimits, RangeSensor, Sensor, SensorInfo, SensorNoise, Sweep, WrenchAxes, WrenchDirection, sensor,
};

use super::lens::{Lens, LensView};
use super::noise::word;
use crate::{
    failure::Usage,
    output::{
        json::PoseView,
        number::{ABSENT, exact},
        table::{Column, Page, Table},
    },
    quantity::{self, Motion},
};

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Kind {
    /// Specific force, angular velocity and orientation
    Imu,
    /// Force and torque that a joint carries, including fixed ones
    ForceTorque,
    /// Contacts of a link, with their forces
    Contact,
    /// One ray along x
    Range,
    /// Many rays
    Lidar,
    /// Pose and twist of a link
    LinkState,
    /// Position and velocity of a joint
    Encoder,
    /// Pose of a link relative to its start
    Odometry,
    /// Pictures along x, which a renderer draws
    Camera,
}

impl Kind {
    pub(super) fn is_of_joint(self) -> bool {
        matches!(self, Self::ForceTorque | Self::Encoder)
    }

    fn name(self) -> String {
        self.to_possible_value().map(|value| value.get_name().to_owned()).unwrap_or_default()
    }
}

/// Options of only some kinds.
pub(super) struct Shape {
    pub(super) range: Option<[f64; 2]>,
    pub(super) horizontal: Option<Sweep>,
    pub(super) vertical: Option<Sweep>,
    pub(super) rolling: bool,
    pub(super) axes: Option<WrenchAxes>,
    pub(super) direction: Option<WrenchDirection>,
    pub(super) threshold: Option<f64>,
    pub(super) backlash: Option<f64>,
    pub(super) lens: Lens,
}

impl Shape {
    /// Makes the kind; refuses options that it does not use, and missing ones.
    pub(super) fn of(self, kind: Kind) -> anyhow::Result<sensor::Kind> {
        let Self { range, horizontal, vertical, rolling, axes, direction, threshold, backlash, lens } = self;
        let has_rays = matches!(kind, Kind::Range | Kind::Lidar);
        let is_wrench = kind == Kind::ForceTorque;
        for (option, is_given, is_allowed) in [
            ("--range", range.is_some(), has_rays),
            ("--horizontal", horizontal.is_some(), kind == Kind::Lidar),
            ("--vertical", vertical.is_some(), kind == Kind::Lidar),
            ("--rolling", rolling, kind == Kind::Lidar),
            ("--axes", axes.is_some(), is_wrench),
            ("--on-child", direction.is_some(), is_wrench),
            ("--threshold", threshold.is_some(), kind == Kind::Contact),
            ("--backlash", backlash.is_some(), kind == Kind::Encoder),
            (lens.given().unwrap_or_default(), lens.given().is_some(), kind == Kind::Camera),
        ] {
            if is_given && !is_allowed {
                bail!(Usage(format!("{option} is not for a sensor of the kind {}", kind.name())));
            }
        }
        let rays = || match range {
            Some(range) => Ok(range),
            None => bail!(Usage(format!("a sensor of the kind {} needs --range MIN,MAX", kind.name()))),
        };
        Ok(match kind {
            Kind::Imu => sensor::Kind::Imu(ImuSensor {}),
            Kind::ForceTorque => sensor::Kind::ForceTorque(ForceTorqueSensor {
                axes: axes.unwrap_or_default().into(),
                direction: direction.unwrap_or_default().into(),
            }),
            Kind::Contact => sensor::Kind::Contact(ContactSensor { threshold: threshold.unwrap_or(0.0) }),
            Kind::Range => {
                let [min, max] = rays()?;
                sensor::Kind::Range(RangeSensor { min, max })
            }
            Kind::Lidar => {
                let [min, max] = rays()?;
                let Some(horizontal) = horizontal else {
                    bail!(Usage("a lidar needs --horizontal SAMPLES,MIN,MAX".to_owned()))
                };
                let range = Some(RangeLimits { min, max });
                sensor::Kind::Lidar(LidarSensor { horizontal: Some(horizontal), vertical, range, rolling })
            }
            Kind::LinkState => sensor::Kind::LinkState(LinkStateSensor {}),
            Kind::Encoder => sensor::Kind::Encoder(EncoderSensor { backlash: backlash.unwrap_or(0.0) }),
            Kind::Odometry => sensor::Kind::Odometry(OdometrySensor {}),
            Kind::Camera => sensor::Kind::Camera(lens.camera()),
        })
    }
}

/// Parses `MIN,MAX`.
pub(super) fn limits(text: &str) -> Result<[f64; 2], String> {
    match numbers(text, Motion::Slides)?.as_slice() {
        &[min, max] => Ok([min, max]),
        _ => Err("must be MIN,MAX".to_owned()),
    }
}

/// Parses `SAMPLES,MIN,MAX`.
pub(super) fn sweep(text: &str) -> Result<Sweep, String> {
    let (samples, angles) = text.split_once(',').ok_or_else(|| "must be SAMPLES,MIN,MAX".to_owned())?;
    let samples = samples.parse().map_err(|_| format!("`{samples}` is not a number of samples"))?;
    match numbers(angles, Motion::Turns)?.as_slice() {
        &[min, max] => Ok(Sweep { samples, min, max }),
        _ => Err("must be SAMPLES,MIN,MAX".to_owned()),
    }
}

/// Parses an angle or a length: the type of the joint is unknown here.
pub(super) fn backlash(text: &str) -> Result<f64, String> {
    quantity::parse(text, quantity::Kind::Position).map(|of| of.value)
}

/// Parses lengths or angles between commas, with or without units.
fn numbers(text: &str, wanted: Motion) -> Result<Vec<f64>, String> {
    let read = |part| match quantity::parse(part, quantity::Kind::Position)? {
        of if of.motion.is_some_and(|motion| motion != wanted) => Err(format!("`{part}` has the wrong unit")),
        of => Ok(of.value),
    };
    text.split(',').map(read).collect()
}

/// A sensor; null for values that its kind does not have.
#[derive(Serialize)]
pub(super) struct SensorView {
    robot: String,
    name: String,
    /// As in `sensor add`.
    kind: &'static str,
    /// Null for sensors of a joint.
    link: Option<String>,
    joint: Option<String>,
    pose: Option<PoseView>,
    /// Samples per simulated second; null: one each step.
    rate: Option<f64>,
    seed: u64,
    noise: Vec<NoiseView>,
    /// Range finders and lidars: metres.
    range: Option<[f64; 2]>,
    horizontal: Option<SweepView>,
    vertical: Option<SweepView>,
    /// Lidars: each column has its own time.
    rolling: Option<bool>,
    /// Encoders: rad or m.
    backlash: Option<f64>,
    /// Contact sensors: N.
    threshold: Option<f64>,
    /// Force-torque sensors, as in `sensor add`.
    axes: Option<&'static str>,
    /// Force-torque sensors: measures the force of the parent on the child.
    on_child: Option<bool>,
    /// Present for cameras.
    camera: Option<LensView>,
    /// Whether it came with the robot's description.
    described: bool,
    /// Sequence of its newest reading. Before the first reading, a number below all of its sequences.
    last_sequence: u64,
    /// Null if it has readings.
    unavailable: Option<String>,
}

#[derive(Serialize)]
struct SweepView {
    samples: u32,
    min: f64,
    max: f64,
}

#[derive(Serialize)]
struct NoiseView {
    channel: String,
    /// Null: all.
    axis: Option<u32>,
    standard_deviation: f64,
    bias_mean: f64,
    bias_standard_deviation: f64,
    random_walk: f64,
    correlation_time: Option<f64>,
    quantum: f64,
    dropout: f64,
}

impl From<SensorNoise> for NoiseView {
    fn from(of: SensorNoise) -> Self {
        Self {
            channel: word(of.channel()),
            axis: of.axis,
            standard_deviation: of.standard_deviation,
            bias_mean: of.bias_mean,
            bias_standard_deviation: of.bias_standard_deviation,
            random_walk: of.random_walk,
            correlation_time: of.correlation_time,
            quantum: of.quantum,
            dropout: of.dropout,
        }
    }
}

impl SensorView {
    pub(super) fn new(info: SensorInfo) -> Self {
        let SensorInfo { sensor, last_sequence, described, unavailable } = info;
        let Sensor { robot, name, link, joint, pose, rate, seed, noise, kind } = sensor.unwrap_or_default();
        let some = |text: String| Some(text).filter(|text| !text.is_empty());
        let sweep = |of: Option<Sweep>| of.map(|Sweep { samples, min, max }| SweepView { samples, min, max });
        let (mut range, mut horizontal, mut vertical, mut rolling, mut backlash) =
            (None, None, None, None, None);
        let (mut threshold, mut axes, mut on_child, mut camera) = (None, None, None, None);
        let kind = match kind {
            Some(sensor::Kind::Imu(_)) => "imu",
            Some(sensor::Kind::ForceTorque(of)) => {
                axes = Some(match of.axes() {
                    WrenchAxes::Unspecified | WrenchAxes::Child => "child",
                    WrenchAxes::Parent => "parent",
                    WrenchAxes::Sensor => "sensor",
                });
                on_child = Some(of.direction() == WrenchDirection::ParentToChild);
                "force-torque"
            }
            Some(sensor::Kind::Contact(of)) => {
                threshold = Some(of.threshold);
                "contact"
            }
            Some(sensor::Kind::Range(RangeSensor { min, max })) => {
                range = Some([min, max]);
                "range"
            }
            Some(sensor::Kind::Lidar(of)) => {
                range = of.range.map(|RangeLimits { min, max }| [min, max]);
                (horizontal, vertical) = (sweep(of.horizontal), sweep(of.vertical));
                rolling = Some(of.rolling);
                "lidar"
            }
            Some(sensor::Kind::LinkState(_)) => "link-state",
            Some(sensor::Kind::Encoder(of)) => {
                backlash = Some(of.backlash);
                "encoder"
            }
            Some(sensor::Kind::Odometry(_)) => "odometry",
            Some(sensor::Kind::Camera(of)) => {
                camera = Some(LensView::new(&of));
                "camera"
            }
            // A newer daemon may have kinds that this client does not know.
            None => "unknown",
        };
        Self {
            robot,
            name,
            kind,
            link: some(link),
            joint: some(joint),
            pose: pose.as_ref().map(PoseView::from),
            rate,
            seed,
            noise: noise.into_iter().map(NoiseView::from).collect(),
            range,
            horizontal,
            vertical,
            rolling,
            backlash,
            threshold,
            axes,
            on_child,
            camera,
            described,
            last_sequence,
            unavailable: some(unavailable),
        }
    }
}

/// Returns a table with a row for each.
pub(super) fn list(views: &[SensorView]) -> Page {
    let columns = vec![
        Column::left("ROBOT"),
        Column::left("SENSOR"),
        Column::left("KIND"),
        Column::left("ON"),
        Column::right("RATE [Hz]"),
        Column::left("NOISE"),
        Column::right("LAST READING"),
    ];
    let row = |of: &SensorView| {
        let noise: Vec<&str> = of.noise.iter().map(|noise| noise.channel.as_str()).collect();
        vec![
            of.robot.clone(),
            of.name.clone(),
            of.kind.to_owned(),
            of.joint.as_ref().or(of.link.as_ref()).cloned().unwrap_or_default(),
            of.rate.map_or_else(|| "each step".to_owned(), exact),
            if noise.is_empty() { ABSENT.to_owned() } else { noise.join(", ") },
            if of.unavailable.is_some() { "none".to_owned() } else { of.last_sequence.to_string() },
        ]
    };
    let page = Page::new().table(Table::new(columns, views.iter().map(row).collect()));
    let silent = views.iter().filter_map(|of| Some((of, of.unavailable.as_ref()?)));
    silent.fold(page, |page, (of, why)| page.line(format!("{}/{} has no readings: {why}", of.robot, of.name)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nothing() -> Shape {
        Shape {
            range: None,
            horizontal: None,
            vertical: None,
            rolling: false,
            axes: None,
            direction: None,
            threshold: None,
            backlash: None,
            lens: Lens::default(),
        }
    }

    #[test]
    fn a_kind_takes_what_it_has_and_refuses_the_rest() {
        let lidar = Shape {
            range: Some(limits("0.1,30").unwrap()),
            horizontal: Some(sweep("360,-180deg,180deg").unwrap()),
            ..nothing()
        };
        let Ok(sensor::Kind::Lidar(lidar)) = lidar.of(Kind::Lidar) else { panic!("no lidar") };
        assert_eq!(lidar.range, Some(RangeLimits { min: 0.1, max: 30.0 }));
        let horizontal = lidar.horizontal.unwrap();
        assert_eq!((horizontal.samples, horizontal.max), (360, std::f64::consts::PI));
        let slack = Shape { range: Some([0.0, 1.0]), ..nothing() }.of(Kind::Imu).unwrap_err().to_string();
        assert_eq!(slack, "--range is not for a sensor of the kind imu");
        let still = Shape { rolling: true, ..nothing() }.of(Kind::Encoder).unwrap_err().to_string();
        assert_eq!(still, "--rolling is not for a sensor of the kind encoder");
        let bare = nothing().of(Kind::Range).unwrap_err().to_string();
        assert_eq!(bare, "a sensor of the kind range needs --range MIN,MAX");
        let geared = Shape { backlash: Some(backlash("1deg").unwrap()), ..nothing() };
        let Ok(sensor::Kind::Encoder(geared)) = geared.of(Kind::Encoder) else { panic!("no encoder") };
        assert_eq!(geared.backlash, 1f64.to_radians());
    }

    #[test]
    fn sweeps_are_a_number_and_two_angles() {
        for text in ["", "3", "3,1", "x,0,1", "3,0,1,2", "-3,0,1"] {
            assert!(sweep(text).is_err(), "{text}");
        }
        assert_eq!(limits("20cm,5m"), Ok([0.2, 5.0]));
        assert!(limits("1").is_err() && limits("1,90deg").is_err());
    }
}
