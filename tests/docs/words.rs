//! Old words of this project for things that have an established word, which must not come back: see the
//! glossary in `CONTRIBUTING.md`.

use std::fs;
use std::path::{Path, PathBuf};

use crate::root;

/// A word in lower case as it stands in prose and in identifiers (`nobody` in `lock_nobody_out` and in
/// `lockNobodyOut`), and its replacement. Then follow the files in which it means something else, each by the
/// end or the beginning of its path.
const WORDS: &[(&str, &str, &[&str])] = &[
    ("leftovers", "pending, unpublished", &[]),
    ("misfit", "invalid state", &[]),
    ("nobody", "no client, no daemon", &["tests/assets/make_assets.py"]),
    ("paper", "document", &[]),
    ("papers", "documents", &[]),
    ("patience", "timeout", &[]),
    // Frequencies in Hz, calls a second, and pictures have rates.
    (
        "rates",
        "velocities",
        &[
            "cli/src/commands/top",
            "client/python/benches/",
            "docs/sensors.md",
            "docs/simctl.md",
            "proto/simd/v1/simulation.proto",
            "server/model/src/urdf/tests/sensors.rs",
            "server/api/src/convert/from_proto/tests.rs",
            "server/src/embedded/publications.rs",
            "tests/benches/",
            "tests/reference/camera.py",
        ],
    ),
    ("roster", "registry", &[]),
    ("seat", "slot", &[]),
    ("seats", "slots", &[]),
    ("shelf", "cache", &[]),
    // insta compares texts with files of that name.
    ("snapshot", "published state, or saved state", &["tests/daemon/"]),
    ("snapshots", "published states, or saved states", &["tests/daemon/"]),
    ("somebody", "a client, another client", &[]),
    ("stranger", "untrusted client", &[]),
    ("strangers", "untrusted clients", &[]),
    ("surroundings", "the daemons of a network", &[]),
    ("told", "notified, reported", &[]),
    ("whoever", "the client that", &[]),
    ("writhe", "turn", &[]),
];

/// Identifiers as they stand; their single words are not specific enough.
const IDENTIFIERS: &[(&str, &str)] = &[
    ("_PUSHES", "_WRENCHES"),
    ("_pushes", "_wrenches"),
    ("Freedom", "JointType"),
    ("Hands", "PointerInteraction"),
    ("Noted", "what it is of"),
    ("Reasoned", "what it explains"),
    ("SayWho", "RecordCaller"),
    ("SixByFactors", "Ldlt6"),
    ("Touch", "ContactPoint, ContactReading"),
    ("Touches", "contact points"),
    ("begin_placing", "begin_position_update"),
    ("finish_placed", "finish_velocities, finish_with_split_velocities"),
    ("letGo", "endDrag"),
    ("place_links", "update_split_velocities"),
    ("push_step", "wrench_step"),
    ("push_steps", "wrench_steps"),
    ("pushes_at", "applies_wrench_at"),
    ("was_put", "teleported"),
];

