//! A step whose request is kept. A loop sets one number for each of the same joints in each turn. It gives these numbers
//! alone, and gets joint states as numbers. So nothing is encoded or decoded.

use std::time::Duration;

use simd_api::service::transport::with_reason;
use simd_api::service::version;
use simd_proto::checked;
use simd_proto::v1;
use simd_proto::v1::joint_target::Target;
use tonic::Status;

use super::Embedded;

/// A request for steps with targets, which is made again with other numbers.
#[derive(Clone, Debug)]
pub struct KeptStep {
    request: v1::StepSimulationRequest,
}

impl KeptStep {
    /// How many numbers a turn has: one a target.
    pub fn count(&self) -> usize {
        self.request.robots.iter().map(|robot| robot.joints.len()).sum()
    }

    /// Gives the targets other numbers, in the order of the request: a position's, a servo's, a velocity's or an effort's own number. Those
    /// that have none keep what they have.
    fn set(&mut self, numbers: &[f64]) {
        let joints = self.request.robots.iter_mut().flat_map(|robot| &mut robot.joints);
        for (joint, number) in joints.zip(numbers) {
            match &mut joint.target {
                Some(Target::Position(target)) => target.position = *number,
                Some(Target::Servo(target)) => target.position = *number,
                Some(Target::Velocity(target)) => target.velocity = *number,
                Some(Target::Effort(target)) => target.effort = *number,
                _ => {}
            }
        }
    }
}

impl Embedded {
    /// Keeps a request.
    ///
    /// # Errors
    /// Returns an error if these bytes are not a `StepSimulationRequest`, or the caller's version is not served.
    pub fn keep_step(&self, request: &[u8]) -> Result<KeptStep, Status> {
        version::check(self.said.as_ref()).map_err(with_reason)?;
        let request = checked::decode::<v1::StepSimulationRequest>(request);
        let request = request.map_err(|error| with_reason(Status::invalid_argument(error.to_string())))?;
        Ok(KeptStep { request })
    }

    /// Makes a kept step with these numbers, or with its last ones if there are none, and waits as [`call`](Self::call) does.
    ///
    /// # Errors
    /// Those of `StepSimulation`, and of [`call`](Self::call).
    pub fn step_kept(
        &self,
        kept: &mut KeptStep,
        numbers: &[f64],
        time_limit: Duration,
        goes_on: impl FnMut() -> bool,
    ) -> Result<v1::StepSimulationResponse, Status> {
        let count = kept.count();
        if !numbers.is_empty() && numbers.len() != count {
            let sentence = format!("{} numbers for {count} targets", numbers.len());
            return Err(with_reason(Status::invalid_argument(sentence)));
        }
        kept.set(numbers);
        let method = self.find("SimulationService/StepSimulation")?;
        self.wait(self.direct.step(method, kept.request.clone()), time_limit, goes_on)
    }
}
