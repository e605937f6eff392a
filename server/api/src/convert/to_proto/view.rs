//! Answers of the view service.

use simd_proto::v1;
use tokio::time::Instant;

use super::geometry;
use simd_world::handle::{
    CameraTarget, GivenColor, InputEvent, InputKind, Marker, MarkerShape, MouseButton, PageCamera,
    ViewCamera, ViewChange,
};

/// Converts a marker, as it is at this time.
pub fn marker(marker: &Marker, now: Instant) -> v1::Marker {
    let shape = match marker.shape.clone() {
        MarkerShape::Lines { points, colors, width } => {
            v1::marker::Shape::Lines(v1::MarkerLines { points, colors, width })
        }
        MarkerShape::Points { points, colors, size } => {
            v1::marker::Shape::Points(v1::MarkerPoints { points, colors, size })
        }
        MarkerShape::Text { text, position, orientation, size } => v1::marker::Shape::Text(v1::MarkerText {
            text,
            position: Some(geometry::vector(position)),
            orientation: orientation.map(geometry::rotation),
            size,
        }),
    };
    let color = marker.color.map(|[red, green, blue, alpha]| v1::Color { red, green, blue, alpha });
    v1::Marker {
        id: marker.id,
        shape: Some(shape),
        color,
        robot: marker.robot.clone(),
        link: marker.link.clone(),
        life_time: marker.expires.map_or(0.0, |at| at.saturating_duration_since(now).as_secs_f64()),
        version: marker.version,
        owner: marker.owner.to_string(),
    }
}

/// Converts the changes for a page.
pub fn change(change: &ViewChange, now: Instant) -> v1::NextViewResponse {
    v1::NextViewResponse {
        version: change.version,
        whole: change.whole,
        markers: change.markers.iter().map(|it| marker(it, now)).collect(),
        deleted: change.deleted.clone(),
        camera: change.camera.map(camera_target),
        colors: change.colors.as_ref().map(|given| v1::LinkColors {
            colors: given.iter().map(|((robot, link), color)| link_color(robot, link, *color)).collect(),
        }),
        wants_input: change.asks.is_some(),
        input_client: change.asks.as_deref().unwrap_or_default().to_owned(),
    }
}

fn link_color(robot: &str, link: &str, given: GivenColor) -> v1::LinkColor {
    let GivenColor { color: [red, green, blue, alpha], layout_version } = given;
    let color = Some(v1::Color { red, green, blue, alpha });
    v1::LinkColor { robot: robot.to_owned(), link: link.to_owned(), color, layout_version }
}

/// Converts the requested camera.
pub fn camera_target(target: CameraTarget) -> v1::CameraTarget {
    let CameraTarget { version, position, target, field_of_view } = target;
    let (position, target) = (Some(geometry::vector(position)), Some(geometry::vector(target)));
    v1::CameraTarget { version, position, target, field_of_view }
}

/// Converts the camera of a page.
pub fn page_camera(page: &PageCamera) -> v1::PageCamera {
    let ViewCamera { position, target, up, field_of_view, size: [width, height] } = page.camera;
    let camera = v1::ViewCamera {
        position: Some(geometry::vector(position)),
        target: Some(geometry::vector(target)),
        up: Some(geometry::vector(up)),
        field_of_view,
        width,
        height,
    };
    v1::PageCamera {
        client: page.client.to_string(),
        camera: Some(camera),
        age: page.age.as_secs_f64(),
        followed_version: page.followed,
    }
}

/// Converts an input event of a page.
pub fn input(event: &InputEvent) -> v1::InputEvent {
    let kind = match event.kind.clone() {
        InputKind::Key { key, code, is_down } => {
            v1::input_event::Kind::Key(v1::KeyInput { key, code, is_down })
        }
        InputKind::Mouse { at: [x, y], button, is_down } => {
            let button = match button {
                None => v1::MouseButton::Unspecified,
                Some(MouseButton::Left) => v1::MouseButton::Left,
                Some(MouseButton::Middle) => v1::MouseButton::Middle,
                Some(MouseButton::Right) => v1::MouseButton::Right,
            };
            v1::input_event::Kind::Mouse(v1::MouseInput { x, y, button: button.into(), is_down })
        }
    };
    v1::InputEvent { sequence: event.sequence, client: event.client.to_string(), kind: Some(kind) }
}
