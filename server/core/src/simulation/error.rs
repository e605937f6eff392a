//! Why a command or a query is refused. Each message is a sentence for people
//! that names the element; nothing was changed.

/// A refusal.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum Error {
    /// No robot of that name.
    #[error("there is no robot {robot:?} in this world; {}", list_known("robots", .known))]
    RobotNotFound {
        /// What was asked for.
        robot: String,
        /// What there is.
        known: Vec<String>,
    },
    /// The robot has no such joint.
    #[error("robot {robot:?} has no joint {joint:?}; {}", list_known("its joints", .known))]
    JointNotFound {
        /// Whose.
        robot: String,
        /// What was asked for.
        joint: String,
        /// What there is.
        known: Vec<String>,
    },
    /// The robot has no such link.
    #[error("robot {robot:?} has no link {link:?}; {}", list_known("its links", .known))]
    LinkNotFound {
        /// Whose.
        robot: String,
        /// What was asked for.
        link: String,
        /// What there is.
        known: Vec<String>,
    },
    /// The name is taken.
    #[error("there is a robot {robot:?} already; choose another name, delete it, or reload it")]
    RobotExists {
        /// The name.
        robot: String,
    },
    /// A number or a name that cannot be.
    #[error("{element}{of} is {value}; {expected}")]
    InvalidValue {
        /// The path of the field in its request, for instance `robots[0].joints[2].position.stiffness`.
        element: String,
        /// What it belongs to, for people: ` (joint "elbow")`, or nothing.
        of: String,
        /// What was given.
        value: String,
        /// What would be accepted, as "it must be ...".
        expected: String,
    },
    /// A list of another length than it must have.
    #[error("{element} has {has}, and needs {needs}")]
    WrongCount {
        /// The path of the field in its request, for instance `controls[0].values`.
        element: String,
        /// How many there are, as "1 number".
        has: String,
        /// How many there must be, and why: "2 (one a joint)".
        needs: String,
    },
    /// What a field of the request names cannot be had. The reason is that of `error`.
    #[error("{field}: {error}")]
    InField {
        /// The path of the field in its request, for instance `costs[2].links[0]`.
        field: String,
        /// Why not.
        error: Box<Error>,
    },
    /// The joint has no actuator.
    #[error("joint {joint:?} of robot {robot:?} {why}, so it takes no target")]
    JointNotActuated {
        /// Whose.
        robot: String,
        /// Which.
        joint: String,
        /// "is fixed", "follows joint ...".
        why: String,
    },
    /// A target beyond a limit, where refusal was asked for.
    #[error("target {requested} of joint {joint:?} lies beyond its limits, {lower} to {upper}")]
    TargetBeyondLimit {
        /// Which.
        joint: String,
        /// What was asked for.
        requested: f64,
        /// The least it may be.
        lower: f64,
        /// The most it may be.
        upper: f64,
    },
    /// The robot's layout is another one.
    #[error(
        "robot {robot:?} has joint layout {present}, the request was made for {requested}; \
         fetch its joints again"
    )]
    LayoutChanged {
        /// Whose.
        robot: String,
        /// What the request says.
        requested: u64,
        /// What there is.
        present: u64,
    },
    /// Another client's robot.
    #[error("robot {robot:?} is claimed by {holder:?}")]
    RobotClaimed {
        /// Which.
        robot: String,
        /// By whom.
        holder: String,
    },
    /// Another client's world.
    #[error("the world is claimed by {holder:?}")]
    WorldClaimed {
        /// By whom.
        holder: String,
    },
    /// What concerns all clients, while another one holds a claim.
    #[error(
        "{holder:?} holds a claim in this world: claim the world to pause, play, reset or restore it, or to change its physics"
    )]
    WorldShared {
        /// Who.
        holder: String,
    },
    /// Another client's joint.
    #[error("joint {joint:?} of robot {robot:?} is claimed by {holder:?}")]
    JointClaimed {
        /// Whose.
        robot: String,
        /// Which.
        joint: String,
        /// By whom.
        holder: String,
    },
    /// No such claim.
    #[error("there is no such claim: it was released, it lapsed, or another took over")]
    ClaimNotFound,
    /// No such constraint.
    #[error("there is no constraint {constraint:?} in this world; {}", list_known("constraints", .known))]
    ConstraintNotFound {
        /// What was asked for.
        constraint: String,
        /// What there is.
        known: Vec<String>,
    },
    /// The name is taken.
    #[error("there is a constraint {constraint:?} already; choose another name, change it, or delete it")]
    ConstraintExists {
        /// The name.
        constraint: String,
    },
    /// The robot has no such sensor.
    #[error("robot {robot:?} has no sensor {sensor:?}; {}", list_known("its sensors", .known))]
    SensorNotFound {
        /// Whose.
        robot: String,
        /// What was asked for.
        sensor: String,
        /// What there is.
        known: Vec<String>,
    },
    /// The name is taken.
    #[error("robot {robot:?} has a sensor {sensor:?} already; choose another name, or delete it")]
    SensorExists {
        /// Whose.
        robot: String,
        /// The name.
        sensor: String,
    },
    /// No such kept state.
    #[error("there is no saved state {name:?}; {}", list_known("saved states", .known))]
    SavedStateNotFound {
        /// What was asked for.
        name: String,
        /// What there is.
        known: Vec<String>,
    },
    /// A limit of the world.
    #[error("{what} would be {value}, and the limit is {limit}")]
    LimitExceeded {
        /// What is counted.
        what: String,
        /// What it would be.
        value: u64,
        /// What it may be.
        limit: u64,
    },
}

impl Error {
    /// The same, with the field that has the name which was not found.
    pub(crate) fn in_field(self, field: impl Into<String>) -> Self {
        Self::InField { field: field.into(), error: Box::new(self) }
    }

    /// The same, where the field that is named is one of `parent`.
    pub(super) fn within(self, parent: impl FnOnce() -> String) -> Self {
        match self {
            Self::InvalidValue { element, of, value, expected } => {
                Self::InvalidValue { element: format!("{}.{element}", parent()), of, value, expected }
            }
            other => other,
        }
    }

    /// The same, with what the field belongs to, for people.
    pub(super) fn of(self, whose: impl FnOnce() -> String) -> Self {
        match self {
            Self::InvalidValue { element, of: _, value, expected } => {
                Self::InvalidValue { element, of: format!(" ({})", whose()), value, expected }
            }
            other => other,
        }
    }
}

/// "its joints are a, b and 3 more", or that there are none.
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
