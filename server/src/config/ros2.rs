//! What the operator can say about the node of ROS 2.

use simd_ros2::wire;

/// Where `rmw_zenohd` is found where nothing else is said.
const DEFAULT_ROUTER: &str = "tcp/localhost:7447";
/// Domains that ROS 2 has.
pub(super) const MAX_DOMAIN_ID: u32 = 232;
/// Messages of each topic a wall second, up to this.
pub(super) const MAX_RATE: f64 = 1_000.0;

/// Says that a build cannot do what is asked of it.
pub const NO_ROS2: &str = "this build of simd has no ROS 2: leave out the settings that enable it, or build simd with the \
                           feature `ros2`";

/// A node on a graph of ROS 2 whose middleware is `rmw_zenoh`.
#[derive(Clone, Debug, PartialEq)]
pub struct Ros2 {
    /// Whether there is one.
    pub enabled: bool,
    /// The router of the graph, as `tcp/HOST:PORT`.
    pub router: String,
    /// `ROS_DOMAIN_ID`.
    pub domain_id: u32,
    /// Before the names of topics and services: `/`, or `/lab`.
    pub namespace: String,
    /// Of the other nodes.
    pub distro: Distro,
    /// States a wall second at the most.
    pub rate: f64,
}

/// A distribution of ROS 2 that has `rmw_zenoh`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Distro {
    /// Has no type hashes.
    Humble,
    /// Has them, as all after it.
    Jazzy,
    /// 2025.
    Kilted,
    /// 2026.
    Lyrical,
    /// What comes next.
    Rolling,
}

impl Distro {
    /// As the configuration names them, in the order of the type.
    pub(super) const NAMES: [&str; 5] = ["humble", "jazzy", "kilted", "lyrical", "rolling"];
    const ALL: [Self; 5] = [Self::Humble, Self::Jazzy, Self::Kilted, Self::Lyrical, Self::Rolling];

    pub(super) fn name(self) -> &'static str {
        let of = Self::ALL.into_iter().zip(Self::NAMES).find(|(distro, _)| *distro == self);
        of.map_or("", |(_, name)| name)
    }

    pub(super) fn named(text: &str) -> Option<Self> {
        Self::ALL.into_iter().zip(Self::NAMES).find(|(_, name)| *name == text).map(|(distro, _)| distro)
    }

    /// Whether its keys have hashes of types.
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

    /// The daemon's own Zenoh cannot listen where the router does. And nodes have no tokens: a router of another machine has to be meant.
    pub(super) fn check(&self, zenoh: &super::Zenoh, insecure: bool) -> Result<(), String> {
        let port = |locator: &str| locator.rsplit_once(':').map(|(_, port)| port.to_owned());
        if self.enabled && cfg!(not(feature = "ros2")) {
            return Err(NO_ROS2.to_owned());
        }
        let is_near = super::zenoh::is_loopback(&self.router);
        if self.enabled && !is_near && !insecure {
            return Err(format!(
                "the router of ROS 2 at {} is on another machine, and ROS 2 has no tokens: anyone who reaches it commands the \
                 robots; say --insecure, or have a router on this machine",
                self.router
            ));
        }
        if !self.enabled || !zenoh.enabled || !is_near {
            return Ok(());
        }
        match zenoh.listens_on().iter().find(|own| port(own) == port(&self.router)) {
            Some(own) => Err(format!(
                "the router of ROS 2 is at {}, and the daemon's own Zenoh is to listen at {own}: give it another place \
                 with --zenoh tcp/127.0.0.1:7448, or do without by --zenoh off",
                self.router
            )),
            None => Ok(()),
        }
    }
}
