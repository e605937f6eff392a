//! The configuration file: TOML, and a key that is not known is a mistake.

use std::collections::BTreeMap;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::time::Duration;

use glamx::{DPose3, DQuat, DVec3, EulerRot};
use serde::Deserialize;
use simd_core::simulation::command::PhysicsChange;

use super::connections::ConnectionsTable;
use super::{Config, IntegratorName, Robot, TlsFiles, Zenoh};
use crate::handle::DaemonLimits;

/// All that a file can say; see `simd --help`.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct File {
    name: Option<String>,
    listen: Option<SocketAddr>,
    #[serde(default)]
    allow_hosts: Vec<String>,
    insecure: Option<bool>,
    tokens: Option<PathBuf>,
    tls: Option<TlsTable>,
    log: Option<String>,
    log_format: Option<String>,
    #[serde(default)]
    asset_roots: Vec<PathBuf>,
    paused: Option<bool>,
    #[serde(default)]
    zenoh: ZenohTable,
    #[serde(default)]
    physics: PhysicsTable,
    #[serde(default)]
    limits: LimitsTable,
    #[serde(default)]
    connections: ConnectionsTable,
    #[serde(default)]
    robots: Vec<RobotTable>,
}

/// What a description must stay within; see `docs/urdf.md`.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct LimitsTable {
    urdf_bytes: Option<usize>,
    xml_nodes: Option<u32>,
    xml_depth: Option<usize>,
    xml_attributes: Option<usize>,
    xml_namespaces: Option<usize>,
    name_bytes: Option<usize>,
    links: Option<usize>,
    shapes: Option<usize>,
    mesh_bytes: Option<usize>,
    mesh_triangles: Option<usize>,
    robot_triangles: Option<usize>,
    findings: Option<usize>,
    seconds: Option<f64>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct TlsTable {
    certificate: PathBuf,
    key: PathBuf,
    client_authorities: Option<PathBuf>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct ZenohTable {
    enabled: Option<bool>,
    listen: Option<Vec<String>>,
    connect: Option<Vec<String>>,
    config: Option<PathBuf>,
    state_rate: Option<f64>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct PhysicsTable {
    gravity: Option<[f64; 3]>,
    time_step: Option<f64>,
    substeps: Option<u32>,
    integrator: Option<IntegratorName>,
    real_time_factor: Option<f64>,
    as_fast_as_possible: Option<bool>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct RobotTable {
    path: PathBuf,
    #[serde(default)]
    name: String,
    #[serde(default)]
    xyz: [f64; 3],
    #[serde(default)]
    rpy: [f64; 3],
    fixed: Option<bool>,
    #[serde(default)]
    passive: bool,
    #[serde(default)]
    positions: BTreeMap<String, f64>,
    scale: Option<f64>,
    #[serde(default)]
    strict: bool,
}

/// Reads a file. The error is the rest of a sentence that begins with the file's name.
pub(super) fn read(path: &Path) -> Result<File, String> {
    let text = std::fs::read_to_string(path).map_err(|error| format!("cannot be read: {error}"))?;
    parse(&text)
}

pub(super) fn parse(text: &str) -> Result<File, String> {
    toml::from_str(text).map_err(|error| sentence(text, &error))
}

/// Line, key, and what is wrong with it.
fn sentence(text: &str, error: &toml::de::Error) -> String {
    let message = error.message().split_whitespace().collect::<Vec<_>>().join(" ");
    // Serde names Rust's types, which mean nothing to an operator.
    let message = message.replace("expected f64", "expected a number");
    let message = message.replace("expected u32", "expected a whole number, 0 or more");
    let Some(before) = error.span().and_then(|span| text.get(..span.start)) else {
        return message;
    };
    let number = before.matches('\n').count();
    let line = text.lines().nth(number).unwrap_or_default();
    match line.split_once('=').map(|(key, _)| key.trim()) {
        Some(key) if !message.contains(&format!("`{key}`")) => {
            format!("line {}: {key}: {message}", number + 1)
        }
        _ => format!("line {}: {message}", number + 1),
    }
}

impl File {
    /// Puts what the file says over the configuration. Relative paths begin at
    /// the file's folder. The error is the rest of a sentence, as in [`read`].
    pub(super) fn apply(self, path: &Path, config: &mut Config) -> Result<(), String> {
        let folder = path.parent().unwrap_or(Path::new("."));
        if let Some(listen) = self.listen {
            config.listen = listen;
        }
        if let Some(name) = self.name {
            config.change_name(name)?;
        }
        if let Some(log) = self.log {
            config.change_log(log)?;
        }
        if let Some(format) = self.log_format {
            config.log_format = super::log_format(&format)?;
        }
        self.zenoh.apply(folder, &mut config.zenoh)?;
        let PhysicsTable { gravity, time_step, substeps, integrator, real_time_factor, as_fast_as_possible } =
            self.physics;
        let (gravity, integrator) = (gravity.map(DVec3::from), integrator.map(Into::into));
        config.change_physics(PhysicsChange { gravity, time_step, substeps, integrator })?;
        config.change_pace(real_time_factor, as_fast_as_possible.unwrap_or(false))?;
        self.limits.apply(&mut config.limits)?;
        self.connections.apply(&mut config.connections)?;
        if self.paused == Some(true) {
            config.pause();
        }
        config.insecure |= self.insecure.unwrap_or(false);
        config.tokens = self.tokens.map(|tokens| folder.join(tokens));
        config.tls = self.tls.map(|tls| TlsFiles {
            certificate: folder.join(tls.certificate),
            key: folder.join(tls.key),
            client_authorities: tls.client_authorities.map(|path| folder.join(path)),
        });
        for name in self.allow_hosts {
            config.add_allowed_host(name)?;
        }
        for root in self.asset_roots {
            config.add_asset_root(folder.join(root))?;
        }
        for robot in self.robots {
            config.robots.push(robot.placed(folder)?);
        }
        Ok(())
    }
}

impl ZenohTable {
    fn apply(self, folder: &Path, zenoh: &mut Zenoh) -> Result<(), String> {
        if let Some(listen) = self.listen {
            zenoh.set_listen(listen)?;
        }
        if let Some(connect) = self.connect {
            zenoh.set_connect(connect)?;
        }
        if let Some(file) = self.config {
            zenoh.file = Some(folder.join(file));
        }
        if let Some(rate) = self.state_rate {
            zenoh.set_state_rate(rate)?;
        }
        if let Some(enabled) = self.enabled {
            zenoh.enabled = enabled;
        }
        Ok(())
    }
}

impl LimitsTable {
    fn apply(self, limits: &mut DaemonLimits) -> Result<(), String> {
        let reading = &mut limits.reading;
        let set = |limit: &mut usize, value: Option<usize>| *limit = value.unwrap_or(*limit);
        set(&mut reading.urdf_bytes, self.urdf_bytes);
        set(&mut reading.xml_depth, self.xml_depth);
        set(&mut reading.xml_attributes, self.xml_attributes);
        set(&mut reading.xml_namespaces, self.xml_namespaces);
        set(&mut reading.name_bytes, self.name_bytes);
        set(&mut reading.links, self.links);
        set(&mut reading.shapes, self.shapes);
        set(&mut reading.mesh_bytes, self.mesh_bytes);
        set(&mut reading.mesh_triangles, self.mesh_triangles);
        set(&mut reading.robot_triangles, self.robot_triangles);
        set(&mut reading.findings, self.findings);
        reading.xml_nodes = self.xml_nodes.unwrap_or(reading.xml_nodes);
        if let Some(seconds) = self.seconds {
            reading.time = Duration::try_from_secs_f64(seconds)
                .map_err(|_| format!("limits.seconds is {seconds}; it must be 0 or more, and finite"))?;
        }
        reading.check()?;
        // What a client may send, as the daemon says.
        if let Some(bytes) = self.urdf_bytes {
            limits.description_bytes = bytes as u64;
        }
        limits.asset_bytes = limits.asset_bytes.min(reading.mesh_bytes as u64);
        limits.links = u32::try_from(reading.links).unwrap_or(u32::MAX);
        Ok(())
    }
}

impl RobotTable {
    fn placed(self, folder: &Path) -> Result<Robot, String> {
        let numbers = self.xyz.iter().chain(&self.rpy).chain(self.positions.values()).chain(&self.scale);
        if let Some(number) = numbers.copied().find(|number| !number.is_finite()) {
            let path = self.path.display();
            return Err(format!("robot {path}: {number} in xyz, rpy, positions or scale; it must be finite"));
        }
        // URDF's rpy: about the fixed axes x, then y, then z.
        let [roll, pitch, yaw] = self.rpy;
        let rotation = DQuat::from_euler(EulerRot::ZYX, yaw, pitch, roll);
        Ok(Robot {
            path: folder.join(self.path),
            name: self.name,
            pose: DPose3::from_parts(DVec3::from(self.xyz), rotation),
            fixed: self.fixed,
            passive: self.passive,
            positions: self.positions,
            scale: self.scale.unwrap_or(1.0),
            strict: self.strict,
        })
    }
}
