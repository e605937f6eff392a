//! Sensors and their readings.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use simd_core::Error;
use simd_core::simulation::sensors::WorldSensor;

use super::{CallError, Published, SimHandle};
use crate::driver::ReadingBatch;

/// Maximum bytes of the newest readings in one answer.
const MAX_NEWEST_BYTES: u64 = 32 << 20;
/// Maximum bytes of following readings in one answer, shared equally by the sensors.
const MAX_NEXT_BYTES: usize = 4 << 20;
/// Maximum number of sensors that one call follows.
pub const MAX_WATCHED_SENSORS: usize = 64;

/// Sensors of a robot; an empty list means all of them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SensorSelection {
    /// Name of the robot.
    pub robot: String,
    /// Names of the sensors.
    pub sensors: Vec<String>,
}

/// Position of a caller in a sensor's readings.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SensorCursor {
    /// Name of the robot.
    pub robot: String,
    /// Name of the sensor.
    pub sensor: String,
    /// Number of the last reading before the wanted ones.
    pub after: u64,
}

/// Readings of one sensor.
#[derive(Clone, Debug, PartialEq)]
pub struct SensorReadings {
    /// Name of the robot.
    pub robot: String,
    /// Name of the sensor.
    pub sensor: String,
    /// Readings.
    pub batch: ReadingBatch,
}

impl SensorReadings {
    /// Returns the position after these readings.
    pub fn cursor(&self) -> SensorCursor {
        SensorCursor { robot: self.robot.clone(), sensor: self.sensor.clone(), after: self.batch.after }
    }
}

/// A sensor, and the number of its newest reading.
pub type NumberedSensor = (WorldSensor, u64);

impl SimHandle {
    /// Returns the sensors of a robot, or of all, and the number of the newest reading of each.
    ///
    /// # Errors
    /// Returns an error if the robot does not exist.
    pub fn sensors(&self, robot: Option<&str>) -> Result<(Arc<Published>, Vec<NumberedSensor>), CallError> {
        let state = self.newest();
        let only = robot.map(|robot| robot_index(&state, robot)).transpose()?;
        let found = only.map_or(state.state.sensors.as_slice(), |robot| of_robot(&state, robot)).to_vec();
        let last = self.inner.driver.sensors.last_sequences(found.iter().map(|of| of.id));
        Ok((state, found.into_iter().zip(last).collect()))
    }

    /// Returns the number of the newest reading of each sensor, by its id.
    pub fn last_readings(&self) -> BTreeMap<u64, u64> {
        let state = self.newest();
        let ids = || state.state.sensors.iter().map(|of| of.id);
        ids().zip(self.inner.driver.sensors.last_sequences(ids())).collect()
    }

    /// Returns positions after the present readings of these sensors; no selection means all sensors.
    ///
    /// # Errors
    /// Returns an error if a robot or sensor does not exist.
    pub fn sensor_cursors(&self, selections: &[SensorSelection]) -> Result<Vec<SensorCursor>, CallError> {
        let state = self.newest();
        let chosen = chosen(&state, selections)?;
        let last = self.inner.driver.sensors.last_sequences(chosen.iter().map(|of| of.id));
        let cursor = |(of, after): (&WorldSensor, u64)| SensorCursor {
            robot: robot_name(&state, of),
            sensor: of.definition.name.clone(),
            after,
        };
        Ok(chosen.into_iter().zip(last).map(cursor).collect())
    }

    /// Returns the newest reading of each of these sensors; no selection means all sensors. Waits at most
    /// `timeout` for pending scans of the newest state or an earlier one.
    ///
    /// # Errors
    /// Returns an error if a robot or sensor does not exist, the readings are too large in total, or the
    /// daemon drains.
    pub async fn newest_readings(
        &self,
        selections: &[SensorSelection],
        timeout: Duration,
    ) -> Result<(Arc<Published>, Vec<SensorReadings>), CallError> {
        let log = &self.inner.driver.sensors;
        let state = self.newest();
        let chosen = chosen(&state, selections)?;
        let due = log.scans_due(chosen.iter().map(|of| of.id));
        let measured = async {
            loop {
                let grown = log.grown();
                if log.are_measured(&due) {
                    return;
                }
                grown.await;
            }
        };
        // After that time, the newest available ones are returned.
        if let Ok(ended) = tokio::time::timeout(timeout, self.until_drained(measured)).await {
            ended?;
        }
        let readings = self.newest_of(&state, chosen, MAX_NEWEST_BYTES)?;
        Ok((state, readings))
    }

