//! `simctl constraint create`: the kinds of constraints, and the options of each.

use clap::{Args, ValueEnum};
use simd_client::proto::{ConstraintEnd, ConstraintKind, CreateConstraintRequest, Pose, Vector3};

use crate::{failure::Usage, output::json, pose};

#[derive(Args, Debug)]
pub(crate) struct Create {
    /// Kind of the constraint
    kind: Kind,
    /// Parent end
    #[arg(value_name = "world|ROBOT[/LINK]|ROBOT/JOINT")]
    parent: String,
    /// Child end; ends of a gear are joints
    #[arg(value_name = "world|ROBOT[/LINK]|ROBOT/JOINT")]
    child: String,
    /// Name of the constraint; chosen by the daemon if left out
    #[arg(long, default_value = "", hide_default_value = true)]
    name: String,
    /// Pose on the parent, metres, and radians about the fixed axes; the link's origin if left out
    #[arg(long, value_name = "X,Y,Z[,ROLL,PITCH,YAW]", value_parser = pose::parse, allow_hyphen_values = true)]
    parent_pose: Option<Pose>,
    /// Pose on the child; the present pose of the parent's frame if left out
    #[arg(long, value_name = "X,Y,Z[,ROLL,PITCH,YAW]", value_parser = pose::parse, allow_hyphen_values = true)]
    child_pose: Option<Pose>,
    /// Axis of a hinge or slide; 1,0,0 if left out
    #[arg(long, value_name = "X,Y,Z", value_parser = pose::parse_vector, allow_hyphen_values = true)]
    axis: Option<Vector3>,
    /// For a gear: child = ratio * parent + offset
    #[arg(long, allow_hyphen_values = true)]
    ratio: Option<f64>,
    /// For a gear, rad or m; its present value if left out
    #[arg(long, allow_hyphen_values = true)]
    offset: Option<f64>,
    /// For a distance, metres; its present value if left out
    #[arg(long)]
    length: Option<f64>,
    /// For a distance: pull, but do not push
    #[arg(long)]
    rope: bool,
    /// Maximum force, N; for a gear N m or N
    #[arg(long, value_name = "NEWTON")]
    max_force: Option<f64>,
    /// Maximum torque, N m
    #[arg(long, value_name = "NEWTON_METRE")]
    max_torque: Option<f64>,
    /// Delete the constraint when it would need more
    #[arg(long)]
    breaks: bool,
    /// The two links do not collide with each other
    #[arg(long)]
    disable_collisions: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Kind {
    /// The two frames coincide
    Weld,
    /// The origins coincide
    PointToPoint,
    /// The ends turn about the axis
    Hinge,
    /// The ends slide along the axis
    Slide,
    /// A joint follows another
    Gear,
    /// The origins keep a distance
    Distance,
}

impl From<Kind> for ConstraintKind {
    fn from(kind: Kind) -> Self {
        match kind {
            Kind::Weld => Self::Weld,
            Kind::PointToPoint => Self::PointToPoint,
            Kind::Hinge => Self::Hinge,
            Kind::Slide => Self::Slide,
            Kind::Gear => Self::Gear,
            Kind::Distance => Self::Distance,
        }
    }
}

/// Options that only some kinds use, and whether they were given.
pub(super) type Given = [(&'static str, bool); 3];

pub(super) fn given(parent_pose: Option<&Pose>, child_pose: Option<&Pose>, max_torque: Option<f64>) -> Given {
    [
        ("--parent-pose", parent_pose.is_some()),
        ("--child-pose", child_pose.is_some()),
        ("--max-torque", max_torque.is_some()),
    ]
}

/// Refuses options that a kind does not use. The daemon would accept them for all kinds, without effect.
pub(super) fn refuse_idle(kind: ConstraintKind, given: Given) -> Result<(), Usage> {
    let of_no_use: &[&str] = match kind {
        ConstraintKind::Gear => &["--parent-pose", "--child-pose", "--max-torque"],
        ConstraintKind::PointToPoint | ConstraintKind::Distance => &["--max-torque"],
        _ => return Ok(()),
    };
    let idle = given.into_iter().filter(|(option, is_given)| *is_given && of_no_use.contains(option));
    let idle: Vec<&str> = idle.map(|(option, _)| option).collect();
    if idle.is_empty() {
        return Ok(());
    }
    let why = match kind {
        ConstraintKind::Gear => "it is between joints, and --max-force is the most that it does, N m or N",
        _ => "it has a force and no torque, and --max-force is the most that it does",
    };
    let word = json::name("CONSTRAINT_KIND_", kind.as_str_name()).replace('_', "-");
    Err(Usage(format!("a {word} has no use for {}: {why}", idle.join(" and "))))
}

/// Makes the request.
pub(super) fn request(create: Create) -> Result<CreateConstraintRequest, Usage> {
    let Create {
        kind,
        parent,
        child,
        name,
        parent_pose,
        child_pose,
        axis,
        ratio,
        offset,
        length,
        rope,
        max_force,
        max_torque,
        breaks,
        disable_collisions,
    } = create;
    refuse_idle(kind.into(), given(parent_pose.as_ref(), child_pose.as_ref(), max_torque))?;
    Ok(CreateConstraintRequest {
        name,
        kind: ConstraintKind::from(kind).into(),
        parent: Some(end(kind, &parent, parent_pose)?),
        child: Some(end(kind, &child, child_pose)?),
        axis,
        ratio,
        offset,
        length,
        rope,
        max_force,
        max_torque,
        breaks,
        disable_collisions,
        ..Default::default()
    })
}

/// Parses `world`, `ROBOT` or `ROBOT/LINK`; for a gear `ROBOT/JOINT`. A robot's name has no slash.
fn end(kind: Kind, text: &str, pose: Option<Pose>) -> Result<ConstraintEnd, Usage> {
    let (robot, part) = text.split_once('/').unwrap_or((text, ""));
    if kind == Kind::Gear && part.is_empty() {
        let why = match text {
            "world" => "the world has no joints".to_owned(),
            _ => format!("{text:?} names none, and `simctl joint list {robot}` shows them"),
        };
        return Err(Usage(format!("a gear is between two joints, each as ROBOT/JOINT: {why}")));
    }
    let robot = if text == "world" { "" } else { robot }.to_owned();
    let (link, joint) = if kind == Kind::Gear { ("", part) } else { (part, "") };
    Ok(ConstraintEnd { robot, link: link.to_owned(), joint: joint.to_owned(), pose })
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;
    use crate::commands::constraint::Constraint;
    use crate::commands::{Arguments, Command};

    /// Returns the request of `simctl constraint create` with these arguments.
    fn asked(arguments: &str) -> Result<CreateConstraintRequest, String> {
        let line = format!("simctl constraint create {arguments}");
        let parsed = Arguments::try_parse_from(line.split(' ')).unwrap();
        let Command::Constraint(Constraint::Create(create)) = parsed.command else { unreachable!() };
        request(*create).map_err(|Usage(sentence)| sentence)
    }

    #[test]
    fn ends_are_read_as_people_write_them() {
        let link = end(Kind::Weld, "hand/tip link", None).unwrap();
        assert_eq!((link.robot.as_str(), link.link.as_str(), link.joint.as_str()), ("hand", "tip link", ""));
        let joint = end(Kind::Gear, "hand/left", None).unwrap();
        assert_eq!((joint.robot.as_str(), joint.link.as_str(), joint.joint.as_str()), ("hand", "", "left"));
        assert_eq!(end(Kind::Weld, "world", None).unwrap(), ConstraintEnd::default());
        assert_eq!(end(Kind::Weld, "hand", None).unwrap().link, "");
    }

    #[test]
    fn an_end_of_a_gear_without_a_joint_is_refused() {
        for (ends, part) in [
            ("arm arm/elbow", "each as ROBOT/JOINT: \"arm\" names none, and `simctl joint list arm`"),
            ("arm/elbow arm/", "\"arm/\" names none"),
            ("world arm/elbow", "each as ROBOT/JOINT: the world has no joints"),
        ] {
            let said = asked(&format!("gear {ends}")).unwrap_err();
            assert!(said.contains(part), "{ends}: {said}");
        }
    }

    #[test]
    fn options_that_mean_nothing_for_a_kind_are_refused() {
        for (arguments, part) in [
            ("gear a/j b/j --parent-pose 0,0,1", "a gear has no use for --parent-pose: it is between"),
            ("gear a/j b/j --child-pose 0,0,1 --max-torque 5", "no use for --child-pose and --max-torque"),
            ("point-to-point a b --max-torque 5", "a point-to-point has no use for --max-torque"),
            ("distance a b --max-torque 5", "a distance has no use for --max-torque"),
        ] {
            let said = asked(arguments).unwrap_err();
            assert!(said.contains(part), "{arguments}: {said}");
        }
        for arguments in [
            "gear a/j b/j --ratio 2 --offset 0.1 --max-force 5 --breaks --disable-collisions",
            "weld a b --parent-pose 0,0,1 --child-pose 0,0,1 --max-torque 5",
            "hinge a b --axis 0,0,1 --max-torque 5",
            "distance a b --parent-pose 0,0,1 --length 1 --max-force 5",
        ] {
            assert!(asked(arguments).is_ok(), "{arguments}");
        }
    }
}
