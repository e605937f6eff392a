//! Requests of the view service.

use std::time::Duration;

use glamx::DVec3;
use simd_proto::text::is_printable;
use simd_proto::v1;

use super::geometry::{finite_vector, rotation};
use crate::convert::field::{BadField, Path};
use simd_world::handle::{InputKind, LinkColor, MarkerShape, MouseButton, NewMarker, ViewCamera};

/// Maximum number of markers in a request.
const MARKERS: usize = 4_096;
/// Maximum number of colours in a request.
const COLORS: usize = 4_096;
/// Maximum length of a text, bytes.
const TEXT: usize = 1_024;
/// Maximum length of a browser's key name, bytes.
const KEY: usize = 32;
/// Maximum number of events in a report.
const EVENTS: usize = 256;
/// Longest lifetime of a marker, seconds.
const YEAR: f64 = 365.0 * 86_400.0;
/// Maximum width of lines and dots, CSS pixels.
const WIDEST: f32 = 100.0;
/// Maximum height of a text, metres.
const HIGHEST: f64 = 1_000.0;
/// Maximum size of a page's picture, CSS pixels.
const LARGEST: u32 = 65_536;

/// Parses markers to draw.
pub fn markers(given: Vec<v1::Marker>) -> Result<Vec<NewMarker>, BadField> {
    let at = Path::ROOT.field("markers");
    if given.is_empty() {
        return Err(at.refuse("empty", "it must have at least one"));
    }
    if given.len() > MARKERS {
        return Err(
            at.refuse(format_args!("{} long", given.len()), format!("it must have at most {MARKERS}"))
        );
    }
    given
        .into_iter()
        .enumerate()
        .map(|(index, given)| marker(&Path::ROOT.item("markers", index), given))
        .collect()
}

fn marker(at: &Path<'_>, given: v1::Marker) -> Result<NewMarker, BadField> {
    let v1::Marker { id, shape, color, robot, link, life_time, version: _, owner: _ } = given;
    let shape = match at.field("shape").given(shape)? {
        v1::marker::Shape::Lines(lines) => {
            let at = at.field("lines");
            let v1::MarkerLines { points, colors, width } = lines;
            let (points, colors) = drawn(&at, points, 6, colors)?;
            MarkerShape::Lines { points, colors, width: pixels(&at.field("width"), width)? }
        }
        v1::marker::Shape::Points(dots) => {
            let at = at.field("points");
            let v1::MarkerPoints { points, colors, size } = dots;
            let (points, colors) = drawn(&at, points, 3, colors)?;
            MarkerShape::Points { points, colors, size: pixels(&at.field("size"), size)? }
        }
        v1::marker::Shape::Text(words) => text(&at.field("text"), words)?,
    };
    let color = color.map(|given| self::color(&at.field("color"), given));
    let life_time = match life_time {
        0.0 => None,
        seconds => Some(at.field("life_time").seconds(seconds, 0.0..=YEAR, 0.0)?),
    };
    if robot.is_empty() && !link.is_empty() {
        return Err(at
            .field("link")
            .refuse("given", "it must be of a robot: name that too, or leave it out"));
    }
    let (robot, link) = (at.field("robot").short(robot)?, at.field("link").short(link)?);
    Ok(NewMarker { replaces: id, shape, color: color.transpose()?, robot, link, life_time })
}

fn color(at: &Path<'_>, given: v1::Color) -> Result<[f64; 4], BadField> {
    let v1::Color { red, green, blue, alpha } = given;
    for (name, value) in [("red", red), ("green", green), ("blue", blue), ("alpha", alpha)] {
        at.field(name).within(value, 0.0..=1.0)?;
    }
    Ok([red, green, blue, alpha])
}

/// Parses new colours of links.
pub fn link_colors(given: Vec<v1::LinkColor>) -> Result<Vec<LinkColor>, BadField> {
    let at = Path::ROOT.field("colors");
    if given.is_empty() || given.len() > COLORS {
        let expected = format!("it must have 1 to {COLORS}");
        return Err(at.refuse(format_args!("{} long", given.len()), expected));
    }
    let read = |(index, given): (usize, v1::LinkColor)| {
        let at = Path::ROOT.item("colors", index);
        let v1::LinkColor { robot, link, color, layout_version: _ } = given;
        Ok(LinkColor {
            robot: at.field("robot").name(robot)?.into(),
            link: at.field("link").name(link)?.into(),
            color: color.map(|given| self::color(&at.field("color"), given)).transpose()?,
        })
    };
    given.into_iter().enumerate().map(read).collect()
}