    /// Returns the newest available reading of each of these sensors, to accompany a state; no selection
    /// means no sensors.
    ///
    /// # Errors
    /// Returns an error if a robot or sensor does not exist, or the readings are too large in total.
    pub fn readings_beside(&self, selections: &[SensorSelection]) -> Result<Vec<SensorReadings>, CallError> {
        if selections.is_empty() {
            return Ok(Vec::new());
        }
        let state = self.newest();
        let chosen = chosen(&state, selections)?;
        self.newest_of(&state, chosen, MAX_NEXT_BYTES as u64)
    }

    fn newest_of(
        &self,
        state: &Published,
        chosen: Vec<&WorldSensor>,
        limit: u64,
    ) -> Result<Vec<SensorReadings>, CallError> {
        let batches = self.inner.driver.sensors.newest(chosen.iter().map(|of| of.id));
        let bytes: usize =
            batches.iter().flat_map(|batch| &batch.readings).map(|reading| reading.bytes()).sum();
        let value = bytes as u64;
        if value > limit {
            let what = "bytes of readings in one answer (ask for fewer sensors)".to_owned();
            return Err(CallError::LimitExceeded { what, value, limit });
        }
        let named = |(of, batch): (&WorldSensor, ReadingBatch)| SensorReadings {
            robot: robot_name(state, of),
            sensor: of.definition.name.clone(),
            batch,
        };
        Ok(chosen.into_iter().zip(batches).map(named).collect())
    }

    /// Returns the readings of each of these sensors after a number, waiting at most `timeout` for the first.
    ///
    /// # Errors
    /// Returns an error if a robot or sensor does not exist (any more), or the daemon drains before a reading
    /// arrives.
    pub async fn next_readings(
        &self,
        cursors: &[SensorCursor],
        timeout: Duration,
    ) -> Result<Vec<SensorReadings>, CallError> {
        let wait = async {
            loop {
                let grown = self.inner.driver.sensors.grown();
                let readings = self.readings_after(cursors)?;
                if readings.iter().any(|of| of.batch.is_news()) {
                    return Ok(readings);
                }
                grown.await;
            }
        };
        match tokio::time::timeout(timeout, self.until_drained(wait)).await {
            Ok(readings) => readings?,
            Err(_elapsed) => self.readings_after(cursors),
        }
    }

    /// Returns the readings of each of these sensors after a number, at once.
    ///
    /// # Errors
    /// Returns an error if a robot or sensor does not exist.
    pub fn readings_after(&self, cursors: &[SensorCursor]) -> Result<Vec<SensorReadings>, CallError> {
        let state = self.newest();
        let wanted = cursors
            .iter()
            .map(|cursor| {
                Ok((find(&state, robot_index(&state, &cursor.robot)?, &cursor.sensor)?.id, cursor.after))
            })
            .collect::<Result<Vec<_>, CallError>>()?;
        let batches = self.inner.driver.sensors.after(&wanted, MAX_NEXT_BYTES);
        let named = |(cursor, batch): (&SensorCursor, ReadingBatch)| SensorReadings {
            robot: cursor.robot.clone(),
            sensor: cursor.sensor.clone(),
            batch,
        };
        Ok(cursors.iter().zip(batches).map(named).collect())
    }

    /// Measures samples that take long, on threads of low priority, until the daemon drains.
    pub async fn measure_scans(self) {
        let processors = std::thread::available_parallelism().map_or(1, usize::from);
        // Half of the processors, as for calls that compute.
        let measuring = (0..(processors / 2).max(1)).map(|_| self.clone().measure_one_by_one());
        futures_util::future::join_all(measuring).await;
    }

    async fn measure_one_by_one(self) {
        let draining = self.draining();
        let log = &self.inner.driver.sensors;
        while let Some(mut scan) = draining.run_until_cancelled(log.next_scan()).await {
            let cancelled = draining.clone();
            let measure = move || {
                scan.measure(&|| cancelled.is_cancelled());
                scan
            };
            match self.loader().threads().run(measure).await {
                // Dropped here: on a busy machine those threads may stop for long, and readers would wait for
                // the log.
                Ok(measured) => drop(measured),
                Err(error) => tracing::error!(%error, "a scan is not measured"),
            }
        }
    }
}

