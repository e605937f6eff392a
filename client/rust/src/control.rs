//! The stream for controllers: each request is one credit, and each gets one answer.

use std::time::Duration;

use simd_proto::v1::{
    ClampedTarget, ControlRequest, ControlResponse, ControlWait, JointSelection, JointStates, JointTarget,
    LimitPolicy, RobotTargets, SensorReadings, SensorSelection,
};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::Streaming;

use crate::{Client, Error, Refusal, client::present, target::robot_targets};

/// Options that hold for all requests of one stream.
#[derive(Clone, Debug, Default)]
pub struct ControlOptions {
    /// Joints to return; empty: all joints of all robots.
    pub selections: Vec<JointSelection>,
    /// Sensors whose newest readings the answers have; empty: none.
    pub sensors: Vec<SensorSelection>,
    /// Whether an answer waits for a newer state.
    pub wait: ControlWait,
    /// Longest wait in wall time; `None`: no limit.
    pub timeout: Option<Duration>,
    /// Handling of a target beyond a limit.
    pub limit_policy: LimitPolicy,
    /// Claim from [`Client::claim_joints`]; empty: the claim of the client.
    pub claim: String,
}

/// The answer to one request.
#[derive(Clone, Debug)]
pub struct ControlReply {
    /// The newest state. Absent in a refusal if a selected robot or joint does not exist.
    pub states: Option<JointStates>,
    /// Targets beyond a limit.
    pub clamped: Vec<ClampedTarget>,
    /// Newest reading of each requested sensor.
    pub sensors: Vec<SensorReadings>,
    /// Reason why the targets were refused: none of them holds, but the stream continues.
    pub refusal: Option<Refusal>,
}

impl ControlReply {
    /// Returns the states, if the targets were accepted.
    ///
    /// # Errors
    /// [`Error::Refused`] if the targets were refused.
    pub fn accepted(self) -> Result<JointStates, Error> {
        match self.refusal {
            None => present(self.states, "states"),
            Some(refusal) => Err(Error::Refused(refusal)),
        }
    }
}

/// A stream with at most one pending request, so that its reader is never behind: send targets, read the
/// newest state, and repeat.
///
/// Dropping it closes the stream; targets stay in force.
#[derive(Debug)]
pub struct Control {
    client: Client,
    requests: mpsc::Sender<ControlRequest>,
    answers: Streaming<ControlResponse>,
    options: ControlOptions,
    /// Whether a request has no answer yet.
    is_waiting: bool,
}

impl Client {
    /// Opens a stream for a controller.
    ///
    /// # Errors
    /// Returns an error if the daemon refuses or does not answer.
    pub async fn control(&self, options: ControlOptions) -> Result<Control, Error> {
        // At most one credit is pending, so one place is enough.
        let (requests, receiver) = mpsc::channel(1);
        let answers = self.unary(self.joint().control(ReceiverStream::new(receiver))).await?;
        Ok(Control { client: self.clone(), requests, answers, options, is_waiting: false })
    }
}

impl Control {
    /// Sends targets for joints of one robot; [`next`](Self::next) reads the answer.
    ///
    /// # Errors
    /// [`Error::CreditInUse`] before the last answer was read, or if the stream ended.
    pub fn send(&mut self, robot: &str, targets: impl IntoIterator<Item = JointTarget>) -> Result<(), Error> {
        self.send_all(vec![robot_targets(robot, targets)])
    }

    /// Sends targets for several robots, which hold from the same step; or none, to ask only for a state.
    ///
    /// # Errors
    /// As [`send`](Self::send).
    pub fn send_all(&mut self, robots: Vec<RobotTargets>) -> Result<(), Error> {
        if self.is_waiting {
            return Err(Error::CreditInUse);
        }
        let request = self.client.claimed(ControlRequest {
            selections: self.options.selections.clone(),
            sensors: self.options.sensors.clone(),
            robots,
            limit_policy: self.options.limit_policy.into(),
            claim: self.options.claim.clone(),
            wait: self.options.wait.into(),
            timeout: self.options.timeout.map_or(0.0, |timeout| timeout.as_secs_f64()),
            ..ControlRequest::default()
        });
        // The queue cannot be full: the last answer was read, so its request was taken.
        self.requests.try_send(request).map_err(|_| self.ended())?;
        self.is_waiting = true;
        Ok(())
    }

    /// Returns the answer to the last request. If none is pending, sends one without targets. Dropping the
    /// future loses nothing: the next call continues.
    ///
    /// # Errors
    /// Returns an error if the stream ended or the connection broke. Refused targets are not an error: see
    /// [`ControlReply::refusal`].
    pub async fn next(&mut self) -> Result<ControlReply, Error> {
        if !self.is_waiting {
            self.send_all(Vec::new())?;
        }
        let answer = match self.answers.message().await {
            Ok(Some(answer)) => answer,
            Ok(None) => return Err(self.ended()),
            Err(status) => return Err(Error::from_status(&status, self.client.endpoint())),
        };
        self.is_waiting = false;
        let refusal = answer.refusal.map(Refusal::from);
        let states = match refusal {
            None => Some(present(answer.states, "states")?),
            Some(_) => answer.states,
        };
        if refusal.is_none() {
            // The daemon has received them and keeps them.
            self.options.selections.clear();
            self.options.sensors.clear();
        }
        Ok(ControlReply { states, clamped: answer.clamped, sensors: answer.sensors, refusal })
    }

    /// Sends targets for joints of one robot and waits for the answer.
    ///
    /// # Errors
    /// As [`send`](Self::send) and [`next`](Self::next).
    pub async fn exchange(
        &mut self,
        robot: &str,
        targets: impl IntoIterator<Item = JointTarget>,
    ) -> Result<ControlReply, Error> {
        self.send(robot, targets)?;
        self.next().await
    }

    fn ended(&self) -> Error {
        Error::StreamEnded { endpoint: self.client.endpoint().to_owned() }
    }
}
