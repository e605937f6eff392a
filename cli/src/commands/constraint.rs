//! `simctl constraint`: constraints between links, in addition to the joints of their robots.

mod create;

use clap::{Args, Subcommand};
use serde::Serialize;
use simd_client::{
    Client,
    proto::{self, ChangeConstraintRequest, ConstraintEnd, Pose, Vector3},
};

use self::create::Create;
use crate::{
    failure::Usage,
    output::{
        Output, View,
        json::{self, PoseView},
        number::{fixed, several},
        table::{Column, Page, Table},
    },
    pose,
};

#[derive(Debug, Subcommand)]
pub(crate) enum Constraint {
    /// Connects two links, or a link and the world
    Create(Box<Create>),
    /// Shows the constraints, with their forces and errors
    List {
        /// Only constraints of this robot
        robot: Option<String>,
    },
    /// Changes a constraint
    Change(Box<Change>),
    /// Deletes a constraint
    Delete {
        /// Name of the constraint
        name: String,
    },
}

#[derive(Args, Debug)]
pub(crate) struct Change {
    /// Name of the constraint
    name: String,
    /// Frame on the parent: metres, and radians about the fixed axes
    #[arg(long, value_name = "X,Y,Z[,ROLL,PITCH,YAW]", value_parser = pose::parse, allow_hyphen_values = true)]
    parent_pose: Option<Pose>,
    /// Frame on the child
    #[arg(long, value_name = "X,Y,Z[,ROLL,PITCH,YAW]", value_parser = pose::parse, allow_hyphen_values = true)]
    child_pose: Option<Pose>,
    /// Maximum force, N; `inf` means no limit
    #[arg(long, value_name = "NEWTON")]
    max_force: Option<f64>,
    /// Maximum torque, N m; `inf` means no limit
    #[arg(long, value_name = "NEWTON_METRE")]
    max_torque: Option<f64>,
    /// Whether the constraint is deleted if it needs more than its limits
    #[arg(long, value_name = "BOOL", action = clap::ArgAction::Set)]
    breaks: Option<bool>,
    /// Ratio of a gear: motion of the child's joint per motion of the parent's
    #[arg(long, allow_hyphen_values = true)]
    ratio: Option<f64>,
    /// Offset of a gear, rad or m
    #[arg(long, allow_hyphen_values = true)]
    offset: Option<f64>,
    /// Length of a distance, metres
    #[arg(long)]
    length: Option<f64>,
}

pub(crate) async fn run(command: Constraint, client: &Client, output: Output) -> anyhow::Result<()> {
    match command {
        Constraint::Create(create) => {
            let created = client.create_constraint(create::request(*create)?).await?;
            output.one(&Created { created })
        }
        Constraint::List { robot } => {
            let all = client.constraints(robot.as_deref()).await?;
            let views: Vec<ConstraintView> = all.into_iter().map(ConstraintView::new).collect();
            output.list(&views, list)
        }
        Constraint::Change(change) => {
            let changed = self::change(*change, client).await?;
            output.one(&Changed { changed })
        }
        Constraint::Delete { name } => {
            client.delete_constraint(&name).await?;
            output.one(&Deleted { deleted: name })
        }
    }
}

/// Changes a constraint, and returns its name.
async fn change(change: Change, client: &Client) -> anyhow::Result<String> {
    let Change { name, parent_pose, child_pose, max_force, max_torque, breaks, ratio, offset, length } =
        change;
    let given = create::given(parent_pose.as_ref(), child_pose.as_ref(), max_torque);
    let of_some_kinds = given.iter().any(|(_, is_given)| *is_given);
    let others = [max_force, ratio, offset, length].iter().any(Option::is_some) || breaks.is_some();
    if !of_some_kinds && !others {
        let sentence = "give at least one of: --parent-pose, --child-pose, --max-force, --max-torque, \
                        --breaks, --ratio, --offset or --length";
        return Err(Usage(sentence.to_owned()).into());
    }
    if of_some_kinds {
        let all = client.constraints(None).await?;
        // The daemon refuses an unknown one.
        if let Some(constraint) = all.iter().find(|constraint| constraint.name == name) {
            create::refuse_idle(constraint.kind(), given)?;
        }
    }
    let request = ChangeConstraintRequest {
        name: name.clone(),
        parent_pose,
        child_pose,
        max_force,
        max_torque,
        breaks,
        ratio,
        offset,
        length,
        ..Default::default()
    };
    client.change_constraint(request).await?;
    Ok(name)
}

#[derive(Serialize)]
struct Created {
    created: String,
}

impl View for Created {
    fn page(&self) -> Page {
        Page::of_line(format!("constraint {} created", self.created))
    }
}

#[derive(Serialize)]
struct Changed {
    changed: String,
}

