//! The report while a file of another format is read.

use std::collections::BTreeSet;

use super::draft::At;
use super::element::Element;
use crate::report::{Disposition, Finding, LoadReport, Severity, cut};
use crate::urdf::Refused;

/// Findings so far. As for URDF, each severity has a maximum number.
pub(crate) struct Notes {
    list: Vec<Finding>,
    most: usize,
    taken: [usize; 2],
    left_out: [usize; 2],
    /// Bytes of all sentences.
    bytes: usize,
    /// Kinds of elements with a finding about an ignored part: the parent's tag, and its own.
    ignored: BTreeSet<(String, String)>,
}

/// Reason why reading stops.
#[derive(Debug)]
pub(crate) struct Stop {
    finding: Finding,
}

/// Maximum bytes of a finding's sentence.
const SENTENCE: usize = 2000;
/// Maximum bytes of an element's label.
const ELEMENT: usize = 500;
/// Maximum bytes of all of them.
const ALL: usize = 1 << 20;

impl Notes {
    pub(crate) fn new(most: usize) -> Self {
        Self { list: Vec::new(), most, taken: [0; 2], left_out: [0; 2], bytes: 0, ignored: BTreeSet::new() }
    }

    /// Adds a finding that needs no attention.
    pub(crate) fn info(&mut self, at: Element, disposition: Disposition, message: impl Into<String>) {
        self.push(Severity::Info, disposition, at, message.into());
    }

    /// Adds a reason to refuse a file as a warning: only the element is left out.
    pub(crate) fn warn_of(&mut self, at: Element, stop: &Stop) {
        self.warn(at, Disposition::Ignored, format!("{}: left out", stop.finding.message));
    }

    /// Adds a finding that the author may not have intended.
    pub(crate) fn warn(&mut self, at: Element, disposition: Disposition, message: impl Into<String>) {
        self.push(Severity::Warning, disposition, at, message.into());
    }

    /// Adds a warning for a line whose element is not available.
    pub(crate) fn warn_at_line(&mut self, disposition: Disposition, (file, line): At, message: String) {
        let (element, message) = ("file".to_owned(), cut(message, SENTENCE));
        let file = (file > 0).then(|| format!("included file {file}"));
        let line = Some(line).filter(|line| *line > 0);
        self.keep(Finding { severity: Severity::Warning, disposition, element, file, line, message });
    }

    /// Turns a refusal that only concerns the look into a warning.
    pub(crate) fn pass_over(&mut self, stop: Stop) {
        let message = format!("{}: left out, since it is only visual", stop.finding.message);
        let (severity, disposition) = (Severity::Warning, Disposition::Ignored);
        self.keep(Finding { severity, disposition, message: cut(message, SENTENCE), ..stop.finding });
    }

    /// Adds a repair of a file's text; the file that was sent has no URI.
    pub(crate) fn of_text(&mut self, uri: &str, line: u32, message: String) {
        let (severity, disposition) = (Severity::Warning, Disposition::Repaired);
        let file = Some(uri.to_owned()).filter(|uri| !uri.is_empty());
        let element = "file".to_owned();
        self.keep(Finding { severity, disposition, element, file, line: Some(line), message });
    }

    /// Adds a finding about an included file, which another reader made.
    pub(crate) fn of_file(&mut self, uri: &str, finding: Finding) {
        let file = finding.file.or_else(|| Some(uri.to_owned()).filter(|uri| !uri.is_empty()));
        self.keep(Finding { file, ..finding });
    }

    fn push(&mut self, severity: Severity, disposition: Disposition, at: Element, message: String) {
        if disposition == Disposition::Ignored {
            self.ignored.insert(kind_of(at));
        }
        self.keep(finding(severity, disposition, at, message));
    }

    /// Returns whether an element of this kind has a finding about an ignored part.
    pub(crate) fn has_ignored(&self, element: Element) -> bool {
        self.ignored.contains(&kind_of(element))
    }

    fn keep(&mut self, finding: Finding) {
        let kind = usize::from(finding.severity >= Severity::Warning);
        if self.taken[kind] >= self.most || self.bytes > ALL {
            self.left_out[kind] += 1;
            return;
        }
        self.taken[kind] += 1;
        self.bytes += finding.message.len() + finding.element.len() + size_of::<Finding>();
        self.list.push(finding);
    }

    pub(crate) fn into_report(mut self) -> LoadReport {
        let severities = [Severity::Info, Severity::Warning];
        for (severity, count) in severities.into_iter().zip(self.left_out).filter(|(_, count)| *count > 0) {
            let message = format!("{count} more findings like these are left out");
            let (disposition, element) = (Disposition::Ignored, "file".to_owned());
            self.list.push(Finding { severity, disposition, element, file: None, line: None, message });
        }
        LoadReport { findings: self.list }
    }

    /// Returns the report of a refused file.
    pub(crate) fn refused(self, stop: Stop) -> Refused {
        let Finding { element, line, message, file, .. } = &stop.finding;
        let file = file.as_ref().map(|file| format!("{file}, ")).unwrap_or_default();
        let sentence = match (element.as_str(), line) {
            ("file", Some(line)) => format!("{file}line {line}: {message}"),
            ("file", None) => format!("{file}{message}"),
            (element, Some(line)) => format!("{element} ({file}line {line}): {message}"),
            (element, None) => format!("{element}: {message}"),
        };
        let mut report = self.into_report();
        report.findings.push(stop.finding);
        Refused { message: sentence, report }
    }
}

/// Returns the tag of the parent, and its own.
fn kind_of(element: Element) -> (String, String) {
    let above = element.node.parent_element().map(|above| above.tag_name().name().to_owned());
    (above.unwrap_or_default(), element.tag().to_owned())
}

fn finding(severity: Severity, disposition: Disposition, at: Element, message: String) -> Finding {
    let message = cut(message, SENTENCE);
    let file = at.file_name().map(str::to_owned);
    Finding { severity, disposition, element: cut(at.label(), ELEMENT), file, line: Some(at.line()), message }
}

impl Stop {
    /// Makes a refusal because of an element.
    pub(crate) fn at(at: Element, message: impl Into<String>) -> Self {
        Self { finding: finding(Severity::Error, Disposition::Refused, at, message.into()) }
    }

    /// Makes a refusal of the whole file, or of one that it includes.
    pub(crate) fn of_file(file: Option<String>, line: Option<u32>, message: String) -> Self {
        let (severity, disposition) = (Severity::Error, Disposition::Refused);
        let (element, message) = ("file".to_owned(), cut(message, SENTENCE));
        Self { finding: Finding { severity, disposition, element, file, line, message } }
    }
}

/// Returns a refusal with the findings so far.
pub(crate) fn refused(message: String, report: LoadReport) -> Refused {
    let mut notes = Notes::new(usize::MAX);
    notes.list = report.findings;
    notes.refused(Stop::of_file(None, None, message))
}
