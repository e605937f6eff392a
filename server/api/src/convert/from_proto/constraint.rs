//! Requests of the constraint service.

use glamx::{DPose3, DVec3};
use simd_core::simulation::command::{ChangeConstraint, CreateConstraint, RequestedConstraint, RequestedEnd};
use simd_proto::v1::{self, ConstraintKind};

use super::geometry;
use crate::convert::field::{BadField, Path};

/// Returns the robot whose constraints are requested, or `None` for all robots.
pub fn only(request: v1::ListConstraintsRequest) -> Result<Option<String>, BadField> {
    let robot = Path::ROOT.field("robot").short(request.robot)?;
    Ok((!robot.is_empty()).then_some(robot))
}

/// Accepts the name of a constraint.
pub fn name(name: String) -> Result<String, BadField> {
    Path::ROOT.field("name").name(name)
}

/// Parses a constraint to create.
pub fn create(request: v1::CreateConstraintRequest) -> Result<CreateConstraint, BadField> {
    let v1::CreateConstraintRequest {
        name,
        kind,
        parent,
        child,
        axis,
        ratio,
        offset,
        length,
        rope,
        max_force,
        max_torque,
        breaks,
        disable_collisions,
        request_id: _,
        claim: _,
    } = request;
    let at = Path::ROOT.field("kind");
    let known = at.known(kind)?;
    let turns = matches!(known, ConstraintKind::Hinge | ConstraintKind::Slide);
    refuse_where("axis", axis.is_some() && !turns, "only a hinge or a slide has one")?;
    let is_gear = known == ConstraintKind::Gear;
    refuse_where("ratio", ratio.is_some() && !is_gear, "only a gear has one")?;
    refuse_where("offset", offset.is_some() && !is_gear, "only a gear has one")?;
    let is_distance = known == ConstraintKind::Distance;
    refuse_where("length", length.is_some() && !is_distance, "only a distance has one")?;
    refuse_where("rope", rope && !is_distance, "only a distance can be one")?;
    let axis = axis.map_or(DVec3::X, geometry::vector);
    let kind = match known {
        ConstraintKind::Unspecified => return Err(at.refuse("not given", "it must be given")),
        ConstraintKind::Weld => RequestedConstraint::Weld,
        ConstraintKind::PointToPoint => RequestedConstraint::PointToPoint,
        ConstraintKind::Hinge => RequestedConstraint::Hinge { axis },
        ConstraintKind::Slide => RequestedConstraint::Slide { axis },
        ConstraintKind::Gear => RequestedConstraint::Gear { ratio: ratio.unwrap_or(1.0), offset },
        ConstraintKind::Distance => RequestedConstraint::Distance { length, is_rope: rope },
    };
    Ok(CreateConstraint {
        name: Path::ROOT.field("name").short(name)?,
        kind,
        parent: end("parent", parent)?,
        child: end("child", child)?,
        max_force,
        max_torque,
        breaks,
        disable_collisions,
    })
}

/// Parses new settings of a constraint.
pub fn change(request: v1::ChangeConstraintRequest) -> Result<ChangeConstraint, BadField> {
    let v1::ChangeConstraintRequest {
        name,
        parent_pose,
        child_pose,
        max_force,
        max_torque,
        breaks,
        ratio,
        offset,
        length,
        request_id: _,
        claim: _,
    } = request;
    Ok(ChangeConstraint {
        name: self::name(name)?,
        parent_pose: pose(&Path::ROOT.field("parent_pose"), parent_pose)?,
        child_pose: pose(&Path::ROOT.field("child_pose"), child_pose)?,
        max_force,
        max_torque,
        breaks,
        ratio,
        offset,
        length,
    })
}

fn end(field: &str, given: Option<v1::ConstraintEnd>) -> Result<RequestedEnd, BadField> {
    let at = Path::ROOT.field(field);
    let v1::ConstraintEnd { robot, link, joint, pose } = given.unwrap_or_default();
    Ok(RequestedEnd {
        robot: at.field("robot").short(robot)?,
        link: at.field("link").short(link)?,
        joint: at.field("joint").short(joint)?,
        pose: self::pose(&at.field("pose"), pose)?,
    })
}

fn pose(at: &Path<'_>, given: Option<v1::Pose>) -> Result<Option<DPose3>, BadField> {
    given.map(|given| geometry::pose(at, given)).transpose()
}

fn refuse_where(field: &str, is_wrong: bool, expected: &str) -> Result<(), BadField> {
    if is_wrong { Err(Path::ROOT.field(field).refuse("given", expected)) } else { Ok(()) }
}
