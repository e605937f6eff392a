//! `@home`: positions of a named state as targets.

use std::collections::BTreeMap;

use anyhow::bail;
use simd_client::{Client, Target, proto::NamedState};

use crate::target::{Assignment, assignment};

/// An argument after the robot's name.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Wanted {
    /// A target for a joint.
    Joint(Assignment),
    /// A named state, in one group or in any.
    State { group: Option<String>, name: String },
}

/// Parses `JOINT=TARGET`, `@STATE` or `@GROUP/STATE`.
pub(super) fn wanted(text: &str) -> Result<Wanted, String> {
    let Some(state) = text.strip_prefix('@').filter(|_| !text.contains('=')) else {
        return assignment(text).map(Wanted::Joint);
    };
    let (group, name) = match state.split_once('/') {
        Some((group, name)) => (Some(group.to_owned()), name),
        None => (None, state),
    };
    if name.is_empty() {
        return Err("must be @STATE or @GROUP/STATE".to_owned());
    }
    Ok(Wanted::State { group, name: name.to_owned() })
}

/// Converts all of it to targets: one for each joint, where the last one wins.
pub(super) async fn resolved(
    wanted: Vec<Wanted>,
    robot: &str,
    client: &Client,
) -> anyhow::Result<Vec<Assignment>> {
    let is_state = |wanted: &Wanted| matches!(wanted, Wanted::State { .. });
    let known = if wanted.iter().any(is_state) { client.robot_info(robot).await?.states } else { Vec::new() };
    let mut targets: Vec<Assignment> = Vec::new();
    for wanted in wanted {
        match wanted {
            Wanted::Joint(target) => targets.push(target),
            Wanted::State { group, name } => {
                let of_state = of_state(&known, group.as_deref(), &name)?;
                targets.retain(|target| !of_state.contains_key(&target.joint));
                targets.extend(of_state.into_iter().map(|(joint, position)| Assignment {
                    joint,
                    target: Target::position(position),
                    motion: None,
                }));
            }
        }
    }
    // A joint that is given in addition to a state overrides it.
    let mut last: BTreeMap<String, usize> = BTreeMap::new();
    for (index, target) in targets.iter().enumerate().filter(|_| !known.is_empty()) {
        last.insert(target.joint.clone(), index);
    }
    let kept = targets.into_iter().enumerate();
    let kept = kept.filter(|(index, target)| last.get(&target.joint).is_none_or(|last| last == index));
    Ok(kept.map(|(_, target)| target).collect())
}

/// Returns the positions by joint of all states with a name.
fn of_state(known: &[NamedState], group: Option<&str>, name: &str) -> anyhow::Result<BTreeMap<String, f64>> {
    let is_meant = |state: &&NamedState| state.name == name && group.is_none_or(|group| state.group == group);
    let mut meant = known.iter().filter(is_meant).peekable();
    if meant.peek().is_none() {
        let full = |state: &NamedState| match state.group.as_str() {
            "" => format!("@{}", state.name),
            group => format!("@{group}/{}", state.name),
        };
        let names: Vec<String> = known.iter().take(20).map(full).collect();
        let asked = group.map_or_else(|| format!("@{name}"), |group| format!("@{group}/{name}"));
        match names.as_slice() {
            [] => {
                bail!("the robot has no named states, so no {asked}; give its SRDF with `robot load --srdf`")
            }
            names => bail!("the robot has no state {asked}; it has {}", names.join(", ")),
        }
    }
    Ok(meant.flat_map(|state| state.positions.clone()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn state(group: &str, name: &str, positions: &[(&str, f64)]) -> NamedState {
        let positions = positions.iter().map(|(joint, position)| ((*joint).to_owned(), *position)).collect();
        NamedState { name: name.into(), group: group.into(), positions }
    }

    #[test]
    fn a_state_is_typed_with_its_group_or_without() {
        assert_eq!(wanted("@home"), Ok(Wanted::State { group: None, name: "home".into() }));
        assert_eq!(wanted("@arm/home"), Ok(Wanted::State { group: Some("arm".into()), name: "home".into() }));
        assert!(matches!(wanted("@joint=1"), Ok(Wanted::Joint(target)) if target.joint == "@joint"));
        assert!(wanted("@").is_err() && wanted("@arm/").is_err());
    }

    #[test]
    fn a_state_of_several_groups_is_all_of_them_and_an_unknown_one_names_those_there_are() {
        let known = [state("arm", "home", &[("a", 1.0)]), state("hand", "home", &[("b", 2.0)])];
        let both = of_state(&known, None, "home").unwrap();
        assert_eq!(both, BTreeMap::from([("a".to_owned(), 1.0), ("b".to_owned(), 2.0)]));
        assert_eq!(of_state(&known, Some("hand"), "home").unwrap(), BTreeMap::from([("b".to_owned(), 2.0)]));
        let refused = of_state(&known, None, "up").unwrap_err().to_string();
        assert_eq!(refused, "the robot has no state @up; it has @arm/home, @hand/home");
        assert!(of_state(&[], None, "up").unwrap_err().to_string().contains("--srdf"));
    }
}
