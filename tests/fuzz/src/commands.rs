//! Requests as they come over the network, one after the other, to a world with robots in it.

use std::sync::Arc;

use glamx::{DPose3, DVec3};
use prost::Message;
use simd_api::convert::BadField;
use simd_api::convert::field::Path;
use simd_api::convert::from_proto::{contact, entity, joint, primitive, simulation};
use simd_core::collision::{MeshShapes, Shapes};
use simd_core::simulation::WorldLimits;
use simd_core::simulation::command::{ClaimId, ClaimRequest, ReleaseCause, Reload, Spawn};
use simd_core::simulation::rays::RayReport;
use simd_core::{Command, PhysicsSettings, PublishedState, Simulation};
use simd_model::{ReadOptions, wire_name};
use simd_proto::v1;
use simd_world::handle::Source;

/// Steps after each request.
const STEPS: usize = 3;
/// Requests of one sequence.
const MAX: usize = 200;

/// A sequence is requests one after the other: a byte for the kind, two for the length, and the message. A
/// refused request changes nothing, to the bit. After an accepted request, every number that a client sees is
/// finite.
pub fn commands(bytes: &[u8]) {
    let mut world = Simulation::new(PhysicsSettings::default(), WorldLimits { robots: 5, saved_states: 3 });
    for (name, x) in [("arm", 0.0), ("ball", 1.0)] {
        let text = if name == "arm" { ARM } else { BALL };
        if let Some(spawn) = read(text.as_bytes(), name, x) {
            let spawned = world.apply(&Command::Spawn(Box::new(spawn)));
            assert!(spawned.is_ok(), "{spawned:?}");
        }
    }
    let mut rest = bytes;
    // Held by the sender of every second command.
    let mut claim = None;
    for turn in 0..MAX {
        let Some((kind, message)) = super::message(&mut rest) else { break };
        let before = world.fingerprint();
        match asked(kind, message, turn) {
            None => continue,
            Some(Asked::Command(command)) => {
                let applied = world.apply_for(&command, claim.filter(|_| turn % 2 == 0));
                if let (Ok(_), Command::Claim(request)) = (&applied, &command) {
                    claim = Some(request.claim);
                }
                if applied.is_err() {
                    assert_eq!(world.fingerprint(), before, "a refusal changes nothing: {command:?}");
                }
            }
            Some(Asked::Rays(rays)) => {
                let mut seen = PublishedState::default();
                world.observe(&mut seen);
                if let Ok(hits) = seen.cast_rays(&rays, None, &|| false) {
                    assert_eq!(hits.len(), rays.len(), "each ray has an answer");
                    hits.iter().flatten().for_each(check);
                }
            }
        }
        (0..STEPS).for_each(|_| world.step());
        let mut seen = PublishedState::default();
        world.observe(&mut seen);
        let numbers = [&seen.positions, &seen.velocities, &seen.efforts, &seen.targets];
        assert!(numbers.into_iter().flatten().all(|value| value.is_finite()), "after request {turn}");
        assert!(seen.roots.iter().all(|root| root.pose.is_finite()), "after request {turn}");
    }
}

pub(super) const ARM: &str = "<robot name='arm'><link name='base'/><link name='a'><inertial><mass value='1'/>\
    <inertia ixx='.1' ixy='0' ixz='0' iyy='.1' iyz='0' izz='.1'/></inertial><collision><geometry>\
    <box size='.2 .2 .2'/></geometry></collision></link><joint name='j' type='revolute'><parent link='base'/>\
    <child link='a'/><axis xyz='0 1 0'/><limit lower='-1' upper='1' effort='10' velocity='5'/></joint></robot>";
pub(super) const BALL: &str = "<robot name='ball'><link name='a'><inertial><mass value='1'/>\
    <inertia ixx='.1' ixy='0' ixz='0' iyy='.1' iyz='0' izz='.1'/></inertial><collision><geometry>\
    <sphere radius='.1'/></geometry></collision></link></robot>";

/// A pyramid, for hulls of a mesh of our own.
pub(super) const PYRAMID: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 2 3 4\nf 1 4 3\n";
pub(super) const MESH: &str = "<robot name='mesh'><link name='a'><inertial><mass value='1'/><inertia ixx='.1' ixy='0' ixz='0' \
    iyy='.1' iyz='0' izz='.1'/></inertial><collision><geometry><mesh filename='a.obj'/></geometry></collision>\
    </link></robot>";

/// Meaning of a message.
enum Asked {
    Command(Command),
    Rays(Vec<[DVec3; 2]>),
}

