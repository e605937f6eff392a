//! Sensors of robots, and their readings.

use std::time::Duration;

use simd_proto::v1::{
    CreateSensorRequest, DeleteSensorRequest, GetSensorReadingsRequest, ListSensorsRequest,
    NextSensorReadingsRequest, Sensor, SensorCursor, SensorInfo, SensorReadings, SensorSelection, Stamp,
    WatchSensorReadingsRequest, WatchSensorReadingsResponse,
};
use tonic::Streaming;

use crate::{Client, Error, client::present};

/// Selects all sensors of a robot.
pub fn every_sensor(robot: &str) -> SensorSelection {
    SensorSelection { robot: robot.to_owned(), sensors: Vec::new() }
}

/// Selects some sensors of a robot, in this order.
pub fn some_sensors(robot: &str, sensors: impl IntoIterator<Item = impl Into<String>>) -> SensorSelection {
    SensorSelection { robot: robot.to_owned(), sensors: sensors.into_iter().map(Into::into).collect() }
}

/// `SensorService`.
impl Client {
    /// Adds a sensor to a robot. Returns the sensor's name.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `LINK_NOT_FOUND`, `JOINT_NOT_FOUND`, `SENSOR_EXISTS`, `INVALID_VALUE`, `LIMIT_EXCEEDED`,
    /// `ROBOT_CLAIMED`.
    pub async fn create_sensor(&self, sensor: Sensor) -> Result<String, Error> {
        let request = CreateSensorRequest { sensor: Some(sensor), ..Default::default() };
        Ok(self.unary(self.sensor().create_sensor(self.claimed(request))).await?.name)
    }

    /// Deletes a sensor.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `SENSOR_NOT_FOUND`, `ROBOT_CLAIMED`.
    pub async fn delete_sensor(&self, robot: &str, name: &str) -> Result<Stamp, Error> {
        let (robot, name) = (robot.to_owned(), name.to_owned());
        let request = DeleteSensorRequest { robot, name, ..Default::default() };
        present(self.unary(self.sensor().delete_sensor(self.claimed(request))).await?.stamp, "stamp")
    }

    /// Returns the sensors of a robot, or of all robots if none is named.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`.
    pub async fn sensors(&self, robot: Option<&str>) -> Result<Vec<SensorInfo>, Error> {
        let request = ListSensorsRequest { robot: robot.unwrap_or_default().to_owned() };
        Ok(self.unary(self.sensor().list_sensors(request)).await?.sensors)
    }

    /// Returns the newest reading of each of these sensors; without a selection, of all sensors. Waits for
    /// scans that are due.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `SENSOR_NOT_FOUND`, `LIMIT_EXCEEDED`.
    pub async fn sensor_readings(
        &self,
        selections: Vec<SensorSelection>,
    ) -> Result<Vec<SensorReadings>, Error> {
        let request = GetSensorReadingsRequest { selections, timeout: 0.0 };
        Ok(self.unary(self.sensor().get_sensor_readings(request)).await?.sensors)
    }

    /// Returns the readings after the caller's cursors, waiting at most `wait` (up to 60 s) for the first.
    /// One entry for each of `sensors`, in that order.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `SENSOR_NOT_FOUND`, `INVALID_VALUE`.
    pub async fn next_sensor_readings(
        &self,
        sensors: Vec<SensorCursor>,
        wait: Duration,
    ) -> Result<Vec<SensorReadings>, Error> {
        let request = NextSensorReadingsRequest { sensors, timeout: wait.as_secs_f64() };
        Ok(self.unary_for(wait, self.sensor().next_sensor_readings(request)).await?.sensors)
    }

    /// Streams readings from now on, at a rate of messages per wall second; 0 is the daemon's default.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `SENSOR_NOT_FOUND`, `INVALID_VALUE`, `LIMIT_EXCEEDED`.
    pub async fn watch_sensors(
        &self,
        selections: Vec<SensorSelection>,
        rate: f64,
    ) -> Result<SensorWatch, Error> {
        let request = WatchSensorReadingsRequest { selections, rate };
        let readings = self.unary(self.sensor().watch_sensor_readings(request)).await?;
        Ok(SensorWatch { client: self.clone(), readings })
    }
}

/// A stream of readings.
#[derive(Debug)]
pub struct SensorWatch {
    client: Client,
    readings: Streaming<WatchSensorReadingsResponse>,
}

impl SensorWatch {
    /// Returns the readings since the last message, of the sensors that have some; `None` if the daemon ended
    /// the stream normally.
    ///
    /// # Errors
    /// Returns an error if a sensor was deleted, or the connection broke.
    pub async fn next(&mut self) -> Result<Option<Vec<SensorReadings>>, Error> {
        match self.readings.message().await {
            Ok(Some(answer)) => Ok(Some(answer.sensors)),
            Ok(None) => Ok(None),
            Err(status) => Err(Error::from_status(&status, self.client.endpoint())),
        }
    }
}
