//! The sensor service: sensors and their readings.

use crate::service::status::OrStatus as _;
use std::time::Duration;

use futures_util::stream;
use simd_core::{Command, Error, Reply};
use simd_proto::v1::{self, sensor_service_server::SensorService};
use tokio::time::{Interval, MissedTickBehavior, interval};
use tonic::{Request, Response, Status};

use super::once::once;
use super::{BoxStream, mismatched};
use crate::convert::from_proto::sensor as from_proto;
use crate::convert::to_proto::{sensor as to_proto, stamp};
use simd_world::SimHandle;
use simd_world::handle::{CallError, MAX_WATCHED_SENSORS, SensorCursor, SensorReadings};

/// Longest wait of one look for readings; a watcher does not notice it.
const WAIT: Duration = Duration::from_secs(60);

/// Serves `simd.v1.SensorService`.
#[derive(Clone, Debug)]
pub struct Service {
    handle: SimHandle,
}

impl Service {
    /// Serves the world of a handle.
    pub fn new(handle: SimHandle) -> Self {
        Self { handle }
    }
}

#[tonic::async_trait]
impl SensorService for Service {
    async fn create_sensor(
        &self,
        request: Request<v1::CreateSensorRequest>,
    ) -> Result<Response<v1::CreateSensorResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let create = from_proto::create(request)?;
            let done =
                handle.command(Command::CreateSensor(Box::new(create))).await.map_err(within_sensor)?;
            let stamp = Some(stamp::done(&done));
            match done.applied.reply {
                Reply::SensorCreated { name } => Ok(v1::CreateSensorResponse { name, stamp }),
                other => Err(mismatched(&other).into()),
            }
        })
        .await
    }

    async fn delete_sensor(
        &self,
        request: Request<v1::DeleteSensorRequest>,
    ) -> Result<Response<v1::DeleteSensorResponse>, Status> {
        once(&self.handle, request, |handle, request| async move {
            let (robot, name) = from_proto::delete(request)?;
            let done = handle.command(Command::DeleteSensor { robot, name }).await?;
            Ok(v1::DeleteSensorResponse { stamp: Some(stamp::done(&done)) })
        })
        .await
    }

    async fn list_sensors(
        &self,
        request: Request<v1::ListSensorsRequest>,
    ) -> Result<Response<v1::ListSensorsResponse>, Status> {
        let robot = from_proto::only(request.into_inner())?;
        let (state, sensors) = self.handle.sensors(robot.as_deref()).or_status()?;
        let sensors = sensors.iter().map(|(sensor, last)| to_proto::info(&state, sensor, *last)).collect();
        Ok(Response::new(v1::ListSensorsResponse { stamp: Some(stamp::published(&state)), sensors }))
    }

    async fn get_sensor_readings(
        &self,
        request: Request<v1::GetSensorReadingsRequest>,
    ) -> Result<Response<v1::GetSensorReadingsResponse>, Status> {
        let (selections, timeout) = from_proto::newest(request.into_inner())?;
        let (state, readings) = self.handle.newest_readings(&selections, timeout).await.or_status()?;
        let sensors = readings.into_iter().map(to_proto::readings).collect();
        Ok(Response::new(v1::GetSensorReadingsResponse { stamp: Some(stamp::published(&state)), sensors }))
    }

    async fn next_sensor_readings(
        &self,
        request: Request<v1::NextSensorReadingsRequest>,
    ) -> Result<Response<v1::NextSensorReadingsResponse>, Status> {
        let (cursors, timeout) = from_proto::next(request.into_inner())?;
        let readings = self.handle.next_readings(&cursors, timeout).await.or_status()?;
        let sensors = readings.into_iter().map(to_proto::readings).collect();
        Ok(Response::new(v1::NextSensorReadingsResponse { sensors }))
    }

    type WatchSensorReadingsStream = BoxStream<v1::WatchSensorReadingsResponse>;

    async fn watch_sensor_readings(
        &self,
        request: Request<v1::WatchSensorReadingsRequest>,
    ) -> Result<Response<Self::WatchSensorReadingsStream>, Status> {
        let (selections, period) = from_proto::watch(request.into_inner())?;
        let cursors = self.handle.sensor_cursors(&selections).or_status()?;
        if cursors.is_empty() {
            let (element, value) = ("selections".into(), "of no sensor".into());
            let expected = "there must be a sensor to watch".into();
            return Err(CallError::InvalidValue { element, value, expected }).or_status();
        }
        if cursors.len() > MAX_WATCHED_SENSORS {
            let what = "sensors that are watched".to_owned();
            let (value, limit) = (cursors.len() as u64, MAX_WATCHED_SENSORS as u64);
            return Err(CallError::LimitExceeded { what, value, limit }).or_status();
        }
        let mut ticks = interval(period);
        ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
        let watcher = Watcher { handle: self.handle.clone(), cursors, ticks };
        Ok(Response::new(Box::pin(stream::try_unfold(watcher, Watcher::next))))
    }
}

/// Renames a field of the command to its field in the request's `sensor`.
fn within_sensor(error: CallError) -> CallError {
    match error {
        CallError::World(Error::InvalidValue { element, of, value, expected }) => {
            let element = format!("sensor.{element}");
            CallError::World(Error::InvalidValue { element, of, value, expected })
        }
        other => other,
    }
}

/// A watcher. Readings are fetched when the network asks for the next message, so unread readings of a slow
/// reader are only in the daemon's log.
struct Watcher {
    handle: SimHandle,
    cursors: Vec<SensorCursor>,
    ticks: Interval,
}

impl Watcher {
    async fn next(mut self) -> Result<Option<(v1::WatchSensorReadingsResponse, Self)>, Status> {
        let draining = self.handle.draining();
        if draining.run_until_cancelled(self.ticks.tick()).await.is_none() {
            return Ok(None);
        }
        loop {
            let readings = match self.handle.next_readings(&self.cursors, WAIT).await {
                Ok(readings) => readings,
                Err(CallError::ShuttingDown) => return Ok(None),
                Err(error) => return Err(error).or_status(),
            };
            self.cursors = readings.iter().map(SensorReadings::cursor).collect();
            let news = readings.into_iter().filter(|of| of.batch.is_news());
            let sensors: Vec<v1::SensorReadings> = news.map(to_proto::readings).collect();
            if !sensors.is_empty() {
                return Ok(Some((v1::WatchSensorReadingsResponse { sensors }, self)));
            }
        }
    }
}
