//! Edges of a convex hull, by which the farthest corner in a direction is found without a scan of all
//! corners.

use glamx::DVec3;
use rapier3d_f64::parry::shape::ConvexPolyhedron;

/// Number of corners below which all are scanned.
const WORTH_A_GRAPH: usize = 24;

/// Number of corners of the largest hull with a graph.
const MAX_CORNERS: usize = 1_024;

/// Number of start directions along each side of a cube's face.
const SIDE: usize = 4;

/// Edges of a hull.
pub(super) struct Graph {
    /// Offset of the neighbours of each corner, and the end of the last ones.
    first: Vec<u32>,
    neighbours: Vec<u16>,
    /// Farthest corner in each start direction.
    starts: Vec<u16>,
}

impl Graph {
    /// Returns the graph of a hull with enough corners, and not too many.
    pub(super) fn of(hull: &ConvexPolyhedron) -> Option<Self> {
        let points = hull.points();
        if !(WORTH_A_GRAPH..=MAX_CORNERS).contains(&points.len()) {
            return None;
        }
        let mut edges: Vec<(u16, u16)> = Vec::new();
        for edge in hull.edges() {
            let [a, b] = [edge.vertices[0], edge.vertices[1]].map(u16::try_from);
            let (a, b) = (a.ok()?, b.ok()?);
            edges.extend([(a, b), (b, a)]);
        }
        edges.sort_unstable();
        edges.dedup();
        let first = (0..=points.len()).map(|corner| edges.partition_point(|(a, _)| usize::from(*a) < corner));
        let first = first.map(u32::try_from).collect::<Result<Vec<_>, _>>().ok()?;
        // A corner without an edge would end a search that begins at it.
        if first.windows(2).any(|pair| pair[0] == pair[1]) {
            return None;
        }
        let farthest = |direction: DVec3| {
            let far = |a: &u16, b: &u16| {
                let along = |corner: u16| points[usize::from(corner)].dot(direction);
                along(*a).total_cmp(&along(*b))
            };
            (0..points.len() as u16).max_by(far).unwrap_or(0)
        };
        let starts = (0..6 * SIDE * SIDE).map(|cell| farthest(direction(cell))).collect();
        Some(Self { first, neighbours: edges.into_iter().map(|(_, b)| b).collect(), starts })
    }

    fn neighbours(&self, corner: usize) -> &[u16] {
        &self.neighbours[self.first[corner] as usize..self.first[corner + 1] as usize]
    }

    /// Returns the corner that lies farthest along a direction, over ascending edges from a corner that
    /// depends on the direction only.
    pub(super) fn farthest(&self, points: &[DVec3], along: DVec3) -> usize {
        let mut corner = usize::from(self.starts[cell::<SIDE>(along)]);
        let mut far = points[corner].dot(along);
        loop {
            let before = corner;
            for &next in self.neighbours(before) {
                let there = points[usize::from(next)].dot(along);
                if there > far {
                    (corner, far) = (usize::from(next), there);
                }
            }
            if corner == before {
                return corner;
            }
        }
    }

    /// Calls `found` with each corner that is at least `least` along a direction, in their order. It starts
    /// from the farthest one, to which every step leads up, over edges between such corners. They are
    /// connected, because the hull is convex.
    pub(super) fn beyond(&self, points: &[DVec3], along: DVec3, least: f64, mut found: impl FnMut(DVec3)) {
        let corner = self.farthest(points, along);
        if points[corner].dot(along) < least {
            return;
        }
        let mut reached = [0u64; MAX_CORNERS / 64];
        let mut open = [0u64; MAX_CORNERS / 64];
        reached[corner / 64] |= 1 << (corner % 64);
        open[corner / 64] |= 1 << (corner % 64);
        let words = points.len().div_ceil(64);
        while let Some(word) = open[..words].iter().position(|bits| *bits != 0) {
            let corner = 64 * word + open[word].trailing_zeros() as usize;
            open[word] &= open[word] - 1;
            for &next in self.neighbours(corner) {
                let next = usize::from(next);
                let bit = 1 << (next % 64);
                if reached[next / 64] & bit == 0 && points[next].dot(along) >= least {
                    reached[next / 64] |= bit;
                    open[next / 64] |= bit;
                }
            }
        }
        for (word, bits) in reached[..words].iter().enumerate() {
            let mut bits = *bits;
            while bits != 0 {
                found(points[64 * word + bits.trailing_zeros() as usize]);
                bits &= bits - 1;
            }
        }
    }
}

