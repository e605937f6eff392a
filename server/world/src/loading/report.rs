//! Findings of a load report that do not come from the readers of formats.

use std::collections::BTreeSet;

use simd_core::collision::{CoarsePair, MeshShapes, Proxy, ProxyShape, Shapes};
use simd_model::robot::JointKind;
use simd_model::{Disposition, Finding, LoadReport, Refused, RobotModel, Severity};

/// Element of findings about collision meshes. They have no line.
const COLLISION: &str = "collision";

/// The element of findings about links that touch others of their robot.
const SELF_COLLISION: &str = "self_collision";

/// Adds that constraints are left out which are on robots that do not come.
pub(super) fn report_absent(model: &RobotModel, names: &BTreeSet<&str>, report: &mut LoadReport) {
    for absent in model.setup.partners().difference(names) {
        let message =
            format!("constraints on {absent:?} are left out: that robot is not loaded by the same call");
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

/// Adds findings about the shapes of collision meshes, at most `most` of each severity.
pub(super) fn report_proxies(shapes: &Shapes, most: usize, report: &mut LoadReport) {
    for proxy in shapes.proxies() {
        let Proxy { uri, triangles, shape, asked, is_fixed, distance, simpler_by, is_measured } = proxy;
        let mesh = format!("the collision mesh of {}", counted(*triangles, "triangle"));
        let simpler = simpler_by.map_or_else(String::new, |by| {
            format!("of some of its corners; the others lie at most {by:.6} m outside;  ")
        });
        let error = format!("{simpler}the largest distance found between the two is {distance:.4} m");
        let divided = *asked == MeshShapes::Decomposition;
        let (severity, disposition, message) = match shape {
            ProxyShape::Mesh => {
                let message = format!(
                    "{mesh} collides by its triangles: its link cannot move; it does not collide with other \
                     fixed shapes, and has no distance from other such meshes"
                );
                (Severity::Info, Disposition::Used, message)
            }
            ProxyShape::Hull if divided => (
                Severity::Warning,
                Disposition::Ignored,
                format!(
                    "{mesh} is not divided into convex parts, because it is flat or has more than 100000 \
                     triangles: its convex hull is used instead; {error}"
                ),
            ),
            ProxyShape::Hull if *asked == MeshShapes::Mesh && *is_fixed => (
                Severity::Warning,
                Disposition::Ignored,
                format!(
                    "the convex hull of {mesh} is used instead of its triangles, because they have no area \
                     or the robot's are more than 1000000; {error}"
                ),
            ),
            ProxyShape::Hull if *is_measured => (
                Severity::Info,
                Disposition::Used,
                format!(
                    "the convex hull of {mesh} is used instead; {error}, so other links of this robot touch \
                     its triangles and not the hull"
                ),
            ),
            ProxyShape::Hull => (
                Severity::Info,
                Disposition::Used,
                format!("the convex hull of {mesh} is used instead; {error}"),
            ),
            ProxyShape::Parts(count) => (
                Severity::Info,
                Disposition::Used,
                format!("{} of {mesh} are used instead; {error}", counted(*count, "convex part")),
            ),
        };
        if report.at_least(severity).filter(|finding| finding.severity == severity).count() < most {
            let (element, file) = (COLLISION.to_owned(), Some(uri.clone()));
            report.findings.push(Finding { severity, disposition, element, file, line: None, message });
        }
    }
}

/// Adds links of one robot that push each other while their meshes are apart, with at most `most` warnings.
pub(super) fn report_coarse_pairs(
    pairs: &[CoarsePair],
    model: &RobotModel,
    most: usize,
    report: &mut LoadReport,
) {
    let name = |link: usize| model.links.get(link).map_or("", |link| link.name.as_str());
    let warnings = report.findings.iter().filter(|finding| finding.severity == Severity::Warning).count();
    for CoarsePair { links, distance } in pairs.iter().take(most.saturating_sub(warnings)) {
        let [first, second] = links.map(name);
        report.findings.push(Finding {
            severity: Severity::Warning,
            disposition: Disposition::Used,
            element: SELF_COLLISION.to_owned(),
            file: None,
            line: None,
            message: format!(
                "links {first:?} and {second:?} collide by their convex hulls; one of the hulls lies up to \
                 {distance:.4} m outside of its mesh, so they may push each other at that distance; load the \
                 robot with collision \"mesh\" and at most 100000 triangles a mesh, or with convex parts"
            ),
        });
    }
}

/// Refuses what collision meshes became where that is a warning, as a strict load does.
pub(super) fn refuse_proxies(mut report: LoadReport) -> Result<LoadReport, Refused> {
    let is_serious = |finding: &&mut Finding| {
        finding.element == COLLISION && finding.severity == Severity::Warning && finding.line.is_none()
    };
    let mut serious = report.findings.iter_mut().filter(is_serious);
    let Some(first) = serious.next() else { return Ok(report) };
    let (file, message) = (first.file.clone(), format!("{} (strict loading refuses this)", first.message));
    first.severity = Severity::Error;
    serious.for_each(|other| other.severity = Severity::Error);
    let named = file.as_deref().map_or_else(String::new, |file| format!(" {file:?}"));
    report.findings.push(Finding {
        severity: Severity::Error,
        disposition: Disposition::Refused,
        element: COLLISION.to_owned(),
        file,
        line: None,
        message: message.clone(),
    });
    Err(Refused { message: format!("{COLLISION}{named}: {message}"), report })
}

/// Returns a report in one line, for instance "arm: 2 links, 1 moving joint; 1 warning".
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
