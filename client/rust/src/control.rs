//! The stream of controllers: each request is one credit, each gets one answer.

use std::time::Duration;

use simd_proto::v1::{
    ClampedTarget, ControlRequest, ControlResponse, ControlWait, JointSelection, JointStates, JointTarget,
    LimitPolicy, RobotTargets, SensorReadings, SensorSelection,
};
use tokio::sync::mpsc;
use tokio_stream::wrappers::ReceiverStream;
use tonic::Streaming;

use crate::{Client, Error, Refusal, client::present, target::robot_targets};

/// What holds for all requests of one stream.
#[derive(Clone, Debug, Default)]
pub struct ControlOptions {
    /// What to be answered with; all joints of all robots where it is empty.
    pub selections: Vec<JointSelection>,
    /// Whose newest readings answers have; none where it is empty.
    pub sensors: Vec<SensorSelection>,
    /// Whether an answer waits for a newer state.
    pub wait: ControlWait,
    /// How long it waits, in wall time; `None` as long as it takes.
    pub timeout: Option<Duration>,
    /// What to do with a target beyond a limit.
    pub limit_policy: LimitPolicy,
    /// From [`Client::claim_joints`]; empty for that of the client.
    pub claim: String,
}

/// The answer to one request.
#[derive(Clone, Debug)]
pub struct ControlReply {
    /// The newest state. A refusal has none while a selected robot or joint is not there.
    pub states: Option<JointStates>,
    /// Targets that were beyond a limit.
    pub clamped: Vec<ClampedTarget>,
    /// The newest reading of each sensor that was asked for.
    pub sensors: Vec<SensorReadings>,
    /// Why the targets were refused; then none of them holds, and the stream goes on.
    pub refusal: Option<Refusal>,
}

impl ControlReply {
    /// The states, where the targets were taken.
    ///
    /// # Errors
    /// [`Error::Refused`] where they were not.
    pub fn accepted(self) -> Result<JointStates, Error> {
        match self.refusal {
            None => present(self.states, "states"),
            Some(refusal) => Err(Error::Refused(refusal)),
        }
    }
}

/// A stream on which one request is under way at a time, so that its reader is
/// never behind: send targets, read the newest state, and so on.
///
/// Dropping it closes the stream; targets stay in force.
#[derive(Debug)]
pub struct Control {
    client: Client,
    requests: mpsc::Sender<ControlRequest>,
    answers: Streaming<ControlResponse>,
    options: ControlOptions,
    /// A request has no answer yet.
    is_waiting: bool,
}

impl Client {
    /// Opens a stream for a controller.
    ///
    /// # Errors
    /// Returns an error if the daemon refuses or does not answer.
    pub async fn control(&self, options: ControlOptions) -> Result<Control, Error> {
        // One credit is under way at a time, so that one place is enough.
        let (requests, receiver) = mpsc::channel(1);
        let answers = self.unary(self.joint().control(ReceiverStream::new(receiver))).await?;
        Ok(Control { client: self.clone(), requests, answers, options, is_waiting: false })
    }
}

impl Control {
    /// Sends targets for joints of one robot; [`next`](Self::next) reads the answer.
    ///
    /// # Errors
    /// [`Error::CreditInUse`] before the last answer was read, or where the stream ended.
    pub fn send(&mut self, robot: &str, targets: impl IntoIterator<Item = JointTarget>) -> Result<(), Error> {
        self.send_all(vec![robot_targets(robot, targets)])
    }

    /// Sends targets for several robots, to hold from the same step; or none, to
    /// ask for a state and nothing else.
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
        // Full cannot be: the answer before was read, so the request before was taken.
        self.requests.try_send(request).map_err(|_| self.ended())?;
        self.is_waiting = true;
        Ok(())
    }

    /// The answer to the last request. Where none is under way, sends one that
    /// holds no targets. Dropping the future loses nothing: the next call goes on.
    ///
    /// # Errors
    /// Returns an error if the stream ended or the connection broke. Refused targets are no
    /// error: see [`ControlReply::refusal`].
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
            // The daemon has them and keeps them.
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
