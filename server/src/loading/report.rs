//! What a load report says beside what the readers of formats found.

use std::collections::BTreeSet;

use simd_core::collision::{MeshShapes, Shapes, StandIn, StandInShape};
use simd_model::robot::JointKind;
use simd_model::{Disposition, Finding, LoadReport, RobotModel, Severity};

/// Adds that constraints are left out which are on robots that do not come.
pub(super) fn report_absent(model: &RobotModel, names: &BTreeSet<&str>, report: &mut LoadReport) {
    for absent in model.setup.partners().difference(names) {
        let message =
            format!("constraints on {absent:?} are left out: that robot does not come at the same moment");
        report.findings.push(Finding {
            severity: Severity::Warning,
            disposition: Disposition::Ignored,
            element: format!("robot {:?}", model.name),
            file: None,
            line: None,
            message,
        });
    }
}

/// Adds what the collision meshes became, with at most `most` findings of a severity.
pub(super) fn report_stand_ins(shapes: &Shapes, most: usize, report: &mut LoadReport) {
    for stand_in in shapes.stand_ins() {
        let StandIn { uri, triangles, shape, asked, distance } = stand_in;
        let mesh = format!("the collision mesh of {}", counted(*triangles, "triangle"));
        let error = format!("the largest distance found between the two is {distance:.4} m");
        let divided = *asked == MeshShapes::Decomposition;
        let (severity, disposition, message) = match shape {
            StandInShape::Mesh => {
                (Severity::Info, Disposition::Used, format!("{mesh} touches as it is: its link cannot move"))
            }
            StandInShape::Hull if divided => (
                Severity::Warning,
                Disposition::Ignored,
                format!(
                    "{mesh} is not taken apart, because it is flat or has more than 100000 triangles: its convex \
                     hull stands for it; {error}"
                ),
            ),
            StandInShape::Hull => (
                Severity::Info,
                Disposition::Used,
                format!("the convex hull of {mesh} stands for it; {error}"),
            ),
            StandInShape::Parts(count) => (
                Severity::Info,
                Disposition::Used,
                format!("{} of {mesh} stand for it; {error}", counted(*count, "convex part")),
            ),
        };
        if report.at_least(severity).filter(|finding| finding.severity == severity).count() < most {
            let (element, file) = ("collision".to_owned(), Some(uri.clone()));
            report.findings.push(Finding { severity, disposition, element, file, line: None, message });
        }
    }
}

/// A report in one line, for instance "arm: 2 links, 1 moving joint; 1 warning".
pub(crate) fn summary(model: &RobotModel, report: &LoadReport) -> String {
    let moving = model.joints.iter().filter(|joint| joint.kind != JointKind::Fixed).count();
    let warnings = report.findings.iter().filter(|finding| finding.severity == Severity::Warning).count();
    let mut summary = format!(
        "{}: {}, {}",
        model.name,
        counted(model.links.len(), "link"),
        counted(moving, "moving joint")
    );
    if warnings > 0 {
        summary += &format!("; {}", counted(warnings, "warning"));
    }
    summary
}

fn counted(count: usize, what: &str) -> String {
    let plural = if count == 1 { "" } else { "s" };
    format!("{count} {what}{plural}")
}
