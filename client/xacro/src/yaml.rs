//! The part of YAML that robots' configurations are written in: maps and lists by
//! indentation or in brackets, texts, numbers, and xacro's tags `!degrees` and `!radians`.
//!
//! No anchors and aliases (by which a short file becomes a huge one), no texts over several
//! lines, no second document: those are refused as not supported.

use std::rc::Rc;

use crate::error::{Fault, not_supported, shown};
use crate::limits;
use crate::value::{Value, float};

/// A line that says something.
struct Line<'t> {
    number: usize,
    indent: usize,
    text: &'t str,
}

/// The value of a file, and how many values are in it.
pub(crate) fn read(text: &str) -> Result<(Value, usize), Fault> {
    let mut lines = Vec::new();
    for (index, line) in text.strip_prefix('\u{feff}').unwrap_or(text).lines().enumerate() {
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
    let mut reader = Reader { lines, at: 0, values: 0 };
    let value = reader.block(0, 0)?;
    match reader.lines.get(reader.at) {
        None => Ok((value, reader.values)),
        Some(line) => Err(format!("line {}: the indentation fits nothing before it", line.number)),
    }
}

/// Up to a `#` that stands alone and in no quotes.
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

struct Reader<'t> {
    lines: Vec<Line<'t>>,
    at: usize,
    values: usize,
}

impl<'t> Reader<'t> {
    fn count(&mut self, number: usize) -> Result<(), Fault> {
        self.values += 1;
        if self.values > limits::ENTRIES {
            return Err(format!("line {number}: the file has more than {} values", limits::ENTRIES));
        }
        Ok(())
    }

    /// The lines from here that are indented by at least `indent`.
    fn block(&mut self, indent: usize, depth: usize) -> Result<Value, Fault> {
        let Some(first) = self.lines.get(self.at).filter(|line| line.indent >= indent) else {
            return Ok(Value::None);
        };
        let (number, indent, text) = (first.number, first.indent, first.text);
        if depth > limits::BRACKETS {
            return Err(format!("line {number}: nested deeper than {}", limits::BRACKETS));
        }
        if text == "-" || text.starts_with("- ") {
            return self.list(indent, depth);
        }
        if key_of(text).is_some() {
            return self.map(indent, depth);
        }
        self.at += 1;
        self.scalar(text, number)
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
            // What stands behind the dash begins a block of its own there.
            line.indent += line.text.len() - inner.len();
            line.text = inner;
            let inner_indent = line.indent;
            list.push(self.block(inner_indent, depth + 1)?);
        }
        Ok(Value::List(Rc::new(list)))
    }

    fn map(&mut self, indent: usize, depth: usize) -> Result<Value, Fault> {
        let mut map: Vec<(Value, Value)> = Vec::new();
        while let Some(line) = self.lines.get(self.at).filter(|line| line.indent == indent) {
            let (number, text) = (line.number, line.text);
            let Some((key, rest)) = key_of(text) else {
                return Err(format!("line {number}: {} has no `:`", shown(text)));
            };
            self.at += 1;
            let key = self.scalar(key.trim(), number)?;
            let value = if rest.is_empty() {
                // A list may stand under its key without indentation.
                let dashed =
                    |line: &&Line| line.indent == indent && (line.text == "-" || line.text.starts_with("- "));
                match self.lines.get(self.at).filter(dashed) {
                    Some(_) => self.list(indent, depth + 1)?,
                    None => self.block(indent + 1, depth + 1)?,
                }
            } else {
                self.flowing(rest, number)?
            };
            map.push((key, value));
        }
        Ok(Value::Map(Rc::new(map)))
    }

    /// A value on the key's line; brackets may go on over the next lines.
    fn flowing(&mut self, rest: &str, number: usize) -> Result<Value, Fault> {
        if !rest.starts_with(['[', '{']) {
            return self.scalar(rest, number);
        }
        let mut text = rest.to_owned();
        while !is_closed(&text) {
            let Some(line) = self.lines.get(self.at) else {
                return Err(format!("line {number}: {} has no closing bracket", shown(rest)));
            };
            text.push(' ');
            text.push_str(line.text);
            self.at += 1;
        }
        self.scalar(&text, number)
    }

    fn scalar(&mut self, text: &str, number: usize) -> Result<Value, Fault> {
        let mut flow = Flow { rest: text, number };
        let value = flow.value(self, 0, &[])?;
        if flow.rest.trim().is_empty() { Ok(value) } else { Err(flow.wrong()) }
    }
}

