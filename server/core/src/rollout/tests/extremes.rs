//! Requests of arbitrary numbers: each is refused, or gives results of its shape.

use super::super::draw::uniform;
use super::*;

/// Pseudorandom numbers; some are as large as possible, or NaN.
struct Numbers {
    seed: u64,
    drawn: u64,
}

impl Numbers {
    fn part(&mut self) -> f64 {
        self.drawn += 1;
        uniform([self.seed, self.drawn, 0, 0], 0.0, 1.0)
    }

    /// Returns a number from 0 to `most`.
    fn below(&mut self, most: usize) -> usize {
        (self.part() * most as f64) as usize
    }

    fn number(&mut self) -> f64 {
        match self.below(400) {
            0 => f64::NAN,
            1 => f64::INFINITY,
            2 => 1e12,
            3 => -1e12,
            4 => 1e300,
            5 => 0.0,
            _ => 4.0 * self.part() - 2.0,
        }
    }

    fn numbers(&mut self, count: usize) -> Vec<f64> {
        (0..count).map(|_| self.number()).collect()
    }

    fn one_of<T: Clone>(&mut self, all: &[T]) -> T {
        all[self.below(all.len())].clone()
    }

    fn named(&mut self) -> Named {
        let robot: &str = self.one_of(&["arm", "arm", "arm", "ball", "floor", "leg"]);
        let names: &[&str] =
            self.one_of::<&[&str]>(&[&[], &["elbow"], &["hand"], &["shoulder", "elbow"], &["ball"]]);
        Named { robot: robot.into(), names: names.iter().map(|name| (*name).into()).collect() }
    }

    fn control(&mut self, copies: usize) -> Control {
        let knots = self.below(3);
        let count = 2 * knots * self.one_of(&[1, copies, copies]);
        let feedback =
            (self.below(3) == 0).then(|| Feedback { gains: self.numbers(8), ..Feedback::default() });
        Control {
            interpolation: self.one_of(&[Interpolation::Hold, Interpolation::Linear, Interpolation::Cubic]),
            feedback,
            ..control(
                self.one_of(&[ControlMode::Position, ControlMode::Velocity, ControlMode::Effort]),
                self.numbers(count),
                knots,
                self.below(4) as u64,
            )
        }
    }

    fn start(&mut self, copies: usize) -> Start {
        if self.below(2) == 0 {
            let positions = self.numbers(2 * copies);
            return Start { robot: "arm".into(), positions, velocities: self.numbers(2), ..Start::default() };
        }
        let mut roots = self.numbers(3);
        roots.extend([0.0, 0.6, 0.0, 0.8]);
        Start { robot: "ball".into(), roots, root_twists: self.numbers(6 * copies), ..Start::default() }
    }

    fn variation(&mut self, copies: usize) -> Variation {
        let named = self.named();
        let of = match self.below(8) {
            0 => Varied::JointPositions(named),
            1 => Varied::JointVelocities(named),
            2 => Varied::LinkMasses(named),
            3 => Varied::JointFriction(named),
            4 => Varied::JointDamping(named),
            5 => Varied::Gains(named),
            6 => Varied::SurfaceFriction(named),
            _ => Varied::Wrench {
                robot: "ball".into(),
                link: "ball".into(),
                at: 1,
                steps: self.below(3) as u64,
            },
        };
        let values = match self.below(3) {
            0 => {
                let width = 1 + self.below(3);
                Values::Given(self.numbers(copies * width))
            }
            1 => Values::Uniform { low: self.number(), high: self.number() },
            _ => Values::Normal { mean: self.number(), deviation: self.number() },
        };
        Variation { of, values }
    }

    fn cost(&mut self) -> CostTerm {
        let named = self.named();
        let (robot, link) = (named.robot.clone(), String::from("hand"));
        let of = match self.below(6) {
            0 => Cost::JointPositions { joints: named, targets: self.numbers(2), wrapped: true },
            1 => Cost::JointVelocities { joints: named, targets: Vec::new() },
            2 => Cost::JointEfforts(named),
            3 => Cost::LinkPosition {
                robot,
                link,
                point: DVec3::splat(self.number()),
                target: DVec3::splat(self.number()),
            },
            4 => Cost::ContactForce(named),
            _ => Cost::Nearness {
                robot,
                link: String::new(),
                other_robot: String::new(),
                other_link: String::new(),
                distance: self.number(),
            },
        };
        CostTerm { weight: self.number(), final_weight: 1.0, of }
    }

    fn request(&mut self) -> RolloutRequest {
        let (copies, steps) = (self.below(5), self.below(12) as u64);
        let some = |numbers: &mut Self| numbers.below(3);
        RolloutRequest {
            copies,
            steps,
            starts: (0..some(self)).map(|_| self.start(copies)).collect(),
            variations: (0..some(self)).map(|_| self.variation(copies)).collect(),
            seed: self.seed,
            controls: (0..some(self)).map(|_| self.control(copies)).collect(),
            record_every: self.below(4) as u64,
            record_start: self.below(2) == 0,
            costs: (0..some(self)).map(|_| self.cost()).collect(),
            step_costs: self.below(2) == 0,
            ..all_of_it(copies, steps)
        }
    }
}

#[test]
fn whatever_is_asked_is_refused_or_has_its_shape() {
    let world = world();
    let (mut refused, mut ended, mut done) = (0, 0, 0);
    for seed in 0..3_000 {
        let request = Numbers { seed, drawn: 0 }.request();
        let Ok(rollout) = Rollout::new(world.to_saved(), request, ROOM) else {
            refused += 1;
            continue;
        };
        let shape = rollout.shape().clone();
        let mut worker = rollout.worker();
        let result = rollout.advance(&mut worker, 0, &|| false).unwrap();
        assert_eq!(result.states.len(), shape.copies * shape.rows * shape.columns(), "seed {seed}");
        assert_eq!(result.costs.len(), shape.copies * shape.terms);
        let steps = if shape.step_costs { shape.steps as usize } else { 0 };
        assert_eq!(result.step_costs.len(), shape.copies * steps);
        assert!(result.steps_done.iter().all(|done| *done <= shape.steps));
        assert!(!result.costs.iter().chain(&result.step_costs).any(|cost| cost.is_nan()), "seed {seed}");
        ended += result.ended.len();
        done += shape.copies - result.ended.len();
    }
    assert!(refused > 50 && ended > 5 && done > 50, "{refused} refused, {ended} ended, {done} done");
}
