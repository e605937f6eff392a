//! Sites of MJCF and frames of SDF are links at their places, and change nothing else of their robots.
//!
//! The trees are random. Each test computes its expected poses while it writes the file.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use fastrand::Rng;
use glamx::{DPose3, DQuat, DVec3};
use simd_model::robot::{JointKind, RobotModel};
use simd_model::{LoadLimits, ReadOptions, Translation};

use crate::mutations::Nothing;

/// Number of files of each format.
const FILES: u64 = 200;

fn vector(random: &mut Rng) -> DVec3 {
    DVec3::new(random.f64(), random.f64(), random.f64()) * 2.0 - DVec3::ONE
}

fn pose(random: &mut Rng) -> DPose3 {
    let turn = DQuat::from_scaled_axis(vector(random) * 3.0);
    DPose3::from_parts(vector(random), turn)
}

fn words(values: impl IntoIterator<Item = f64>) -> String {
    values.into_iter().map(|value| format!("{value}")).collect::<Vec<_>>().join(" ")
}

fn translated(text: &str) -> Translation {
    let read = simd_model::translate(text.as_bytes(), &Nothing, &LoadLimits::default());
    read.unwrap_or_else(|refused| panic!("{refused}\n{text}")).unwrap()
}

/// Returns the robots of a file, each with its pose in the world.
fn robots(translation: &Translation) -> Vec<(RobotModel, DPose3)> {
    let read = |urdf: &str| simd_model::read(urdf.as_bytes(), &Nothing, &ReadOptions::default()).unwrap().0;
    translation.models.iter().map(|model| (read(&model.urdf), model.pose)).collect()
}

/// Returns the pose of each link by its name with all joints at zero, and the name of its parent.
fn links((model, world_from_root): &(RobotModel, DPose3)) -> BTreeMap<&str, (DPose3, &str)> {
    let mut poses = vec![*world_from_root];
    for joint in &model.joints {
        poses.push(poses[joint.parent] * joint.parent_from_joint);
    }
    let parent = |link: usize| {
        link.checked_sub(1).map_or("", |joint| model.links[model.joints[joint].parent].name.as_str())
    };
    let named = model.links.iter().zip(poses).enumerate();
    named.map(|(index, (link, pose))| (link.name.as_str(), (pose, parent(index)))).collect()
}

fn apart(a: DPose3, b: DPose3) -> f64 {
    let turn = |pose: DPose3, axis: DVec3| pose.rotation * axis;
    let axes = DVec3::AXES.map(|axis| (turn(a, axis) - turn(b, axis)).length());
    axes.into_iter().fold((a.translation - b.translation).length(), f64::max)
}

/// Names of links other than frames, and of joints that move.
fn bones(model: &RobotModel) -> (Vec<&str>, Vec<&str>, f64) {
    let hangs = |link: usize| link.checked_sub(1).is_some_and(|joint| !model.joints[joint].kind.moves());
    let is_frame = |link: usize| {
        let of = &model.links[link];
        hangs(link) && of.inertial.mass == 0.0 && of.collisions.is_empty() && of.visuals.is_empty()
    };
    let links = (0..model.links.len()).filter(|link| !is_frame(*link));
    let moving = model.joints.iter().filter(|joint| joint.kind != JointKind::Fixed);
    (
        links.map(|link| model.links[link].name.as_str()).collect(),
        moving.map(|joint| joint.name.as_str()).collect(),
        model.links.iter().map(|link| link.inertial.mass).sum(),
    )
}

/// Checks that frames change neither roots nor links, joints and masses.
fn assert_bones_are_equal(with: &[(RobotModel, DPose3)], without: &[(RobotModel, DPose3)], text: &str) {
    assert_eq!(with.len(), without.len(), "{text}");
    for ((one, pose), (other, other_pose)) in with.iter().zip(without) {
        assert_eq!(bones(one), bones(other), "{text}");
        assert_eq!((pose, &one.links[0].name), (other_pose, &other.links[0].name), "{text}");
    }
}

/// A site, as it should be read.
struct Site {
    name: String,
    /// Body of the world above it, and its own.
    top: String,
    body: String,
    world_from_site: DPose3,
}

#[derive(Default)]
struct Mjcf {
    text: String,
    bodies: usize,
    sites: Vec<Site>,
}

impl Mjcf {
    /// Writes the attributes of a random pose.
    fn placed(&mut self, random: &mut Rng) -> DPose3 {
        let mut place = pose(random);
        let [x, y, z, w] = place.rotation.to_array();
        write!(self.text, " pos='{}'", words(place.translation.to_array())).unwrap();
        match random.u8(0..3) {
            0 => write!(self.text, " quat='{}'", words([w, x, y, z])).unwrap(),
            1 => {
                let (axis, angle) = place.rotation.to_axis_angle();
                let [x, y, z] = axis.to_array();
                write!(self.text, " axisangle='{}'", words([x, y, z, angle])).unwrap();
            }
            _ => {
                let [a, b, c] = vector(random).to_array();
                write!(self.text, " euler='{}'", words([a, b, c])).unwrap();
                place.rotation =
                    DQuat::from_rotation_x(a) * DQuat::from_rotation_y(b) * DQuat::from_rotation_z(c);
            }
        }
        place
    }

