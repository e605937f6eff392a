//! Output of results: pages for people, JSON for programs.

pub(crate) mod json;
pub(crate) mod number;
pub(crate) mod table;

use std::{
    cell::RefCell,
    env,
    io::{self, IsTerminal as _, Write as _},
};

use clap::ValueEnum;
use serde::Serialize;
use simd_client::is_printable;

use table::Page;

/// Format of results.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    /// Aligned columns
    Table,
    /// One JSON document; for a watch, the same as jsonl
    Json,
    /// One JSON document per line
    Jsonl,
}

/// A result. Its serialisation is the interface of `-o json`: field names must not change.
pub(crate) trait View: Serialize {
    /// Returns the result as a page for people.
    fn page(&self) -> Page;
}

/// Writes results to stdout in the requested format.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Output {
    format: Format,
    colour: bool,
}

impl Output {
    pub(crate) fn new(format: Format) -> Self {
        Self { format, colour: has_colour(io::stdout().is_terminal()) }
    }

    /// Writes a single result.
    pub(crate) fn one(self, view: &impl View) -> anyhow::Result<()> {
        match self.format {
            Format::Table => self.write(&view.page().render(self.colour)),
            Format::Json => self.json(serde_json::to_string_pretty(view)?),
            Format::Jsonl => self.json(serde_json::to_string(view)?),
        }
    }

    /// Writes a list: an array in JSON, one item per line in JSON lines.
    pub(crate) fn list<T: Serialize>(
        self,
        items: &[T],
        page: impl FnOnce(&[T]) -> Page,
    ) -> anyhow::Result<()> {
        match self.format {
            Format::Table => self.write(&page(items).render(self.colour)),
            Format::Json => self.json(serde_json::to_string_pretty(items)?),
            Format::Jsonl => items.iter().try_for_each(|item| self.line(item)),
        }
    }

    /// Writes one item of an open series: one line in each format.
    pub(crate) fn item(self, view: &impl View) -> anyhow::Result<()> {
        match self.format {
            Format::Table => self.write(&view.page().render(self.colour)),
            Format::Json | Format::Jsonl => self.line(view),
        }
    }

    /// Writes a page only for people.
    pub(crate) fn remark(self, page: &Page) -> anyhow::Result<()> {
        match self.format {
            Format::Table => self.write(&page.render(self.colour)),
            Format::Json | Format::Jsonl => Ok(()),
        }
    }

    fn line(self, item: &impl Serialize) -> anyhow::Result<()> {
        self.json(serde_json::to_string(item)?)
    }

    fn json(self, document: String) -> anyhow::Result<()> {
        self.write(&format!("{}\n", shown(&document)))
    }

    /// Writes text unchanged.
    pub(crate) fn write(self, text: &str) -> anyhow::Result<()> {
        write_bytes(text.as_bytes())
    }
}

tokio::task_local! {
    static CAPTURED: RefCell<Vec<u8>>;
}

/// Runs work, and returns the text that it would write to stdout, with its warnings.
#[cfg(feature = "mcp")]
pub(crate) async fn captured<T>(work: impl Future<Output = T>) -> (T, String) {
    let work = async {
        let result = work.await;
        (result, CAPTURED.with(RefCell::take))
    };
    let (result, bytes) = CAPTURED.scope(RefCell::default(), work).await;
    (result, String::from_utf8_lossy(&bytes).into_owned())
}

/// Keeps bytes of captured work. Returns whether they are kept.
pub(crate) fn capture(bytes: &[u8]) -> bool {
    CAPTURED.try_with(|captured| captured.borrow_mut().extend_from_slice(bytes)).is_ok()
}

/// Writes at once and as a whole, since the reader may wait for each line.
pub(crate) fn write_bytes(bytes: &[u8]) -> anyhow::Result<()> {
    if capture(bytes) {
        return Ok(());
    }
    let mut stdout = io::stdout().lock();
    stdout.write_all(bytes)?;
    stdout.flush()?;
    Ok(())
}

/// Returns whether to colour output to a terminal: see no-color.org.
pub(crate) fn has_colour(is_terminal: bool) -> bool {
    let is_set = |variable| env::var_os(variable).is_some_and(|value| !value.is_empty());
    is_terminal && !is_set("NO_COLOR") && env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// Escapes characters in a document that a terminal would obey or hide, as `\u202e`: names come from
/// untrusted files. Such a character can only be within a text.
fn shown(json: &str) -> String {
    let mut clean = String::with_capacity(json.len());
    for c in json.chars() {
        if c == '\n' || is_printable(c) {
            clean.push(c);
        } else {
            clean.extend(c.encode_utf16(&mut [0; 2]).iter().map(|unit| format!("\\u{unit:04x}")));
        }
    }
    clean
}

#[cfg(test)]
mod tests {
    #[test]
    fn json_is_the_same_document_without_what_a_terminal_obeys() {
        let text = "a\u{202e}b\u{e0041}\u{7f}\n";
        let json = serde_json::to_string(text).unwrap();
        let shown = super::shown(&json);
        assert_eq!(shown, r#""a\u202eb\udb40\udc41\u007f\n""#);
        assert_eq!(serde_json::from_str::<String>(&shown).unwrap(), text);
    }
}
