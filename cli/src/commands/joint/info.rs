//! Properties of joints, as in `joint list`.

use serde::Serialize;
use simd_client::proto::{JointGains, JointInfo, JointSpring, JointTendonTerm, JointType};

use super::blocked::BlockedBy;
use super::reading::Unit;
use crate::output::{
    json::{self, PoseView},
    number::{ABSENT, fixed, optional, several},
    table::{Column, Page, Table},
};

/// A row of `joint list`. Radians and newton metres for joints that turn, metres and newtons for joints that
/// slide; null if absent.
#[derive(Serialize)]
pub(super) struct InfoView {
    index: u32,
    name: String,
    /// `revolute`, `continuous`, `prismatic`, `fixed`, `floating`, `planar` or `spherical`.
    r#type: String,
    /// Unit vector in the joint's frame.
    axis: Option<[f64; 3]>,
    parent_link: String,
    child_link: String,
    parent_from_joint: Option<PoseView>,
    world_from_joint: Option<PoseView>,
    limits: LimitsView,
    damping: f64,
    friction: f64,
    armature: f64,
    spring: Option<SpringView>,
    /// Its actuator compensates the weight of what hangs on it.
    gravity_compensation: bool,
    /// Its setpoint follows a velocity profile on its way to a position target.
    profile: bool,
    mimic: Option<MimicView>,
    tendon: Option<TendonView>,
    /// `passive`, `position`, `velocity`, `effort`, `hold` or `none`.
    mode: String,
    gains: Option<GainsView>,
    default_gains: Option<GainsView>,
    claimed_by: Option<String>,
    /// Link whose contact keeps it from its target; null if none.
    blocked_by: Option<BlockedBy>,
    #[serde(skip)]
    unit: Option<Unit>,
}

#[derive(Default, Serialize)]
struct LimitsView {
    lower: Option<f64>,
    upper: Option<f64>,
    effort: Option<f64>,
    velocity: Option<f64>,
}

#[derive(Serialize)]
struct MimicView {
    joint: String,
    multiplier: f64,
    offset: f64,
}

#[derive(Serialize)]
struct TendonView {
    terms: Vec<TermView>,
    offset: f64,
}

#[derive(Serialize)]
struct TermView {
    joint: String,
    factor: f64,
}

#[derive(Serialize)]
struct SpringView {
    stiffness: f64,
    rest: f64,
}

#[derive(Serialize)]
struct GainsView {
    stiffness: f64,
    damping: f64,
}

impl From<&JointGains> for GainsView {
    fn from(gains: &JointGains) -> Self {
        Self { stiffness: gains.stiffness, damping: gains.damping }
    }
}

