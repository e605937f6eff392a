//! Copies of the world that run from one state.

use simd_proto::v1::{
    RolloutArray, RolloutPart, RolloutProgress, RolloutRequest, RolloutResult, rollout_response::Event,
};

use crate::{Client, Error, client::present};

/// Maximum number of values in all arrays of a rollout: 512 MiB.
const MAX_NUMBERS: u64 = 64 << 20;

/// Result of a rollout.
#[derive(Clone, Debug, Default)]
pub struct Rollout {
    /// The result without its arrays.
    pub result: RolloutResult,
    /// By copy, row and number of all quantities; NaN from the end of a copy that ended early.
    pub states: Vec<f64>,
    /// By copy and term, weighted and summed over the steps; infinite for a copy that ended early.
    pub costs: Vec<f64>,
    /// By copy and step; infinite from the end of a copy that ended early. Empty if not requested.
    pub step_costs: Vec<f64>,
}

/// Packs numbers for a request: 64 bits each, the least significant byte first.
pub fn packed(numbers: &[f64]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
}

impl Rollout {
    fn new(result: RolloutResult) -> Self {
        Self { result, ..Self::default() }
    }

    /// Returns each array with its number of values.
    fn arrays(&mut self) -> [(&mut Vec<f64>, u64); 3] {
        let copies = u64::from(self.result.copies);
        let columns: u64 = self.result.widths.iter().map(|width| u64::from(*width)).sum();
        let (rows, terms) = (u64::from(self.result.rows), u64::from(self.result.terms));
        let steps = if self.result.has_step_costs { u64::from(self.result.steps) } else { 0 };
        let states = copies.saturating_mul(rows).saturating_mul(columns);
        [
            (&mut self.states, states),
            (&mut self.costs, copies.saturating_mul(terms)),
            (&mut self.step_costs, copies.saturating_mul(steps)),
        ]
    }

    fn take(&mut self, part: &RolloutPart) -> Result<(), Error> {
        let wrong = |reason: &str| Error::Answer { reason: format!("a part of a rollout {reason}") };
        let array = match part.array() {
            RolloutArray::States => 0,
            RolloutArray::Costs => 1,
            RolloutArray::StepCosts => 2,
            RolloutArray::Unspecified => return Err(wrong("is of no array")),
        };
        let (numbers, rest) = part.data.as_chunks();
        let (into, most) = &mut self.arrays()[array];
        if !rest.is_empty() || (into.len() + numbers.len()) as u64 > (*most).min(MAX_NUMBERS) {
            return Err(wrong("has another size than announced"));
        }
        into.extend(numbers.iter().map(|number| f64::from_le_bytes(*number)));
        Ok(())
    }

    fn is_whole(&mut self) -> bool {
        self.arrays().iter().all(|(array, count)| array.len() as u64 == *count)
    }

    /// Returns the cost of each copy: the sum of its terms. Empty without terms.
    pub fn total_costs(&self) -> Vec<f64> {
        let terms = usize::try_from(self.result.terms).unwrap_or(usize::MAX);
        self.costs.chunks_exact(terms.max(1)).map(|terms| terms.iter().sum()).collect()
    }
}

/// `RolloutService`.
impl Client {
    /// Runs copies of the world, and reports how many are done. Waits as long as the daemon sends progress.
    ///
    /// # Errors
    /// `ROBOT_NOT_FOUND`, `JOINT_NOT_FOUND`, `LINK_NOT_FOUND`, `JOINT_NOT_ACTUATED`, `SAVED_STATE_NOT_FOUND`, `INVALID_VALUE`,
    /// `LIMIT_EXCEEDED`.
    pub async fn rollout(
        &self,
        request: RolloutRequest,
        mut listener: impl FnMut(&RolloutProgress),
    ) -> Result<Rollout, Error> {
        let mut answers = self.unary(self.rollout_service().rollout(request)).await?;
        let mut found: Option<Rollout> = None;
        loop {
            let answer = answers.message().await;
            let answer = answer.map_err(|status| Error::from_status(&status, self.endpoint()))?;
            let Some(answer) = answer else { break };
            match present(answer.event, "event")? {
                Event::Progress(progress) => listener(&progress),
                Event::Result(result) => found = Some(Rollout::new(result)),
                Event::Part(part) => match &mut found {
                    Some(found) => found.take(&part)?,
                    None => return Err(incomplete()),
                },
            }
        }
        let mut found = found.ok_or_else(incomplete)?;
        if found.is_whole() { Ok(found) } else { Err(incomplete()) }
    }
}

fn incomplete() -> Error {
    Error::Answer { reason: "the rollout is incomplete".to_owned() }
}
