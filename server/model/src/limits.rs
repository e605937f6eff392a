//! The limits of untrusted descriptions and meshes; each refusal says the value and the limit.

use std::time::Duration;

/// How much a description may be, so that no file hangs or bloats the process that reads
/// it. The defaults are far above any real robot. What a mesh may be can be made
/// less than the defaults, not more: its readers are built for those.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LoadLimits {
    /// Bytes of a URDF.
    pub urdf_bytes: usize,
    /// XML nodes of a URDF: elements, texts and comments.
    pub xml_nodes: u32,
    /// Elements inside one another, the root counted.
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
    /// Findings of a report, of each severity; what goes beyond is counted.
    pub findings: usize,
    /// From the first byte to the finished robot, looked at between its parts.
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

/// Links of the largest robot that can be asked for.
pub const MOST_LINKS: usize = 10_000;

/// Elements inside one another, in a mesh file and by default in a URDF.
pub(crate) const XML_DEPTH: usize = 100;
/// The same of `=` signs between two `<`.
pub(crate) const XML_ATTRIBUTES: usize = 128;
/// The same of declarations of namespaces.
pub(crate) const XML_NAMESPACES: usize = 256;
/// Bytes of a mesh file.
pub(crate) const MESH_BYTES: usize = 128 << 20;
/// Triangles of one mesh file.
pub(crate) const MESH_TRIANGLES: usize = 2_000_000;
/// Corners of one mesh file.
pub(crate) const MESH_VERTICES: usize = 3 * MESH_TRIANGLES;
/// Bytes of a COLLADA file, which is text and takes room while it is read.
pub(crate) const COLLADA_BYTES: usize = 64 << 20;
/// XML nodes of a COLLADA file.
pub(crate) const COLLADA_NODES: u32 = 500_000;
/// Attributes of a COLLADA file, all together.
pub(crate) const COLLADA_ATTRIBUTES: usize = 1_000_000;
/// Bytes of a COLLADA file that may be walked over: what is referred to again and again
/// is walked over as often.
pub(crate) const COLLADA_WALK: usize = 128 << 20;
/// Files beside a mesh that it names, and pictures of a description.
pub(crate) const FILES_BESIDE: usize = 128;
/// Bytes of a file of materials.
pub(crate) const MATERIAL_BYTES: usize = 4 << 20;
/// Materials of one mesh file.
pub(crate) const MATERIALS: usize = 10_000;
/// Bytes of a picture.
pub(crate) const IMAGE_BYTES: usize = 16 << 20;
/// Pixels of a picture along a side: no browser's graphics take more everywhere.
pub(crate) const IMAGE_SIDE: u32 = 8192;
/// Pixels of a picture. A viewer unpacks each to four bytes.
pub(crate) const IMAGE_PIXELS: u64 = 4096 * 4096;
/// Bytes of all files beside one mesh, and of the pictures in it.
pub(crate) const BESIDE_BYTES: usize = 64 << 20;
/// Bytes of the JSON of a glTF.
pub(crate) const GLTF_JSON_BYTES: usize = 32 << 20;
/// Objects in it.
pub(crate) const GLTF_OBJECTS: usize = 250_000;
/// Parts of meshes that are visited in a glTF.
pub(crate) const GLTF_VISITS: usize = 1_000_000;
/// Elements of buffers that are read for a glTF: what is referred to again is read as often.
pub(crate) const GLTF_WALK: usize = 50_000_000;
/// Largest number that a description or a mesh may hold, in either direction:
/// what is computed from such numbers (a tensor of inertia is the fifth power
/// of a length) stays finite.
pub(crate) const MAGNITUDE: f64 = 1e18;
/// Largest factor of size that a spawn may ask for.
pub(crate) const SCALE: f64 = 1000.0;
