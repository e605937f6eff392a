//! Request of a rollout. Arrays of many copies are flat: the copy is the slowest index.

use glamx::{DQuat, DVec3};

/// Request of a rollout.
#[derive(Clone, Debug, Default)]
pub struct RolloutRequest {
    /// Number of copies, at least 1.
    pub copies: usize,
    /// Number of steps of each, at least 1.
    pub steps: u64,
    /// Starts of copies that differ from the state.
    pub starts: Vec<Start>,
    /// Other differences between copies.
    pub variations: Vec<Variation>,
    /// Seed of random values.
    pub seed: u64,
    /// Controls of joints. All others continue as in the state.
    pub controls: Vec<Control>,
    /// Quantities to read of each copy.
    pub quantities: Vec<Quantity>,
    /// Number of steps between readings of quantities; 0 reads only after the last step.
    pub record_every: u64,
    /// Whether quantities are also read before the first step.
    pub record_start: bool,
    /// Costs that are summed over the steps of each copy.
    pub costs: Vec<CostTerm>,
    /// Whether the cost of each step is returned too.
    pub step_costs: bool,
}

/// Start of joints and the root of a robot. Each array has one row for each copy, or one for all of them, or
/// is empty.
#[derive(Clone, Debug, Default)]
pub struct Start {
    /// Name of the robot.
    pub robot: String,
    /// Joints of one axis each; an empty list means all of them that follow no other.
    pub joints: Vec<String>,
    /// Positions, one for each joint, rad or m; empty keeps them.
    pub positions: Vec<f64>,
    /// Velocities, one for each joint, rad/s or m/s; empty means rest if positions are given.
    pub velocities: Vec<f64>,
    /// Poses `world_from_root` in seven numbers: x y z and a quaternion x y z w.
    pub roots: Vec<f64>,
    /// Velocities of a free root in six numbers, world axes: linear velocity of its origin, then angular
    /// velocity.
    pub root_twists: Vec<f64>,
}

/// Values that differ from copy to copy.
#[derive(Clone, Debug)]
pub struct Variation {
    /// Quantity that varies.
    pub of: Varied,
    /// Source of the values.
    pub values: Values,
}

/// Quantity of a variation.
#[derive(Clone, Debug)]
pub enum Varied {
    /// Additions to initial positions, rad or m: one for each joint.
    JointPositions(Named),
    /// Additions to initial velocities, rad/s or m/s: one for each joint.
    JointVelocities(Named),
    /// Factors of the masses and inertias of links.
    LinkMasses(Named),
    /// Factors of the dry friction of joints.
    JointFriction(Named),
    /// Factors of the damping of joints.
    JointDamping(Named),
    /// Factors of the stiffness and the damping of targets: the joints' defaults, and the rollout's gains.
    Gains(Named),
    /// Factors of the sliding friction of links.
    SurfaceFriction(Named),
    /// Force on the origin of a link, world axes, newtons: three numbers.
    Wrench {
        /// Name of the robot.
        robot: String,
        /// Name of the link.
        link: String,
        /// First step of the force; 0 is the first step.
        at: u64,
        /// Number of steps, at least 1.
        steps: u64,
    },
}

/// Joints or links of a robot.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Named {
    /// Name of the robot.
    pub robot: String,
    /// Names; an empty list means all.
    pub names: Vec<String>,
}

/// Source of a variation's values. Random values depend only on the seed, the copy and the variation's index.
#[derive(Clone, Debug)]
pub enum Values {
    /// Values for each copy.
    Given(Vec<f64>),
    /// Uniform distribution between two numbers.
    Uniform {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// Normal distribution.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        deviation: f64,
    },
}

/// Control of joints of one robot.
#[derive(Clone, Debug)]
pub struct Control {
    /// Name of the robot.
    pub robot: String,
    /// Joints of one axis each; an empty list means all of them that take targets.
    pub joints: Vec<String>,
    /// Meaning of the values.
    pub mode: ControlMode,
    /// Rows of one value for each joint, one row for each knot: for all copies, or for each. Empty means
    /// zero, if there is feedback.
    pub values: Vec<f64>,
    /// Number of knots, at least 1.
    pub knots: usize,
    /// Number of steps from knot to knot. The last knot's values hold after it.
    pub knot_steps: u64,
    /// Interpolation between knots.
    pub interpolation: Interpolation,
    /// Stiffness of position and velocity targets, one for each joint; empty means the joints' own.
    pub stiffness: Vec<f64>,
    /// Damping of position and velocity targets, one for each joint; empty means the joints' own.
    pub damping: Vec<f64>,
    /// Feedback that is added to the values at each step.
    pub feedback: Option<Feedback>,
}

