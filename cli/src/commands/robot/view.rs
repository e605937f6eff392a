//! Output of robots.

use serde::Serialize;
use simd_client::{
    Reloaded, Spawned,
    proto::{EntityInfo, Finding, GetEntityStateResponse, LinkInfo, LoadReport, Twist},
};

use super::filter::FilterView;
use crate::{
    commands::present,
    output::{
        View,
        json::{self, PoseView, Stamp},
        number::{ABSENT, count, fixed, several},
        table::{Column, Page, Table},
    },
    pose::roll_pitch_yaw,
};

/// A row of `robot list`, and `robot` of the others.
#[derive(Serialize)]
pub(super) struct RobotView {
    name: String,
    model: String,
    /// `fixed` or `free`.
    base: String,
    /// Kilograms.
    mass: f64,
    links: usize,
    joints: u32,
    moving_joints: u32,
    layout_version: u64,
    description: String,
    loaded_at_start: bool,
    /// Reason why it is disabled, or null.
    disabled_reason: Option<String>,
}

impl From<EntityInfo> for RobotView {
    fn from(entity: EntityInfo) -> Self {
        Self {
            base: json::name("BASE_", entity.base().as_str_name()),
            name: entity.name,
            model: entity.model,
            mass: entity.mass,
            links: entity.links.len(),
            joints: entity.joints,
            moving_joints: entity.moving_joints,
            layout_version: entity.layout_version,
            description: entity.description,
            loaded_at_start: entity.loaded_at_start,
            disabled_reason: Some(entity.disabled_reason).filter(|reason| !reason.is_empty()),
        }
    }
}

impl RobotView {
    /// Returns a summary such as "2 links, 1 moving joint, fixed base".
    fn in_short(&self) -> String {
        let joints = count(self.moving_joints as usize, "moving joint");
        format!("{}, {joints}, {} base", count(self.links, "link"), self.base)
    }
}

pub(super) fn list(robots: &[RobotView]) -> Page {
    if robots.is_empty() {
        return Page::of_line("no robots; `simctl robot load PATH` loads one");
    }
    let columns = vec![
        Column::left("ROBOT"),
        Column::left("MODEL"),
        Column::left("BASE"),
        Column::right("LINKS"),
        Column::right("JOINTS"),
        Column::right("MOVING"),
        Column::right("MASS [kg]"),
        Column::left("DISABLED"),
    ];
    let row = |robot: &RobotView| {
        vec![
            robot.name.clone(),
            robot.model.clone(),
            robot.base.clone(),
            robot.links.to_string(),
            robot.joints.to_string(),
            robot.moving_joints.to_string(),
            fixed(robot.mass, 4),
            robot.disabled_reason.as_ref().map_or(ABSENT, |_| "yes").to_owned(),
        ]
    };
    let page = Page::new().table(Table::new(columns, robots.iter().map(row).collect()));
    let reasons = robots.iter().filter_map(|robot| Some((&robot.name, robot.disabled_reason.as_ref()?)));
    reasons.fold(page, |page, (name, reason)| page.line(format!("{name} is disabled: {reason}")))
}

/// Report on a description.
#[derive(Serialize)]
struct ReportView {
    summary: String,
    findings: Vec<FindingView>,
}

/// One element and its treatment.
#[derive(Serialize)]
pub(super) struct FindingView {
    /// `info`, `warning` or `error`.
    pub(super) severity: String,
    /// `used`, `defaulted`, `repaired`, `ignored` or `refused`.
    pub(super) disposition: String,
    pub(super) element: String,
    /// Mesh file that it concerns; null if it concerns the description.
    pub(super) file: Option<String>,
    /// Null if it does not apply.
    pub(super) line: Option<u32>,
    pub(super) message: String,
}

impl From<LoadReport> for ReportView {
    fn from(report: LoadReport) -> Self {
        let view = |finding: Finding| FindingView {
            severity: json::name("SEVERITY_", finding.severity().as_str_name()),
            disposition: json::name("DISPOSITION_", finding.disposition().as_str_name()),
            element: finding.element,
            file: Some(finding.file).filter(|file| !file.is_empty()),
            line: Some(finding.line).filter(|line| *line > 0),
            message: finding.message,
        };
        Self { summary: report.summary, findings: report.findings.into_iter().map(view).collect() }
    }
}

/// `robot load`.
#[derive(Serialize)]
pub(super) struct Loaded {
    robot: RobotView,
    /// Other robots of the same file.
    others: Vec<RobotView>,
    report: ReportView,
    stamp: Stamp,
}

impl From<Spawned> for Loaded {
    fn from(spawned: Spawned) -> Self {
        Self {
            robot: spawned.entity.into(),
            others: spawned.others.into_iter().map(RobotView::from).collect(),
            report: spawned.report.into(),
            stamp: spawned.stamp.into(),
        }
    }
}

impl View for Loaded {
    fn page(&self) -> Page {
        let robots = std::iter::once(&self.robot).chain(&self.others);
        robots.fold(Page::new(), |page, robot| {
            page.line(format!("loaded {}: {}", robot.name, robot.in_short()))
        })
    }
}

/// `robot reload`.
#[derive(Serialize)]
pub(super) struct ReloadedView {
    robot: RobotView,
    report: ReportView,
    stamp: Stamp,
    added_joints: Vec<String>,
    removed_joints: Vec<String>,
}

