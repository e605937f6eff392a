//! The part of YAML that robots' configurations use: maps and lists by indentation or in brackets, texts,
//! numbers, anchors and aliases, and xacro's unit tags.
//!
//! The values of an alias are counted each time, so that no short file becomes a huge one. A second document
//! is refused.

mod flow;

use std::collections::HashMap;
use std::rc::Rc;

use self::flow::{Flow, is_closed};
use crate::error::{Fault, not_supported, shown};
use crate::limits;
use crate::value::{Value, find, put};

/// Computes the number after a unit tag.
pub(crate) type Evaluate<'e> = dyn FnMut(&str) -> Result<f64, Fault> + 'e;

/// A line with content.
struct Line<'t> {
    number: usize,
    indent: usize,
    text: &'t str,
}

/// Returns the value of a file, and the number of values in it.
pub(crate) fn read(text: &str, evaluate: &mut Evaluate) -> Result<(Value, usize), Fault> {
    let raw: Vec<&str> = text.strip_prefix('\u{feff}').unwrap_or(text).lines().collect();
    let mut lines = Vec::new();
    for (index, line) in raw.iter().enumerate() {
        let number = index + 1;
        let content = without_comment(line).trim_end();
        let text = content.trim_start_matches(' ');
        if text.is_empty() || (text == "---" && lines.is_empty()) || text.starts_with('%') {
            continue;
        }
        if text.starts_with('\t') {
            return Err(format!("line {number}: YAML is not indented by tabs"));
        }
        if text == "---" || text == "..." {
            return Err(format!("line {number}: {}", not_supported("a second document in a YAML file")));
        }
        lines.push(Line { number, indent: content.len() - text.len(), text });
    }
    let mut reader = Reader { raw, lines, at: 0, values: 0, anchors: HashMap::new(), evaluate };
    let value = reader.block(0, 0)?;
    match reader.lines.get(reader.at) {
        None => Ok((value, reader.values)),
        Some(line) => Err(format!("line {}: the indentation fits nothing before it", line.number)),
    }
}

/// Returns the part of a line before a comment: a `#` after a blank and outside of quotes.
fn without_comment(line: &str) -> &str {
    let mut quote = None;
    let mut before = ' ';
    for (at, c) in line.char_indices() {
        match quote {
            Some(open) if c == open => quote = None,
            Some(_) => {}
            None if c == '#' && before.is_whitespace() => return line.get(..at).unwrap_or(line),
            // Within a word a quote is an apostrophe.
            None if matches!(c, '\'' | '"') && !before.is_alphanumeric() => quote = Some(c),
            None => {}
        }
        before = c;
    }
    line
}

struct Reader<'t, 'e> {
    /// All lines, unchanged.
    raw: Vec<&'t str>,
    lines: Vec<Line<'t>>,
    at: usize,
    values: usize,
    /// Values by the names of their anchors, each with the number of its values.
    anchors: HashMap<String, (Value, usize)>,
    evaluate: &'e mut Evaluate<'e>,
}

