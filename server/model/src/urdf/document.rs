//! What is wrong around a document, and mended in its text before it is parsed:
//! where its declaration stands, what follows its root, prefixes that it does
//! not declare. Lines stay where they are.

use std::borrow::Cow;

use roxmltree::Error;

use super::findings::{Findings, Refusal, quoted};
use super::prescan::{check_counts, parse_xml};
use crate::limits::Limits;
use crate::report::{Disposition, Severity};

/// The text as an XML parser takes it.
pub(super) fn mended<'a>(
    text: Cow<'a, str>,
    limits: &Limits,
    findings: &mut Findings,
) -> Result<Cow<'a, str>, Refusal> {
    let text = without_declarations(text, findings);
    let text = without_tail(text, findings);
    check_counts(&text, limits)?;
    Ok(bind_prefixes(text, limits, findings))
}

fn repaired(findings: &mut Findings, line: Option<u32>, message: String) {
    findings.of_text(Severity::Warning, Disposition::Repaired, line, message);
}

fn line_of(text: &str, at: usize) -> u32 {
    let before = text.bytes().take(at).filter(|byte| *byte == b'\n').count();
    u32::try_from(before + 1).unwrap_or(u32::MAX)
}

/// What stands before the root's name: each comment and each instruction, and
/// where the name ends.
struct Prologue {
    /// Ranges of `<?xml ...?>`.
    declarations: Vec<(usize, usize)>,
    /// Absent where there is no root.
    root_name_end: Option<usize>,
}

fn prologue(text: &str) -> Prologue {
    let mut found = Prologue { declarations: Vec::new(), root_name_end: None };
    let mut at = 0;
    while let Some(open) = text.get(at..).and_then(|rest| rest.find('<')).map(|open| at + open) {
        let tag = text.get(open..).unwrap_or_default();
        let length = if tag.starts_with("<!--") {
            tag.find("-->").map(|end| end + 3)
        } else if tag.starts_with("<?") {
            let end = tag.find("?>").map(|end| end + 2);
            let is_declaration = tag.get(5..6).is_none_or(|next| next.trim().is_empty() || next == "?");
            if tag.starts_with("<?xml") && is_declaration {
                found.declarations.extend(end.map(|length| (open, open + length)));
            }
            end
        } else {
            let end = tag.find(|c: char| c.is_whitespace() || c == '>' || c == '/');
            found.root_name_end = end.map(|end| open + end);
            return found;
        };
        let Some(length) = length else { break };
        at = open + length;
    }
    found
}

/// The text is decoded, so a declaration has nothing left to say; and XML wants
/// it at the very start, where exporters and authors of comments do not put it.
fn without_declarations<'a>(text: Cow<'a, str>, findings: &mut Findings) -> Cow<'a, str> {
    let declarations = prologue(&text).declarations;
    if declarations.is_empty() {
        return text;
    }
    let mut text = text.into_owned();
    for (start, end) in declarations {
        if start > 0 {
            let message =
                "the XML declaration is not at the start of the file; read as if it were".to_owned();
            repaired(findings, Some(line_of(&text, start)), message);
        }
        let declaration = text.get(start..end).unwrap_or_default();
        // Byte for byte, so that columns stay too.
        let blank: String = declaration.bytes().map(|byte| if byte == b'\n' { '\n' } else { ' ' }).collect();
        text.replace_range(start..end, &blank);
    }
    Cow::Owned(text)
}

/// Nothing after the last `>` can belong to a document: some end in a NUL byte.
fn without_tail<'a>(text: Cow<'a, str>, findings: &mut Findings) -> Cow<'a, str> {
    let Some(end) = text.rfind('>').map(|last| last + 1) else { return text };
    let tail = text.get(end..).unwrap_or_default();
    let rest = tail.trim();
    if rest.is_empty() {
        return text;
    }
    let line = line_of(&text, end + tail.find(rest).unwrap_or(0));
    let message = format!("{} bytes after the end of the document are left out", rest.len());
    repaired(findings, Some(line), message);
    match text {
        Cow::Borrowed(text) => Cow::Borrowed(text.get(..end).unwrap_or(text)),
        Cow::Owned(mut text) => {
            text.truncate(end);
            Cow::Owned(text)
        }
    }
}

/// Real files use prefixes that they do not declare (`<controller:plugin>`):
/// declares them at the root, on the root's line.
fn bind_prefixes<'a>(mut text: Cow<'a, str>, limits: &Limits, findings: &mut Findings) -> Cow<'a, str> {
    const MOST: usize = 16;
    for _ in 0..MOST {
        let prefix = match parse_xml(&text, limits) {
            Err(Error::UnknownNamespace(prefix, _)) if prefix.len() <= limits.name_bytes => prefix,
            _ => break,
        };
        let Some(end) = prologue(&text).root_name_end else { break };
        let (before, after) = text.split_at(end);
        text = Cow::Owned(format!("{before} xmlns:{prefix}=\"undeclared:{prefix}\"{after}"));
        let message = format!("the prefix {} is not declared; read as if it were", quoted(&prefix));
        repaired(findings, None, message);
    }
    text
}
