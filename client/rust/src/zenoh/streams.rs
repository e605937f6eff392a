//! Calls of many messages. A Zenoh query with many replies would let a slow reader fall behind. So each
//! message is a separate query: a reader that asks again gets the newest message, however long it paused.

use std::collections::VecDeque;
use std::sync::Arc;
use std::time::Duration;

use bytes::Bytes;
use futures_util::stream;
use prost::Message;
use simd_proto::methods::{self, Method};
use simd_proto::v1::{
    ControlRequest, ControlResponse, ControlWait, JointSelection, ListSensorsRequest, ListSensorsResponse,
    NextEventsRequest, NextEventsResponse, NextJointStatesRequest, NextJointStatesResponse,
    NextParametersRequest, NextParametersResponse, NextSensorReadingsRequest, NextSensorReadingsResponse,
    Sensor, SensorCursor, SensorSelection, WatchEventsRequest, WatchEventsResponse, WatchJointStatesRequest,
    WatchJointStatesResponse, WatchParametersResponse, WatchSensorReadingsRequest,
    WatchSensorReadingsResponse,
};
use tokio::task::JoinHandle;
use tokio::time::{Interval, MissedTickBehavior, interval};
use tonic::{Code, Status, Streaming};
use tonic_types::StatusExt as _;
use zenoh::session::ZenohId;

use super::channel::{Answers, Asked, ZenohChannel};

/// Time that the daemon holds a query before it is repeated.
const WAIT: Duration = Duration::from_secs(5);
/// Default rate of states per second, as in the schema.
const DEFAULT_RATE: f64 = 30.0;
/// Default rate of messages with sensor readings per second, as in the schema.
const DEFAULT_READINGS_RATE: f64 = 50.0;

/// Calls a unary method.
async fn ask<R: Message, A: Message + Default>(
    channel: &ZenohChannel,
    method: &'static Method,
    request: &R,
    headers: &Arc<str>,
) -> Result<A, Status> {
    let message = Bytes::from(request.encode_to_vec());
    let answer = channel.ask(method, Asked { message, headers: headers.clone() }).await?;
    A::decode(answer).map_err(|error| Status::internal(format!("the answer is not a message: {error}")))
}

fn method(service: &str, name: &str) -> Result<&'static Method, Status> {
    methods::find(service, name).ok_or_else(|| Status::unimplemented(format!("there is no {service}/{name}")))
}

fn read<R: Message + Default>(message: Bytes) -> Result<R, Status> {
    R::decode(message).map_err(|error| Status::internal(format!("the request is not a message: {error}")))
}

/// Ends the stream without an error if the daemon drains.
fn ended<T>(result: Result<T, Status>) -> Result<Option<T>, Status> {
    match result {
        Ok(answer) => Ok(Some(answer)),
        Err(status) if status.code() == Code::Ok => Ok(None),
        Err(status) => {
            let details = status.get_error_details();
            let reason = details.error_info().map(|info| info.reason.as_str());
            if reason == Some("SHUTTING_DOWN") { Ok(None) } else { Err(status) }
        }
    }
}

/// `WatchJointStates` by `NextJointStates`, at the requested rate.
pub(super) async fn joint_states(
    channel: ZenohChannel,
    watch: &'static Method,
    asked: Asked,
) -> Result<Answers, Status> {
    // The daemon checks the rate and the selections.
    channel.check(watch, asked.clone()).await?;
    let request: WatchJointStatesRequest = read(asked.message)?;
    let rate = if request.rate > 0.0 { request.rate } else { DEFAULT_RATE };
    let mut ticks = interval(Duration::from_secs_f64(1.0 / rate));
    ticks.set_missed_tick_behavior(MissedTickBehavior::Skip);
    let next = method("JointService", "NextJointStates")?;
    let headers = asked.headers;
    let WatchJointStatesRequest { selections, sensors, rate: _ } = request;
    let watcher = StateWatch { channel, next, headers, ticks, selections, sensors, daemon: None, seen: 0 };
    Ok(Box::pin(stream::try_unfold(watcher, StateWatch::next)))
}

struct StateWatch {
    channel: ZenohChannel,
    next: &'static Method,
    headers: Arc<str>,
    ticks: Interval,
    selections: Vec<JointSelection>,
    /// Sensors whose newest readings come with the states.
    sensors: Vec<SensorSelection>,
    /// Session that was asked before.
    daemon: Option<ZenohId>,
    /// Sequence of the last state. It restarts with the daemon.
    seen: u64,
}

