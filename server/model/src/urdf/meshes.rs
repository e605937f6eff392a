//! Mesh files of a description: each found once, read once, reported once.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;

use roxmltree::Node;

use super::findings::{Findings, quoted};
use crate::assets::{Asset, Assets, first_places};
use crate::limits::{self, LoadLimits};
use crate::mesh::{self, Beside, beside, image};
use crate::report::Disposition::{Ignored, Repaired};
use crate::report::counted;
use crate::robot::{Image, MeshAsset, Sha256, look_of};

/// Use of a mesh.
pub(super) enum Use {
    /// For drawing: a load never fails for it.
    Visual {
        /// Picture of the visual's material.
        cover: Option<Arc<Image>>,
        /// Whether the description gives the visual a colour.
        has_color: bool,
    },
    /// For collisions.
    Collision,
}

/// A mesh, or the reason why there is none.
type Found = Result<Arc<MeshAsset>, String>;

/// A mesh, with notes on its files.
#[derive(Clone)]
struct KnownMesh {
    found: Found,
    /// A wrong statement of the file about itself.
    lie: Option<String>,
    /// Missing parts of its look.
    looks: Vec<String>,
}

/// The meshes of one load.
pub(super) struct Meshes<'s> {
    assets: &'s dyn Assets,
    limits: &'s LoadLimits,
    /// By URI and by the picture that is put on it.
    by_uri: HashMap<(String, Option<Sha256>), KnownMesh>,
    /// By contents and format of the file.
    by_content: HashMap<(Sha256, String), KnownMesh>,
    /// Reported URIs, separately for visuals and collisions.
    reported: HashSet<(String, bool)>,
    /// Whether missing materials of a mesh that has a colour in the description were reported.
    are_materials_reported: bool,
    triangles: usize,
    /// Pictures of the description's materials, by their URIs.
    images: HashMap<String, Option<Arc<Image>>>,
}

impl<'s> Meshes<'s> {
    /// Makes it without meshes.
    pub(super) fn new(assets: &'s dyn Assets, limits: &'s LoadLimits) -> Self {
        Self {
            assets,
            limits,
            by_uri: HashMap::new(),
            by_content: HashMap::new(),
            reported: HashSet::new(),
            are_materials_reported: false,
            triangles: 0,
            images: HashMap::new(),
        }
    }

    /// Returns the mesh of a URI; reports a missing one.
    pub(super) fn get(
        &mut self,
        uri: &str,
        node: Node,
        usage: &Use,
        findings: &mut Findings,
    ) -> Option<Arc<MeshAsset>> {
        let (is_visual, cover, has_color) = match usage {
            Use::Visual { cover, has_color } => (true, cover.as_ref(), *has_color),
            Use::Collision => (false, None, false),
        };
        let key = (uri.to_owned(), cover.map(|cover| cover.sha256));
        let KnownMesh { found, lie, looks } = match self.by_uri.get(&key) {
            Some(found) => found.clone(),
            None => {
                let found = self.find(uri, cover);
                self.by_uri.insert(key, found.clone());
                found
            }
        };
        let is_first = self.reported.insert((uri.to_owned(), is_visual));
        match found {
            Ok(asset) => {
                if is_first {
                    let (triangles, vertices) = (asset.triangles.len(), asset.vertices.len());
                    findings.used_file(node, uri, || {
                        format!("{}, {}", counted(triangles, "triangle"), counted(vertices, "corner"))
                    });
                    let backslashes =
                        uri.contains('\\').then(|| "backslashes are read as slashes".to_owned());
                    for repair in backslashes.into_iter().chain(self.assets.note(uri)).chain(lie) {
                        let message = format!("mesh {}: {repair}", quoted(uri));
                        findings.warn_of_file(node, uri, Repaired, true, message);
                    }
                    // Colliders have no look.
                    for look in looks.into_iter().filter(|_| is_visual) {
                        let mut message = format!("mesh {}: {look}", quoted(uri));
                        // Its colour replaces the colours of the materials, so one note for all such meshes suffices.
                        if has_color && look.starts_with(beside::MATERIALS) {
                            if self.are_materials_reported {
                                continue;
                            }
                            self.are_materials_reported = true;
                            message +=
                                "; it has the colour of the description, like others without their materials";
                        }
                        findings.warn_of_file(node, uri, Ignored, false, message);
                    }
                }
                Some(asset)
            }
            Err(why) => {
                let (lost, serious) = match usage {
                    Use::Visual { .. } => ("it is not shown", false),
                    Use::Collision => ("it touches nothing", true),
                };
                if is_first {
                    findings.warn_of_file(node, uri, Ignored, serious, format!("{why}; {lost}"));
                }
                None
            }
        }
    }