/// Whether all brackets are closed.
fn is_closed(text: &str) -> bool {
    let open = text.bytes().filter(|byte| matches!(byte, b'[' | b'{')).count();
    open <= text.bytes().filter(|byte| matches!(byte, b']' | b'}')).count()
}

/// A key and what stands behind its colon.
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

/// Values in brackets, or one.
struct Flow<'t> {
    rest: &'t str,
    number: usize,
}

impl Flow<'_> {
    fn wrong(&self) -> Fault {
        format!("line {}: {} is not understood", self.number, shown(self.rest.trim()))
    }

    fn take(&mut self, sign: char) -> bool {
        let rest = self.rest.trim_start();
        let after = rest.strip_prefix(sign);
        self.rest = after.unwrap_or(rest);
        after.is_some()
    }

    fn value(&mut self, reader: &mut Reader, depth: usize, ends: &[char]) -> Result<Value, Fault> {
        reader.count(self.number)?;
        if depth > limits::BRACKETS {
            return Err(format!("line {}: nested deeper than {}", self.number, limits::BRACKETS));
        }
        if self.take('[') {
            let mut list = Vec::new();
            while !self.take(']') {
                list.push(self.value(reader, depth + 1, &[',', ']'])?);
                if !self.take(',') && !self.rest.starts_with(']') {
                    return Err(self.wrong());
                }
            }
            return Ok(Value::List(Rc::new(list)));
        }
        if self.take('{') {
            let mut map = Vec::new();
            while !self.take('}') {
                let key = self.value(reader, depth + 1, &[':', ',', '}'])?;
                let value = match self.take(':') {
                    true => self.value(reader, depth + 1, &[',', '}'])?,
                    false => Value::None,
                };
                map.push((key, value));
                if !self.take(',') && !self.rest.starts_with('}') {
                    return Err(self.wrong());
                }
            }
            return Ok(Value::Map(Rc::new(map)));
        }
        self.plain(ends)
    }

    fn plain(&mut self, ends: &[char]) -> Result<Value, Fault> {
        let rest = self.rest.trim_start();
        if let Some(quote @ ('\'' | '"')) = rest.chars().next() {
            let inner = rest.get(1..).unwrap_or_default();
            let end = inner.find(quote).ok_or_else(|| self.wrong())?;
            let (text, after) = inner.split_at(end);
            if text.contains('\\') && quote == '"' {
                return Err(format!("line {}: {}", self.number, not_supported("escapes in YAML")));
            }
            self.rest = after.get(1..).unwrap_or_default();
            return Ok(Value::text(text));
        }
        let end = rest.find(ends).unwrap_or(rest.len());
        let (word, after) = rest.split_at(end);
        self.rest = after;
        let word = word.trim();
        let number = |text: &str| {
            float(text).ok_or_else(|| format!("line {}: {} is not a number", self.number, shown(text)))
        };
        if let Some((tag, text)) = word.strip_prefix('!').and_then(|word| word.split_once(' ')) {
            return match tag {
                "degrees" => Ok(Value::Float(number(text)?.to_radians())),
                "radians" => Ok(Value::Float(number(text)?)),
                _ => Err(format!("line {}: {}", self.number, not_supported(&format!("the tag !{tag}")))),
            };
        }
        if word.starts_with(['&', '*', '|', '>', '!', '`', '@']) || word == "<<" {
            return Err(format!(
                "line {}: {}",
                self.number,
                not_supported(&format!("{} in YAML", shown(word)))
            ));
        }
        Ok(match word {
            "" | "~" | "null" | "Null" => Value::None,
            "true" | "True" | "TRUE" | "yes" | "Yes" | "on" => Value::Bool(true),
            "false" | "False" | "FALSE" | "no" | "No" | "off" => Value::Bool(false),
            ".inf" => Value::Float(f64::INFINITY),
            "-.inf" => Value::Float(f64::NEG_INFINITY),
            ".nan" => Value::Float(f64::NAN),
            word => match word.parse() {
                Ok(int) => Value::Int(int),
                Err(_) if word.starts_with(|c: char| c.is_ascii_digit() || "+-.".contains(c)) => {
                    float(word).map_or_else(|| Value::text(word), Value::Float)
                }
                Err(_) => Value::text(word),
            },
        })
    }
}