impl From<Reloaded> for ReloadedView {
    fn from(reloaded: Reloaded) -> Self {
        Self {
            robot: reloaded.entity.into(),
            report: reloaded.report.into(),
            stamp: reloaded.stamp.into(),
            added_joints: reloaded.added_joints,
            removed_joints: reloaded.removed_joints,
        }
    }
}

impl View for ReloadedView {
    fn page(&self) -> Page {
        let mut line = format!("reloaded {}: {}", self.robot.name, self.robot.in_short());
        for (verb, joints) in [("added", &self.added_joints), ("removed", &self.removed_joints)] {
            if !joints.is_empty() {
                line.push_str(&format!("; {verb} {}", joints.join(", ")));
            }
        }
        Page::of_line(line)
    }
}

/// `robot delete`.
#[derive(Serialize)]
pub(super) struct Deleted {
    pub(super) deleted: String,
    pub(super) stamp: Stamp,
}

impl View for Deleted {
    fn page(&self) -> Page {
        Page::of_line(format!("deleted {} at {}", self.deleted, self.stamp))
    }
}

/// `robot info`.
#[derive(Serialize)]
pub(super) struct InfoView {
    #[serde(flatten)]
    robot: RobotWithLinks,
    stamp: Stamp,
    /// world_from_root.
    pose: PoseView,
    /// Twist of the root link's origin, world axes.
    twist: TwistView,
    /// Its collision filter.
    collision_filter: FilterView,
    #[serde(skip)]
    roll_pitch_yaw: [f64; 3],
}

/// A robot whose `links` are the links and not their number.
#[derive(Serialize)]
struct RobotWithLinks {
    name: String,
    model: String,
    base: String,
    mass: f64,
    links: Vec<LinkView>,
    joints: u32,
    moving_joints: u32,
    layout_version: u64,
    description: String,
    loaded_at_start: bool,
    disabled_reason: Option<String>,
}

#[derive(Serialize)]
struct LinkView {
    name: String,
    /// Null for the root.
    parent: Option<String>,
    /// Kilograms.
    mass: f64,
    /// In the link's frame, metres.
    center_of_mass: [f64; 3],
    /// xx xy xz yy yz zz, kg m^2.
    inertia: Vec<f64>,
}

impl From<LinkInfo> for LinkView {
    fn from(link: LinkInfo) -> Self {
        Self {
            name: link.name,
            parent: Some(link.parent).filter(|parent| !parent.is_empty()),
            mass: link.mass,
            center_of_mass: link.center_of_mass.as_ref().map(json::vector).unwrap_or_default(),
            inertia: link.inertia,
        }
    }
}

#[derive(Default, Serialize)]
struct TwistView {
    /// m/s.
    linear: [f64; 3],
    /// rad/s.
    angular: [f64; 3],
}

impl From<Twist> for TwistView {
    fn from(twist: Twist) -> Self {
        Self {
            linear: twist.linear.as_ref().map(json::vector).unwrap_or_default(),
            angular: twist.angular.as_ref().map(json::vector).unwrap_or_default(),
        }
    }
}

impl InfoView {
    pub(super) fn new(
        mut entity: EntityInfo,
        state: GetEntityStateResponse,
        collision_filter: FilterView,
    ) -> anyhow::Result<Self> {
        let links = std::mem::take(&mut entity.links).into_iter().map(LinkView::from).collect();
        let robot = RobotView::from(entity);
        let pose = present(state.pose, "pose")?;
        Ok(Self {
            robot: RobotWithLinks {
                name: robot.name,
                model: robot.model,
                base: robot.base,
                mass: robot.mass,
                links,
                joints: robot.joints,
                moving_joints: robot.moving_joints,
                layout_version: robot.layout_version,
                description: robot.description,
                loaded_at_start: robot.loaded_at_start,
                disabled_reason: robot.disabled_reason,
            },
            collision_filter,
            stamp: present(state.stamp, "stamp")?.into(),
            pose: PoseView::from(&pose),
            twist: state.twist.map(TwistView::from).unwrap_or_default(),
            roll_pitch_yaw: pose.orientation.as_ref().map(roll_pitch_yaw).unwrap_or_default(),
        })
    }
}

impl View for InfoView {
    fn page(&self) -> Page {
        let robot = &self.robot;
        let mut pairs = vec![
            ("robot", robot.name.clone()),
            ("model", robot.model.clone()),
            ("base", robot.base.clone()),
            ("mass", format!("{} kg", fixed(robot.mass, 4))),
            ("joints", format!("{}, {} moving", robot.joints, robot.moving_joints)),
            ("position", format!("{} m", several(&self.pose.position, 4))),
            ("roll pitch yaw", format!("{} rad", several(&self.roll_pitch_yaw, 4))),
            ("linear velocity", format!("{} m/s", several(&self.twist.linear, 4))),
            ("angular velocity", format!("{} rad/s", several(&self.twist.angular, 4))),
            ("touches", self.collision_filter.in_short()),
        ];
        if let Some(reason) = &robot.disabled_reason {
            pairs.push(("disabled", reason.clone()));
        }
        let columns = vec![
            Column::left("LINK"),
            Column::left("PARENT"),
            Column::right("MASS [kg]"),
            Column::right("CENTER OF MASS [m]"),
        ];
        let row = |link: &LinkView| {
            vec![
                link.name.clone(),
                link.parent.clone().unwrap_or_else(|| ABSENT.to_owned()),
                fixed(link.mass, 4),
                several(&link.center_of_mass, 4),
            ]
        };
        let links = Table::new(columns, robot.links.iter().map(row).collect());
        Page::new().pairs(pairs).line("").table(links)
    }
}
