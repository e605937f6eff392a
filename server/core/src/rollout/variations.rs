//! Variations between copies: positions of joints, masses, friction, gains, applied wrenches.

use std::sync::Arc;

use glamx::DVec3;
use simd_model::robot::Material;

use super::draw::{normal, uniform};
use super::names::{Axis, axes_of, link, links, moderate, refuse, robot, sized};
use super::request::{Named, Values, Variation, Varied};
use super::starts::reset;
use crate::dynamics::Tree;
use crate::simulation::command::{
    JointProperties, LinkProperties, LinkWrench, MAX_WRENCH_DURATION, WrenchDuration,
};
use crate::simulation::{Command, Error, PublishedState, Simulation};

/// Smallest factor of a mass: finite forces cannot move a robot without mass.
const LEAST_MASS: f64 = 0.01;

/// A variation with resolved names.
#[derive(Debug)]
pub(super) struct VariationPlan {
    /// Index in the request.
    index: u64,
    seed: u64,
    of: VariedPlan,
    /// Number of values of a copy.
    width: usize,
    values: Values,
}

#[derive(Debug)]
enum VariedPlan {
    JointStates {
        robot: usize,
        name: String,
        joints: Vec<String>,
        axes: Vec<Axis>,
        /// Whether positions vary; else velocities.
        of_positions: bool,
    },
    LinkMasses {
        robot: usize,
        links: Vec<usize>,
    },
    Joints {
        name: String,
        joints: Vec<(String, Setting)>,
        /// For gains, the robot's index, and the joints' indices in its model.
        gains: Option<(usize, Vec<usize>)>,
    },
    Surfaces {
        name: String,
        /// Names of the links, each with its friction.
        links: Vec<(String, f64)>,
    },
    Wrench {
        name: String,
        link: String,
        at: u64,
        seconds: f64,
    },
}

/// Setting of a joint, as in the state.
#[derive(Clone, Copy, Debug)]
enum Setting {
    Friction(f64),
    Damping(f64),
    Gains(f64, f64),
}

impl Setting {
    /// Returns the change that multiplies it by a factor.
    fn times(self, joint: &str, factor: f64) -> JointProperties {
        let joint = JointProperties { joint: joint.to_owned(), ..JointProperties::default() };
        match self {
            Self::Friction(value) => JointProperties { friction: Some(value * factor), ..joint },
            Self::Damping(value) => JointProperties { damping: Some(value * factor), ..joint },
            Self::Gains(stiffness, damping) => {
                JointProperties { default_gains: Some((stiffness * factor, damping * factor)), ..joint }
            }
        }
    }
}

impl VariationPlan {
    /// Resolves names and checks lengths, for copies of a world in this state; `index` is the variation's
    /// index in the request.
    pub(super) fn new(
        state: &PublishedState,
        time_step: f64,
        (index, seed): (usize, u64),
        variation: Variation,
        copies: usize,
    ) -> Result<Self, Error> {
        let Variation { of, values } = variation;
        let is_mass = matches!(of, Varied::LinkMasses(_));
        let is_factor =
            !matches!(of, Varied::JointPositions(_) | Varied::JointVelocities(_) | Varied::Wrench { .. });
        let (of, width) = VariedPlan::new(state, time_step, index, of)?;
        let field = |name: &str| format!("variations[{index}].{name}");
        let least = if is_mass { LEAST_MASS } else { 0.0 };
        let bounded = |name: &str, value: f64| match is_factor && value < least {
            true => Err(refuse(field(name), value, format!("a factor must be at least {least}"))),
            false => Ok(()),
        };
        match &values {
            Values::Given(given) => {
                sized(
                    &field("values"),
                    given.len(),
                    &[(width.saturating_mul(copies), "a row for each copy")],
                )?;
                moderate(&field("values"), given)?;
                given.iter().try_for_each(|value| bounded("values", *value))?;
            }
            Values::Uniform { low, high } => {
                moderate(&field("uniform"), &[*low, *high])?;
                bounded("uniform.low", *low)?;
                if low > high {
                    let expected = format!("it must be at most the other end, {high}");
                    return Err(refuse(field("uniform.low"), low, expected));
                }
            }
            Values::Normal { mean, deviation } => {
                moderate(&field("normal"), &[*mean, *deviation])?;
                bounded("normal.mean", *mean)?;
                if *deviation < 0.0 {
                    return Err(refuse(field("normal.deviation"), deviation, "it must be at least 0"));
                }
            }
        }
        Ok(Self { index: index as u64, seed, of, width, values })
    }

