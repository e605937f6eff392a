//! Tendons: joints whose positions are sums of others; see [`sums`](super::constraint::sums) for their forces.

use super::actuator::{Axis, Drive};
use super::integrator::{Implicitness, Integrator};
use super::scratch::BodyScratch;
use super::tree::{Tendon, Tree};

impl Tendon {
    /// Returns its velocity.
    pub fn velocity(&self, tree: &Tree, velocities: &[f64]) -> f64 {
        self.terms.iter().map(|&(body, factor)| factor * velocities[tree.bodies[body].velocity]).sum()
    }

    /// Returns its position.
    pub fn position(&self, tree: &Tree, q: &[f64]) -> f64 {
        let sum: f64 = self.terms.iter().map(|&(body, by)| by * q[tree.bodies[body].position]).sum();
        sum + self.offset
    }
}

impl Tree {
    /// Sets the positions of tendons.
    pub fn apply_tendons(&self, q: &mut [f64]) {
        for tendon in &self.tendons {
            q[self.bodies[tendon.body].position] = tendon.position(self, q);
        }
    }

    /// Sets the velocities of tendons.
    pub fn tendons_follow(&self, velocities: &mut [f64]) {
        for tendon in &self.tendons {
            velocities[self.bodies[tendon.body].velocity] = tendon.velocity(self, velocities);
        }
    }
}

/// Returns the implicitness of a tendon's forces: as of a joint that moves its composite inertia.
pub fn implicitness((axis, drive): (&Axis, &Drive), (h, integrator): (f64, Integrator)) -> Implicitness {
    if integrator == Integrator::Euler {
        return Implicitness::BACKWARD;
    }
    let stiffness = axis.settings.own_forces().stiffness_of_step(h) + drive.stiffness_of_step(h);
    Implicitness::of_joint(stiffness, axis.settings.composite_inertia)
}

/// Frees the bodies of tendons from the forces that the inertia pass gave them, which act on other joints.
pub fn release(
    tree: &Tree,
    (axes, drives): (&[Axis], &[Drive]),
    step: (f64, Integrator),
    bodies: &mut [BodyScratch],
) {
    for tendon in &tree.tendons {
        let dof = tree.bodies[tendon.body].velocity;
        let at = &mut bodies[tendon.body];
        at.implicitness = implicitness((&axes[dof], &drives[dof]), step);
        at.of_law = at.implicitness;
        at.inverse_d = 0.0;
    }
}
