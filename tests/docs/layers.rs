//! Modules import downwards only, in the order that the root of each crate lists. Crates without IO do none, and no
//! program is executed.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use crate::root;

/// A folder of sources and the modules in it, from the top to the bottom. Those of one line do not import
/// each other.
struct Layers {
    folder: &'static str,
    /// Prefix of its modules in an import, beside `super`.
    prefix: &'static str,
    lines: &'static [&'static [&'static str]],
}

const SERVER: Layers = Layers {
    folder: "server/src",
    prefix: "crate::",
    lines: &[
        &["embedded"],
        &["daemon"],
        &["grpc"],
        &["absent", "http", "ros2", "zenoh"],
        &["connect"],
        &["replay", "zenoh_acl"],
        &["config"],
        &["authority", "log"],
        &["subcommand"],
    ],
};

const API: Layers = Layers {
    folder: "server/api/src",
    prefix: "crate::",
    lines: &[&["service"], &["publication"], &["convert"]],
};

const WORLD: Layers = Layers {
    folder: "server/world/src",
    prefix: "crate::",
    lines: &[
        &["handle"],
        &["recording"],
        &["loading"],
        &["driver"],
        &["fair_permits", "unread_answers"],
        &["call_error"],
        &["access"],
        &["account", "blocking_threads", "histogram", "info", "process", "run_state"],
    ],
};

const CORE: Layers = Layers {
    folder: "server/core/src",
    prefix: "crate::",
    lines: &[&["rollout"], &["simulation"], &["collision"], &["dynamics"], &["plain", "pool", "valid"]],
};

const SIMULATION: Layers = Layers {
    folder: "server/core/src/simulation",
    prefix: "crate::simulation::",
    lines: &[
        &["operations"],
        &["event"],
        &["command"],
        &["spawn_overlaps"],
        &["measure", "queries", "terrain_penetration"],
        &["joint_status", "obstructions", "rays", "reactions"],
        &["published_state"],
        &["robot_settings", "saved"],
        &["group_memory"],
        &["contacts", "groups"],
        &["sleep"],
        &["constraints"],
        &["entity"],
        &["world_state"],
        &["sensors"],
        &[
            "check",
            "claim",
            "contact_settings",
            "free_place",
            "pull",
            "target_sources",
            "trajectory",
            "wrench",
        ],
        &["error", "moment", "settings"],
    ],
};

const COLLISION: Layers = Layers {
    folder: "server/core/src/collision",
    prefix: "crate::collision::",
    lines: &[
        &["fixed_pair"],
        &["clearance", "coarse_pairs", "feet", "narrow", "overlaps"],
        &["broad", "distance", "filter", "near_facets", "rays", "terrain"],
        &["colliders", "geometry", "scene"],
        &["shapes"],
        &["mesh"],
        &["proxy"],
        &["convex_mesh", "mesh_facets", "surface_contact"],
        &["facet_contact", "field_cast", "part"],
        &["clip", "seams", "separation", "still", "surface_distance"],
        &["bounds", "first_touch", "hull_support", "plane", "simplify", "triangle_tree"],
        &["convex_contact", "facets", "groups", "hull", "reduce", "triangle_pair"],
    ],
};

const DYNAMICS: Layers = Layers {
    folder: "server/core/src/dynamics",
    prefix: "crate::dynamics::",
    lines: &[
        &["lanes"],
        &["island"],
        &["direct"],
        &["articulation", "inverse_kinematics"],
        &["implicit_inertia", "inverse_dynamics", "jacobian", "single_bodies"],
        &["configuration", "constraint", "reactions", "velocity_terms"],
        &["articulated", "gains", "integrate", "link_damping", "link_motion", "mass_matrix", "tendon"],
        &["arcs", "gravity_compensation", "kinematics"],
        &["scratch"],
        &["ldlt"],
        &["spatials", "spherical"],
        &["lane", "spin", "tree"],
        &["actuator", "inertia"],
        &["block_cholesky", "integrator", "spatial", "symmetric", "trigonometry"],
        &["bullet"],
        &["contact_point", "member", "real"],
    ],
};

const MODEL: Layers = Layers {
    folder: "server/model/src",
    prefix: "crate::",
    lines: &[
        &["translate"],
        &["mjcf", "sdf"],
        &["translation"],
        &["primitive", "urdf"],
        &["inertia", "mesh"],
        &["assets"],
        &["report"],
        &["robot"],
        &["setup"],
        &["limits", "name", "number", "sensor"],
    ],
};

const CLI: Layers = Layers {
    folder: "cli/src",
    prefix: "crate::",
    lines: &[
        &["commands"],
        &["complete"],
        &["credentials"],
        &["context"],
        &["options"],
        &["candidates"],
        &["configuration"],
        &["failure"],
        &["typed"],
        &["mistakes", "output", "pose", "target", "text_file"],
        &["quantity"],
    ],
};

/// Paths that the code below a folder does not name, tests excepted.
const WITHOUT: [(&str, &[&str]); 5] = [
    (
        "server/core/src",
        &[
            "std::env",
            "std::fs",
            "std::net",
            "std::process",
            "std::thread",
            "time::Instant",
            "SystemTime",
            "tokio::",
        ],
    ),
    ("server/model/src", &["std::env", "std::fs", "std::net", "std::process", "std::thread", "tokio::"]),
    ("cli/src", &["process::Command"]),
    ("client", &["process::Command"]),
    ("server", &["process::Command"]),
];

impl Layers {
    /// Returns the number of a module's line.
    fn of(&self, module: &str) -> Option<usize> {
        self.lines.iter().position(|line| line.contains(&module))
    }

