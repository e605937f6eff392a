//! A progress line on stderr, if it is a terminal.

use std::io::{self, IsTerminal as _, Write as _};

use simd_client::printable;
use simd_client::proto::{LoadPhase, LoadProgress};

/// The line, if it is shown.
#[derive(Debug, Default)]
pub(super) struct Progress {
    is_shown: bool,
}

impl Progress {
    /// Rewrites the line.
    pub(super) fn show(&mut self, progress: &LoadProgress) {
        let mut stderr = io::stderr().lock();
        if stderr.is_terminal() {
            self.is_shown = true;
            let _ = write!(stderr, "\r\x1b[K{}", sentence(progress)).and_then(|()| stderr.flush());
        }
    }

    /// Removes the line.
    pub(super) fn clear(&mut self) {
        if std::mem::take(&mut self.is_shown) {
            let mut stderr = io::stderr().lock();
            let _ = write!(stderr, "\r\x1b[K").and_then(|()| stderr.flush());
        }
    }
}

fn sentence(progress: &LoadProgress) -> String {
    let LoadProgress { done, total, ref uri, .. } = *progress;
    match progress.phase() {
        LoadPhase::Unspecified | LoadPhase::Waiting => "waits for other robots to be read".to_owned(),
        LoadPhase::Reading if uri.is_empty() => "reads the description".to_owned(),
        LoadPhase::Reading => format!("reads mesh {} of {total}: {}", done + 1, printable(uri)),
        LoadPhase::Hulls => "makes convex hulls of the collision meshes".to_owned(),
        LoadPhase::Spawning => "waits for the end of a step".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn progress_is_a_sentence_and_obeys_no_escape_sequence() {
        let reading = LoadPhase::Reading.into();
        let uri = "package://arm/\u{1b}[2J.stl".to_owned();
        let progress = LoadProgress { phase: reading, done: 2, total: 7, uri };
        assert_eq!(sentence(&progress), "reads mesh 3 of 7: package://arm/\\u{1b}[2J.stl");
        assert_eq!(sentence(&LoadProgress::default()), "waits for other robots to be read");
    }
}
