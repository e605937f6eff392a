//! The table of keys: all settings of the operator, except for the robots to load at the start.
//!
//! Within one layer, values are applied in the order of this table.

mod limits;
mod network;

use std::sync::LazyLock;

use glamx::DVec3;
use simd_core::simulation::SetpointProfiles;
use simd_core::simulation::command::PhysicsChange;
use simd_core::{BulletContacts, Integrator, SurfaceCombination};

use super::key::{Access, Key, MANY};
use crate::log::LogFormat;
use simd_world::driver::{MAX_SPIN_US, MAX_STEP_THREADS, Processors};
use simd_world::handle::{Pace, RunState};

/// All keys, in the order of the file.
pub(super) static KEYS: LazyLock<Vec<Key>> = LazyLock::new(|| {
    let keys = [daemon(), network::keys(), physics(), autosave(), realtime(), limits::keys(), recording()];
    keys.into_iter().flatten().collect()
});

/// Tables of the file, in order, each with its subject.
pub(super) const TABLES: [(&str, &str); 12] = [
    ("", ""),
    (
        "tls",
        "The certificate of gRPC, gRPC-Web and the page, as PEM. `simd tls init` makes one; SIGHUP reads it again.",
    ),
    ("zenoh", "Addresses and limits of the daemon on Zenoh."),
    ("ros2", "The daemon as a node of ROS 2 with the middleware `rmw_zenoh`: see ros2.md."),
    ("physics", "Settings of the world at its start."),
    (
        "autosave",
        "Saves the world to a file while it runs and when the daemon drains, so that a later start can \
         continue from there: see operations.md.",
    ),
    (
        "realtime",
        "Settings of the physics thread that the system must allow (Linux), and the number of threads of a \
         step. If the system refuses one, the log says so, and the daemon runs without it.",
    ),
    ("limits", "Limits of a description and its meshes: see urdf.md."),
    ("service", "Limits of the daemon's memory and of requests: see daemon.md."),
    (
        "clients",
        "Limits of one client, so that others have room. A client is the owner of a token. Without tokens it \
         is an IPv4 address, an IPv6 network of 64 bits, a session of Zenoh, or on the same machine a \
         connection. Its parameters, saved states and claims count while they exist.",
    ),
    ("recording", "Recordings of the world in files, which clients start and stop: see recording.md."),
    ("connections", "Connections of gRPC, gRPC-Web and the page: see daemon.md."),
];

pub(super) fn find(path: &str) -> Option<&'static Key> {
    KEYS.iter().find(|key| key.path == path)
}

