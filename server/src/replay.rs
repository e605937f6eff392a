//! `simd replay`: whether a recording comes to the same again, without a daemon and as fast as it goes.

use std::ffi::OsString;
use std::fs::File;
use std::io::BufReader;
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

use crate::recording::{self, Replayed};
use crate::subcommand;

/// One process, one world, stepped in real time.
#[derive(Debug, Parser)]
#[command(name = "simd", version)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Runs what was recorded again, without a daemon and as fast as it goes, and says whether each step is equal to the bit
    ///
    /// Exit codes: 0 equal, 1 not equal or damaged, 2 no recording or a mistake in the flags.
    Replay(Replay),
}

#[derive(Args, Debug)]
struct Replay {
    /// Files of recordings (.mcap)
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Begins with the last recorded world that is not after this simulated time, in seconds
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    from: Option<f64>,
}

fn seconds(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|seconds: &f64| seconds.is_finite()).ok_or("must be a number of seconds".into())
}

/// Does what the arguments ask for, where they ask for this: what to print, and the exit code.
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
    for file in &replay.files {
        let open = || File::open(file).map(BufReader::new);
        let replayed = runtime.block_on(recording::replay(open, replay.from));
        let replayed = replayed.map_err(|why| format!("simd: {}: {why}", file.display()))?;
        text += &format!("{}: {}\n", file.display(), sentence(&replayed));
        if replayed.difference.is_some() || replayed.damaged.is_some() {
            code = 1;
        }
    }
    Ok((text, code))
}

/// What it came to.
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
