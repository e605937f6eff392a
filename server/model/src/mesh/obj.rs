//! Wavefront OBJ: the triangles; side files that it names are never opened.

use glamx::DVec3;
use tobj::{LoadError, LoadOptions};

use super::Triangles;
use crate::limits;

/// Reads the text. Faces of more than three corners become fans.
pub(super) fn parse(bytes: &[u8]) -> Result<Triangles, String> {
    let options = LoadOptions { triangulate: true, ..LoadOptions::default() };
    // A material library is refused, whatever its name: nothing here needs colours.
    let (models, _) = tobj::load_obj_buf(&mut &*bytes, &options, |_| Err(LoadError::OpenFileFailed))
        .map_err(|error| format!("it is not an OBJ file that can be read: {error}"))?;
    let (mut vertices, mut triangles) = (Vec::new(), Vec::new());
    for mesh in models.into_iter().map(|model| model.mesh) {
        let first = u32::try_from(vertices.len()).map_err(|_| "it has too many corners")?;
        let (corners, _) = mesh.positions.as_chunks::<3>();
        vertices.extend(corners.iter().map(|&corner| DVec3::from_array(corner)));
        let (faces, _) = mesh.indices.as_chunks::<3>();
        if faces.iter().flatten().any(|&corner| corner as usize >= corners.len()) {
            return Err("a face names a corner that it does not have".into());
        }
        triangles.extend(faces.iter().map(|face| face.map(|corner| first + corner)));
        if triangles.len() > limits::MESH_TRIANGLES {
            return Err(format!("it has more than {} triangles", limits::MESH_TRIANGLES));
        }
    }
    if triangles.is_empty() {
        return Err("it has no triangles".into());
    }
    if vertices.iter().any(|corner| !corner.is_finite()) {
        return Err("a corner of it is not a finite number".into());
    }
    Ok((vertices, triangles))
}