fn daemon() -> Vec<Key> {
    vec![
        Key::new(
            "name",
            "name of the daemon on the network: 1 to 64 of `A-Z a-z 0-9 _ -`",
            Access::Text(|draft| draft.config.name.clone(), |draft, name| draft.config.change_name(name)),
        )
        .flag("name"),
        Key::new(
            "listen",
            "address of gRPC, gRPC-Web and the page; port 0 takes a free one. Another address than loopback needs \
             `tls` and `tokens`, or `insecure`",
            Access::Text(
                |draft| draft.config.listen.to_string(),
                |draft, listen| {
                    draft.config.listen = listen.parse().map_err(|_error| {
                        format!("listen is {listen:?}; it must be ADDRESS:PORT, for instance 127.0.0.1:7400")
                    })?;
                    Ok(())
                },
            ),
        )
        .flag("listen"),
        Key::new(
            "unix_socket",
            "Unix socket that serves the same without TLS, to processes of the daemon's user and group; left out: \
             none",
            Access::File(|draft| &mut draft.config.unix_socket),
        )
        .flag("unix-socket")
        .example("\"/run/simd/simd.sock\""),
        Key::new(
            "allow_hosts",
            "names by which browsers may address the daemon, in addition to addresses and localhost; names from all \
             sources are added",
            Access::Texts(
                |draft| draft.config.allow_hosts.clone(),
                |draft, names| {
                    names.into_iter().try_for_each(|name| draft.config.add_allowed_host(name))
                },
            ),
        )
        .flag("allow-host")
        .example("[\"lab.example\"]"),
        Key::new(
            "frame_ancestors",
            "origins of sites that may show the page in a frame, as notebooks and dashboards do",
            Access::Texts(
                |draft| draft.config.frame_ancestors.clone(),
                |draft, origins| draft.config.set_frame_ancestors(origins),
            ),
        )
        .example("[\"https://lab.example\", \"http://localhost:8888\"]"),
        Key::new(
            "insecure",
            "allows an address that others can reach without TLS and tokens: anyone who reaches the port commands \
             the robots",
            Access::Switch(|draft| draft.config.insecure, |draft, insecure| draft.config.insecure = insecure),
        )
        .flag("insecure"),
        Key::new(
            "tokens",
            "file of tokens, which `simctl token` writes; clients need one of them. It is read again when it \
             changes",
            Access::File(|draft| &mut draft.config.tokens),
        )
        .flag("tokens")
        .example("\"/var/lib/simd/tokens\""),
        Key::new(
            "log",
            "log level on stderr, or filters like `simd_server=debug`",
            Access::Text(|draft| draft.config.log.clone(), |draft, log| draft.config.change_log(log)),
        )
        .flag("log"),
        Key::new(
            "log_format",
            "format of the log: `text` for people, or `json` for programs: an object per line, with `timestamp`, \
             `level`, `target` and `fields`",
            Access::Word(
                &["text", "json"],
                |draft| match draft.config.log_format {
                    LogFormat::Text => "text",
                    LogFormat::Json => "json",
                },
                |draft, format| {
                    draft.config.log_format = if format == "json" { LogFormat::Json } else { LogFormat::Text };
                    Ok(())
                },
            ),
        )
        .flag("log-format"),
        Key::new(
            "asset_roots",
            "folders on this disk below which clients may name robots; folders from all sources are added",
            Access::Files(
                |draft| draft.config.asset_roots.clone(),
                |draft, roots| roots.into_iter().try_for_each(|root| draft.config.add_asset_root(root)),
            ),
        )
        .flag("asset-root"),
        Key::new(
            "paused",
            "whether the world starts paused",
            Access::Switch(
                |draft| draft.config.driver.state == RunState::Paused,
                |draft, paused| {
                    draft.config.driver.state = if paused { RunState::Paused } else { RunState::Playing };
                },
            ),
        )
        .flag("paused"),
    ]
}