    /// Returns the picture of a material in the description; reports a missing one once.
    pub(super) fn image(&mut self, uri: &str, node: Node, findings: &mut Findings) -> Option<Arc<Image>> {
        if let Some(known) = self.images.get(uri) {
            return known.clone();
        }
        let name = quoted(uri);
        let read = if self.images.len() >= limits::FILES_BESIDE {
            let most = limits::FILES_BESIDE;
            Err(format!("texture {name} is not read: the description names more than {most}"))
        } else {
            match self.assets.find(uri) {
                Ok(asset) => image::check(asset.sha256, asset.bytes)
                    .map_err(|why| format!("texture {name} is not read: {why}")),
                Err(places) => Err(format!("texture {name} {}", absent(uri, places))),
            }
        };
        let image = match read {
            Ok(image) => {
                let [width, height] = image.size;
                findings.used_file(node, uri, || format!("{width} by {height} pixels"));
                Some(Arc::new(image))
            }
            Err(why) => {
                let message = format!("{why}; the colour of its material is shown");
                findings.warn_of_file(node, uri, Ignored, false, message);
                None
            }
        };
        self.images.insert(uri.to_owned(), image.clone());
        image
    }

    fn find(&mut self, uri: &str, cover: Option<&Arc<Image>>) -> KnownMesh {
        let asset = match self.assets.find(uri) {
            Ok(asset) => asset,
            Err(places) => {
                let found = Err(format!("mesh {} {}", quoted(uri), absent(uri, places)));
                return KnownMesh { found, lie: None, looks: Vec::new() };
            }
        };
        let (size, cap) = (asset.bytes.len(), self.limits.mesh_bytes);
        if size > cap {
            let found =
                Err(format!("mesh {} is not read: it has {size} bytes; the limit is {cap}", quoted(uri)));
            return KnownMesh { found, lie: None, looks: Vec::new() };
        }
        let beside = Beside::gather(uri, &asset.bytes, self.assets).covered_by(cover);
        let content = (look_of(asset.sha256, &beside.files), mesh::format(uri));
        if let Some(found) = self.by_content.get(&content) {
            return found.clone();
        }
        // Without its numbers there is no mesh: the report says where they were looked for.
        let lost = beside.notes.iter().find(|note| note.starts_with("the buffer"));
        let found = self.parse(uri, &asset, &beside);
        let found = found.map_err(|why| lost.map_or_else(|| why.clone(), |lost| format!("{why}: {lost}")));
        let mut looks = beside.notes;
        if let (Ok(mesh), Some(_)) = (&found, cover)
            && mesh.paints.iter().all(|paint| paint.texture.is_none())
        {
            looks.push(
                "its material's texture is not drawn: its file gives no texture coordinates".to_owned(),
            );
        }
        let found = KnownMesh { found, lie: mesh::note(uri, &asset.bytes), looks };
        self.by_content.insert(content, found.clone());
        found
    }

    fn parse(&mut self, uri: &str, asset: &Asset, beside: &Beside) -> Found {
        let name = quoted(uri);
        let mut read = || mesh::asset(uri, asset.sha256, &asset.bytes, beside);
        let look = look_of(asset.sha256, &beside.files);
        let read = self.assets.mesh(look, &mesh::format(uri), &mut read);
        let read = read.map_err(|why| format!("mesh {name} is not read: {why}"))?;
        let (count, cap) = (read.triangles.len(), self.limits.mesh_triangles);
        if count > cap {
            return Err(format!("mesh {name} is not read: it has {count} triangles; the limit is {cap}"));
        }
        self.triangles = self.triangles.saturating_add(count);
        if self.triangles > self.limits.robot_triangles {
            let cap = self.limits.robot_triangles;
            return Err(format!("mesh {name} is not read: with it the robot has more than {cap} triangles"));
        }
        Ok(read)
    }
}

/// Returns the reason why there is no file, to follow its URI.
fn absent(uri: &str, places: Vec<String>) -> String {
    let places = first_places(places);
    // If the URI itself is invalid, no place was searched.
    let wrong = format!("because `{uri}` ");
    match &places[..] {
        [] => "is not found".to_owned(),
        [only] => match only.split_once(&wrong) {
            Some((_, why)) => why.to_owned(),
            None => format!("is not found; looked in: {only}"),
        },
        several => format!("is not found; looked in: {}", several.join(", ")),
    }
}

/// Returns a note if a file was found under a path whose letter case differs from the URI: an
/// [`Assets::note`](crate::assets::Assets::note).
pub fn other_case(uri: &str, found: &str) -> Option<String> {
    let parts = |path: &str| -> Vec<String> { path.rsplit(['/', '\\']).map(str::to_owned).collect() };
    let (written, found) = (parts(uri), parts(found));
    let same = written.iter().zip(&found).take_while(|(a, b)| a.to_lowercase() == b.to_lowercase());
    let differs = same.into_iter().filter(|(a, b)| a != b).last();
    differs.map(|(_, there)| {
        format!("it is found as {}; other systems tell capital letters from small ones", quoted(there))
    })
}
