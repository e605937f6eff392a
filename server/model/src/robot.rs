//! The model of a robot: links, joints, shapes. Immutable once it is read.

mod sha256;

use std::sync::Arc;

use glamx::{DMat3, DPose3, DVec3};
use serde::{Deserialize, Serialize};

use crate::setup::Setup;

pub use sha256::Sha256;

/// A checked robot from its description: a tree of links with finite numbers, unit axes and ordered limits.
/// SI units, radians.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RobotModel {
    /// `name` of the `<robot>` element.
    pub name: String,
    /// Depth-first, children in the order of the file; the first is the root.
    pub links: Vec<Link>,
    /// Depth-first: joint `i` ends at link `i + 1`. Fixed joints are here too.
    pub joints: Vec<Joint>,
    /// Initial state.
    pub setup: Setup,
}

/// A rigid part of a robot, in the frame of its joint.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Unique among the robot's links.
    pub name: String,
    /// Mass and inertia.
    pub inertial: Inertial,
    /// Shapes for drawing.
    pub visuals: Vec<Visual>,
    /// Shapes for collisions.
    pub collisions: Vec<Collision>,
}

/// Mass and inertia of a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertial {
    /// Kilograms, at least 0.
    pub mass: f64,
    /// Centre of mass in the link's frame, metres.
    pub center_of_mass: DVec3,
    /// About the centre of mass, in the link's axes, kg m^2. Symmetric and
    /// positive semidefinite.
    pub inertia: DMat3,
}

impl Inertial {
    /// Zero mass.
    pub const ZERO: Self = Self { mass: 0.0, center_of_mass: DVec3::ZERO, inertia: DMat3::ZERO };
}

/// A shape for drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct Visual {
    /// `link_from_shape`.
    pub link_from_shape: DPose3,
    /// The shape.
    pub geometry: Geometry,
    /// Red, green, blue, alpha, each 0 to 1; absent if the file gives none.
    pub color: Option<[f64; 4]>,
    /// Picture of the description's material. On a mesh it is also among its asset's paints, for triangles
    /// with texture coordinates but no picture in their file.
    pub texture: Option<Picture>,
}

/// The picture of a description's material.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// Name in the description.
    pub uri: String,
    /// The picture.
    pub image: Arc<Image>,
    /// Repetitions on one shape.
    pub repeat: TextureRepeat,
}

/// Repetitions of a picture on a shape, across and up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TextureRepeat {
    /// On each side of a box, and around round shapes.
    Times([f64; 2]),
    /// On each metre of a box or a plane. The middle of a picture is at the middle of the shape.
    PerMetre([f64; 2]),
}

impl Default for TextureRepeat {
    fn default() -> Self {
        Self::Times([1.0, 1.0])
    }
}

/// A shape for collisions.
#[derive(Clone, Debug, PartialEq)]
pub struct Collision {
    /// `link_from_shape`.
    pub link_from_shape: DPose3,
    /// The shape.
    pub geometry: Geometry,
    /// Surface of the shape.
    pub material: Material,
}

/// Surface of a shape; absent values are the world's defaults.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Coulomb's coefficient, at least 0.
    pub friction: Option<f64>,
    /// Fraction of the approach speed after an impact, 0 to 1.
    pub restitution: Option<f64>,
    /// Rolling friction: torque per normal force, metres, at least 0.
    pub rolling_friction: Option<f64>,
    /// Spinning friction: torque about the normal per normal force, metres, at least 0.
    pub spinning_friction: Option<f64>,
    /// Stiffness of the spring at a contact point, N/m; 0 is rigid. Descriptions have none.
    pub contact_stiffness: Option<f64>,
    /// Damping in parallel with that spring, N s/m.
    pub contact_damping: Option<f64>,
}

/// A shape, centred on its own origin. Metres.
#[derive(Clone, Debug, PartialEq)]
pub enum Geometry {
    /// Full lengths of the sides.
    Box {
        /// Along x, y, z.
        size: DVec3,
    },
    /// A ball.
    Sphere {
        /// Above 0.
        radius: f64,
    },
    /// About the z axis.
    Cylinder {
        /// Above 0.
        radius: f64,
        /// Above 0.
        length: f64,
    },
    /// About the z axis.
    Capsule {
        /// Above 0.
        radius: f64,
        /// Length of the cylinder, without the caps.
        length: f64,
    },
    /// About the z axis: the base at -`length` / 2, the apex at `length` / 2.
    Cone {
        /// Radius of the base, above 0.
        radius: f64,
        /// From the base to the apex, above 0.
        length: f64,
    },
    /// The half-space below a plane through the origin.
    Plane {
        /// Unit vector; points out.
        normal: DVec3,
    },
    /// Triangles from a file.
    Mesh {
        /// URI as in the description.
        uri: String,
        /// Factors on the file's coordinates; negative ones mirror.
        scale: DVec3,
        /// Content of the file; absent if it is missing or cannot be read.
        asset: Option<Arc<MeshAsset>>,
    },
}

/// Content of a mesh file.
#[derive(Debug, PartialEq)]
pub struct MeshAsset {
    /// SHA-256 of the file.
    pub sha256: Sha256,
    /// Vertices in the file's own coordinates, each finite.
    pub vertices: Vec<DVec3>,
    /// Vertices of each triangle, as indices into `vertices`, each in range.
    pub triangles: Vec<[u32; 3]>,
    /// Colours and textures of the file: in order, each up to the next. The physics ignores them.
    pub paints: Vec<Paint>,
    /// Files beside it that belong to its look: materials of an OBJ, textures, buffers of a glTF.
    pub files: Vec<FileBeside>,
    /// Present if the vertices are heights above a grid.
    pub grid: Option<Grid>,
}

