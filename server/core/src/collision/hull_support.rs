//! Support functions of a convex hull for GJK and clipping: the farthest corner in a direction, and the face
//! in that direction.
//!
//! parry scans all corners and all faces, and takes the first four corners of a face. For a round sole with a
//! hundred corners this is a sliver at its edge. Here corners are found over edges, faces are those at the
//! farthest corner, and the four corners span the face.

use glamx::DVec3;
use rapier3d_f64::parry::shape::{
    ConvexPolyhedron, PackedFeatureId, PolygonalFeature, PolygonalFeatureMap, Shape, SupportMap,
};

use super::hull::Graph;

/// Number of corners of a face that parry clips.
const CLIPPED: usize = 4;

/// A hull, with its edges if it has many corners.
pub(super) struct HullSupport<'a> {
    hull: &'a ConvexPolyhedron,
    graph: Option<&'a Graph>,
}

impl<'a> HullSupport<'a> {
    /// Returns the support of a shape that is a hull.
    pub(super) fn of(shape: &'a dyn Shape, graph: Option<&'a Graph>) -> Option<Self> {
        shape.as_convex_polyhedron().map(|hull| Self { hull, graph })
    }

    /// Returns the face whose normal is nearest to a direction: among those at the corner that lies farthest
    /// there, or among all.
    fn face(&self, direction: DVec3) -> usize {
        let faces = self.hull.faces();
        let towards =
            |face: &usize| faces.get(*face).map_or(f64::NEG_INFINITY, |face| face.normal.dot(direction));
        // On ties the first.
        let best = |all: &mut dyn Iterator<Item = usize>| {
            all.reduce(|best, next| if towards(&next) > towards(&best) { next } else { best })
        };
        let about = self.graph.and_then(|graph| {
            let corner = self.hull.vertices().get(graph.farthest(self.hull.points(), direction))?;
            let first = corner.first_adj_face_or_edge as usize;
            self.hull.faces_adj_to_vertex().get(first..first + corner.num_adj_faces_or_edge as usize)
        });
        let about = about.and_then(|about| best(&mut about.iter().map(|face| *face as usize)));
        about.or_else(|| best(&mut (0..faces.len()))).unwrap_or(0)
    }

    /// Returns up to four corners of a face in order, as indices into its list: all, or four that span it.
    /// The direction for the first one is fixed to the hull's axes, so that a resting contact keeps its
    /// points.
    fn spanning(&self, corners: &[u32], normal: DVec3) -> ([usize; CLIPPED], usize) {
        if corners.len() <= CLIPPED {
            return ([0, 1, 2, 3], corners.len());
        }
        let points = self.hull.points();
        let at = |index: usize| points[corners[index] as usize];
        let farthest = |score: &dyn Fn(DVec3) -> f64| {
            (0..corners.len()).max_by(|a, b| score(at(*a)).total_cmp(&score(at(*b)))).unwrap_or(0)
        };
        let (u, v) = normal.any_orthonormal_pair();
        let start = u * 0.83 + v * 0.55;
        let first = farthest(&|point| point.dot(start));
        let second = farthest(&|point| point.distance_squared(at(first)));
        let across = normal.cross(at(second) - at(first));
        let mut kept =
            [first, second, farthest(&|point| point.dot(across)), farthest(&|point| -point.dot(across))];
        kept.sort_unstable();
        let mut count = 1;
        for i in 1..CLIPPED {
            if kept[i] != kept[count - 1] {
                kept[count] = kept[i];
                count += 1;
            }
        }
        (kept, count)
    }
}

impl SupportMap for HullSupport<'_> {
    fn local_support_point(&self, direction: DVec3) -> DVec3 {
        match self.graph {
            Some(graph) => {
                let points = self.hull.points();
                points[graph.farthest(points, direction)]
            }
            None => self.hull.local_support_point(direction),
        }
    }
}