impl From<&JointInfo> for InfoView {
    fn from(joint: &JointInfo) -> Self {
        let limits = joint.limits.as_ref().map(|limits| LimitsView {
            lower: limits.lower,
            upper: limits.upper,
            effort: limits.effort,
            velocity: limits.velocity,
        });
        let mimic = joint.mimic.as_ref().map(|mimic| MimicView {
            joint: mimic.joint.clone(),
            multiplier: mimic.multiplier,
            offset: mimic.offset,
        });
        let term = |term: &JointTendonTerm| TermView { joint: term.joint.clone(), factor: term.factor };
        let tendon = joint.tendon.as_ref().map(|tendon| TendonView {
            terms: tendon.terms.iter().map(term).collect(),
            offset: tendon.offset,
        });
        // A fixed joint has no meaningful axis.
        let axis = joint.axis.as_ref().filter(|_| joint.r#type() != JointType::Fixed);
        Self {
            index: joint.index,
            name: joint.name.clone(),
            r#type: json::name("JOINT_TYPE_", joint.r#type().as_str_name()),
            axis: axis.map(json::vector),
            parent_link: joint.parent_link.clone(),
            child_link: joint.child_link.clone(),
            parent_from_joint: joint.parent_from_joint.as_ref().map(PoseView::from),
            world_from_joint: joint.world_from_joint.as_ref().map(PoseView::from),
            limits: limits.unwrap_or_default(),
            damping: joint.damping,
            friction: joint.friction,
            armature: joint.armature,
            spring: joint.spring.map(|JointSpring { stiffness, rest }| SpringView { stiffness, rest }),
            gravity_compensation: joint.gravity_compensation,
            profile: joint.profile,
            mimic,
            tendon,
            mode: json::name("JOINT_MODE_", joint.mode().as_str_name()),
            gains: joint.gains.as_ref().map(GainsView::from),
            default_gains: joint.default_gains.as_ref().map(GainsView::from),
            claimed_by: Some(joint.claimed_by.clone()).filter(|holder| !holder.is_empty()),
            blocked_by: joint.obstruction.clone().map(BlockedBy::from),
            unit: Unit::of(joint.r#type()),
        }
    }
}

pub(super) fn list(joints: &[InfoView], wide: bool) -> Page {
    let unit = Unit::common(joints.iter().filter_map(|joint| joint.unit));
    let mut columns = vec![
        Column::right("#"),
        Column::left("JOINT"),
        Column::left("TYPE"),
        Column::left("AXIS"),
        Column::right(unit.heading("LOWER", Unit::position)),
        Column::right(unit.heading("UPPER", Unit::position)),
        Column::right(unit.heading("VELOCITY", Unit::velocity)),
        Column::right(unit.heading("EFFORT", Unit::effort)),
        Column::left("MODE"),
    ];
    // Most robots have no holder.
    let held = joints.iter().any(|joint| joint.claimed_by.is_some());
    columns.extend(held.then(|| Column::left("HELD BY")));
    let blocked = joints.iter().any(|joint| joint.blocked_by.is_some());
    columns.extend(blocked.then(|| Column::left("BLOCKED BY")));
    if wide {
        columns.extend([
            Column::right("STIFFNESS"),
            Column::right("GAIN DAMPING"),
            Column::right("DAMPING"),
            Column::right("FRICTION"),
            Column::left("PARENT"),
            Column::left("CHILD"),
        ]);
    }
    let rows = joints.iter().map(|joint| row(joint, [held, blocked], wide)).collect();
    Page::new().table(Table::new(columns, rows))
}

fn row(joint: &InfoView, [held, blocked]: [bool; 2], wide: bool) -> Vec<String> {
    let mut cells = vec![
        joint.index.to_string(),
        joint.name.clone(),
        if joint.tendon.is_some() { "tendon".to_owned() } else { joint.r#type.clone() },
        joint
            .axis
            .filter(|_| joint.tendon.is_none())
            .map_or_else(|| ABSENT.to_owned(), |axis| several(&axis, 2)),
        optional(joint.limits.lower, 4),
        optional(joint.limits.upper, 4),
        optional(joint.limits.velocity, 2),
        optional(joint.limits.effort, 2),
        joint.mode.replace("none", ABSENT),
    ];
    let or_absent = |cell: Option<String>| cell.unwrap_or_else(|| ABSENT.to_owned());
    cells.extend(held.then(|| or_absent(joint.claimed_by.clone())));
    cells.extend(blocked.then(|| or_absent(joint.blocked_by.as_ref().map(BlockedBy::name))));
    if wide {
        let moves = |value: f64| if joint.unit.is_some() { fixed(value, 4) } else { ABSENT.to_owned() };
        cells.extend([
            optional(joint.gains.as_ref().map(|gains| gains.stiffness), 3),
            optional(joint.gains.as_ref().map(|gains| gains.damping), 3),
            moves(joint.damping),
            moves(joint.friction),
            joint.parent_link.clone(),
            joint.child_link.clone(),
        ]);
    }
    cells
}

#[cfg(test)]
mod tests {
    use simd_client::proto::{JointLimits, JointMode, JointTendon, Vector3};

    use super::*;

    fn joint(name: &str, kind: JointType) -> JointInfo {
        JointInfo {
            name: name.into(),
            r#type: kind.into(),
            axis: Some(Vector3 { x: 0.0, y: 0.0, z: 1.0 }),
            mode: JointMode::Hold.into(),
            ..Default::default()
        }
    }

    #[test]
    fn an_absent_limit_is_a_dash_and_null_and_never_zero() {
        let mut elbow = joint("elbow", JointType::Revolute);
        elbow.limits =
            Some(JointLimits { lower: Some(-1.0), upper: None, effort: Some(0.0), velocity: None });
        let view = InfoView::from(&elbow);
        let expected = "\
#  JOINT  TYPE      AXIS            LOWER [rad]  UPPER [rad]  VELOCITY [rad/s]  EFFORT [N m]  MODE
0  elbow  revolute  0.00 0.00 1.00      -1.0000            -                 -          0.00  hold
";
        assert_eq!(list(&[view], false).render(false), expected);
        let json = serde_json::to_value(InfoView::from(&elbow)).unwrap();
        assert_eq!(json["limits"]["upper"], serde_json::Value::Null);
        assert_eq!(json["limits"]["effort"], 0.0);
        assert_eq!(json["type"], "revolute");
    }

    #[test]
    fn a_tendon_is_named_in_place_of_its_type_and_has_its_terms() {
        let term = JointTendonTerm { joint: "knuckle".into(), factor: 0.02 };
        let tendon = Some(JointTendon { terms: vec![term], offset: 0.1 });
        let view = InfoView::from(&JointInfo { tendon, ..joint("pull", JointType::Prismatic) });
        assert!(list(&[view], false).render(false).contains("0  pull   tendon  -"));
        let json = serde_json::to_value(InfoView::from(&joint("slide", JointType::Prismatic))).unwrap();
        assert_eq!(json["tendon"], serde_json::Value::Null);
    }

    #[test]
    fn holders_are_a_column_if_a_joint_is_claimed() {
        let free = joint("elbow", JointType::Revolute);
        let held = JointInfo { claimed_by: "planner".into(), ..joint("wrist", JointType::Revolute) };
        let lines = |joints: &[&JointInfo], wide| -> Vec<String> {
            let views: Vec<InfoView> = joints.iter().map(|joint| InfoView::from(*joint)).collect();
            list(&views, wide).render(false).lines().map(str::to_owned).collect()
        };
        let shown = lines(&[&free, &held], false);
        for (line, end) in shown.iter().zip(["MODE  HELD BY", "hold  -", "hold  planner"]) {
            assert!(line.ends_with(end), "{shown:?}");
        }
        assert!(lines(&[&held], true)[0].contains("MODE  HELD BY  STIFFNESS"));
        assert!(lines(&[&free], false)[0].ends_with("MODE"));
    }

    #[test]
    fn headings_name_both_units_where_joints_turn_and_slide() {
        let joints = [joint("a", JointType::Continuous), joint("b", JointType::Prismatic)];
        let views: Vec<InfoView> = joints.iter().map(InfoView::from).collect();
        let text = list(&views, false).render(false);
        assert!(text.contains("LOWER [rad, m]") && text.contains("EFFORT [N m, N]"), "{text}");
    }
}
