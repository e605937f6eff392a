//! Appearance of robots: their shapes and meshes, fetched from the daemon once and kept on the GPU within a
//! bound.

mod surfaces;

use std::collections::HashMap;
use std::sync::Arc;

use glamx::{DAffine3, DMat3, DQuat, DVec3};
use simd_client::proto::{self, RobotLinkPoses, RobotScene, Shape, shape::Geometry};
use simd_client::{Client, Error};

use crate::draw::{DrawError, Surface};
use crate::drawing::Drawing;
use crate::primitives::segments;

use surfaces::{Key, Surfaces};

/// Colour of shapes without one, as on the page (`UNCOLOURED`).
const UNCOLORED: [f32; 4] = [0.639, 0.678, 0.729, 1.0];
/// Colour of shapes that have a picture but no colour.
const WHITE: [f32; 4] = [1.0; 4];
/// Colour of planes without one.
const GROUND: [f32; 4] = [0.875, 0.890, 0.910, 1.0];
/// Number of pictures after which an absent robot is forgotten.
const FORGOTTEN: u64 = 256;

/// Reason why the appearance of a robot is unknown.
#[derive(Debug, thiserror::Error)]
pub(crate) enum AppearanceError {
    /// The daemon did not answer, or refused.
    #[error(transparent)]
    Daemon(#[from] Error),
    /// The GPU refused a mesh.
    #[error(transparent)]
    Draw(#[from] DrawError),
    /// A robot of the task no longer exists.
    #[error("robot `{0}` was reloaded or deleted meanwhile")]
    Changed(String),
    /// The meshes need more memory than the renderer may use.
    #[error(
        "the meshes of this world take {wanted} MiB, more than the {most} MiB that the renderer may use: start it with \
         a larger --memory"
    )]
    Memory { wanted: u64, most: u64 },
}

/// A shape of a robot, on the GPU.
#[derive(Clone, Debug)]
pub(crate) struct PlacedSurface {
    /// Index of the robot's link.
    pub(crate) link: usize,
    /// Includes the scale of the mesh.
    pub(crate) link_from_mesh: DAffine3,
    pub(crate) surface: Arc<Surface>,
    /// Colour of parts without their own.
    pub(crate) color: [f32; 4],
}

/// All shapes of a robot.
pub(crate) type Appearance = Arc<[PlacedSurface]>;

/// A robot's name and layout version.
type RobotKey = (String, u64);

struct Known {
    appearance: Appearance,
    /// Number of the last picture that it was in.
    picture: u64,
}

/// The appearances of the robots of one world.
pub(crate) struct Appearances {
    client: Client,
    surfaces: Surfaces,
    robots: HashMap<RobotKey, Known>,
    picture: u64,
}

impl Appearances {
    /// Makes it with the GPU memory that meshes may use.
    pub(crate) fn new(client: Client, drawing: Drawing, most_bytes: u64) -> Self {
        Self { client, surfaces: Surfaces::new(drawing, most_bytes), robots: HashMap::new(), picture: 0 }
    }

    /// Forgets robots: after a restart of the daemon, the same names and versions may mean others. Meshes are
    /// keyed by their contents, and stay.
    pub(crate) fn forget_robots(&mut self) {
        self.robots.clear();
    }

