//! Sensors of a world: their published form, and the samples of the last step.

use std::sync::Arc;

use super::definition::WorldSensor;
use super::state::{DueSample, SensorState};

/// Sensor data of a world without the states of sensors, which belong to their robots.
#[derive(Debug, Default)]
pub(in crate::simulation) struct WorldSensors {
    /// Sensors by robot, in the order of their creation. Shared with what is published.
    pub(in crate::simulation) published: Arc<Vec<WorldSensor>>,
    /// Indices of the robots with sensors, in order.
    pub(in crate::simulation) robots: Vec<usize>,
    /// Samples of the last step. Measurements read the state that is published after it, and no later one.
    pub(in crate::simulation) due: Vec<DueSample>,
    last_id: u64,
}

impl WorldSensors {
    /// Updates the lists. Call it with all sensors, by the index of their robot, when sensors may have been
    /// added or deleted or have changed their index.
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
