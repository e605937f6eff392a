//! Texture coordinates of a COLLADA file.

use std::collections::HashMap;
use std::rc::Rc;

use roxmltree::{Node, NodeId};

use super::xml::{File, attribute, child, children, words};
use crate::limits;
use crate::mesh::builder::texture_coordinate;

/// Texture coordinates that were read so far.
pub(super) struct TextureCoordinates<'f, 'a> {
    file: &'f File<'a>,
    /// By `<source>`; `None` if it cannot be read.
    known: HashMap<NodeId, Option<Rc<[[f32; 2]]>>>,
    /// Number of coordinates in all of `known`.
    all: usize,
}

impl<'f, 'a> TextureCoordinates<'f, 'a> {
    /// Makes it without coordinates.
    pub(super) fn new(file: &'f File<'a>) -> Self {
        Self { file, known: HashMap::new(), all: 0 }
    }

    /// Returns texture coordinates, and their place among a corner's indices. Unreadable ones are left out: a
    /// mesh is not refused for its look.
    pub(super) fn of(&mut self, faces: Node<'a, 'a>) -> Option<(Rc<[[f32; 2]]>, usize)> {
        // If there are several, the lowest set is for diffuse pictures.
        let inputs = children(faces, "input").filter(|input| input.attribute("semantic") == Some("TEXCOORD"));
        let input = inputs.min_by_key(|input| attribute(*input, "set", 0).unwrap_or(usize::MAX))?;
        let offset = attribute(input, "offset", 0).ok()?;
        let source = self.file.follow(input, "source", "source").ok()?;
        let uvs = match self.known.get(&source.id()) {
            Some(known) => known.clone(),
            None => {
                let read = self.read(source);
                self.known.insert(source.id(), read.clone());
                read
            }
        };
        Some((uvs?, offset))
    }

    fn read(&mut self, source: Node<'a, 'a>) -> Option<Rc<[[f32; 2]]>> {
        let accessor = child(child(source, "technique_common")?, "accessor")?;
        let array = self.file.follow(accessor, "source", "float_array").ok()?;
        let of = |name: &str, default| attribute(accessor, name, default).ok();
        let (count, offset, stride) = (of("count", 0)?, of("offset", 0)?, of("stride", 2)?);
        self.file.walk(array.range().len()).ok()?;
        if stride < 2 {
            return None;
        }
        let most = limits::MESH_VERTICES.saturating_sub(self.all);
        let mut words = words(array).skip(offset);
        let mut uvs = Vec::new();
        while uvs.len() < count.min(most) {
            let (Some(across), Some(up)) = (words.next(), words.next()) else { break };
            let [across, up] = [across, up].map(|word| word.parse::<f64>().unwrap_or(0.0));
            uvs.push([texture_coordinate(across), texture_coordinate(1.0 - up)]);
            if stride > 2 && words.nth(stride - 3).is_none() {
                break;
            }
        }
        self.all += uvs.len();
        Some(uvs.into())
    }
}