/// Parses the points of lines or dots, with one colour per point or none.
fn drawn(
    at: &Path<'_>,
    points: Vec<f32>,
    numbers: usize,
    colors: Vec<f32>,
) -> Result<(Vec<f32>, Vec<f32>), BadField> {
    let points_at = at.field("points");
    if points.is_empty() || !points.len().is_multiple_of(numbers) {
        let expected = format!("it must have {numbers} numbers for each, and at least those of one");
        return Err(points_at.refuse(format_args!("{} numbers long", points.len()), expected));
    }
    if let Some(bad) = points.iter().find(|number| !number.is_finite()) {
        return Err(points_at.refuse(bad, "all of its numbers must be finite"));
    }
    let (elements, colors_at) = (points.len() / numbers, at.field("colors"));
    if !colors.is_empty() && colors.len() != 3 * elements {
        let expected = format!("it must be empty, or have 3 numbers for each of {elements}");
        return Err(colors_at.refuse(format_args!("{} numbers long", colors.len()), expected));
    }
    if let Some(bad) = colors.iter().find(|number| !(0.0..=1.0).contains(*number)) {
        return Err(colors_at.refuse(bad, "all of its numbers must be between 0 and 1"));
    }
    Ok((points, colors))
}

fn pixels(at: &Path<'_>, given: f32) -> Result<f32, BadField> {
    match given {
        0.0 => Ok(1.0),
        width if width > 0.0 && width <= WIDEST => Ok(width),
        width => Err(at.refuse(width, format!("it must be between 0 and {WIDEST}"))),
    }
}

fn text(at: &Path<'_>, given: v1::MarkerText) -> Result<MarkerShape, BadField> {
    let v1::MarkerText { text, position, orientation, size } = given;
    let text_at = at.field("text");
    if text.is_empty() || text.len() > TEXT {
        let expected = format!("it must have 1 to {TEXT}");
        return Err(text_at.refuse(format_args!("{} bytes long", text.len()), expected));
    }
    let text = visible(&text_at, text)?;
    let position = match position {
        Some(position) => finite_vector(&at.field("position"), position)?,
        None => DVec3::ZERO,
    };
    let orientation =
        orientation.map(|orientation| rotation(&at.field("orientation"), orientation)).transpose()?;
    let size = match size {
        0.0 => 0.1,
        size => at.field("size").within(size, 1e-4..=HIGHEST)?,
    };
    Ok(MarkerShape::Text { text, position, orientation, size })
}

/// Parses the new position, target and field of view of a camera.
pub fn set_camera(given: &v1::SetCameraRequest) -> Result<(DVec3, DVec3, f64), BadField> {
    let position = given_vector("position", given.position)?;
    let target_at = Path::ROOT.field("target");
    let target = given_vector("target", given.target)?;
    if position == target {
        return Err(target_at.refuse("the place of the camera", "it must be another point"));
    }
    let field = match given.field_of_view {
        0.0 => 0.0,
        field => Path::ROOT.field("field_of_view").within(field, 0.01..=3.0)?,
    };
    Ok((position, target, field))
}

fn given_vector(name: &str, given: Option<v1::Vector3>) -> Result<DVec3, BadField> {
    let at = Path::ROOT.field(name);
    finite_vector(&at, at.given(given)?)
}

/// Parses the present camera of a page.
pub fn camera(given: v1::ViewCamera) -> Result<ViewCamera, BadField> {
    let at = Path::ROOT.field("camera");
    let v1::ViewCamera { position, target, up, field_of_view, width, height } = given;
    let vector = |name: &str, given| {
        let at = at.field(name);
        finite_vector(&at, at.given(given)?)
    };
    let (position, target, up) =
        (vector("position", position)?, vector("target", target)?, vector("up", up)?);
    at.field("field_of_view").within(field_of_view, 1e-3..=std::f64::consts::PI)?;
    for (name, value) in [("width", width), ("height", height)] {
        at.field(name).within(value.into(), 1.0..=LARGEST.into())?;
    }
    Ok(ViewCamera { position, target, up, field_of_view, size: [width, height] })
}

