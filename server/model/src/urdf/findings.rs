//! The load report while it is written: place and treatment of each element.

use roxmltree::Node;

use super::Refused;
use crate::report::{Disposition, Finding, LoadReport, Severity, cut};

/// Reason why reading stops.
#[derive(Debug)]
pub(crate) struct Refusal {
    element: String,
    line: Option<u32>,
    message: String,
}

impl Refusal {
    /// Makes a refusal of the whole file.
    pub(crate) fn of_file(message: String) -> Self {
        Self { element: "file".to_owned(), line: None, message }
    }

    /// Makes a refusal before there are elements.
    pub(crate) fn at(line: u32, message: String) -> Self {
        Self { element: "file".to_owned(), line: Some(line), message }
    }
}

/// Findings so far.
pub(crate) struct Findings {
    /// Offsets of the beginnings of lines, without the first.
    line_starts: Vec<usize>,
    list: Vec<Finding>,
    /// Indices of findings that a strict load refuses.
    serious: Vec<usize>,
    serious_left_out: usize,
    /// Maximum number of findings in each quota.
    most: usize,
    quotas: [Quota; 3],
}

/// Maximum bytes of the findings of one quota.
const QUOTA_BYTES: usize = 512 << 10;
/// Maximum bytes of a finding's sentence; a longer one is cut.
const SENTENCE: usize = 2000;
/// Maximum bytes of an element's label; a longer one is cut.
const ELEMENT: usize = 500;

/// Each kind has a separate quota, so that many notes do not hide warnings.
#[derive(Clone, Copy, Default)]
struct Quota {
    taken: usize,
    /// Bytes of the accepted findings.
    bytes: usize,
    left_out: usize,
}

impl Quota {
    fn is_full(&self, most: usize) -> bool {
        self.taken >= most || self.bytes >= QUOTA_BYTES
    }
}

/// Place of a finding until it is written down.
struct Location<'n, 'a, 'i> {
    node: Node<'a, 'i>,
    file: Option<&'n str>,
}

impl Findings {
    /// Makes empty findings with at most `most` of each kind.
    pub(crate) fn new(most: usize) -> Self {
        Self {
            line_starts: Vec::new(),
            list: Vec::new(),
            serious: Vec::new(),
            serious_left_out: 0,
            most,
            quotas: Default::default(),
        }
    }

    /// Sets the text in which lines are counted.
    pub(crate) fn set_text(&mut self, text: &str) {
        self.line_starts =
            text.bytes().enumerate().filter(|(_, b)| *b == b'\n').map(|(i, _)| i + 1).collect();
    }

    /// Returns the line of a node, from 1.
    pub(crate) fn line(&self, node: Node) -> u32 {
        let start = node.range().start;
        u32::try_from(self.line_starts.partition_point(|line| *line <= start) + 1).unwrap_or(u32::MAX)
    }

    /// Returns whether the quota of notes is full.
    pub(crate) fn is_full(&self) -> bool {
        let [_, infos, _] = &self.quotas;
        infos.is_full(self.most)
    }

    /// Adds that an element was used.
    pub(crate) fn used(&mut self, node: Node, message: impl FnOnce() -> String) {
        self.push(Severity::Info, Disposition::Used, Location { node, file: None }, false, message);
    }

    /// Adds that a file of an element was used.
    pub(crate) fn used_file(&mut self, node: Node, file: &str, message: impl FnOnce() -> String) {
        self.push(Severity::Info, Disposition::Used, Location { node, file: Some(file) }, false, message);
    }

    /// Adds a finding that needs no attention.
    pub(crate) fn info(&mut self, node: Node, disposition: Disposition, message: impl Into<String>) {
        self.push(Severity::Info, disposition, Location { node, file: None }, false, || message.into());
    }

    /// Adds a finding that the author may not have intended.
    pub(crate) fn warn(&mut self, node: Node, disposition: Disposition, message: impl Into<String>) {
        self.push(Severity::Warning, disposition, Location { node, file: None }, true, || message.into());
    }

    /// Adds such a finding about a file that an element names; a strict load may accept it.
    pub(crate) fn warn_of_file(
        &mut self,
        node: Node,
        file: &str,
        disposition: Disposition,
        serious: bool,
        message: impl Into<String>,
    ) {
        let location = Location { node, file: Some(file) };
        self.push(Severity::Warning, disposition, location, serious, || message.into());
    }

    /// Turns a refusal that only concerns the look into a warning.
    pub(crate) fn pass_over(&mut self, node: Node, refusal: &Refusal) {
        self.warn(
            node,
            Disposition::Ignored,
            format!("{}: left out, since it is only visual", refusal.message),
        );
    }

