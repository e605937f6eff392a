//! Builder of meshes, with the limits for every format.

use std::sync::Arc;

use glamx::DVec3;

use super::Triangles;
use super::hull::{self, NoHull};
use crate::limits;
use crate::robot::{Image, Paint, Texture};

/// Appearance of triangles with one material.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Look {
    /// Absent if the file has none.
    pub(super) color: Option<[f64; 3]>,
    /// 1 is opaque.
    pub(super) alpha: f64,
    pub(super) image: Option<Arc<Image>>,
}

impl Default for Look {
    fn default() -> Self {
        Self { color: None, alpha: 1.0, image: None }
    }
}

/// A corner of a face, and its texture coordinates.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct FaceCorner {
    pub(super) index: u32,
    /// Distance from the left and from the top, 0 to 1.
    pub(super) uv: [f32; 2],
}

/// Vertices and triangles so far.
#[derive(Default)]
pub(super) struct Builder {
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// Texture coordinates of the first triangles; later triangles have none.
    uvs: Vec<[[f32; 2]; 3]>,
    /// First triangle of each look.
    looks: Vec<(usize, Look)>,
    /// Picture for triangles with texture coordinates but no picture.
    cover: Option<Arc<Image>>,
}

impl Builder {
    /// Makes a builder with capacity.
    pub(super) fn with_capacity(corners: usize, triangles: usize) -> Self {
        Self {
            vertices: Vec::with_capacity(corners),
            triangles: Vec::with_capacity(triangles),
            ..Self::default()
        }
    }

    /// Sets the picture for triangles with texture coordinates but no picture.
    pub(super) fn covered_by(self, cover: Option<&Arc<Image>>) -> Self {
        Self { cover: cover.cloned(), ..self }
    }

    /// Adds a vertex and returns its index.
    pub(super) fn corner(&mut self, corner: DVec3) -> Result<u32, String> {
        if self.vertices.len() >= limits::MESH_VERTICES {
            return Err(format!("it has more than {} corners", limits::MESH_VERTICES));
        }
        let index = u32::try_from(self.vertices.len()).map_err(|_| "it has too many corners")?;
        self.vertices.push(corner);
        Ok(index)
    }

    /// Returns the number of vertices.
    pub(super) fn corners(&self) -> usize {
        self.vertices.len()
    }

    /// Adds a triangle of vertices, which [`Builder::finish`] expects to exist.
    pub(super) fn triangle(&mut self, corners: [u32; 3]) -> Result<(), String> {
        if self.triangles.len() >= limits::MESH_TRIANGLES {
            return Err(format!("it has more than {} triangles", limits::MESH_TRIANGLES));
        }
        self.triangles.push(corners);
        Ok(())
    }

    /// Returns the number of triangles.
    pub(super) fn triangles(&self) -> usize {
        self.triangles.len()
    }

    /// Adds a triangle of vertices with texture coordinates.
    pub(super) fn face(&mut self, corners: [FaceCorner; 3]) -> Result<(), String> {
        let uvs = corners.map(|corner| corner.uv);
        if uvs != [[0.0; 2]; 3] {
            self.uvs.resize(self.triangles.len(), [[0.0; 2]; 3]);
            self.uvs.push(uvs);
        }
        self.triangle(corners.map(|corner| corner.index))
    }

    /// Sets the look of the triangles from here on.
    pub(super) fn paint(&mut self, look: Look) {
        let first = self.triangles.len();
        // A look without triangles is removed, so that there are never more looks than triangles.
        self.looks.pop_if(|(begin, _)| *begin == first);
        if self.looks.last().map_or(look != Look::default(), |(_, last)| *last != look) {
            self.looks.push((first, look));
        }
    }

    /// Takes the texture coordinates, which [`Builder::finish`] does not return: of the first triangles, in
    /// order.
    pub(super) fn take_uvs(&mut self) -> Vec<[[f32; 2]; 3]> {
        std::mem::take(&mut self.uvs)
    }

