//! Creation and deletion of sensors, and their samples in steps.

use simd_model::RobotModel;
use simd_model::sensor::{self, MAX_SENSORS_PER_ROBOT, SensorKind};

use crate::simulation::command::{CreateSensor, Spawn};
use crate::simulation::entity::Entity;
use crate::simulation::error::Error;
use crate::simulation::sensors::{DueSample, SensorCount, SensorDefinition, SensorState, WorldSensors};
use crate::simulation::world_state::EntityState;
use crate::simulation::{EventKind, Reply, Simulation, check};

impl Simulation {
    /// Moves the samples of the last step to a list, once. Their measurements follow from the state that is
    /// published after that step: see [`PublishedState::readings`](crate::PublishedState::readings). The next
    /// step discards those that were not moved.
    pub fn take_due_samples(&mut self, samples: &mut Vec<DueSample>) {
        samples.append(&mut self.sensors.due);
    }

    /// Takes the samples that are due at the end of a step.
    pub(super) fn take_samples(&mut self) {
        let Self { sensors: WorldSensors { robots, due, .. }, entities, now, settings, .. } = self;
        due.clear();
        for &robot in &*robots {
            if !entities[robot].is_active() {
                continue;
            }
            entities[robot].move_encoders();
            let EntityState { name, sensors, .. } = &mut entities[robot].state;
            for sensor in sensors {
                if let Some(sample) = sensor.take((robot, name.as_str()), *now, settings) {
                    due.push(sample);
                }
            }
        }
    }

    pub(in crate::simulation) fn create_sensor(&mut self, create: &CreateSensor) -> Result<Reply, Error> {
        let CreateSensor { robot, name, link, joint, pose, rate, kind, noise, seed } = create;
        let robot_index = self.robot_index(robot)?;
        sensor::check(kind, *rate, noise).map_err(|bad| check::refuse(bad.field, bad.value, bad.expected))?;
        self.check_more_sensors([kind])?;
        let entity = &self.entities[robot_index];
        if entity.state.sensors.len() >= MAX_SENSORS_PER_ROBOT {
            let (what, limit) =
                (format!("the number of sensors of robot {robot:?}"), MAX_SENSORS_PER_ROBOT as u64);
            return Err(Error::LimitExceeded { what, value: limit + 1, limit });
        }
        let name = entity.free_sensor_name(name, kind)?;
        let (on, link) = entity.sensor_mount(kind, link, joint)?;
        check::pose("pose", pose)?;
        for (axis, value) in ["x", "y", "z"].into_iter().zip(pose.translation.to_array()) {
            check::moderate(&format!("pose.position.{axis}"), value)?;
        }
        let definition = SensorDefinition {
            name: name.clone(),
            on,
            link,
            pose: *pose,
            rate: *rate,
            kind: *kind,
            noise: noise.clone(),
            seed: seed.unwrap_or_default(),
            is_described: false,
        };
        let now = self.now.sim_time;
        self.entities[robot_index].add_sensor(definition, now);
        self.sensors_changed();
        self.happened(EventKind::SensorCreated { robot: robot.clone(), sensor: name.clone() });
        Ok(Reply::SensorCreated { name })
    }

    pub(in crate::simulation) fn delete_sensor(&mut self, robot: &str, name: &str) -> Result<Reply, Error> {
        let entity = self.entity_mut(robot)?;
        let sensors = &mut entity.state.sensors;
        let index = sensors.iter().position(|sensor| sensor.definition.name == name);
        let index = index.ok_or_else(|| Error::SensorNotFound {
            robot: robot.to_owned(),
            sensor: name.to_owned(),
            known: sensors.iter().map(|sensor| sensor.definition.name.clone()).collect(),
        })?;
        sensors.remove(index);
        self.sensors_changed();
        self.happened(EventKind::SensorDeleted { robot: robot.to_owned(), sensor: name.to_owned() });
        Ok(Reply::Done)
    }

    /// Refuses robots with too many sensors, before they are added.
    pub(super) fn check_described_sensors<'s>(
        &self,
        spawns: impl IntoIterator<Item = &'s Spawn>,
    ) -> Result<(), Error> {
        let sensors = spawns.into_iter().flat_map(|spawn| &spawn.model.setup.sensors);
        self.check_more_sensors(sensors.map(|sensor| &sensor.kind))
    }

    /// Refuses a new model of a robot with too many sensors; it keeps the sensors of clients.
    pub(super) fn check_reloaded_sensors(&self, robot: usize, model: &RobotModel) -> Result<(), Error> {
        let stay = self.entities.iter().enumerate().flat_map(|(index, entity)| {
            let sensors = entity.state.sensors.iter();
            sensors.filter(move |sensor| index != robot || !sensor.definition.is_described)
        });
        SensorCount::of(stay.map(|sensor| &sensor.definition.kind))
            .check(SensorCount::of(model.setup.sensors.iter().map(|sensor| &sensor.kind)))
    }

    /// Refuses additional sensors if they would be too many.
    fn check_more_sensors<'k>(&self, kinds: impl IntoIterator<Item = &'k SensorKind>) -> Result<(), Error> {
        let there = self.sensors.published.iter().map(|sensor| &sensor.definition.kind);
        SensorCount::of(there).check(SensorCount::of(kinds))
    }

    /// Adds sensors to the successor of the robot at this index. They are those of its description, and those
    /// that clients had added to the old one, if it has their links and joints. Returns the names of those
    /// that are dropped.
    pub(super) fn carry_sensors(&self, robot: usize, new: &mut Entity) -> Vec<String> {
        let old = &self.entities[robot];
        new.add_described_sensors(self.now.sim_time);
        let mut gone = Vec::new();
        for sensor in old.state.sensors.iter().filter(|sensor| !sensor.definition.is_described) {
            let is_free = new.sensor_index(&sensor.definition.name).is_none();
            let has_room = new.state.sensors.len() < MAX_SENSORS_PER_ROBOT;
            match new.carried_definition(&old.model, &sensor.definition).filter(|_| is_free && has_room) {
                Some(definition) => {
                    new.state.sensors.push(SensorState { definition: definition.into(), ..sensor.clone() });
                }
                None => gone.push(sensor.definition.name.clone()),
            }
        }
        gone
    }

    /// Emits events for deleted sensors.
    pub(super) fn sensors_went(&mut self, robot: &str, names: Vec<String>) {
        for sensor in names {
            self.happened(EventKind::SensorDeleted { robot: robot.to_owned(), sensor });
        }
    }

    /// Updates published sensors; call it when sensors or their robots were added, deleted or changed.
    pub(super) fn sensors_changed(&mut self) {
        let sensors = self.entities.iter_mut().map(|entity| &mut entity.state.sensors);
        self.sensors.changed(sensors.enumerate());
    }

    /// Restarts the counts of all samples at this moment.
    pub(super) fn begin_sensors_anew(&mut self) {
        let now = self.now.sim_time;
        for &robot in &self.sensors.robots {
            self.entities[robot].for_each_sensor(|sensor, origin| sensor.begin_anew(now, origin));
        }
    }
}
