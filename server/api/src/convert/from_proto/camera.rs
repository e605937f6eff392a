//! Requests of the camera service.

use std::time::Duration;

use simd_model::robot::Sha256;
use simd_proto::text::is_printable;
use simd_proto::v1;

use super::entity::sha256;
use super::geometry::finite_vector;
use crate::convert::field::{BadField, Path};
use simd_world::handle::{BadMatrix, Drawn, Lens, Light, MAX_PIXELS, PictureView, Plane, Planes};

/// Default time limit of a picture, seconds.
const PICTURE: f64 = 10.0;
/// Maximum length of a renderer's name, bytes.
const NAME: usize = 128;
/// Maximum length of the sentence that explains a missing picture, bytes.
const SENTENCE: usize = 500;

/// Request for a picture of a robot's camera.
#[derive(Clone, Debug)]
pub struct Wanted {
    /// Robot of the camera.
    pub robot: String,
    /// Name of the camera; if empty, the robot's only one.
    pub sensor: String,
    /// Moment of the picture.
    pub moment: Moment,
    /// Longest wait.
    pub timeout: Duration,
}

/// Moment of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moment {
    /// The newest state, or a later one.
    Present,
    /// Next picture at the camera's own rate.
    Next {
        /// Sequence of the picture before it.
        after: u64,
    },
}

/// Result of a renderer.
#[derive(Clone, Debug)]
pub struct Put {
    /// Id of the task.
    pub id: u64,
    /// Name of the renderer.
    pub renderer: String,
    /// Picture, or the reason why there is none.
    pub drawn: Result<Drawn, String>,
}

/// Parses a request for a picture of a robot's camera.
pub fn wanted(request: v1::GetPictureRequest) -> Result<Wanted, BadField> {
    let v1::GetPictureRequest { robot, sensor, moment, after_sequence, timeout } = request;
    let moment = match Path::ROOT.field("moment").known(moment)? {
        v1::PictureMoment::Unspecified | v1::PictureMoment::Present => Moment::Present,
        v1::PictureMoment::Next => Moment::Next { after: after_sequence },
    };
    Ok(Wanted {
        robot: Path::ROOT.field("robot").name(robot)?,
        sensor: Path::ROOT.field("sensor").short(sensor)?,
        moment,
        timeout: seconds(timeout)?,
    })
}

/// Parses a request for a picture from any point of view; also returns its time limit.
pub fn view(request: v1::TakePictureRequest) -> Result<(PictureView, Duration), BadField> {
    let v1::TakePictureRequest { view, projection, width, height, planes, light, background, timeout } =
        request;
    let refused = |BadMatrix { element, value, expected }| Path::ROOT.field(element).refuse(value, expected);
    let lens =
        Lens::of_matrices(matrix("view", view)?, matrix("projection", projection)?).map_err(refused)?;
    for (name, pixels) in [("width", width), ("height", height)] {
        if !(1..=MAX_PIXELS).contains(&pixels) {
            let expected = format!("it must be between 1 and {MAX_PIXELS} pixels");
            return Err(Path::ROOT.field(name).refuse(pixels, expected));
        }
    }
    let v1::PicturePlanes { color, depth, segmentation } = planes.unwrap_or_default();
    let color = color || !(depth || segmentation);
    let background = background.map(|color| self::color(&Path::ROOT.field("background"), &color));
    let view = PictureView {
        width,
        height,
        lens,
        planes: Planes { color, depth, segmentation },
        light: self::light(light)?,
        background: background.transpose()?.unwrap_or([1.0; 3]),
    };
    Ok((view, seconds(timeout)?))
}

fn seconds(timeout: f64) -> Result<Duration, BadField> {
    Path::ROOT.field("timeout").seconds(timeout, 0.001..=60.0, PICTURE)
}

