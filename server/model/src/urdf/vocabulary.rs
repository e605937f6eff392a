//! The vocabulary of URDF: elements and attributes that simd reads, and their values.

/// An element that simd reads.
pub(super) struct Element {
    /// Its tag.
    pub(super) tag: &'static str,
    /// Whether a parent may hold several.
    pub(super) many: bool,
    /// Effect on a parent that lacks it.
    pub(super) missing: Missing,
    /// Known attributes. Others are reported as ignored.
    pub(super) attributes: &'static [Attribute],
    /// Known children. Others are reported as ignored.
    pub(super) children: &'static [Element],
    /// Whether it has exactly one of its children, the first usable one.
    pub(super) one_of: bool,
}

/// An attribute that simd reads.
pub(super) struct Attribute {
    /// Its name.
    pub(super) name: &'static str,
    /// Type of its value.
    pub(super) kind: Kind,
    /// Effect on an element that lacks it.
    pub(super) missing: Missing,
}

/// Type of an attribute's value.
pub(super) enum Kind {
    /// Any text.
    Text,
    /// Text that names something.
    Name,
    /// URI of a file.
    Uri,
    /// One of these words.
    Word(&'static [&'static str]),
    /// This many numbers.
    Numbers(Shape),
    /// Numbers that simd reads from the node, since urdf-rs does not have them.
    OursNumbers(usize),
    /// Known, but not used by simd: no finding.
    Unused,
}