    /// Writes sites of a body, some of them within frames, and some with the name of a body of their tree.
    fn sites(&mut self, random: &mut Rng, top: &str, body: &str, world_from_body: DPose3) {
        for _ in 0..random.usize(0..4) {
            let mut place = world_from_body;
            let depth = random.usize(0..3);
            for _ in 0..depth {
                self.text += "<frame";
                place *= self.placed(random);
                self.text += ">";
            }
            let number = self.sites.len();
            let is_taken = self.sites.iter().any(|site| site.name == body);
            let name =
                if random.u8(0..5) == 0 && !is_taken { body.to_owned() } else { format!("site_{number}") };
            write!(self.text, "<site name='{name}'").unwrap();
            place *= self.placed(random);
            self.text += "/>\n";
            self.text += &"</frame>".repeat(depth);
            let (top, body) = (top.to_owned(), body.to_owned());
            self.sites.push(Site { name, top, body, world_from_site: place });
        }
    }

    fn body(&mut self, random: &mut Rng, top: Option<&str>, parent: DPose3, depth: usize) {
        let name = format!("body_{}", self.bodies);
        let top = top.map_or_else(|| name.clone(), str::to_owned);
        self.bodies += 1;
        write!(self.text, "<body name='{name}'").unwrap();
        let world_from_body = parent * self.placed(random);
        self.text += "><geom size='0.1'/>\n";
        if depth == 0 && random.bool() {
            self.text += "<freejoint/>";
        } else {
            // Bodies of the world move, so that each of them is a robot.
            for joint in 0..random.usize(usize::from(depth == 0)..3) {
                let (kind, at) = (["hinge", "slide", "ball"][random.usize(0..3)], vector(random));
                let kind = if joint > 0 && kind == "ball" { "hinge" } else { kind };
                let at = words(at.to_array());
                writeln!(self.text, "<joint name='{name}_{joint}' type='{kind}' pos='{at}'/>").unwrap();
            }
        }
        self.sites(random, &top, &name, world_from_body);
        for _ in 0..if depth < 4 { random.usize(0..3) } else { 0 } {
            self.body(random, Some(&top), world_from_body, depth + 1);
        }
        self.sites(random, &top, &name, world_from_body);
        self.text += "</body>\n";
    }
}

#[test]
fn sites_of_random_trees_are_links_at_their_places_and_change_nothing_else() {
    let mut all = 0;
    for seed in 0..FILES {
        let random = &mut Rng::with_seed(seed);
        let mut file =
            Mjcf { text: "<mujoco><compiler angle='radian'/><worldbody>".into(), ..Mjcf::default() };
        for _ in 0..random.usize(1..4) {
            file.body(random, None, DPose3::IDENTITY, 0);
        }
        let Mjcf { mut text, sites, .. } = file;
        text += "</worldbody></mujoco>";
        println!("seed {seed}");
        let with = robots(&translated(&text));
        let without: String = text.lines().map(|line| format!("{}\n", without_site(line))).collect();
        assert_bones_are_equal(&with, &robots(&translated(&without)), &text);
        for Site { name, top, body, world_from_site } in &sites {
            let of_top = with.iter().map(links).find(|links| links.contains_key(top.as_str())).unwrap();
            let given = if name == body { format!("{name}_site") } else { name.clone() };
            let (pose, parent) = of_top.get(given.as_str()).unwrap_or_else(|| panic!("{given}: {text}"));
            assert_eq!(parent, body, "{name}: {text}");
            assert!(apart(*pose, *world_from_site) < 1e-9, "{name}: {text}");
            all += 1;
        }
    }
    assert!(all > 1000, "only {all} sites");
}

fn without_site(line: &str) -> &str {
    line.find("<site").map_or(line, |at| &line[..at])
}

/// A model of an SDF while it is written: poses of what has a frame, and the link that each is fixed to.
#[derive(Default)]
struct Sdf {
    text: String,
    places: BTreeMap<String, (DPose3, String)>,
    frames: Vec<String>,
}

fn sdf_pose(pose: &DPose3, relative_to: &str) -> String {
    let at = words(pose.translation.to_array().into_iter().chain(pose.rotation.to_array()));
    let relative_to = match relative_to {
        "" => String::new(),
        name => format!(" relative_to='{name}'"),
    };
    format!("<pose rotation_format='quat_xyzw'{relative_to}>{at}</pose>")
}

impl Sdf {
    /// Returns a random frame so far, or the model's own.
    fn any(&self, random: &mut Rng) -> (String, DPose3) {
        let index = random.usize(0..=self.places.len());
        self.places
            .iter()
            .nth(index)
            .map_or_else(|| (String::new(), DPose3::IDENTITY), |(name, (pose, _))| (name.clone(), *pose))
    }

