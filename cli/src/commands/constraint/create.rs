//! `simctl constraint create`: what a kind is asked for, and which options it has a use for.

use clap::{Args, ValueEnum};
use simd_client::proto::{ConstraintEnd, ConstraintKind, CreateConstraintRequest, Pose, Vector3};

use crate::{failure::Usage, output::json, pose};

#[derive(Args, Debug)]
pub(crate) struct Create {
    /// What it asks for
    kind: Kind,
    /// The first end
    #[arg(value_name = "world|ROBOT[/LINK]|ROBOT/JOINT")]
    parent: String,
    /// The second one; ends of a gear are joints
    #[arg(value_name = "world|ROBOT[/LINK]|ROBOT/JOINT")]
    child: String,
    /// Its name; made up where it is left out
    #[arg(long, default_value = "", hide_default_value = true)]
    name: String,
    /// Where on the parent, metres, and radians about the fixed axes; at the link's origin if left out
    #[arg(long, value_name = "X,Y,Z[,ROLL,PITCH,YAW]", value_parser = pose::parse, allow_hyphen_values = true)]
    parent_pose: Option<Pose>,
    /// Where on the child; where that of the parent is now if left out
    #[arg(long, value_name = "X,Y,Z[,ROLL,PITCH,YAW]", value_parser = pose::parse, allow_hyphen_values = true)]
    child_pose: Option<Pose>,
    /// Of a hinge or slide; 1,0,0 if left out
    #[arg(long, value_name = "X,Y,Z", value_parser = pose::parse_vector, allow_hyphen_values = true)]
    axis: Option<Vector3>,
    /// Of a gear: child = ratio * parent + offset
    #[arg(long, allow_hyphen_values = true)]
    ratio: Option<f64>,
    /// Of a gear, rad or m; as it is now if left out
    #[arg(long, allow_hyphen_values = true)]
    offset: Option<f64>,
    /// Of a distance, metres; as it is now if left out
    #[arg(long)]
    length: Option<f64>,
    /// A distance pulls and does not push
    #[arg(long)]
    rope: bool,
    /// The most it does, N; of a gear N m or N
    #[arg(long, value_name = "NEWTON")]
    max_force: Option<f64>,
    /// The most it does, N m
    #[arg(long, value_name = "NEWTON_METRE")]
    max_torque: Option<f64>,
    /// It goes where it would need more
    #[arg(long)]
    breaks: bool,
    /// The two links do not touch each other
    #[arg(long)]
    disable_collisions: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Kind {
    /// The two frames are one
    Weld,
    /// Their origins are one
    PointToPoint,
    /// What is left is a turn about the axis
    Hinge,
    /// What is left is a shift along the axis
    Slide,
    /// A joint follows another
    Gear,
    /// The origins are so far from each other
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

/// Options that not every kind has a use for, and whether they were given.
pub(super) type Given = [(&'static str, bool); 3];

pub(super) fn given(parent_pose: Option<&Pose>, child_pose: Option<&Pose>, max_torque: Option<f64>) -> Given {
    [
        ("--parent-pose", parent_pose.is_some()),
        ("--child-pose", child_pose.is_some()),
        ("--max-torque", max_torque.is_some()),
    ]
}

/// Refuses what a kind has no use for. The daemon keeps it for all kinds, and nothing would come of it.
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

/// What the daemon is asked for.
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

/// `world`, `ROBOT` or `ROBOT/LINK`; of a gear `ROBOT/JOINT`. A robot's name has no slash.
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
    use crate::args::{Arguments, Command};
    use crate::commands::constraint::Constraint;

    /// What `simctl constraint create` asks for with these arguments.
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