/// Returns the centre of a cell of the cube.
fn direction(cell: usize) -> DVec3 {
    let part = |i: usize| (2 * i + 1) as f64 / SIDE as f64 - 1.0;
    let (face, u, v) = (cell / (SIDE * SIDE), part(cell / SIDE % SIDE), part(cell % SIDE));
    let out = if face % 2 == 0 { 1.0 } else { -1.0 };
    match face / 2 {
        0 => DVec3::new(out, u, v),
        1 => DVec3::new(u, out, v),
        _ => DVec3::new(u, v, out),
    }
}

/// Returns the cell that a direction points into, of `SIDE` by `SIDE` on each face of a cube.
pub(super) fn cell<const SIDE: usize>(direction: DVec3) -> usize {
    let size = direction.abs();
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.y >= size.z {
        1
    } else {
        2
    };
    let (out, u, v) = match axis {
        0 => (direction.x, direction.y, direction.z),
        1 => (direction.y, direction.x, direction.z),
        _ => (direction.z, direction.x, direction.y),
    };
    let part = |at: f64| {
        let cell = (at / out.abs() + 1.0) * 0.5 * SIDE as f64;
        // NaN begins anywhere.
        (cell as usize).min(SIDE - 1)
    };
    let face = 2 * axis + usize::from(out < 0.0);
    (face * SIDE + part(u)) * SIDE + part(v)
}

#[cfg(test)]
mod tests {
    use rapier3d_f64::parry::shape::SharedShape;

    use super::*;

    /// Returns a hull of some 200 corners of a lopsided egg, with flat ends.
    fn hull() -> SharedShape {
        let corner = |i: u32| {
            let (z, turn) = (1.0 - f64::from(i) / 120.0, f64::from(i) * 2.4);
            let across = (1.0 - z * z).max(0.0).sqrt();
            DVec3::new(across * turn.cos(), 0.6 * across * turn.sin(), z.clamp(-0.8, 0.9))
        };
        SharedShape::convex_hull(&(0..=240).map(corner).collect::<Vec<_>>()).unwrap()
    }

    #[test]
    fn the_search_over_edges_finds_the_corner_that_a_full_search_finds() {
        let shape = hull();
        let polyhedron = shape.as_convex_polyhedron().unwrap();
        let (graph, points) = (Graph::of(polyhedron).unwrap(), polyhedron.points());
        assert!(points.len() > 100);
        let mut some = 0;
        for i in 0..2_000 {
            let turn = f64::from(i);
            let along = DVec3::new((1.1 * turn).sin(), (1.7 * turn).cos(), (0.3 * turn).sin());
            let along = along.try_normalize().unwrap();
            let top = points.iter().map(|point| point.dot(along)).fold(f64::NEG_INFINITY, f64::max);
            for depth in [-0.01, 1e-3, 0.05, 0.7, 3.0] {
                let least = top - depth;
                let mut found = Vec::new();
                graph.beyond(points, along, least, |point| found.push(point));
                let all: Vec<DVec3> =
                    points.iter().copied().filter(|point| point.dot(along) >= least).collect();
                assert_eq!(found, all, "{i} {depth}");
                some += usize::from(found.len() > 1 && found.len() < points.len());
            }
        }
        assert!(some > 2_000);
    }

    #[test]
    fn each_direction_is_in_its_cell() {
        for index in 0..6 * SIDE * SIDE {
            assert_eq!(cell::<SIDE>(direction(index)), index);
        }
        for odd in [DVec3::ZERO, DVec3::NAN, DVec3::splat(f64::INFINITY)] {
            assert!(cell::<SIDE>(odd) < 6 * SIDE * SIDE);
        }
    }
}
