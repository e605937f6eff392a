//! Output of contacts, hits and surfaces.

use serde::Serialize;
use simd_client::proto::{Contact, LinkProperties, RayHit, Vector3};

use crate::output::{
    View,
    number::{ABSENT, exact, fixed, optional, several},
    table::{Column, Page, Table},
};

/// An item of `contact list`.
#[derive(Serialize)]
pub(super) struct ContactView {
    robot_a: String,
    link_a: String,
    robot_b: String,
    link_b: String,
    /// Metres, world.
    point: [f64; 3],
    /// Unit vector from a to b.
    normal: [f64; 3],
    depth: f64,
    normal_force: f64,
    friction_force: [f64; 3],
}

impl From<Contact> for ContactView {
    fn from(contact: Contact) -> Self {
        Self {
            robot_a: contact.robot_a,
            link_a: contact.link_a,
            robot_b: contact.robot_b,
            link_b: contact.link_b,
            point: array(contact.point),
            normal: array(contact.normal),
            depth: contact.depth,
            normal_force: contact.normal_force,
            friction_force: array(contact.friction_force),
        }
    }
}

/// Returns the table of `contact list`.
pub(super) fn contacts(contacts: &[ContactView]) -> Page {
    if contacts.is_empty() {
        return Page::of_line("nothing touches");
    }
    let columns = vec![
        Column::left("A"),
        Column::left("B"),
        Column::left("POINT m"),
        Column::left("NORMAL A TO B"),
        Column::right("DEPTH mm"),
        Column::right("NORMAL N"),
        Column::right("FRICTION N"),
    ];
    let row = |contact: &ContactView| {
        let friction = contact.friction_force.iter().map(|part| part * part).sum::<f64>().sqrt();
        vec![
            format!("{}/{}", contact.robot_a, contact.link_a),
            format!("{}/{}", contact.robot_b, contact.link_b),
            several(&contact.point, 4),
            several(&contact.normal, 3),
            fixed(contact.depth * 1e3, 4),
            fixed(contact.normal_force, 3),
            fixed(friction, 3),
        ]
    };
    Page::new().table(Table::new(columns, contacts.iter().map(row).collect()))
}

/// `contact cast`, and an item of `contact ray`.
#[derive(Serialize)]
pub(super) struct HitView {
    hit: bool,
    robot: Option<String>,
    link: Option<String>,
    /// 0 at the start of the ray, 1 at its end.
    fraction: Option<f64>,
    point: Option<[f64; 3]>,
    normal: Option<[f64; 3]>,
}

impl From<RayHit> for HitView {
    fn from(hit: RayHit) -> Self {
        let RayHit { hit: is_hit, robot, link, fraction, point, normal } = hit;
        Self {
            hit: is_hit,
            robot: is_hit.then_some(robot),
            link: is_hit.then_some(link),
            fraction: is_hit.then_some(fraction),
            point: is_hit.then(|| array(point)),
            normal: is_hit.then(|| array(normal)),
        }
    }
}

impl View for HitView {
    fn page(&self) -> Page {
        let (Some(robot), Some(link), Some(fraction), Some(point), Some(normal)) =
            (&self.robot, &self.link, self.fraction, self.point, self.normal)
        else {
            return Page::of_line("nothing is hit");
        };
        Page::new().pairs([
            ("hits", format!("{robot}/{link}")),
            ("at", format!("{} m", several(&point, 4))),
            ("normal", several(&normal, 3)),
            ("fraction", fixed(fraction, 4)),
        ])
    }
}

/// Returns the table of `contact ray --rays`, with rays numbered from 0 as in the daemon.
pub(super) fn hits(hits: &[HitView]) -> Page {
    let columns = vec![
        Column::right("RAY"),
        Column::left("HITS"),
        Column::right("FRACTION"),
        Column::left("POINT m"),
        Column::left("NORMAL"),
    ];
    let row = |(index, hit): (usize, &HitView)| {
        let several = |values: Option<[f64; 3]>, decimals: usize| {
            values.map_or_else(|| ABSENT.to_owned(), |values| several(&values, decimals))
        };
        let link = hit.robot.as_ref().zip(hit.link.as_ref());
        vec![
            index.to_string(),
            link.map_or_else(|| ABSENT.to_owned(), |(robot, link)| format!("{robot}/{link}")),
            optional(hit.fraction, 4),
            several(hit.point, 4),
            several(hit.normal, 3),
        ]
    };
    Page::new().table(Table::new(columns, hits.iter().enumerate().map(row).collect()))
}

/// An item of `contact surfaces`.
#[derive(Serialize)]
pub(super) struct SurfaceView {
    link: String,
    /// Absent if the link has no colliders.
    friction: Option<f64>,
    restitution: Option<f64>,
    /// Metres.
    rolling_friction: Option<f64>,
    spinning_friction: Option<f64>,
    /// N/m; 0 is rigid.
    contact_stiffness: Option<f64>,
    /// N s/m.
    contact_damping: Option<f64>,
}

impl From<LinkProperties> for SurfaceView {
    fn from(properties: LinkProperties) -> Self {
        let LinkProperties {
            link,
            friction,
            restitution,
            rolling_friction,
            spinning_friction,
            contact_stiffness,
            contact_damping,
            ..
        } = properties;
        Self {
            link,
            friction,
            restitution,
            rolling_friction,
            spinning_friction,
            contact_stiffness,
            contact_damping,
        }
    }
}

/// Formats a stiffness, N/m.
fn stiffness(value: f64) -> String {
    if value == 0.0 { "rigid".to_owned() } else { exact(value) }
}

/// Returns the table of `contact surfaces`.
pub(super) fn surfaces(links: &[SurfaceView]) -> Page {
    let columns = vec![
        Column::left("LINK"),
        Column::right("FRICTION"),
        Column::right("RESTITUTION"),
        Column::right("ROLLING (m)"),
        Column::right("SPINNING (m)"),
        Column::right("STIFFNESS (N/m)"),
        Column::right("DAMPING (N s/m)"),
    ];
    let row = |surface: &SurfaceView| {
        vec![
            surface.link.clone(),
            optional(surface.friction, 3),
            optional(surface.restitution, 3),
            optional(surface.rolling_friction, 6),
            optional(surface.spinning_friction, 6),
            surface.contact_stiffness.map_or_else(String::new, stiffness),
            optional(surface.contact_damping, 1),
        ]
    };
    Page::new().table(Table::new(columns, links.iter().map(row).collect()))
}

pub(super) fn array(vector: Option<Vector3>) -> [f64; 3] {
    vector.map_or([0.0; 3], |Vector3 { x, y, z }| [x, y, z])
}
