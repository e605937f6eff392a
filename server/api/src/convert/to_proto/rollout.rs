//! Results of rollouts.

use simd_core::rollout::BatchResult;
use simd_proto::v1;

use super::stamp;
use simd_world::handle::{RolloutAnswer, RolloutStart};

/// Maximum number of early-ended copies whose reasons an answer has.
const MAX_REASONS: usize = 16;
/// Maximum length of a reason, bytes.
const MAX_REASON_BYTES: usize = 500;

fn count(value: usize) -> u32 {
    u32::try_from(value).unwrap_or(u32::MAX)
}

/// Converts a result without its arrays.
pub(crate) fn result(answer: &RolloutAnswer) -> v1::RolloutResult {
    let RolloutAnswer { shape, fingerprint, start, batches, seconds, .. } = answer;
    let start = match start {
        RolloutStart::Published(state) => stamp::published(state),
        RolloutStart::Saved(at) => stamp::stamp(*at, None, 0),
    };
    let ended = batches.iter().flat_map(|batch| &batch.ended).take(MAX_REASONS).map(|ended| {
        let end = ended.reason.floor_char_boundary(MAX_REASON_BYTES);
        v1::RolloutEnd {
            copy: count(ended.copy),
            reason: ended.reason.get(..end).unwrap_or_default().to_owned(),
        }
    });
    let steps = |steps: u64| u32::try_from(steps).unwrap_or(u32::MAX);
    v1::RolloutResult {
        start: Some(start),
        copies: count(shape.copies),
        steps: steps(shape.steps),
        rows: count(shape.rows),
        widths: shape.widths.iter().map(|width| count(*width)).collect(),
        terms: count(shape.terms),
        has_step_costs: shape.step_costs,
        steps_done: batches.iter().flat_map(|batch| &batch.steps_done).map(|done| steps(*done)).collect(),
        ended: ended.collect(),
        processor_seconds: *seconds,
        start_fingerprint: *fingerprint,
    }
}

/// Arrays of an answer, in sending order.
pub(crate) const ARRAYS: [v1::RolloutArray; 3] =
    [v1::RolloutArray::States, v1::RolloutArray::Costs, v1::RolloutArray::StepCosts];

/// Returns the numbers of one array of a batch.
pub(crate) fn numbers(batch: &BatchResult, array: v1::RolloutArray) -> &[f64] {
    match array {
        v1::RolloutArray::Unspecified => &[],
        v1::RolloutArray::States => &batch.states,
        v1::RolloutArray::Costs => &batch.costs,
        v1::RolloutArray::StepCosts => &batch.step_costs,
    }
}
