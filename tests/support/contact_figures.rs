//! Results of a scene with contact: figures of a run, of the same kinds as those that
//! `tests/reference/make_scenes.py` takes from MuJoCo.

use glamx::{DQuat, DVec3};
use serde::Deserialize;

use crate::contact_scene::{Scene, View};

/// If there are more bodies, only figures of the whole are taken.
const MANY: usize = 20;

/// Figures of a run; "inside" is within the scene's window.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct Figures {
    /// The largest overlap of all, metres.
    pub deepest: f64,
    /// The largest inside, metres.
    pub resting: f64,
    /// Mean inside of each watched force, N.
    pub forces: Vec<f64>,
    /// Minimum inside of the first of those, N.
    pub least_force: f64,
    /// Speed of the fastest root at the window's end, m/s.
    pub speed: f64,
    /// Largest distance of a root from its place at the window's start, metres.
    pub drift: f64,
    /// Largest rotation of a root from there, rad.
    pub turn: f64,
    /// Joint positions at the window's start and end.
    pub joints: [Vec<f64>; 2],
    /// Place and quaternion of each root at the window's start and end; empty if there are many.
    pub roots: Vec<Vec<[f64; 7]>>,
    /// For many bodies: mean height of their centres, metres.
    #[serde(default)]
    pub mean_height: f64,
    /// For many bodies: the highest centre, metres.
    #[serde(default)]
    pub top: f64,
    /// For many bodies: the farthest centre along x or y, metres.
    #[serde(default)]
    pub spread: f64,
    /// For many bodies of one mass: half the sum of squares of their speeds, m^2/s^2 times that mass.
    #[serde(default)]
    pub kinetic: f64,
}

impl Figures {
    /// Computes the figures of these views of a scene. If there are many bodies, each has this mass.
    ///
    /// # Panics
    /// Panics if there is no view inside: then the test has failed.
    pub fn of(scene: &Scene, views: &[View], mass: f64) -> Self {
        let [from, to] = scene.window;
        let inside: Vec<&View> =
            views.iter().filter(|view| (from - 1e-9..=to + 1e-9).contains(&view.time)).collect();
        let [start, .., end] = inside[..] else { return Self::default() };
        let most = |views: &[&View]| views.iter().map(|view| view.deepest).fold(0.0, f64::max);
        let count = inside.len() as f64;
        let mean = |i: usize| inside.iter().map(|view| view.forces[i]).sum::<f64>() / count;
        let mut new = Self {
            deepest: most(&views.iter().collect::<Vec<_>>()),
            // The first view also covers the time before it.
            resting: most(&inside[1..]),
            forces: (0..start.forces.len()).map(mean).collect(),
            least_force: inside.iter().map(|view| view.forces[0]).fold(f64::INFINITY, f64::min),
            joints: [start.joints.clone(), end.joints.clone()],
            ..Self::default()
        };
        let roots = |view: &View| -> Vec<[f64; 7]> {
            view.roots.iter().filter_map(|root| root.first_chunk().copied()).collect()
        };
        for view in &inside {
            for (now, then) in view.roots.iter().zip(&start.roots) {
                new.drift = new.drift.max(place(now).distance(place(then)));
                new.turn = new.turn.max(rotation(now).angle_between(rotation(then)));
            }
        }
        for root in &end.roots {
            let speed = DVec3::from_slice(&root[7..10]).length();
            new.speed = new.speed.max(speed);
            if end.roots.len() > MANY {
                new.kinetic += 0.5 * mass * speed * speed;
                new.mean_height += root[2] / end.roots.len() as f64;
                new.top = new.top.max(root[2]);
                new.spread = new.spread.max(root[0].abs().max(root[1].abs()));
            }
        }
        if end.roots.len() <= MANY {
            new.roots = vec![roots(start), roots(end)];
        }
        new
    }

    /// Returns the position of a root at the window's end, metres.
    pub fn end(&self, root: usize) -> DVec3 {
        place(&self.roots[1][root])
    }

    /// Returns the displacement of a root in the window, metres.
    pub fn way(&self, root: usize) -> DVec3 {
        self.end(root) - place(&self.roots[0][root])
    }

    /// Returns the z axis of a root at the window's end, world.
    pub fn up(&self, root: usize) -> DVec3 {
        rotation(&self.roots[1][root]) * DVec3::Z
    }
}

fn place(root: &[f64]) -> DVec3 {
    DVec3::from_slice(root)
}

fn rotation(root: &[f64]) -> DQuat {
    DQuat::from_slice(&root[3..])
}
