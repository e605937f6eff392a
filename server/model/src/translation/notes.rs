//! The report while a file of another format is read.

use super::draft::At;
use super::element::Element;
use crate::report::{Disposition, Finding, LoadReport, Severity};
use crate::urdf::Refused;
use crate::urdf::findings::cut;

/// What was found so far. Like the findings of URDF, so many and no more of each severity.
pub(crate) struct Notes {
    list: Vec<Finding>,
    most: usize,
    taken: [usize; 2],
    left_out: [usize; 2],
    /// Bytes of the sentences.
    bytes: usize,
}

/// Why reading stops.
#[derive(Debug)]
pub(crate) struct Stop {
    finding: Finding,
}

/// Bytes of a finding's sentence.
const SENTENCE: usize = 2000;
/// Bytes of what an element is called.
const ELEMENT: usize = 500;
/// Bytes of all of them.
const ALL: usize = 1 << 20;

impl Notes {
    pub(crate) fn new(most: usize) -> Self {
        Self { list: Vec::new(), most, taken: [0; 2], left_out: [0; 2], bytes: 0 }
    }

    /// Something that needs no attention.
    pub(crate) fn info(&mut self, at: Element, disposition: Disposition, message: impl Into<String>) {
        self.push(Severity::Info, disposition, at, message.into());
    }

    /// Something that the author may not have meant.
    pub(crate) fn warn(&mut self, at: Element, disposition: Disposition, message: impl Into<String>) {
        self.push(Severity::Warning, disposition, at, message.into());
    }

    /// A warning of a line of which the element is not at hand.
    pub(crate) fn warn_at_line(&mut self, disposition: Disposition, (file, line): At, message: String) {
        let (element, message) = ("file".to_owned(), cut(message, SENTENCE));
        let file = (file > 0).then(|| format!("included file {file}"));
        let line = Some(line).filter(|line| *line > 0);
        self.keep(Finding { severity: Severity::Warning, disposition, element, file, line, message });
    }

    fn push(&mut self, severity: Severity, disposition: Disposition, at: Element, message: String) {
        self.keep(finding(severity, disposition, at, message));
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

    /// The report of a file that is refused.
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

fn finding(severity: Severity, disposition: Disposition, at: Element, message: String) -> Finding {
    let message = cut(message, SENTENCE);
    let file = at.file_name().map(str::to_owned);
    Finding { severity, disposition, element: cut(at.label(), ELEMENT), file, line: Some(at.line()), message }
}

impl Stop {
    /// Because of an element.
    pub(crate) fn at(at: Element, message: impl Into<String>) -> Self {
        Self { finding: finding(Severity::Error, Disposition::Refused, at, message.into()) }
    }

    /// Of the file as a whole, or of another that it includes.
    pub(crate) fn of_file(file: Option<String>, line: Option<u32>, message: String) -> Self {
        let (severity, disposition) = (Severity::Error, Disposition::Refused);
        let (element, message) = ("file".to_owned(), cut(message, SENTENCE));
        Self { finding: Finding { severity, disposition, element, file, line, message } }
    }
}

/// A refusal after what was found.
pub(crate) fn refused(message: String, report: LoadReport) -> Refused {
    let mut notes = Notes::new(usize::MAX);
    notes.list = report.findings;
    notes.refused(Stop::of_file(None, None, message))
}
