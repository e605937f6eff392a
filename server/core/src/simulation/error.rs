//! Refusals of commands and queries. Each message is a sentence for people that names the element; nothing
//! was changed.

/// Refusal of a command or a query.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// No robot of that name.
    #[error("there is no robot {robot:?} in this world; {}", list_known("robots", .known))]
    RobotNotFound {
        /// Requested name.
        robot: String,
        /// Known names.
        known: Vec<String>,
    },
    /// The robot has no such joint.
    #[error("robot {robot:?} has no joint {joint:?}; {}", list_known("its joints", .known))]
    JointNotFound {
        /// Name of the robot.
        robot: String,
        /// Requested name.
        joint: String,
        /// Known names.
        known: Vec<String>,
    },
    /// The robot has no such link.
    #[error("robot {robot:?} has no link {link:?}; {}", list_known("its links", .known))]
    LinkNotFound {
        /// Name of the robot.
        robot: String,
        /// Requested name.
        link: String,
        /// Known names.
        known: Vec<String>,
    },
    /// The name is taken.
    #[error("there is a robot {robot:?} already; choose another name, delete it, or reload it")]
    RobotExists {
        /// Name.
        robot: String,
    },
    /// An invalid number or name.
    #[error("{element}{of} is {value}; {expected}")]
    InvalidValue {
        /// Path of the field in its request, for instance `robots[0].joints[2].position.stiffness`.
        element: String,
        /// Owner of the field, for people: ` (joint "elbow")`, or nothing.
        of: String,
        /// Given value.
        value: String,
        /// Accepted values, as "it must be ...".
        expected: String,
    },
    /// A list of the wrong length.
    #[error("{element} has {has}, and needs {needs}")]
    WrongCount {
        /// Path of the field in its request, for instance `controls[0].values`.
        element: String,
        /// Present length, as "1 number".
        has: String,
        /// Required length and its reason: "2 (one a joint)".
        needs: String,
    },
    /// A field of the request names something that does not exist. `error` has the reason.
    #[error("{field}: {error}")]
    InField {
        /// Path of the field in its request, for instance `costs[2].links[0]`.
        field: String,
        /// Reason.
        error: Box<Error>,
    },
    /// The joint has no actuator.
    #[error("joint {joint:?} of robot {robot:?} {why}, so it takes no target")]
    JointNotActuated {
        /// Name of the robot.
        robot: String,
        /// Name of the joint.
        joint: String,
        /// Reason: "is fixed", "follows joint ...".
        why: String,
    },
    /// A target beyond a limit, if refusal was requested.
    #[error("target {requested} of joint {joint:?} lies beyond its limits, {lower} to {upper}")]
    TargetBeyondLimit {
        /// Name of the joint.
        joint: String,
        /// Requested value.
        requested: f64,
        /// Lower limit.
        lower: f64,
        /// Upper limit.
        upper: f64,
    },
    /// The robot has another layout.
    #[error(
        "robot {robot:?} has joint layout {present}, the request was made for {requested}; \
         fetch its joints again"
    )]
    LayoutChanged {
        /// Name of the robot.
        robot: String,
        /// Requested version.
        requested: u64,
        /// Present version.
        present: u64,
    },
    /// Another client has claimed the robot.
    #[error("robot {robot:?} is claimed by {holder:?}")]
    RobotClaimed {
        /// Name of the robot.
        robot: String,
        /// Holder of the claim.
        holder: String,
    },
    /// Another client has claimed the world.
    #[error("the world is claimed by {holder:?}")]
    WorldClaimed {
        /// Holder of the claim.
        holder: String,
    },
    /// An action concerns all clients, while another one holds a claim.
    #[error(
        "{holder:?} holds a claim in this world: claim the world to pause, play, reset or restore it, or to change its physics"
    )]
    WorldShared {
        /// Holder of the claim.
        holder: String,
    },
    /// Another client has claimed the joint.
    #[error("joint {joint:?} of robot {robot:?} is claimed by {holder:?}")]
    JointClaimed {
        /// Name of the robot.
        robot: String,
        /// Name of the joint.
        joint: String,
        /// Holder of the claim.
        holder: String,
    },
    /// The claim does not exist.
    #[error("this claim does not exist: it was released, it expired, or another client took over")]
    ClaimNotFound,
    /// The constraint does not exist.
    #[error("there is no constraint {constraint:?} in this world; {}", list_known("constraints", .known))]
    ConstraintNotFound {
        /// Requested name.
        constraint: String,
        /// Known names.
        known: Vec<String>,
    },
    /// The name is taken.
    #[error("there is a constraint {constraint:?} already; choose another name, change it, or delete it")]
    ConstraintExists {
        /// Name.
        constraint: String,
    },
    /// The robot has no such sensor.
    #[error("robot {robot:?} has no sensor {sensor:?}; {}", list_known("its sensors", .known))]
    SensorNotFound {
        /// Name of the robot.
        robot: String,
        /// Requested name.
        sensor: String,
        /// Known names.
        known: Vec<String>,
    },
    /// The name is taken.
    #[error("robot {robot:?} has a sensor {sensor:?} already; choose another name, or delete it")]
    SensorExists {
        /// Name of the robot.
        robot: String,
        /// Name.
        sensor: String,
    },
    /// The saved state does not exist.
    #[error("there is no saved state {name:?}; {}", list_known("saved states", .known))]
    SavedStateNotFound {
        /// Requested name.
        name: String,
        /// Known names.
        known: Vec<String>,
    },
    /// A limit of the world is exceeded.
    #[error("{what} would be {value}, and the limit is {limit}")]
    LimitExceeded {
        /// Quantity that is limited.
        what: String,
        /// Value that it would have.
        value: u64,
        /// Maximum value.
        limit: u64,
    },
}

impl Error {
    /// Adds the field whose name was not found.
    pub(crate) fn in_field(self, field: impl Into<String>) -> Self {
        Self::InField { field: field.into(), error: Box::new(self) }
    }

    /// Prefixes the named field with `parent`.
    pub(super) fn within(self, parent: impl FnOnce() -> String) -> Self {
        match self {
            Self::InvalidValue { element, of, value, expected } => {
                Self::InvalidValue { element: format!("{}.{element}", parent()), of, value, expected }
            }
            other => other,
        }
    }

    /// Adds the owner of the field, for people.
    pub(super) fn of(self, whose: impl FnOnce() -> String) -> Self {
        match self {
            Self::InvalidValue { element, of: _, value, expected } => {
                Self::InvalidValue { element, of: format!(" ({})", whose()), value, expected }
            }
            other => other,
        }
    }
}

/// Returns "its joints are a, b and 3 more", or that there are none.
pub fn list_known(what: &str, names: &[String]) -> String {
    const SHOWN: usize = 8;
    if names.is_empty() {
        return format!("there are no {}", what.trim_start_matches("its "));
    }
    let shown: Vec<String> = names.iter().take(SHOWN).map(|name| format!("{name:?}")).collect();
    let more = names.len().saturating_sub(SHOWN);
    let tail = if more > 0 { format!(" and {more} more") } else { String::new() };
    format!("{what} are {}{tail}", shown.join(", "))
}
