//! Sensors of a robot: their mounts, their names, and the origin of their odometry.

use std::sync::Arc;

use glamx::DPose3;
use simd_model::RobotModel;
use simd_model::sensor::{self, MAX_SENSOR_NAME, MAX_SENSORS_PER_ROBOT, Sensor, SensorKind, SensorMount};

use super::Entity;
use crate::dynamics::Articulation;
use crate::simulation::check;
use crate::simulation::error::Error;
use crate::simulation::sensors::{SensorDefinition, SensorOrigin, SensorState};

impl Entity {
    /// Adds the sensors of its description to a new robot.
    pub(in crate::simulation) fn add_described_sensors(&mut self, now: f64) {
        let model = Arc::clone(&self.model);
        for sensor in model.setup.sensors.iter().take(MAX_SENSORS_PER_ROBOT) {
            // Its numbers were checked when it was read: only models from elsewhere can be refused.
            if let Some(definition) = self.described_definition(sensor) {
                self.add_sensor(definition, now);
            }
        }
    }

    /// Resets the random walks, odometry and backlash of its sensors at its present pose.
    pub(in crate::simulation) fn put_sensors_back(&mut self) {
        self.for_each_sensor(SensorState::put_back);
    }

    /// Adds a sensor that starts at this sim time.
    pub(in crate::simulation) fn add_sensor(&mut self, definition: SensorDefinition, now: f64) {
        let origin = self.sensor_origin(&definition);
        self.state.sensors.push(SensorState::new(definition, now, origin));
    }

    /// Calls `change` with each sensor and its present origin.
    pub(in crate::simulation) fn for_each_sensor(
        &mut self,
        mut change: impl FnMut(&mut SensorState, SensorOrigin),
    ) {
        let origins: Vec<SensorOrigin> =
            self.state.sensors.iter().map(|sensor| self.sensor_origin(&sensor.definition)).collect();
        for (sensor, origin) in self.state.sensors.iter_mut().zip(origins) {
            change(sensor, origin);
        }
    }

    /// Updates encoders with backlash from their joints after a step.
    pub(in crate::simulation) fn move_encoders(&mut self) {
        let Self { body, state, .. } = self;
        for sensor in &mut state.sensors {
            let position = sensor.followed_joint().and_then(|joint| joint_position(body, joint));
            if let Some(position) = position {
                sensor.follow_joint(position);
            }
        }
    }

    fn sensor_origin(&self, definition: &SensorDefinition) -> SensorOrigin {
        let joint = match (definition.kind, definition.on) {
            (SensorKind::Encoder { .. }, SensorMount::Joint(joint)) => joint_position(&self.body, joint),
            _ => None,
        };
        SensorOrigin { start: self.sensor_start(definition), joint: joint.unwrap_or_default() }
    }

    /// Returns `world_from_sensor` at which its odometry begins; identity for other sensors.
    fn sensor_start(&self, definition: &SensorDefinition) -> DPose3 {
        if !matches!(definition.kind, SensorKind::Odometry) {
            return DPose3::IDENTITY;
        }
        let positions = &self.body.positions()[self.body.tree().root_positions()..];
        let poses = self.body.tree().link_poses(self.body.root_pose(), positions);
        poses.get(definition.link).map_or(DPose3::IDENTITY, |link| *link * definition.pose)
    }

    /// Returns the index of a sensor by name.
    pub(in crate::simulation) fn sensor_index(&self, name: &str) -> Option<usize> {
        self.state.sensors.iter().position(|sensor| sensor.definition.name == name)
    }

    /// Returns the name, or for an empty one the type's name with the first free number.
    pub(in crate::simulation) fn free_sensor_name(
        &self,
        name: &str,
        kind: &SensorKind,
    ) -> Result<String, Error> {
        if name.is_empty() {
            let mut number = 1u64;
            loop {
                let candidate = format!("{}_{number}", kind.word());
                if self.sensor_index(&candidate).is_none() {
                    return Ok(candidate);
                }
                number += 1;
            }
        }
        if !simd_model::is_wire_name(name) || name.len() > MAX_SENSOR_NAME {
            let expected = format!(
                "it must be letters and digits of any script, `_` and `-`, at least one and at most {MAX_SENSOR_NAME} bytes"
            );
            return Err(check::refuse("name", format!("{name:?}"), expected));
        }
        if self.sensor_index(name).is_some() {
            return Err(Error::SensorExists { robot: self.state.name.clone(), sensor: name.to_owned() });
        }
        Ok(name.to_owned())
    }

