//! Configuration of the ROS 2 node.

use simd_ros2::wire;

/// Default address of `rmw_zenohd`.
const DEFAULT_ROUTER: &str = "tcp/localhost:7447";
/// Words of `ros2.plain_names`.
const FIRST: &str = "first";
const NONE: &str = "none";
const ROBOT: &str = "robot:";
/// Largest domain of ROS 2.
pub(super) const MAX_DOMAIN_ID: u32 = 232;
/// Maximum messages of each topic per wall second.
pub(super) const MAX_RATE: f64 = 1_000.0;

/// Error of a build without ROS 2.
pub const NO_ROS2: &str = "this build of simd has no ROS 2: leave out the settings that enable it, or build simd with the \
                           feature `ros2`";

/// A node on a ROS 2 graph with the middleware `rmw_zenoh`.
#[derive(Clone, Debug, PartialEq)]
pub struct Ros2 {
    /// Whether the node is enabled.
    pub enabled: bool,
    /// Router of the graph, as `tcp/HOST:PORT`.
    pub router: String,
    /// `ROS_DOMAIN_ID`.
    pub domain_id: u32,
    /// Prefix of the names of topics and services: `/`, or `/lab`.
    pub namespace: String,
    /// Distribution of the other nodes.
    pub distro: Distro,
    /// Maximum states per wall second.
    pub rate: f64,
    /// Robot whose topics and frames have plain names.
    pub plain_names: PlainNames,
}

/// Robot whose topics and frames have plain names, such as `/joint_states`. Others have their name before them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum PlainNames {
    /// The first robot with joints.
    #[default]
    First,
    /// The robot of this name.
    Robot(String),
    /// No robot.
    None,
}

/// A distribution of ROS 2 with `rmw_zenoh`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distro {
    /// Without type hashes.
    Humble,
    /// With type hashes, as all later ones.
    Jazzy,
    /// Released in 2025.
    Kilted,
    /// Released in 2026.
    Lyrical,
    /// The development distribution.
    Rolling,
}

impl Distro {
    /// Names in the configuration, in the order of the type.
    pub(super) const NAMES: [&str; 5] = ["humble", "jazzy", "kilted", "lyrical", "rolling"];
    const ALL: [Self; 5] = [Self::Humble, Self::Jazzy, Self::Kilted, Self::Lyrical, Self::Rolling];

    pub(super) fn name(self) -> &'static str {
        let of = Self::ALL.into_iter().zip(Self::NAMES).find(|(distro, _)| *distro == self);
        of.map_or("", |(_, name)| name)
    }

    pub(super) fn named(text: &str) -> Option<Self> {
        Self::ALL.into_iter().zip(Self::NAMES).find(|(_, name)| *name == text).map(|(distro, _)| distro)
    }

    /// Returns whether its keys have type hashes.
    pub fn has_type_hashes(self) -> bool {
        self != Self::Humble
    }
}

impl Default for Ros2 {
    fn default() -> Self {
        Self {
            enabled: false,
            router: DEFAULT_ROUTER.into(),
            domain_id: 0,
            namespace: "/".into(),
            distro: Distro::Jazzy,
            rate: 100.0,
            plain_names: PlainNames::First,
        }
    }
}

impl Ros2 {
    pub(super) fn set_router(&mut self, router: String) -> Result<(), String> {
        super::zenoh::check_locator(&router)?;
        self.router = router;
        Ok(())
    }

    pub(super) fn set_namespace(&mut self, namespace: String) -> Result<(), String> {
        if !wire::is_namespace(&namespace) {
            return Err(format!("ros2.namespace is {namespace:?}; it must be / or words like /lab/cell_1"));
        }
        self.namespace = namespace;
        Ok(())
    }

    pub(super) fn plain_names(&self) -> String {
        match &self.plain_names {
            PlainNames::First => FIRST.into(),
            PlainNames::None => NONE.into(),
            PlainNames::Robot(robot) => format!("{ROBOT}{robot}"),
        }
    }

    pub(super) fn set_plain_names(&mut self, names: &str) -> Result<(), String> {
        self.plain_names = match (names, names.strip_prefix(ROBOT)) {
            (FIRST, _) => PlainNames::First,
            (NONE, _) => PlainNames::None,
            (_, Some(robot)) if simd_model::is_wire_name(robot) => PlainNames::Robot(robot.into()),
            _ => {
                return Err(format!(
                    "ros2.plain_names is {names:?}; it must be {FIRST:?}, {NONE:?}, or \"{ROBOT}\" and the name of a robot"
                ));
            }
        };
        Ok(())
    }

    /// Checks the node with the other settings. The daemon's own Zenoh cannot listen at the router's address.
    /// Nodes have no tokens, so a router on another machine must be explicitly allowed.
    pub(super) fn check(&self, zenoh: &super::Zenoh, insecure: bool) -> Result<(), String> {
        let port = |locator: &str| locator.rsplit_once(':').map(|(_, port)| port.to_owned());
        if self.enabled && cfg!(not(feature = "ros2")) {
            return Err(NO_ROS2.to_owned());
        }
        let is_near = super::zenoh::is_loopback(&self.router);
        if self.enabled && !is_near && !insecure {
            return Err(format!(
                "the router of ROS 2 at {} is on another machine, and ROS 2 has no tokens: anyone who reaches it commands the \
                 robots; use --insecure, or run a router on this machine",
                self.router
            ));
        }
        if !self.enabled || !zenoh.enabled || !is_near {
            return Ok(());
        }
        match zenoh.listens_on().iter().find(|own| port(own) == port(&self.router)) {
            Some(own) => Err(format!(
                "the router of ROS 2 is at {}, and the daemon's own Zenoh is to listen at {own}: give it another place \
                 with --zenoh tcp/127.0.0.1:7448, or disable Zenoh with --zenoh off",
                self.router
            )),
            None => Ok(()),
        }
    }
}