    /// Returns the appearances of robots, in their order. Fetches the unknown ones.
    ///
    /// # Errors
    /// Returns an error if a robot changed in the daemon, the daemon does not answer, or the GPU has no room.
    pub(crate) async fn of(&mut self, robots: &[RobotLinkPoses]) -> Result<Vec<Appearance>, AppearanceError> {
        self.picture += 1;
        let key = |robot: &RobotLinkPoses| (robot.robot.clone(), robot.layout_version);
        let unknown: Vec<&str> = robots
            .iter()
            .filter(|robot| !self.robots.contains_key(&key(robot)))
            .map(|robot| robot.robot.as_str())
            .collect();
        if !unknown.is_empty() {
            if self.surfaces.is_half_full() {
                // Robots of other pictures make room first, then meshes that only they used.
                self.robots.retain(|(name, version), _| {
                    robots.iter().any(|robot| robot.robot == *name && robot.layout_version == *version)
                });
            }
            self.ask(&unknown).await?;
        }
        let mut appearances = Vec::with_capacity(robots.len());
        for robot in robots {
            let Some(known) = self.robots.get_mut(&key(robot)) else {
                return Err(AppearanceError::Changed(robot.robot.clone()));
            };
            known.picture = self.picture;
            appearances.push(Arc::clone(&known.appearance));
        }
        let picture = self.picture;
        self.robots.retain(|_, known| picture - known.picture < FORGOTTEN);
        Ok(appearances)
    }

    async fn ask(&mut self, robots: &[&str]) -> Result<(), AppearanceError> {
        let scene = self.client.scene(robots).await?;
        for robot in scene.robots {
            let appearance = self.appearance(&robot).await?;
            // Other versions of the robot are not drawn again.
            self.robots.retain(|(name, _), _| *name != robot.robot);
            let known = Known { appearance, picture: self.picture };
            self.robots.insert((robot.robot, robot.layout_version), known);
        }
        Ok(())
    }

    /// Returns the appearance of a robot. Without visuals, it consists of the collision shapes, as in the
    /// page.
    async fn appearance(&mut self, robot: &RobotScene) -> Result<Appearance, AppearanceError> {
        let drawn = if robot.visuals.is_empty() { &robot.collisions } else { &robot.visuals };
        let mut appearance = Vec::with_capacity(drawn.len());
        for shape in drawn {
            let Some(placed) = placed(shape) else { continue };
            let Some(surface) = self.surfaces.get(&self.client, &placed.key).await? else { continue };
            let color = placed.color;
            let link = shape.link as usize;
            appearance.push(PlacedSurface { link, link_from_mesh: placed.link_from_mesh, surface, color });
        }
        Ok(appearance.into())
    }
}

/// A shape before its mesh is known.
#[derive(Clone, Debug, PartialEq)]
struct Placed {
    key: Key,
    link_from_mesh: DAffine3,
    color: [f32; 4],
}

/// Returns the drawing of a shape; `None` if its file is missing, which the load report says.
fn placed(shape: &Shape) -> Option<Placed> {
    let mut link_from_mesh = affine(shape.pose.as_ref());
    let texture = &shape.texture;
    // A picture is multiplied by the colour.
    let mut uncolored = if texture.is_empty() { UNCOLORED } else { WHITE };
    let (key, scale) = match shape.geometry.as_ref()? {
        Geometry::Box(cuboid) => (Key::Cube, vector(cuboid.size.as_ref(), DVec3::ZERO)),
        Geometry::Sphere(sphere) => (Key::Ball(segments(sphere.radius)), DVec3::splat(sphere.radius)),
        Geometry::Cylinder(cylinder) => {
            let scale = DVec3::new(cylinder.radius, cylinder.radius, cylinder.length);
            (Key::Cylinder(segments(cylinder.radius)), scale)
        }
        Geometry::Capsule(capsule) => (Key::capsule(capsule.radius, capsule.length), DVec3::ONE),
        Geometry::Cone(cone) => (Key::cone(cone.radius, cone.length), DVec3::ONE),
        Geometry::Plane(plane) => {
            let normal = vector(plane.normal.as_ref(), DVec3::Z).normalize_or(DVec3::Z);
            link_from_mesh *= DAffine3::from_quat(DQuat::from_rotation_arc(DVec3::Z, normal));
            uncolored = GROUND;
            (Key::Plane, DVec3::ONE)
        }
        Geometry::Mesh(mesh) if mesh.look.is_empty() => return None,
        Geometry::Mesh(mesh) => (Key::Mesh(mesh.look.clone()), vector(mesh.scale.as_ref(), DVec3::ONE)),
        // Only colliders have it, and they are not drawn.
        Geometry::Convex(_) => return None,
    };
    link_from_mesh.matrix3 *= DMat3::from_diagonal(scale);
    let has_picture = !texture.is_empty() && !matches!(key, Key::Mesh(_) | Key::Plane);
    let key = if has_picture { Key::Pictured(Box::new(key), texture.clone()) } else { key };
    let color = shape.color.as_ref().map_or(uncolored, |color| {
        [color.red, color.green, color.blue, color.alpha].map(|part| part.clamp(0.0, 1.0) as f32)
    });
    Some(Placed { key, link_from_mesh, color })
}