/// Effect on an element that lacks a part.
pub(super) enum Missing {
    /// No effect.
    Leave,
    /// It gets this text.
    Text(&'static str),
    /// Its number is 0.
    Zero,
    /// It is left out, with a warning.
    Drop,
    /// The robot is refused.
    Refuse,
}

use Kind::{Name, OursNumbers, Text, Unused, Uri, Word};
use Missing::{Drop, Leave, Refuse, Zero};

use super::numbers::Shape;

const fn attribute(name: &'static str, kind: Kind, missing: Missing) -> Attribute {
    Attribute { name, kind, missing }
}

const fn element(
    tag: &'static str,
    attributes: &'static [Attribute],
    children: &'static [Element],
) -> Element {
    Element { tag, many: false, missing: Leave, attributes, children, one_of: false }
}

const fn many(element: Element) -> Element {
    Element { many: true, ..element }
}

const fn needed(element: Element, missing: Missing) -> Element {
    Element { missing, ..element }
}

#[allow(non_snake_case, reason = "it stands where the kinds of values stand")]
const fn Numbers(count: usize) -> Kind {
    Kind::Numbers(Shape::Exactly(count))
}

const JOINT_TYPES: &[&str] =
    &["revolute", "continuous", "prismatic", "fixed", "floating", "planar", "spherical"];

const ORIGIN: Element = element(
    "origin",
    &[
        attribute("xyz", Numbers(3), Leave),
        attribute("rpy", Numbers(3), Leave),
        attribute("quat_xyzw", OursNumbers(4), Leave),
    ],
    &[],
);

const MATERIAL: Element = element(
    "material",
    &[attribute("name", Text, Missing::Text(""))],
    &[
        element("color", &[attribute("rgba", Kind::Numbers(Shape::Color), Drop)], &[]),
        element(
            "texture",
            &[
                attribute("filename", Uri, Leave),
                attribute("repeat", OursNumbers(2), Leave),
                attribute("per_metre", OursNumbers(2), Leave),
            ],
            &[],
        ),
    ],
);

const SHAPES: &[Element] = &[
    element("box", &[attribute("size", Numbers(3), Drop)], &[]),
    element("cylinder", &[attribute("radius", Numbers(1), Drop), attribute("length", Numbers(1), Drop)], &[]),
    element("capsule", &[attribute("radius", Numbers(1), Drop), attribute("length", Numbers(1), Drop)], &[]),
    element("sphere", &[attribute("radius", Numbers(1), Drop)], &[]),
    element(
        "mesh",
        &[attribute("filename", Uri, Drop), attribute("scale", Kind::Numbers(Shape::Scale), Leave)],
        &[],
    ),
    // SDF's.
    element(
        "cone",
        &[attribute("radius", OursNumbers(1), Drop), attribute("length", OursNumbers(1), Drop)],
        &[],
    ),
    // PyBullet's.
    element("plane", &[attribute("normal", OursNumbers(3), Leave)], &[]),
];

const GEOMETRY: Element = Element { one_of: true, ..needed(element("geometry", &[], SHAPES), Drop) };

const INERTIA: Element = element(
    "inertia",
    &[
        attribute("ixx", Numbers(1), Zero),
        attribute("ixy", Numbers(1), Zero),
        attribute("ixz", Numbers(1), Zero),
        attribute("iyy", Numbers(1), Zero),
        attribute("iyz", Numbers(1), Zero),
        attribute("izz", Numbers(1), Zero),
    ],
    &[],
);

const INERTIAL: Element = element(
    "inertial",
    &[],
    &[ORIGIN, element("mass", &[attribute("value", Numbers(1), Drop)], &[]), INERTIA],
);

/// PyBullet's attributes of a link's surface, and MuJoCo's of its collision groups.
const CONTACT: Element = element(
    "contact",
    &[],
    &[
        element("lateral_friction", &[attribute("value", Numbers(1), Drop)], &[]),
        element("restitution", &[attribute("value", Numbers(1), Drop)], &[]),
        element("rolling_friction", &[attribute("value", Numbers(1), Drop)], &[]),
        element("spinning_friction", &[attribute("value", Numbers(1), Drop)], &[]),
        element("contype", &[attribute("value", Numbers(1), Drop)], &[]),
        element("conaffinity", &[attribute("value", Numbers(1), Drop)], &[]),
    ],
);

const LINK: Element = element(
    "link",
    &[attribute("name", Name, Refuse), attribute("type", Unused, Leave)],
    &[
        INERTIAL,
        many(element("visual", &[attribute("name", Unused, Leave)], &[ORIGIN, GEOMETRY, MATERIAL])),
        many(element("collision", &[attribute("name", Unused, Leave)], &[ORIGIN, GEOMETRY])),
        CONTACT,
    ],
);

const JOINT: Element = element(
    "joint",
    &[attribute("name", Name, Refuse), attribute("type", Word(JOINT_TYPES), Refuse)],
    &[
        ORIGIN,
        needed(element("parent", &[attribute("link", Name, Refuse)], &[]), Refuse),
        needed(element("child", &[attribute("link", Name, Refuse)], &[]), Refuse),
        element("axis", &[attribute("xyz", Numbers(3), Drop)], &[]),
        element(
            "limit",
            &[
                attribute("lower", Kind::Numbers(Shape::Bound), Leave),
                attribute("upper", Kind::Numbers(Shape::Bound), Leave),
                attribute("effort", Kind::Numbers(Shape::Bound), Leave),
                attribute("velocity", Kind::Numbers(Shape::Bound), Zero),
            ],
            &[],
        ),
        element(
            "dynamics",
            &[
                attribute("damping", Numbers(1), Leave),
                attribute("friction", Numbers(1), Leave),
                attribute("armature", OursNumbers(1), Leave),
            ],
            &[],
        ),
        element(
            "mimic",
            &[
                attribute("joint", Name, Drop),
                attribute("multiplier", Numbers(1), Leave),
                attribute("offset", Numbers(1), Leave),
            ],
            &[],
        ),
        // MuJoCo's fixed tendons.
        element(
            "tendon",
            &[attribute("offset", OursNumbers(1), Leave)],
            &[many(element(
                "joint",
                &[attribute("joint", Name, Drop), attribute("coef", OursNumbers(1), Drop)],
                &[],
            ))],
        ),
    ],
);

/// Name of a nameless robot.
pub(super) const NAMELESS: &str = "robot";

/// The root. `version` has no effect: simd reads the elements of all versions. [`setup`](super::setup) reads elements that concern no single link or joint.
pub(super) const ROBOT: Element = element(
    "robot",
    &[attribute("name", Name, Missing::Text(NAMELESS)), attribute("version", Unused, Leave)],
    &[many(LINK), many(JOINT), many(MATERIAL)],
);
