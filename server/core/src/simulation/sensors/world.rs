//! The sensors of a world: what is published of them, and the samples of the last step.

use std::sync::Arc;

use super::definition::WorldSensor;
use super::state::{DueSample, SensorState};

/// What a world has of its sensors beside their state, which is their robots'.
#[derive(Debug, Default)]
pub(in crate::simulation) struct WorldSensors {
    /// By robot, in the order in which they were made. Shared with what is published.
    pub(in crate::simulation) published: Arc<Vec<WorldSensor>>,
    /// Indices of the robots that have some, in order.
    pub(in crate::simulation) robots: Vec<usize>,
    /// Of the last step: what measures reads the state that is published after it, and no later one.
    pub(in crate::simulation) due: Vec<DueSample>,
    last_id: u64,
}

impl WorldSensors {
    /// To be called with all sensors, by the index of their robot, when some of them may have come, gone or changed their index.
    pub(in crate::simulation) fn changed<'s>(
        &mut self,
        all: impl Iterator<Item = (usize, &'s mut Vec<SensorState>)>,
    ) {
        let mut published = Vec::new();
        self.robots.clear();
        for (robot, sensors) in all {
            if !sensors.is_empty() {
                self.robots.push(robot);
            }
            for sensor in sensors {
                if sensor.id == 0 {
                    self.last_id += 1;
                    sensor.id = self.last_id;
                }
                let definition = Arc::clone(&sensor.definition);
                published.push(WorldSensor { id: sensor.id, robot, definition });
            }
        }
        let is_same = |(a, b): (&WorldSensor, &WorldSensor)| {
            (a.id, a.robot) == (b.id, b.robot) && Arc::ptr_eq(&a.definition, &b.definition)
        };
        let mut pairs = published.iter().zip(&*self.published);
        if published.len() != self.published.len() || !pairs.all(is_same) {
            self.published = Arc::new(published);
        }
    }
}
