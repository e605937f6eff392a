//! The triangles of a surface in a tree of boxes, for questions about two surfaces that both move.

use glamx::{DMat3, DPose3, DVec3};

use super::triangle_pair::{Corners, nearest_to};

/// Maximum number of triangles of a leaf.
const LEAF: usize = 1;

/// A part of a point's distance from a mesh by which the search may be off.
const ROUNDING: f64 = 1e-12;

/// Triangles, and boxes around them.
#[derive(Debug)]
pub(super) struct TriangleTree {
    /// A node is followed by those below it: first all of its first half.
    nodes: Vec<Node>,
    triangles: Vec<Corners>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    /// The middle of the box around it.
    middle: DVec3,
    /// Half lengths of the box.
    half: DVec3,
    /// Its first triangle.
    first: u32,
    /// Its triangles if it is a leaf, else 0.
    count: u32,
    /// Index of its second half among the nodes.
    second: u32,
}

/// Two nodes that are still to be looked at, and how far their boxes are apart.
type Pending = (f64, u32, u32);

/// Memory of a search. It is kept from search to search.
#[derive(Debug, Default)]
pub(super) struct TreeScratch {
    pairs: Vec<Pending>,
}

impl TriangleTree {
    /// Makes a tree of the triangles that have finite corners; `None` if none has.
    pub(super) fn new(triangles: impl Iterator<Item = Corners>) -> Option<Self> {
        let mut triangles: Vec<Corners> =
            triangles.filter(|corners| corners.iter().all(|corner| corner.is_finite())).collect();
        let mut tree =
            Self { nodes: Vec::with_capacity(2 * triangles.len() / LEAF + 1), triangles: Vec::new() };
        if triangles.is_empty() {
            return None;
        }
        tree.add(&mut triangles, 0);
        tree.triangles = triangles;
        Some(tree)
    }

    /// About what it takes in memory.
    pub(super) fn bytes(&self) -> u64 {
        (self.nodes.len() * size_of::<Node>() + self.triangles.len() * size_of::<Corners>()) as u64
    }

    fn add(&mut self, triangles: &mut [Corners], first: u32) {
        let corners = triangles.iter().flatten();
        let (least, most) = corners.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(least, most), corner| {
            (least.min(*corner), most.max(*corner))
        });
        let (middle, half) = (0.5 * (least + most), 0.5 * (most - least));
        let index = self.nodes.len();
        let is_leaf = triangles.len() <= LEAF;
        let count = if is_leaf { triangles.len() as u32 } else { 0 };
        self.nodes.push(Node { middle, half, first, count, second: 0 });
        if is_leaf {
            return;
        }
        let along = |corners: &Corners| corners.iter().sum::<DVec3>()[half.max_position()];
        // A stable sort, so that equal ones keep their order.
        triangles.sort_by(|a, b| along(a).total_cmp(&along(b)));
        let (before, after) = triangles.split_at_mut(triangles.len() / 2);
        self.add(before, first);
        self.nodes[index].second = self.nodes.len() as u32;
        self.add(after, first + before.len() as u32);
    }

    fn triangles(&self, node: &Node) -> &[Corners] {
        &self.triangles[node.first as usize..(node.first + node.count) as usize]
    }

    /// Calls `visit` with pairs of triangles of two surfaces whose boxes are nearer than a limit, in the axes of the first
    /// surface. `visit` returns the next limit. Nearer pairs mostly come first.
    pub(super) fn visit_pairs(
        [a, b]: [&Self; 2],
        a_from_b: &DPose3,
        scratch: &mut TreeScratch,
        mut limit: f64,
        mut visit: impl FnMut(&Corners, &Corners) -> f64,
    ) {
        let axes = DMat3::from_quat(a_from_b.rotation);
        let spread = DMat3::from_cols(axes.x_axis.abs(), axes.y_axis.abs(), axes.z_axis.abs());
        let moved = |point: DVec3| axes * point + a_from_b.translation;
        let gap = |i: u32, j: u32| {
            let (one, other) = (&a.nodes[i as usize], &b.nodes[j as usize]);
            let apart = (moved(other.middle) - one.middle).abs() - one.half - spread * other.half;
            apart.max(DVec3::ZERO).length()
        };
        let stack = &mut scratch.pairs;
        stack.clear();
        stack.push((gap(0, 0), 0, 0));
        while let Some((apart, i, j)) = stack.pop() {
            if apart > limit {
                continue;
            }
            let (one, other) = (&a.nodes[i as usize], &b.nodes[j as usize]);
            if one.count > 0 && other.count > 0 {
                for corners in b.triangles(other) {
                    let corners = corners.map(moved);
                    for triangle in a.triangles(one) {
                        limit = visit(triangle, &corners);
                    }
                }
                continue;
            }
            let divides_first =
                other.count > 0 || (one.count == 0 && one.half.max_element() >= other.half.max_element());
            let halves =
                if divides_first { [(i + 1, j), (one.second, j)] } else { [(i, j + 1), (i, other.second)] };
            let [near, far] = halves.map(|(i, j)| (gap(i, j), i, j));
            let (near, far) = if far.0 < near.0 { (far, near) } else { (near, far) };
            stack.push(far);
            stack.push(near);
        }
    }

    /// How far a point is from the surface, where that is below a limit; else the limit.
    pub(super) fn distance_to(&self, point: DVec3, scratch: &mut TreeScratch, limit: f64) -> f64 {
        let gap = |i: u32| {
            let node = &self.nodes[i as usize];
            ((point - node.middle).abs() - node.half).max(DVec3::ZERO).length()
        };
        let mut least = limit;
        let stack = &mut scratch.pairs;
        stack.clear();
        stack.push((gap(0), 0, 0));
        while let Some((apart, i, _)) = stack.pop() {
            if apart * (1.0 - ROUNDING) > least {
                continue;
            }
            let node = &self.nodes[i as usize];
            for corners in self.triangles(node) {
                least = least.min(nearest_to(corners, point).distance(point));
            }
            if node.count == 0 {
                let [near, far] = [i + 1, node.second].map(|i| (gap(i), i, 0));
                let (near, far) = if far.0 < near.0 { (far, near) } else { (near, far) };
                stack.push(far);
                stack.push(near);
            }
        }
        least
    }
}
