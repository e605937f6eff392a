//! Expands xacro files to URDF without ROS and without Python.
//!
//! What is understood is a subset that covers the robots people ship; the rest is refused as
//! "not supported" with its file and line, never passed over. Nothing is executed: the
//! expressions of Python that xacro has are read by a small evaluator of our own. A xacro
//! file may be untrusted and what it says is sent to a daemon, so it reads xacro and
//! YAML files of its own package and of known ones alone, and no variable of the environment.
//! Everything is bounded: files, depth, steps, and what comes out.
//!
//! * [`expand`]: from a file to a URDF, and from its lines back.

mod error;
mod evaluate;
mod expand;
mod expression;
mod functions;
mod limits;
mod macros;
mod pattern;
mod scope;
mod source;
#[cfg(test)]
mod tests;
mod text;
mod value;
mod write;
mod yaml;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use simd_assets::Locator;

pub use error::Error;

/// A URDF that was a xacro.
#[derive(Clone, Debug)]
pub struct Expanded {
    /// The URDF, with each element on a line of its own.
    pub urdf: String,
    /// The files that it was made of, the first asked for first.
    pub files: Vec<PathBuf>,
    /// What the files say by `xacro.message` and `xacro.warning`.
    pub messages: Vec<String>,
    /// For each line of the URDF the file, as an index, and the line there.
    pub(crate) lines: Vec<(usize, u32)>,
}

impl Expanded {
    /// Where a line of the URDF, from 1, comes from.
    pub fn source(&self, line: u32) -> Option<(&Path, u32)> {
        let (file, line) = self.lines.get(usize::try_from(line).ok()?.checked_sub(1)?)?;
        Some((self.files.get(*file)?, *line))
    }
}

/// Expands a file. What it includes is found as what a URDF names; `$(arg NAME)` is taken
/// from `arguments`, else from the file.
///
/// # Errors
/// What cannot be read or understood, with its file and line.
pub fn expand(
    path: &Path,
    arguments: &BTreeMap<String, String>,
    locator: &Locator,
) -> Result<Expanded, Error> {
    on_own_stack(|| expand::Expansion::new(locator, arguments).run(path))
}

/// Expands a text that includes nothing.
///
/// # Errors
/// As [`expand`]; `<xacro:include>` and `load_yaml` are refused.
pub fn expand_text(text: &str, arguments: &BTreeMap<String, String>) -> Result<Expanded, Error> {
    let nowhere = Locator::new(Path::new("/")).within(Path::new("/dev/null"));
    on_own_stack(|| expand::Expansion::new(&nowhere, arguments).run_text(text))
}

/// Runs an expansion on a thread whose stack holds the deepest recursion that the [limits] allow, whatever the caller's is
/// and however the compiler optimises.
fn on_own_stack(expand: impl FnOnce() -> Result<Expanded, Error> + Send) -> Result<Expanded, Error> {
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(limits::STACK_BYTES).spawn_scoped(scope, expand);
        let thread = thread.map_err(|error| Error {
            message: format!("no thread for the expansion can be started: {error}"),
            file: None,
            line: 0,
        })?;
        thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    })
}