    /// Returns a value of a copy.
    fn number(&self, copy: usize, element: usize) -> f64 {
        let counter = [self.seed, copy as u64, self.index, element as u64];
        match &self.values {
            Values::Given(values) => values[copy * self.width + element],
            Values::Uniform { low, high } => uniform(counter, *low, *high),
            Values::Normal { mean, deviation } => normal(counter, *mean, *deviation),
        }
    }

    /// Returns a factor of a copy. Values of a normal distribution below the smallest factor are clamped to
    /// it.
    fn factor(&self, copy: usize, element: usize) -> f64 {
        let least = if matches!(self.of, VariedPlan::LinkMasses { .. }) { LEAST_MASS } else { 0.0 };
        self.number(copy, element).max(least)
    }

    /// Multiplies the factors of the masses of links, by robot and link.
    pub(super) fn masses(&self, copy: usize, factors: &mut [Vec<f64>], state: &PublishedState) {
        let VariedPlan::LinkMasses { robot, links } = &self.of else { return };
        let factors = &mut factors[*robot];
        factors.resize(state.world.entities[*robot].model.links.len(), 1.0);
        for (element, link) in links.iter().enumerate() {
            factors[*link] *= self.factor(copy, element);
        }
    }

    /// Applies the variation to a copy at its start. Multiplies the factors of the rollout's gains, by robot
    /// and joint.
    pub(super) fn apply(
        &self,
        world: &mut Simulation,
        copy: usize,
        gain_factors: &mut [Vec<f64>],
        state: &PublishedState,
    ) -> Result<(), Error> {
        let command = match &self.of {
            VariedPlan::JointStates { robot, name, joints, axes, of_positions } => {
                return reset(world, (*robot, name), (joints, axes), |index, (position, velocity)| {
                    let added = self.number(copy, index);
                    match of_positions {
                        true => (position + added, velocity),
                        false => (position, velocity + added),
                    }
                });
            }
            VariedPlan::LinkMasses { .. } | VariedPlan::Wrench { .. } => return Ok(()),
            VariedPlan::Joints { name, joints, gains } => {
                if let Some((robot, indices)) = gains {
                    let factors = &mut gain_factors[*robot];
                    factors.resize(state.world.entities[*robot].model.joints.len(), 1.0);
                    for (element, joint) in indices.iter().enumerate() {
                        factors[*joint] *= self.factor(copy, element);
                    }
                }
                let changed = joints.iter().enumerate();
                let changed = changed.map(|(i, (joint, setting))| setting.times(joint, self.factor(copy, i)));
                Command::SetJointProperties { robot: name.clone(), joints: changed.collect() }
            }
            VariedPlan::Surfaces { name, links } => {
                let changed = links.iter().enumerate().map(|(element, (link, friction))| LinkProperties {
                    link: link.clone(),
                    material: Material {
                        friction: Some(friction * self.factor(copy, element)),
                        ..Material::default()
                    },
                    ..LinkProperties::default()
                });
                let links = changed.collect();
                Command::SetLinkProperties { robot: name.clone(), links, stays_awake: None }
            }
        };
        world.apply(&command).map(drop)
    }

    /// Returns whether it applies a wrench to copies from this step on.
    pub(super) fn applies_wrench_at(&self, step: u64) -> bool {
        matches!(self.of, VariedPlan::Wrench { at, .. } if at == step)
    }

    /// Applies the wrench to a copy, in its first step.
    pub(super) fn apply_wrench(&self, world: &mut Simulation, copy: usize, step: u64) -> Result<(), Error> {
        let VariedPlan::Wrench { name, link, at, seconds } = &self.of else { return Ok(()) };
        if step != *at {
            return Ok(());
        }
        let command = Command::ApplyWrench(LinkWrench {
            robot: name.clone(),
            link: link.clone(),
            force: DVec3::from_array([0, 1, 2].map(|element| self.number(copy, element))),
            torque: DVec3::ZERO,
            in_link_axes: false,
            point: DVec3::ZERO,
            duration: WrenchDuration::For(*seconds),
        });
        world.apply(&command).map(drop)
    }
}