impl StateWatch {
    async fn next(mut self) -> Result<Option<(Bytes, Self)>, Status> {
        self.ticks.tick().await;
        loop {
            let daemon = Some(self.channel.daemon().await?);
            if std::mem::replace(&mut self.daemon, daemon) != daemon {
                self.seen = 0;
            }
            let request = NextJointStatesRequest {
                after_sequence: self.seen,
                timeout: WAIT.as_secs_f64(),
                selections: self.selections.clone(),
                sensors: self.sensors.clone(),
                ..NextJointStatesRequest::default()
            };
            let answer = ask(&self.channel, self.next, &request, &self.headers).await;
            let Some(NextJointStatesResponse { states, sensors, .. }) = ended(answer)? else {
                return Ok(None);
            };
            let sequence = states.as_ref().and_then(|states| states.stamp).map_or(0, |stamp| stamp.sequence);
            // A smaller sequence is not older: the daemon was restarted in the meantime.
            if sequence != self.seen {
                self.seen = sequence;
                let answer = WatchJointStatesResponse { states, sensors };
                return Ok(Some((answer.encode_to_vec().into(), self)));
            }
        }
    }
}

/// `WatchEvents` by `NextEvents`, so that unread events are only in the daemon's log.
pub(super) async fn events(channel: ZenohChannel, asked: Asked) -> Result<Answers, Status> {
    let next = method("EventService", "NextEvents")?;
    let WatchEventsRequest { after_sequence } = read(asked.message)?;
    // A sequence in the future returns only the newest sequence.
    let request = NextEventsRequest { after_sequence: u64::MAX, timeout: 0.0 };
    let now: NextEventsResponse = ask(&channel, next, &request, &asked.headers).await?;
    let after = match after_sequence {
        0 => now.last_sequence,
        after => after.min(now.last_sequence),
    };
    let mut watcher =
        EventWatch { channel, next, headers: asked.headers, asking: None, ready: VecDeque::new() };
    watcher.ask(after);
    Ok(Box::pin(stream::try_unfold(watcher, EventWatch::next)))
}

struct EventWatch {
    channel: ZenohChannel,
    next: &'static Method,
    headers: Arc<str>,
    /// The query for the next events. It is sent before the reader needs it, so that a daemon that drains can
    /// end it.
    asking: Option<JoinHandle<Result<NextEventsResponse, Status>>>,
    ready: VecDeque<WatchEventsResponse>,
}

impl EventWatch {
    fn ask(&mut self, after_sequence: u64) {
        let (channel, next, headers) = (self.channel.clone(), self.next, self.headers.clone());
        let request = NextEventsRequest { after_sequence, timeout: WAIT.as_secs_f64() };
        self.asking = Some(tokio::spawn(async move { ask(&channel, next, &request, &headers).await }));
    }

    async fn next(mut self) -> Result<Option<(Bytes, Self)>, Status> {
        loop {
            if let Some(event) = self.ready.pop_front() {
                return Ok(Some((event.encode_to_vec().into(), self)));
            }
            let Some(asking) = self.asking.take() else { return Ok(None) };
            let answer = asking.await.map_err(|error| Status::internal(error.to_string()))?;
            let Some(batch) = ended(answer)? else { return Ok(None) };
            let mut missed = batch.missed;
            let events = batch.events.into_iter();
            self.ready = events
                .map(|event| WatchEventsResponse { event: Some(event), missed: std::mem::take(&mut missed) })
                .collect();
            self.ask(batch.last_sequence);
        }
    }
}

/// `WatchSensorReadings` by `NextSensorReadings`, at the requested rate.
pub(super) async fn sensor_readings(
    channel: ZenohChannel,
    watch: &'static Method,
    asked: Asked,
) -> Result<Answers, Status> {
    // The daemon checks the rate and the selections.
    channel.check(watch, asked.clone()).await?;
    let WatchSensorReadingsRequest { selections, rate } = read(asked.message)?;
    let rate = if rate > 0.0 { rate } else { DEFAULT_READINGS_RATE };
    let mut ticks = interval(Duration::from_secs_f64(1.0 / rate));
    ticks.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let list = method("SensorService", "ListSensors")?;
    let all: ListSensorsResponse =
        ask(&channel, list, &ListSensorsRequest::default(), &asked.headers).await?;
    let is_wanted = |sensor: &Sensor| {
        let of_robot = || selections.iter().filter(|of| of.robot == sensor.robot);
        selections.is_empty()
            || of_robot().any(|of| of.sensors.is_empty() || of.sensors.contains(&sensor.name))
    };
    let wanted = all.sensors.into_iter().filter_map(|info| Some((info.sensor?, info.last_sequence)));
    let wanted = wanted.filter(|(sensor, _)| is_wanted(sensor));
    let cursor = |(of, after_sequence): (Sensor, u64)| SensorCursor {
        robot: of.robot,
        sensor: of.name,
        after_sequence,
    };
    let sensors = wanted.map(cursor).collect();
    let next = method("SensorService", "NextSensorReadings")?;
    let watcher = SensorWatch { channel, next, headers: asked.headers, ticks, sensors };
    Ok(Box::pin(stream::try_unfold(watcher, SensorWatch::next)))
}

struct SensorWatch {
    channel: ZenohChannel,
    next: &'static Method,
    headers: Arc<str>,
    ticks: Interval,
    /// Cursors of the reader. A restarted daemon treats a sequence in the future as none.
    sensors: Vec<SensorCursor>,
}

