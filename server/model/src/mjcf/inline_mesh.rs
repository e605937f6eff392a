//! Meshes written as numbers in the file itself. They become OBJ files, which all mesh readers read, and
//! which the URDF names like any other.

use std::cell::{Cell, RefCell};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;

use glamx::DVec3;

use super::{mesh_inertia, value};
use crate::assets::Asset;
use crate::limits;
use crate::mesh::hull::{self, NoHull};
use crate::report::Disposition::Ignored;
use crate::robot::Sha256;
use crate::translation::draft::Names;
use crate::translation::element::Element;
use crate::translation::notes::{Notes, Stop};

/// Files that were made.
#[derive(Default)]
pub(super) struct Made {
    /// By their URIs in the URDF.
    pub(super) files: BTreeMap<String, Asset>,
    names: Names,
    bytes: usize,
    /// Cost of weighing meshes and computing hulls so far, in triangles whose volume is summed.
    work: Cell<usize>,
    /// Files that were read to be weighed.
    read: RefCell<BTreeSet<String>>,
}

/// Maximum bytes of all files that one description makes.
const MAX_BYTES: usize = 64 << 20;
/// Maximum of [`Made::spend`]: under two seconds.
const MAX_WORK: usize = 80_000_000;
/// Maximum numbers of one attribute: three for each vertex.
const MAX_NUMBERS: usize = 3 * limits::MESH_VERTICES;
/// Folder of the files in the URDF, next to it.
const FOLDER: &str = "mjcf_inline";
/// Maximum bytes of a file's name, without its folder.
const NAME: usize = 60;

impl Made {
    /// Counts work for an element. Refuses a description that needs more than the maximum.
    pub(super) fn spend(&self, work: usize, at: Element) -> Result<(), Stop> {
        self.work.set(self.work.get().saturating_add(work));
        if self.work.get() <= MAX_WORK {
            return Ok(());
        }
        let message = "the meshes so far are too large to compute masses and hulls of: give bodies an inertial, and meshes faces";
        Err(Stop::at(at, message))
    }

    /// Counts the repeated reading of a file, for meshes that differ only in their scale.
    pub(super) fn spend_reading(&self, uri: &str, bytes: usize, at: Element) -> Result<(), Stop> {
        let is_first = self.read.borrow_mut().insert(uri.to_owned());
        if is_first { Ok(()) } else { self.spend(bytes / 2, at) }
    }

    /// Keeps a file for a named mesh; returns its URI.
    pub(super) fn add(&mut self, at: Element, name: &str, text: String) -> Result<String, Stop> {
        self.keep(at, name, "obj", text.into_bytes())
    }

    /// Keeps a named picture as a PNG; returns its URI.
    pub(super) fn add_picture(&mut self, at: Element, name: &str, png: Vec<u8>) -> Result<String, Stop> {
        self.keep(at, name, "png", png)
    }

    fn keep(&mut self, at: Element, name: &str, extension: &str, bytes: Vec<u8>) -> Result<String, Stop> {
        self.bytes += bytes.len();
        if self.bytes > MAX_BYTES {
            let message = format!(
                "meshes and textures without a file have more than {MAX_BYTES} bytes; give them one each"
            );
            return Err(Stop::at(at, message));
        }
        let name: String = crate::wire_name(name).chars().take(NAME).collect();
        let uri = format!("{FOLDER}/{}.{extension}", self.names.unique(&name));
        self.files.insert(uri.clone(), Asset { sha256: Sha256::of(&bytes), bytes: bytes.into() });
        Ok(uri)
    }
}

