//! Requests as they come over the network, one after the other, to a world with robots in it.

use std::sync::Arc;

use glamx::{DPose3, DVec3};
use prost::Message;
use simd_core::collision::Shapes;
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::Spawn;
use simd_core::{Command, PhysicsSettings, Simulation, Snapshot};
use simd_model::{ReadOptions, wire_name};
use simd_proto::v1;
use simd_server::convert::BadField;
use simd_server::convert::field::Path;
use simd_server::convert::from_proto::{entity, joint, primitive, simulation};

/// Steps after each request.
const STEPS: usize = 3;
/// Requests of one sequence.
const MOST: usize = 200;

/// A sequence is requests one after the other: a byte that says which, two that say how
/// long, and the message. What is refused changes nothing, to the bit; and whatever is
/// accepted, every number that a client sees is finite.
pub fn commands(bytes: &[u8]) {
    let mut world = Simulation::new(PhysicsSettings::default(), WorldLimits { robots: 5, snapshots: 3 });
    for (name, x) in [("arm", 0.0), ("ball", 1.0)] {
        let text = if name == "arm" { ARM } else { BALL };
        if let Some(spawn) = read(text.as_bytes(), name, x) {
            let spawned = world.apply(&Command::Spawn(Box::new(spawn)));
            assert!(spawned.is_ok(), "{spawned:?}");
        }
    }
    let mut rest = bytes;
    for _ in 0..MOST {
        let [kind, low, high, left @ ..] = rest else { break };
        let (message, left) = left.split_at(left.len().min(usize::from(u16::from_le_bytes([*low, *high]))));
        rest = left;
        let Some(command) = command(*kind, message) else { continue };
        let before = world.fingerprint();
        if world.apply(&command).is_err() {
            assert_eq!(world.fingerprint(), before, "a refusal changes nothing: {command:?}");
        }
        (0..STEPS).for_each(|_| world.step());
        let mut seen = Snapshot::default();
        world.observe(&mut seen);
        let numbers = [&seen.positions, &seen.velocities, &seen.efforts, &seen.targets];
        assert!(numbers.into_iter().flatten().all(|value| value.is_finite()), "after {command:?}");
        assert!(seen.roots.iter().all(|root| root.pose.is_finite()), "after {command:?}");
    }
}

const ARM: &str = "<robot name='arm'><link name='base'/><link name='a'><inertial><mass value='1'/>\
    <inertia ixx='.1' ixy='0' ixz='0' iyy='.1' iyz='0' izz='.1'/></inertial><collision><geometry>\
    <box size='.2 .2 .2'/></geometry></collision></link><joint name='j' type='revolute'><parent link='base'/>\
    <child link='a'/><axis xyz='0 1 0'/><limit lower='-1' upper='1' effort='10' velocity='5'/></joint></robot>";
const BALL: &str = "<robot name='ball'><link name='a'><inertial><mass value='1'/>\
    <inertia ixx='.1' ixy='0' ixz='0' iyy='.1' iyz='0' izz='.1'/></inertial><collision><geometry>\
    <sphere radius='.1'/></geometry></collision></link></robot>";

/// The command of a message; none where its bytes are no message, or it is refused.
fn command(kind: u8, bytes: &[u8]) -> Option<Command> {
    match kind % 9 {
        0 => taken(bytes, |asked| joint::set_joint_targets(asked).map(Command::SetTargets)),
        1 => taken(bytes, joint::reset_joints),
        2 => taken(bytes, joint::set_joint_properties),
        3 => taken(bytes, entity::set_entity_state),
        4 => taken(bytes, entity::link_wrench),
        5 => taken(bytes, entity::set_link_properties),
        6 => {
            let asked = v1::ResetSimulationRequest::decode(bytes).ok()?;
            Some(Command::Reset(simulation::reset_scope(&asked)))
        }
        7 => {
            let asked = v1::SetPhysicsRequest::decode(bytes).ok()?;
            let (change, _pace) = simulation::physics_change(&asked).ok()?;
            Some(Command::SetPhysics(change))
        }
        _ => {
            let asked = v1::Primitive::decode(bytes).ok()?;
            let shape = primitive::primitive(&Path::ROOT, asked).ok()?;
            read(shape.urdf().as_bytes(), "shape", 0.0).map(|spawn| Command::Spawn(Box::new(spawn)))
        }
    }
}

fn taken<M: Message + Default>(
    bytes: &[u8],
    convert: impl FnOnce(M) -> Result<Command, BadField>,
) -> Option<Command> {
    convert(M::decode(bytes).ok()?).ok()
}

fn read(urdf: &[u8], name: &str, x: f64) -> Option<Spawn> {
    let (model, _) = simd_model::read(urdf, &super::Only(None), &ReadOptions::default()).ok()?;
    Some(Spawn {
        name: wire_name(name),
        allow_renaming: true,
        shapes: Arc::new(Shapes::new(&model)),
        model: Arc::new(model),
        pose: DPose3::from_translation(DVec3::X * x),
        fixed_base: Some(name == "arm"),
        passive: false,
        joint_positions: Vec::new(),
        touches: Default::default(),
        loaded_at_start: false,
    })
}
