//! Commands and their output, as one text for an insta test.

use simd_tests::process::{Process, Said};

/// Lines as a terminal shows them.
#[derive(Debug, Default)]
pub(crate) struct Transcript(String);

impl Transcript {
    /// Adds the result of a line, with the exit code if it is not 0.
    pub(crate) fn add(&mut self, line: &str, said: &Said) {
        self.0 += &format!("$ {line}\n{}{}", said.out, said.err);
        if said.code != 0 {
            self.0 += &format!("(exit code {})\n", said.code);
        }
    }

    /// Runs each line for a daemon, beginning in the repository's folder.
    pub(crate) async fn of(daemon: &Process, lines: &[&str]) -> Self {
        let mut transcript = Self::default();
        for line in lines {
            let said = daemon.shell(line, &simd_tests::process::repository()).await;
            assert!(!said.out.contains('\x1b') && !said.err.contains('\x1b'), "a pipe has no colour: {line}");
            transcript.add(line, &said);
        }
        transcript
    }

    pub(crate) fn text(&self) -> &str {
        &self.0
    }
}

/// Compares with `snapshots/NAME.snap`; `INSTA_UPDATE=always` writes it. Values that differ from run to run
/// everywhere, such as ports, are replaced; `filters` replace more.
pub(crate) fn assert_snapshot(name: &str, text: &str, filters: &[(&str, &str)]) {
    let mut settings = insta::Settings::clone_current();
    settings.set_prepend_module_to_snapshot(false);
    settings.set_omit_expression(true);
    settings.add_filter(r"127\.0\.0\.1:\d+", "127.0.0.1:[PORT]");
    settings.add_filter(r"/tmp/\.tmp\w+", "[TMP]");
    settings.add_filter(r"connection \d+", "connection [N]");
    for (pattern, replacement) in filters {
        settings.add_filter(pattern, *replacement);
    }
    settings.bind(|| insta::assert_snapshot!(name, text));
}