/// Returns the sensors of selections, each once; without selections, all.
fn chosen<'a>(
    state: &'a Published,
    selections: &[SensorSelection],
) -> Result<Vec<&'a WorldSensor>, CallError> {
    if selections.is_empty() {
        return Ok(state.state.sensors.iter().collect());
    }
    let mut found = Vec::new();
    for SensorSelection { robot, sensors } in selections {
        let robot = robot_index(state, robot)?;
        if sensors.is_empty() {
            found.extend(of_robot(state, robot));
        }
        for sensor in sensors {
            found.push(find(state, robot, sensor)?);
        }
    }
    Ok(found)
}

/// Returns the index of a robot.
fn robot_index(state: &Published, robot: &str) -> Result<usize, CallError> {
    let found = state.state.entity(robot).map(|(index, _)| index);
    found.ok_or_else(|| {
        let known = state.state.world.entities.iter().map(|entity| entity.name.clone()).collect();
        Error::RobotNotFound { robot: robot.to_owned(), known }.into()
    })
}

fn find<'a>(state: &'a Published, robot: usize, sensor: &str) -> Result<&'a WorldSensor, CallError> {
    let sensors = of_robot(state, robot);
    sensors.iter().find(|of| of.definition.name == sensor).ok_or_else(|| {
        let known = sensors.iter().map(|of| of.definition.name.clone()).collect();
        let robot = state.state.world.entities.get(robot);
        let robot = robot.map(|entity| entity.name.clone()).unwrap_or_default();
        Error::SensorNotFound { robot, sensor: sensor.to_owned(), known }.into()
    })
}

/// Returns the sensors of the robot at an index. They are ordered by robot, so that other robots' are not
/// searched.
fn of_robot(state: &Published, robot: usize) -> &[WorldSensor] {
    let sensors = state.state.sensors.as_slice();
    let first = sensors.partition_point(|of| of.robot < robot);
    let end = sensors.partition_point(|of| of.robot <= robot);
    sensors.get(first..end).unwrap_or_default()
}

fn robot_name(state: &Published, sensor: &WorldSensor) -> String {
    state.state.world.entities.get(sensor.robot).map(|entity| entity.name.clone()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::time::SystemTime;

    use glamx::DPose3;
    use simd_core::simulation::sensors::SensorDefinition;
    use simd_core::{PhysicsSettings, PublishedState};
    use simd_model::sensor::{SensorKind, SensorMount};

    use super::*;
    use crate::handle::{Pace, RunState, Statistics};

    /// Returns a state whose sensors are numbered from 1 and named accordingly, on the robots at these
    /// indices.
    fn with_sensors(robots: &[usize]) -> Published {
        let definition = |id: u64| SensorDefinition {
            name: format!("imu_{id}"),
            on: SensorMount::Link(0),
            link: 0,
            pose: DPose3::IDENTITY,
            rate: None,
            kind: SensorKind::Imu,
            noise: Vec::new(),
            seed: 0,
            is_described: false,
        };
        let sensors = (1..).zip(robots).map(|(id, robot)| WorldSensor {
            id,
            robot: *robot,
            definition: Arc::new(definition(id)),
        });
        Published {
            sequence: 1,
            wall_time: SystemTime::UNIX_EPOCH,
            state: PublishedState { sensors: Arc::new(sensors.collect()), ..PublishedState::default() },
            physics: PhysicsSettings::default(),
            statistics: Statistics::at_start(RunState::Paused, Pace::default()),
        }
    }

    #[test]
    fn the_sensors_of_a_robot_are_its_own_in_their_order() {
        let state = with_sensors(&[0, 0, 2, 5, 5, 5]);
        let ids = |robot: usize| of_robot(&state, robot).iter().map(|of| of.id).collect::<Vec<u64>>();
        assert_eq!([ids(0), ids(2), ids(5)], [vec![1, 2], vec![3], vec![4, 5, 6]]);
        assert!([1, 3, 6].into_iter().all(|robot| ids(robot).is_empty()));
        assert!(of_robot(&with_sensors(&[]), 0).is_empty());
    }

    #[test]
    fn a_sensor_of_another_robot_is_not_found() {
        let state = with_sensors(&[0, 0, 2, 5]);
        assert_eq!(find(&state, 0, "imu_2").unwrap().id, 2);
        let refused = find(&state, 2, "imu_2").unwrap_err();
        let CallError::World(Error::SensorNotFound { known, .. }) = refused else { panic!() };
        assert_eq!(known, ["imu_3"]);
    }
}
