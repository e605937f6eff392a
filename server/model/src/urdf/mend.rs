//! Repairs malformed XML that other readers of robots accept, line by line: dashes in comments, a bare `&`,
//! repeated attributes, and undeclared prefixes.

use std::borrow::Cow;
use std::collections::HashSet;
use std::ops::Range;

use roxmltree::Error;

use super::findings::quoted;
use super::prescan::parse_xml;
use crate::limits::LoadLimits;

/// A repair of a line, from 1.
pub(crate) type Mended = (u32, String);

/// Notes of one file: more of them say nothing new.
const MAX_NOTES: usize = 20;

/// Maximum number of repairs of one file. A file that needs more is left to the parser, which refuses it.
const MAX_REPAIRS: usize = 10_000;

/// Returns the repaired text. Line numbers do not change. Attributes are counted before, so that comparing
/// them is bounded.
pub(crate) fn mended<'t>(text: Cow<'t, str>, notes: &mut Vec<Mended>) -> Cow<'t, str> {
    // A document with its own entities is refused anyway.
    if text.contains("<!DOCTYPE") {
        return text;
    }
    let mut mender = Mender { text: &text, at: 0, line: 1, edits: Vec::new(), notes: Vec::new() };
    mender.run();
    let Mender { edits, notes: new, .. } = mender;
    if edits.is_empty() {
        return text;
    }
    notes.extend(new);
    if edits.len() > MAX_REPAIRS {
        return text;
    }
    let mut out = String::with_capacity(text.len() + edits.len() * 4);
    let mut from = 0;
    for (range, instead) in edits {
        out.push_str(text.get(from..range.start).unwrap_or_default());
        out.push_str(&instead);
        from = range.end;
    }
    out.push_str(text.get(from..).unwrap_or_default());
    Cow::Owned(out)
}

/// Declares undeclared prefixes at the root, on the root's line.
pub(crate) fn bind_prefixes<'t>(
    text: Cow<'t, str>,
    limits: &LoadLimits,
    notes: &mut Vec<Mended>,
) -> Cow<'t, str> {
    const MAX: usize = 16;
    let mut text = text;
    for _ in 0..MAX {
        let (prefix, line) = match parse_xml(&text, limits) {
            Err(Error::UnknownNamespace(prefix, at)) if prefix.len() <= limits.name_bytes => (prefix, at.row),
            _ => break,
        };
        let Some(end) = root_name_end(&text) else { break };
        text.to_mut().insert_str(end, &format!(" xmlns:{prefix}=\"undeclared:{prefix}\""));
        notes.push((line, format!("the prefix {} is not declared; read as if it were", quoted(&prefix))));
    }
    text
}

/// Returns the end of the root's name.
fn root_name_end(text: &str) -> Option<usize> {
    let mut at = 0;
    loop {
        let open = at + text.get(at..)?.find('<')?;
        let tag = text.get(open..)?;
        let end = match tag {
            tag if tag.starts_with("<!--") => tag.find("-->")? + 3,
            tag if tag.starts_with("<?") => tag.find("?>")? + 2,
            tag => return Some(open + tag.find(|c: char| c.is_whitespace() || c == '>' || c == '/')?),
        };
        at = open + end;
    }
}

struct Mender<'t> {
    text: &'t str,
    at: usize,
    /// Line of `at`.
    line: u32,
    edits: Vec<(Range<usize>, Cow<'static, str>)>,
    notes: Vec<Mended>,
}

impl<'t> Mender<'t> {
    fn run(&mut self) {
        while let Some(open) = self.rest().find('<')
            && !self.is_full()
        {
            self.ampersands(self.at..self.at + open);
            self.go(open);
            let rest = self.rest();
            if rest.starts_with("<!--") {
                let Some(length) = rest.get(4..).and_then(|body| body.find("-->")) else { return };
                self.comment(self.at + 4..self.at + 4 + length);
                self.go(length + 7);
            } else if rest.starts_with("<![CDATA[") {
                let Some(length) = rest.find("]]>") else { return };
                self.go(length + 3);
            } else if rest.starts_with("<?") {
                let Some(length) = rest.find("?>") else { return };
                self.go(length + 2);
            } else if rest.starts_with("<!") {
                let Some(length) = rest.find('>') else { return };
                self.declaration(self.at..self.at + length + 1);
                self.go(length + 1);
            } else {
                self.tag();
            }
        }
    }

