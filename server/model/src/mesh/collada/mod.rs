//! COLLADA: triangles of a file's scene, in metres, in the file's own axes.
//!
//! * `xml`: the document, with limits.
//! * `scene`: nodes, their transforms, and their geometries.
//! * `geometry`: vertices and faces; `texture_coordinates`: positions in pictures.
//! * `material`: colours and textures.
//!
//! No library is used: the existing ones hang, abort or take gigabytes on files of a few hundred bytes.
//! Nothing here recurses, and memory is bounded by the file's own bytes.
//!
//! `<unit meter>` is applied. `<up_axis>` is not: RViz, MoveIt and Gazebo ignore it. So the axes of robots'
//! files are the link's, whatever their `up_axis` is (rviz issue 1045, gazebo-classic issue 1305).

mod geometry;
mod material;
mod scene;
#[cfg(test)]
mod tests;
mod texture_coordinates;
mod xml;

use super::{Beside, Triangles};
use crate::limits;
use crate::robot::Paint;

/// Reads the scene of a file, its colours and its textures.
pub(super) fn parse(bytes: &[u8], beside: &Beside) -> Result<(Triangles, Vec<Paint>), String> {
    if bytes.len() > limits::COLLADA_BYTES {
        let (size, cap) = (bytes.len(), limits::COLLADA_BYTES);
        return Err(format!("it has {size} bytes; the limit for COLLADA is {cap}"));
    }
    let text = xml::decode(bytes)?;
    let document = xml::parse(&text)?;
    let file = xml::File::new(&document)?;
    let mut mesh = scene::read(&file, beside)?;
    let paints = mesh.take_paints();
    Ok((mesh.finish()?, paints))
}
