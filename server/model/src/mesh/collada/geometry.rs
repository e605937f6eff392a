//! Geometries of a COLLADA file: sources of vertices, and faces.

use std::collections::HashMap;
use std::rc::Rc;

use glamx::{DMat4, DVec3};
use roxmltree::{Node, NodeId};

use super::texture_coordinates::TextureCoordinates;
use super::xml::{File, at, attribute, child, children, is, number, whole, words};
use crate::limits;
use crate::mesh::Triangles;
use crate::mesh::builder::{Builder, FaceCorner, Fan, Look};

/// A geometry in its own frame and the file's unit.
pub(super) struct Geometry<'a> {
    mesh: Triangles,
    /// Texture coordinates of the first triangles.
    uvs: Vec<[[f32; 2]; 3]>,
    /// First triangle of each part, and the geometry's name of its material.
    parts: Vec<(usize, Option<&'a str>)>,
}

impl<'a> Geometry<'a> {
    /// Adds the geometry to a mesh, with the look of each material.
    pub(super) fn add(
        &self,
        mesh_from_geometry: DMat4,
        look: &mut dyn FnMut(&'a str) -> Look,
        mesh: &mut Builder,
    ) -> Result<(), String> {
        let Self { mesh: (vertices, triangles), uvs, parts } = self;
        let first = u32::try_from(mesh.corners()).map_err(|_| "it has too many corners")?;
        for vertex in vertices {
            mesh.corner(mesh_from_geometry.transform_point3(*vertex))?;
        }
        let mut parts = parts.iter().peekable();
        mesh.paint(Look::default());
        for (number, triangle) in triangles.iter().enumerate() {
            if let Some((_, material)) = parts.next_if(|(begin, _)| *begin == number) {
                mesh.paint(material.map_or_else(Look::default, &mut *look));
            }
            let uvs = uvs.get(number).copied().unwrap_or_default();
            let corner = |n: usize| FaceCorner {
                index: first.saturating_add(triangle.get(n).copied().unwrap_or_default()),
                uv: uvs.get(n).copied().unwrap_or_default(),
            };
            mesh.face([0, 1, 2].map(corner))?;
        }
        Ok(())
    }
}

/// Geometries that were read so far.
pub(super) struct Geometries<'f, 'a> {
    file: &'f File<'a>,
    read: HashMap<NodeId, Rc<Geometry<'a>>>,
    /// Vertices and triangles of all of `read`.
    corners: usize,
    triangles: usize,
    /// By `<vertices>` and by `<source>`.
    positions: HashMap<NodeId, Positions<'a>>,
    /// Texture coordinates, if there are pictures.
    uvs: Option<TextureCoordinates<'f, 'a>>,
}

/// Positions of vertices.
#[derive(Clone, Copy)]
struct Positions<'a> {
    accessor: Node<'a, 'a>,
    /// Indices of x, y and z in the accessor's values for a vertex.
    axes: [usize; 3],
}

impl<'f, 'a> Geometries<'f, 'a> {
    /// Makes it without geometries.
    pub(super) fn new(file: &'f File<'a>, has_images: bool) -> Self {
        Self {
            file,
            read: HashMap::new(),
            corners: 0,
            triangles: 0,
            positions: HashMap::new(),
            uvs: has_images.then(|| TextureCoordinates::new(file)),
        }
    }

