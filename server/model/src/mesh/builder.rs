//! A mesh as it is put together, with the limits that hold for every format.

use glamx::DVec3;

use super::Triangles;
use crate::limits;
use crate::robot::Paint;

/// Corners and triangles so far.
#[derive(Default)]
pub(super) struct Builder {
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    paints: Vec<Paint>,
}

impl Builder {
    /// With room for so many.
    pub(super) fn with_capacity(corners: usize, triangles: usize) -> Self {
        Self {
            vertices: Vec::with_capacity(corners),
            triangles: Vec::with_capacity(triangles),
            paints: Vec::new(),
        }
    }

    /// Adds a corner and gives its index.
    pub(super) fn corner(&mut self, corner: DVec3) -> Result<u32, String> {
        if self.vertices.len() >= limits::MESH_VERTICES {
            return Err(format!("it has more than {} corners", limits::MESH_VERTICES));
        }
        let index = u32::try_from(self.vertices.len()).map_err(|_| "it has too many corners")?;
        self.vertices.push(corner);
        Ok(index)
    }

    /// How many corners there are.
    pub(super) fn corners(&self) -> usize {
        self.vertices.len()
    }

    /// Adds a triangle of corners, which [`Builder::finish`] expects to be there.
    pub(super) fn triangle(&mut self, corners: [u32; 3]) -> Result<(), String> {
        if self.triangles.len() >= limits::MESH_TRIANGLES {
            return Err(format!("it has more than {} triangles", limits::MESH_TRIANGLES));
        }
        self.triangles.push(corners);
        Ok(())
    }

    /// How many triangles there are.
    pub(super) fn triangles(&self) -> usize {
        self.triangles.len()
    }

    /// The triangles from here on have this colour.
    pub(super) fn paint(&mut self, color: Option<[f64; 3]>) {
        let first = self.triangles.len();
        // What was painted and is empty is forgotten, so that there are no more than triangles.
        self.paints.pop_if(|paint| paint.first == first);
        if self.paints.last().map_or(color.is_some(), |last| last.color != color) {
            self.paints.push(Paint { first, color });
        }
    }

    /// What was painted, which [`Builder::finish`] does not give.
    pub(super) fn take_paints(&mut self) -> Vec<Paint> {
        std::mem::take(&mut self.paints)
    }

    /// What there is, without corners that no triangle uses: they would be part of its hull.
    pub(super) fn pruned(self) -> Result<Triangles, String> {
        const UNUSED: u32 = u32::MAX;
        let Self { mut vertices, mut triangles, .. } = self;
        let mut places = vec![UNUSED; vertices.len()];
        for corner in triangles.iter().flatten() {
            let place = places.get_mut(*corner as usize);
            *place.ok_or("a face names a corner that it does not have")? = 0;
        }
        let mut used = places.iter().map(|place| *place != UNUSED);
        vertices.retain(|_| used.next().unwrap_or(false));
        for (index, place) in (0_u32..).zip(places.iter_mut().filter(|place| **place != UNUSED)) {
            *place = index;
        }
        for corner in triangles.iter_mut().flatten() {
            *corner = places.get(*corner as usize).copied().unwrap_or_default();
        }
        vertices.shrink_to_fit();
        triangles.shrink_to_fit();
        Ok((vertices, triangles))
    }

    /// The mesh, if there is one, and each corner of it is at a place.
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

/// A polygon as a fan of triangles from its first corner, one corner at a time.
#[derive(Default)]
pub(super) struct Fan {
    first: Option<u32>,
    last: Option<u32>,
}

impl Fan {
    /// The next corner of the polygon.
    pub(super) fn corner(&mut self, corner: u32, into: &mut Builder) -> Result<(), String> {
        match (self.first, self.last.replace(corner)) {
            (None, _) => {
                self.first = Some(corner);
                self.last = None;
                Ok(())
            }
            (Some(_), None) => Ok(()),
            (Some(first), Some(last)) => into.triangle([first, last, corner]),
        }
    }
}
