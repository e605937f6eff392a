//! Changes for another run of a recording: `time_step=0.0005`, `arm/elbow.stiffness=200`.

use glamx::DVec3;
use simd_core::simulation::command::{JointProperties, PhysicsChange, Target};
use simd_core::simulation::published_state::PublishedState;
use simd_core::{BulletContacts, Command, Integrator, SurfaceCombination};

/// Changes, in the order in which they were given.
#[derive(Clone, Debug, Default)]
pub struct Changes {
    physics: PhysicsChange,
    joints: Vec<JointChange>,
    texts: Vec<String>,
}

/// Changes of one joint.
#[derive(Clone, Debug)]
struct JointChange {
    robot: String,
    joint: String,
    stiffness: Option<f64>,
    gain_damping: Option<f64>,
    properties: JointProperties,
    is_found: bool,
}

/// Properties of a joint that can be changed.
const PROPERTIES: [&str; 7] =
    ["stiffness", "gain_damping", "damping", "friction", "armature", "gravity_compensation", "profile"];

impl Changes {
    /// Adds a change, as `KEY=VALUE`.
    ///
    /// # Errors
    /// Returns a sentence if the key does not exist, or cannot have this value.
    pub fn add(&mut self, text: &str) -> Result<(), String> {
        let (key, value) = text.rsplit_once('=').ok_or_else(|| format!("{text:?} is not KEY=VALUE"))?;
        let number = || {
            let number = value.parse().ok().filter(|number: &f64| number.is_finite());
            number.ok_or_else(|| format!("{key} is {value:?}; it must be a number"))
        };
        match key {
            "time_step" => self.physics.time_step = Some(number()?),
            "substeps" => {
                let substeps =
                    value.parse().map_err(|_| format!("{key} is {value:?}; it must be a whole number"));
                self.physics.substeps = Some(substeps?);
            }
            "gravity" => self.physics.gravity = Some(vector(value)?),
            "integrator" => {
                self.physics.integrator = Some(match value {
                    "leapfrog" => Integrator::Leapfrog,
                    "euler" => Integrator::Euler,
                    "bullet" => Integrator::Bullet(BulletContacts::default()),
                    _ => return Err(format!("{key} is {value:?}; it must be leapfrog, euler or bullet")),
                });
            }
            "surface_combination" => {
                self.physics.surface_combination = Some(match value {
                    "min" => SurfaceCombination::Min,
                    "multiply" => SurfaceCombination::Multiply,
                    "max" => SurfaceCombination::Max,
                    _ => return Err(format!("{key} is {value:?}; it must be min, multiply or max")),
                });
            }
            "sleeping" => {
                let sleeping =
                    value.parse().map_err(|_| format!("{key} is {value:?}; it must be true or false"));
                self.physics.sleeping = Some(sleeping?);
            }
            _ => self.add_of_joint(key, value, number)?,
        }
        self.texts.push(text.to_owned());
        Ok(())
    }

    fn add_of_joint(
        &mut self,
        key: &str,
        value: &str,
        number: impl Fn() -> Result<f64, String>,
    ) -> Result<(), String> {
        let unknown = || {
            format!(
                "{key:?} cannot be set; it must be time_step, substeps, gravity, integrator, surface_combination, sleeping, or \
                 ROBOT/JOINT. and one of {}",
                PROPERTIES.join(", ")
            )
        };
        let (path, property) = key.rsplit_once('.').ok_or_else(unknown)?;
        let (robot, joint) = path.split_once('/').ok_or_else(unknown)?;
        let known = self.joints.iter().position(|change| change.robot == robot && change.joint == joint);
        let index = known.unwrap_or_else(|| {
            self.joints.push(JointChange {
                robot: robot.to_owned(),
                joint: joint.to_owned(),
                stiffness: None,
                gain_damping: None,
                properties: JointProperties { joint: joint.to_owned(), ..JointProperties::default() },
                is_found: false,
            });
            self.joints.len() - 1
        });
        let switch = || match value {
            "on" => Ok(true),
            "off" => Ok(false),
            _ => Err(format!("{key} is {value:?}; it must be on or off")),
        };
        let JointChange { stiffness, gain_damping, properties, .. } = &mut self.joints[index];
        match property {
            "stiffness" => *stiffness = Some(number()?),
            "gain_damping" => *gain_damping = Some(number()?),
            "damping" => properties.damping = Some(number()?),
            "friction" => properties.friction = Some(number()?),
            "armature" => properties.armature = Some(number()?),
            "gravity_compensation" => properties.gravity_compensation = Some(switch()?),
            "profile" => properties.profile = Some(switch()?),
            _ => return Err(unknown()),
        }
        Ok(())
    }

    /// Returns whether there are no changes.
    pub fn is_empty(&self) -> bool {
        self.texts.is_empty()
    }

    /// Returns the changes as they were given.
    pub(super) fn texts(&self) -> &[String] {
        &self.texts
    }