fn vector(vector: Option<&proto::Vector3>, absent: DVec3) -> DVec3 {
    vector.map_or(absent, |vector| DVec3::new(vector.x, vector.y, vector.z))
}

fn affine(pose: Option<&proto::Pose>) -> DAffine3 {
    let Some(pose) = pose else { return DAffine3::IDENTITY };
    let turn = pose.orientation.as_ref().map(|q| DQuat::from_xyzw(q.x, q.y, q.z, q.w));
    let turn = turn.filter(|turn| turn.length_squared() > 0.0).map_or(DQuat::IDENTITY, DQuat::normalize);
    DAffine3::from_rotation_translation(turn, vector(pose.position.as_ref(), DVec3::ZERO))
}

#[cfg(test)]
mod tests {
    use simd_client::proto::{BoxGeometry, MeshGeometry, PlaneGeometry, Pose, Vector3};

    use super::*;

    fn shape(geometry: Geometry) -> Shape {
        let position = Some(Vector3 { x: 1.0, y: 2.0, z: 3.0 });
        let pose = Some(Pose { position, orientation: None });
        Shape { pose, geometry: Some(geometry), ..Shape::default() }
    }

    #[test]
    fn a_box_is_a_cube_that_is_stretched_before_it_is_put_somewhere() {
        let size = Some(Vector3 { x: 2.0, y: 4.0, z: 6.0 });
        let placed = placed(&shape(Geometry::Box(BoxGeometry { size }))).unwrap();
        assert_eq!(placed.key, Key::Cube);
        assert_eq!(placed.link_from_mesh.transform_point3(DVec3::splat(0.5)), DVec3::new(2.0, 4.0, 6.0));
        assert_eq!(placed.color, UNCOLORED);
    }

    #[test]
    fn a_plane_is_turned_to_its_normal_and_pale() {
        let normal = Some(Vector3 { x: 3.0, y: 0.0, z: 0.0 });
        let placed = placed(&shape(Geometry::Plane(PlaneGeometry { normal }))).unwrap();
        let turned = placed.link_from_mesh.transform_vector3(DVec3::Z);
        assert!(turned.distance(DVec3::X) < 1e-12, "{turned}");
        assert_eq!(placed.color, GROUND);
    }

    #[test]
    fn a_picture_is_multiplied_by_the_colour_and_by_white_where_there_is_none() {
        let size = Some(Vector3 { x: 1.0, y: 1.0, z: 1.0 });
        let pictured = Shape { texture: "ab".to_owned(), ..shape(Geometry::Box(BoxGeometry { size })) };
        let placed = placed(&pictured).unwrap();
        assert_eq!(placed.key, Key::Pictured(Box::new(Key::Cube), "ab".to_owned()));
        assert_eq!(placed.color, WHITE);
    }

    #[test]
    fn a_mesh_whose_file_is_missing_is_not_drawn() {
        let mesh = |look: &str| MeshGeometry { look: look.to_owned(), ..MeshGeometry::default() };
        assert_eq!(placed(&shape(Geometry::Mesh(mesh("")))), None);
        assert_eq!(placed(&shape(Geometry::Mesh(mesh("ab")))).unwrap().key, Key::Mesh("ab".to_owned()));
    }
}