/// Returns a mesh of `vertex`, `face` and `texcoord` as OBJ. Without faces it is the convex hull of its
/// vertices, as in MuJoCo. `None`, with a note, if it has no volume.
pub(super) fn obj(mesh: Element, made: &Made, notes: &mut Notes) -> Result<Option<String>, Stop> {
    let corners = rows::<3>(mesh, "vertex")?.unwrap_or_default();
    if corners.len() < 4 {
        return Err(Stop::at(mesh, format!("vertex has {} corners; a mesh has at least 4", corners.len())));
    }
    let Some(faces) = rows::<3>(mesh, "face")? else {
        made.spend(mesh_inertia::of_hull(corners.len().min(hull::MAX_VERTICES)), mesh)?;
        return hull(mesh, &corners, notes);
    };
    let faces = indices(mesh, "face", &faces, corners.len())?;
    let uvs = rows::<2>(mesh, "texcoord")?.unwrap_or_default();
    let uv_indices = match rows::<3>(mesh, "facetexcoord")? {
        Some(uv_indices) => indices(mesh, "facetexcoord", &uv_indices, uvs.len())?,
        None => faces.clone(),
    };
    let is_beyond = |index: &u32| *index as usize >= uvs.len();
    if !uvs.is_empty() && (uv_indices.len() != faces.len() || uv_indices.iter().flatten().any(is_beyond)) {
        // A picture only affects the look.
        notes.warn(mesh, Ignored, "texcoord does not have as many rows as vertex, or facetexcoord as face");
        return Ok(Some(written(&corners, &[], &faces, &faces)));
    }
    Ok(Some(written(&corners, &uvs, &faces, &uv_indices)))
}

fn hull(mesh: Element, corners: &[[f64; 3]], notes: &mut Notes) -> Result<Option<String>, Stop> {
    let points: Vec<DVec3> = corners.iter().copied().map(DVec3::from_array).collect();
    match hull::of_corners(&points) {
        Ok((corners, faces)) => {
            let corners: Vec<[f64; 3]> = corners.iter().map(DVec3::to_array).collect();
            Ok(Some(written(&corners, &[], &faces, &faces)))
        }
        Err(NoHull::Corners(why)) => Err(Stop::at(mesh, why)),
        Err(NoHull::Volume) => {
            let message =
                "its corners have no convex hull that has a volume: geoms of this mesh are left out";
            notes.warn(mesh, Ignored, message);
            Ok(None)
        }
    }
}

/// Returns the numbers of an attribute, `N` per row. `None` if it is absent.
fn rows<const N: usize>(mesh: Element, name: &str) -> Result<Option<Vec<[f64; N]>>, Stop> {
    let Some(text) = mesh.word(name) else { return Ok(None) };
    let values = value::list(mesh, name, text, MAX_NUMBERS)?;
    if !values.len().is_multiple_of(N) {
        return Err(Stop::at(
            mesh,
            format!("{name} has {} numbers, which are not rows of {N}", values.len()),
        ));
    }
    Ok(Some(values.chunks_exact(N).filter_map(|row| row.try_into().ok()).collect()))
}

/// Returns numbers as indices below `count`, from 0.
fn indices(mesh: Element, name: &str, rows: &[[f64; 3]], count: usize) -> Result<Vec<[u32; 3]>, Stop> {
    if rows.len() > limits::MESH_TRIANGLES {
        let message = format!("{name} has {} rows; the limit is {}", rows.len(), limits::MESH_TRIANGLES);
        return Err(Stop::at(mesh, message));
    }
    let mut found = Vec::with_capacity(rows.len());
    for row in rows {
        if let Some(wrong) =
            row.iter().find(|index| index.fract() != 0.0 || **index < 0.0 || **index >= count as f64)
        {
            return Err(Stop::at(
                mesh,
                format!("{name} names {wrong}, and there are {count}, counted from 0"),
            ));
        }
        found.push(row.map(|index| index as u32));
    }
    Ok(found)
}

/// Writes an OBJ. Texture coordinates begin at the top in MJCF, and at the bottom in OBJ.
fn written(corners: &[[f64; 3]], uvs: &[[f64; 2]], faces: &[[u32; 3]], uv_indices: &[[u32; 3]]) -> String {
    let mut text = String::new();
    // Writing to a string cannot fail. `{:?}` writes very small numbers with an exponent.
    for [x, y, z] in corners {
        let _ = writeln!(text, "v {x:?} {y:?} {z:?}");
    }
    for [across, down] in uvs {
        let _ = writeln!(text, "vt {across:?} {:?}", 1.0 - down);
    }
    for ([a, b, c], [p, q, r]) in faces.iter().zip(uv_indices) {
        let _ = if uvs.is_empty() {
            writeln!(text, "f {} {} {}", a + 1, b + 1, c + 1)
        } else {
            writeln!(text, "f {}/{} {}/{} {}/{}", a + 1, p + 1, b + 1, q + 1, c + 1, r + 1)
        };
    }
    text
}
