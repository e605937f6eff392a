//! What is asked of a rollout. Arrays of many copies are flat: the copy is the slowest index.

use glamx::{DQuat, DVec3};

/// What is asked.
#[derive(Clone, Debug, Default)]
pub struct RolloutRequest {
    /// How many copies, at least 1.
    pub copies: usize,
    /// Steps of each, at least 1.
    pub steps: u64,
    /// Where copies begin other than where the state has them.
    pub starts: Vec<Start>,
    /// What differs from copy to copy beside that.
    pub variations: Vec<Variation>,
    /// Of what is drawn at random.
    pub seed: u64,
    /// What joints are to do. All else goes on as the state has it.
    pub controls: Vec<Control>,
    /// What is read of each copy.
    pub quantities: Vec<Quantity>,
    /// Quantities are read after every so many steps; 0 is after the last one alone.
    pub record_every: u64,
    /// They are also read before the first step.
    pub record_start: bool,
    /// What is summed over the steps of each copy.
    pub costs: Vec<CostTerm>,
    /// The cost of each step is an answer too.
    pub step_costs: bool,
}

/// Where joints and the root of a robot begin. Each array has one row for each copy, or one for all of them, or is empty.
#[derive(Clone, Debug, Default)]
pub struct Start {
    /// Its name.
    pub robot: String,
    /// Joints of one axis each; none is all of them that follow no other.
    pub joints: Vec<String>,
    /// A number a joint, rad or m; empty leaves them.
    pub positions: Vec<f64>,
    /// A number a joint, rad/s or m/s; empty is at rest where positions are given.
    pub velocities: Vec<f64>,
    /// `world_from_root` in seven numbers: x y z and a quaternion x y z w.
    pub roots: Vec<f64>,
    /// Of a free root in six numbers, world axes: linear velocity of its origin, then angular velocity.
    pub root_twists: Vec<f64>,
}

/// Numbers that differ from copy to copy.
#[derive(Clone, Debug)]
pub struct Variation {
    /// What they are.
    pub of: Varied,
    /// Where they come from.
    pub values: Values,
}

/// What numbers of a variation are.
#[derive(Clone, Debug)]
pub enum Varied {
    /// Added to positions at the start, rad or m: a number a joint.
    JointPositions(Named),
    /// Added to velocities at the start, rad/s or m/s: a number a joint.
    JointVelocities(Named),
    /// Factors of the masses and inertias of links.
    LinkMasses(Named),
    /// Factors of the dry friction of joints.
    JointFriction(Named),
    /// Factors of the damping of joints.
    JointDamping(Named),
    /// Factors of the stiffness and the damping of targets: those that joints have by default, and those that the rollout gives.
    Gains(Named),
    /// Factors of the sliding friction of links.
    SurfaceFriction(Named),
    /// A force on the origin of a link, world axes, newtons: three numbers.
    Wrench {
        /// The robot's name.
        robot: String,
        /// The link's name.
        link: String,
        /// The step that it begins with; 0 is the first.
        at: u64,
        /// For how many steps, at least 1.
        steps: u64,
    },
}

/// Joints or links of a robot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Named {
    /// Its name.
    pub robot: String,
    /// None is all of them.
    pub names: Vec<String>,
}

/// Where the numbers of a variation come from. What is drawn depends on the seed, the copy and the variation's index alone.
#[derive(Clone, Debug)]
pub enum Values {
    /// Given for each copy.
    Given(Vec<f64>),
    /// Equally likely between two numbers.
    Uniform {
        /// The least.
        low: f64,
        /// The most.
        high: f64,
    },
    /// Of a normal distribution.
    Normal {
        /// Its mean.
        mean: f64,
        /// Its standard deviation.
        deviation: f64,
    },
}

