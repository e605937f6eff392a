//! Writes a draft as URDF: one element per line, numbers with all their digits, rotations as quaternions.

use std::fmt::Write as _;

use glamx::{DPose3, DQuat, DVec3};

use super::TranslatedModel;
use super::draft::{
    At, Draft, DraftConstraint, DraftConstraintKind, DraftDrive, DraftGeometry, DraftJoint, DraftLink,
    DraftSensor, DraftShape, DraftState,
};
use crate::robot::{Inertial, Material, TextureRepeat};

/// Lines with their origins.
#[derive(Default)]
struct Text {
    text: String,
    lines: Vec<At>,
}

impl Text {
    fn line(&mut self, at: At, depth: usize, line: &str) {
        self.text.extend(std::iter::repeat_n("  ", depth));
        self.text.push_str(line);
        self.text.push('\n');
        self.lines.push(at);
    }
}

/// Writes the robot as URDF. `files` are the names of the lines' files.
pub(crate) fn urdf(draft: &Draft, files: Vec<String>) -> TranslatedModel {
    let mut text = Text::default();
    text.line(draft.at, 0, "<?xml version=\"1.0\"?>");
    text.line(draft.at, 0, &format!("<robot name=\"{}\">", escaped(&draft.name)));
    for link in &draft.links {
        write_link(&mut text, link);
    }
    for joint in &draft.joints {
        write_joint(&mut text, joint);
    }
    for joint in &draft.joints {
        write_spring(&mut text, joint);
    }
    for link in &draft.links {
        write_sensors(&mut text, &link.name, &link.sensors);
    }
    for joint in &draft.joints {
        write_sensors(&mut text, &joint.name, &joint.sensors);
    }
    write_drives(&mut text, draft);
    for state in &draft.states {
        write_state(&mut text, state);
    }
    for constraint in &draft.constraints {
        write_constraint(&mut text, constraint);
    }
    for ([a, b], at) in &draft.excluded {
        let (a, b) = (escaped(a), escaped(b));
        text.line(*at, 1, &format!("<disable_collisions link1=\"{a}\" link2=\"{b}\"/>"));
    }
    if draft.self_collision {
        text.line(draft.at, 1, "<gazebo><self_collide>true</self_collide></gazebo>");
    }
    if draft.stays_awake {
        text.line(draft.at, 1, "<gazebo><allow_auto_disable>false</allow_auto_disable></gazebo>");
    }
    text.line(draft.at, 0, "</robot>");
    TranslatedModel {
        name: draft.name.clone(),
        urdf: text.text,
        pose: draft.pose,
        fixed: draft.fixed,
        lines: text.lines,
        files,
    }
}

fn write_link(text: &mut Text, link: &DraftLink) {
    text.line(link.at, 1, &format!("<link name=\"{}\">", escaped(&link.name)));
    if let Some(inertial) = &link.inertial {
        write_inertial(text, link.at, inertial);
    }
    for shape in &link.visuals {
        write_shape(text, "visual", shape);
    }
    for shape in &link.collisions {
        write_shape(text, "collision", shape);
    }
    let Material { friction, restitution, rolling_friction, spinning_friction, .. } = link.material;
    let surface = [
        ("lateral_friction", friction),
        ("restitution", restitution),
        ("rolling_friction", rolling_friction),
        ("spinning_friction", spinning_friction),
        ("contype", link.groups.map(|[group, _]| f64::from(group))),
        ("conaffinity", link.groups.map(|[_, mask]| f64::from(mask))),
    ];
    let said: String =
        surface.iter().filter_map(|(tag, value)| Some(format!("<{tag} value=\"{}\"/>", (*value)?))).collect();
    if !said.is_empty() {
        text.line(link.at, 2, &format!("<contact>{said}</contact>"));
    }
    text.line(link.at, 1, "</link>");
}