fn physics() -> Vec<Key> {
    vec![
        Key::new(
            "physics.gravity",
            "gravity along the world's axes, m/s²",
            Access::Vector(
                |draft| draft.config.physics.gravity.to_array(),
                |draft, gravity| {
                    let gravity = Some(DVec3::from(gravity));
                    draft.config.change_physics(PhysicsChange { gravity, ..PhysicsChange::default() })
                },
            ),
        )
        .flag("gravity"),
        Key::new(
            "physics.time_step",
            "simulated time of a step, seconds",
            Access::Number(
                1e-6..=0.1,
                |draft| draft.config.physics.time_step,
                |draft, step| {
                    let time_step = Some(step);
                    draft.config.change_physics(PhysicsChange { time_step, ..PhysicsChange::default() })
                },
            ),
        )
        .flag("time-step"),
        Key::new(
            "physics.substeps",
            "number of substeps of a step",
            Access::Count(1..=1_000, |draft| &mut draft.config.physics.substeps),
        ),
        Key::new(
            "physics.integrator",
            "integrator of a step: a second-order one, MuJoCo's Euler, or Bullet's step; see physics.md",
            Access::Word(
                &["leapfrog", "euler", "bullet"],
                |draft| match draft.config.physics.integrator {
                    Integrator::Leapfrog => "leapfrog",
                    Integrator::Euler => "euler",
                    Integrator::Bullet(_) => "bullet",
                },
                |draft, name| {
                    let integrator = Some(match name.as_str() {
                        "euler" => Integrator::Euler,
                        "bullet" => Integrator::Bullet(BulletContacts::default()),
                        _ => Integrator::Leapfrog,
                    });
                    draft.config.change_physics(PhysicsChange { integrator, ..PhysicsChange::default() })
                },
            ),
        )
        .flag("integrator"),
        Key::new(
            "physics.surface_combination",
            "friction between two surfaces: the smaller value, the product as in Bullet, or the larger value as \
             in MuJoCo; see physics.md",
            Access::Word(
                &["min", "multiply", "max"],
                |draft| match draft.config.physics.surface_combination {
                    SurfaceCombination::Min => "min",
                    SurfaceCombination::Multiply => "multiply",
                    SurfaceCombination::Max => "max",
                },
                |draft, name| {
                    let surface_combination = Some(match name.as_str() {
                        "multiply" => SurfaceCombination::Multiply,
                        "max" => SurfaceCombination::Max,
                        _ => SurfaceCombination::Min,
                    });
                    draft.config.change_physics(PhysicsChange { surface_combination, ..PhysicsChange::default() })
                },
            ),
        )
        .flag("surface-combination"),
        Key::new(
            "physics.sleeping",
            "whether free bodies at rest sleep until something acts on them; see physics.md",
            Access::Switch(
                |draft| draft.config.physics.sleeping,
                |draft, sleeping| draft.config.physics.sleeping = sleeping,
            ),
        ),
        Key::new(
            "physics.setpoint_profiles",
            "joints of new robots whose setpoints follow a velocity profile: those without gains in their \
             description, all, or none; see physics.md",
            Access::Word(
                &["undescribed", "all", "none"],
                |draft| match draft.config.physics.setpoint_profiles {
                    SetpointProfiles::Undescribed => "undescribed",
                    SetpointProfiles::All => "all",
                    SetpointProfiles::None => "none",
                },
                |draft, name| {
                    draft.config.physics.setpoint_profiles = match name.as_str() {
                        "all" => SetpointProfiles::All,
                        "none" => SetpointProfiles::None,
                        _ => SetpointProfiles::Undescribed,
                    };
                    Ok(())
                },
            ),
        ),
        Key::new(
            "physics.real_time_factor",
            "simulated seconds per wall second",
            Access::Number(
                0.001..=1_000.0,
                |draft| draft.config.driver.pace.factor(),
                // A given factor implies real time, unless the same source says otherwise.
                |draft, factor| draft.config.change_pace(Pace::RealTime { factor }),
            ),
        )
        .flag("rtf"),
        Key::new(
            "physics.as_fast_as_possible",
            "whether steps follow each other without waiting",
            Access::Switch(
                |draft| matches!(draft.config.driver.pace, Pace::AsFastAsPossible { .. }),
                |draft, is_free| {
                    let factor = draft.config.driver.pace.factor();
                    draft.config.driver.pace = match is_free {
                        true => Pace::AsFastAsPossible { factor },
                        false => Pace::RealTime { factor },
                    };
                },
            ),
        )
        .flag("as-fast-as-possible"),
    ]
}