    /// Returns the commands that apply the changes to a recorded world.
    pub(super) fn commands(&mut self, state: &PublishedState) -> Vec<Command> {
        let mut commands = Vec::new();
        if self.physics != PhysicsChange::default() {
            commands.push(Command::SetPhysics(self.physics));
        }
        for change in &mut self.joints {
            let Some((index, entity)) = state.entity(&change.robot) else { continue };
            let Some(joint) = entity.model.joints.iter().position(|joint| joint.name == change.joint) else {
                continue;
            };
            let Some(settings) = state.settings.get(index).and_then(|robot| robot.joints.get(joint)) else {
                continue;
            };
            change.is_found = true;
            // Values that are already set are left alone: a command interrupts the integrator's history.
            let given = &change.properties;
            let other = |given: Option<f64>, present: f64| given.filter(|given| *given != present);
            let (stiffness, damping) = settings.default_gains;
            let gains = (change.stiffness.unwrap_or(stiffness), change.gain_damping.unwrap_or(damping));
            let (compensated, profile) = (given.gravity_compensation, given.profile);
            let same = JointProperties { joint: given.joint.clone(), ..JointProperties::default() };
            let properties = JointProperties {
                damping: other(given.damping, settings.damping),
                friction: other(given.friction, settings.friction),
                armature: other(given.armature, settings.armature),
                default_gains: Some(gains).filter(|gains| *gains != settings.default_gains),
                gravity_compensation: compensated.filter(|given| *given != settings.gravity_compensation),
                profile: profile.filter(|given| *given != settings.profile),
                ..same.clone()
            };
            if properties == same {
                continue;
            }
            commands
                .push(Command::SetJointProperties { robot: change.robot.clone(), joints: vec![properties] });
        }
        commands
    }

    /// Returns a sentence about joints that no robot had.
    pub(super) fn not_found(&self) -> Option<String> {
        let lost = self.joints.iter().filter(|change| !change.is_found);
        let names: Vec<String> = lost.map(|change| format!("{}/{}", change.robot, change.joint)).collect();
        (!names.is_empty()).then(|| format!("no robot of the recording has the joint {}", names.join(", ")))
    }

    /// Applies the changes to a recorded command.
    pub(super) fn keep_in(&self, command: &mut Command) {
        match command {
            Command::SetPhysics(change) => {
                let PhysicsChange { gravity, time_step, substeps, integrator, surface_combination, sleeping } =
                    self.physics;
                change.gravity = gravity.or(change.gravity);
                change.time_step = time_step.or(change.time_step);
                change.substeps = substeps.or(change.substeps);
                change.integrator = integrator.or(change.integrator);
                change.surface_combination = surface_combination.or(change.surface_combination);
                change.sleeping = sleeping.or(change.sleeping);
            }
            Command::SetTargets(targets) => {
                for robot in &mut targets.robots {
                    for target in &mut robot.joints {
                        let known = self
                            .joints
                            .iter()
                            .find(|change| change.robot == robot.robot && change.joint == target.joint);
                        if let Some(change) = known {
                            change.keep_in(&mut target.target);
                        }
                    }
                }
            }
            _ => {}
        }
    }
}

impl JointChange {
    fn keep_in(&self, target: &mut Target) {
        if let Target::Position { stiffness, damping, .. } | Target::Orientation { stiffness, damping, .. } =
            target
        {
            *stiffness = self.stiffness.or(*stiffness);
            *damping = self.gain_damping.or(*damping);
        }
    }
}

/// Parses `x,y,z`.
fn vector(text: &str) -> Result<DVec3, String> {
    let numbers: Vec<f64> = text
        .split(',')
        .filter_map(|number| number.trim().parse().ok())
        .filter(|number: &f64| number.is_finite())
        .collect();
    match numbers[..] {
        [x, y, z] if text.matches(',').count() == 2 => Ok(DVec3::new(x, y, z)),
        _ => Err(format!("gravity is {text:?}; it must be three numbers x,y,z")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_that_cannot_be_names_what_can() {
        for (text, part) in [
            ("time_step", "is not KEY=VALUE"),
            ("time_step=fast", "must be a number"),
            ("time_step=inf", "must be a number"),
            ("substeps=1.5", "must be a whole number"),
            ("gravity=0,0", "three numbers"),
            ("integrator=rk4", "leapfrog, euler or bullet"),
            ("surface_combination=average", "min, multiply or max"),
            ("elbow.stiffness=1", "ROBOT/JOINT."),
            ("arm/elbow.color=1", "gravity_compensation"),
            ("arm/elbow.gravity_compensation=1", "on or off"),
        ] {
            let error = Changes::default().add(text).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
        let mut changes = Changes::default();
        changes.add("arm/left.elbow.stiffness=12").unwrap();
        changes.add("arm/left.elbow.damping=0.1").unwrap();
        assert_eq!((changes.joints.len(), changes.joints[0].joint.as_str()), (1, "left.elbow"));
    }
}