    /// Takes the looks, which [`Builder::finish`] does not return.
    pub(super) fn take_paints(&mut self) -> Vec<Paint> {
        let (mut looks, uvs) = (std::mem::take(&mut self.looks), self.take_uvs());
        if self.cover.is_some() && looks.first().is_none_or(|(first, _)| *first > 0) {
            looks.insert(0, (0, Look::default()));
        }
        let ends = looks.iter().skip(1).map(|(begin, _)| *begin).chain([self.triangles.len()]);
        let ends: Vec<usize> = ends.collect();
        let paint = |((first, mut look), end): ((usize, Look), usize)| {
            if let Some(cover) = self.cover.as_ref().filter(|_| look.image.is_none()) {
                let own = uvs.get(first..end.min(uvs.len())).unwrap_or_default();
                if own.iter().any(|own| *own != [[0.0; 2]; 3]) {
                    // The picture replaces the colour.
                    look = Look { color: None, alpha: look.alpha, image: Some(Arc::clone(cover)) };
                }
            }
            let texture = look.image.map(|image| {
                let mut own = uvs.get(first..end.min(uvs.len())).unwrap_or_default().to_vec();
                own.resize(end - first, [[0.0; 2]; 3]);
                Texture { image, uvs: own }
            });
            Paint { first, color: look.color, alpha: look.alpha, texture }
        };
        looks.into_iter().zip(ends).map(paint).collect()
    }

    /// Returns the convex hull of vertices without triangles.
    pub(super) fn hull(self) -> Result<Self, String> {
        match hull::of_corners(&self.vertices) {
            Ok((vertices, triangles)) => Ok(Self { vertices, triangles, ..Self::default() }),
            Err(NoHull::Corners(why)) => Err(why),
            Err(NoHull::Volume) => Err("it has no triangles".to_owned()),
        }
    }

    /// Returns the mesh without vertices that no triangle uses: they would be part of its hull.
    pub(super) fn pruned(self) -> Result<Triangles, String> {
        const UNUSED: u32 = u32::MAX;
        let Self { mut vertices, mut triangles, .. } = self;
        let mut new_indices = vec![UNUSED; vertices.len()];
        for corner in triangles.iter().flatten() {
            let slot = new_indices.get_mut(*corner as usize);
            *slot.ok_or("a face names a corner that it does not have")? = 0;
        }
        let mut used = new_indices.iter().map(|index| *index != UNUSED);
        vertices.retain(|_| used.next().unwrap_or(false));
        for (index, slot) in (0_u32..).zip(new_indices.iter_mut().filter(|slot| **slot != UNUSED)) {
            *slot = index;
        }
        for corner in triangles.iter_mut().flatten() {
            *corner = new_indices.get(*corner as usize).copied().unwrap_or_default();
        }
        vertices.shrink_to_fit();
        triangles.shrink_to_fit();
        Ok((vertices, triangles))
    }

    /// Returns the mesh, if it has triangles and all coordinates are finite.
    pub(super) fn finish(self) -> Result<Triangles, String> {
        if self.triangles.is_empty() {
            return Err("it has no triangles".to_owned());
        }
        let (vertices, triangles) = self.pruned()?;
        if vertices.iter().any(|vertex| !vertex.is_finite()) {
            return Err("a corner is not finite".to_owned());
        }
        if vertices.iter().any(|vertex| vertex.abs().max_element() > limits::MAGNITUDE) {
            return Err(format!("a corner is further than {:e} away", limits::MAGNITUDE));
        }
        Ok((vertices, triangles))
    }
}

/// Divides a polygon into a fan of triangles from its first corner, one corner at a time.
#[derive(Default)]
pub(super) struct Fan {
    first: Option<FaceCorner>,
    last: Option<FaceCorner>,
}

impl Fan {
    /// Adds the next corner of the polygon.
    pub(super) fn corner(&mut self, corner: FaceCorner, into: &mut Builder) -> Result<(), String> {
        match (self.first, self.last.replace(corner)) {
            (None, _) => {
                self.first = Some(corner);
                self.last = None;
                Ok(())
            }
            (Some(_), None) => Ok(()),
            (Some(first), Some(last)) => into.face([first, last, corner]),
        }
    }
}

/// Returns a texture coordinate that can be drawn.
pub(super) fn texture_coordinate(value: f64) -> f32 {
    const MAX: f64 = 1e6;
    if value.is_finite() { value.clamp(-MAX, MAX) as f32 } else { 0.0 }
}
