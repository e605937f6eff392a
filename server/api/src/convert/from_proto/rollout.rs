//! Rollouts: inputs of the copies of a world, and the requested outputs.

use simd_core::rollout::RolloutRequest;
use simd_core::rollout::request::{
    Control, ControlMode, Cost, CostTerm, Feedback, Interpolation, Named, Quantity, Start, Values, Variation,
    Varied,
};
use simd_proto::v1;

use super::geometry;
use crate::convert::field::{BadField, Path};

/// Returns the name of the saved state where copies start, which may be empty, and the rest of the request.
pub fn rollout(request: v1::RolloutRequest) -> Result<(String, RolloutRequest), BadField> {
    let v1::RolloutRequest {
        saved_state,
        copies,
        steps,
        controls,
        starts,
        variations,
        seed,
        quantities,
        record_steps,
        record_start,
        costs,
        return_step_costs,
    } = request;
    let saved_state = Path::ROOT.field("saved_state").short(saved_state)?;
    let request = RolloutRequest {
        copies: usize::try_from(copies).unwrap_or(usize::MAX),
        steps: steps.into(),
        starts: each("starts", starts, start)?,
        variations: each("variations", variations, variation)?,
        seed,
        controls: each("controls", controls, control)?,
        quantities: each("quantities", quantities, quantity)?,
        record_every: record_steps.into(),
        record_start,
        costs: each("costs", costs, cost)?,
        step_costs: return_step_costs,
    };
    Ok((saved_state, request))
}

