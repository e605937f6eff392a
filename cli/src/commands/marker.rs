//! `simctl marker`: lines, points and texts that pages draw in addition to the world.

use clap::{Args, Subcommand};
use serde::Serialize;
use simd_client::{
    Client, lines, points,
    proto::{Color, Marker as Wire, Vector3, marker::Shape},
    text,
};

use super::taking_over;
use crate::{
    output::{
        Output, View,
        number::{ABSENT, count, fixed},
        table::{Column, Page, Table},
    },
    pose,
};

#[derive(Debug, Subcommand)]
pub(crate) enum Marker {
    /// Adds a line, a point or a text, and prints its id
    #[command(subcommand)]
    Add(Add),
    /// Shows the markers, in the order in which they were added
    List,
    /// Deletes markers
    Delete {
        /// Ids of the markers
        #[arg(required_unless_present = "all", conflicts_with = "all", value_name = "ID")]
        ids: Vec<u64>,
        /// Delete all markers except those of other owners
        #[arg(long)]
        all: bool,
        /// Also delete markers of other owners: for admins
        #[arg(long)]
        take_over: bool,
    },
}

#[derive(Debug, Subcommand)]
pub(crate) enum Add {
    /// A straight line
    Line {
        /// Start of the line, metres
        #[arg(value_name = "X,Y,Z", value_parser = pose::parse_vector, allow_hyphen_values = true)]
        from: Vector3,
        /// End of the line, metres
        #[arg(value_name = "X,Y,Z", value_parser = pose::parse_vector, allow_hyphen_values = true)]
        to: Vector3,
        /// CSS pixels
        #[arg(long, default_value_t = 1.0, value_name = "PIXELS", allow_negative_numbers = true)]
        width: f32,
        #[command(flatten)]
        common: Common,
    },
    /// A dot
    Point {
        /// Position, metres
        #[arg(value_name = "X,Y,Z", value_parser = pose::parse_vector, allow_hyphen_values = true)]
        position: Vector3,
        /// CSS pixels
        #[arg(long, default_value_t = 6.0, value_name = "PIXELS", allow_negative_numbers = true)]
        size: f32,
        #[command(flatten)]
        common: Common,
    },
    /// A text that faces the camera
    Text {
        /// The text
        text: String,
        /// Start of the text, metres
        #[arg(value_name = "X,Y,Z", value_parser = pose::parse_vector, allow_hyphen_values = true)]
        position: Vector3,
        /// Height of a line, metres
        #[arg(long, default_value_t = 0.1, value_name = "METRES", allow_negative_numbers = true)]
        size: f64,
        #[command(flatten)]
        common: Common,
    },
}

/// Options of all markers.
#[derive(Args, Debug)]
pub(crate) struct Common {
    /// Red, green and blue, from 0 to 1; a colour that is visible in the page if left out
    #[arg(long, value_name = "R,G,B", value_parser = pose::parse_vector)]
    color: Option<Vector3>,
    /// Robot or link that the marker moves with; positions are then in the link's frame
    #[arg(long, value_name = "ROBOT[/LINK]")]
    on: Option<String>,
    /// Seconds until the marker disappears; if left out, it stays until it is deleted
    #[arg(
        long,
        default_value_t = 0.0,
        hide_default_value = true,
        value_name = "SECONDS",
        allow_negative_numbers = true
    )]
    seconds: f64,
    /// Id of the marker to replace
    #[arg(long, default_value_t = 0, hide_default_value = true, value_name = "ID")]
    replace: u64,
}

pub(crate) async fn run(command: Marker, client: &Client, output: Output) -> anyhow::Result<()> {
    match command {
        Marker::Add(add) => {
            let ids = client.add_markers([marker(add)], false).await?;
            output.one(&Added { ids })
        }
        Marker::List => {
            let views: Vec<MarkerView> = client.markers().await?.iter().map(MarkerView::new).collect();
            output.list(&views, list)
        }
        // No ids means all of them: clap requires one of the two.
        Marker::Delete { ids, all: _, take_over } => {
            let deleted = taking_over(client, take_over).delete_markers(ids).await?;
            output.one(&Deleted { deleted })
        }
    }
}

#[allow(clippy::cast_possible_truncation, reason = "pages draw with this precision")]
fn short(point: &Vector3) -> [f32; 3] {
    [point.x as f32, point.y as f32, point.z as f32]
}

