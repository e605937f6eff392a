//! Words for mistakes in arguments: the parser's own are for programmers.

use std::ffi::OsString;

use clap::Command;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use simd_client::without_error_numbers;

/// Returns the text of a refusal, for people who read it for the first time.
pub(crate) fn text(error: &clap::Error, command: &Command, typed: &[OsString], rendered: &str) -> String {
    match error.kind() {
        ErrorKind::ValueValidation => plain(rendered),
        ErrorKind::InvalidSubcommand => with_commands(error, command, typed, rendered),
        ErrorKind::UnknownArgument => with_options(command, typed, rendered),
        _ => rendered.to_owned(),
    }
}

/// Replaces words of Rust in a sentence.
pub(crate) fn plain(text: &str) -> String {
    const WORDS: [(&str, &str); 6] = [
        ("invalid digit found in string", "it must be a whole number, 0 or more"),
        ("cannot parse integer from empty string", "it must be a whole number"),
        ("number too large to fit in target type", "the number is too large"),
        ("number too small to fit in target type", "the number is too small"),
        ("invalid float literal", "it must be a number"),
        ("cannot parse float from empty string", "it must be a number"),
    ];
    let text = WORDS.iter().fold(text.to_owned(), |text, (rust, plain)| text.replace(rust, plain));
    without_error_numbers(&with_plain_range(&text).unwrap_or(text)).into_owned()
}

/// Returns the text with `it must be at least 1` in place of `0 is not in 1..18446744073709551615`.
fn with_plain_range(text: &str) -> Option<String> {
    let (before, after) = text.split_once(" is not in ")?;
    let begin = before.rfind(' ').map_or(0, |space| space + 1);
    let end = after.find(|c: char| !c.is_ascii_digit() && !"-.=".contains(c)).unwrap_or(after.len());
    let (least, most) = after[..end].split_once("..")?;
    let most: i128 = most.trim_start_matches('=').parse().ok()?;
    let ends = [i128::from(u64::MAX), i128::from(i64::MAX), i128::from(u32::MAX), i128::from(i32::MAX)];
    let rule = match ends.contains(&most) {
        true => format!("it must be at least {least}"),
        false => format!("it must be from {least} to {most}"),
    };
    Some(format!("{}{rule}{}", &before[..begin], &after[end..]))
}

/// Adds the commands that exist where an unknown one was typed, or the noun that has it as its verb.
fn with_commands(error: &clap::Error, command: &Command, typed: &[OsString], rendered: &str) -> String {
    let Some(ContextValue::String(unknown)) = error.get(ContextKind::InvalidSubcommand) else {
        return rendered.to_owned();
    };
    let parent = innermost(command, typed, unknown);
    let visible = |of: &Command| {
        let shown = of.get_subcommands().filter(|inner| !inner.is_hide_set() && inner.get_name() != "help");
        shown.map(|inner| inner.get_name().to_owned()).collect::<Vec<_>>()
    };
    let elsewhere = command.get_subcommands().filter(|noun| noun.get_name() != parent.get_name());
    let elsewhere = elsewhere.filter(|noun| visible(noun).contains(unknown));
    let elsewhere: Vec<_> = elsewhere.map(|noun| format!("'simctl {} {unknown}'", noun.get_name())).collect();
    let mut line = format!("  commands here: {}\n", visible(parent).join(", "));
    if !elsewhere.is_empty() {
        line += &format!("  elsewhere: {}\n", elsewhere.join(", "));
    }
    before_usage(rendered, &line)
}

/// Adds the options that exist where an unknown one was typed. The parser's tip to type `--` before it would
/// only lead to the next mistake.
fn with_options(command: &Command, typed: &[OsString], rendered: &str) -> String {
    let without_tip: String =
        rendered.split_inclusive('\n').filter(|line| !line.contains("as a value, use '")).collect();
    let without_tip = without_tip.replace("\n\n\n", "\n\n");
    let parent = innermost(command, typed, "");
    let own = parent.get_arguments().filter(|arg| !arg.is_hide_set() && !arg.is_global_set());
    let names: Vec<_> = own.filter_map(|arg| arg.get_long()).map(|name| format!("--{name}")).collect();
    match names.is_empty() {
        true => without_tip,
        false => before_usage(&without_tip, &format!("  options here: {}\n", names.join(", "))),
    }
}

fn before_usage(rendered: &str, line: &str) -> String {
    match rendered.find("Usage:").or_else(|| rendered.find("For more information")) {
        // A coloured word begins with a sequence of the terminal.
        Some(at) => {
            let at = rendered[..at].rfind('\n').map_or(0, |end| end + 1);
            format!("{}{line}\n{}", &rendered[..at], &rendered[at..])
        }
        None => format!("{rendered}{line}"),
    }
}

/// Returns the command that words lead to, up to an unknown one.
fn innermost<'c>(command: &'c Command, typed: &[OsString], unknown: &str) -> &'c Command {
    let words = typed.iter().skip(1).filter_map(|word| word.to_str());
    words.take_while(|word| *word != unknown).fold(command, |of, word| of.find_subcommand(word).unwrap_or(of))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_range_is_given_in_words() {
        for (rust, said) in [
            (
                "'0' for '[STEPS]': 0 is not in 1..18446744073709551615\n",
                "'0' for '[STEPS]': it must be at least 1\n",
            ),
            (
                "'-2' for '--substeps <N>': -2 is not in 0..=4294967295",
                "'-2' for '--substeps <N>': it must be at least 0",
            ),
            (
                "'1' for '--window <N>': 1 is not in 2..=100000",
                "'1' for '--window <N>': it must be from 2 to 100000",
            ),
            ("Rome is not in Spain", "Rome is not in Spain"),
        ] {
            assert_eq!(plain(rust), said);
        }
    }
}
