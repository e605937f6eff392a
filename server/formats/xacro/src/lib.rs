//! Expands xacro files to URDF without ROS and without Python.
//!
//! The supported subset covers common robots. Other features are refused as "not supported" with their file
//! and line, never ignored. Nothing is executed: a small evaluator of our own computes xacro's Python
//! expressions.
//!
//! A xacro file may be untrusted, and its result is sent to a daemon. So it may only read xacro and YAML
//! files of its package and of known packages, and no environment variables. Files, depth, steps and output
//! are bounded.
//!
//! * [`expand`]: expands a file to a URDF, and maps its lines back.

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

/// A URDF that was expanded from a xacro file.
#[derive(Clone, Debug)]
pub struct Expanded {
    /// The URDF, with each element on a separate line.
    pub urdf: String,
    /// Files that it was made from, in the order of their first use.
    pub files: Vec<PathBuf>,
    /// Output of `xacro.message` and `xacro.warning`.
    pub messages: Vec<String>,
    /// File, as an index, and line there, for each line of the URDF.
    pub(crate) lines: Vec<(usize, u32)>,
}

impl Expanded {
    /// Returns the file and line from which a line of the URDF, from 1, comes.
    pub fn source(&self, line: u32) -> Option<(&Path, u32)> {
        let (file, line) = self.lines.get(usize::try_from(line).ok()?.checked_sub(1)?)?;
        Some((self.files.get(*file)?, *line))
    }
}

/// Expands a file. Its includes are found like the files of a URDF. The values of `$(arg NAME)` come from
/// `arguments`, or from the file's defaults.
///
/// # Errors
/// Returns an error for files that cannot be read or understood, with file and line.
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

/// Runs an expansion on a thread with a stack for the deepest recursion that the [limits] allow. So neither
/// the caller's stack nor the compiler's optimisation matters.
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
