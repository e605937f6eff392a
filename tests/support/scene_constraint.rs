//! Constraints between the bodies and robots of a scene.

use glamx::DPose3;
use serde::Deserialize;
use simd_core::simulation::command::{CreateConstraint, RequestedConstraint, RequestedEnd};
use simd_core::{Command, Simulation};

use crate::scenes;

/// A constraint between two links, a link and the world, or two joints.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Constraint {
    /// `weld`, `point`, `rod`, `rope` or `gear`.
    kind: String,
    /// Robot and link, or of a gear robot and joint; both empty: the world.
    parent: [String; 2],
    child: [String; 2],
    /// Point in the axes of its link.
    parent_at: [f64; 3],
    child_at: [f64; 3],
    /// Length of a rod or a rope.
    length: f64,
    /// Ratio of a gear: child = ratio * parent.
    ratio: f64,
    /// It breaks above this force, N; never if 0.
    max_force: f64,
}

impl Constraint {
    /// Puts it into a world that has its ends.
    ///
    /// # Panics
    /// Panics if the world refuses it: then the test has failed.
    #[allow(clippy::panic, reason = "the test has failed")]
    pub(crate) fn put_into(&self, world: &mut Simulation) {
        let length = Some(self.length);
        let kind = match self.kind.as_str() {
            "weld" => RequestedConstraint::Weld,
            "point" => RequestedConstraint::PointToPoint,
            "rod" => RequestedConstraint::Distance { length, is_rope: false },
            "rope" => RequestedConstraint::Distance { length, is_rope: true },
            "gear" => RequestedConstraint::Gear { ratio: self.ratio, offset: Some(0.0) },
            other => panic!("there is no constraint {other}"),
        };
        let is_gear = self.kind == "gear";
        let end = |[robot, of]: &[String; 2], at: [f64; 3]| {
            let robot = robot.clone();
            if is_gear {
                return RequestedEnd { robot, joint: of.clone(), ..RequestedEnd::default() };
            }
            let pose = Some(DPose3::from_translation(at.into()));
            RequestedEnd { robot, link: of.clone(), joint: String::new(), pose }
        };
        let max_force = (self.max_force > 0.0).then_some(self.max_force);
        let create = CreateConstraint {
            name: String::new(),
            kind,
            parent: end(&self.parent, self.parent_at),
            child: end(&self.child, self.child_at),
            max_force,
            max_torque: None,
            breaks: max_force.is_some(),
            disable_collisions: true,
        };
        scenes::apply(world, Command::CreateConstraint(Box::new(create)));
    }
}