impl<'t> Reader<'t, '_> {
    fn count(&mut self, values: usize, number: usize) -> Result<(), Fault> {
        self.values = self.values.saturating_add(values);
        if self.values > limits::ENTRIES {
            return Err(format!("line {number}: the file has more than {} values", limits::ENTRIES));
        }
        Ok(())
    }

    /// Parses the lines from here that are indented by at least `indent`.
    fn block(&mut self, indent: usize, depth: usize) -> Result<Value, Fault> {
        let Some(first) = self.lines.get(self.at).filter(|line| line.indent >= indent) else {
            return Ok(Value::None);
        };
        let (number, indent, text) = (first.number, first.indent, first.text);
        if depth > limits::BRACKETS {
            return Err(format!("line {number}: nested deeper than {}", limits::BRACKETS));
        }
        if let Some((name, rest)) = anchor(text) {
            let before = self.values;
            match self.lines.get_mut(self.at) {
                Some(line) if !rest.is_empty() => {
                    line.indent += text.len() - rest.len();
                    line.text = rest;
                }
                _ => self.at += 1,
            }
            let value = self.block(indent, depth + 1)?;
            self.keep(name, &value, before);
            return Ok(value);
        }
        if text == "-" || text.starts_with("- ") {
            return self.list(indent, depth);
        }
        if key_of(text).is_some() {
            return self.map(indent, depth);
        }
        self.at += 1;
        self.flowing(text, number, indent.saturating_sub(1))
    }

    /// Keeps a value under the name of its anchor.
    fn keep(&mut self, name: &str, value: &Value, before: usize) {
        self.anchors.insert(name.to_owned(), (value.clone(), self.values.saturating_sub(before).max(1)));
    }

    /// Returns the value of an alias.
    fn alias(&mut self, name: &str, number: usize) -> Result<Value, Fault> {
        let found = self.anchors.get(name).cloned();
        let (value, size) =
            found.ok_or_else(|| format!("line {number}: no anchor is named {}", shown(name)))?;
        self.count(size, number)?;
        Ok(value)
    }

    fn list(&mut self, indent: usize, depth: usize) -> Result<Value, Fault> {
        let mut list = Vec::new();
        while let Some(line) = self.lines.get_mut(self.at).filter(|line| line.indent == indent) {
            let Some(rest) =
                line.text.strip_prefix('-').filter(|rest| rest.is_empty() || rest.starts_with(' '))
            else {
                break;
            };
            let inner = rest.trim_start();
            if inner.is_empty() {
                self.at += 1;
                list.push(self.block(indent + 1, depth + 1)?);
                continue;
            }
            // The content after the dash begins a separate block at its own column.
            line.indent += line.text.len() - inner.len();
            line.text = inner;
            let inner_indent = line.indent;
            list.push(self.block(inner_indent, depth + 1)?);
        }
        Ok(Value::List(Rc::new(list)))
    }

    fn map(&mut self, indent: usize, depth: usize) -> Result<Value, Fault> {
        let mut map: Vec<(Value, Value)> = Vec::new();
        let mut merged = Vec::new();
        while let Some(line) = self.lines.get(self.at).filter(|line| line.indent == indent) {
            let (number, text) = (line.number, line.text);
            let Some((key, rest)) = key_of(text) else {
                return Err(format!("line {number}: {} has no `:`", shown(text)));
            };
            self.at += 1;
            let key = self.scalar(key.trim(), number)?;
            let before = self.values;
            let (name, rest) = anchor(rest).map_or((None, rest), |(name, rest)| (Some(name), rest));
            let value = if rest.is_empty() {
                // A list may be below its key without indentation.
                let dashed =
                    |line: &&Line| line.indent == indent && (line.text == "-" || line.text.starts_with("- "));
                match self.lines.get(self.at).filter(dashed) {
                    Some(_) => self.list(indent, depth + 1)?,
                    None => self.block(indent + 1, depth + 1)?,
                }
            } else {
                self.flowing(rest, number, indent)?
            };
            if let Some(name) = name {
                self.keep(name, &value, before);
            }
            match &key {
                Value::Text(key) if &**key == "<<" => merged.push(value),
                // The last value of a repeated key counts.
                _ => put(&mut map, key, value),
            }
        }
        for value in merged {
            merge(&mut map, &value);
        }
        Ok(Value::Map(Rc::new(map)))
    }

    /// Parses a value on the key's line; brackets, quotes and texts may continue on the next lines.
    fn flowing(&mut self, rest: &str, number: usize, indent: usize) -> Result<Value, Fault> {
        if rest.starts_with(['|', '>']) {
            return self.block_text(rest, number, indent);
        }
        let mut text = rest.to_owned();
        let is_open = rest.starts_with(['[', '{', '"', '\'']);
        loop {
            let line = self.lines.get(self.at);
            let goes_on = match is_open {
                true => !is_closed(&text),
                // A plain text continues if the line is indented and begins nothing else.
                false => line.is_some_and(|line| line.indent > indent && key_of(line.text).is_none()),
            };
            match line {
                _ if !goes_on => return self.scalar(&text, number),
                None if rest.starts_with(['[', '{']) => {
                    return Err(format!("line {number}: {} has no closing bracket", shown(rest)));
                }
                None => return Err(format!("line {number}: {} has no closing quote", shown(rest))),
                Some(line) => {
                    text.push(' ');
                    text.push_str(line.text);
                    self.at += 1;
                }
            }
        }
    }

    /// Parses a text after `|` or `>`: all lines that are indented deeper.
    fn block_text(&mut self, head: &str, number: usize, indent: usize) -> Result<Value, Fault> {
        let is_folded = head.starts_with('>');
        let chomping = head.get(1..).unwrap_or_default();
        if !matches!(chomping, "" | "-" | "+") {
            return Err(format!("line {number}: {}", not_supported(&format!("{} in YAML", shown(head)))));
        }
        self.count(1, number)?;
        let width = |line: &str| line.len() - line.trim_start_matches(' ').len();
        let behind = self.raw.get(number..).unwrap_or_default();
        let inner = behind.iter().find(|line| !line.trim().is_empty()).map_or(0, |line| width(line));
        let length = match inner > indent {
            true => behind
                .iter()
                .position(|line| !line.trim().is_empty() && width(line) < inner)
                .unwrap_or(behind.len()),
            false => 0,
        };
        let lines: Vec<&str> =
            behind.iter().take(length).map(|line| line.get(inner..).unwrap_or_default()).collect();
        while self.lines.get(self.at).is_some_and(|line| line.number <= number + length) {
            self.at += 1;
        }
        let mut text = String::new();
        for (index, line) in lines.iter().enumerate() {
            let next = lines.get(index + 1);
            text.push_str(line);
            let is_word = |line: &&&str| !line.is_empty() && !line.starts_with(' ');
            let joins = is_folded && is_word(&line) && next.as_ref().is_some_and(is_word);
            text.push(if joins { ' ' } else { '\n' });
        }
        let kept = text.trim_end_matches('\n').len();
        match chomping {
            "-" => text.truncate(kept),
            "+" => {}
            _ => text.truncate(text.len().min(kept + 1)),
        }
        Ok(Value::text(&text))
    }

    fn scalar(&mut self, text: &str, number: usize) -> Result<Value, Fault> {
        let mut flow = Flow { rest: text, number };
        let value = flow.value(self, 0, &[])?;
        if flow.rest.trim().is_empty() { Ok(value) } else { Err(flow.wrong()) }
    }
}

