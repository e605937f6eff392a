//! Names of robots in ROS 2: the prefix of each robot's topics and frames. It is chosen when the robot is first seen,
//! and stays while the robot exists, whatever other robots come and go.

use std::collections::{BTreeMap, BTreeSet};

use simd_ros2::wire::word;

use crate::config::{PlainNames, Ros2};

/// A robot as it is named.
#[derive(Clone, Copy, Debug)]
pub(super) struct Named<'n> {
    pub(super) robot: &'n str,
    /// Whether it has joints, and so topics.
    pub(super) is_jointed: bool,
}

/// Prefixes of the present robots.
#[derive(Clone, Debug)]
pub(super) struct Names {
    rule: PlainNames,
    given: BTreeMap<String, Given>,
    /// The last robot with plain names. A robot of this name gets them again.
    plain: Option<String>,
}

#[derive(Clone, Debug)]
struct Given {
    /// Empty, or `arm/`.
    prefix: String,
    is_jointed: bool,
}

impl Names {
    pub(super) fn new(settings: &Ros2) -> Self {
        Self { rule: settings.plain_names.clone(), given: BTreeMap::new(), plain: None }
    }

    /// Forgets robots that are gone, and names new ones, in the order in which they were spawned.
    pub(super) fn follow(&mut self, robots: &[Named<'_>]) {
        let present: BTreeSet<&str> = robots.iter().map(|named| named.robot).collect();
        self.given.retain(|robot, _| present.contains(robot.as_str()));
        for &Named { robot, is_jointed } in robots {
            if self.given.contains_key(robot) {
                continue;
            }
            let prefix = if is_jointed && self.is_plain(robot) {
                self.plain = Some(robot.to_owned());
                String::new()
            } else {
                self.free_prefix(robot)
            };
            self.given.insert(robot.to_owned(), Given { prefix, is_jointed });
        }
    }

    /// Returns the prefix of a robot's topics and frames: empty, or `arm/`.
    pub(super) fn prefix(&self, robot: &str) -> String {
        self.given.get(robot).map(|given| given.prefix.clone()).unwrap_or_default()
    }

    /// Returns whether a new robot gets plain names.
    fn is_plain(&self, robot: &str) -> bool {
        if self.given.values().any(|given| given.prefix.is_empty()) {
            return false;
        }
        match &self.rule {
            PlainNames::None => false,
            PlainNames::Robot(chosen) => chosen == robot,
            PlainNames::First => {
                let is_first = !self.given.values().any(|given| given.is_jointed);
                is_first || self.plain.as_deref() == Some(robot)
            }
        }
    }

    /// Returns the robot's name as a word of ROS with a slash, and with a number if another robot has it.
    fn free_prefix(&self, robot: &str) -> String {
        let own = word(robot);
        let is_taken = |prefix: &String| self.given.values().any(|given| given.prefix == *prefix);
        let mut prefix = format!("{own}/");
        let mut number = 2;
        while is_taken(&prefix) {
            prefix = format!("{own}_{number}/");
            number += 1;
        }
        prefix
    }
}
