//! Converts the daemon's tasks to scenes, and pictures to answers.

use std::io::Write as _;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use glamx::{DAffine3, DMat4, DQuat, DVec3};
use simd_client::proto::{
    Color, PictureLight, PicturePlane, PictureTask, PlaneCompression, PutPictureRequest, RobotLinkPoses,
};

use crate::appearance::Appearance;
use crate::scene::{Item, Light, Picture, Planes, Scene};

/// Numbers of a link's pose: x y z, then the quaternion x y z w.
const POSE: usize = 7;

/// Returns the scene of a task with the robots' appearances. The error is a fragment of a sentence.
pub(crate) fn scene(task: &PictureTask, appearances: &[Appearance]) -> Result<Scene, String> {
    let planes = task.planes.unwrap_or_default();
    let mut planes = Planes { color: planes.color, depth: planes.depth, segmentation: planes.segmentation };
    if planes == Planes::default() {
        planes.color = true;
    }
    let mut items = Vec::new();
    let mut first_id = 1_u32;
    for (robot, appearance) in task.robots.iter().zip(appearances) {
        put_robot(&mut items, robot, appearance, first_id)?;
        let links = u32::try_from(robot.poses.len() / POSE).unwrap_or(u32::MAX);
        first_id = first_id.saturating_add(links);
    }
    Ok(Scene {
        width: task.width,
        height: task.height,
        view: matrix(&task.view, "view")?,
        projection: matrix(&task.projection, "projection")?,
        planes,
        light: light(task.light.as_ref()),
        background: rgb(task.background.as_ref()),
        items,
    })
}

fn put_robot(
    items: &mut Vec<Item>,
    robot: &RobotLinkPoses,
    appearance: &Appearance,
    first_id: u32,
) -> Result<(), String> {
    for shape in appearance.iter() {
        let at = POSE * shape.link;
        let Some([x, y, z, qx, qy, qz, qw]) = robot.poses.get(at..at + POSE) else {
            return Err(format!("the task has no pose for link {} of robot `{}`", shape.link, robot.robot));
        };
        let turn = DQuat::from_xyzw(*qx, *qy, *qz, *qw);
        let world_from_link = DAffine3::from_rotation_translation(turn, DVec3::new(*x, *y, *z));
        let world_from_mesh = world_from_link * shape.link_from_mesh;
        if !world_from_mesh.is_finite() {
            return Err(format!("the pose of link {} of robot `{}` is not finite", shape.link, robot.robot));
        }
        let id = first_id.saturating_add(u32::try_from(shape.link).unwrap_or(u32::MAX));
        items.push(Item { surface: shape.surface.clone(), world_from_mesh, color: shape.color, id });
    }
    Ok(())
}

fn matrix(numbers: &[f64], name: &str) -> Result<DMat4, String> {
    let numbers: &[f64; 16] = numbers
        .try_into()
        .map_err(|_| format!("the task's {name} has {} numbers and not 16", numbers.len()))?;
    let matrix = DMat4::from_cols_array(numbers);
    if matrix.is_finite() { Ok(matrix) } else { Err(format!("the task's {name} is not finite")) }
}

/// Returns the light of a task; missing values are the schema's defaults.
fn light(light: Option<&PictureLight>) -> Light {
    let aside = DVec3::new(-0.5, 0.3, 1.0);
    let direction = light.and_then(|light| light.direction.as_ref());
    let direction = direction.map_or(aside, |towards| DVec3::new(towards.x, towards.y, towards.z));
    let share = |share: Option<f64>, absent: f64| share.unwrap_or(absent) as f32;
    Light {
        direction: if direction.normalize_or_zero() == DVec3::ZERO { aside } else { direction },
        color: rgb(light.and_then(|light| light.color.as_ref())),
        ambient: share(light.and_then(|light| light.ambient), 0.6),
        diffuse: share(light.and_then(|light| light.diffuse), 0.35),
        specular: share(light.and_then(|light| light.specular), 0.05),
        shadow: light.is_some_and(|light| light.shadow),
    }
}

/// Returns a colour; white if absent.
fn rgb(color: Option<&Color>) -> [f32; 3] {
    color.map_or([1.0; 3], |color| {
        [color.red, color.green, color.blue].map(|part| part.clamp(0.0, 1.0) as f32)
    })
}

