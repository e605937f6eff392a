//! A scene with contact in simd: actuators as a robot is spawned with, and without sleeping.

use std::sync::Arc;

use glamx::{DPose3, DVec3};
use simd_core::pool::Pool;
use simd_core::simulation::command::Spawn;
use simd_core::{Command, Simulation};
use simd_tests::{contact_scene, scenes};

use crate::World;
use crate::scene::{Contact, Scene, TIME_STEP, Thing};

pub(crate) struct InContact {
    world: Simulation,
    /// Expected places of all free bodies: the initial ones, or in a heap, those after it settled.
    expected: Vec<DVec3>,
}

const SETTLED: &str = "settled";

impl InContact {
    /// Settled, and kept so as a saved state.
    pub(crate) fn new(scene: &Scene, contact: &Contact, may_sleep: bool) -> Self {
        let mut world = scenes::world(TIME_STEP);
        let contact_settings = || scenes::surface(contact.friction, 0.0);
        let ground = scenes::robot("ground", &scenes::plane(DVec3::Z), DPose3::IDENTITY, true);
        scenes::spawn(&mut world, Spawn { contact_settings: contact_settings(), ..ground });
        if !scene.urdf.is_empty() {
            let positions = scene.joints().into_iter().map(|joint| (joint.name, joint.position));
            let robot = Spawn {
                passive: false,
                joint_positions: positions.collect(),
                contact_settings: contact_settings(),
                ..scenes::robot("robot", &scene.model(), DPose3::IDENTITY, false)
            };
            for copy in 0..scene.copies {
                let pose = Scene::root_pose(copy) * DPose3::from_translation(DVec3::Z * contact.height);
                scenes::spawn(&mut world, Spawn { name: format!("robot-{copy}"), pose, ..robot.clone() });
            }
        }
        for (i, thing) in contact.things.iter().enumerate() {
            let Thing { ref shape, ref size, at, mass } = *thing;
            let model = match size[..] {
                [radius] if shape == "sphere" => scenes::ball(radius, mass),
                [x, y, z] => scenes::cuboid(DVec3::new(x, y, z), mass),
                _ => continue,
            };
            let (name, fixed) = (format!("thing-{i}"), mass == 0.0);
            let thing = scenes::robot(&name, &model, DPose3::from_translation(at.into()), fixed);
            scenes::spawn(&mut world, Spawn { contact_settings: contact_settings(), ..thing });
            if !fixed && !may_sleep {
                contact_scene::keep_awake(&mut world, &name);
            }
        }
        let start = free(&world);
        (0..(contact.settle / TIME_STEP).round() as u64).for_each(|_| world.step());
        let expected = if contact.heap { free(&world) } else { start };
        scenes::apply(&mut world, Command::SaveState { name: SETTLED.into() });
        Self { world, expected }
    }

    pub(crate) fn world(&self) -> &Simulation {
        &self.world
    }
}

impl World for InContact {
    fn put_back(&mut self) {
        scenes::apply(&mut self.world, Command::RestoreState { name: SETTLED.into() });
        self.world.take_events();
    }

    fn step(&mut self) {
        self.world.step();
    }

    fn lend(&mut self, threads: Arc<dyn Pool>) {
        self.world.set_pool(Some(threads));
    }

    fn error(&self) -> f64 {
        let places = free(&self.world);
        places.iter().zip(&self.expected).map(|(at, expected)| at.distance(*expected)).fold(0.0, f64::max)
    }
}

/// Returns the root positions of all free bodies.
fn free(world: &Simulation) -> Vec<DVec3> {
    let seen = scenes::look(world);
    let entities = seen.world.entities.iter().zip(&seen.roots);
    entities.filter(|(entity, _)| !entity.fixed_base).map(|(_, root)| root.pose.translation).collect()
}
