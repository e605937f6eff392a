//! Requests of the kinematics service. Values that depend on the robot are checked against the state that the
//! answer is computed from.

use glamx::{DQuat, DVec3};
use simd_core::PublishedState;
use simd_core::dynamics::Configuration;
use simd_core::dynamics::inverse_kinematics::SolverOptions;
use simd_core::simulation::published_state::EntityLayout;
use simd_model::LARGEST_GIVEN;
use simd_proto::v1;

use super::geometry;
use crate::convert::field::{BadField, Path};

/// Default and maximum number of iterations of a search.
const ITERATIONS: (u32, u32) = (300, 1_000);
/// Default and permitted tolerances, metres.
const TOLERANCE: (f64, std::ops::RangeInclusive<f64>) = (1e-4, 1e-12..=1.0);

/// Target of a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Target {
    /// Position, world axes.
    pub position: DVec3,
    /// `world_from_link`; `None` if only the position counts.
    pub orientation: Option<DQuat>,
}

/// Returns the configuration for which a robot is evaluated: the given positions, or the state's.
pub fn configuration(
    field: &str,
    given: Option<v1::Configuration>,
    state: &PublishedState,
    index: usize,
    entity: &EntityLayout,
) -> Result<Configuration, BadField> {
    configuration_at(&Path::ROOT.field(field), given, state, index, entity)
}

/// Like `configuration`, for a field of an inner message.
pub fn configuration_at(
    at: &Path<'_>,
    given: Option<v1::Configuration>,
    state: &PublishedState,
    index: usize,
    entity: &EntityLayout,
) -> Result<Configuration, BadField> {
    let present = state.configuration(index).unwrap_or_default();
    let Some(given) = given else { return Ok(present) };
    let mut positions = numbers(at, "positions", given.positions, entity.positions.len())?;
    for range in entity.joint_positions.iter().filter(|range| matches!(range.len(), 4 | 7)) {
        // A spherical or floating joint: its quaternion is normalised, as every rotation from a client.
        if let Some([x, y, z, w]) = positions.get_mut(range.end - 4..range.end).and_then(|q| q.as_mut_array())
        {
            let unit = geometry::rotation(at, v1::Quaternion { x: *x, y: *y, z: *z, w: *w })?;
            [*x, *y, *z, *w] = unit.to_array();
        }
    }
    let velocities = if given.velocities.is_empty() {
        Vec::new()
    } else {
        numbers(at, "velocities", given.velocities, entity.velocities.len())?
    };
    let root_at = at.field("root");
    let root = given.root.map(|root| geometry::pose(&root_at, root)).transpose()?;
    moderate(&root_at, root.map_or(DVec3::ZERO, |root| root.translation))?;
    let twist_at = at.field("root_twist");
    let twist = given.root_twist.map(geometry::twist);
    let (linear, angular) = twist.unwrap_or_default();
    moderate(&twist_at, linear)?;
    moderate(&twist_at, angular)?;
    if entity.fixed_base && (linear, angular) != (DVec3::ZERO, DVec3::ZERO) {
        return Err(twist_at.refuse("not zero", "the robot's base is fixed, so it must be"));
    }
    Ok(Configuration { root: root.unwrap_or(present.root), linear, angular, positions, velocities })
}

/// Accepts a vector whose components are moderate enough for computations.
fn moderate(at: &Path<'_>, vector: DVec3) -> Result<DVec3, BadField> {
    // Checks each component: `max` over them would drop NaN.
    if vector.to_array().iter().all(|value| value.abs() <= LARGEST_GIVEN) {
        return Ok(vector);
    }
    Err(at.refuse(vector, format!("no part of it may be beyond {LARGEST_GIVEN:e}")))
}

/// Accepts finite numbers if their count is as expected.
fn numbers(at: &Path<'_>, name: &str, given: Vec<f64>, count: usize) -> Result<Vec<f64>, BadField> {
    if given.len() != count {
        let value = format!("{} values", given.len());
        return Err(at
            .field(name)
            .refuse(value, format!("it must be {count}, aligned with the joint layout")));
    }
    for (index, value) in given.iter().enumerate() {
        at.item(name, index).within(*value, -LARGEST_GIVEN..=LARGEST_GIVEN)?;
    }
    Ok(given)
}

/// Parses accelerations by velocity, a free root's six first; an empty list stays empty and means rest.
pub fn accelerations(given: Vec<f64>, entity: &EntityLayout) -> Result<Vec<f64>, BadField> {
    if given.is_empty() {
        return Ok(given);
    }
    numbers(&Path::ROOT, "accelerations", given, entity.tree.velocity_count)
}

/// Accepts the names of a robot and of one of its links.
pub fn link(robot: String, link: String) -> Result<(String, String), BadField> {
    Ok((Path::ROOT.field("robot").name(robot)?, Path::ROOT.field("link").name(link)?))
}

/// Parses a point of a link; absent means the link's origin.
pub fn point(given: Option<v1::Vector3>) -> Result<DVec3, BadField> {
    let at = Path::ROOT.field("point");
    moderate(&at, geometry::vector_or_zero(given))
}

/// Parses the target of a link. The position must be given; the orientation is optional.
pub fn target(given: Option<v1::Pose>) -> Result<Target, BadField> {
    let at = Path::ROOT.field("target");
    let given = at.given(given)?;
    let position_at = at.field("position");
    let position = geometry::vector(position_at.given(given.position)?);
    let position = moderate(&position_at, position)?;
    let turned = |given| geometry::rotation(&at.field("orientation"), given);
    Ok(Target { position, orientation: given.orientation.map(turned).transpose()? })
}

/// Parses names of joints that may move; an empty list means all actuated ones.
pub fn joints(given: Vec<String>) -> Result<Vec<String>, BadField> {
    Path::ROOT.each_once("joints", &given)?;
    given.into_iter().enumerate().map(|(index, name)| Path::ROOT.item("joints", index).name(name)).collect()
}

/// Parses the end criteria of a search.
pub fn solver_options(max_iterations: u32, tolerance: f64) -> Result<SolverOptions, BadField> {
    if max_iterations > ITERATIONS.1 {
        let expected = format!("it must be at most {}", ITERATIONS.1);
        return Err(Path::ROOT.field("max_iterations").refuse(max_iterations, expected));
    }
    let tolerance = match tolerance {
        0.0 => TOLERANCE.0,
        given => Path::ROOT.field("tolerance").within(given, TOLERANCE.1)?,
    };
    Ok(SolverOptions {
        iterations: if max_iterations == 0 { ITERATIONS.0 } else { max_iterations },
        tolerance,
    })
}