/// Returns the answer for the daemon. Planes are compressed only if they exceed its limit: compression takes
/// longer than sending.
pub(crate) fn answer(task: &PictureTask, renderer: &str, picture: Picture) -> PutPictureRequest {
    let planes = [picture.color, picture.depth, picture.segmentation];
    let bytes = |planes: &[Option<PicturePlane>; 3]| -> u64 {
        planes.iter().flatten().map(|plane| plane.data.len() as u64).sum()
    };
    let compression = PlaneCompression::Unspecified.into();
    let mut planes = planes.map(|plane| plane.map(|data| PicturePlane { compression, data }));
    let raw = bytes(&planes);
    if raw > task.max_bytes {
        planes = planes.map(|plane| plane.map(packed));
        if bytes(&planes) > task.max_bytes {
            let most = task.max_bytes;
            let reason =
                format!("the picture has {raw} bytes, packed {}; the limit is {most}", bytes(&planes));
            return refusal(task, renderer, reason);
        }
    }
    let [color, depth, segmentation] = planes;
    let renderer = renderer.to_owned();
    PutPictureRequest { id: task.id, renderer, color, depth, segmentation, error: String::new() }
}

/// Returns the answer for a picture that was not drawn.
pub(crate) fn refusal(task: &PictureTask, renderer: &str, reason: String) -> PutPictureRequest {
    PutPictureRequest {
        id: task.id,
        renderer: renderer.to_owned(),
        error: reason,
        ..PutPictureRequest::default()
    }
}

fn packed(plane: PicturePlane) -> PicturePlane {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    match encoder.write_all(&plane.data).and_then(|()| encoder.finish()) {
        Ok(data) => PicturePlane { compression: PlaneCompression::Zlib.into(), data },
        // Writing to a list in memory cannot fail.
        Err(_) => plane,
    }
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;

    use flate2::read::ZlibDecoder;

    use super::*;

    fn task() -> PictureTask {
        let identity = DMat4::IDENTITY.to_cols_array().to_vec();
        PictureTask {
            id: 7,
            width: 4,
            height: 2,
            view: identity.clone(),
            projection: identity,
            max_bytes: 1 << 20,
            ..PictureTask::default()
        }
    }

    #[test]
    fn a_task_without_planes_asks_for_colour_in_white_light() {
        let scene = scene(&task(), &[]).unwrap();
        assert_eq!(scene.planes, Planes { color: true, ..Planes::default() });
        assert_eq!((scene.light.color, scene.background), ([1.0; 3], [1.0; 3]));
        assert_eq!((scene.light.ambient, scene.light.diffuse, scene.light.specular), (0.6, 0.35, 0.05));
        assert!(scene.light.direction.z > 0.0 && !scene.light.shadow);
        let light = Some(PictureLight { shadow: true, ..PictureLight::default() });
        assert!(super::scene(&PictureTask { light, ..task() }, &[]).unwrap().light.shadow);
    }

    #[test]
    fn matrices_of_other_sizes_and_what_is_not_finite_are_refused() {
        let short = PictureTask { view: vec![1.0; 15], ..task() };
        assert_eq!(scene(&short, &[]).unwrap_err(), "the task's view has 15 numbers and not 16");
        let endless = PictureTask { projection: vec![f64::INFINITY; 16], ..task() };
        assert_eq!(scene(&endless, &[]).unwrap_err(), "the task's projection is not finite");
    }

    #[test]
    fn planes_are_packed_only_where_they_would_not_fit() {
        let picture = || Picture { depth: Some(vec![1; 32_000]), ..Picture::default() };
        let raw = answer(&task(), "one", picture()).depth.unwrap();
        assert_eq!((raw.compression(), raw.data.len()), (PlaneCompression::Unspecified, 32_000));
        let small = PictureTask { max_bytes: 1000, ..task() };
        let packed = answer(&small, "one", picture()).depth.unwrap();
        assert_eq!(packed.compression(), PlaneCompression::Zlib);
        let mut whole = Vec::new();
        ZlibDecoder::new(&*packed.data).read_to_end(&mut whole).unwrap();
        assert_eq!(whole, vec![1; 32_000]);
        let smaller = PictureTask { max_bytes: 10, ..task() };
        let refused = answer(&smaller, "one", picture());
        assert!(refused.error.starts_with("the picture has 32000 bytes"), "{}", refused.error);
        assert_eq!((refused.depth, refused.id), (None, 7));
    }
}
