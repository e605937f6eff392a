//! `simd replay`: checks whether a recording repeats exactly, without a daemon and as fast as possible.

use std::ffi::OsString;
use std::fs::File;
use std::io::{BufReader, BufWriter, Write};
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use simd_assets::files;

use crate::subcommand;
use simd_world::recording::{self, Changes, Comparison, Replayed, Variation};

/// A headless robot physics daemon: replays
#[derive(Debug, Parser)]
#[command(name = "simd", version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Runs recordings again, without a daemon and as fast as possible, and checks that each step is equal to
    /// the bit
    ///
    /// Exit codes: 0 equal, 1 not equal or damaged, 2 not a recording, or a mistake in the flags.
    Replay(Replay),
}

#[derive(Args, Debug)]
struct Replay {
    /// Recording files (.mcap)
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Begins with the last recorded world up to this simulated time, in seconds
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    from: Option<f64>,
    /// Makes a second run with this change, and shows how joints differ: time_step, substeps, gravity,
    /// integrator, surface_combination, or ROBOT/JOINT. with stiffness, gain_damping, damping, friction,
    /// armature, gravity_compensation or profile
    #[arg(long = "set", value_name = "KEY=VALUE")]
    changes: Vec<String>,
    /// Writes the motion of joints in both runs as comma-separated values, a row every 10 ms
    #[arg(long, value_name = "FILE", requires = "changes")]
    csv: Option<PathBuf>,
}

fn seconds(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|seconds: &f64| seconds.is_finite()).ok_or("must be a number of seconds".into())
}

/// Runs the arguments if they begin with `replay`; returns the text to print and the exit code.
pub fn run(arguments: &[OsString]) -> Option<Result<(String, u8), String>> {
    let Command::Replay(replay) = match subcommand::read::<Arguments>("replay", arguments)? {
        Ok(arguments) => arguments.command,
        Err(said) => return Some(said.map(|text| (text, 0))),
    };
    Some(replay_all(&replay))
}

fn replay_all(replay: &Replay) -> Result<(String, u8), String> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build();
    let runtime = runtime.map_err(|error| format!("simd: {error}"))?;
    let (mut text, mut code) = (String::new(), 0);
    if replay.csv.is_some() && replay.files.len() > 1 {
        return Err("simd: --csv takes one recording".to_owned());
    }
    for file in &replay.files {
        let open = || files::open(file).map(BufReader::new);
        let variation = variation(replay).map_err(|why| format!("simd: {why}"))?;
        let replayed = runtime.block_on(recording::replay_beside(open, replay.from, variation));
        let replayed = replayed.map_err(|why| format!("simd: {}: {why}", file.display()))?;
        text += &format!("{}: {}\n", file.display(), sentence(&replayed));
        text += &replayed.comparison.as_ref().map(beside).unwrap_or_default();
        if replayed.difference.is_some() || replayed.damaged.is_some() {
            code = 1;
        }
    }
    Ok((text, code))
}

/// Returns the changes of the second run, and the destination of its table.
fn variation(replay: &Replay) -> Result<Variation, String> {
    let mut changes = Changes::default();
    replay.changes.iter().try_for_each(|text| changes.add(text))?;
    let table = match &replay.csv {
        Some(path) => {
            let is_recording = |file: &PathBuf| file.canonicalize().ok() == path.canonicalize().ok();
            if path.exists() && replay.files.iter().any(is_recording) {
                return Err(format!("{}: --csv would overwrite the recording", path.display()));
            }
            let file = File::create(path).map_err(|error| format!("{}: {error}", path.display()))?;
            Some(Box::new(BufWriter::new(file)) as Box<dyn Write>)
        }
        None => None,
    };
    Ok(Variation { changes, table })
}

/// Returns the comparison of the second run, a line for each joint.
fn beside(comparison: &Comparison) -> String {
    let Comparison { changes, rows, refused } = comparison;
    let mut text = format!("with {}, compared with the recording, in rad or m:\n", changes.join(", "));
    let names =
        rows.iter().map(|row| (row.robot.clone(), if row.joint.is_empty() { "(base)" } else { &row.joint }));
    let names: Vec<_> = names.collect();
    let width = |of: &dyn Fn(&(String, &str)) -> usize, title: usize| {
        names.iter().map(of).max().unwrap_or(0).max(title)
    };
    let (robots, joints) =
        (width(&|name| name.0.chars().count(), 5), width(&|name| name.1.chars().count(), 5));
    text += &format!(
        "{:robots$}  {:joints$}  {:>10}  {:>9}  {:>10}  {:>10}\n",
        "ROBOT", "JOINT", "LARGEST", "AT s", "AT THE END", "RMS"
    );
    for (row, (robot, joint)) in rows.iter().zip(&names) {
        text += &format!(
            "{robot:robots$}  {joint:joints$}  {:>10.3e}  {:>9.3}  {:>10.3e}  {:>10.3e}\n",
            row.largest,
            row.at,
            row.last,
            row.rms()
        );
    }
    if let Some(refused) = refused {
        text += &format!("A command that was applied when it was recorded is refused there: {refused}\n");
    }
    text
}

/// Returns a sentence with the result.
fn sentence(replayed: &Replayed) -> String {
    let Replayed { from, steps, commands, worlds, difference, ends_early, damaged, release, .. } = replayed;
    let counts = format!("{steps} steps, {commands} commands, {worlds} worlds from {from} s on");
    let mut sentence = match difference {
        None => format!("{counts}: equal"),
        Some(difference) => format!("{counts} are equal; {difference}"),
    };
    if difference.is_some() && release != env!("CARGO_PKG_VERSION") {
        sentence += &format!(" (it was made by simd {release}, and this is {})", env!("CARGO_PKG_VERSION"));
    }
    if let Some(early) = ends_early {
        sentence += &format!("; {early}");
    }
    if let Some(damaged) = damaged {
        sentence += &format!("; then it cannot be read: {damaged}");
    }
    sentence
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_does_not_overwrite_the_recording() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("run.mcap");
        std::fs::write(&file, "kept").unwrap();
        let replay = Replay {
            files: vec![file.clone()],
            from: None,
            changes: vec!["substeps=2".into()],
            csv: Some(
                directory.path().join("../").join(directory.path().file_name().unwrap()).join("run.mcap"),
            ),
        };
        let error = variation(&replay).err().unwrap();
        assert!(error.ends_with("--csv would overwrite the recording"), "{error}");
        assert_eq!(std::fs::read(&file).unwrap(), b"kept");
    }
}
