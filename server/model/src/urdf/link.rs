//! Links: shapes, surfaces and colours. [`inertial`](super::inertial) reads their mass.

use std::sync::Arc;

use roxmltree::Node;

use super::deadline::Deadline;
use super::findings::{Findings, Refusal};
use super::gazebo::Gazebo;
use super::geometry::{geometry, pose};
use super::material::Palette;
use super::meshes::{Meshes, Use};
use super::repair::RepairedUrdf;
use super::surface::Surfaces;
use super::tree::Tree;
use crate::assets::Assets;
use crate::limits::LoadLimits;
use crate::report::Disposition::Defaulted;
use crate::robot::{Collision, Inertial, Link, Picture, Visual};

/// Returns all links, in the tree's order, without mass.
pub(super) fn read_all<'a, 'i>(
    repaired: &RepairedUrdf<'a, 'i>,
    tree: &Tree<'a, 'i>,
    assets: &dyn Assets,
    gazebo: &Gazebo,
    (limits, deadline): (&LoadLimits, &Deadline),
    findings: &mut Findings,
) -> Result<Vec<Link>, Refusal> {
    let mut reader = Reader {
        repaired,
        palette: Palette::of(repaired, findings),
        surfaces: Surfaces::of(gazebo),
        meshes: Meshes::new(assets, limits),
        deadline,
        findings,
    };
    let mut links = Vec::with_capacity(tree.links.len());
    for (in_file, node) in tree.links.iter().zip(&tree.link_nodes) {
        let Some(link) = repaired.robot.links.get(*in_file) else { continue };
        links.push(reader.link(link, *node)?);
    }
    Ok(links)
}

struct Reader<'r, 'a, 'i> {
    repaired: &'r RepairedUrdf<'a, 'i>,
    palette: Palette<'r>,
    surfaces: Surfaces<'r>,
    meshes: Meshes<'r>,
    deadline: &'r Deadline,
    findings: &'r mut Findings,
}

impl<'a, 'i> Reader<'_, 'a, 'i> {
    fn link(&mut self, link: &urdf_rs::Link, node: Node<'a, 'i>) -> Result<Link, Refusal> {
        let Self { repaired, palette, surfaces, meshes, deadline, findings } = self;
        let mut visuals = Vec::with_capacity(link.visual.len());
        for (visual, node) in link.visual.iter().zip(repaired.children(node, "visual")) {
            deadline.check()?;
            let link_from_shape = pose(&visual.origin, repaired.child(node, "origin"), findings);
            let material = repaired.child(node, "material");
            let color = palette.color(visual.material.as_ref(), material, findings);
            let picture = palette.texture(material);
            let picture = picture.and_then(|(uri, repeat)| {
                let image = meshes.image(uri, material.unwrap_or(node), findings)?;
                Some(Picture { uri: uri.to_owned(), image, repeat })
            });
            let cover = picture.as_ref().map(|picture| Arc::clone(&picture.image));
            let usage = Use::Visual { cover, has_color: color.is_some() };
            let geometry = geometry(repaired, node, &visual.geometry, meshes, &usage, findings);
            let visual = |geometry| Visual { link_from_shape, geometry, color, texture: picture };
            visuals.extend(geometry.map(visual));
        }
        let material = surfaces.material(repaired, link, node, findings);
        let mut collisions = Vec::with_capacity(link.collision.len());
        for (collision, node) in link.collision.iter().zip(repaired.children(node, "collision")) {
            deadline.check()?;
            let link_from_shape = pose(&collision.origin, repaired.child(node, "origin"), findings);
            let geometry = geometry(repaired, node, &collision.geometry, meshes, &Use::Collision, findings);
            collisions.extend(geometry.map(|geometry| Collision { link_from_shape, geometry, material }));
        }
        deadline.check()?;
        if !link.visual.is_empty() && link.collision.is_empty() {
            findings.info(node, Defaulted, "it has visuals and no collision: it touches nothing");
        }
        Ok(Link { name: link.name.clone(), inertial: Inertial::ZERO, visuals, collisions })
    }
}