/// Parses input events of a page.
pub fn input(given: Vec<v1::InputEvent>) -> Result<Vec<InputKind>, BadField> {
    if given.len() > EVENTS {
        let at = Path::ROOT.field("input");
        return Err(at.refuse(format_args!("{} long", given.len()), format!("it must have at most {EVENTS}")));
    }
    given
        .into_iter()
        .enumerate()
        .map(|(index, given)| event(&Path::ROOT.item("input", index), given))
        .collect()
}

fn event(at: &Path<'_>, given: v1::InputEvent) -> Result<InputKind, BadField> {
    match at.field("kind").given(given.kind)? {
        v1::input_event::Kind::Key(v1::KeyInput { key, code, is_down }) => {
            let at = at.field("key");
            let (key, code) = (key_name(&at.field("key"), key)?, key_name(&at.field("code"), code)?);
            Ok(InputKind::Key { key, code, is_down })
        }
        v1::input_event::Kind::Mouse(v1::MouseInput { x, y, button, is_down }) => {
            let at = at.field("mouse");
            let button = match at.field("button").known(button)? {
                v1::MouseButton::Unspecified => None,
                v1::MouseButton::Left => Some(MouseButton::Left),
                v1::MouseButton::Middle => Some(MouseButton::Middle),
                v1::MouseButton::Right => Some(MouseButton::Right),
            };
            let at = [at.field("x").finite(x)?, at.field("y").finite(y)?];
            Ok(InputKind::Mouse { at, button, is_down })
        }
    }
}

/// Accepts a key's name or code, which may be empty: some keys have no code, and some no name.
fn key_name(at: &Path<'_>, given: String) -> Result<String, BadField> {
    if given.len() > KEY {
        let expected = format!("it must have at most {KEY}");
        return Err(at.refuse(format_args!("{} bytes long", given.len()), expected));
    }
    visible(at, given)
}

/// Accepts text that can be shown unchanged.
fn visible(at: &Path<'_>, given: String) -> Result<String, BadField> {
    if !given.chars().all(is_printable) {
        let shown = simd_proto::text::printable(&given);
        return Err(at.refuse(format_args!("\"{shown}\""), "all of its characters must be visible"));
    }
    Ok(given)
}

