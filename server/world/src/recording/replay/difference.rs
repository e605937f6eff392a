//! Differences between a recorded world and the replayed one.

use simd_core::PublishedState;
use simd_core::simulation::Saved;
use simd_core::simulation::world_state::WorldState;

/// Returns the first robot, joint and quantity of two states that are not equal to the bit; `state` belongs
/// to the present one.
pub(super) fn what_differs(recorded: &Saved, present: &WorldState, state: &PublishedState) -> String {
    let recorded = recorded.world_state();
    let names = |state: &WorldState| -> Vec<String> {
        state.robots.iter().map(|robot| robot.entity.name.clone()).collect()
    };
    if names(recorded) != names(present) {
        return format!("the robots are {:?}, and were {:?}", names(present), names(recorded));
    }
    let robots = recorded.robots.iter().zip(&present.robots).zip(&state.world.entities);
    for ((before, now), layout) in robots {
        let robot = &before.entity.name;
        let (before, now) = (&before.body, &now.body);
        let (root_positions, root_velocities) = (layout.tree.root_positions(), layout.tree.root_velocities());
        for (quantity, before, now, root, ranges) in [
            ("position", &before.positions, &now.positions, root_positions, &layout.joint_positions),
            ("velocity", &before.velocities, &now.velocities, root_velocities, &layout.joint_velocities),
            ("effort", &before.efforts, &now.efforts, root_velocities, &layout.joint_velocities),
        ] {
            let differ = |(before, now): (&f64, &f64)| before.to_bits() != now.to_bits();
            let Some(index) = before.iter().zip(now).position(differ) else { continue };
            let values =
                (now.get(index).copied().unwrap_or(f64::NAN), before.get(index).copied().unwrap_or(f64::NAN));
            let joint = index
                .checked_sub(root)
                .and_then(|index| ranges.iter().position(|range| range.contains(&index)));
            let joint = joint.and_then(|joint| layout.model.joints.get(joint));
            let whose = joint.map_or_else(|| "root".to_owned(), |joint| format!("joint {:?}", joint.name));
            return format!(
                "robot {robot:?}, {whose}: the {quantity} is {:?}, and was {:?}",
                values.0, values.1
            );
        }
    }
    if recorded.settings != present.settings {
        return format!("the physics is {:?}, and was {:?}", present.settings, recorded.settings);
    }
    "positions, velocities and efforts are equal, and something else of the state differs: targets, settings or contacts".into()
}
