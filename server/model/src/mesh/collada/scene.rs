//! Nodes of a COLLADA scene: their transforms and geometries.

use std::collections::HashMap;
use std::collections::hash_map::Entry;
use std::rc::Rc;

use glamx::{DMat4, DQuat, DVec3};
use roxmltree::Node;

use super::geometry::{Geometries, Geometry};
use super::material::Materials;
use super::xml::{File, at, child, children, is, number, numbers};
use crate::limits;
use crate::mesh::Beside;
use crate::mesh::builder::{Builder, Look};

/// A node to visit, with its path.
struct Visit<'a> {
    node: Node<'a, 'a>,
    depth: usize,
    /// `file_from_parent`, or the reason why it is unknown: an error only if the node has a geometry.
    file_from_parent: Result<DMat4, String>,
}

/// Returns the mesh of the scene that the file names, or of the first scene, or of all geometries.
pub(super) fn read<'a>(file: &File<'a>, beside: &Beside) -> Result<Builder, String> {
    let metres_from_file = DMat4::from_scale(DVec3::splat(unit(file.root)?));
    let mut mesh = Builder::default().covered_by(beside.cover());
    let mut geometries = Geometries::new(file, beside.has_images());
    let mut materials = Materials::new(file, beside);
    let named = child(file.root, "scene").and_then(|scene| child(scene, "instance_visual_scene"));
    let scene = match named {
        Some(instance) => Some(file.follow(instance, "url", "visual_scene")?),
        None => child(file.root, "library_visual_scenes").and_then(|scenes| child(scenes, "visual_scene")),
    };
    let Some(scene) = scene else {
        let all = children(file.root, "library_geometries").flat_map(|all| children(all, "geometry"));
        for node in all {
            geometries.get(node)?.add(metres_from_file, &mut |_| Look::default(), &mut mesh)?;
        }
        return Ok(mesh);
    };
    // The next visit is at the end.
    let mut visits: Vec<Visit> = Vec::new();
    queue(scene, 1, &Ok(DMat4::IDENTITY), &mut visits);
    let mut controllers = HashMap::new();
    while let Some(visit) = visits.pop() {
        file.walk(length(visit.node))?;
        if visit.depth > limits::XML_DEPTH {
            let depth = limits::XML_DEPTH;
            let message = format!("nodes are nested deeper than {depth} levels, or contain themselves");
            return Err(at(visit.node, &message));
        }
        let file_from_node = visit.file_from_parent.and_then(|parent| Ok(parent * transform(visit.node)?));
        for shown in visit.node.children().filter(Node::is_element) {
            match shown.tag_name().name() {
                "instance_geometry" => {
                    let geometry = geometries.get(file.follow(shown, "url", "geometry")?)?;
                    let mut look = materials.bound_in(shown);
                    geometry.add(metres_from_file * file_from_node.clone()?, &mut look, &mut mesh)?;
                }
                "instance_controller" => {
                    let controller = file.follow(shown, "url", "controller")?;
                    let (geometry, file_from_skin) = match controllers.entry(controller.id()) {
                        Entry::Occupied(known) => known.into_mut(),
                        Entry::Vacant(new) => new.insert(skin(file, controller, &mut geometries)?),
                    };
                    let mut look = materials.bound_in(shown);
                    geometry.add(metres_from_file * *file_from_skin, &mut look, &mut mesh)?;
                }
                "instance_node" => {
                    let node = file.follow(shown, "url", "node")?;
                    let (depth, file_from_parent) = (visit.depth + 1, file_from_node.clone());
                    visits.push(Visit { node, depth, file_from_parent });
                }
                _ => {}
            }
        }
        queue(visit.node, visit.depth + 1, &file_from_node, &mut visits);
    }
    Ok(mesh)
}

/// Queues the nodes of a node or a scene, so that the first is visited first.
fn queue<'a>(
    parent: Node<'a, 'a>,
    depth: usize,
    file_from_parent: &Result<DMat4, String>,
    visits: &mut Vec<Visit<'a>>,
) {
    let first = visits.len();
    visits.extend(children(parent, "node").map(|node| Visit {
        node,
        depth,
        file_from_parent: file_from_parent.clone(),
    }));
    if let Some(new) = visits.get_mut(first..) {
        new.reverse();
    }
}

/// Returns the metres of the file's unit.
fn unit(root: Node) -> Result<f64, String> {
    let unit = child(root, "asset").and_then(|asset| child(asset, "unit"));
    let Some((unit, word)) = unit.and_then(|unit| Some((unit, unit.attribute("meter")?))) else {
        return Ok(1.0);
    };
    let metres = number(unit, word.trim())?;
    if metres > 0.0 { Ok(metres) } else { Err(at(unit, "a unit must be above 0 metres")) }
}

/// Returns the bytes that the visit of a node counts, without its child nodes, which are separate visits.
fn length(node: Node) -> usize {
    const TAG: usize = 512;
    node.children().map(|child| TAG + if is(child, "node") { 0 } else { child.range().len() }).sum()
}

/// Returns `parent_from_node`: the product of all transforms, in the order of the file.
fn transform(node: Node) -> Result<DMat4, String> {
    let mut parent_from_node = DMat4::IDENTITY;
    for element in node.children().filter(Node::is_element) {
        parent_from_node *= match element.tag_name().name() {
            "matrix" => matrix(element)?,
            "translate" => DMat4::from_translation(DVec3::from_array(numbers(element)?)),
            "scale" => DMat4::from_scale(DVec3::from_array(numbers(element)?)),
            "rotate" => {
                let [x, y, z, degrees] = numbers(element)?;
                match DVec3::new(x, y, z).try_normalize() {
                    Some(axis) => DMat4::from_quat(DQuat::from_axis_angle(axis, degrees.to_radians())),
                    None => DMat4::IDENTITY,
                }
            }
            name @ ("skew" | "lookat") => return Err(at(element, &format!("<{name}> is not supported"))),
            _ => continue,
        };
    }
    Ok(parent_from_node)
}

/// Reads sixteen numbers, row by row.
fn matrix(element: Node) -> Result<DMat4, String> {
    Ok(DMat4::from_cols_array(&numbers(element)?).transpose())
}

/// Returns the geometry of a skin in its bind pose. Then its bones cancel out, and the instance's node does
/// not count (COLLADA 1.4.1, chapter 4, skin deformation).
fn skin<'a>(
    file: &File<'a>,
    controller: Node<'a, 'a>,
    geometries: &mut Geometries<'_, 'a>,
) -> Result<(Rc<Geometry<'a>>, DMat4), String> {
    let Some(skin) = child(controller, "skin") else {
        return Err(at(controller, "a controller without <skin> is not supported"));
    };
    let file_from_skin = child(skin, "bind_shape_matrix").map_or(Ok(DMat4::IDENTITY), matrix)?;
    Ok((geometries.get(file.follow(skin, "source", "geometry")?)?, file_from_skin))
}
