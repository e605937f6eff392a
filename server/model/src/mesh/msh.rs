//! MSH, MuJoCo's binary meshes: four counts, vertices, normals, texture coordinates, triangles.

use glamx::DVec3;

use super::Triangles;
use super::builder::Builder;
use crate::limits;

const HEADER: usize = 16;

pub(super) fn parse(bytes: &[u8]) -> Result<Triangles, String> {
    let count = |number: usize| -> Result<usize, String> {
        let word = bytes.get(4 * number..4 * number + 4).and_then(|word| word.try_into().ok());
        let word = word.ok_or_else(|| format!("not an MSH: it has only {} bytes", bytes.len()))?;
        usize::try_from(i32::from_le_bytes(word))
            .map_err(|_negative| "not an MSH: a count is negative".to_owned())
    };
    let [corners, normals, uvs, triangles] = [count(0)?, count(1)?, count(2)?, count(3)?];
    for (what, count, cap) in
        [("corners", corners, limits::MESH_VERTICES), ("triangles", triangles, limits::MESH_TRIANGLES)]
    {
        if count > cap {
            return Err(format!("it has {count} {what}; the limit is {cap}"));
        }
    }
    // None of these overflows within the limit of the file's size.
    let numbers = 3_u64 * corners as u64 + 3 * normals as u64 + 2 * uvs as u64 + 3 * triangles as u64;
    let size = HEADER as u64 + 4 * numbers;
    if size != bytes.len() as u64 {
        return Err(format!("not an MSH: its header declares {size} bytes, and it has {}", bytes.len()));
    }
    if triangles == 0 {
        return Err("it has no triangles".to_owned());
    }
    let (words, _) = bytes.get(HEADER..).unwrap_or_default().as_chunks::<4>();
    let mut mesh = Builder::with_capacity(corners, triangles);
    let (points, rest) = words.split_at_checked(3 * corners).ok_or("not an MSH: it ends early")?;
    let (points, _) = points.as_chunks::<3>();
    let mut indices = Vec::with_capacity(corners);
    for point in points {
        indices.push(mesh.corner(DVec3::from_array(point.map(|word| f64::from(f32::from_le_bytes(word)))))?);
    }
    let faces = rest.get(3 * normals + 2 * uvs..).ok_or("not an MSH: it ends early")?;
    let (faces, _) = faces.as_chunks::<3>();
    for (number, face) in faces.iter().enumerate() {
        let corner = |word: [u8; 4]| {
            let index = usize::try_from(i32::from_le_bytes(word)).ok();
            index.and_then(|index| indices.get(index).copied())
        };
        let [Some(a), Some(b), Some(c)] = face.map(corner) else {
            return Err(format!("triangle {number} names a corner that does not exist"));
        };
        mesh.triangle([a, b, c])?;
    }
    mesh.finish()
}