    fn rest(&self) -> &'t str {
        self.text.get(self.at..).unwrap_or_default()
    }

    fn go(&mut self, bytes: usize) {
        let passed = self.rest().get(..bytes).unwrap_or(self.rest());
        let lines = passed.bytes().filter(|byte| *byte == b'\n').count();
        self.line = self.line.saturating_add(u32::try_from(lines).unwrap_or(u32::MAX));
        self.at += passed.len();
    }

    fn is_full(&self) -> bool {
        self.edits.len() > MAX_REPAIRS
    }

    fn note(&mut self, message: String) {
        if self.notes.len() < MAX_NOTES {
            self.notes.push((self.line, message));
        }
    }

    /// Replaces two dashes in a comment by blanks, byte for byte.
    fn comment(&mut self, body: Range<usize>) {
        let text = self.text.get(body.clone()).unwrap_or_default();
        if !text.contains("--") && !text.ends_with('-') && !text.starts_with('>') {
            return;
        }
        self.edits.push((body, text.replace(['-', '>'], " ").into()));
        self.note("a comment has two dashes in it, which XML does not allow; left out".to_owned());
    }

    /// Blanks what begins like a comment and is none, line by line.
    fn declaration(&mut self, range: Range<usize>) {
        let text = self.text.get(range.clone()).unwrap_or_default();
        let blank: String = text.bytes().map(|byte| if byte == b'\n' { '\n' } else { ' ' }).collect();
        self.edits.push((range, blank.into()));
        self.note("`<!` begins neither a comment nor a text; left out up to the next `>`".to_owned());
    }

    /// Escapes an `&` that begins no reference.
    fn ampersands(&mut self, within: Range<usize>) {
        let text = self.text.get(within.clone()).unwrap_or_default();
        let mut bare = false;
        for (at, _) in text.match_indices('&') {
            if self.is_full() {
                break;
            }
            if !is_reference(text.get(at + 1..).unwrap_or_default()) {
                let at = within.start + at;
                self.edits.push((at..at + 1, "&amp;".into()));
                bare = true;
            }
        }
        if bare {
            self.note("an `&` begins no reference; read as if it were `&amp;`".to_owned());
        }
    }

    /// Reads a tag from its `<` to its `>`. The last of repeated attributes wins.
    fn tag(&mut self) {
        let mut attributes: Vec<(&str, Range<usize>)> = Vec::new();
        let (start, first) = (self.at, self.edits.len());
        let bytes = self.text.as_bytes();
        let mut at = start + 1;
        let mut begin: Option<usize> = None;
        let mut has_sign = false;
        loop {
            match bytes.get(at) {
                None => break,
                Some(b'>') => {
                    at += 1;
                    break;
                }
                // An unclosed tag: the parser reports it.
                Some(b'<') => break,
                Some(quote @ (b'"' | b'\'')) => {
                    let inner = bytes.get(at + 1..).unwrap_or_default();
                    let Some(length) = inner.iter().position(|byte| byte == quote) else { break };
                    self.ampersands(at + 1..at + 1 + length);
                    at += length + 2;
                    if let Some(begin) = begin.take() {
                        let name = self.text.get(begin..at).and_then(|text| text.split('=').next());
                        attributes.push((name.unwrap_or_default().trim(), begin..at));
                    }
                    continue;
                }
                Some(byte) if byte.is_ascii_whitespace() => {
                    let run = bytes.get(at..).unwrap_or_default();
                    at += run.iter().position(|byte| !byte.is_ascii_whitespace()).unwrap_or(run.len());
                    // Blanks may surround the sign.
                    if !has_sign && bytes.get(at) != Some(&b'=') {
                        begin = None;
                    }
                    continue;
                }
                Some(b'=') => has_sign = true,
                Some(_) if begin.is_none() => (begin, has_sign) = (Some(at), false),
                Some(_) => {}
            }
            at += 1;
        }
        let mut seen: HashSet<&str> = HashSet::new();
        for (name, range) in attributes.into_iter().rev() {
            if name.is_empty() || seen.insert(name) {
                continue;
            }
            let blank = |byte: u8| if byte == b'\n' { '\n' } else { ' ' };
            let spaces: String =
                self.text.get(range.clone()).unwrap_or_default().bytes().map(blank).collect();
            self.edits.push((range, spaces.into()));
            self.note(format!("the attribute {} is given twice; the last one counts", quoted(name)));
        }
        // In order. Repairs within a removed attribute are removed too.
        let mut own = self.edits.split_off(first);
        own.sort_by_key(|(range, _)| range.start);
        let mut end = start;
        own.retain(|(range, _)| {
            let is_free = range.start >= end;
            end = end.max(range.end);
            is_free
        });
        self.edits.append(&mut own);
        self.go(at - start);
    }
}

