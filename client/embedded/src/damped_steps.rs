//! PyBullet's search for joint positions of a pose: damped steps that may end before it.
//!
//! S. R. Buss, "Introduction to inverse kinematics with Jacobian transpose, pseudoinverse and damped least
//! squares methods", 2004. The Python client has the same search for interpreters without this module
//! (`simd_client/pybullet/damped_steps.py`), and a test holds both against each other.

use std::f64::consts::{FRAC_PI_4, PI};

use glamx::{DPose3, DQuat, DVec3};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

/// Damping of the null space, squared.
const NULL_SPACE_DAMPING: f64 = 0.6 * 0.6;
/// Rad, slightly reduced: Bullet's angle has single precision, in which pi is more than pi.
const HALF_TURN: f64 = 3.141_592_62;
/// Parts of the way to their rest poses, and back within their limits, that joints wish to go in a step.
const TO_REST: f64 = 0.001;
const TO_LIMITS: f64 = 10.0;
/// Fraction of the largest singular value: smaller ones are ignored in the null space.
const SINGULAR: f64 = 0.01;

/// A pose as Python gives it: x y z, and a quaternion x y z w.
type Numbers = [f64; 7];
/// Difference or change of a pose: a linear part and an angular one, which is not read without an
/// orientation.
type Column = [f64; 6];

/// A movable joint of a chain.
struct Step {
    /// Fixed transform from the joint before.
    way: DPose3,
    slides: bool,
    axis: DVec3,
    /// Number of its degree of freedom.
    column: usize,
}

/// The joints between a robot's base and one of its links.
#[pyclass(frozen, module = "simd_embedded")]
pub(crate) struct Chain {
    steps: Vec<Step>,
    /// Fixed transform from the last joint to the link's end.
    end: DPose3,
}

/// Goal of a search: the place, and the orientation if it counts.
type Goal = ([f64; 3], Option<[f64; 4]>);
/// Lower and upper limits, ranges and rest poses of the null space, and the bounds of each step.
type Wishes = (Option<[Vec<f64>; 4]>, Option<[Vec<f64>; 2]>);

#[pymethods]
impl Chain {
    /// `steps` has the movable joints, from the base on. Each has the fixed transform to it, whether it
    /// slides, its axis, and the number of its degree of freedom. `end` is the fixed transform from the last
    /// of them to the link's end.
    #[new]
    fn new(steps: Vec<(Numbers, bool, [f64; 3], usize)>, end: Numbers) -> Self {
        let step = |(way, slides, axis, column): (Numbers, bool, [f64; 3], usize)| Step {
            way: pose(way),
            slides,
            axis: DVec3::from_array(axis),
            column,
        };
        Self { steps: steps.into_iter().map(step).collect(), end: pose(end) }
    }

    /// Returns joint positions after at most `ends.0` steps, or after the first within `ends.1` metres of the
    /// goal. `joints` has the positions at the start and the damping, one for each degree of freedom. `None`
    /// if a step needs a pseudoinverse, which this module does not compute. Raises `ValueError` for lists of
    /// other lengths.
    fn search(
        &self,
        root: Numbers,
        joints: (Vec<f64>, Vec<f64>),
        goal: Goal,
        wishes: Wishes,
        ends: (usize, f64),
    ) -> PyResult<Option<Vec<f64>>> {
        let (mut q, damping) = joints;
        let count = q.len();
        let (null_space, bounds) = wishes;
        let lists = null_space.iter().flatten().chain(bounds.iter().flatten()).chain([&damping]);
        if lists.map(Vec::len).any(|length| length != count)
            || self.steps.iter().any(|step| step.column >= count)
        {
            return Err(PyValueError::new_err("each list has one number for each degree of freedom"));
        }
        let (root, (most, threshold)) = (pose(root), ends);
        let rows = if goal.1.is_some() { 6 } else { 3 };
        let mut columns = Vec::with_capacity(self.steps.len());
        for _ in 0..most {
            let off = off(&self.at(root, &q, &mut columns), goal);
            let left = DVec3::new(off[0], off[1], off[2]).length();
            let step = match &null_space {
                None => Some(self.damped(&columns, &damping, &off[..rows])),
                Some(null_space) => self.within_null_space(&columns, &wish(null_space, &q), &off[..rows]),
            };
            let Some(mut step) = step else { return Ok(None) };
            let largest = step.iter().fold(0.0, |largest: f64, turn| largest.max(turn.abs()));
            if largest > FRAC_PI_4 {
                step.iter_mut().for_each(|turn| *turn *= FRAC_PI_4 / largest);
            }
            q.iter_mut().zip(&step).for_each(|(q, turn)| *q += turn);
            if let Some([lower, upper]) = &bounds {
                for ((q, lower), upper) in q.iter_mut().zip(lower).zip(upper) {
                    *q = q.max(*lower).min(*upper);
                }
            }
            // A distance that is not a number ends it too.
            if left.is_nan() || left <= threshold {
                break;
            }
        }
        Ok(Some(q))
    }
}

impl Chain {
    /// Returns the end's pose, and writes the columns of its Jacobian, one for each joint of the chain.
    fn at(&self, root: DPose3, q: &[f64], columns: &mut Vec<Column>) -> DPose3 {
        columns.clear();
        let mut pose = root;
        for step in &self.steps {
            let at = pose * step.way;
            let along = at.rotation * step.axis;
            let value = q[step.column];
            // The origin is replaced by the arm once the end is known.
            columns.push([along.x, along.y, along.z, at.translation.x, at.translation.y, at.translation.z]);
            pose = if step.slides {
                DPose3::from_parts(at.translation + along * value, at.rotation)
            } else {
                let (sine, cosine) = (0.5 * value).sin_cos();
                let turn =
                    DQuat::from_xyzw(step.axis.x * sine, step.axis.y * sine, step.axis.z * sine, cosine);
                DPose3::from_parts(at.translation, at.rotation * turn)
            };
        }
        let end = pose * self.end;
        for (step, column) in self.steps.iter().zip(columns) {
            let [a, b, c, x, y, z] = *column;
            let along = DVec3::new(a, b, c);
            *column = if step.slides {
                [a, b, c, 0.0, 0.0, 0.0]
            } else {
                let arm = along.cross(end.translation - DVec3::new(x, y, z));
                [arm.x, arm.y, arm.z, a, b, c]
            };
        }
        end
    }

