//! The mesh files that a description names: each found once, read once, reported once.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use roxmltree::Node;

use super::Assets;
use super::findings::{Findings, quoted};
use crate::limits;
use crate::mesh;
use crate::report::Disposition::Ignored;
use crate::robot::{MeshAsset, Sha256};

/// What a mesh is for.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub(super) enum Use {
    /// To draw: a load never fails for it.
    Visual,
    /// To touch.
    Collision,
}

/// A mesh, or why there is none.
type Found = Result<Arc<MeshAsset>, String>;

/// The meshes of one load.
pub(super) struct Meshes<'s> {
    assets: &'s dyn Assets,
    by_uri: HashMap<String, Found>,
    by_content: HashMap<Sha256, Found>,
    reported: HashSet<(String, Use)>,
    triangles: usize,
}

impl<'s> Meshes<'s> {
    /// Nothing read yet.
    pub(super) fn new(assets: &'s dyn Assets) -> Self {
        Self {
            assets,
            by_uri: HashMap::new(),
            by_content: HashMap::new(),
            reported: HashSet::new(),
            triangles: 0,
        }
    }

    /// The mesh behind a URI; where there is none, that is reported.
    pub(super) fn get(
        &mut self,
        uri: &str,
        node: Node,
        usage: Use,
        findings: &mut Findings,
    ) -> Option<Arc<MeshAsset>> {
        let found = match self.by_uri.get(uri) {
            Some(found) => found.clone(),
            None => {
                let found = self.find(uri);
                self.by_uri.insert(uri.to_owned(), found.clone());
                found
            }
        };
        let why = match found {
            Ok(asset) => return Some(asset),
            Err(why) => why,
        };
        if self.reported.insert((uri.to_owned(), usage)) {
            match usage {
                Use::Visual => findings.warn_leniently(node, Ignored, format!("{why}; it is not shown")),
                Use::Collision => findings.warn(node, Ignored, format!("{why}; it touches nothing")),
            }
        }
        None
    }

    fn find(&mut self, uri: &str) -> Found {
        let asset = self.assets.find(uri).map_err(|places| {
            let places = if places.is_empty() { "nowhere".to_owned() } else { places.join(", ") };
            format!("mesh {} is not found; looked in: {places}", quoted(uri))
        })?;
        if let Some(found) = self.by_content.get(&asset.sha256) {
            return found.clone();
        }
        let found = self.parse(uri, &asset);
        self.by_content.insert(asset.sha256, found.clone());
        found
    }

    fn parse(&mut self, uri: &str, asset: &super::Asset) -> Found {
        let name = quoted(uri);
        let (vertices, triangles) =
            mesh::parse(uri, &asset.bytes).map_err(|why| format!("mesh {name} is not read: {why}"))?;
        self.triangles = self.triangles.saturating_add(triangles.len());
        if self.triangles > limits::ROBOT_TRIANGLES {
            let cap = limits::ROBOT_TRIANGLES;
            return Err(format!("mesh {name} is not read: with it the robot has more than {cap} triangles"));
        }
        Ok(Arc::new(MeshAsset { sha256: asset.sha256, vertices, triangles }))
    }
}