impl View for Changed {
    fn page(&self) -> Page {
        Page::of_line(format!("constraint {} changed", self.changed))
    }
}

#[derive(Serialize)]
struct Deleted {
    deleted: String,
}

impl View for Deleted {
    fn page(&self) -> Page {
        Page::of_line(format!("constraint {} deleted", self.deleted))
    }
}

#[derive(Serialize)]
struct EndView {
    /// Null: the world.
    robot: Option<String>,
    link: Option<String>,
    /// Present for a gear.
    joint: Option<String>,
    pose: Option<PoseView>,
}

impl EndView {
    fn new(end: Option<ConstraintEnd>) -> Self {
        let ConstraintEnd { robot, link, joint, pose } = end.unwrap_or_default();
        let some = |text: String| Some(text).filter(|text| !text.is_empty());
        Self {
            robot: some(robot),
            link: some(link),
            joint: some(joint),
            pose: pose.as_ref().map(PoseView::from),
        }
    }

    fn in_short(&self) -> String {
        match (&self.robot, self.joint.as_ref().or(self.link.as_ref())) {
            (Some(robot), Some(part)) => format!("{robot}/{part}"),
            (Some(robot), None) => robot.clone(),
            (None, _) => "world".to_owned(),
        }
    }
}

/// `Constraint` of the schema; null for values that a kind does not have, and for an absent limit.
#[derive(Serialize)]
struct ConstraintView {
    name: String,
    kind: String,
    parent: EndView,
    child: EndView,
    axis: Option<[f64; 3]>,
    ratio: Option<f64>,
    offset: Option<f64>,
    length: Option<f64>,
    rope: bool,
    max_force: Option<f64>,
    max_torque: Option<f64>,
    breaks: bool,
    disable_collisions: bool,
    force: [f64; 3],
    torque: [f64; 3],
    point: [f64; 3],
    position_error: f64,
    angle_error: f64,
    velocity_residual: f64,
    angular_residual: f64,
    saturated: bool,
}

impl ConstraintView {
    /// Returns its state. If the error is larger than loads can cause, the ends are still moving, or others
    /// hold them.
    fn state(&self) -> &'static str {
        const FAR: [f64; 2] = [1e-3, 3e-3];
        match self.saturated {
            true => "saturated",
            false if self.position_error > FAR[0] || self.angle_error > FAR[1] => "is off",
            false => "holds",
        }
    }

    /// Returns its errors, mm and mrad. A gear has only one of them, the angle if it has a torque.
    fn errors(&self) -> [String; 2] {
        let shown = |error: f64| fixed(error * 1e3, 3);
        let none = || "-".to_owned();
        match self.kind.as_str() {
            "gear" if self.torque != [0.0; 3] => [none(), shown(self.position_error)],
            "gear" => [shown(self.position_error), none()],
            _ => [shown(self.position_error), shown(self.angle_error)],
        }
    }
}

impl ConstraintView {
    fn new(of: proto::Constraint) -> Self {
        let vector = |vector: &Option<Vector3>| vector.as_ref().map(json::vector).unwrap_or_default();
        Self {
            kind: json::name("CONSTRAINT_KIND_", of.kind().as_str_name()),
            axis: of.axis.as_ref().map(json::vector),
            force: vector(&of.force),
            torque: vector(&of.torque),
            point: vector(&of.point),
            name: of.name,
            parent: EndView::new(of.parent),
            child: EndView::new(of.child),
            ratio: of.ratio,
            offset: of.offset,
            length: of.length,
            rope: of.rope,
            max_force: of.max_force,
            max_torque: of.max_torque,
            breaks: of.breaks,
            disable_collisions: of.disable_collisions,
            position_error: of.position_error,
            angle_error: of.angle_error,
            velocity_residual: of.velocity_residual,
            angular_residual: of.angular_residual,
            saturated: of.saturated,
        }
    }
}

fn list(views: &[ConstraintView]) -> Page {
    let columns = vec![
        Column::left("CONSTRAINT"),
        Column::left("KIND"),
        Column::left("PARENT"),
        Column::left("CHILD"),
        Column::right("FORCE [N]"),
        Column::right("TORQUE [Nm]"),
        Column::right("ERROR [mm]"),
        Column::right("ANGLE [mrad]"),
        Column::left("STATE"),
    ];
    let row = |of: &ConstraintView| {
        let [shift, angle] = of.errors();
        vec![
            of.name.clone(),
            of.kind.replace('_', "-"),
            of.parent.in_short(),
            of.child.in_short(),
            several(&of.force, 3),
            several(&of.torque, 3),
            shift,
            angle,
            of.state().to_owned(),
        ]
    };
    Page::new().table(Table::new(columns, views.iter().map(row).collect()))
}