    fn of(random: &mut Rng, depth: usize) -> Self {
        let mut model = Self::default();
        let count = random.usize(1..5);
        for number in 0..count {
            let ((relative_to, base), own) = (model.any(random), pose(random));
            let name = format!("link_{number}");
            writeln!(
                model.text,
                "<link name='{name}'>{}<inertial><mass>2</mass></inertial></link>",
                sdf_pose(&own, &relative_to)
            )
            .unwrap();
            model.places.insert(name.clone(), (base * own, name.clone()));
            if number > 0 && random.u8(0..4) > 0 {
                let parent = format!("link_{}", random.usize(0..number));
                let (joint, kind) = (format!("joint_{number}"), ["fixed", "revolute"][random.usize(0..2)]);
                let own = if random.bool() { pose(random) } else { DPose3::IDENTITY };
                writeln!(
                    model.text,
                    "<joint name='{joint}' type='{kind}'>{}<parent>{parent}</parent><child>{name}</child>\
                     <axis><xyz>0 0 1</xyz></axis></joint>",
                    sdf_pose(&own, "")
                )
                .unwrap();
                model.places.insert(joint, (base_of(&model, &name) * own, name));
            }
        }
        if depth < 2 && random.bool() {
            let (inner, own) = (Self::of(random, depth + 1), pose(random));
            writeln!(model.text, "<model name='inner'>{}{}</model>", sdf_pose(&own, ""), inner.text).unwrap();
            let full = |name: &str| format!("inner::{name}");
            for (name, (place, link)) in inner.places {
                model.places.insert(full(&name), (own * place, full(&link)));
            }
            model.frames.extend(inner.frames.iter().map(|name| full(name)));
        }
        for number in 0..random.usize(1..6) {
            let ((attached_to, base), own) = (model.any(random), pose(random));
            let (relative_to, base) = if random.bool() { model.any(random) } else { (String::new(), base) };
            // Without `relative_to` a pose is in the frame that it is attached to.
            let base = match (relative_to.as_str(), attached_to.as_str()) {
                ("", "") => DPose3::IDENTITY,
                ("", attached_to) => base_of(&model, attached_to),
                _ => base,
            };
            let name = format!("frame_{number}");
            let attribute = match attached_to.as_str() {
                "" => String::new(),
                to => format!(" attached_to='{to}'"),
            };
            let place = sdf_pose(&own, &relative_to);
            writeln!(model.text, "<frame name='{name}'{attribute}>{place}</frame>").unwrap();
            let link = model.places.get(&attached_to).map_or("link_0", |(_, link)| link.as_str()).to_owned();
            model.places.insert(name.clone(), (base * own, link));
            model.frames.push(name);
        }
        model
    }
}

fn base_of(model: &Sdf, name: &str) -> DPose3 {
    model.places[name].0
}

#[test]
fn frames_of_random_models_are_links_at_their_places_and_change_nothing_else() {
    let mut all = 0;
    for seed in 0..FILES {
        let random = &mut Rng::with_seed(seed);
        let Sdf { text, places, frames } = Sdf::of(random, 0);
        let is_static = if random.u8(0..5) == 0 { "<static>1</static>" } else { "" };
        let placed = pose(random);
        let whole = |content: &str| {
            let pose = sdf_pose(&placed, "");
            format!("<sdf version='1.9'>\n<model name='m'>{pose}{is_static}\n{content}</model></sdf>")
        };
        println!("seed {seed}");
        let text = whole(&text);
        let read = translated(&text);
        let with = robots(&read);
        // Other elements are relative to frames, so that they stay in the text: only the links of them go.
        let names: Vec<&str> = frames.iter().map(String::as_str).collect();
        for (model, _) in &with {
            let is_frame = |link: &&str| names.contains(link);
            assert!(!is_frame(&model.links[0].name.as_str()), "{text}");
            let masses = model.links.iter().filter(|link| names.contains(&link.name.as_str()));
            assert!(masses.clone().all(|link| link.inertial.mass == 0.0), "{text}");
        }
        for name in &frames {
            let (model_from_frame, link) = &places[name];
            let of = with.iter().map(links).find_map(|links| links.get(name.as_str()).copied());
            let (pose, parent) = of.unwrap_or_else(|| panic!("{name}: {text}"));
            assert_eq!(parent, link, "{name}: {text}");
            assert!(apart(pose, placed * *model_from_frame) < 1e-9, "{name}: {text}");
            all += 1;
        }
        let count = frames.len();
        let are = if count == 1 { "frame is a link" } else { "frames are links" };
        let said = format!("{count} {are} without mass");
        assert!(read.report.findings.iter().any(|finding| finding.message == said), "{said}");
    }
    assert!(all > 500, "only {all} frames");
}
