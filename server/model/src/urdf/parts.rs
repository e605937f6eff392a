//! Repaired elements of a document, and the robot of urdf-rs that they are.

use urdf_rs::{
    Axis, Collision, Color, Dynamics, Geometry, Inertia, Inertial, Joint, JointLimit, JointType, Link,
    LinkName, Mass, Material, Mimic, Pose, Robot, Vec3, Vec4, Visual,
};

/// A repaired element: its values are valid, and its required parts are present.
#[derive(Debug, Default)]
pub(super) struct Part {
    pub(super) tag: &'static str,
    pub(super) texts: Vec<(&'static str, String)>,
    pub(super) numbers: Vec<(&'static str, Vec<f64>)>,
    pub(super) parts: Vec<Part>,
}

impl Part {
    fn find(&self, tag: &str) -> Option<&Self> {
        self.all(tag).next()
    }

    fn all(&self, tag: &str) -> impl Iterator<Item = &Self> {
        self.parts.iter().filter(move |part| part.tag == tag)
    }

    /// Returns the text of an attribute; empty if it is not given.
    fn text(&self, name: &str) -> String {
        let text = self.texts.iter().find(|(given, _)| *given == name);
        text.map(|(_, text)| text.clone()).unwrap_or_default()
    }

    /// Returns the numbers of an attribute, if it is given.
    fn numbers<const N: usize>(&self, name: &str) -> Option<[f64; N]> {
        let (_, numbers) = self.numbers.iter().find(|(given, _)| *given == name)?;
        numbers.as_slice().try_into().ok()
    }

    fn number(&self, name: &str) -> Option<f64> {
        self.numbers(name).map(|[number]| number)
    }

    fn vector(&self, name: &str) -> Option<Vec3> {
        self.numbers(name).map(Vec3)
    }
}

/// Returns the robot of a repaired `<robot>`.
pub(super) fn robot(part: &Part) -> Robot {
    Robot {
        name: part.text("name"),
        version: None,
        links: part.all("link").map(link).collect(),
        joints: part.all("joint").map(joint).collect(),
        materials: part.all("material").map(material).collect(),
    }
}

fn link(part: &Part) -> Link {
    let visual = |part: &Part| Visual {
        name: None,
        origin: origin(part),
        geometry: geometry(part),
        material: part.find("material").map(material),
    };
    let collision = |part: &Part| Collision { name: None, origin: origin(part), geometry: geometry(part) };
    Link {
        name: part.text("name"),
        inertial: part.find("inertial").map(inertial).unwrap_or_default(),
        visual: part.all("visual").map(visual).collect(),
        collision: part.all("collision").map(collision).collect(),
    }
}

fn inertial(part: &Part) -> Inertial {
    let mass = part.find("mass").and_then(|mass| mass.number("value"));
    let inertia = |inertia: &Part| {
        let of = |name| inertia.number(name).unwrap_or_default();
        let [ixx, ixy, ixz, iyy, iyz, izz] = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"].map(of);
        Inertia { ixx, ixy, ixz, iyy, iyz, izz }
    };
    Inertial {
        origin: origin(part),
        mass: Mass { value: mass.unwrap_or_default() },
        inertia: part.find("inertia").map(inertia).unwrap_or_default(),
    }
}

/// Returns the pose of an element's `<origin>`.
fn origin(part: &Part) -> Pose {
    let pose = |origin: &Part| Pose {
        xyz: origin.vector("xyz").unwrap_or_default(),
        rpy: origin.vector("rpy").unwrap_or_default(),
    };
    part.find("origin").map(pose).unwrap_or_default()
}

fn geometry(part: &Part) -> Geometry {
    let shape = part.find("geometry").and_then(|geometry| geometry.parts.first());
    let Some(shape) = shape else { return Geometry::default() };
    let of = |name| shape.number(name).unwrap_or_default();
    match shape.tag {
        "box" => Geometry::Box { size: shape.vector("size").unwrap_or_default() },
        "cylinder" => Geometry::Cylinder { radius: of("radius"), length: of("length") },
        "capsule" => Geometry::Capsule { radius: of("radius"), length: of("length") },
        "mesh" => Geometry::Mesh { filename: shape.text("filename"), scale: shape.vector("scale") },
        "sphere" => Geometry::Sphere { radius: of("radius") },
        // A cone or a plane, which urdf-rs does not have: simd reads it from its node.
        _ => Geometry::Sphere { radius: 1.0 },
    }
}

fn material(part: &Part) -> Material {
    let color = |color: &Part| Color { rgba: color.numbers("rgba").map(Vec4).unwrap_or_default() };
    // simd reads a texture from its node: urdf-rs has none without a file.
    Material { name: part.text("name"), color: part.find("color").map(color), texture: None }
}

fn joint(part: &Part) -> Joint {
    let end = |tag| LinkName { link: part.find(tag).map(|end| end.text("link")).unwrap_or_default() };
    let axis = part.find("axis").and_then(|axis| axis.vector("xyz"));
    let dynamics = |dynamics: &Part| Dynamics {
        damping: dynamics.number("damping").unwrap_or_default(),
        friction: dynamics.number("friction").unwrap_or_default(),
    };
    let mimic = |mimic: &Part| Mimic {
        joint: mimic.text("joint"),
        multiplier: mimic.number("multiplier"),
        offset: mimic.number("offset"),
    };
    Joint {
        name: part.text("name"),
        joint_type: kind(&part.text("type")),
        origin: origin(part),
        parent: end("parent"),
        child: end("child"),
        axis: axis.map(|xyz| Axis { xyz }).unwrap_or_default(),
        limit: part.find("limit").map(limit).unwrap_or_default(),
        calibration: None,
        dynamics: part.find("dynamics").map(dynamics),
        mimic: part.find("mimic").map(mimic),
        safety_controller: None,
    }
}

fn limit(part: &Part) -> JointLimit {
    let of = |name| part.number(name).unwrap_or_default();
    let [lower, upper, effort, velocity] = ["lower", "upper", "effort", "velocity"].map(of);
    JointLimit { lower, upper, effort, velocity, ..JointLimit::default() }
}

fn kind(word: &str) -> JointType {
    match word {
        "revolute" => JointType::Revolute,
        "continuous" => JointType::Continuous,
        "prismatic" => JointType::Prismatic,
        "floating" => JointType::Floating,
        "planar" => JointType::Planar,
        "spherical" => JointType::Spherical,
        _ => JointType::Fixed,
    }
}

#[cfg(test)]
mod tests;
