//! `simctl camera list` and `view`: pictures of robots' cameras.

use std::path::PathBuf;

use anyhow::{Context as _, bail};
use clap::{Args, ValueEnum};
use png::{BitDepth, ColorType, Compression, Encoder};
use serde::Serialize;
use simd_client::{
    Client, plane_bytes,
    proto::{CameraInfo, CameraPicture, GetPictureRequest, RendererInfo},
    replace_file,
};

use crate::{
    complete,
    output::{
        Output, View,
        number::{ABSENT, exact, fixed},
        table::{Column, Page, Table},
    },
};

/// Millimetres per metre, the unit of written depths.
const MILLI: f32 = 1_000.0;

#[derive(Args, Debug)]
pub(crate) struct Picture {
    /// Name of the robot
    #[arg(add = complete::robots())]
    robot: String,
    /// Name of the sensor; the only camera of the robot if left out
    #[arg(id = "sensor", value_name = "CAMERA", add = complete::sensors(), default_value = "", hide_default_value = true)]
    camera: String,
    /// PNG file to write; CAMERA.png or ROBOT.png here if left out
    #[arg(long, value_name = "FILE")]
    file: Option<PathBuf>,
    /// Plane of the camera; its first plane if left out
    #[arg(long)]
    plane: Option<Plane>,
    /// Longest wait for the picture, seconds
    #[arg(long, default_value_t = 10.0, value_name = "SECONDS")]
    wait: f64,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Plane {
    /// Colours
    Color,
    /// 16-bit grey: millimetres along the optical axis, 0 if nothing is seen
    Depth,
    /// 16-bit grey: number of the visible link, 0 for none
    Segmentation,
}

impl Plane {
    /// Returns its word, for people and on the command line.
    fn word(self) -> &'static str {
        match self {
            Self::Color => "color",
            Self::Depth => "depth",
            Self::Segmentation => "segmentation",
        }
    }
}

pub(super) async fn list(client: &Client, output: Output) -> anyhow::Result<()> {
    let answer = client.list_cameras().await?;
    let cameras: Vec<CameraView> = answer.cameras.into_iter().map(CameraView::new).collect();
    output.list(&cameras, |cameras| page(cameras, &answer.renderers))
}

pub(super) async fn view(arguments: Picture, client: &Client, output: Output) -> anyhow::Result<()> {
    let Picture { robot, camera, file, plane, wait } = arguments;
    let name = if camera.is_empty() { &robot } else { &camera };
    let file = file.unwrap_or_else(|| PathBuf::from(format!("{name}.png")));
    let request = GetPictureRequest { robot, sensor: camera, timeout: wait, ..Default::default() };
    let picture = client.get_picture(request).await?;
    let bytes = drawn(&picture, plane)?;
    replace_file(&file, &bytes).with_context(|| format!("cannot write {}", file.display()))?;
    let stamp = picture.stamp.unwrap_or_default();
    output.one(&Saved {
        file: file.display().to_string(),
        width: picture.width,
        height: picture.height,
        step: stamp.step,
        sim_time: stamp.sim_time,
        renderer: picture.renderer,
    })
}

