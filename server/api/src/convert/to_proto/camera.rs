//! Answers of the camera service.

use simd_model::sensor::SensorKind;
use simd_proto::v1::{self, sensor::Kind};

use super::{entity, sensor, stamp};
use simd_world::handle::{
    CameraName, CameraReport, Intrinsics, Light, Picture, PictureRobot, PictureTask, PictureView, Plane,
    Planes, RendererStatus, intrinsics,
};

/// Maximum bytes of a message in addition to the planes of a picture: names and framing.
const BESIDE_PLANES: u64 = 4_096;

/// Converts a camera of a robot.
pub fn report(report: CameraReport) -> v1::CameraInfo {
    let CameraReport {
        name: CameraName { robot, sensor: name },
        camera,
        rate,
        followed,
        newest,
        drawn,
        missed,
    } = report;
    let numbers = intrinsics(&camera);
    let camera = match sensor::kind(SensorKind::Camera(camera)) {
        Kind::Camera(camera) => Some(camera),
        _ => None,
    };
    v1::CameraInfo {
        robot,
        sensor: name,
        camera,
        intrinsics: Some(self::numbers(numbers)),
        rate,
        followed,
        newest: newest.as_ref().map(|picture| moment(picture)),
        last_sequence: newest.as_ref().map_or(0, |picture| picture.sequence),
        renderer: newest.as_ref().map(|picture| picture.renderer.to_string()).unwrap_or_default(),
        drawn,
        missed,
    }
}

/// Converts an active renderer.
pub fn renderer(status: RendererStatus) -> v1::RendererInfo {
    let RendererStatus { name, drawn, drawing, failed } = status;
    let drawing = u32::try_from(drawing).unwrap_or(u32::MAX);
    v1::RendererInfo { name: name.to_string(), drawn, drawing, failed }
}

/// Converts a camera's picture.
pub fn picture(picture: &Picture) -> v1::CameraPicture {
    let PictureView { width, height, lens, .. } = &picture.view;
    let robot = |of: &PictureRobot| {
        let PictureRobot { robot, first_link, links } = of;
        v1::PictureRobot { robot: robot.clone(), first_link: *first_link, links: *links }
    };
    v1::CameraPicture {
        sequence: picture.sequence,
        stamp: Some(moment(picture)),
        width: *width,
        height: *height,
        color: picture.drawn.color.as_ref().map(plane),
        depth: picture.drawn.depth.as_ref().map(plane),
        segmentation: picture.drawn.segmentation.as_ref().map(plane),
        robots: picture.robots.iter().map(robot).collect(),
        view: lens.view.to_vec(),
        projection: lens.projection.to_vec(),
        intrinsics: lens.intrinsics.map(numbers),
        near: lens.near,
        far: lens.far,
        renderer: picture.renderer.to_string(),
    }
}

fn moment(picture: &Picture) -> v1::Stamp {
    stamp::stamp(picture.at, Some(picture.wall_time), picture.state_sequence)
}

fn plane(plane: &Plane) -> v1::PicturePlane {
    let Plane { is_zlib, data } = plane;
    let compression = if *is_zlib { v1::PlaneCompression::Zlib } else { v1::PlaneCompression::Unspecified };
    v1::PicturePlane { compression: compression.into(), data: data.to_vec() }
}

fn numbers(Intrinsics { fx, fy, cx, cy }: Intrinsics) -> v1::CameraIntrinsics {
    v1::CameraIntrinsics { fx, fy, cx, cy }
}

/// Converts a task for a renderer, where a message may have at most `message_bytes`.
pub fn task(task: &PictureTask, message_bytes: u64) -> v1::PictureTask {
    let PictureTask { id, order, time_left } = task;
    let PictureView { width, height, lens, planes, light, background } = &order.view;
    let (robot, sensor) = match &order.camera {
        Some((_, CameraName { robot, sensor })) => (robot.clone(), sensor.clone()),
        None => Default::default(),
    };
    let Planes { color, depth, segmentation } = *planes;
    let state = &order.state.state;
    let robots = state.world.entities.iter().enumerate();
    v1::PictureTask {
        id: *id,
        robot,
        sensor,
        width: *width,
        height: *height,
        view: lens.view.to_vec(),
        projection: lens.projection.to_vec(),
        intrinsics: lens.intrinsics.map(numbers),
        near: lens.near,
        far: lens.far,
        planes: Some(v1::PicturePlanes { color, depth, segmentation }),
        light: Some(self::light(light)),
        background: Some(opaque(*background)),
        stamp: Some(stamp::published(&order.state)),
        robots: robots.map(|(index, robot)| entity::link_poses(state, index, robot)).collect(),
        time_left: time_left.as_secs_f64(),
        max_bytes: message_bytes.saturating_sub(BESIDE_PLANES),
    }
}

fn light(light: &Light) -> v1::PictureLight {
    let Light { direction: [x, y, z], color, ambient, diffuse, specular, shadow } = *light;
    v1::PictureLight {
        direction: Some(v1::Vector3 { x, y, z }),
        color: Some(opaque(color)),
        ambient: Some(ambient),
        diffuse: Some(diffuse),
        specular: Some(specular),
        shadow,
    }
}

fn opaque([red, green, blue]: [f64; 3]) -> v1::Color {
    v1::Color { red, green, blue, alpha: 1.0 }
}
