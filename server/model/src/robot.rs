//! What a robot is: links, joints, shapes. Immutable once it is read.

mod sha256;

use std::sync::Arc;

use glamx::{DMat3, DPose3, DVec3};
use serde::{Deserialize, Serialize};

use crate::setup::Setup;

pub use sha256::Sha256;

/// A robot as its description gives it, checked: a tree of links with finite
/// numbers, unit axes and ordered limits. SI units, radians.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RobotModel {
    /// `name` of the `<robot>`.
    pub name: String,
    /// Depth-first, children in the order of the file; the first is the root.
    pub links: Vec<Link>,
    /// Depth-first: joint `i` ends at link `i + 1`. Fixed joints are here too.
    pub joints: Vec<Joint>,
    /// How it begins.
    pub setup: Setup,
}

/// A rigid part of a robot, in the frame of the joint that it hangs on.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Unique among the robot's links.
    pub name: String,
    /// What moves when the link moves.
    pub inertial: Inertial,
    /// What is drawn.
    pub visuals: Vec<Visual>,
    /// What touches.
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
    /// No mass.
    pub const ZERO: Self = Self { mass: 0.0, center_of_mass: DVec3::ZERO, inertia: DMat3::ZERO };
}

/// Something to draw.
#[derive(Clone, Debug, PartialEq)]
pub struct Visual {
    /// `link_from_shape`.
    pub link_from_shape: DPose3,
    /// What it is.
    pub geometry: Geometry,
    /// Red, green, blue, alpha, each 0 to 1; absent where the file gives none.
    pub color: Option<[f64; 4]>,
    /// The picture of the description's material. Of a mesh it is among the paints of its asset, on the triangles that have
    /// texture coordinates and no picture of their own file.
    pub texture: Option<Picture>,
}

/// The picture of a description's material.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    /// How the description names it.
    pub uri: String,
    /// What it is.
    pub image: Arc<Image>,
    /// How often it is there on one shape.
    pub repeat: TextureRepeat,
}

/// How often a picture is repeated on a shape, across and up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TextureRepeat {
    /// On each side of a box, and around what is round.
    Times([f64; 2]),
    /// On each metre of a box or a plane. The middle of a picture is at the middle of the shape.
    PerMetre([f64; 2]),
}

impl Default for TextureRepeat {
    fn default() -> Self {
        Self::Times([1.0, 1.0])
    }
}

/// Something that touches.
#[derive(Clone, Debug, PartialEq)]
pub struct Collision {
    /// `link_from_shape`.
    pub link_from_shape: DPose3,
    /// What it is.
    pub geometry: Geometry,
    /// What its surface is like.
    pub material: Material,
}

/// What a surface is like; absent is the world's default.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Material {
    /// Coulomb's coefficient, at least 0.
    pub friction: Option<f64>,
    /// The part of the approach speed that is left after a hit, 0 to 1.
    pub restitution: Option<f64>,
    /// The torque against rolling, as a part of the normal force, metres, at least 0.
    pub rolling_friction: Option<f64>,
    /// The same against turning about the normal.
    pub spinning_friction: Option<f64>,
    /// Of the spring that a contact point is, N/m; 0 is rigid. Descriptions give none.
    pub contact_stiffness: Option<f64>,
    /// Of the damper beside that spring, N s/m.
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
        /// Of the cylinder, without the caps.
        length: f64,
    },
    /// About the z axis: the base at -`length` / 2, the apex at `length` / 2.
    Cone {
        /// Of the base, above 0.
        radius: f64,
        /// From the base to the apex, above 0.
        length: f64,
    },
    /// All that lies below a plane through the origin.
    Plane {
        /// Of unit length; points out.
        normal: DVec3,
    },
    /// Triangles from a file.
    Mesh {
        /// As the description writes it.
        uri: String,
        /// Factors on the file's coordinates; negative ones mirror.
        scale: DVec3,
        /// The file's content; absent where it is missing or cannot be read.
        asset: Option<Arc<MeshAsset>>,
    },
}

/// A mesh file, read.
#[derive(Debug, PartialEq)]
pub struct MeshAsset {
    /// SHA-256 of the file.
    pub sha256: Sha256,
    /// Corners in the file's own coordinates, each finite.
    pub vertices: Vec<DVec3>,
    /// Corners of each triangle, as indices into `vertices`, each in range.
    pub triangles: Vec<[u32; 3]>,
    /// Where the file gives colours or textures: in order, each up to the next. The physics knows none.
    pub paints: Vec<Paint>,
    /// The files beside it that its look is made of too: materials of an OBJ, textures, buffers of a glTF.
    pub files: Vec<FileBeside>,
    /// Set where the corners are heights above a grid.
    pub grid: Option<Grid>,
}

