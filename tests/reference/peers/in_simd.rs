//! A scene in simd, with the actuators that a robot is spawned with.

use std::sync::Arc;

use simd_core::pool::Pool;
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::*;
use simd_core::{Command, Integrator, PhysicsSettings, PublishedState, Simulation};

use crate::World;
use crate::scene::{Scene, TIME_STEP};

pub(crate) struct Simd {
    world: Simulation,
    /// Held positions of the joints of all copies.
    held: Vec<f64>,
}

impl Simd {
    pub(crate) fn new(scene: &Scene, integrator: Integrator) -> Self {
        let settings = PhysicsSettings { time_step: TIME_STEP, integrator, ..PhysicsSettings::default() };
        let mut world = Simulation::new(settings, WorldLimits::default());
        let (model, joints) = (scene.model(), scene.joints());
        let positions: Vec<_> = joints.iter().map(|joint| (joint.name.clone(), joint.position)).collect();
        for copy in 0..scene.copies {
            let spawn = Spawn {
                name: format!("robot-{copy}"),
                allow_renaming: false,
                model: model.clone(),
                pose: Scene::root_pose(copy),
                fixed_base: Some(!scene.free),
                passive: false,
                joint_positions: positions.clone(),
                joint_orientations: Vec::new(),
                shapes: Default::default(),
                contact_settings: Default::default(),
                collision_pairs: Vec::new(),
                free_place: Default::default(),
                loaded_at_start: false,
            };
            let spawned = world.apply(&Command::Spawn(Box::new(spawn)));
            assert!(spawned.is_ok(), "{spawned:?}");
        }
        let held = (0..scene.copies).flat_map(|_| joints.iter().map(|joint| joint.position)).collect();
        Self { world, held }
    }
}

impl World for Simd {
    fn put_back(&mut self) {
        let scope = ResetScope { time: true, state: true, spawned: false };
        assert!(self.world.apply(&Command::Reset(scope)).is_ok());
        self.world.take_events();
    }

    fn step(&mut self) {
        self.world.step();
    }

    fn lend(&mut self, threads: Arc<dyn Pool>) {
        self.world.set_pool(Some(threads));
    }

    fn error(&self) -> f64 {
        let mut seen = PublishedState::default();
        self.world.observe(&mut seen);
        assert!(seen.roots.iter().all(|root| root.disabled.is_none()));
        seen.positions.iter().zip(&self.held).map(|(at, held)| (at - held).abs()).fold(0.0, f64::max)
    }
}
