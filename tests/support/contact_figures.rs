//! What a scene with contact comes to: figures of a run, equal in kind to those that
//! `tests/reference/make_scenes.py` takes from MuJoCo.

use glamx::{DQuat, DVec3};
use serde::Deserialize;

use crate::contact_scene::{Scene, View};

/// More bodies than these are described by what they are together.
const MANY: usize = 20;

/// Of a run; "inside" is within the scene's window.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct Figures {
    /// The largest overlap of all, metres.
    pub deepest: f64,
    /// The largest inside, metres.
    pub resting: f64,
    /// Means inside of what the scene watches, N.
    pub forces: Vec<f64>,
    /// The least inside of the first of those, N.
    pub least_force: f64,
    /// Of the fastest root at the window's end, m/s.
    pub speed: f64,
    /// How far a root got from where the window found it, metres.
    pub drift: f64,
    /// How far it turned, rad.
    pub turn: f64,
    /// At the window's start and end.
    pub joints: [Vec<f64>; 2],
    /// Place and quaternion of each root at the window's start and end; none of many.
    pub roots: Vec<Vec<[f64; 7]>>,
    /// Of many: mean height of their centres, metres.
    #[serde(default)]
    pub mean_height: f64,
    /// Of many: the highest centre, metres.
    #[serde(default)]
    pub top: f64,
    /// Of many: the farthest centre along x or y, metres.
    #[serde(default)]
    pub spread: f64,
    /// Of many bodies of one mass: the sum of squares of their speeds, halved, m^2/s^2 times that mass.
    #[serde(default)]
    pub kinetic: f64,
}

impl Figures {
    /// Of these views of a scene, whose bodies are of this mass where they are many.
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
            // The first view also tells of what was before it.
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

    /// Where a root is at the window's end, metres.
    pub fn end(&self, root: usize) -> DVec3 {
        place(&self.roots[1][root])
    }

    /// How far a root has come in the window, metres.
    pub fn way(&self, root: usize) -> DVec3 {
        self.end(root) - place(&self.roots[0][root])
    }

    /// The z axis of a root at the window's end, world.
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