/// Parses each entry of a list.
fn each<W, C>(
    list: &str,
    entries: Vec<W>,
    convert: impl Fn(&Path<'_>, W) -> Result<C, BadField>,
) -> Result<Vec<C>, BadField> {
    let convert = |(index, entry)| convert(&Path::ROOT.item(list, index), entry);
    entries.into_iter().enumerate().map(convert).collect()
}

/// Parses packed numbers, little-endian.
fn numbers(at: &Path<'_>, bytes: &[u8]) -> Result<Vec<f64>, BadField> {
    let (numbers, rest) = bytes.as_chunks();
    if rest.is_empty() {
        return Ok(numbers.iter().map(|number| f64::from_le_bytes(*number)).collect());
    }
    Err(at.refuse(format_args!("{} bytes long", bytes.len()), "it must have 8 bytes a number"))
}

fn names(at: &Path<'_>, list: &str, names: Vec<String>) -> Result<Vec<String>, BadField> {
    at.each_once(list, &names)?;
    names.into_iter().enumerate().map(|(index, name)| at.item(list, index).name(name)).collect()
}

fn named(at: &Path<'_>, robot: String, list: &str, given: Vec<String>) -> Result<Named, BadField> {
    Ok(Named { robot: at.field("robot").name(robot)?, names: names(at, list, given)? })
}

/// Returns a number, and 1 for 0.
fn at_least_one(number: u32) -> u32 {
    number.max(1)
}

fn control(at: &Path<'_>, given: v1::RolloutControl) -> Result<Control, BadField> {
    let mode = match at.field("mode").known(given.mode)? {
        v1::RolloutControlMode::Unspecified | v1::RolloutControlMode::Position => ControlMode::Position,
        v1::RolloutControlMode::Velocity => ControlMode::Velocity,
        v1::RolloutControlMode::Effort => ControlMode::Effort,
    };
    let interpolation = match at.field("interpolation").known(given.interpolation)? {
        v1::RolloutInterpolation::Unspecified | v1::RolloutInterpolation::Hold => Interpolation::Hold,
        v1::RolloutInterpolation::Linear => Interpolation::Linear,
        v1::RolloutInterpolation::Cubic => Interpolation::Cubic,
    };
    let feedback = |given: v1::RolloutFeedback| {
        let at = at.field("feedback");
        Ok::<_, BadField>(Feedback {
            joints: names(&at, "joints", given.joints)?,
            gains: numbers(&at.field("gains"), &given.gains)?,
            references: numbers(&at.field("references"), &given.references)?,
        })
    };
    Ok(Control {
        robot: at.field("robot").name(given.robot)?,
        joints: names(at, "joints", given.joints)?,
        mode,
        values: numbers(&at.field("values"), &given.values)?,
        knots: usize::try_from(at_least_one(given.knots)).unwrap_or(usize::MAX),
        knot_steps: at_least_one(given.knot_steps).into(),
        interpolation,
        stiffness: given.stiffness,
        damping: given.damping,
        feedback: given.feedback.map(feedback).transpose()?,
    })
}

fn start(at: &Path<'_>, given: v1::RolloutStart) -> Result<Start, BadField> {
    Ok(Start {
        robot: at.field("robot").name(given.robot)?,
        joints: names(at, "joints", given.joints)?,
        positions: numbers(&at.field("positions"), &given.positions)?,
        velocities: numbers(&at.field("velocities"), &given.velocities)?,
        roots: numbers(&at.field("roots"), &given.roots)?,
        root_twists: numbers(&at.field("root_twists"), &given.root_twists)?,
    })
}

fn variation(at: &Path<'_>, given: v1::RolloutVariation) -> Result<Variation, BadField> {
    use v1::rollout_variation::Values as Wire;
    let of_at = at.field("of");
    let kind = of_at.known(given.of)?;
    let mut named = named(at, given.robot, "names", given.names)?;
    let of = match kind {
        v1::RolloutVaried::Unspecified => return Err(of_at.refuse("not given", "it must be given")),
        v1::RolloutVaried::JointPositions => Varied::JointPositions(named),
        v1::RolloutVaried::JointVelocities => Varied::JointVelocities(named),
        v1::RolloutVaried::LinkMasses => Varied::LinkMasses(named),
        v1::RolloutVaried::JointFriction => Varied::JointFriction(named),
        v1::RolloutVaried::JointDamping => Varied::JointDamping(named),
        v1::RolloutVaried::Gains => Varied::Gains(named),
        v1::RolloutVaried::SurfaceFriction => Varied::SurfaceFriction(named),
        v1::RolloutVaried::Wrench => {
            let count = named.names.len();
            let Some(link) = named.names.pop().filter(|_| count == 1) else {
                let expected = "it must have 1: a wrench is on one link";
                return Err(at.field("names").refuse(format_args!("{count} names long"), expected));
            };
            let (at, steps) = (given.wrench_step.into(), given.wrench_steps.into());
            Varied::Wrench { robot: named.robot, link, at, steps }
        }
    };
    let values = match at.field("values").given(given.values)? {
        Wire::Given(bytes) => Values::Given(numbers(&at.field("given"), &bytes)?),
        Wire::Uniform(v1::RolloutUniform { low, high }) => Values::Uniform { low, high },
        Wire::Normal(v1::RolloutNormal { mean, deviation }) => Values::Normal { mean, deviation },
    };
    Ok(Variation { of, values })
}

fn quantity(at: &Path<'_>, given: v1::RolloutQuantity) -> Result<Quantity, BadField> {
    use v1::RolloutQuantityKind as Kind;
    let kind_at = at.field("kind");
    let kind = kind_at.known(given.kind)?;
    let named = named(at, given.robot, "names", given.names)?;
    let takes_names = !matches!(kind, Kind::RootPose | Kind::RootTwist | Kind::ContactCount);
    if !takes_names && !named.names.is_empty() {
        let expected = "it must be empty: this is of the whole robot";
        return Err(at.field("names").refuse(format_args!("{:?}", named.names), expected));
    }
    Ok(match kind {
        Kind::Unspecified => return Err(kind_at.refuse("not given", "it must be given")),
        Kind::JointPositions => Quantity::JointPositions(named),
        Kind::JointVelocities => Quantity::JointVelocities(named),
        Kind::JointEfforts => Quantity::JointEfforts(named),
        Kind::RootPose => Quantity::RootPose(named.robot),
        Kind::RootTwist => Quantity::RootTwist(named.robot),
        Kind::LinkPoses => Quantity::LinkPoses(named),
        Kind::ContactCount => Quantity::ContactCount(named.robot),
        Kind::ContactForce => Quantity::ContactForce(named),
    })
}

/// Refuses `wrapped` for values that have no whole turns.
fn turns_whole(at: &Path<'_>, wrapped: bool) -> Result<(), BadField> {
    match wrapped {
        true => Err(at.field("wrapped").refuse(true, "it must be false: only positions have whole turns")),
        false => Ok(()),
    }
}

fn cost(at: &Path<'_>, given: v1::RolloutCost) -> Result<CostTerm, BadField> {
    use v1::rollout_cost::Term;
    let v1::RolloutCost { weight, final_weight, term } = given;
    let joints = |at: &Path<'_>, term: v1::RolloutJointTerm| {
        let v1::RolloutJointTerm { robot, joints, targets, wrapped } = term;
        Ok::<_, BadField>((named(at, robot, "joints", joints)?, targets, wrapped))
    };
    let link = |at: &Path<'_>, robot: String, link: String| {
        Ok::<_, BadField>((at.field("robot").name(robot)?, at.field("link").name(link)?))
    };
    let of = match at.field("term").given(term)? {
        Term::JointPositions(term) => {
            let (joints, targets, wrapped) = joints(&at.field("joint_positions"), term)?;
            Cost::JointPositions { joints, targets, wrapped }
        }
        Term::JointVelocities(term) => {
            let at = at.field("joint_velocities");
            let (joints, targets, wrapped) = joints(&at, term)?;
            turns_whole(&at, wrapped)?;
            Cost::JointVelocities { joints, targets }
        }
        Term::JointEfforts(term) => {
            let at = at.field("joint_efforts");
            let (joints, targets, wrapped) = joints(&at, term)?;
            turns_whole(&at, wrapped)?;
            if !targets.is_empty() {
                let noun = if targets.len() == 1 { "number" } else { "numbers" };
                let given = format_args!("{} {noun} long", targets.len());
                return Err(at.field("targets").refuse(given, "it must be empty: efforts have none"));
            }
            Cost::JointEfforts(joints)
        }
        Term::LinkPosition(term) => {
            let at = at.field("link_position");
            let (robot, link) = link(&at, term.robot, term.link)?;
            let point = geometry::vector_or_zero(term.point);
            let target = geometry::vector(at.field("position").given(term.position)?);
            Cost::LinkPosition { robot, link, point, target }
        }
        Term::LinkOrientation(term) => {
            let at = at.field("link_orientation");
            let (robot, link) = link(&at, term.robot, term.link)?;
            let at = at.field("orientation");
            let given = at.given(term.orientation)?;
            if given == v1::Quaternion::default() {
                return Err(at.refuse("zero", "it must be a quaternion"));
            }
            let target = geometry::rotation(&at, given)?;
            Cost::LinkOrientation { robot, link, target }
        }
        Term::ContactForce(term) => {
            Cost::ContactForce(named(&at.field("contact_force"), term.robot, "links", term.links)?)
        }
        Term::Nearness(term) => {
            let at = at.field("nearness");
            Cost::Nearness {
                robot: at.field("robot").name(term.robot)?,
                link: at.field("link").short(term.link)?,
                other_robot: at.field("other_robot").short(term.other_robot)?,
                other_link: at.field("other_link").short(term.other_link)?,
                distance: term.distance,
            }
        }
    };
    Ok(CostTerm { weight, final_weight, of })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_that_a_term_cannot_use_are_refused() {
        use v1::rollout_cost::Term;
        let joints = |targets: &[f64], wrapped: bool| v1::RolloutJointTerm {
            robot: "arm".into(),
            targets: targets.to_vec(),
            wrapped,
            ..Default::default()
        };
        let turned = v1::RolloutLinkTerm {
            robot: "arm".into(),
            link: "hand".into(),
            orientation: Some(v1::Quaternion::default()),
            ..Default::default()
        };
        for (term, field) in [
            (Term::JointEfforts(joints(&[1.0], false)), "joint_efforts.targets"),
            (Term::JointEfforts(joints(&[], true)), "joint_efforts.wrapped"),
            (Term::JointVelocities(joints(&[1.0], true)), "joint_velocities.wrapped"),
            (Term::LinkOrientation(turned), "link_orientation.orientation"),
        ] {
            let refused = cost(&Path::ROOT, v1::RolloutCost { term: Some(term), ..Default::default() });
            assert_eq!(refused.unwrap_err().field, field);
        }
    }

    #[test]
    fn numbers_that_a_term_has_no_use_for_are_counted_in_words() {
        for (targets, value) in [(vec![1.0], "1 number long"), (vec![1.0, 2.0], "2 numbers long")] {
            let term = v1::RolloutJointTerm { robot: "arm".into(), targets, ..Default::default() };
            let term = Some(v1::rollout_cost::Term::JointEfforts(term));
            let costs = vec![v1::RolloutCost { term, ..Default::default() }];
            let refused = rollout(v1::RolloutRequest { costs, ..Default::default() }).unwrap_err();
            assert_eq!(
                refused.to_string(),
                format!("costs[0].joint_efforts.targets is {value}; it must be empty: efforts have none")
            );
        }
    }

    fn packed(numbers: &[f64]) -> Vec<u8> {
        numbers.iter().flat_map(|number| number.to_le_bytes()).collect()
    }

    #[test]
    fn packed_numbers_are_read_and_a_broken_one_is_named() {
        let control = |values: Vec<u8>| v1::RolloutRequest {
            copies: 2,
            steps: 3,
            controls: vec![v1::RolloutControl { robot: "arm".into(), values, ..Default::default() }],
            ..Default::default()
        };
        let (saved, read) = rollout(control(packed(&[0.5, -1.0]))).unwrap();
        assert_eq!((saved.as_str(), read.copies, read.steps), ("", 2, 3));
        assert_eq!(read.controls[0].values, [0.5, -1.0]);
        assert_eq!((read.controls[0].knots, read.controls[0].knot_steps), (1, 1));
        let refused = rollout(control(vec![0; 15])).unwrap_err();
        assert_eq!(refused.to_string(), "controls[0].values is 15 bytes long; it must have 8 bytes a number");
    }

    #[test]
    fn a_wrench_is_on_one_link_and_what_is_of_a_whole_robot_takes_no_names() {
        let wrench = |names: &[&str]| v1::RolloutRequest {
            variations: vec![v1::RolloutVariation {
                of: v1::RolloutVaried::Wrench.into(),
                robot: "arm".into(),
                names: names.iter().map(|name| (*name).to_owned()).collect(),
                values: Some(v1::rollout_variation::Values::Uniform(v1::RolloutUniform {
                    low: 0.0,
                    high: 1.0,
                })),
                ..Default::default()
            }],
            ..Default::default()
        };
        assert!(rollout(wrench(&["hand"])).is_ok());
        for names in [&[][..], &["hand", "foot"]] {
            assert_eq!(rollout(wrench(names)).unwrap_err().field, "variations[0].names");
        }
        let root = v1::RolloutQuantity {
            kind: v1::RolloutQuantityKind::RootPose.into(),
            robot: "arm".into(),
            names: vec!["hand".into()],
        };
        let request = v1::RolloutRequest { quantities: vec![root], ..Default::default() };
        assert_eq!(rollout(request).unwrap_err().field, "quantities[0].names");
    }
}