/// Returns the longest wait of NextView and NextInput.
pub fn next_timeout(seconds: f64) -> Result<Duration, BadField> {
    Path::ROOT.field("timeout").seconds(seconds, 0.0..=60.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(points: Vec<f32>, colors: Vec<f32>) -> v1::Marker {
        let lines = v1::MarkerLines { points, colors, width: 0.0 };
        v1::Marker { shape: Some(v1::marker::Shape::Lines(lines)), ..Default::default() }
    }

    fn words(text: &str) -> v1::Marker {
        let text = v1::MarkerText { text: text.into(), ..Default::default() };
        v1::Marker { shape: Some(v1::marker::Shape::Text(text)), ..Default::default() }
    }

    #[test]
    fn absent_fields_of_a_marker_have_defaults() {
        let read = markers(vec![lines(vec![0.0; 12], vec![1.0; 6]), words("here")]).unwrap();
        let expected = MarkerShape::Lines { points: vec![0.0; 12], colors: vec![1.0; 6], width: 1.0 };
        assert_eq!((&read[0].shape, read[0].color, read[0].life_time), (&expected, None, None));
        let (position, orientation) = (DVec3::ZERO, None);
        let expected = MarkerShape::Text { text: "here".into(), position, orientation, size: 0.1 };
        assert_eq!(read[1].shape, expected);
    }

    #[test]
    fn invalid_markers_are_refused_by_the_path_of_their_field() {
        let color = |alpha| Some(v1::Color { red: 0.0, green: 0.0, blue: 0.0, alpha });
        let fine = || lines(vec![0.0; 6], Vec::new());
        let long = "x".repeat(TEXT + 1);
        for (marker, field) in [
            (v1::Marker::default(), "markers[0].shape"),
            (lines(Vec::new(), Vec::new()), "markers[0].lines.points"),
            (lines(vec![0.0; 7], Vec::new()), "markers[0].lines.points"),
            (lines(vec![f32::NAN; 6], Vec::new()), "markers[0].lines.points"),
            (lines(vec![0.0; 6], vec![0.0; 6]), "markers[0].lines.colors"),
            (lines(vec![0.0; 6], vec![0.0, 0.0, 1.5]), "markers[0].lines.colors"),
            (lines(vec![0.0; 6], vec![0.0, 0.0, f32::NAN]), "markers[0].lines.colors"),
            (words(""), "markers[0].text.text"),
            (words(&long), "markers[0].text.text"),
            (words("a\u{1b}[31m"), "markers[0].text.text"),
            (v1::Marker { color: color(1.5), ..fine() }, "markers[0].color.alpha"),
            (v1::Marker { life_time: -1.0, ..fine() }, "markers[0].life_time"),
            (v1::Marker { life_time: f64::INFINITY, ..fine() }, "markers[0].life_time"),
            (v1::Marker { link: "hand".into(), ..fine() }, "markers[0].link"),
        ] {
            assert_eq!(markers(vec![marker]).unwrap_err().field, field);
        }
        assert_eq!(markers(Vec::new()).unwrap_err().field, "markers");
        assert_eq!(markers(vec![fine(); MARKERS + 1]).unwrap_err().field, "markers");
    }

    #[test]
    fn invalid_link_colours_are_refused_by_the_path_of_their_field() {
        let color = |red| Some(v1::Color { red, green: 0.0, blue: 0.0, alpha: 1.0 });
        let fine = || v1::LinkColor {
            robot: "arm".into(),
            link: "hand".into(),
            color: color(1.0),
            layout_version: 7,
        };
        assert_eq!(link_colors(vec![fine()]).unwrap()[0].color, Some([1.0, 0.0, 0.0, 1.0]));
        assert_eq!(link_colors(vec![v1::LinkColor { color: None, ..fine() }]).unwrap()[0].color, None);
        for (given, field) in [
            (v1::LinkColor { color: color(1.5), ..fine() }, "colors[0].color.red"),
            (v1::LinkColor { color: color(f64::NAN), ..fine() }, "colors[0].color.red"),
            (v1::LinkColor { robot: String::new(), ..fine() }, "colors[0].robot"),
            (v1::LinkColor { link: String::new(), ..fine() }, "colors[0].link"),
        ] {
            assert_eq!(link_colors(vec![given]).unwrap_err().field, field);
        }
        assert_eq!(link_colors(Vec::new()).unwrap_err().field, "colors");
        assert_eq!(link_colors(vec![fine(); COLORS + 1]).unwrap_err().field, "colors");
    }

    #[test]
    fn a_camera_looks_at_another_point_than_where_it_is() {
        let at = |x| Some(v1::Vector3 { x, y: 0.0, z: 1.0 });
        let request = |position, target, field_of_view| v1::SetCameraRequest {
            position,
            target,
            field_of_view,
            ..Default::default()
        };
        assert!(set_camera(&request(at(0.0), at(1.0), 0.5)).is_ok());
        for (request, field) in [
            (request(None, at(1.0), 0.0), "position"),
            (request(at(0.0), None, 0.0), "target"),
            (request(at(1.0), at(1.0), 0.0), "target"),
            (request(at(f64::NAN), at(1.0), 0.0), "position.x"),
            (request(at(0.0), at(1.0), 4.0), "field_of_view"),
        ] {
            assert_eq!(set_camera(&request).unwrap_err().field, field);
        }
    }

    #[test]
    fn reports_of_pages_are_bounded() {
        let key = |key: &str| {
            let key = v1::KeyInput { key: key.into(), code: String::new(), is_down: true };
            v1::InputEvent { kind: Some(v1::input_event::Kind::Key(key)), ..Default::default() }
        };
        assert_eq!(input(vec![key("a"); EVENTS]).unwrap().len(), EVENTS);
        assert_eq!(input(vec![key("a"); EVENTS + 1]).unwrap_err().field, "input");
        assert_eq!(input(vec![key(&"a".repeat(KEY + 1))]).unwrap_err().field, "input[0].key.key");
        assert_eq!(
            input(vec![key("\u{1b}[31m")]).unwrap_err().to_string(),
            "input[0].key.key is \"\\u{1b}[31m\"; all of its characters must be visible"
        );
        assert_eq!(input(vec![v1::InputEvent::default()]).unwrap_err().field, "input[0].kind");
        let x = f64::NAN;
        let moved = v1::MouseInput { x, ..Default::default() };
        let moved = v1::InputEvent { kind: Some(v1::input_event::Kind::Mouse(moved)), ..Default::default() };
        assert_eq!(input(vec![moved]).unwrap_err().field, "input[0].mouse.x");
    }
}
