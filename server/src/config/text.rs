//! The table of keys as text: the commented default file, the document, and the values in force with their
//! sources.

use std::fmt::Write as _;

use super::draft::Draft;
use super::file::ROBOT;
use super::key::Key;
use super::keys::{KEYS, TABLES};

/// Width of a comment, columns.
const WIDTH: usize = 118;

/// Returns a file with every key: a default is commented out with one `#`, an example with two.
pub(super) fn default_file() -> String {
    let mut text = String::from(
        "# The configuration of simd. A default is commented out with one #, an example with two. Relative paths begin at the\n\
         # folder of this file. Each key can also be set by a flag and an environment variable: simd --help.\n\n",
    );
    for (table, about) in TABLES {
        if !table.is_empty() {
            comment(&mut text, about);
            let mark = if table == "tls" { "##" } else { "#" };
            let _ = writeln!(text, "{mark}[{table}]");
        }
        for key in of_table(table) {
            let mut meaning = key.meaning.replace('`', "");
            if !key.is_switch() && key.takes() != "text" {
                let _ = write!(meaning, " ({})", key.takes());
            }
            comment(&mut text, &sentence(&meaning));
            let name = key.table_and_name().1;
            let _ = match key.value(&mut Draft::default()) {
                Some(value) => writeln!(text, "#{name} = {value}"),
                None => writeln!(text, "##{name} = {}", key.example),
            };
        }
        text.push('\n');
    }
    comment(&mut text, "A robot to load before the first step. Each further robot needs another [[robots]].");
    for line in ROBOT.lines() {
        let _ = writeln!(text, "##{line}");
    }
    text
}

/// Returns the same as tables of Markdown.
pub(super) fn document() -> String {
    let mut text = String::new();
    for (table, about) in TABLES {
        if !table.is_empty() {
            let _ = writeln!(text, "### `[{table}]`\n\n{about}\n");
        }
        let _ = writeln!(text, "| key | flag | takes | default | meaning |\n|---|---|---|---|---|");
        for key in of_table(table) {
            let flag = key.flag.map_or(String::new(), |flag| format!("`--{flag}`"));
            let default =
                key.value(&mut Draft::default()).map_or(String::new(), |value| format!("`{value}`"));
            let name = key.table_and_name().1;
            let _ = writeln!(text, "| `{name}` | {flag} | {} | {default} | {} |", key.takes(), key.meaning);
        }
        text.push('\n');
    }
    let _ =
        writeln!(text, "### `[[robots]]`\n\nRobots to load before the first step.\n\n```toml\n{ROBOT}```");
    text
}

/// Returns the values in force, as a file, with their sources.
pub(super) fn show(draft: &mut Draft) -> String {
    let mut text = String::new();
    for (table, _) in TABLES {
        let lines: Vec<String> = of_table(table)
            .filter_map(|key| {
                let value = key.value(draft)?;
                let said = draft.origin(key.path).map_or("default".into(), ToString::to_string);
                Some(format!("{} = {value}  # {said}", key.table_and_name().1))
            })
            .collect();
        if !table.is_empty() && !lines.is_empty() {
            let _ = writeln!(text, "\n[{table}]");
        }
        lines.iter().for_each(|line| text.extend([line, "\n"]));
    }
    for robot in &draft.config.robots {
        let _ =
            writeln!(text, "\n[[robots]]\npath = {}", super::key::quoted(&robot.path.display().to_string()));
    }
    text
}

fn of_table(table: &str) -> impl Iterator<Item = &'static Key> {
    KEYS.iter().filter(move |key| key.table_and_name().0 == table)
}

fn sentence(meaning: &str) -> String {
    let mut text = meaning.to_owned();
    if let Some(first) = text.get(..1).map(str::to_ascii_uppercase) {
        text.replace_range(..1, &first);
    }
    text
}

/// Writes lines of a comment, broken between words.
fn comment(text: &mut String, words: &str) {
    let mut line = String::from("#");
    for word in words.split_whitespace() {
        if line.len() + 1 + word.len() > WIDTH {
            let _ = writeln!(text, "{line}");
            line = String::from("#");
        }
        line.extend([" ", word]);
    }
    let _ = writeln!(text, "{line}");
}