fn write_inertial(text: &mut Text, at: At, inertial: &Inertial) {
    let Inertial { mass, center_of_mass, inertia: i } = inertial;
    let (x, y, z) = (i.x_axis, i.y_axis, i.z_axis);
    text.line(at, 2, "<inertial>");
    if *center_of_mass != DVec3::ZERO {
        text.line(at, 3, &format!("<origin xyz=\"{}\"/>", numbers(center_of_mass.to_array())));
    }
    text.line(at, 3, &format!("<mass value=\"{mass}\"/>"));
    let inertia = format!(
        "<inertia ixx=\"{}\" ixy=\"{}\" ixz=\"{}\" iyy=\"{}\" iyz=\"{}\" izz=\"{}\"/>",
        x.x, y.x, z.x, y.y, z.y, z.z
    );
    text.line(at, 3, &inertia);
    text.line(at, 2, "</inertial>");
}

fn write_shape(text: &mut Text, tag: &str, shape: &DraftShape) {
    let at = shape.at;
    text.line(at, 2, &format!("<{tag}>"));
    write_origin(text, at, 3, &shape.link_from_shape);
    let geometry = match &shape.geometry {
        DraftGeometry::Box { size } => format!("<box size=\"{}\"/>", numbers(size.to_array())),
        DraftGeometry::Sphere { radius } => format!("<sphere radius=\"{radius}\"/>"),
        DraftGeometry::Cylinder { radius, length } => {
            format!("<cylinder radius=\"{radius}\" length=\"{length}\"/>")
        }
        DraftGeometry::Capsule { radius, length } => {
            format!("<capsule radius=\"{radius}\" length=\"{length}\"/>")
        }
        DraftGeometry::Cone { radius, length } => format!("<cone radius=\"{radius}\" length=\"{length}\"/>"),
        DraftGeometry::Plane { normal } => format!("<plane normal=\"{}\"/>", numbers(normal.to_array())),
        DraftGeometry::Mesh { uri, scale } => {
            let scale = match *scale {
                DVec3::ONE => String::new(),
                scale => format!(" scale=\"{}\"", numbers(scale.to_array())),
            };
            format!("<mesh filename=\"{}\"{scale}/>", escaped(uri))
        }
    };
    text.line(at, 3, &format!("<geometry>{geometry}</geometry>"));
    let color = shape.color.map(|color| format!("<color rgba=\"{}\"/>", numbers(color)));
    let texture = shape.texture.as_ref().map(|(uri, repeat)| {
        let repeat = match *repeat {
            whole if whole == TextureRepeat::default() => String::new(),
            TextureRepeat::Times(often) => format!(" repeat=\"{}\"", numbers(often)),
            TextureRepeat::PerMetre(often) => format!(" per_metre=\"{}\"", numbers(often)),
        };
        format!("<texture filename=\"{}\"{repeat}/>", escaped(uri))
    });
    let look: String = color.into_iter().chain(texture).collect();
    if tag == "visual" && !look.is_empty() {
        text.line(at, 3, &format!("<material name=\"\">{look}</material>"));
    }
    text.line(at, 2, &format!("</{tag}>"));
}

fn write_origin(text: &mut Text, at: At, depth: usize, pose: &DPose3) {
    let mut said = String::new();
    if pose.translation != DVec3::ZERO {
        // Writing to a string cannot fail.
        let _ = write!(said, " xyz=\"{}\"", numbers(pose.translation.to_array()));
    }
    if pose.rotation != DQuat::IDENTITY {
        let _ = write!(said, " quat_xyzw=\"{}\"", numbers(pose.rotation.to_array()));
    }
    if !said.is_empty() {
        text.line(at, depth, &format!("<origin{said}/>"));
    }
}

