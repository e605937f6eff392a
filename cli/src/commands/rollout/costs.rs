//! Terms of the cost of a step, from a JSON document.

use anyhow::{Context as _, bail, ensure};
use serde::Deserialize;
use simd_client::proto::{
    Quaternion, RolloutContactTerm, RolloutCost, RolloutDistanceTerm, RolloutJointTerm, RolloutLinkTerm,
    Vector3, rollout_cost::Term,
};

use crate::text_file::{Object, from_json};

/// A term with its weights. It has exactly one of the optional fields.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Cost {
    #[serde(default = "one")]
    weight: f64,
    #[serde(default)]
    final_weight: f64,
    joint_positions: Option<Object<Joints>>,
    joint_velocities: Option<Object<Joints>>,
    joint_efforts: Option<Object<Joints>>,
    link_position: Option<Object<LinkPosition>>,
    link_orientation: Option<Object<LinkOrientation>>,
    contact_force: Option<Object<Links>>,
    nearness: Option<Object<Nearness>>,
}

fn one() -> f64 {
    1.0
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Joints {
    /// The command's robot if left out, as below.
    robot: Option<String>,
    joints: Vec<String>,
    targets: Vec<f64>,
    wrapped: bool,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct LinkPosition {
    robot: Option<String>,
    link: String,
    point: Option<[f64; 3]>,
    position: [f64; 3],
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct LinkOrientation {
    robot: Option<String>,
    link: String,
    /// x y z w.
    orientation: [f64; 4],
}

#[derive(Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Links {
    robot: Option<String>,
    links: Vec<String>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Nearness {
    robot: Option<String>,
    #[serde(default)]
    link: String,
    #[serde(default)]
    other_robot: String,
    #[serde(default)]
    other_link: String,
    distance: f64,
}

/// Reads a list of terms, for this robot if they name none.
pub(super) fn read(text: &str, robot: &str) -> anyhow::Result<Vec<RolloutCost>> {
    ensure!(!text.trim().is_empty(), "it is empty; it must be a list of terms");
    let all: Vec<Object<Cost>> = from_json(text)?;
    let request = |(index, Object(of)): (usize, Object<Cost>)| {
        of.request(robot).with_context(|| format!("term {index}"))
    };
    all.into_iter().enumerate().map(request).collect()
}

impl Cost {
    fn request(self, own: &str) -> anyhow::Result<RolloutCost> {
        let named = |robot: Option<String>| robot.unwrap_or_else(|| own.to_owned());
        let joints = |Object(of): Object<Joints>| {
            let Joints { robot, joints, targets, wrapped } = of;
            RolloutJointTerm { robot: named(robot), joints, targets, wrapped }
        };
        let place = |Object(of): Object<LinkPosition>| RolloutLinkTerm {
            robot: named(of.robot),
            link: of.link,
            point: of.point.map(vector),
            position: Some(vector(of.position)),
            orientation: None,
        };
        let turned = |Object(of): Object<LinkOrientation>| {
            let [x, y, z, w] = of.orientation;
            let orientation = Some(Quaternion { x, y, z, w });
            RolloutLinkTerm { robot: named(of.robot), link: of.link, orientation, ..Default::default() }
        };
        let touched =
            |Object(of): Object<Links>| RolloutContactTerm { robot: named(of.robot), links: of.links };
        let near = |Object(of): Object<Nearness>| {
            let Nearness { robot, link, other_robot, other_link, distance } = of;
            RolloutDistanceTerm { robot: named(robot), link, other_robot, other_link, distance }
        };
        let terms = [
            self.joint_positions.map(joints).map(Term::JointPositions),
            self.joint_velocities.map(joints).map(Term::JointVelocities),
            self.joint_efforts.map(joints).map(Term::JointEfforts),
            self.link_position.map(place).map(Term::LinkPosition),
            self.link_orientation.map(turned).map(Term::LinkOrientation),
            self.contact_force.map(touched).map(Term::ContactForce),
            self.nearness.map(near).map(Term::Nearness),
        ];
        let mut terms = terms.into_iter().flatten();
        let Some(term) = terms.next() else {
            bail!(
                "it must have one of `joint_positions`, `joint_velocities`, `joint_efforts`, `link_position`, \
                 `link_orientation`, `contact_force` and `nearness`"
            );
        };
        ensure!(terms.next().is_none(), "it has more than one kind: give each a term of its own");
        Ok(RolloutCost { weight: self.weight, final_weight: self.final_weight, term: Some(term) })
    }
}

fn vector([x, y, z]: [f64; 3]) -> Vector3 {
    Vector3 { x, y, z }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_term_is_that_of_the_schema() {
        let text = r#"[
            {"weight": 2, "joint_positions": {"joints": ["elbow"], "targets": [0.5], "wrapped": true}},
            {"joint_efforts": {}},
            {"weight": 0, "final_weight": 3, "link_position": {"link": "hand", "position": [1, 2, 3]}},
            {"link_orientation": {"robot": "other", "link": "hand", "orientation": [0, 0, 0, 1]}},
            {"contact_force": {"links": ["hand"]}},
            {"nearness": {"link": "hand", "other_robot": "post", "distance": 0.1}}
        ]"#;
        let [positions, efforts, place, turned, force, near] =
            <[RolloutCost; 6]>::try_from(read(text, "arm").unwrap()).unwrap();
        let joints = RolloutJointTerm {
            robot: "arm".into(),
            joints: vec!["elbow".into()],
            targets: vec![0.5],
            wrapped: true,
        };
        assert_eq!((positions.weight, positions.term), (2.0, Some(Term::JointPositions(joints))));
        assert_eq!((efforts.weight, efforts.final_weight), (1.0, 0.0));
        assert!(
            matches!(efforts.term, Some(Term::JointEfforts(of)) if of.robot == "arm" && of.joints.is_empty())
        );
        assert_eq!((place.weight, place.final_weight), (0.0, 3.0));
        let Some(Term::LinkPosition(of)) = place.term else { panic!("{place:?}") };
        assert_eq!((of.link.as_str(), of.point, of.position), ("hand", None, Some(vector([1.0, 2.0, 3.0]))));
        let Some(Term::LinkOrientation(of)) = turned.term else { panic!("{turned:?}") };
        assert_eq!((of.robot.as_str(), of.orientation.unwrap().w), ("other", 1.0));
        assert!(matches!(force.term, Some(Term::ContactForce(of)) if of.links == ["hand"]));
        assert!(
            matches!(near.term, Some(Term::Nearness(of)) if of.other_robot == "post" && of.distance == 0.1)
        );
    }

    #[test]
    fn faults_name_their_term_or_their_line() {
        let said = |text: &str| match read(text, "arm") {
            Ok(found) => panic!("{text}: {found:?}"),
            Err(error) => format!("{error:#}"),
        };
        for (text, part) in [
            ("", "it is empty"),
            (r#"[{"weight": 1}]"#, "term 0: it must have one of `joint_positions`"),
            (
                r#"[{"joint_efforts": {}}, {"joint_efforts": {}, "contact_force": {}}]"#,
                "term 1: it has more than one kind",
            ),
            (r#"[{"joint_effort": {}}]"#, "unknown field `joint_effort`"),
            (r#"[{"link_position": {"link": "hand"}}]"#, "missing field `position`"),
            ("[\n{\"joint_efforts\": 1}]", "expected an object at line 2"),
            (r#"[{"weight": "much", "joint_efforts": {}}]"#, "string \"much\", expected a number"),
            ("[{\"joint_efforts\": {}},\n[2, 0]]", "sequence, expected an object at line 2"),
            ("[\n{\"joint_efforts\": []}]", "sequence, expected an object at line 2"),
            (r#"[{"nearness": ["arm", "hand", "", "", 0.1]}]"#, "sequence, expected an object at line 1"),
        ] {
            assert!(said(text).contains(part), "{text}: {}", said(text));
        }
    }
}
