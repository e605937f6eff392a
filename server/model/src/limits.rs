//! The caps on what a stranger may send; each refusal says the value and the cap.

/// Bytes of a URDF.
pub(crate) const URDF_BYTES: usize = 16 << 20;
/// XML nodes of a URDF: elements, texts and comments.
pub(crate) const XML_NODES: u32 = 250_000;
/// Elements inside one another. Far below what a parser's stack holds.
pub(crate) const XML_DEPTH: usize = 100;
/// `=` signs between two `<`, an upper bound of an element's attributes: the
/// XML parser compares each attribute with each other one.
pub(crate) const XML_ATTRIBUTES: usize = 128;
/// Declarations of namespaces: the XML parser copies them from element to element.
pub(crate) const XML_NAMESPACES: usize = 256;
/// Bytes of a name or of a mesh URI.
pub(crate) const NAME_BYTES: usize = 1024;
/// Links of a robot. Its joints are one fewer.
pub(crate) const LINKS: usize = 1000;
/// Visual and collision shapes of a robot.
pub(crate) const SHAPES: usize = 10_000;
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
/// Triangles of all mesh files of a robot, each file counted once.
pub(crate) const ROBOT_TRIANGLES: usize = 10_000_000;
/// Largest number that a description or a mesh may hold, in either direction:
/// what is computed from such numbers (a tensor of inertia is the fifth power
/// of a length) stays finite.
pub(crate) const MAGNITUDE: f64 = 1e18;
/// Findings of a report, of each severity; what goes beyond is counted.
pub(crate) const FINDINGS: usize = 1000;
/// Largest factor of size that a spawn may ask for.
pub(crate) const SCALE: f64 = 1000.0;