fn write_joint(text: &mut Text, joint: &DraftJoint) {
    let at = joint.at;
    text.line(at, 1, &format!("<joint name=\"{}\" type=\"{}\">", escaped(&joint.name), joint.kind));
    write_origin(text, at, 2, &joint.parent_from_joint);
    text.line(at, 2, &format!("<parent link=\"{}\"/>", escaped(&joint.parent)));
    text.line(at, 2, &format!("<child link=\"{}\"/>", escaped(&joint.child)));
    let one_axis = ["revolute", "continuous", "prismatic"].contains(&joint.kind);
    if one_axis {
        text.line(at, 2, &format!("<axis xyz=\"{}\"/>", numbers(joint.axis.to_array())));
        write_limit(text, joint);
    }
    let dynamics = [("damping", joint.damping), ("friction", joint.friction), ("armature", joint.armature)];
    let said: String = dynamics
        .iter()
        .filter(|(_, value)| *value != 0.0)
        .map(|(name, value)| format!(" {name}=\"{value}\""))
        .collect();
    if !said.is_empty() {
        text.line(at, 2, &format!("<dynamics{said}/>"));
    }
    if let Some((leader, multiplier, offset)) = &joint.mimic {
        let leader = escaped(leader);
        let mimic = format!("<mimic joint=\"{leader}\" multiplier=\"{multiplier}\" offset=\"{offset}\"/>");
        text.line(at, 2, &mimic);
    }
    if let Some((terms, offset)) = &joint.tendon {
        text.line(at, 2, &format!("<tendon offset=\"{offset}\">"));
        for (joint, factor) in terms {
            text.line(at, 3, &format!("<joint joint=\"{}\" coef=\"{factor}\"/>", escaped(joint)));
        }
        text.line(at, 2, "</tendon>");
    }
    text.line(at, 1, "</joint>");
}

fn write_limit(text: &mut Text, joint: &DraftJoint) {
    let limits = &joint.limits;
    let mut said = String::new();
    let mut say = |name: &str, value: Option<f64>| {
        if let Some(value) = value {
            let _ = write!(said, " {name}=\"{value}\"");
        }
    };
    // URDF reads a missing one of the two as 0, and 0 for both as no limits: so infinity means no limit.
    if limits.lower.is_some() || limits.upper.is_some() {
        say("lower", Some(limits.lower.unwrap_or(f64::NEG_INFINITY)));
        say("upper", Some(limits.upper.unwrap_or(f64::INFINITY)));
    }
    say("effort", limits.effort);
    say("velocity", limits.velocity);
    if !said.is_empty() {
        text.line(joint.at, 2, &format!("<limit{said}/>"));
    }
}

fn write_spring(text: &mut Text, joint: &DraftJoint) {
    let Some([stiffness, rest]) = joint.spring else { return };
    let name = escaped(&joint.name);
    text.line(joint.at, 1, &format!("<gazebo reference=\"{name}\">"));
    text.line(joint.at, 2, &format!("<springStiffness>{stiffness}</springStiffness>"));
    text.line(joint.at, 2, &format!("<springReference>{rest}</springReference>"));
    text.line(joint.at, 1, "</gazebo>");
}

/// Writes the sensors of a link or a joint.
fn write_sensors(text: &mut Text, reference: &str, sensors: &[DraftSensor]) {
    for DraftSensor { name, at, kind, pose, lines } in sensors {
        text.line(*at, 1, &format!("<gazebo reference=\"{}\">", escaped(reference)));
        text.line(*at, 2, &format!("<sensor name=\"{}\" type=\"{}\">", escaped(name), escaped(kind)));
        if *pose != DPose3::IDENTITY {
            let (position, rotation) =
                (numbers(pose.translation.to_array()), numbers(pose.rotation.to_array()));
            text.line(*at, 3, &format!("<pose rotation_format=\"quat_xyzw\">{position} {rotation}</pose>"));
        }
        for (at, depth, line) in lines {
            text.line(*at, 3 + depth, line);
        }
        text.line(*at, 2, "</sensor>");
        text.line(*at, 1, "</gazebo>");
    }
}