impl PolygonalFeatureMap for HullSupport<'_> {
    fn local_support_feature(&self, direction: DVec3, found: &mut PolygonalFeature) {
        let id = self.face(direction);
        let Some(face) = self.hull.faces().get(id) else { return };
        let first = face.first_vertex_or_edge as usize;
        let whole = first..first + face.num_vertices_or_edges as usize;
        let (corners, edges) =
            (&self.hull.vertices_adj_to_face()[whole.clone()], &self.hull.edges_adj_to_face()[whole]);
        let (kept, count) = self.spanning(corners, face.normal);
        for (i, &index) in kept[..count].iter().enumerate() {
            found.vertices[i] = self.hull.points()[corners[index] as usize];
            found.vids[i] = PackedFeatureId::vertex(corners[index]);
            found.eids[i] = PackedFeatureId::edge(edges[index]);
        }
        found.fid = PackedFeatureId::face(id as u32);
        found.num_vertices = count;
    }

    fn is_convex_polyhedron(&self) -> bool {
        true
    }
}

#[cfg(test)]
mod tests {
    use rapier3d_f64::parry::shape::SharedShape;

    use super::*;

    /// Returns a prism with `sides` sides, about z.
    fn prism(sides: u32) -> SharedShape {
        let corner = |i: u32| {
            let turn = f64::from(i / 2) * std::f64::consts::TAU / f64::from(sides);
            DVec3::new(turn.cos(), turn.sin(), if i.is_multiple_of(2) { 0.5 } else { -0.5 })
        };
        SharedShape::convex_hull(&(0..2 * sides).map(corner).collect::<Vec<_>>()).unwrap()
    }

    /// The largest quadrilateral in a regular polygon of n sides is a square: 2 of n / 2 sin(2 pi / n).
    #[test]
    fn four_corners_span_a_face_of_many() {
        for sides in [5, 6, 12, 40] {
            let shape = prism(sides);
            let hull = shape.as_convex_polyhedron().unwrap();
            let graph = Graph::of(hull);
            let mut found = PolygonalFeature::default();
            HullSupport { hull, graph: graph.as_ref() }.local_support_feature(DVec3::Z, &mut found);
            assert_eq!(found.num_vertices, 4, "{sides}");
            let corner = |i: usize| found.vertices[i % 4];
            assert!((0..4).all(|i| (corner(i).z - 0.5).abs() < 1e-12));
            // In order about the normal: each corner turns the same way.
            let turns = (0..4).map(|i| (corner(i + 1) - corner(i)).cross(corner(i + 2) - corner(i + 1)).z);
            let turns: Vec<f64> = turns.collect();
            assert!(
                turns.iter().all(|turn| *turn > 0.0) || turns.iter().all(|turn| *turn < 0.0),
                "{turns:?}"
            );
            let area = 0.5 * (corner(2) - corner(0)).cross(corner(3) - corner(1)).length();
            assert!(area > 0.85 * 2.0 || sides < 8 && area > 1.6, "{sides}: {area}");
        }
    }

    #[test]
    fn the_farthest_corner_equals_that_of_a_full_search() {
        let shape = prism(40);
        let hull = shape.as_convex_polyhedron().unwrap();
        let graph = Graph::of(hull).unwrap();
        let searched = HullSupport { hull, graph: Some(&graph) };
        for i in 0..2_000 {
            let turn = f64::from(i);
            let direction = DVec3::new((1.1 * turn).sin(), (1.7 * turn).cos(), (0.3 * turn).sin());
            let (here, there) =
                (searched.local_support_point(direction), hull.local_support_point(direction));
            assert!((here.dot(direction) - there.dot(direction)).abs() < 1e-15, "{direction}");
            // The face has that corner.
            let face = &hull.faces()[searched.face(direction)];
            let first = face.first_vertex_or_edge as usize;
            let corners = &hull.vertices_adj_to_face()[first..first + face.num_vertices_or_edges as usize];
            assert!(corners.iter().any(|corner| hull.points()[*corner as usize] == here), "{direction}");
        }
    }
}
