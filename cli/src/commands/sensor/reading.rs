//! Output of sensor readings.

use serde::{Serialize, Serializer};
use simd_client::proto::{Pose, Quaternion, SensorReading, Twist, Vector3, sensor_reading::Measurement};

use crate::output::{
    View,
    json::{self, PoseView, Stamp},
    number::{count, fixed, several},
    table::{Column, Page, Table},
};

/// A reading.
#[derive(Serialize)]
pub(super) struct ReadingView {
    robot: String,
    sensor: String,
    /// Number of the reading, without gaps except for lost ones.
    sequence: u64,
    /// Number of the sample, from 1.
    sample: u64,
    /// Null if the daemon does not send it.
    stamp: Option<Stamp>,
    measurement: MeasurementView,
}

/// SI units; axes as in the schema.
#[derive(Serialize)]
#[serde(rename_all = "snake_case")]
enum MeasurementView {
    Imu {
        linear_acceleration: [f64; 3],
        angular_velocity: [f64; 3],
        orientation: [f64; 4],
    },
    ForceTorque {
        force: [f64; 3],
        torque: [f64; 3],
    },
    Contact {
        touching: bool,
        force: [f64; 3],
        normal_force: f64,
        partners: Vec<PartnerView>,
        more_partners: u32,
    },
    Range {
        range: Distance,
    },
    /// Row by row, with `columns` values in each.
    Lidar {
        ranges: Vec<Distance>,
        columns: u32,
    },
    LinkState {
        pose: PoseView,
        linear: [f64; 3],
        angular: [f64; 3],
    },
    Encoder {
        position: f64,
        velocity: f64,
    },
    Odometry {
        pose: PoseView,
        linear: [f64; 3],
        angular: [f64; 3],
    },
    /// A kind of a newer daemon.
    Unknown {},
}

#[derive(Serialize)]
struct PartnerView {
    robot: String,
    link: String,
    force: [f64; 3],
    normal_force: f64,
    depth: f64,
    points: u32,
}

/// Metres. JSON has no infinite numbers: they are texts, `inf`, `-inf` and `nan`.
#[derive(Clone, Copy, Debug)]
struct Distance(f64);

impl Serialize for Distance {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self.0 {
            metres if metres.is_finite() => serializer.serialize_f64(metres),
            beyond => serializer.serialize_str(&fixed(beyond, 0)),
        }
    }
}

impl ReadingView {
    pub(super) fn new(robot: &str, sensor: &str, reading: SensorReading) -> Self {
        let SensorReading { sequence, sample, stamp, measurement } = reading;
        Self {
            robot: robot.to_owned(),
            sensor: sensor.to_owned(),
            sequence,
            sample,
            stamp: stamp.map(Stamp::from),
            measurement: MeasurementView::new(measurement),
        }
    }

    fn time(&self) -> String {
        self.stamp.as_ref().map_or_else(String::new, |stamp| fixed(stamp.sim_time, 3))
    }
}

impl View for ReadingView {
    fn page(&self) -> Page {
        let Self { robot, sensor, sample, .. } = self;
        Page::of_line(format!(
            "{:>10} s  {robot}/{sensor} #{sample}  {}",
            self.time(),
            self.measurement.in_short()
        ))
    }
}

impl MeasurementView {
    fn new(measurement: Option<Measurement>) -> Self {
        let vector = |of: &Option<Vector3>| of.as_ref().map(json::vector).unwrap_or_default();
        let pose = |of: &Option<Pose>| PoseView::from(&of.unwrap_or_default());
        let motion = |of: &Option<Twist>| {
            let of = of.unwrap_or_default();
            (vector(&of.linear), vector(&of.angular))
        };
        match measurement {
            Some(Measurement::Imu(of)) => {
                let Quaternion { x, y, z, w } = of.orientation.unwrap_or_default();
                Self::Imu {
                    linear_acceleration: vector(&of.linear_acceleration),
                    angular_velocity: vector(&of.angular_velocity),
                    orientation: [x, y, z, w],
                }
            }
            Some(Measurement::ForceTorque(of)) => {
                Self::ForceTorque { force: vector(&of.force), torque: vector(&of.torque) }
            }
            Some(Measurement::Contact(of)) => Self::Contact {
                touching: of.touching,
                force: vector(&of.force),
                normal_force: of.normal_force,
                partners: of
                    .partners
                    .into_iter()
                    .map(|of| PartnerView {
                        force: vector(&of.force),
                        robot: of.robot,
                        link: of.link,
                        normal_force: of.normal_force,
                        depth: of.depth,
                        points: of.points,
                    })
                    .collect(),
                more_partners: of.more_partners,
            },
            Some(Measurement::Range(of)) => Self::Range { range: Distance(of.range) },
            Some(Measurement::Lidar(of)) => {
                let ranges = of.ranges.into_iter().map(|range| Distance(f64::from(range))).collect();
                Self::Lidar { ranges, columns: of.columns }
            }
            Some(Measurement::LinkState(of)) => {
                let (linear, angular) = motion(&of.twist);
                Self::LinkState { pose: pose(&of.pose), linear, angular }
            }
            Some(Measurement::Encoder(of)) => Self::Encoder { position: of.position, velocity: of.velocity },
            Some(Measurement::Odometry(of)) => {
                let (linear, angular) = motion(&of.twist);
                Self::Odometry { pose: pose(&of.pose), linear, angular }
            }
            None => Self::Unknown {},
        }
    }

