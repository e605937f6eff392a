//! The load report while it is written: where each element stands, and what became of it.

use roxmltree::Node;

use super::Refused;
use crate::limits;
use crate::report::{Disposition, Finding, LoadReport, Severity};

/// Why reading stops.
#[derive(Debug)]
pub(super) struct Refusal {
    element: String,
    line: Option<u32>,
    message: String,
}

impl Refusal {
    /// Of the file as a whole.
    pub(super) fn of_file(message: String) -> Self {
        Self { element: "file".to_owned(), line: None, message }
    }

    /// Of a place where there is no element yet.
    pub(super) fn at(line: u32, message: String) -> Self {
        Self { element: "file".to_owned(), line: Some(line), message }
    }
}

/// What was found so far.
#[derive(Default)]
pub(super) struct Findings {
    /// Offsets at which the lines begin, without the first.
    line_starts: Vec<usize>,
    list: Vec<Finding>,
    infos: usize,
    infos_left_out: usize,
    warnings: usize,
    warnings_left_out: usize,
    /// The first warning that a strict load refuses.
    strict: Option<Refusal>,
}

impl Findings {
    /// The text that lines are counted in.
    pub(super) fn set_text(&mut self, text: &str) {
        self.line_starts =
            text.bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(i, _)| i + 1).collect();
    }

    /// From 1.
    pub(super) fn line(&self, node: Node) -> u32 {
        let start = node.range().start;
        u32::try_from(self.line_starts.partition_point(|line| *line <= start) + 1).unwrap_or(u32::MAX)
    }

    /// Something that needs no attention.
    pub(super) fn info(&mut self, node: Node, disposition: Disposition, message: impl Into<String>) {
        self.push(Severity::Info, node, disposition, message.into());
    }

    /// The same of no element in particular.
    pub(super) fn info_of_file(&mut self, disposition: Disposition, message: String) {
        let (severity, element) = (Severity::Info, "file".to_owned());
        self.list.push(Finding { severity, disposition, element, line: None, message });
    }

    /// Something that the author may not have meant.
    pub(super) fn warn(&mut self, node: Node, disposition: Disposition, message: impl Into<String>) {
        let message = message.into();
        if self.strict.is_none() {
            let (element, line) = (label(node), Some(self.line(node)));
            let message = format!("{message} (a warning, and strict loading refuses those)");
            self.strict = Some(Refusal { element, line, message });
        }
        self.push(Severity::Warning, node, disposition, message);
    }

    /// A warning that even a strict load forgives.
    pub(super) fn warn_leniently(&mut self, node: Node, disposition: Disposition, message: String) {
        self.push(Severity::Warning, node, disposition, message);
    }

    /// The reason why the robot is refused.
    pub(super) fn refuse(&self, node: Node, message: impl Into<String>) -> Refusal {
        Refusal { element: label(node), line: Some(self.line(node)), message: message.into() }
    }

    /// Refuses where there was a warning.
    pub(super) fn refuse_warnings(&mut self) -> Result<(), Refusal> {
        self.strict.take().map_or(Ok(()), Err)
    }

    fn push(&mut self, severity: Severity, node: Node, disposition: Disposition, message: String) {
        // Each severity has its own room, so that no crowd of trifles hides a warning.
        let (count, left_out) = match severity {
            Severity::Info => (&mut self.infos, &mut self.infos_left_out),
            Severity::Warning | Severity::Error => (&mut self.warnings, &mut self.warnings_left_out),
        };
        if *count >= limits::FINDINGS {
            *left_out += 1;
            return;
        }
        *count += 1;
        let (element, line) = (label(node), Some(self.line(node)));
        self.list.push(Finding { severity, disposition, element, line, message });
    }

    /// The report of a robot that was read, in the order of the file.
    pub(super) fn into_report(mut self) -> LoadReport {
        self.list.sort_by_key(|finding| finding.line);
        let left_out = [(Severity::Info, self.infos_left_out), (Severity::Warning, self.warnings_left_out)];
        for (severity, count) in left_out.into_iter().filter(|(_, count)| *count > 0) {
            let (disposition, element) = (Disposition::Ignored, "file".to_owned());
            let message = format!("{count} more findings like these are left out");
            self.list.push(Finding { severity, disposition, element, line: None, message });
        }
        LoadReport { findings: self.list }
    }

    /// The report of a robot that was refused.
    pub(super) fn refused(self, refusal: Refusal) -> Refused {
        let Refusal { element, line, message } = refusal;
        let sentence = match (element.as_str(), line) {
            ("file", Some(line)) => format!("line {line}: {message}"),
            ("file", None) => message.clone(),
            (element, Some(line)) => format!("{element} (line {line}): {message}"),
            (element, None) => format!("{element}: {message}"),
        };
        let mut report = self.into_report();
        let (severity, disposition) = (Severity::Error, Disposition::Refused);
        report.findings.push(Finding { severity, disposition, element, line, message });
        Refused { message: sentence, report }
    }
}

/// What an element is called in a report: `joint "elbow" limit`.
pub(super) fn label(node: Node) -> String {
    let mut words: Vec<String> = node
        .ancestors()
        .filter(|node| node.is_element() && node.parent_element().is_some())
        .map(|node| match (node.tag_name().name(), node.attribute("name")) {
            (tag @ ("link" | "joint"), Some(name)) => format!("{tag} {}", quoted(name)),
            (tag, _) => shortened(tag),
        })
        .collect();
    if words.is_empty() {
        return "robot".to_owned();
    }
    words.reverse();
    words.join(" ")
}

/// A value of the file in quotes, cut where it is long.
pub(super) fn quoted(value: &str) -> String {
    format!("\"{}\"", shortened(value))
}

fn shortened(value: &str) -> String {
    let clean = |c: char| if c.is_control() { ' ' } else { c };
    let mut chars = value.chars().map(clean);
    let mut short: String = chars.by_ref().take(80).collect();
    if chars.next().is_some() {
        short.push_str("...");
    }
    short
}