/// Code and phrases as they stand, with words that have another meaning elsewhere: the beginnings of the
/// searched paths, and the replacement.
const PHRASES: &[(&str, &str, &str)] = &[
    ("", "[place -", "index"),
    ("", "[place]", "index"),
    ("server/core/src/dynamics/", "fn place", "update_positions"),
    ("server/core/src/dynamics/", ".place(", "update_positions"),
    ("", "angular rate", "angular velocity"),
    ("server/core/src/dynamics/", "rate", "velocity"),
    ("tests/physics/closed_forms/", "rate", "velocity"),
    ("tests/reference/solver_scenes.py", "rate", "velocity"),
    ("", "class Effort", "SolverOptions, or what it is of"),
    ("", "struct Effort", "SolverOptions, or what it is of"),
    ("server/core/src/dynamics/inverse_kinematics", "Effort", "SolverOptions"),
    ("server/", ".itself", "self_collision"),
    ("server/", "pub itself", "self_collision"),
    ("server/core/src/dynamics/", ".apart", "position correction, split impulse"),
    ("server/core/src/dynamics/", "pub apart", "position correction, split impulse"),
    ("server/core/src/dynamics/constraint/", ".part", "position correction, split impulse"),
    ("server/core/src/dynamics/constraint/", "pub part", "position correction, split impulse"),
    ("server/core/src/dynamics/", ".pushed", "position correction, split impulse"),
    ("server/core/src/dynamics/", "pub pushed", "position correction, split impulse"),
    ("", "# Pushes", "applied wrenches"),
    ("", "let pushes", "wrenches"),
    ("server/", ".pushes", "applied_wrenches"),
    ("server/", "pub pushes", "applied_wrenches"),
    ("server/core/src/", ".passed", "expired"),
    ("server/core/src/", "pub passed", "expired"),
    ("server/core/src/", ".waits", "suspended"),
    ("server/core/src/", "pub waits", "suspended"),
    ("server/core/src/", "self.merged", "ignored_overlaps"),
    ("server/core/src/", "pub merged", "ignored_overlaps"),
    ("server/core/src/collision/", "fn leave", "save_poses"),
    ("server/core/src/collision/", ".leave(", "save_poses"),
    ("server/core/src/collision/", "fn left", "saved poses, rest poses"),
    ("server/core/src/collision/", "pub left", "saved poses, rest poses"),
    ("server/core/src/collision/", ".left", "saved poses, rest poses"),
    ("server/core/src/", "Work", "BodyScratch"),
    ("server/core/src/dynamics/", "travel", "advance"),
    ("server/core/src/dynamics/", "travels", "advances"),
    ("", "setpoint travels", "setpoint advances"),
    ("server/core/src/dynamics/actuator.rs", "follow", "advance_setpoint, anti_windup"),
    ("server/world/src/fair_permits.rs", "turn", "permit, round robin"),
    ("server/world/src/fair_permits.rs", "turns", "permits, round robin"),
    ("", "class Limits", "what they limit"),
    ("", "interface Limits", "what they limit"),
    ("", "message Limits", "what they limit"),
    ("", "struct Limits", "what they limit"),
    ("", "type Limits", "what they limit"),
    ("", "Limits =", "what they limit"),
];

const ENDINGS: [&str; 12] =
    ["rs", "py", "pyi", "ts", "tsx", "js", "proto", "md", "toml", "css", "html", "wgsl"];

/// Folders of built, generated or found files, and of third parties: the ends of their paths, in whole names.
const SKIPPED: [&str; 8] = [
    "target",
    "node_modules",
    "dist",
    "client/python/src/simd_client/proto",
    "client/web/src/gen",
    "proto/src/generated",
    "tests/fuzz/corpus",
    "tests/out",
];

/// Returns the words of a text, with the text: runs of letters, and a capital after a small letter begins
/// another one.
fn words(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_ascii_alphabetic()).flat_map(|run| {
        let bytes = run.as_bytes();
        let is_start = |&at: &usize| {
            let (before, this) = (bytes[at - 1], bytes[at]);
            this.is_ascii_uppercase()
                && (before.is_ascii_lowercase() || bytes.get(at + 1).is_some_and(u8::is_ascii_lowercase))
        };
        let starts: Vec<usize> = std::iter::once(0).chain((1..run.len()).filter(is_start)).collect();
        let ends = starts.clone().into_iter().skip(1).chain([run.len()]);
        starts.into_iter().zip(ends).map(|(start, end)| &run[start..end]).collect::<Vec<_>>()
    })
}

/// Returns true if a line has a phrase, and not only as a part of longer names.
pub(crate) fn has_phrase(line: &str, phrase: &str) -> bool {
    let is_of_name = |c: char| c.is_ascii_alphanumeric() || c == '_';
    line.match_indices(phrase).any(|(at, _)| {
        let (before, after) = (&line[..at], &line[at + phrase.len()..]);
        let is_longer_before = phrase.starts_with(is_of_name) && before.ends_with(is_of_name);
        let is_longer_after = phrase.ends_with(is_of_name) && after.starts_with(is_of_name);
        !is_longer_before && !is_longer_after
    })
}