    /// Adds a finding about the text, before there are elements.
    pub(crate) fn of_text(
        &mut self,
        severity: Severity,
        disposition: Disposition,
        line: Option<u32>,
        message: String,
    ) {
        if severity >= Severity::Warning {
            self.serious.push(self.list.len());
        }
        let element = "file".to_owned();
        let message = cut(message, SENTENCE);
        self.list.push(Finding { severity, disposition, element, file: None, line, message });
    }

    /// Returns the reason why the robot is refused.
    pub(crate) fn refuse(&self, node: Node, message: impl Into<String>) -> Refusal {
        Refusal { element: label(node), line: Some(self.line(node)), message: message.into() }
    }

    /// Refuses if there was a serious warning, and turns these warnings into errors.
    pub(crate) fn refuse_warnings(&mut self) -> Result<(), Refusal> {
        let Some(first) = self.serious.first().and_then(|first| self.list.get(*first)) else { return Ok(()) };
        let more = match self.serious.len() + self.serious_left_out - 1 {
            0 => String::new(),
            more => format!(" and {more} more like it"),
        };
        let message = format!("{} (strict loading refuses this{more})", first.message);
        let refusal = Refusal { element: first.element.clone(), line: first.line, message };
        for index in &self.serious {
            if let Some(finding) = self.list.get_mut(*index) {
                finding.severity = Severity::Error;
            }
        }
        Err(refusal)
    }

    fn push(
        &mut self,
        severity: Severity,
        disposition: Disposition,
        location: Location,
        serious: bool,
        message: impl FnOnce() -> String,
    ) {
        let [used, infos, warnings] = &mut self.quotas;
        let quota = match (severity, disposition) {
            (Severity::Info, Disposition::Used) => used,
            (Severity::Info, _) => infos,
            (Severity::Warning | Severity::Error, _) => warnings,
        };
        if quota.is_full(self.most) {
            quota.left_out += 1;
            self.serious_left_out += usize::from(serious);
            return;
        }
        let Location { node, file } = location;
        let (element, message) = (cut(label(node), ELEMENT), cut(message(), SENTENCE));
        quota.taken += 1;
        quota.bytes += size_of::<Finding>() + element.len() + message.len() + file.map_or(0, str::len);
        if serious {
            self.serious.push(self.list.len());
        }
        let (file, line) = (file.map(str::to_owned), Some(self.line(node)));
        self.list.push(Finding { severity, disposition, element, file, line, message });
    }

    /// Returns the report of a robot that was read, in the order of the file.
    pub(crate) fn into_report(mut self) -> LoadReport {
        self.list.sort_by_key(|finding| finding.line);
        let [used, infos, warnings] = self.quotas;
        let left_out = [
            (Severity::Info, Disposition::Used, used.left_out),
            (Severity::Info, Disposition::Ignored, infos.left_out),
            (Severity::Warning, Disposition::Ignored, warnings.left_out),
        ];
        for (severity, disposition, count) in left_out.into_iter().filter(|(_, _, count)| *count > 0) {
            let element = "file".to_owned();
            let message = format!("{count} more findings like these are left out");
            self.list.push(Finding { severity, disposition, element, file: None, line: None, message });
        }
        LoadReport { findings: self.list }
    }

    /// Returns the report of a refused robot.
    pub(crate) fn refused(self, refusal: Refusal) -> Refused {
        let Refusal { element, line, message } = refusal;
        let (element, message) = (cut(element, ELEMENT), cut(message, SENTENCE));
        let sentence = match (element.as_str(), line) {
            ("file", Some(line)) => format!("line {line}: {message}"),
            ("file", None) => message.clone(),
            (element, Some(line)) => format!("{element} (line {line}): {message}"),
            (element, None) => format!("{element}: {message}"),
        };
        let mut report = self.into_report();
        let (severity, disposition) = (Severity::Error, Disposition::Refused);
        report.findings.push(Finding { severity, disposition, element, file: None, line, message });
        Refused { message: sentence, report }
    }
}

/// Returns an element's label in a report: `joint "elbow" limit`.
pub(crate) fn label(node: Node) -> String {
    let mut words: Vec<String> = node
        .ancestors()
        .filter(|node| node.is_element() && node.parent_element().is_some())
        .map(|node| match (node.tag_name().name(), node.attribute("name")) {
            (tag @ ("link" | "joint"), Some(name)) => format!("{tag} {}", quoted(name)),
            (tag, _) => shortened(tag),
        })
        .collect();
    // A `<robot>` within another element is still the robot.
    if words.last().is_some_and(|tag| tag == "robot") {
        words.pop();
    }
    if words.is_empty() {
        return "robot".to_owned();
    }
    words.reverse();
    words.join(" ")
}

/// Quotes a value of the file, and shortens it.
pub(crate) fn quoted(value: &str) -> String {
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
