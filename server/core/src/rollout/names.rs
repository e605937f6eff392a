//! Resolution of a request's names. Unknown names and invalid numbers are refused with their fields.

use std::sync::Arc;

use simd_model::LARGEST_GIVEN;
use simd_model::robot::JointKind;

use super::request::Named;
use crate::simulation::Error;
pub(super) use crate::simulation::check::refuse;
use crate::simulation::published_state::{EntityLayout, WorldLayout};

/// A joint of one axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Axis {
    /// Joint in the model, by index.
    pub(super) joint: usize,
    /// Body in the tree, by index.
    pub(super) body: usize,
}

/// Checks that each number is within [`LARGEST_GIVEN`].
pub(super) fn moderate(field: &str, values: &[f64]) -> Result<(), Error> {
    match values.iter().position(|value| value.is_nan() || value.abs() > LARGEST_GIVEN) {
        Some(index) => Err(refuse(
            format!("{field}[{index}]"),
            values[index],
            format!("it must be a number between -{LARGEST_GIVEN:e} and {LARGEST_GIVEN:e}"),
        )),
        None => Ok(()),
    }
}

/// Checks that the count is one of `lengths`, which have descriptions for the error message.
pub(super) fn sized(field: &str, count: usize, lengths: &[(usize, &str)]) -> Result<(), Error> {
    if lengths.iter().any(|(length, _)| *length == count) {
        return Ok(());
    }
    // With one copy, a row for all copies and a row for each have the same length, which is named once.
    let mut lengths = lengths.to_vec();
    lengths.dedup_by_key(|(length, _)| *length);
    let needs: Vec<String> = lengths.iter().map(|(length, of)| format!("{length} ({of})")).collect();
    let has = if count == 1 { "1 number".to_owned() } else { format!("{count} numbers") };
    Err(Error::WrongCount { element: field.to_owned(), has, needs: needs.join(" or ") })
}

/// Returns a robot, named in this field of the request, and its index.
pub(super) fn robot<'l>(
    layout: &'l WorldLayout,
    field: &str,
    name: &str,
) -> Result<(usize, &'l Arc<EntityLayout>), Error> {
    let found = layout.entities.iter().enumerate().find(|(_, entity)| entity.name == name);
    found.ok_or_else(|| {
        let known = layout.entities.iter().map(|entity| entity.name.clone()).collect();
        Error::RobotNotFound { robot: name.to_owned(), known }.in_field(field)
    })
}

/// Returns the value of each name of a list; `field` is the list in the request.
fn each<T>(field: &str, names: &[String], find: impl Fn(&str) -> Result<T, Error>) -> Result<Vec<T>, Error> {
    let find = |(index, name): (usize, &String)| {
        find(name).map_err(|error| error.in_field(format!("{field}[{index}]")))
    };
    names.iter().enumerate().map(find).collect()
}

/// Returns the index of a joint in the model.
fn joint(entity: &EntityLayout, name: &str) -> Result<usize, Error> {
    let joints = &entity.model.joints;
    joints.iter().position(|joint| joint.name == name).ok_or_else(|| Error::JointNotFound {
        robot: entity.name.clone(),
        joint: name.to_owned(),
        known: joints.iter().map(|joint| joint.name.clone()).collect(),
    })
}

/// Returns the index in the model of a link that is named in this field of the request.
pub(super) fn link(entity: &EntityLayout, field: &str, name: &str) -> Result<usize, Error> {
    link_index(entity, name).map_err(|error| error.in_field(field))
}

fn link_index(entity: &EntityLayout, name: &str) -> Result<usize, Error> {
    let links = &entity.model.links;
    links.iter().position(|link| link.name == name).ok_or_else(|| Error::LinkNotFound {
        robot: entity.name.clone(),
        link: name.to_owned(),
        known: links.iter().map(|link| link.name.clone()).collect(),
    })
}

/// Returns the indices of the named joints, of any type; no names mean all. `field` is the list in the
/// request, as below.
pub(super) fn joints(entity: &EntityLayout, field: &str, names: &[String]) -> Result<Vec<usize>, Error> {
    if names.is_empty() {
        return Ok((0..entity.model.joints.len()).collect());
    }
    each(field, names, |name| joint(entity, name))
}

/// Returns the indices of the named links; no names mean all.
pub(super) fn links(entity: &EntityLayout, field: &str, names: &[String]) -> Result<Vec<usize>, Error> {
    if names.is_empty() {
        return Ok((0..entity.model.links.len()).collect());
    }
    each(field, names, |name| link_index(entity, name))
}

/// Returns the named joints, each of one axis and moved by no other; no names mean all of these.
pub(super) fn axes(entity: &EntityLayout, field: &str, names: &[String]) -> Result<Vec<Axis>, Error> {
    let why_not = |joint: usize| {
        let model = &entity.model.joints[joint];
        match (model.kind, model.mimic) {
            (JointKind::Fixed, _) => Some("is fixed".to_owned()),
            (JointKind::Floating | JointKind::Planar | JointKind::Spherical, _) => {
                Some("has more than one axis".to_owned())
            }
            (_, Some(mimic)) => Some(format!("follows joint {:?}", entity.model.joints[mimic.joint].name)),
            (JointKind::Revolute | JointKind::Continuous | JointKind::Prismatic, None) => None,
        }
    };
    let axis = |joint: usize| Axis { joint, body: entity.tree.joints[joint].start };
    if names.is_empty() {
        let all = 0..entity.model.joints.len();
        return Ok(all.filter(|joint| why_not(*joint).is_none()).map(axis).collect());
    }
    each(field, names, |name| {
        let found = joint(entity, name)?;
        match why_not(found) {
            Some(why) => {
                Err(Error::JointNotActuated { robot: entity.name.clone(), joint: name.to_owned(), why })
            }
            None => Ok(axis(found)),
        }
    })
}

/// Returns a robot and its joints of one axis. `field` returns the path of a field by its name, and `list` is
/// the name of the joints' field.
pub(super) fn axes_of(
    layout: &WorldLayout,
    named: &Named,
    field: impl Fn(&str) -> String,
    list: &str,
) -> Result<(usize, Vec<Axis>), Error> {
    let (index, entity) = robot(layout, &field("robot"), &named.robot)?;
    Ok((index, axes(entity, &field(list), &named.names)?))
}