    /// Returns it on one line, with units.
    fn in_short(&self) -> String {
        match self {
            Self::Imu { linear_acceleration, angular_velocity, orientation: _ } => {
                format!("{} m/s^2, {} rad/s", several(linear_acceleration, 3), several(angular_velocity, 3))
            }
            Self::ForceTorque { force, torque } => {
                format!("{} N, {} Nm", several(force, 3), several(torque, 3))
            }
            Self::Contact { touching: false, .. } => "touches nothing".to_owned(),
            Self::Contact { normal_force, partners, more_partners, .. } => {
                let names: Vec<String> =
                    partners.iter().map(|partner| format!("{}/{}", partner.robot, partner.link)).collect();
                let more =
                    if *more_partners > 0 { format!(" and {more_partners} more") } else { String::new() };
                format!("{} N from {}{more}", fixed(*normal_force, 3), names.join(", "))
            }
            Self::Range { range } => format!("{} m", fixed(range.0, 3)),
            Self::Lidar { ranges, columns: _ } => {
                let hits = ranges.iter().map(|range| range.0).filter(|range| range.is_finite());
                let nearest = hits.clone().fold(f64::INFINITY, f64::min);
                let near = ranges.iter().filter(|range| range.0 == f64::NEG_INFINITY).count();
                let hits = match hits.count() {
                    0 => "none hit".to_owned(),
                    hits => format!("{hits} hit, the nearest at {} m", fixed(nearest, 3)),
                };
                format!("{}: {hits}; {near} too near", count(ranges.len(), "ray"))
            }
            Self::LinkState { pose, linear, angular } | Self::Odometry { pose, linear, angular } => format!(
                "at {} m, {} m/s, {} rad/s",
                several(&pose.position, 3),
                several(linear, 3),
                several(angular, 3)
            ),
            Self::Encoder { position, velocity } => {
                format!("{} at {} a second", fixed(*position, 4), fixed(*velocity, 4))
            }
            Self::Unknown {} => "of a kind that this simctl does not know".to_owned(),
        }
    }
}

/// Returns a table with a row for each.
pub(super) fn list_readings(views: &[ReadingView]) -> Page {
    let columns = vec![
        Column::left("ROBOT"),
        Column::left("SENSOR"),
        Column::right("TIME [s]"),
        Column::right("SAMPLE"),
        Column::left("MEASUREMENT"),
    ];
    let row = |of: &ReadingView| {
        vec![of.robot.clone(), of.sensor.clone(), of.time(), of.sample.to_string(), of.measurement.in_short()]
    };
    Page::new().table(Table::new(columns, views.iter().map(row).collect()))
}

#[cfg(test)]
mod tests {
    use simd_client::proto::{LidarReading, RangeReading};

    use super::*;

    #[test]
    fn numbers_beyond_json_are_texts() {
        let ranges = vec![1.5, f32::INFINITY, f32::NEG_INFINITY, f32::NAN];
        let view = MeasurementView::new(Some(Measurement::Lidar(LidarReading { ranges, columns: 2 })));
        let json = serde_json::to_string(&view).unwrap();
        assert_eq!(json, r#"{"lidar":{"ranges":[1.5,"inf","-inf","nan"],"columns":2}}"#);
        assert_eq!(view.in_short(), "4 rays: 1 hit, the nearest at 1.500 m; 1 too near");
        let empty = LidarReading { ranges: vec![f32::INFINITY; 2], columns: 2 };
        assert_eq!(
            MeasurementView::new(Some(Measurement::Lidar(empty))).in_short(),
            "2 rays: none hit; 0 too near"
        );
        let nothing = Some(Measurement::Range(RangeReading { range: f64::INFINITY }));
        assert_eq!(MeasurementView::new(nothing).in_short(), "inf m");
    }
}
