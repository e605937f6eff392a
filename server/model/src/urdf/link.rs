//! Links: shapes and colours. Their mass is [`inertial`](super::inertial)'s.

use super::Assets;
use super::findings::Findings;
use super::geometry::{geometry, pose};
use super::material::Palette;
use super::mend::Mended;
use super::meshes::{Meshes, Use};
use super::tree::Tree;
use crate::robot::{Collision, Inertial, Link, Material, Visual};

/// All links, in the tree's order, without mass.
pub(super) fn read_all<'a, 'i>(
    mended: &Mended<'a, 'i>,
    tree: &Tree<'a, 'i>,
    assets: &dyn Assets,
    findings: &mut Findings,
) -> Vec<Link> {
    let palette = Palette::of(mended);
    let mut meshes = Meshes::new(assets);
    let mut links = Vec::with_capacity(tree.links.len());
    for (in_file, node) in tree.links.iter().zip(&tree.link_nodes) {
        let Some(link) = mended.robot.links.get(*in_file) else { continue };
        let mut visuals = Vec::with_capacity(link.visual.len());
        for (visual, node) in link.visual.iter().zip(mended.children(*node, "visual")) {
            let link_from_shape = pose(&visual.origin, mended.child(node, "origin"), findings);
            let material = mended.child(node, "material");
            let color = palette.color(visual.material.as_ref(), material, findings);
            let geometry = geometry(mended, node, &visual.geometry, &mut meshes, Use::Visual, findings);
            visuals.extend(geometry.map(|geometry| Visual { link_from_shape, geometry, color }));
        }
        let mut collisions = Vec::with_capacity(link.collision.len());
        for (collision, node) in link.collision.iter().zip(mended.children(*node, "collision")) {
            let link_from_shape = pose(&collision.origin, mended.child(node, "origin"), findings);
            let geometry = geometry(mended, node, &collision.geometry, &mut meshes, Use::Collision, findings);
            collisions.extend(geometry.map(|geometry| Collision {
                link_from_shape,
                geometry,
                material: Material::default(),
            }));
        }
        links.push(Link { name: link.name.clone(), inertial: Inertial::ZERO, visuals, collisions });
    }
    links
}