/// Decodes a message; `None` if its bytes are not a message, or it is refused.
fn asked(kind: u8, bytes: &[u8], turn: usize) -> Option<Asked> {
    let command = match kind % 20 {
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
        8 => {
            let asked = v1::Primitive::decode(bytes).ok()?;
            let shape = primitive::primitive(&Path::ROOT, asked).ok()?;
            read(shape.urdf().as_bytes(), "shape", 0.0).map(spawn)
        }
        9 => taken(bytes, |asked| {
            let (request, _lease) = joint::claim_joints(asked)?;
            Ok(Command::Claim(ClaimRequest { claim: ClaimId(turn as u64), ..request }))
        }),
        10 => taken(bytes, |asked: v1::ReleaseJointsRequest| {
            // One that the sequence made, if it can be read as one.
            let claim = ClaimId(joint::claim(&asked)?.parse().unwrap_or_default());
            Ok(Command::Release { claim, cause: ReleaseCause::Released })
        }),
        11 => taken(bytes, |asked: v1::DeleteEntityRequest| {
            Ok(Command::Delete { robot: entity::robot(asked.robot)? })
        }),
        12 => taken(bytes, |asked: v1::SaveStateRequest| Ok(Command::SaveState { name: asked.name })),
        13 => taken(bytes, |asked: v1::RestoreStateRequest| Ok(Command::RestoreState { name: asked.name })),
        14 => taken(bytes, |asked: v1::DeleteSavedStateRequest| {
            Ok(Command::DeleteSavedState { name: asked.name })
        }),
        15 => reload(bytes),
        // An untrusted mesh, and its collision shape.
        16 => {
            let (meshes, mesh) = bytes.split_first()?;
            let meshes = if meshes % 2 == 0 { MeshShapes::Hull } else { MeshShapes::Decomposition };
            read_with(MESH.as_bytes(), "mesh", 0.0, &super::only(mesh), meshes).map(spawn)
        }
        18 => taken(bytes, entity::set_collision_filter),
        19 => taken(bytes, entity::link_pull),
        _ => {
            let asked = v1::CastRaysRequest::decode(bytes).ok()?;
            return contact::rays(asked.rays).ok().map(Asked::Rays);
        }
    };
    command.map(Asked::Command)
}

fn spawn(spawn: Spawn) -> Command {
    Command::Spawn(Box::new(spawn))
}

/// Returns a robot's new text, which may name the pyramid.
fn reload(bytes: &[u8]) -> Option<Command> {
    let asked = v1::ReloadEntityRequest::decode(bytes).ok()?;
    let (robot, source) = entity::reload(asked.robot, asked.source).ok()?;
    let Some(Source::Inline { urdf, .. }) = source else { return None };
    let Spawn { model, shapes, .. } =
        read_with(&urdf, "reloaded", 0.0, &super::only(PYRAMID), MeshShapes::Hull)?;
    Some(Command::Reload(Box::new(Reload { robot, model, shapes })))
}

/// A ray's hit lies on the ray.
pub(super) fn check(hit: &RayReport) {
    assert!((0.0..=1.0).contains(&hit.fraction), "{hit:?}");
    assert!(hit.point.is_finite() && hit.normal.is_finite(), "{hit:?}");
}

fn taken<M: Message + Default>(
    bytes: &[u8],
    convert: impl FnOnce(M) -> Result<Command, BadField>,
) -> Option<Command> {
    convert(M::decode(bytes).ok()?).ok()
}

fn read(urdf: &[u8], name: &str, x: f64) -> Option<Spawn> {
    read_with(urdf, name, x, &super::Only(None), MeshShapes::Hull)
}

pub(super) fn read_with(
    urdf: &[u8],
    name: &str,
    x: f64,
    assets: &super::Only,
    meshes: MeshShapes,
) -> Option<Spawn> {
    let (model, _) = simd_model::read(urdf, assets, &ReadOptions::default()).ok()?;
    Some(Spawn {
        name: wire_name(name),
        allow_renaming: true,
        shapes: Arc::new(Shapes::reusing(&model, false, meshes, &[])),
        model: Arc::new(model),
        pose: DPose3::from_translation(DVec3::X * x),
        fixed_base: Some(name == "arm"),
        passive: false,
        joint_positions: Vec::new(),
        joint_orientations: Vec::new(),
        contact_settings: Default::default(),
        collision_pairs: Vec::new(),
        free_place: Default::default(),
        loaded_at_start: false,
    })
}