/// Meaning of a control's values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ControlMode {
    /// Positions, rad or m.
    #[default]
    Position,
    /// Velocities, rad/s or m/s.
    Velocity,
    /// Efforts, N m or N.
    Effort,
}

/// Interpolation between knots.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Interpolation {
    /// Value of the previous knot.
    #[default]
    Hold,
    /// Linear interpolation.
    Linear,
    /// Cubic polynomials through the knots, with slopes from the neighbouring knots (Catmull and Rom, 1974).
    Cubic,
}

/// Feedback u = target - K (x - x0), where x is the positions of some joints, and then their velocities.
#[derive(Clone, Debug, Default)]
pub struct Feedback {
    /// Joints of one axis each; an empty list means all of them that follow no other.
    pub joints: Vec<String>,
    /// K, row by row: a row for each driven joint with a number for each of x. There is one matrix for all,
    /// one for each knot, or one for each knot of each copy. The previous knot's matrix holds.
    pub gains: Vec<f64>,
    /// x0, in the same layout. Empty means zero.
    pub references: Vec<f64>,
}

/// Quantity to read of each copy.
#[derive(Clone, Debug)]
pub enum Quantity {
    /// Positions of joints, as in a state: one number for a joint, seven for a floating one, four for a
    /// spherical one.
    JointPositions(Named),
    /// Velocities of joints.
    JointVelocities(Named),
    /// Efforts that actuators applied over the last step.
    JointEfforts(Named),
    /// Pose `world_from_root` in seven numbers.
    RootPose(String),
    /// Velocity of the root link's origin and angular velocity, world axes, in six numbers.
    RootTwist(String),
    /// Poses `world_from_link` of links, seven numbers each.
    LinkPoses(Named),
    /// Number of contact points of a robot: one number.
    ContactCount(String),
    /// Sum of the normal forces on links of a robot over the last step, newtons: one number.
    ContactForce(Named),
}

/// A term of the cost of a step.
#[derive(Clone, Debug)]
pub struct CostTerm {
    /// Weight of the state after each step.
    pub weight: f64,
    /// Additional weight of the state after the last step.
    pub final_weight: f64,
    /// Weighted quantity.
    pub of: Cost,
}

/// Weighted quantity of a cost.
#[derive(Clone, Debug)]
pub enum Cost {
    /// Sum of the squared differences of joints to these positions, rad^2 or m^2.
    JointPositions {
        /// Joints of one axis each.
        joints: Named,
        /// Target positions, one for each joint; empty means zero.
        targets: Vec<f64>,
        /// Whether whole turns are ignored.
        wrapped: bool,
    },
    /// Sum of the squared differences of joints to these velocities.
    JointVelocities {
        /// Joints of one axis each.
        joints: Named,
        /// Target velocities, one for each joint; empty means zero.
        targets: Vec<f64>,
    },
    /// Sum of the squared efforts that actuators applied, N^2 m^2 or N^2.
    JointEfforts(Named),
    /// Squared distance of a point of a link from a target, m^2.
    LinkPosition {
        /// Name of the robot.
        robot: String,
        /// Name of the link.
        link: String,
        /// Point in the link's frame, metres.
        point: DVec3,
        /// Target, world, metres.
        target: DVec3,
    },
    /// Squared angle between a link's orientation and a target, rad^2.
    LinkOrientation {
        /// Name of the robot.
        robot: String,
        /// Name of the link.
        link: String,
        /// Target `world_from_link`.
        target: DQuat,
    },
    /// Sum of the normal forces on links of a robot over the last step, newtons.
    ContactForce(Named),
    /// Squared shortfall against a distance between surfaces, m^2; zero if they are farther apart.
    Nearness {
        /// Name of the robot.
        robot: String,
        /// Link of the robot; empty means all.
        link: String,
        /// Name of the other robot; empty means all others.
        other_robot: String,
        /// Link of the other robot; empty means all.
        other_link: String,
        /// Distance, metres.
        distance: f64,
    },
}