    /// Returns a geometry, which is read once. A geometry without triangles, for instance of lines, is empty.
    pub(super) fn get(&mut self, node: Node<'a, 'a>) -> Result<Rc<Geometry<'a>>, String> {
        if let Some(known) = self.read.get(&node.id()) {
            return Ok(known.clone());
        }
        let mut mesh = Builder::default();
        // First vertex of a source, and the number of its vertices.
        let mut sources = HashMap::new();
        let mut parts = Vec::new();
        for faces in children(node, "mesh").flat_map(|mesh| mesh.children()) {
            if let Some(kind) = Kind::of(faces) {
                let begin = mesh.triangles();
                self.faces(faces, kind, &mut sources, &mut mesh)?;
                if mesh.triangles() > begin {
                    parts.push((begin, faces.attribute("material")));
                }
            }
        }
        let uvs = mesh.take_uvs();
        let read = mesh.pruned()?;
        self.corners += read.0.len();
        self.triangles += read.1.len();
        if self.corners > limits::MESH_VERTICES || self.triangles > limits::MESH_TRIANGLES {
            let (corners, triangles) = (limits::MESH_VERTICES, limits::MESH_TRIANGLES);
            return Err(format!("it has more than {corners} corners or {triangles} triangles"));
        }
        let read = Rc::new(Geometry { mesh: read, uvs, parts });
        self.read.insert(node.id(), read.clone());
        Ok(read)
    }

    fn faces(
        &mut self,
        faces: Node<'a, 'a>,
        kind: Kind,
        sources: &mut HashMap<NodeId, (usize, usize)>,
        mesh: &mut Builder,
    ) -> Result<(), String> {
        let Some((positions, offset, stride)) = self.inputs(faces)? else {
            return Ok(());
        };
        let (first, count) = match sources.get(&positions.accessor.id()) {
            Some(known) => *known,
            None => {
                let first = mesh.corners();
                self.corners_of(positions, mesh)?;
                let known = (first, mesh.corners() - first);
                sources.insert(positions.accessor.id(), known);
                known
            }
        };
        let texture = self.uvs.as_mut().and_then(|uvs| uvs.of(faces));
        // Holes of a polygon are ignored.
        let lists = faces.children().filter_map(|of| match of.tag_name().name() {
            "p" => Some(of),
            "ph" => child(of, "p"),
            _ => None,
        });
        let sizes = Sizes::new(kind, faces);
        for (number, list) in lists.enumerate() {
            if number > 0 && matches!(sizes, Sizes::Given(_)) {
                return Err(at(list, "a second <p> in a <polylist>"));
            }
            let mut words = words(list);
            let mut next = || -> Result<Option<FaceCorner>, String> {
                let mut corner = None;
                let mut uv_of_corner = [0.0; 2];
                for number in 0..stride {
                    let Some(word) = words.next() else {
                        let short = || at(list, "the last corner has fewer indices than the others");
                        return if number == 0 { Ok(None) } else { Err(short()) };
                    };
                    if number == offset {
                        let index = whole(list, word)?;
                        if index >= count {
                            let message = format!("a face names corner {index} of {count}, counted from 0");
                            return Err(at(list, &message));
                        }
                        corner = u32::try_from(first + index).ok();
                    }
                    if let Some((uvs, offset)) = &texture
                        && number == *offset
                    {
                        let uv = word.parse().ok().and_then(|index: usize| uvs.get(index));
                        uv_of_corner = uv.copied().unwrap_or_default();
                    }
                }
                Ok(corner.map(|index| FaceCorner { index, uv: uv_of_corner }))
            };
            sizes.fill(list, &mut next, mesh)?;
        }
        Ok(())
    }

    /// Returns the positions, the place of the vertex among a corner's indices, and the number of these
    /// indices. `None` for faces without indices.
    fn inputs(&mut self, faces: Node<'a, 'a>) -> Result<Option<(Positions<'a>, usize, usize)>, String> {
        let mut found = None;
        let mut stride = 1;
        for input in children(faces, "input") {
            let offset = attribute(input, "offset", 0)?;
            stride = stride.max(offset.saturating_add(1));
            let name = match input.attribute("semantic") {
                Some("VERTEX") => "vertices",
                Some("POSITION") => "source",
                _ => continue,
            };
            if found.is_none() {
                let node = self.file.follow(input, "source", name)?;
                found = Some((self.positions(node)?, offset));
            }
        }
        match found {
            Some((positions, offset)) => Ok(Some((positions, offset, stride))),
            None if !faces.children().any(|node| is(node, "p") || is(node, "ph")) => Ok(None),
            None => Err(at(faces, "faces without an input VERTEX")),
        }
    }

    /// Returns the positions of a `<vertices>` or a `<source>`.
    fn positions(&mut self, node: Node<'a, 'a>) -> Result<Positions<'a>, String> {
        if let Some(known) = self.positions.get(&node.id()) {
            return Ok(*known);
        }
        let source = if is(node, "vertices") {
            let mut inputs = children(node, "input");
            let position = inputs.find(|input| input.attribute("semantic") == Some("POSITION"));
            let position = position.ok_or_else(|| at(node, "<vertices> has no input POSITION"))?;
            self.file.follow(position, "source", "source")?
        } else {
            node
        };
        let positions = match self.positions.get(&source.id()) {
            Some(known) => *known,
            None => {
                let common = child(source, "technique_common");
                let accessor = common.and_then(|common| child(common, "accessor"));
                let accessor = accessor.ok_or_else(|| at(source, "<source> has no accessor"))?;
                Positions { accessor, axes: axes(accessor) }
            }
        };
        self.positions.insert(node.id(), positions);
        self.positions.insert(source.id(), positions);
        Ok(positions)
    }

    /// Adds the vertices of an accessor.
    fn corners_of(
        &self,
        Positions { accessor, axes }: Positions<'a>,
        mesh: &mut Builder,
    ) -> Result<(), String> {
        let array = self.file.follow(accessor, "source", "float_array")?;
        let (count, offset) = (attribute(accessor, "count", 0)?, attribute(accessor, "offset", 0)?);
        let stride = attribute(accessor, "stride", 3)?;
        self.file.walk(array.range().len())?;
        if axes.iter().any(|axis| *axis >= stride) {
            return Err(at(accessor, &format!("a stride of {stride} is too small for three coordinates")));
        }
        let mut words = words(array);
        let short = || at(accessor, &format!("the accessor says {count} corners; its array has fewer"));
        for _ in 0..offset {
            if words.next().is_none() {
                return Err(short());
            }
        }
        let last = axes.iter().max().copied().unwrap_or_default();
        for _ in 0..count {
            let mut corner = [0.0; 3];
            for index in 0..stride {
                match words.next() {
                    Some(word) => {
                        for (coordinate, _) in
                            corner.iter_mut().zip(&axes).filter(|(_, axis)| **axis == index)
                        {
                            *coordinate = number(array, word)?;
                        }
                    }
                    // Padding may be missing after the last vertex.
                    None if index > last => break,
                    None => return Err(short()),
                }
            }
            mesh.corner(DVec3::from_array(corner))?;
        }
        Ok(())
    }
}

