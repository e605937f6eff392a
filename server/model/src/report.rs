//! Findings about a description.

use std::collections::{BTreeMap, BTreeSet};

use crate::robot::RobotModel;

/// The findings of one load, in the order of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadReport {
    /// The findings.
    pub findings: Vec<Finding>,
}

/// Importance of a finding.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// No action needed.
    Info,
    /// The robot loads, but perhaps not as its author meant.
    Warning,
    /// The robot is refused.
    Error,
}

/// Treatment of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Disposition {
    /// Used as it is.
    Used,
    /// Absent, or explicitly not given.
    Defaulted,
    /// Wrong, and corrected. Always at least a warning.
    Repaired,
    /// Not used by simd.
    Ignored,
    /// The reason why the robot is refused.
    Refused,
}

impl Disposition {
    /// All dispositions, in the order in which a report counts them.
    pub const ALL: [Self; 5] = [Self::Used, Self::Defaulted, Self::Repaired, Self::Ignored, Self::Refused];

    /// Returns its word in reports.
    pub fn word(self) -> &'static str {
        match self {
            Self::Used => "used",
            Self::Defaulted => "defaulted",
            Self::Repaired => "repaired",
            Self::Ignored => "ignored",
            Self::Refused => "refused",
        }
    }
}

impl Severity {
    /// Returns its word in reports.
    pub fn word(self) -> &'static str {
        match self {
            Self::Info => "info",
            Self::Warning => "warning",
            Self::Error => "error",
        }
    }
}

/// One element and its treatment.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Importance of the finding.
    pub severity: Severity,
    /// Treatment of the element.
    pub disposition: Disposition,
    /// Element, for instance `joint "elbow" limit`.
    pub element: String,
    /// URI of the mesh file that the finding concerns, as the description writes it; `None` if it concerns
    /// the description itself.
    pub file: Option<String>,
    /// Line of the element in the description, from 1; `None` if it does not apply.
    pub line: Option<u32>,
    /// A sentence: what was read, what was done, why.
    pub message: String,
}

impl LoadReport {
    /// Returns the findings of at least this severity.
    pub fn at_least(&self, severity: Severity) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(move |finding| finding.severity >= severity)
    }

    /// Returns the report with many findings of a kind condensed to one: the first of them, with their number
    /// and the next lines. Findings of a kind have the same text and element, apart from quoted names and
    /// numbers.
    pub fn condensed(&self) -> Self {
        /// Up to this number, findings of a kind are listed one by one.
        const FEW: usize = 3;
        let kind = |finding: &Finding| {
            let key = (finding.severity, finding.disposition, bare(&finding.element), bare(&finding.message));
            // Used elements are not condensed.
            (finding.disposition != Disposition::Used && finding.disposition != Disposition::Refused)
                .then_some(key)
        };
        let mut kinds: BTreeMap<_, Vec<usize>> = BTreeMap::new();
        for (index, finding) in self.findings.iter().enumerate() {
            if let Some(kind) = kind(finding) {
                kinds.entry(kind).or_default().push(index);
            }
        }
        let mut counted: BTreeMap<usize, String> = BTreeMap::new();
        let mut left_out: BTreeSet<usize> = BTreeSet::new();
        for alike in kinds.into_values().filter(|alike| alike.len() > FEW) {
            let Some((first, others)) = alike.split_first() else { continue };
            let locations =
                others.iter().take(FEW).filter_map(|index| self.findings.get(*index)).map(location);
            let mut named: Vec<String> = locations.collect();
            if others.len() > FEW {
                named.push("...".to_owned());
            }
            counted.insert(*first, format!(" ({} more like it: {})", others.len(), named.join(", ")));
            left_out.extend(others);
        }
        let all = self.findings.iter().enumerate().filter(|(index, _)| !left_out.contains(index));
        let condensed = all.map(|(index, finding)| {
            let more = counted.get(&index).map_or("", String::as_str);
            Finding { message: format!("{}{more}", finding.message), ..finding.clone() }
        });
        Self { findings: condensed.collect() }
    }

    /// Returns the number of each disposition: `12 used, 3 defaulted, 1 ignored`.
    pub fn counts(&self) -> String {
        let count = |what| self.findings.iter().filter(|finding| finding.disposition == what).count();
        let counts = Disposition::ALL.map(|what| (count(what), what.word()));
        let named: Vec<_> =
            counts.iter().filter(|(n, _)| *n > 0).map(|(n, word)| format!("{n} {word}")).collect();
        named.join(", ")
    }

    /// Returns one line for a log or a terminal: `arm: 2 links, 1 moving joint; no warnings`.
    pub fn summary(&self, model: &RobotModel) -> String {
        let moving = model.joints.iter().filter(|joint| joint.kind.moves()).count();
        let warnings = match self.at_least(Severity::Warning).count() {
            0 => "no warnings".to_owned(),
            n => counted(n, "warning"),
        };
        let links = counted(model.links.len(), "link");
        format!("{}: {links}, {}; {warnings}", model.name, counted(moving, "moving joint"))
    }
}

/// Returns the place of a finding: `link "arm" (line 4)`.
fn location(finding: &Finding) -> String {
    let line = finding.line.map_or_else(String::new, |line| format!(" (line {line})"));
    format!("{}{line}", finding.element)
}

/// Returns a text without quoted parts and digits.
fn bare(text: &str) -> String {
    let outside = text.split('"').step_by(2);
    outside.flat_map(str::chars).filter(|c| !c.is_ascii_digit()).collect()
}

/// Cuts a text to at most `bytes` bytes, with an ellipsis.
pub(crate) fn cut(mut text: String, bytes: usize) -> String {
    if text.len() > bytes {
        text.truncate(text.floor_char_boundary(bytes));
        text.push_str("...");
        text.shrink_to_fit();
    }
    text
}

/// Returns a counted noun: `1 link`, `2 links`.
pub(crate) fn counted(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}

/// Formats a number with six digits, without trailing zeros.
pub(crate) fn short(value: f64) -> String {
    let size = value.abs();
    if size != 0.0 && !(1e-4..1e7).contains(&size) {
        return format!("{value:.3e}");
    }
    let text = format!("{value:.6}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finding(element: &str, line: u32, message: &str) -> Finding {
        Finding {
            severity: Severity::Warning,
            disposition: Disposition::Repaired,
            element: element.to_owned(),
            file: None,
            line: Some(line),
            message: message.to_owned(),
        }
    }

    #[test]
    fn findings_of_a_kind_are_one_with_the_first_places_and_a_few_stay_apart() {
        let many =
            (0..6).map(|n| finding(&format!("joint \"j{n}\""), n + 1, &format!("lower {n} is above upper")));
        let few = (0..3).map(|n| finding("link \"a\"", n + 10, "another thing"));
        let used =
            (0..5).map(|n| Finding { disposition: Disposition::Used, ..finding("link \"a\"", n, "taken") });
        let report = LoadReport { findings: many.chain(few).chain(used).collect() };
        let condensed = report.condensed();
        assert_eq!(condensed.findings.len(), 1 + 3 + 5);
        let expected = "lower 0 is above upper (5 more like it: joint \"j1\" (line 2), joint \"j2\" (line 3), joint \"j3\" (line 4), ...)";
        assert_eq!(condensed.findings[0].message, expected);
        assert_eq!(condensed.findings[0].line, Some(1));
        assert_eq!(condensed.condensed(), condensed, "once is enough");
    }
}