/// What joints of one robot are to do.
#[derive(Clone, Debug)]
pub struct Control {
    /// Its name.
    pub robot: String,
    /// Joints of one axis each; none is all of them that take targets.
    pub joints: Vec<String>,
    /// What the numbers are.
    pub mode: ControlMode,
    /// Rows of a number a joint, one row a knot: for all copies, or for each. Empty is zero, where there is feedback.
    pub values: Vec<f64>,
    /// How many knots there are, at least 1.
    pub knots: usize,
    /// Steps from knot to knot. After the last knot its numbers hold.
    pub knot_steps: u64,
    /// What holds between knots.
    pub interpolation: Interpolation,
    /// Of position and velocity targets, a number a joint; empty is the joints' own.
    pub stiffness: Vec<f64>,
    /// The same; damping.
    pub damping: Vec<f64>,
    /// Added to the numbers at each step.
    pub feedback: Option<Feedback>,
}

/// What the numbers of a control are.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ControlMode {
    /// rad or m.
    #[default]
    Position,
    /// rad/s or m/s.
    Velocity,
    /// N m or N.
    Effort,
}

/// What holds between knots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// The knot before.
    #[default]
    Hold,
    /// A straight line.
    Linear,
    /// Cubic polynomials through the knots, with the slopes of their neighbours' line (Catmull and Rom, 1974).
    Cubic,
}

/// u = target - K (x - x0), where x is the positions of some joints, and then their velocities.
#[derive(Clone, Debug, Default)]
pub struct Feedback {
    /// Joints of one axis each; none is all of them that follow no other.
    pub joints: Vec<String>,
    /// K, by rows: a row for each driven joint with a number for each of x. One matrix for all, one a knot, or one a knot
    /// for each copy. The knot before holds.
    pub gains: Vec<f64>,
    /// x0; in the same way. Empty is zero.
    pub references: Vec<f64>,
}

/// What is read of each copy.
#[derive(Clone, Debug)]
pub enum Quantity {
    /// Positions of joints, as a state has them: one number a joint, seven of a floating one, four of a spherical one.
    JointPositions(Named),
    /// Velocities of joints.
    JointVelocities(Named),
    /// What actuators applied over the last step.
    JointEfforts(Named),
    /// `world_from_root` in seven numbers.
    RootPose(String),
    /// Of the root link's origin, world axes, in six numbers.
    RootTwist(String),
    /// `world_from_link` of links, seven numbers each.
    LinkPoses(Named),
    /// How many contact points a robot has: one number.
    ContactCount(String),
    /// The sum of the normal forces on links of a robot over the last step, newtons: one number.
    ContactForce(Named),
}

/// A term of the cost of a step.
#[derive(Clone, Debug)]
pub struct CostTerm {
    /// Of the state after each step.
    pub weight: f64,
    /// Of the state after the last one, in addition.
    pub final_weight: f64,
    /// What is weighted.
    pub of: Cost,
}

/// What is weighted.
#[derive(Clone, Debug)]
pub enum Cost {
    /// The sum of the squares of what joints lack to be at these positions, rad^2 or m^2.
    JointPositions {
        /// Joints of one axis each.
        joints: Named,
        /// A number a joint; empty is zero.
        targets: Vec<f64>,
        /// Whole turns do not count.
        wrapped: bool,
    },
    /// The sum of the squares of what joints lack to have these velocities.
    JointVelocities {
        /// Joints of one axis each.
        joints: Named,
        /// A number a joint; empty is zero.
        targets: Vec<f64>,
    },
    /// The sum of the squares of what actuators applied, N^2 m^2 or N^2.
    JointEfforts(Named),
    /// The square of the distance of a point of a link from a place, m^2.
    LinkPosition {
        /// The robot's name.
        robot: String,
        /// The link's name.
        link: String,
        /// In the link's frame, metres.
        point: DVec3,
        /// World, metres.
        target: DVec3,
    },
    /// The square of the angle by which a link is turned from an orientation, rad^2.
    LinkOrientation {
        /// The robot's name.
        robot: String,
        /// The link's name.
        link: String,
        /// `world_from_link`.
        target: DQuat,
    },
    /// The sum of the normal forces on links of a robot over the last step, newtons.
    ContactForce(Named),
    /// The square of what lacks to a distance between surfaces, m^2; zero where they are farther apart.
    Nearness {
        /// The robot's name.
        robot: String,
        /// Its link; empty is all of them.
        link: String,
        /// The other robot; empty is all others.
        other_robot: String,
        /// Its link; empty is all of them.
        other_link: String,
        /// The distance, metres.
        distance: f64,
    },
}