/// Returns the axes by the names of an accessor's params, or the first three.
fn axes(accessor: Node) -> [usize; 3] {
    let names: Vec<Option<&str>> = children(accessor, "param")
        .take(limits::XML_ATTRIBUTES)
        .map(|param| param.attribute("name"))
        .collect();
    let named =
        |axis: &str| names.iter().position(|name| name.is_some_and(|name| name.eq_ignore_ascii_case(axis)));
    if let (Some(x), Some(y), Some(z)) = (named("X"), named("Y"), named("Z")) {
        return [x, y, z];
    }
    [0, 1, 2]
}

/// Format of a list of faces.
#[derive(Clone, Copy)]
enum Kind {
    Triangles,
    Polylist,
    Polygons,
    Fans,
    Strips,
}

impl Kind {
    fn of(faces: Node) -> Option<Self> {
        Some(match faces.tag_name().name() {
            "triangles" => Self::Triangles,
            "polylist" => Self::Polylist,
            "polygons" => Self::Polygons,
            "trifans" => Self::Fans,
            "tristrips" => Self::Strips,
            _ => return None,
        })
    }
}

/// Sizes of listed faces.
enum Sizes<'a> {
    /// Each face has three.
    Three,
    /// Each list is one face.
    List,
    /// Each list is a strip.
    Strip,
    /// Each face has its size in this element.
    Given(Node<'a, 'a>),
}

impl<'a> Sizes<'a> {
    fn new(kind: Kind, faces: Node<'a, 'a>) -> Self {
        match (kind, child(faces, "vcount")) {
            (Kind::Polylist, Some(sizes)) => Self::Given(sizes),
            (Kind::Polygons | Kind::Fans, _) => Self::List,
            (Kind::Strips, _) => Self::Strip,
            (Kind::Triangles | Kind::Polylist, _) => Self::Three,
        }
    }

    fn fill(
        &self,
        list: Node<'a, 'a>,
        next: &mut dyn FnMut() -> Result<Option<FaceCorner>, String>,
        mesh: &mut Builder,
    ) -> Result<(), String> {
        let short = || at(list, "the last face has too few corners");
        match self {
            Self::Three => {
                while let Some(a) = next()? {
                    let (Some(b), Some(c)) = (next()?, next()?) else { return Err(short()) };
                    mesh.face([a, b, c])?;
                }
            }
            Self::List => {
                let mut fan = Fan::default();
                while let Some(corner) = next()? {
                    fan.corner(corner, mesh)?;
                }
            }
            Self::Strip => {
                let (mut before, mut odd) = ((next()?, next()?), false);
                while let ((Some(a), Some(b)), Some(c)) = (before, next()?) {
                    mesh.face(if odd { [b, a, c] } else { [a, b, c] })?;
                    (before, odd) = ((Some(b), Some(c)), !odd);
                }
            }
            Self::Given(sizes) => {
                for word in words(*sizes) {
                    let mut fan = Fan::default();
                    for _ in 0..whole(*sizes, word)? {
                        fan.corner(next()?.ok_or_else(short)?, mesh)?;
                    }
                }
            }
        }
        Ok(())
    }
}