impl SensorWatch {
    async fn next(mut self) -> Result<Option<(Bytes, Self)>, Status> {
        self.ticks.tick().await;
        loop {
            let (sensors, timeout) = (self.sensors.clone(), WAIT.as_secs_f64());
            let request = NextSensorReadingsRequest { sensors, timeout };
            let answer = ask(&self.channel, self.next, &request, &self.headers).await;
            let Some(NextSensorReadingsResponse { mut sensors }) = ended(answer)? else { return Ok(None) };
            for (cursor, of) in self.sensors.iter_mut().zip(&sensors) {
                cursor.after_sequence = of.after_sequence;
            }
            sensors.retain(|of| !of.readings.is_empty() || of.missed > 0);
            if !sensors.is_empty() {
                return Ok(Some((WatchSensorReadingsResponse { sensors }.encode_to_vec().into(), self)));
            }
        }
    }
}

/// `WatchParameters` by `NextParameters`.
pub(super) async fn parameters(channel: ZenohChannel, asked: Asked) -> Result<Answers, Status> {
    let next = method("ParameterService", "NextParameters")?;
    let watcher = ParameterWatch { channel, next, headers: asked.headers, daemon: None, seen: 0 };
    Ok(Box::pin(stream::try_unfold(watcher, ParameterWatch::next)))
}

struct ParameterWatch {
    channel: ZenohChannel,
    next: &'static Method,
    headers: Arc<str>,
    /// Session that was asked before.
    daemon: Option<ZenohId>,
    /// Version of the last list; 0 for none.
    seen: u64,
}

impl ParameterWatch {
    async fn next(mut self) -> Result<Option<(Bytes, Self)>, Status> {
        loop {
            let daemon = Some(self.channel.daemon().await?);
            if std::mem::replace(&mut self.daemon, daemon) != daemon {
                self.seen = 0;
            }
            let timeout = WAIT.as_secs_f64();
            let request = NextParametersRequest { after_version: self.seen, timeout };
            let answer = ask(&self.channel, self.next, &request, &self.headers).await;
            let Some(NextParametersResponse { list }) = ended(answer)? else { return Ok(None) };
            let version = list.as_ref().map_or(0, |list| list.version);
            if self.seen != version {
                self.seen = version;
                return Ok(Some((WatchParametersResponse { list }.encode_to_vec().into(), self)));
            }
        }
    }
}

/// `Control`: each request is a query. This keeps the state that a gRPC stream keeps in the daemon.
pub(super) fn control(
    channel: ZenohChannel,
    method: &'static Method,
    requests: Streaming<Bytes>,
    headers: Arc<str>,
) -> Answers {
    let (selections, sensors) = (Vec::new(), Vec::new());
    let (daemon, answered) = (None, 0);
    let control = Control { channel, method, requests, headers, selections, sensors, daemon, answered };
    Box::pin(stream::try_unfold(control, Control::next))
}

struct Control {
    channel: ZenohChannel,
    method: &'static Method,
    requests: Streaming<Bytes>,
    headers: Arc<str>,
    selections: Vec<JointSelection>,
    /// Sensors whose newest readings come with the states.
    sensors: Vec<SensorSelection>,
    /// Session that was asked before.
    daemon: Option<ZenohId>,
    /// Sequence of the state in the last answer. It restarts with the daemon.
    answered: u64,
}

impl Control {
    async fn next(mut self) -> Result<Option<(Bytes, Self)>, Status> {
        let Some(message) = self.requests.message().await? else { return Ok(None) };
        let mut request: ControlRequest = read(message)?;
        if request.selections.is_empty() {
            request.selections.clone_from(&self.selections);
        } else {
            self.selections.clone_from(&request.selections);
        }
        if request.sensors.is_empty() {
            request.sensors.clone_from(&self.sensors);
        } else {
            self.sensors.clone_from(&request.sensors);
        }
        let after = request.after_sequence;
        let waits_for_ever = request.wait() != ControlWait::None && request.timeout == 0.0;
        if waits_for_ever {
            // A daemon does not notice that the client is gone, so each wait is bounded.
            request.timeout = WAIT.as_secs_f64();
        }
        loop {
            let daemon = Some(self.channel.daemon().await?);
            if std::mem::replace(&mut self.daemon, daemon) != daemon {
                self.answered = 0;
            }
            request.after_sequence = after.max(self.answered);
            let answer = ask(&self.channel, self.method, &request, &self.headers).await;
            let Some(answer): Option<ControlResponse> = ended(answer)? else { return Ok(None) };
            let states = answer.states.as_ref();
            let sequence = states.and_then(|states| states.stamp).map_or(0, |stamp| stamp.sequence);
            // A smaller sequence than before is not older: the daemon was restarted in the meantime.
            let is_old = (self.answered..=request.after_sequence).contains(&sequence);
            if waits_for_ever && answer.refusal.is_none() && is_old {
                // The targets hold, but the state has not changed since.
                request.robots.clear();
                continue;
            }
            if states.is_some() {
                self.answered = sequence;
            }
            return Ok(Some((answer.encode_to_vec().into(), self)));
        }
    }
}