fn identifiers(text: &str) -> impl Iterator<Item = &str> {
    text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_')
}

/// Returns the faults of a file of this path, each as a line for people.
fn wrong(path: &str, text: &str) -> Vec<String> {
    let mut wrong = Vec::new();
    let is_allowed = |files: &[&str]| files.iter().any(|file| path.starts_with(file) || path.ends_with(file));
    for (number, line) in (1..).zip(text.lines()) {
        let mut say = |word: &str, better: &str| {
            wrong
                .push(format!("{path}:{number}: {word:?}; say {better}, or allow it in tests/docs/words.rs"));
        };
        for word in words(line) {
            let lower = word.to_ascii_lowercase();
            let found = WORDS.iter().find(|(private, _, _)| *private == lower);
            if let Some((_, better, files)) = found
                && !is_allowed(files)
            {
                say(word, better);
            }
        }
        for name in identifiers(line) {
            if let Some((_, better)) = IDENTIFIERS.iter().find(|(private, _)| *private == name) {
                say(name, better);
            }
        }
        for (area, phrase, better) in PHRASES {
            if path.starts_with(area) && has_phrase(line, phrase) {
                say(phrase, better);
            }
        }
    }
    wrong
}

pub(crate) fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap().map(Result::unwrap) {
        let (path, name) = (entry.path(), entry.file_name().to_string_lossy().into_owned());
        let kind = entry.file_type().unwrap();
        if kind.is_dir() {
            if !name.starts_with('.') && !SKIPPED.iter().any(|skipped| path.ends_with(skipped)) {
                files(&path, found);
            }
        } else if kind.is_file()
            && path.extension().is_some_and(|it| ENDINGS.iter().any(|known| it == *known))
        {
            found.push(path);
        }
    }
}

#[test]
fn no_private_word_of_before_comes_back() {
    let mut all = Vec::new();
    files(&root(), &mut all);
    assert!(all.len() > 500, "only {} files were found", all.len());
    for source in ["client/web/src/build/film.ts", "proto/generate/src/shapes.rs", "tests/corpus/main.rs"] {
        assert!(all.contains(&root().join(source)), "{source} was not searched");
    }
    // The history has old names, and this file the forbidden ones.
    let exceptions = ["CHANGELOG.md", "tests/docs/words.rs"];
    let found: Vec<String> = all
        .iter()
        .filter_map(|file| {
            let path = file.strip_prefix(root()).unwrap().to_str().unwrap().replace('\\', "/");
            let is_exception = exceptions.contains(&path.as_str());
            (!is_exception).then(|| wrong(&path, &String::from_utf8_lossy(&fs::read(file).unwrap())))
        })
        .flatten()
        .collect();
    assert!(found.is_empty(), "{found:#?}");
}

#[test]
fn words_are_found_in_prose_and_in_identifiers() {
    let of = |line: &str| wrong("server/src/a.rs", line).len();
    assert_eq!(of("// Whoever comes."), 1);
    assert_eq!(of("fn lock_nobody_out() {}"), 1);
    assert_eq!(of("const lockNobodyOut = HTTPSeat(1);"), 2);
    assert_eq!(of("struct Touch; let touch = values[place];"), 2);
    assert_eq!(of("let pirates = separate(&Touching, untold);"), 0, "parts of words are none");
    assert_eq!(of("struct Limits; struct LoadLimits; self.parts.leave();"), 1);
    assert_eq!(wrong("server/core/src/dynamics/actuator.rs", "self.travel(h); self.follow(h);").len(), 2);
    assert_eq!(wrong("server/core/src/dynamics/a.rs", "fn place(&self) { self.place_at(pose) }").len(), 1);
    assert_eq!(wrong("tests/daemon/a.rs", "insta::assert_snapshot!(name, text);").len(), 0);
}