fn marker(add: Add) -> Wire {
    let (marker, common) = match add {
        Add::Line { from, to, width, common } => (lines(&[[short(&from), short(&to)]], width), common),
        Add::Point { position, size, common } => (points(&[short(&position)], size), common),
        Add::Text { text: words, position, size, common } => (text(words, position, size), common),
    };
    let Common { color, on, seconds, replace } = common;
    let (robot, link) = on.as_deref().map_or(("", ""), |on| on.split_once('/').unwrap_or((on, "")));
    Wire {
        id: replace,
        color: color.map(|Vector3 { x, y, z }| Color { red: x, green: y, blue: z, alpha: 1.0 }),
        robot: robot.to_owned(),
        link: link.to_owned(),
        life_time: seconds,
        ..marker
    }
}

#[derive(Serialize)]
struct Added {
    ids: Vec<u64>,
}

impl View for Added {
    fn page(&self) -> Page {
        let ids: Vec<String> = self.ids.iter().map(u64::to_string).collect();
        Page::of_line(format!("marker {} added", ids.join(", ")))
    }
}

#[derive(Serialize)]
struct Deleted {
    deleted: Vec<u64>,
}

impl View for Deleted {
    fn page(&self) -> Page {
        Page::of_line(format!("{} deleted", count(self.deleted.len(), "marker")))
    }
}

/// A marker without its points, of which there may be very many.
#[derive(Serialize)]
struct MarkerView {
    id: u64,
    /// `lines`, `points` or `text`.
    kind: &'static str,
    /// Number of lines or points.
    count: Option<usize>,
    text: Option<String>,
    /// Null: the world.
    robot: Option<String>,
    /// Null: the root link.
    link: Option<String>,
    /// Remaining seconds; null: no limit.
    life_time: Option<f64>,
    owner: String,
}

impl MarkerView {
    fn new(marker: &Wire) -> Self {
        let (kind, count, text) = match &marker.shape {
            Some(Shape::Lines(lines)) => ("lines", Some(lines.points.len() / 6), None),
            Some(Shape::Points(points)) => ("points", Some(points.points.len() / 3), None),
            Some(Shape::Text(text)) => ("text", None, Some(text.text.clone())),
            // A newer daemon may have kinds that this client does not know.
            None => ("unknown", None, None),
        };
        let some = |text: &str| Some(text.to_owned()).filter(|text| !text.is_empty());
        Self {
            id: marker.id,
            kind,
            count,
            text,
            robot: some(&marker.robot),
            link: some(&marker.link),
            life_time: Some(marker.life_time).filter(|left| *left > 0.0),
            owner: marker.owner.clone(),
        }
    }

    fn place(&self) -> String {
        match (&self.robot, &self.link) {
            (Some(robot), Some(link)) => format!("{robot}/{link}"),
            (Some(robot), None) => robot.clone(),
            (None, _) => "world".to_owned(),
        }
    }

    fn content(&self) -> String {
        match (&self.text, self.count) {
            (Some(text), _) => text.clone(),
            (None, Some(number)) => count(number, if self.kind == "lines" { "line" } else { "point" }),
            (None, None) => ABSENT.to_owned(),
        }
    }
}

fn list(views: &[MarkerView]) -> Page {
    let columns = vec![
        Column::right("MARKER"),
        Column::left("KIND"),
        Column::left("CONTENT"),
        Column::left("ON"),
        Column::right("LEFT [s]"),
        Column::left("OWNER"),
    ];
    let row = |of: &MarkerView| {
        vec![
            of.id.to_string(),
            of.kind.to_owned(),
            of.content(),
            of.place(),
            of.life_time.map_or_else(|| ABSENT.to_owned(), |left| fixed(left, 1)),
            of.owner.clone(),
        ]
    };
    Page::new().table(Table::new(columns, views.iter().map(row).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(x: f64) -> Vector3 {
        Vector3 { x, y: 0.0, z: 0.0 }
    }

    #[test]
    fn a_line_is_drawn_on_its_link() {
        let common =
            Common { color: Some(at(1.0)), on: Some("arm/tip link".into()), seconds: 2.0, replace: 7 };
        let made = marker(Add::Line { from: at(0.0), to: at(1.0), width: 3.0, common });
        let Some(Shape::Lines(lines)) = &made.shape else { panic!("{made:?}") };
        assert_eq!(lines.points, [0.0, 0.0, 0.0, 1.0, 0.0, 0.0]);
        assert_eq!((made.id, made.robot.as_str(), made.link.as_str()), (7, "arm", "tip link"));
        assert_eq!((made.life_time, made.color.unwrap().red), (2.0, 1.0));
        let view = MarkerView::new(&made);
        assert_eq!((view.content(), view.place()), ("1 line".to_owned(), "arm/tip link".to_owned()));
    }
}
