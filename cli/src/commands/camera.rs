//! `simctl camera`: pictures of robots' cameras, and cameras of open pages.

mod picture;

use clap::{Args, Subcommand};
use serde::Serialize;
use simd_client::{
    Client,
    proto::{PageCamera, Vector3},
};

use crate::{
    output::{
        Output, View, json,
        number::{fixed, several},
        table::{Column, Page, Table},
    },
    pose,
};

#[derive(Debug, Subcommand)]
pub(crate) enum Camera {
    /// Shows the cameras of the open pages; the one that moved last comes first
    Get,
    /// Moves the cameras of all pages
    Set(Set),
    /// Shows the cameras of robots, and the renderers that draw their pictures
    List,
    /// Saves a picture of a robot's camera as a PNG file
    View(picture::Picture),
}

#[derive(Args, Debug)]
pub(crate) struct Set {
    /// New position of the cameras, world axes, metres
    #[arg(value_name = "X,Y,Z", value_parser = pose::parse_vector, allow_hyphen_values = true)]
    position: Vector3,
    /// Point to look at, world axes, metres
    #[arg(long, value_name = "X,Y,Z", value_parser = pose::parse_vector, allow_hyphen_values = true, default_value = "0,0,0")]
    target: Vector3,
    /// Vertical field of view, degrees; unchanged if left out
    #[arg(long, value_name = "DEGREES", allow_negative_numbers = true)]
    field_of_view: Option<f64>,
}

pub(crate) async fn run(command: Camera, client: &Client, output: Output) -> anyhow::Result<()> {
    match command {
        Camera::Get => {
            let views: Vec<CameraView> =
                client.cameras().await?.cameras.into_iter().map(CameraView::new).collect();
            output.list(&views, list)
        }
        Camera::Set(Set { position, target, field_of_view }) => {
            let version = client.set_camera(position, target, field_of_view.map(f64::to_radians)).await?;
            output.one(&Changed { version })
        }
        Camera::List => picture::list(client, output).await,
        Camera::View(arguments) => picture::view(arguments, client, output).await,
    }
}

#[derive(Serialize)]
struct Changed {
    /// Version that pages report once they have followed.
    version: u64,
}

impl View for Changed {
    fn page(&self) -> Page {
        Page::of_line("cameras moved")
    }
}

/// `PageCamera` of the schema: metres, radians, CSS pixels.
#[derive(Serialize)]
struct CameraView {
    client: String,
    position: [f64; 3],
    target: [f64; 3],
    field_of_view: f64,
    width: u32,
    height: u32,
    /// Seconds since it last moved.
    age: f64,
    followed_version: u64,
}

impl CameraView {
    fn new(page: PageCamera) -> Self {
        let camera = page.camera.unwrap_or_default();
        let vector = |vector: &Option<Vector3>| vector.as_ref().map(json::vector).unwrap_or_default();
        Self {
            client: page.client,
            position: vector(&camera.position),
            target: vector(&camera.target),
            field_of_view: camera.field_of_view,
            width: camera.width,
            height: camera.height,
            age: page.age,
            followed_version: page.followed_version,
        }
    }
}

fn list(views: &[CameraView]) -> Page {
    let columns = vec![
        Column::left("PAGE"),
        Column::right("POSITION [m]"),
        Column::right("TARGET [m]"),
        Column::right("FIELD OF VIEW [deg]"),
        Column::right("PICTURE"),
        Column::right("MOVED [s ago]"),
    ];
    let row = |of: &CameraView| {
        vec![
            of.client.clone(),
            several(&of.position, 3),
            several(&of.target, 3),
            fixed(of.field_of_view.to_degrees(), 1),
            format!("{} x {}", of.width, of.height),
            fixed(of.age, 1),
        ]
    };
    Page::new().table(Table::new(columns, views.iter().map(row).collect()))
}
