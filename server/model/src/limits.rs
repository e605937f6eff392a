//! Limits of untrusted descriptions and meshes; each refusal names the value and the limit.

use std::time::Duration;

/// Limits of a description, so that no file hangs or bloats the process that reads it. The defaults are far
/// above any real robot. Limits of meshes can only be lowered: their readers are built for the defaults.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoadLimits {
    /// Bytes of a URDF.
    pub urdf_bytes: usize,
    /// Nodes in the XML of a URDF: elements, texts and comments.
    pub xml_nodes: u32,
    /// Nesting depth of elements, including the root.
    pub xml_depth: usize,
    /// `=` signs between two `<`, an upper bound of an element's attributes: the
    /// XML parser compares each attribute with each other one.
    pub xml_attributes: usize,
    /// Declarations of namespaces: the XML parser copies them from element to element.
    pub xml_namespaces: usize,
    /// Bytes of a name or of a mesh URI.
    pub name_bytes: usize,
    /// Links of a robot, and its joints.
    pub links: usize,
    /// Visual and collision shapes of a robot, and its materials.
    pub shapes: usize,
    /// Bytes of a mesh file.
    pub mesh_bytes: usize,
    /// Triangles of one mesh file.
    pub mesh_triangles: usize,
    /// Triangles of all mesh files of a robot, each file counted once.
    pub robot_triangles: usize,
    /// Findings of a report, of each severity; further ones are only counted.
    pub findings: usize,
    /// Time from the first byte to the finished robot, checked between its parts.
    pub time: Duration,
}

impl Default for LoadLimits {
    fn default() -> Self {
        Self {
            urdf_bytes: 16 << 20,
            xml_nodes: 250_000,
            xml_depth: XML_DEPTH,
            xml_attributes: XML_ATTRIBUTES,
            xml_namespaces: XML_NAMESPACES,
            name_bytes: 1024,
            links: 1000,
            shapes: 10_000,
            mesh_bytes: MESH_BYTES,
            mesh_triangles: MESH_TRIANGLES,
            robot_triangles: 10_000_000,
            findings: 1000,
            time: Duration::from_secs(60),
        }
    }
}

/// Maximum number of links that can be configured.
pub const MAX_LINKS: usize = 10_000;

/// Nesting depth of elements in a mesh file, and by default in a URDF.
pub(crate) const XML_DEPTH: usize = 100;
/// Number of `=` signs between two `<` in a mesh file.
pub(crate) const XML_ATTRIBUTES: usize = 128;
/// Declarations of namespaces in a mesh file.
pub(crate) const XML_NAMESPACES: usize = 256;
/// Bytes of a mesh file.
pub(crate) const MESH_BYTES: usize = 128 << 20;
/// Triangles of one mesh file.
pub(crate) const MESH_TRIANGLES: usize = 2_000_000;
/// Vertices of one mesh file.
pub(crate) const MESH_VERTICES: usize = simd_gltf::MAX_VERTICES;
/// Bytes of a COLLADA file, which needs much memory while it is read.
pub(crate) const COLLADA_BYTES: usize = 64 << 20;
/// XML nodes of a COLLADA file.
pub(crate) const COLLADA_NODES: u32 = 500_000;
/// Attributes of a COLLADA file, all together.
pub(crate) const COLLADA_ATTRIBUTES: usize = 1_000_000;
/// Bytes of a COLLADA file that may be visited: repeated references count each time.
pub(crate) const COLLADA_WALK: usize = 128 << 20;
/// Files that a mesh names, and pictures of a description.
pub(crate) const FILES_BESIDE: usize = 128;
/// Bytes of a file of materials.
pub(crate) const MATERIAL_BYTES: usize = 4 << 20;
/// Materials of one mesh file.
pub(crate) const MATERIALS: usize = 10_000;
/// Bytes of a picture.
pub(crate) const IMAGE_BYTES: usize = 16 << 20;
/// Pixels of a picture along a side: more is not supported by all browsers.
pub(crate) const IMAGE_SIDE: u32 = 8192;
/// Pixels of a picture. A viewer decodes each to four bytes.
pub(crate) const IMAGE_PIXELS: u64 = 4096 * 4096;
/// Bytes of all files beside one mesh, and of the pictures in it.
pub(crate) const BESIDE_BYTES: usize = 64 << 20;
/// Parts of meshes that are visited in a glTF.
pub(crate) const GLTF_VISITS: usize = 1_000_000;
/// Largest magnitude of a number in a description or a mesh. Results of such numbers stay finite: a tensor of
/// inertia is the fifth power of a length.
pub(crate) const MAGNITUDE: f64 = 1e18;
/// Largest factor of size for a spawn.
pub(crate) const SCALE: f64 = 1000.0;