fn realtime() -> Vec<Key> {
    vec![
        Key::new(
            "realtime.priority",
            "real-time priority of the physics thread (`SCHED_FIFO`); 0 means none. The thread that sends its \
             answers has one less. Needs `CAP_SYS_NICE` or `LimitRTPRIO`; a unit of systemd gets it from \
             `realtime.conf`",
            Access::Count(0..=99, |draft| &mut draft.config.driver.real_time.priority),
        ),
        Key::new(
            "realtime.processors",
            "processors of the physics thread, by the system's numbers; list both threads of a core. The daemon's \
             other threads run on the remaining ones, if any. Left out: all threads run on all processors. A unit \
             of systemd needs `realtime.conf` for it",
            Access::Counts(
                0..=Processors::COUNT as u64 - 1,
                |draft| draft.config.driver.real_time.processors.numbers().collect(),
                |draft, numbers| {
                    draft.config.driver.real_time.processors = Processors::of(numbers);
                    Ok(())
                },
            ),
        )
        .example("[2, 3]"),
        Key::new(
            "realtime.threads",
            "number of threads of a step, including the physics thread; robots that do not touch each other \
             are shared among them. The other threads get its priority and processors, and keep their \
             processors busy during a step. 0: all of `processors`, else one less than the processors; at \
             most 4. With a priority and a thread for each processor, clients get no time while the pace is \
             `max`",
            Access::Count(0..=MAX_STEP_THREADS, |draft| &mut draft.config.driver.step_threads),
        ),
        Key::new(
            "realtime.lock_memory",
            "whether the memory of the process is never swapped out. Needs `CAP_IPC_LOCK` or `LimitMEMLOCK`; a \
             unit of systemd gets it from `realtime.conf`",
            Access::Switch(
                |draft| draft.config.driver.real_time.lock_memory,
                |draft, lock| draft.config.driver.real_time.lock_memory = lock,
            ),
        ),
        Key::new(
            "realtime.spin_us",
            "microseconds for which the physics thread polls for the next call or step, and a caller for its \
             answer, before they sleep. Calls then wake no thread, but a processor stays busy. 0: they sleep at \
             once",
            Access::Count(0..=MAX_SPIN_US, |draft| &mut draft.config.driver.spin_us),
        ),
    ]
}

fn autosave() -> Vec<Key> {
    vec![
        Key::new(
            "autosave.enabled",
            "whether the world is saved as it runs. A `file`, or `restore`, saves it too",
            Access::Switch(
                |draft| draft.autosave_enabled,
                |draft, is_enabled| draft.autosave_enabled = is_enabled,
            ),
        )
        .flag("autosave"),
        Key::new(
            "autosave.file",
            "file of the saved world, which is replaced as a whole. Left out: `NAME.simdstate` in \
             `$STATE_DIRECTORY`, as services have it, or in `$XDG_STATE_HOME/simd`, else in \
             `~/.local/state/simd`; the daemon makes the folder",
            Access::File(|draft| &mut draft.autosave_file),
        )
        .example("\"/var/lib/simd/autosave.simdstate\""),
        Key::new(
            "autosave.every_seconds",
            "time between two saves of a changed world; the daemon also saves at its end",
            Access::Seconds(0.1..=604_800.0, |draft| &mut draft.autosave_every),
        ),
        Key::new(
            "autosave.restore",
            "whether the daemon starts with the world in the file, if there is one, instead of the robots of its \
             configuration",
            Access::Switch(|draft| draft.autosave_restore, |draft, restore| draft.autosave_restore = restore),
        ),
    ]
}

fn recording() -> Vec<Key> {
    vec![
        Key::new(
            "recording.directory",
            "the folder where recordings are kept. Left out: `recordings` in `$STATE_DIRECTORY`, as services have it, or in \
             `$XDG_STATE_HOME/simd`, else in `~/.local/state/simd`; the first recording makes the folder",
            Access::File(|draft| &mut draft.config.recording.directory),
        )
        .flag("recordings")
        .example("\"/var/lib/simd/recordings\""),
        Key::new(
            "recording.max_bytes",
            "bytes of all recordings together",
            Access::Count(1 << 20..=MANY, |draft| &mut draft.config.recording.max_bytes),
        ),
        Key::new(
            "recording.picture_bytes",
            "bytes of recorded pictures of all cameras per second, before compression by the file; 0 disables \
             pictures",
            Access::Count(0..=1 << 32, |draft| &mut draft.config.recording.picture_bytes),
        ),
    ]
}