    /// Returns (J'J + damping)^-1 J' off. Joints outside of the chain do not move.
    fn damped(&self, columns: &[Column], damping: &[f64], off: &[f64]) -> Vec<f64> {
        let size = columns.len();
        let mut matrix = vec![0.0; size * size];
        for (i, a) in columns.iter().enumerate() {
            for (j, b) in columns[..=i].iter().enumerate() {
                matrix[i * size + j] = dot(&a[..off.len()], b);
            }
            matrix[i * size + i] += damping[self.steps[i].column];
        }
        let mut solved: Vec<f64> = columns.iter().map(|column| dot(off, column)).collect();
        solve(&mut matrix, &mut solved);
        let mut step = vec![0.0; damping.len()];
        for (of_chain, turn) in self.steps.iter().zip(solved) {
            step[of_chain.column] = turn;
        }
        step
    }

    /// Returns the wished step, corrected so that the end moves towards the goal: w + J'(JJ' + damping)^-1
    /// (off - J w). `None` if small singular values are to be left out.
    fn within_null_space(&self, columns: &[Column], wish: &[f64], off: &[f64]) -> Option<Vec<f64>> {
        let (rows, mut off) = (off.len(), off.to_vec());
        let mut matrix = vec![0.0; rows * rows];
        for (step, column) in self.steps.iter().zip(columns) {
            for i in 0..rows {
                for j in 0..=i {
                    matrix[i * rows + j] += column[i] * column[j];
                }
                off[i] -= column[i] * wish[step.column];
            }
        }
        let mut trace = 0.0;
        for i in 0..rows {
            matrix[i * rows + i] += NULL_SPACE_DAMPING;
            trace += matrix[i * rows + i];
        }
        if SINGULAR * trace >= NULL_SPACE_DAMPING || trace.is_nan() {
            return None;
        }
        solve(&mut matrix, &mut off);
        let mut step = wish.to_vec();
        for (of_chain, column) in self.steps.iter().zip(columns) {
            step[of_chain.column] += dot(&off, column);
        }
        Some(step)
    }
}

/// Returns the sum of the products, as far as both have numbers.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn pose([x, y, z, i, j, k, w]: Numbers) -> DPose3 {
    DPose3::from_parts(DVec3::new(x, y, z), DQuat::from_xyzw(i, j, k, w))
}

/// Returns how far the goal is away: metres, and a rotation vector.
fn off(at: &DPose3, (place, turn): Goal) -> Column {
    let [x, y, z] = (DVec3::from_array(place) - at.translation).to_array();
    let [i, j, k] = turn.map_or([0.0; 3], |turn| {
        rotation_vector(signed(DQuat::from_array(turn)) * signed(at.rotation).conjugate())
    });
    [x, y, z, i, j, k]
}

/// Returns axis times angle, the shorter way.
fn rotation_vector(turn: DQuat) -> [f64; 3] {
    let axis = DVec3::new(turn.x, turn.y, turn.z);
    let sine = axis.length();
    let mut angle = 2.0 * sine.atan2(turn.w);
    if angle > HALF_TURN {
        angle -= 2.0 * PI;
    }
    (axis * if sine > 0.0 { angle / sine } else { 2.0 }).to_array()
}

/// Returns a quaternion with Bullet's sign for a matrix. The sign decides the direction of half a turn.
fn signed(turn: DQuat) -> DQuat {
    let [x, y, z, w] = turn.to_array();
    // The first of equally large parts decides.
    let larger = |most: f64, next: f64| if next.abs() > most.abs() { next } else { most };
    let leading = if w.abs() > 0.5 { w } else { larger(larger(x, y), z) };
    if leading >= 0.0 { turn } else { -turn }
}

/// Returns the preferred step of the joints.
fn wish([lower, upper, ranges, rest]: &[Vec<f64>; 4], q: &[f64]) -> Vec<f64> {
    let wish = |(index, q): (usize, &f64)| {
        let beyond = (upper[index] - q).min(0.0) + (lower[index] - q).max(0.0);
        let back = if beyond == 0.0 { 0.0 } else { TO_LIMITS * beyond / ranges[index] };
        TO_REST * (rest[index] - q) + back
    };
    q.iter().enumerate().map(wish).collect()
}

/// Solves a system with a symmetric positive definite matrix, of which the lower triangle is read, by
/// Cholesky's factors.
fn solve(matrix: &mut [f64], of: &mut [f64]) {
    let size = of.len();
    for i in 0..size {
        for j in 0..=i {
            let known = dot(&matrix[i * size..i * size + j], &matrix[j * size..j * size + j]);
            let rest = matrix[i * size + j] - known;
            matrix[i * size + j] = if i == j { rest.sqrt() } else { rest / matrix[j * size + j] };
        }
        of[i] = (of[i] - dot(&matrix[i * size..i * size + i], &of[..i])) / matrix[i * size + i];
    }
    for i in (0..size).rev() {
        let known: f64 = (i + 1..size).map(|j| matrix[j * size + i] * of[j]).sum();
        of[i] = (of[i] - known) / matrix[i * size + i];
    }
}