/// Returns `name` of `&name`, and the text after it.
fn anchor(text: &str) -> Option<(&str, &str)> {
    let (name, rest) = text.strip_prefix('&')?.split_once(' ').unwrap_or((text.get(1..)?, ""));
    (!name.is_empty()).then_some((name, rest.trim_start()))
}

/// Merges the entries of `<<` that the map lacks.
fn merge(map: &mut Vec<(Value, Value)>, from: &Value) {
    match from {
        Value::Map(other) => {
            for (key, value) in other.iter() {
                if find(map, key).is_none() {
                    map.push((key.clone(), value.clone()));
                }
            }
        }
        Value::List(all) => {
            for from in all.iter().filter(|from| matches!(from, Value::Map(_))) {
                merge(map, from);
            }
        }
        _ => {}
    }
}

/// Returns a key and the text after its colon.
fn key_of(text: &str) -> Option<(&str, &str)> {
    if text.starts_with(['[', '{']) {
        return None;
    }
    let from = match text.chars().next() {
        Some(quote @ ('\'' | '"')) => text.get(1..)?.find(quote)? + 2,
        _ => 0,
    };
    let colon = text.get(from..)?.match_indices(':').find(|(at, _)| {
        let after = text.get(from + at + 1..).unwrap_or_default();
        after.is_empty() || after.starts_with(' ')
    });
    let at = from + colon?.0;
    Some((text.get(..at)?, text.get(at + 1..)?.trim()))
}