impl VariedPlan {
    /// Resolves the names. Also returns the number of values of a copy.
    fn new(state: &PublishedState, time_step: f64, index: usize, of: Varied) -> Result<(Self, usize), Error> {
        let layout = &*state.world;
        let field = |name: &str| format!("variations[{index}].{name}");
        let of_joints = |named: &Named, setting: &dyn Fn(usize, usize) -> Setting| {
            let (robot, axes) = axes_of(layout, named, field, "names")?;
            let model = &layout.entities[robot].model;
            let joint = |axis: &Axis| (model.joints[axis.joint].name.clone(), setting(robot, axis.joint));
            let joints: Vec<_> = axes.iter().map(joint).collect();
            let indices: Vec<usize> = axes.iter().map(|axis| axis.joint).collect();
            let width = joints.len();
            Ok::<_, Error>((
                robot,
                indices,
                Self::Joints { name: named.robot.clone(), joints, gains: None },
                width,
            ))
        };
        let settings = |robot: usize, joint: usize| &state.settings[robot].joints[joint];
        match of {
            Varied::JointPositions(ref named) | Varied::JointVelocities(ref named) => {
                let (robot, axes) = axes_of(layout, named, field, "names")?;
                let model = &layout.entities[robot].model;
                let joints = axes.iter().map(|axis| model.joints[axis.joint].name.clone()).collect();
                let (width, of_positions) = (axes.len(), matches!(of, Varied::JointPositions(_)));
                let name = named.robot.clone();
                Ok((Self::JointStates { robot, name, joints, axes, of_positions }, width))
            }
            Varied::LinkMasses(named) => {
                let (robot, entity) = robot(layout, &field("robot"), &named.robot)?;
                let links = links(entity, &field("names"), &named.names)?;
                let width = links.len();
                Ok((Self::LinkMasses { robot, links }, width))
            }
            Varied::JointFriction(named) => {
                let setting = |robot, joint| Setting::Friction(settings(robot, joint).friction);
                of_joints(&named, &setting).map(|(_, _, plan, width)| (plan, width))
            }
            Varied::JointDamping(named) => {
                let setting = |robot, joint| Setting::Damping(settings(robot, joint).damping);
                of_joints(&named, &setting).map(|(_, _, plan, width)| (plan, width))
            }
            Varied::Gains(named) => {
                let setting = |robot, joint| {
                    let (stiffness, damping) = settings(robot, joint).default_gains;
                    Setting::Gains(stiffness, damping)
                };
                let (robot, indices, plan, width) = of_joints(&named, &setting)?;
                let Self::Joints { name, joints, .. } = plan else { return Ok((plan, width)) };
                Ok((Self::Joints { name, joints, gains: Some((robot, indices)) }, width))
            }
            Varied::SurfaceFriction(named) => {
                let (robot, entity) = robot(layout, &field("robot"), &named.robot)?;
                let surfaces = &state.settings[robot].surfaces;
                let friction = |link: usize| {
                    let surface = surfaces.get(link).copied().flatten()?;
                    Some((entity.model.links[link].name.clone(), surface.friction))
                };
                // A link without shapes has no surface.
                let links = links(entity, &field("names"), &named.names)?;
                let links: Vec<_> = links.into_iter().filter_map(friction).collect();
                let width = links.len();
                Ok((Self::Surfaces { name: named.robot, links }, width))
            }
            Varied::Wrench { robot: name, link: of_link, at, steps } => {
                let (_, entity) = robot(layout, &field("robot"), &name)?;
                link(entity, &field("names[0]"), &of_link)?;
                let seconds = steps as f64 * time_step;
                if steps == 0 || seconds > MAX_WRENCH_DURATION {
                    let expected = format!("it must be at least 1, and at most {MAX_WRENCH_DURATION} s long");
                    return Err(refuse(field("wrench_steps"), steps, expected));
                }
                Ok((Self::Wrench { name, link: of_link, at, seconds }, 3))
            }
        }
    }
}

/// Returns trees for the robots whose links have factors.
pub(super) fn trees(factors: &[Vec<f64>], state: &PublishedState) -> Vec<Option<Arc<Tree>>> {
    let tree = |(factors, entity): (&Vec<f64>, &Arc<crate::simulation::published_state::EntityLayout>)| {
        let made = || Tree::with_masses(&entity.model, entity.fixed_base, |link| factors[link]);
        (!factors.is_empty()).then(|| Arc::new(made()))
    };
    factors.iter().zip(&state.world.entities).map(tree).collect()
}