/// Returns whether a text continues like `amp;` or `#10;`.
fn is_reference(text: &str) -> bool {
    const LONGEST: usize = 12;
    let Some(end) = text.bytes().take(LONGEST).position(|byte| byte == b';') else { return false };
    let name = text.get(..end).unwrap_or_default();
    match name.strip_prefix('#') {
        Some(digits) => {
            let (digits, radix) = digits.strip_prefix('x').map_or((digits, 10), |digits| (digits, 16));
            u32::from_str_radix(digits, radix).ok().and_then(char::from_u32).is_some()
        }
        None => ["amp", "lt", "gt", "quot", "apos"].contains(&name),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(text: &str) -> (String, Vec<Mended>) {
        let mut notes = Vec::new();
        let text = mended(Cow::Borrowed(text), &mut notes);
        let limits = LoadLimits::default();
        let text = bind_prefixes(text, &limits, &mut notes).into_owned();
        assert!(parse_xml(&text, &limits).is_ok(), "{text}");
        (text, notes)
    }

    #[test]
    fn dashes_in_comments_are_blanks() {
        let (text, notes) = of("<a>\n<!-- --- arm --- -->\n<!---->\n<!-- b --->\n<!-- c-d --></a>");
        assert!(text.contains("arm") && text.contains("<!-- c-d -->"), "{text}");
        assert_eq!(notes.iter().map(|(line, _)| *line).collect::<Vec<_>>(), [2, 4]);
    }

    #[test]
    fn a_false_comment_is_left_out_up_to_its_end() {
        let (text, notes) = of("<a>\n<!-\\- jump\n and spin -\\-><b/><!é></a>");
        assert_eq!(text.split_whitespace().collect::<String>(), "<a><b/></a>");
        assert_eq!(text.matches('\n').count(), 2);
        assert_eq!(notes.iter().map(|(line, _)| *line).collect::<Vec<_>>(), [2, 3]);
    }

    #[test]
    fn a_bare_ampersand_stands_for_itself() {
        let (text, notes) = of("<a b=\"x & y &amp; &#65; &nbsp;\">1 & 2</a>");
        assert_eq!(text, "<a b=\"x &amp; y &amp; &#65; &amp;nbsp;\">1 &amp; 2</a>");
        assert_eq!(notes.len(), 2);
    }

    #[test]
    fn the_last_of_two_attributes_of_one_name_holds() {
        let (text, notes) = of("<a>\n<b n='1 & 2' m = \"3\"\n n=\"2\" m='4'/></a>");
        let document = roxmltree::Document::parse(&text).unwrap();
        let b = document.descendants().find(|node| node.has_tag_name("b")).unwrap();
        assert_eq!((b.attribute("n"), b.attribute("m")), (Some("2"), Some("4")));
        assert!(notes.iter().any(|(line, message)| *line == 2 && message.contains("\"n\" is given twice")));
        assert_eq!(text.matches('\n').count(), 2);
    }

    #[test]
    fn a_prefix_is_declared_where_it_is_not() {
        let (text, notes) = of("<?xml version='1.0'?><!-- <x> --><sdf>\n<a gz:b='1'/><p:c/></sdf>");
        assert!(text.contains("xmlns:gz") && text.contains("xmlns:p"), "{text}");
        assert_eq!(notes.len(), 2);
    }

    #[test]
    fn well_formed_documents_stay_unchanged() {
        let text = "<a><![CDATA[ & -- ]]><b c='<!-- not a comment'/></a>";
        let mut notes = Vec::new();
        let stays = mended(Cow::Borrowed(text), &mut notes);
        assert!(matches!(stays, Cow::Borrowed(_)) && notes.is_empty());
    }

    #[test]
    fn a_text_that_needs_more_repairs_than_any_file_is_left_to_the_parser() {
        let few = format!("<a>{}</a>", "&".repeat(MAX_REPAIRS));
        let many = format!("<a>{}</a>", "&".repeat(MAX_REPAIRS + 1));
        assert_ne!(mended(Cow::Borrowed(&few), &mut Vec::new()), few);
        assert_eq!(mended(Cow::Borrowed(&many), &mut Vec::new()), many);
    }

    #[test]
    fn broken_texts_end() {
        for text in
            ["<", "<!--", "<a b='", "<a b", "<![CDATA[", "<?", "<a <b", "&", "<a b='1' b='2'", "é<é=é'é"]
        {
            drop(mended(Cow::Borrowed(text), &mut Vec::new()));
        }
    }
}