fn write_drives(text: &mut Text, draft: &Draft) {
    let said = |joint: &&DraftJoint| joint.drive.is_some() || joint.position.is_some();
    let mut joints = draft.joints.iter().filter(said).peekable();
    if joints.peek().is_none() {
        return;
    }
    text.line(draft.at, 1, &format!("<ros2_control name=\"{}\" type=\"system\">", escaped(&draft.name)));
    for joint in joints {
        let at = joint.at;
        text.line(at, 2, &format!("<joint name=\"{}\">", escaped(&joint.name)));
        // A joint with only a position holds it.
        let holds = DraftDrive { command: Some("position"), ..DraftDrive::default() };
        let drive = joint.drive.as_ref().unwrap_or(&holds);
        if let Some(command) = drive.command {
            text.line(at, 3, &format!("<command_interface name=\"{command}\"/>"));
        }
        let names = if drive.command == Some("velocity") { ["", "vel_kp"] } else { ["pos_kp", "pos_kd"] };
        for (name, gain) in names.into_iter().zip([drive.stiffness, drive.damping]) {
            if let Some(gain) = gain.filter(|_| !name.is_empty()) {
                text.line(at, 3, &format!("<param name=\"{name}\">{gain}</param>"));
            }
        }
        if drive.gravity_compensation {
            text.line(at, 3, "<param name=\"gravity_compensation\">true</param>");
        }
        let measured = match joint.position {
            Some(position) => format!(
                "<state_interface name=\"position\"><param name=\"initial_value\">{position}</param></state_interface>"
            ),
            None => "<state_interface name=\"position\"/>".to_owned(),
        };
        text.line(at, 3, &measured);
        text.line(at, 2, "</joint>");
    }
    text.line(draft.at, 1, "</ros2_control>");
}

fn write_state(text: &mut Text, state: &DraftState) {
    text.line(state.at, 1, &format!("<group_state name=\"{}\">", escaped(&state.name)));
    for (joint, position) in &state.positions {
        let joint = escaped(joint);
        text.line(state.at, 2, &format!("<joint name=\"{joint}\" value=\"{position}\"/>"));
    }
    text.line(state.at, 1, "</group_state>");
}

fn write_constraint(text: &mut Text, constraint: &DraftConstraint) {
    let DraftConstraint { name, at, kind, ends, collisions } = constraint;
    let (word, axis, said) = match *kind {
        DraftConstraintKind::Weld => ("weld", None, String::new()),
        DraftConstraintKind::PointToPoint => ("point_to_point", None, String::new()),
        DraftConstraintKind::Hinge(axis) => ("hinge", Some(axis), String::new()),
        DraftConstraintKind::Slide(axis) => ("slide", Some(axis), String::new()),
        DraftConstraintKind::Gear(ratio, offset) => {
            ("gear", None, format!(" ratio=\"{ratio}\" offset=\"{offset}\""))
        }
    };
    let name = escaped(name);
    let line = format!("<constraint name=\"{name}\" type=\"{word}\"{said} collide=\"{collisions}\">");
    text.line(*at, 1, &line);
    for (tag, end) in ["parent", "child"].into_iter().zip(ends) {
        let mut said = String::new();
        let of = if word == "gear" { "joint" } else { "link" };
        for (attribute, value) in [(of, &end.name), ("robot", &end.robot)] {
            if let Some(value) = value {
                // Writing to a string cannot fail.
                let _ = write!(said, " {attribute}=\"{}\"", escaped(value));
            }
        }
        if word == "gear" {
            text.line(*at, 2, &format!("<{tag}{said}/>"));
            continue;
        }
        text.line(*at, 2, &format!("<{tag}{said}>"));
        let (xyz, quat) = (end.pose.translation.to_array(), end.pose.rotation.to_array());
        let origin = format!("<origin xyz=\"{}\" quat_xyzw=\"{}\"/>", numbers(xyz), numbers(quat));
        text.line(*at, 3, &origin);
        text.line(*at, 2, &format!("</{tag}>"));
    }
    if let Some(axis) = axis {
        text.line(*at, 2, &format!("<axis xyz=\"{}\"/>", numbers(axis.to_array())));
    }
    text.line(*at, 1, "</constraint>");
}

fn numbers<const N: usize>(values: [f64; N]) -> String {
    let words: Vec<String> = values.iter().map(|value| format!("{value}")).collect();
    words.join(" ")
}

/// Escapes text for an attribute or an element.
pub(crate) fn escaped(text: &str) -> String {
    let mut written = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => written += "&amp;",
            '<' => written += "&lt;",
            '>' => written += "&gt;",
            '"' => written += "&quot;",
            _ if character.is_control() => written.push(' '),
            _ => written.push(character),
        }
    }
    written
}