/// Returns the PNG file of a plane of a picture.
fn drawn(picture: &CameraPicture, wanted: Option<Plane>) -> anyhow::Result<Vec<u8>> {
    let CameraPicture { width, height, color, depth, segmentation, .. } = picture;
    let has = |plane: Plane| match plane {
        Plane::Color => color.is_some(),
        Plane::Depth => depth.is_some(),
        Plane::Segmentation => segmentation.is_some(),
    };
    let all = [Plane::Color, Plane::Depth, Plane::Segmentation];
    let Some(plane) = wanted.or_else(|| all.into_iter().find(|plane| has(*plane))) else {
        bail!("the picture is empty")
    };
    let write = |color: ColorType, depth: BitDepth, rows: Vec<u8>| -> anyhow::Result<Vec<u8>> {
        let mut file = Vec::new();
        let mut encoder = Encoder::new(&mut file, *width, *height);
        encoder.set_color(color);
        encoder.set_depth(depth);
        encoder.set_compression(Compression::Fast);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&rows)?;
        writer.finish()?;
        Ok(file)
    };
    let grey = |rows| write(ColorType::Grayscale, BitDepth::Sixteen, rows);
    let bytes_of = |numbers: Vec<u16>| numbers.into_iter().flat_map(u16::to_be_bytes).collect();
    match (plane, color, depth, segmentation) {
        (Plane::Color, Some(color), _, _) => {
            write(ColorType::Rgb, BitDepth::Eight, plane_bytes(picture, color, 3)?)
        }
        (Plane::Depth, _, Some(depth), _) => {
            let bytes = plane_bytes(picture, depth, 4)?;
            let metres = words(&bytes).map(f32::from_le_bytes);
            // Depths above 65.535 m saturate; infinite ones become 0.
            let millimetres =
                metres.map(|metres| if metres.is_finite() { (metres * MILLI) as u16 } else { 0 });
            grey(bytes_of(millimetres.collect()))
        }
        (Plane::Segmentation, _, _, Some(segmentation)) => {
            let bytes = plane_bytes(picture, segmentation, 4)?;
            let links = words(&bytes).map(u32::from_le_bytes);
            grey(bytes_of(links.map(|link| u16::try_from(link).unwrap_or(u16::MAX)).collect()))
        }
        _ => {
            let there: Vec<&str> = all.into_iter().filter(|plane| has(*plane)).map(Plane::word).collect();
            bail!("the camera has no {}: its pictures have {}", plane.word(), there.join(" and "))
        }
    }
}

/// Splits bytes into words of four.
fn words(bytes: &[u8]) -> impl Iterator<Item = [u8; 4]> {
    bytes.chunks_exact(4).filter_map(|bytes| bytes.try_into().ok())
}

#[derive(Serialize)]
struct Saved {
    file: String,
    width: u32,
    height: u32,
    /// Step of the drawn state.
    step: u64,
    sim_time: f64,
    renderer: String,
}

impl View for Saved {
    fn page(&self) -> Page {
        let Self { file, width, height, step, sim_time, renderer } = self;
        Page::of_line(format!(
            "{width} x {height} pixels of step {step}, {} s, drawn by {renderer}: {file}",
            fixed(*sim_time, 3)
        ))
    }
}

/// `CameraInfo` of the schema.
#[derive(Serialize)]
struct CameraView {
    robot: String,
    name: String,
    width: u32,
    height: u32,
    /// Pictures per simulated second; null: one each step.
    rate: Option<f64>,
    followed: bool,
    /// Step of its newest picture; null if none.
    newest_step: Option<u64>,
    /// Renderer of that picture; empty if none.
    renderer: String,
    drawn: u64,
    missed: u64,
}

impl CameraView {
    fn new(info: CameraInfo) -> Self {
        let camera = info.camera.unwrap_or_default();
        Self {
            robot: info.robot,
            name: info.sensor,
            width: camera.width,
            height: camera.height,
            rate: info.rate,
            followed: info.followed,
            newest_step: info.newest.map(|stamp| stamp.step),
            renderer: info.renderer,
            drawn: info.drawn,
            missed: info.missed,
        }
    }
}

fn page(cameras: &[CameraView], renderers: &[RendererInfo]) -> Page {
    let columns = vec![
        Column::left("ROBOT"),
        Column::left("CAMERA"),
        Column::right("PICTURE"),
        Column::right("RATE [Hz]"),
        Column::right("NEWEST STEP"),
        Column::left("DRAWN BY"),
        // Only pictures at its rate are counted.
        Column::right("DRAWN AT RATE"),
        Column::right("MISSED"),
    ];
    let row = |of: &CameraView| {
        vec![
            of.robot.clone(),
            of.name.clone(),
            format!("{} x {}", of.width, of.height),
            of.rate.map_or_else(|| "each step".to_owned(), exact),
            of.newest_step.map_or_else(|| ABSENT.to_owned(), |step| step.to_string()),
            if of.renderer.is_empty() { ABSENT.to_owned() } else { of.renderer.clone() },
            of.drawn.to_string(),
            of.missed.to_string(),
        ]
    };
    let page = Page::new().table(Table::new(columns, cameras.iter().map(row).collect()));
    let names: Vec<&str> = renderers.iter().map(|renderer| renderer.name.as_str()).collect();
    match names.is_empty() {
        true => page.line("no renderer draws this world: start `simd-camera --endpoint ...`"),
        false => page.line(format!("renderers: {}", names.join(", "))),
    }
}
