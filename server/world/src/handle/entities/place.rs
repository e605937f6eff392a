//! Findings of a load report about the robot's location.

use std::sync::Arc;
use std::time::Duration;

use glamx::DVec3;
use simd_core::simulation::spawn_overlaps::SpawnOverlap;
use simd_core::simulation::terrain_penetration::TerrainPenetration;
use simd_model::{Disposition, Finding, LoadReport, RobotModel, Severity};

use super::super::SimHandle;
use super::super::heavy::Cancelled;
use crate::driver::Published;

/// Maximum time that a load waits for the check of its location.
const LOOK_TIME: Duration = Duration::from_secs(3);

/// Maximum number of links that a report names, separately for links below the surface of terrain and links
/// in other robots.
const MAX_NAMED: usize = 8;

impl SimHandle {
    /// Adds links that are below the surface of terrain, and links that overlap other robots. For a new
    /// terrain, these are links of other robots below its surface. Adds nothing if all permits for heavy
    /// reads are taken for 3 s, or if another robot has the name by then.
    pub(super) async fn report_place(&self, name: &str, model: &Arc<RobotModel>, report: &mut LoadReport) {
        let newest = self.newest();
        let found = newest.state.entity(name).filter(|(_, entity)| Arc::ptr_eq(&entity.model, model));
        let Some((robot, _)) = found else { return };
        // Shapes of requests are thrown about on purpose.
        if self.description_of_model(model).is_some() {
            report.findings.extend(falls(&newest, robot));
        }
        let own_name = name.to_owned();
        let look = move |cancelled: &Cancelled| {
            let Published { state, physics, .. } = &*newest;
            let is_cancelled = || cancelled.is_set();
            let has_terrain = state.world.entities.iter().any(|entity| entity.shapes.has_terrain());
            let below = if has_terrain {
                state.terrain_penetrations(robot, physics.gravity, MAX_NAMED, &is_cancelled)
            } else {
                Vec::new()
            };
            let mut findings: Vec<Finding> = below.into_iter().map(below_terrain).collect();
            let overlaps = state.spawn_overlaps(robot, &is_cancelled).unwrap_or_default();
            let way = state.way_to_free_place(robot).filter(|way| *way > 0.0);
            let free = state.roots.get(robot).zip(way).map(|(root, way)| {
                let place = root.pose.translation;
                [place.x, place.y + way, place.z]
            });
            findings.extend(
                overlaps.into_iter().take(MAX_NAMED).map(|overlap| overlaps_other(&own_name, overlap, free)),
            );
            findings
        };
        // A completed load does not wait for a busy machine: the check ends early.
        let looked = tokio::time::timeout(LOOK_TIME, self.heavy(look)).await;
        report.findings.extend(looked.ok().and_then(Result::ok).unwrap_or_default());
    }
}

/// Says that a free robot falls, unless something in the world can hold it.
fn falls(newest: &Published, robot: usize) -> Option<Finding> {
    let entities = &newest.state.world.entities;
    let fallen = entities.get(robot).filter(|entity| !entity.fixed_base)?;
    let has_ground = entities.iter().any(|entity| entity.fixed_base && !entity.shapes.is_empty());
    if newest.physics.gravity == DVec3::ZERO || has_ground {
        return None;
    }
    let name = &fallen.name;
    Some(warning(
        format!("robot {name:?}"),
        format!(
            "its base is free and the world has no ground, so it falls: add ground with `simctl robot shape plane`, or delete \
             {name:?} and load it with a fixed base (`simctl robot load --fixed`)"
        ),
    ))
}

fn warning(element: String, message: String) -> Finding {
    Finding {
        severity: Severity::Warning,
        disposition: Disposition::Used,
        element,
        file: None,
        line: None,
        message,
    }
}

fn below_terrain(TerrainPenetration { link, terrain, depth }: TerrainPenetration) -> Finding {
    warning(
        format!("link {:?} of {:?}", link.1, link.0),
        format!(
            "starts {depth:.3} m below the surface of {:?}: a height field pushes it out, and a mesh lets it fall; put it \
             higher",
            terrain.0
        ),
    )
}

fn overlaps_other(name: &str, overlap: SpawnOverlap, free: Option<[f64; 3]>) -> Finding {
    let SpawnOverlap { link, robot, other_link, depth } = overlap;
    let advice = match free {
        Some([x, y, z]) => format!(
            "delete {name:?} and load it beside the others (`--beside`), or where there is room, for instance with \
             `--pose {x:.2},{y:.2},{z:.2}`"
        ),
        // A plane cannot be put beside others.
        None => format!("put {name:?} or {robot:?} elsewhere"),
    };
    warning(
        format!("link {link:?} of {name:?}"),
        format!(
            "starts {depth:.3} m inside link {other_link:?} of {robot:?}, and contacts may hold joints or push it away: {advice}"
        ),
    )
}