    /// Names that the root of the folder exports, each with its module.
    fn exported(&self) -> BTreeMap<String, String> {
        let folder = root().join(self.folder);
        let roots = ["mod.rs", "lib.rs"].map(|name| folder.join(name));
        let text = roots.iter().find_map(|root| fs::read_to_string(root).ok()).unwrap_or_default();
        let code = code(&text).collect::<Vec<_>>().join(" ");
        let mut exported = BTreeMap::new();
        for uses in code.split(';').filter_map(|item| item.split_once("pub use ")) {
            let path = uses.1.trim_start_matches("self::").trim_start_matches("crate::");
            let Some((module, names)) = path.split_once("::") else { continue };
            let names = names.rsplit("::").next().unwrap_or(names);
            for name in names.trim_matches(['{', '}', ' ']).split(',') {
                exported.insert(name.trim().to_owned(), module.to_owned());
            }
        }
        exported
    }

    /// Imports upwards, each as a line for people.
    fn wrong(&self) -> Vec<String> {
        let folder = root().join(self.folder);
        let exported = self.exported();
        let mut files = Vec::new();
        sources(&folder, &mut files);
        let mut wrong = Vec::new();
        let mut imports = 0;
        for file in files {
            let name = file.strip_prefix(&folder).unwrap().to_str().unwrap().replace('\\', "/");
            let module = name.split('/').next().unwrap().trim_end_matches(".rs");
            // Tests may join the layers that they test.
            if is_test(&name) || ["lib", "main", "mod"].contains(&module) {
                continue;
            }
            let own = self.of(module).unwrap_or_else(|| panic!("{name} is in no layer"));
            let text = fs::read_to_string(&file).unwrap();
            let code = code(&text).collect::<Vec<_>>().join("\n");
            // `super` of a file beside the module's root is that root; of a deeper one it is the module.
            let outside = if name.contains('/') { None } else { Some("super::") };
            for other in [Some(self.prefix), outside].into_iter().flatten().flat_map(|it| imported(&code, it))
            {
                let other = if other == "SimHandle" { "handle" } else { other };
                let other = exported.get(other).map_or(other, String::as_str);
                imports += 1;
                if other != module && self.of(other).is_some_and(|other| other <= own) {
                    wrong.push(format!("{}/{name} imports {other}", self.folder));
                }
                if self.folder.ends_with("simulation") && other == "Simulation" && module != "operations" {
                    wrong.push(format!("{}/{name} imports the world", self.folder));
                }
            }
        }
        assert!(imports > 20, "{} has {imports} imports", self.folder);
        wrong
    }
}

fn is_test(name: &str) -> bool {
    name.contains("tests") || name.contains("test_world")
}

/// Returns the lines of a source without comments and without its module of tests.
fn code(text: &str) -> impl Iterator<Item = &str> {
    let code = text.split("#[cfg(test)]\nmod tests {").next().unwrap_or_default();
    code.lines().filter(|line| !line.trim_start().starts_with("//"))
}

pub(crate) fn sources(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            let is_built = path.ends_with("target") || path.ends_with("node_modules");
            if !is_built {
                sources(&path, found);
            }
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// Names of modules in `use PREFIXa::b;`, in `use PREFIX{a, b::{c, d}};` and in `PREFIXa::b`.
fn imported<'a>(code: &'a str, prefix: &str) -> impl Iterator<Item = &'a str> {
    let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
    code.split(prefix).skip(1).flat_map(move |rest| {
        let names = rest.strip_prefix('{').map_or_else(|| vec![rest], outer_list);
        names.into_iter().map(move |name| name.split(|c| !is_word(c)).next().unwrap_or(name))
    })
}

/// The entries of a list up to its closing brace. Those of inner lists belong to their entry.
fn outer_list(rest: &str) -> Vec<&str> {
    let (mut depth, mut begin, mut entries) = (0, 0, Vec::new());
    for (at, c) in rest.char_indices() {
        match c {
            '{' => depth += 1,
            '}' if depth > 0 => depth -= 1,
            ',' | '}' if depth == 0 => {
                entries.push(rest[begin..at].trim_start());
                begin = at + 1;
                if c == '}' {
                    break;
                }
            }
            _ => {}
        }
    }
    entries
}

#[test]
fn modules_import_downwards_only() {
    let wrong: Vec<String> = [SERVER, API, WORLD, CORE, SIMULATION, COLLISION, DYNAMICS, MODEL, CLI]
        .iter()
        .flat_map(Layers::wrong)
        .collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn the_core_and_the_model_do_no_io_and_no_program_is_executed() {
    let mut wrong = Vec::new();
    for (folder, paths) in WITHOUT {
        let mut files = Vec::new();
        sources(&root().join(folder), &mut files);
        assert!(files.len() > 20, "{folder} has {} sources", files.len());
        for file in files {
            let name = file.strip_prefix(root()).unwrap().to_str().unwrap().replace('\\', "/");
            let text = fs::read_to_string(&file).unwrap();
            let named = |line: &str| paths.iter().find(|path| line.contains(**path)).copied();
            if !is_test(&name) {
                wrong.extend(code(&text).filter_map(named).map(|path| format!("{name} names {path}")));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}