fn matrix(name: &str, numbers: Vec<f64>) -> Result<[f64; 16], BadField> {
    let count = numbers.len();
    let refused = |_| {
        let expected = "it must be a matrix of 4 x 4, column by column";
        Path::ROOT.field(name).refuse(format_args!("{count} numbers long"), expected)
    };
    numbers.try_into().map_err(refused)
}

fn color(at: &Path<'_>, given: &v1::Color) -> Result<[f64; 3], BadField> {
    let v1::Color { red, green, blue, alpha: _ } = *given;
    for (name, value) in [("red", red), ("green", green), ("blue", blue)] {
        at.field(name).within(value, 0.0..=1.0)?;
    }
    Ok([red, green, blue])
}

fn light(given: Option<v1::PictureLight>) -> Result<Light, BadField> {
    let (at, usual) = (Path::ROOT.field("light"), Light::default());
    let Some(given) = given else { return Ok(usual) };
    let v1::PictureLight { direction, color, ambient, diffuse, specular, shadow } = given;
    let part = |name: &str, given: Option<f64>, usual: f64| match given {
        Some(value) => at.field(name).within(value, 0.0..=1.0),
        None => Ok(usual),
    };
    let direction = direction.map(|vector| {
        let at = at.field("direction");
        let vector = finite_vector(&at, vector)?;
        match vector.length_squared() > 0.0 {
            true => Ok(vector.to_array()),
            false => Err(at.refuse("zero", "it must have a length")),
        }
    });
    let color = color.map(|color| self::color(&at.field("color"), &color));
    Ok(Light {
        direction: direction.transpose()?.unwrap_or(usual.direction),
        color: color.transpose()?.unwrap_or(usual.color),
        ambient: part("ambient", ambient, usual.ambient)?,
        diffuse: part("diffuse", diffuse, usual.diffuse)?,
        specular: part("specular", specular, usual.specular)?,
        shadow,
    })
}

/// Returns the name of a renderer that asks for work, and its longest wait.
pub fn renderer(request: v1::NextPictureRequest) -> Result<(String, Duration), BadField> {
    let v1::NextPictureRequest { renderer, timeout } = request;
    Ok((name(renderer)?, Path::ROOT.field("timeout").seconds(timeout, 0.0..=60.0, 0.0)?))
}

fn name(renderer: String) -> Result<String, BadField> {
    if (1..=NAME).contains(&renderer.len()) && renderer.chars().all(is_printable) {
        return Ok(renderer);
    }
    let expected = format!("it must be a name of 1 to {NAME} visible characters");
    Err(Path::ROOT.field("renderer").refuse(format_args!("{} bytes long", renderer.len()), expected))
}

/// Parses the result of a renderer.
pub fn put(request: v1::PutPictureRequest) -> Result<Put, BadField> {
    let v1::PutPictureRequest { id, renderer, color, depth, segmentation, error } = request;
    let renderer = name(renderer)?;
    if !error.is_empty() {
        let said: String = error.chars().filter(|c| is_printable(*c)).take(SENTENCE).collect();
        return Ok(Put { id, renderer, drawn: Err(said) });
    }
    let drawn = Drawn {
        color: plane("color", color)?,
        depth: plane("depth", depth)?,
        segmentation: plane("segmentation", segmentation)?,
    };
    Ok(Put { id, renderer, drawn: Ok(drawn) })
}

fn plane(name: &str, given: Option<v1::PicturePlane>) -> Result<Option<Plane>, BadField> {
    let Some(v1::PicturePlane { compression, data }) = given else { return Ok(None) };
    let at = Path::ROOT.field(name);
    let is_zlib = match at.field("compression").known(compression)? {
        v1::PlaneCompression::Unspecified => false,
        v1::PlaneCompression::Zlib => true,
    };
    Ok(Some(Plane { is_zlib, data: data.into() }))
}

/// Returns the digest of the requested mesh.
pub fn mesh(request: &v1::GetMeshRequest) -> Result<Sha256, BadField> {
    sha256(&Path::ROOT.field("sha256"), &request.sha256)
}
