//! Keys of robots, which follow the robots of the world.

use std::collections::BTreeMap;
use std::sync::{Arc, Weak};

use simd_core::simulation::published_state::WorldLayout;

/// Publishers of robots, by name.
#[derive(Debug)]
pub(super) struct OfRobots<P> {
    by_name: BTreeMap<String, OfRobot<P>>,
    /// World that the publishers match; `None` if some of its robots may lack theirs. Weak, since a task that
    /// waits for a subscriber would keep deleted robots; no other world gets its address.
    seen: Weak<WorldLayout>,
}

#[derive(Debug)]
struct OfRobot<P> {
    /// Index in [`WorldLayout::entities`].
    index: usize,
    publisher: P,
}

impl<P> Default for OfRobots<P> {
    fn default() -> Self {
        Self { by_name: BTreeMap::new(), seen: Weak::new() }
    }
}

impl<P> OfRobots<P> {
    /// Drops publishers of robots that are not in a world. Returns the robots of the world without one, with
    /// their indices. It examines no robot if the world is unchanged.
    pub(super) fn follow(&mut self, world: &Arc<WorldLayout>) -> Vec<(usize, String)> {
        if std::ptr::eq(self.seen.as_ptr(), Arc::as_ptr(world)) {
            return Vec::new();
        }
        let mut before = std::mem::take(&mut self.by_name);
        let mut lacking = Vec::new();
        for (index, robot) in world.entities.iter().enumerate() {
            match before.remove_entry(&robot.name) {
                Some((name, of)) => drop(self.by_name.insert(name, OfRobot { index, ..of })),
                None => lacking.push((index, robot.name.clone())),
            }
        }
        // A failed publisher is requested again.
        self.seen = if lacking.is_empty() { Arc::downgrade(world) } else { Weak::new() };
        lacking
    }

    /// Adds the publisher that a robot lacked.
    pub(super) fn insert(&mut self, (index, robot): (usize, String), publisher: P) {
        self.by_name.insert(robot, OfRobot { index, publisher });
    }

    /// Returns all publishers by name, with the indices of their robots.
    pub(super) fn iter(&self) -> impl Iterator<Item = (usize, &P)> {
        self.by_name.values().map(|of| (of.index, &of.publisher))
    }
}

#[cfg(test)]
mod tests {
    use simd_core::{Command, Simulation};

    use super::*;
    use simd_api::convert::test_world::{publish, simulation, spawn};

    fn world(simulation: &Simulation) -> Arc<WorldLayout> {
        publish(simulation, 1).state.world
    }

    /// Gives each robot without one a distinct name, and returns those robots.
    fn follow(robots: &mut OfRobots<String>, world: &Arc<WorldLayout>) -> Vec<String> {
        let lacking = robots.follow(world);
        for robot in lacking.clone() {
            let publisher = format!("of {}", robot.1);
            robots.insert(robot, publisher);
        }
        lacking.into_iter().map(|(_, name)| name).collect()
    }

    fn all(robots: &OfRobots<String>) -> Vec<(usize, &str)> {
        robots.iter().map(|(index, publisher)| (index, publisher.as_str())).collect()
    }

    #[test]
    fn a_robot_that_comes_gets_one_and_one_that_goes_loses_it() {
        let mut simulation = simulation();
        let mut robots = OfRobots::default();
        assert_eq!(follow(&mut robots, &world(&simulation)), ["left", "right"]);
        assert_eq!(all(&robots), [(0, "of left"), (1, "of right")]);
        simulation.apply(&Command::Delete { robot: "left".into() }).unwrap();
        simulation.apply(&spawn("middle", &[])).unwrap();
        assert_eq!(follow(&mut robots, &world(&simulation)), ["middle"]);
        assert_eq!(all(&robots), [(1, "of middle"), (0, "of right")], "by name, with the new indices");
    }

    #[test]
    fn a_world_that_did_not_change_is_not_looked_through() {
        let world = world(&simulation());
        let mut robots = OfRobots::default();
        follow(&mut robots, &world);
        assert!(follow(&mut robots, &world).is_empty(), "none lacks anything");
        // A look would drop this one, and find that the others lack theirs.
        robots.by_name.clear();
        robots.insert((7, "gone".to_owned()), "of gone".to_owned());
        assert!(follow(&mut robots, &world).is_empty());
        assert_eq!(all(&robots), [(7, "of gone")]);
    }

    #[test]
    fn publishers_that_fail_are_requested_again() {
        let world = world(&simulation());
        let mut robots = OfRobots::default();
        let [left, right] = [(0, "left".to_owned()), (1, "right".to_owned())];
        assert_eq!(robots.follow(&world), [left.clone(), right.clone()]);
        robots.insert(right, "of right".to_owned());
        for _ in 0..3 {
            assert_eq!(robots.follow(&world), std::slice::from_ref(&left));
            assert_eq!(all(&robots), [(1, "of right")]);
        }
    }

    #[test]
    fn robots_that_are_gone_are_not_kept() {
        let world = world(&simulation());
        let mut robots = OfRobots::default();
        follow(&mut robots, &world);
        follow(&mut robots, &world);
        let gone = Arc::downgrade(&world);
        drop(world);
        assert!(gone.upgrade().is_none());
    }
}