/// How the corners of a height field lie: row by row, and in each from the least x to the greatest. x and y go from
/// -0.5 to 0.5, evenly; the first row is that of the greatest y, as a picture is looked at. Of each cell the triangles
/// share the edge from the corner with the least x and y to the one with the greatest.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Grid {
    /// At least 2.
    pub rows: usize,
    /// At least 2.
    pub columns: usize,
}

impl MeshAsset {
    /// SHA-256 of all that it looks like: of its file alone where that names no other.
    pub fn look(&self) -> Sha256 {
        look_of(self.sha256, &self.files)
    }
}

/// SHA-256 of a mesh's file and of the files beside it.
pub(crate) fn look_of(sha256: Sha256, files: &[FileBeside]) -> Sha256 {
    if files.is_empty() {
        return sha256;
    }
    let mut all = sha256.0.to_vec();
    for FileBeside { name, sha256 } in files {
        all.extend_from_slice(name.as_bytes());
        // No name holds it, so that two lists are never the same bytes.
        all.push(0);
        all.extend_from_slice(&sha256.0);
    }
    Sha256::of(&all)
}

/// A file that a mesh's file names, and that was found.
#[derive(Clone, Debug, PartialEq)]
pub struct FileBeside {
    /// Its path from the folder of the mesh. Empty is the picture that the description puts on the mesh, which it names itself.
    pub name: String,
    /// SHA-256 of the file.
    pub sha256: Sha256,
}

/// The look of some triangles of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Paint {
    /// Index of the first of them.
    pub first: usize,
    /// Red, green and blue, 0 to 1, as screens have them (sRGB); absent where the file says none. A texture is multiplied
    /// by it.
    pub color: Option<[f64; 3]>,
    /// 1 hides what is behind, 0 nothing of it.
    pub alpha: f64,
    /// Set where there is a picture on them.
    pub texture: Option<Texture>,
}

impl Paint {
    /// A colour alone, that hides what is behind.
    pub fn plain(first: usize, color: Option<[f64; 3]>) -> Self {
        Self { first, color, alpha: 1.0, texture: None }
    }
}

/// A picture on triangles.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// The picture.
    pub image: Arc<Image>,
    /// For each triangle that has them the texture coordinates of its corners: from the left, 0 to 1, and from the top. The picture is
    /// repeated beyond that.
    pub uvs: Vec<[[f32; 2]; 3]>,
}

/// A picture as it came: only its header was looked at.
#[derive(Debug, PartialEq, Eq)]
pub struct Image {
    /// SHA-256 of `bytes`.
    pub sha256: Sha256,
    /// How it is written.
    pub kind: ImageKind,
    /// Pixels across and down, each above 0.
    pub size: [u32; 2],
    /// The whole file.
    pub bytes: Arc<[u8]>,
}

/// How a picture is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ImageKind {
    /// ISO/IEC 15948.
    Png,
    /// ISO/IEC 10918.
    Jpeg,
}

impl ImageKind {
    /// As headers of HTTP and glTF name it.
    pub fn media_type(self) -> &'static str {
        match self {
            Self::Png => "image/png",
            Self::Jpeg => "image/jpeg",
        }
    }

    /// The usual extension of files.
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
    /// How the child can move.
    pub kind: JointKind,
    /// Index of the link that it hangs on.
    pub parent: usize,
    /// Index of the link that moves.
    pub child: usize,
    /// The child's frame at position zero: `parent_from_joint`.
    pub parent_from_joint: DPose3,
    /// Unit vector in the joint's frame; meaningless for fixed, floating and spherical joints.
    pub axis: DVec3,
    /// Limits of position, effort and velocity.
    pub limits: JointLimits,
    /// Viscous damping, N m s/rad or N s/m, at least 0.
    pub damping: f64,
    /// Dry friction, N m or N, at least 0.
    pub friction: f64,
    /// Set where the joint follows another.
    pub mimic: Option<Mimic>,
}

/// How a joint's child can move.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum JointKind {
    /// Turns about its axis, within limits where it has them.
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
    /// Whether the child can move against the parent.
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
    /// Index of the joint that is followed.
    pub joint: usize,
    /// rad or m for each rad or m.
    pub multiplier: f64,
    /// rad or m.
    pub offset: f64,
}

impl JointLimits {
    /// Lower and upper, infinite where absent.
    pub fn range(&self) -> (f64, f64) {
        (self.lower.unwrap_or(f64::NEG_INFINITY), self.upper.unwrap_or(f64::INFINITY))
    }

    /// The position within the limits that is nearest to this one.
    pub fn nearest(&self, position: f64) -> f64 {
        let (lower, upper) = self.range();
        position.max(lower).min(upper)
    }
}