/// Layout of the vertices of a height field: row by row, each from the least x to the greatest. x and y are
/// spaced evenly from -0.5 to 0.5. The first row has the greatest y, as a picture is seen. The triangles of a
/// cell share the edge from the vertex with the least x and y to the one with the greatest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// At least 2.
    pub rows: usize,
    /// At least 2.
    pub columns: usize,
}

impl MeshAsset {
    /// Returns the SHA-256 of its whole look: of only its file if that names no other.
    pub fn look(&self) -> Sha256 {
        look_of(self.sha256, &self.files)
    }
}

/// Returns the SHA-256 of a mesh's file and of the files beside it.
pub(crate) fn look_of(sha256: Sha256, files: &[FileBeside]) -> Sha256 {
    if files.is_empty() {
        return sha256;
    }
    let mut all = sha256.0.to_vec();
    for FileBeside { name, sha256 } in files {
        all.extend_from_slice(name.as_bytes());
        // No name contains it, so that two different lists never have the same bytes.
        all.push(0);
        all.extend_from_slice(&sha256.0);
    }
    Sha256::of(&all)
}

/// A file that a mesh's file names, and that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct FileBeside {
    /// Path from the folder of the mesh. Empty for the picture that the description puts on the mesh.
    pub name: String,
    /// SHA-256 of the file.
    pub sha256: Sha256,
}

/// Look of some triangles of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Paint {
    /// Index of the first triangle.
    pub first: usize,
    /// Red, green and blue, 0 to 1 (sRGB); absent if the file has none. It is multiplied with the texture.
    pub color: Option<[f64; 3]>,
    /// 1 is opaque, 0 is invisible.
    pub alpha: f64,
    /// Present if the triangles have a picture.
    pub texture: Option<Texture>,
}

impl Paint {
    /// Makes an opaque colour.
    pub fn plain(first: usize, color: Option<[f64; 3]>) -> Self {
        Self { first, color, alpha: 1.0, texture: None }
    }
}

/// A picture on triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// The picture.
    pub image: Arc<Image>,
    /// Texture coordinates of each triangle's vertices: distance from the left and from the top, 0 to 1. The
    /// picture is repeated beyond that. Triangles without coordinates are left out.
    pub uvs: Vec<[[f32; 2]; 3]>,
}

/// A picture file, of which only the header was read.
#[derive(Debug, PartialEq, Eq)]
pub struct Image {
    /// SHA-256 of `bytes`.
    pub sha256: Sha256,
    /// Format of the file.
    pub kind: ImageKind,
    /// Pixels across and down, each above 0.
    pub size: [u32; 2],
    /// The whole file.
    pub bytes: Arc<[u8]>,
}

/// Format of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageKind {
    /// ISO/IEC 15948.
    Png,
    /// ISO/IEC 10918.
    Jpeg,
}

impl ImageKind {
    /// Returns its name in HTTP headers and glTF.
    pub fn media_type(self) -> &'static str {
        match self {
            Self::Png => "image/png",
            Self::Jpeg => "image/jpeg",
        }
    }

    /// Returns the usual extension of files.
    pub fn extension(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Jpeg => "jpg",
        }
    }
}

/// A connection of two links.
#[derive(Clone, Debug, PartialEq)]
pub struct Joint {
    /// Unique among the robot's joints.
    pub name: String,
    /// Type of motion.
    pub kind: JointKind,
    /// Index of the parent link.
    pub parent: usize,
    /// Index of the child link.
    pub child: usize,
    /// Frame of the child at position zero: `parent_from_joint`.
    pub parent_from_joint: DPose3,
    /// Unit vector in the joint's frame; meaningless for fixed, floating and spherical joints.
    pub axis: DVec3,
    /// Limits of position, effort and velocity.
    pub limits: JointLimits,
    /// Viscous damping, N m s/rad or N s/m, at least 0.
    pub damping: f64,
    /// Dry friction, N m or N, at least 0.
    pub friction: f64,
    /// Present if the joint follows another.
    pub mimic: Option<Mimic>,
}

/// Type of a joint's motion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about its axis, within limits if it has them.
    Revolute,
    /// Turns about its axis without end.
    Continuous,
    /// Slides along its axis.
    Prismatic,
    /// Does not move.
    Fixed,
    /// Moves freely.
    Floating,
    /// Slides in the plane across its axis, and turns about it.
    Planar,
    /// Turns about any axis through its origin: a ball in a socket.
    Spherical,
}

impl JointKind {
    /// Returns whether the child can move relative to the parent.
    pub fn moves(self) -> bool {
        self != Self::Fixed
    }
}

/// Limits of a joint; an absent one does not limit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointLimits {
    /// rad or m; not above `upper`.
    pub lower: Option<f64>,
    /// rad or m.
    pub upper: Option<f64>,
    /// N m or N, above 0.
    pub effort: Option<f64>,
    /// rad/s or m/s, above 0.
    pub velocity: Option<f64>,
}

/// `position = multiplier * position of joint + offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mimic {
    /// Index of the joint that it follows.
    pub joint: usize,
    /// rad or m per rad or m.
    pub multiplier: f64,
    /// rad or m.
    pub offset: f64,
}

impl JointLimits {
    /// Returns lower and upper limit, infinite if absent.
    pub fn range(&self) -> (f64, f64) {
        (self.lower.unwrap_or(f64::NEG_INFINITY), self.upper.unwrap_or(f64::INFINITY))
    }

    /// Returns the nearest position within the limits.
    pub fn nearest(&self, position: f64) -> f64 {
        let (lower, upper) = self.range();
        position.max(lower).min(upper)
    }
}
