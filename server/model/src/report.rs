//! What was done to a description on the way into the world.

use crate::robot::RobotModel;

/// The findings of one load, in the order of the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LoadReport {
    /// What was found.
    pub findings: Vec<Finding>,
}

/// How much a finding matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Nothing to do.
    Info,
    /// The robot loads, but perhaps not as its author meant.
    Warning,
    /// The robot is refused.
    Error,
}

/// What became of an element.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Disposition {
    /// Taken as it is.
    Used,
    /// Not given, or given as "not given".
    Defaulted,
    /// Wrong, and set right.
    Repaired,
    /// Not used by simd.
    Ignored,
    /// The reason why the robot is refused.
    Refused,
}

/// One element and what was done with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// How much it matters.
    pub severity: Severity,
    /// What became of it.
    pub disposition: Disposition,
    /// Where, for instance `joint "elbow" limit`.
    pub element: String,
    /// Line in the file, from 1; `None` where it does not apply.
    pub line: Option<u32>,
    /// A sentence: what was read, what was done, why.
    pub message: String,
}

impl LoadReport {
    /// Findings of at least this severity.
    pub fn at_least(&self, severity: Severity) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(move |finding| finding.severity >= severity)
    }

    /// One line for a log or a terminal: `arm: 2 links, 1 moving joint; no warnings`.
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

fn counted(n: usize, noun: &str) -> String {
    format!("{n} {noun}{}", if n == 1 { "" } else { "s" })
}