    /// Returns the mount of a sensor of this type and its link, for the requested ones.
    pub(in crate::simulation) fn sensor_mount(
        &self,
        kind: &SensorKind,
        link: &str,
        joint: &str,
    ) -> Result<(SensorMount, usize), Error> {
        if !kind.is_of_joint() {
            if !joint.is_empty() {
                let expected = format!("a sensor of the kind {} is on a link: name that", kind.word());
                return Err(check::refuse("joint", format!("{joint:?}"), expected));
            }
            let link = if link.is_empty() { 0 } else { self.link(link)? };
            return Ok((SensorMount::Link(link), link));
        }
        if !link.is_empty() {
            let expected = format!("a sensor of the kind {} is on a joint: name that", kind.word());
            return Err(check::refuse("link", format!("{link:?}"), expected));
        }
        if joint.is_empty() {
            let expected = format!("a sensor of the kind {} is on a joint: name that", kind.word());
            return Err(check::refuse("joint", "empty", expected));
        }
        let index = self.joint(joint)?;
        let on = SensorMount::Joint(index);
        if !self.can_bear(kind, on) {
            let expected = "an encoder is of a joint that turns or slides about one axis";
            return Err(check::refuse("joint", format!("{joint:?}"), expected));
        }
        // The child of each joint is the link after it.
        Ok((on, index + 1))
    }

    /// Returns whether a sensor of this type can have this mount.
    fn can_bear(&self, kind: &SensorKind, on: SensorMount) -> bool {
        match on {
            SensorMount::Link(link) => !kind.is_of_joint() && link < self.model.links.len(),
            SensorMount::Joint(joint) if joint >= self.model.joints.len() => false,
            SensorMount::Joint(joint) if matches!(kind, SensorKind::Encoder { .. }) => {
                self.body.tree().has_one_axis(joint)
            }
            SensorMount::Joint(_) => kind.is_of_joint(),
        }
    }

    fn described_definition(&self, sensor: &Sensor) -> Option<SensorDefinition> {
        let Sensor { name, on, pose, rate, kind, noise, seed } = sensor;
        let can_be = self.can_bear(kind, *on)
            && simd_model::is_wire_name(name)
            && self.sensor_index(name).is_none()
            && check::pose("pose", pose).is_ok()
            && sensor::check(kind, *rate, noise).is_ok();
        can_be.then(|| SensorDefinition {
            name: name.clone(),
            on: *on,
            link: link_of(*on),
            pose: *pose,
            rate: *rate,
            kind: *kind,
            noise: noise.clone(),
            seed: *seed,
            is_described: true,
        })
    }

    /// Returns the definition of another model's sensor, if this one has its link or joint by name.
    pub(in crate::simulation) fn carried_definition(
        &self,
        old: &RobotModel,
        definition: &SensorDefinition,
    ) -> Option<SensorDefinition> {
        let on = match definition.on {
            SensorMount::Link(link) => SensorMount::Link(self.link(&old.links.get(link)?.name).ok()?),
            SensorMount::Joint(joint) => SensorMount::Joint(self.joint(&old.joints.get(joint)?.name).ok()?),
        };
        self.can_bear(&definition.kind, on).then(|| SensorDefinition {
            on,
            link: link_of(on),
            ..definition.clone()
        })
    }

    /// Checks sensors from elsewhere against this robot, in a world at this sim time. The error is a fragment
    /// of a sentence.
    pub(in crate::simulation) fn check_sensors(&self, now: f64) -> Result<(), String> {
        let count = self.state.sensors.len();
        if count > MAX_SENSORS_PER_ROBOT {
            return Err(format!("{count} sensors, of {MAX_SENSORS_PER_ROBOT}"));
        }
        for (index, sensor) in self.state.sensors.iter().enumerate() {
            let SensorDefinition { name, on, link, pose, rate, kind, noise, seed: _, is_described: _ } =
                &*sensor.definition;
            if !simd_model::is_wire_name(name)
                || name.len() > MAX_SENSOR_NAME
                || self.sensor_index(name) != Some(index)
            {
                return Err(format!(
                    "a sensor with the name {name:?}, which is not valid or that of another"
                ));
            }
            if !self.can_bear(kind, *on) || *link != link_of(*on) {
                return Err(format!("the sensor {name:?} on a link or joint that cannot have it"));
            }
            let of_sensor = |what: String| format!("the sensor {name:?} with {what}");
            crate::valid::pose("a pose", pose).map_err(of_sensor)?;
            sensor::check(kind, *rate, noise)
                .map_err(|bad| of_sensor(format!("{} of {}; {}", bad.field, bad.value, bad.expected)))?;
            sensor.check(now).map_err(of_sensor)?;
        }
        Ok(())
    }
}

/// Returns the position of a joint of one axis.
fn joint_position(body: &Articulation, joint: usize) -> Option<f64> {
    let tree = body.tree();
    let moved = tree.bodies.get(tree.joints.get(joint)?.start)?;
    body.positions().get(moved.position).copied()
}

/// Returns the link; for a joint its child, which is the link after it.
fn link_of(on: SensorMount) -> usize {
    match on {
        SensorMount::Link(link) => link,
        SensorMount::Joint(joint) => joint + 1,
    }
}
