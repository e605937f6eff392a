//! Geoms: shapes for visuals, collisions and masses.

use glamx::{DMat3, DPose3, DQuat, DVec3};

use super::assets::{Library, Mesh};
use super::compiler::Compiler;
use super::defaults::Classed;
use super::fit;
use super::inline_mesh::Made;
use super::mesh_inertia;
use super::value;
use crate::assets::{Asset, Assets};
use crate::inertia;
use crate::limits::LoadLimits;
use crate::mesh;
use crate::report::Disposition::{Ignored, Repaired};
use crate::robot::{Geometry, Inertial, Material, MeshAsset, look_of};
use crate::translation::draft::{At, DraftGeometry, DraftShape};
use crate::translation::element::Element;
use crate::translation::ellipsoid::ellipsoid;
use crate::translation::notes::{Notes, Stop};
use crate::urdf::findings::quoted;

/// Data for reading a geom.
pub(super) struct Context<'r> {
    pub(super) compiler: &'r Compiler,
    pub(super) library: &'r Library,
    pub(super) assets: &'r dyn Assets,
    /// Files that were made from meshes in the description itself.
    pub(super) made: &'r Made,
    pub(super) limits: &'r LoadLimits,
}

/// A geom, in its body's frame.
#[derive(Clone, Debug)]
pub(super) struct Geom {
    pub(super) shape: DraftShape,
    pub(super) is_visual: bool,
    pub(super) is_collision: bool,
    pub(super) contype: u32,
    pub(super) conaffinity: u32,
    pub(super) material: Material,
    group: f64,
    /// In the body's frame.
    inertial: Inertial,
}

/// Highest group that MuJoCo's viewer shows.
const SHOWN: f64 = 2.0;

pub(super) fn read(
    geom: &Classed,
    body_from_frame: &DPose3,
    context: &Context,
    notes: &mut Notes,
) -> Result<Option<Geom>, Stop> {
    let element = geom.element;
    let kind = geom.word("type").unwrap_or(if geom.word("mesh").is_some() { "mesh" } else { "sphere" });
    let mut pose = geom.pose(context.compiler, notes)?;
    let size = if fit::is_fitted(geom, kind) {
        let Some(fitted) = fit::fit(geom, kind, context, notes)? else { return Ok(None) };
        pose *= fitted.geom_from_fitted;
        fitted.size.to_vec()
    } else {
        geom.list("size", 3)?.unwrap_or_default()
    };
    let size = |index: usize| size.get(index).copied().unwrap_or(0.0);
    let mut half = size(1);
    if let Some([a, b, c, d, e, f]) = geom.numbers("fromto", notes)? {
        let (from, to) = (DVec3::new(a, b, c), DVec3::new(d, e, f));
        let along = value::direction(element, from - to)?;
        pose = DPose3::from_parts((from + to) * 0.5, DQuat::from_rotation_arc(DVec3::Z, along));
        half = 0.5 * (from - to).length();
    }
    let has_ends = geom.word("fromto").is_some();
    pose = *body_from_frame * pose;
    let plain = |geometry: DraftGeometry, solid: Geometry| (pose, geometry, inertia_of(&solid));
    let (pose, geometry, of_water) = match kind {
        "plane" => (pose, DraftGeometry::Plane { normal: DVec3::Z }, None),
        "sphere" => plain(DraftGeometry::Sphere { radius: size(0) }, Geometry::Sphere { radius: size(0) }),
        "capsule" => {
            let (radius, length) = (size(0), 2.0 * half);
            plain(DraftGeometry::Capsule { radius, length }, Geometry::Capsule { radius, length })
        }
        "cylinder" => {
            let (radius, length) = (size(0), 2.0 * half);
            plain(DraftGeometry::Cylinder { radius, length }, Geometry::Cylinder { radius, length })
        }
        "box" => {
            let halves = if has_ends {
                DVec3::new(size(0), size(0), half)
            } else {
                DVec3::new(size(0), size(1), size(2))
            };
            plain(DraftGeometry::Box { size: 2.0 * halves }, Geometry::Box { size: 2.0 * halves })
        }
        "ellipsoid" => {
            let radii = if has_ends {
                DVec3::new(size(0), size(0), half)
            } else {
                DVec3::new(size(0), size(1), size(2))
            };
            let (turn, geometry, message) = ellipsoid(radii);
            notes.warn(element, Repaired, message);
            // A scaled ball, with its own volume and moments.
            let mass = inertia::DENSITY * std::f64::consts::PI * 4.0 / 3.0 * radii.x * radii.y * radii.z;
            let [x, y, z] = (radii * radii).to_array();
            let tensor = DMat3::from_diagonal(DVec3::new(y + z, x + z, x + y)) * (0.2 * mass);
            (
                pose * turn,
                geometry,
                Some(Inertial { mass, center_of_mass: DVec3::ZERO, inertia: rotated_back(tensor, turn) }),
            )
        }
        "mesh" | "sdf" => match mesh_geom(geom, &pose, context, notes)? {
            Some(found) => found,
            None => return Ok(None),
        },
        "hfield" => {
            let name = geom.word("hfield").unwrap_or_default();
            let Some((uri, scale)) = context.library.heights.get(name) else {
                notes.warn(
                    element,
                    Ignored,
                    format!("there is no height field {} that could be read; left out", quoted(name)),
                );
                return Ok(None);
            };
            (pose, DraftGeometry::Mesh { uri: uri.clone(), scale: *scale }, None)
        }
        other => return Err(Stop::at(element, format!("simd knows no geom of type {}", quoted(other)))),
    };
    let bits = |name: &str, notes: &mut Notes| -> Result<u32, Stop> {
        let Some(value) = geom.number(name)? else { return Ok(1) };
        if value.fract() != 0.0 || !(0.0..=f64::from(u32::MAX)).contains(&value) {
            notes.warn(element, Ignored, format!("{name} {value} is not a 32-bit mask: 1 is used"));
            return Ok(1);
        }
        Ok(value as u32)
    };
    let (contype, conaffinity) = (bits("contype", notes)?, bits("conaffinity", notes)?);
    let group = geom.number("group")?.unwrap_or(0.0);
    // Faults of the look do not refuse the robot.
    let own = geom.numbers("rgba", notes).unwrap_or_else(|stop| {
        notes.pass_over(stop);
        None
    });
    let color = own.or_else(|| context.library.color(geom.word("material")?));
    let texture = geom.word("material");
    let texture = texture.and_then(|material| context.library.picture(material, kind, [size(0), size(1)]));
    let color = color.map(|color: [f64; 4]| color.map(|part| part.clamp(0.0, 1.0)));
    let is_collision = contype != 0 || conaffinity != 0;
    // The weight of a discarded geom stays.
    let is_discarded = !is_collision && context.compiler.discard_visual;
    let weighed =
        of_water.map_or(Ok(Inertial::ZERO), |of_water| weighed(geom, of_water, &pose, kind, notes))?;
    let at: At = (element.file, element.line());
    Ok(Some(Geom {
        shape: DraftShape { at, link_from_shape: pose, geometry, color, texture },
        is_visual: !is_discarded && (!is_collision || group <= SHOWN),
        is_collision,
        contype,
        conaffinity,
        material: material(geom)?,
        group,
        inertial: weighed,
    }))
}

/// Returns the geom's mass and inertia from its mass, or from its density.
fn weighed(
    geom: &Classed,
    of_water: Inertial,
    body_from_geom: &DPose3,
    kind: &str,
    notes: &mut Notes,
) -> Result<Inertial, Stop> {
    let density = geom.number("density")?.unwrap_or(inertia::DENSITY);
    let mass = match geom.number("mass")? {
        Some(mass) => mass,
        None => of_water.mass * density / inertia::DENSITY,
    };
    if geom.word("shellinertia") == Some("true") && kind != "mesh" {
        notes.warn(geom.element, Ignored, "shellinertia is not read: the shape is filled");
    }
    if mass < 0.0 || of_water.mass <= 0.0 {
        return Ok(Inertial::ZERO);
    }
    let inertia = inertia::rotated(of_water.inertia * (mass / of_water.mass), body_from_geom.rotation);
    let center_of_mass = body_from_geom.transform_point(of_water.center_of_mass);
    Ok(Inertial { mass, center_of_mass, inertia })
}

/// Returns mass and inertia when filled with water, in its own frame.
fn inertia_of(solid: &Geometry) -> Option<Inertial> {
    inertia::of_shapes(std::iter::once((&DPose3::IDENTITY, solid)))
}

fn rotated_back(tensor: DMat3, turn: DPose3) -> DMat3 {
    inertia::rotated(tensor, turn.rotation.inverse())
}

type Placed = (DPose3, DraftGeometry, Option<Inertial>);

fn mesh_geom(
    geom: &Classed,
    pose: &DPose3,
    context: &Context,
    notes: &mut Notes,
) -> Result<Option<Placed>, Stop> {
    let element = geom.element;
    let name = geom.word("mesh").unwrap_or_default();
    let Some(asset) = context.library.meshes.get(name) else {
        notes.warn(
            element,
            Ignored,
            format!("there is no mesh {} that could be read; left out", quoted(name)),
        );
        return Ok(None);
    };
    let pose = *pose * asset.geom_from_mesh;
    let geometry = DraftGeometry::Mesh { uri: asset.uri.clone(), scale: asset.scale };
    // Only needed if its mass may count.
    let weighs = context.compiler.inertia_from_geoms != Some(false) && geom.number("mass")? != Some(0.0);
    let inertial = if weighs { weight(element, name, asset, context, notes)? } else { None };
    Ok(Some((pose, geometry, inertial)))
}

/// Returns mass and inertia of a mesh filled with water. Computed once per mesh.
fn weight(
    at: Element,
    name: &str,
    asset: &Mesh,
    context: &Context,
    notes: &mut Notes,
) -> Result<Option<Inertial>, Stop> {
    if let Some(known) = context.library.weights.borrow().get(name) {
        return Ok(*known);
    }
    let mut inertial = None;
    if let Some(read) = mesh_of(at, asset, context)? {
        context.made.spend(mesh_inertia::work(&read, asset.inertia), at)?;
        let found = mesh_inertia::of(&read, asset.scale, asset.inertia);
        if let Some((_, Some(error))) = found {
            let (count, most) = (read.vertices.len(), mesh_inertia::DIRECTIONS);
            let message = format!(
                "it has {count} corners: its convex hull has those that are farthest in {most} directions; \
                 the others lie at most {error:.6} m outside"
            );
            notes.warn(at, Repaired, message);
        }
        inertial = found.map(|(inertial, _)| inertial);
    }
    context.library.weights.borrow_mut().insert(name.to_owned(), inertial);
    Ok(inertial)
}

/// Returns the content of a mesh's file, if it exists and can be read.
pub(super) fn mesh_of(
    at: Element,
    asset: &Mesh,
    context: &Context,
) -> Result<Option<std::sync::Arc<MeshAsset>>, Stop> {
    let Some(file) = mesh_file(&asset.uri, context) else { return Ok(None) };
    context.made.spend_reading(&asset.uri, file.bytes.len(), at)?;
    Ok(read_mesh(&asset.uri, &file, context))
}

fn mesh_file(uri: &str, context: &Context) -> Option<Asset> {
    let file = match context.made.files.get(uri) {
        Some(file) => file.clone(),
        None => context.assets.find(uri).ok()?,
    };
    (file.bytes.len() <= context.limits.mesh_bytes).then_some(file)
}

/// The reader of URDF reports unreadable files.
fn read_mesh(uri: &str, file: &Asset, context: &Context) -> Option<std::sync::Arc<MeshAsset>> {
    let beside = mesh::Beside::gather(uri, &file.bytes, context.assets);
    let look = look_of(file.sha256, &beside.files);
    let mut read = || mesh::asset(uri, file.sha256, &file.bytes, &beside);
    context.assets.mesh(look, &mesh::format(uri), &mut read).ok()
}

/// Returns MuJoCo's friction: sliding, turning, rolling; `condim` says which of them apply.
fn material(geom: &Classed) -> Result<Material, Stop> {
    let friction = geom.list("friction", 3)?.unwrap_or_default();
    let of = |index: usize, default: f64| friction.get(index).copied().unwrap_or(default).max(0.0);
    let condim = geom.number("condim")?.unwrap_or(3.0);
    let mut material =
        Material { friction: Some(if condim >= 3.0 { of(0, 1.0) } else { 0.0 }), ..Material::default() };
    if condim >= 4.0 {
        material.spinning_friction = Some(of(1, 0.005));
    }
    if condim >= 6.0 {
        material.rolling_friction = Some(of(2, 0.0001));
    }
    Ok(material)
}

/// Returns mass and inertia of geoms in these groups.
pub(super) fn together(geoms: &[Geom], [first, last]: [f64; 2]) -> Inertial {
    let counted =
        || geoms.iter().filter(|geom| (first..=last).contains(&geom.group)).map(|geom| geom.inertial);
    let mass: f64 = counted().map(|part| part.mass).sum();
    if mass <= 0.0 {
        return Inertial::ZERO;
    }
    let center_of_mass =
        counted().fold(DVec3::ZERO, |sum, part| sum + part.center_of_mass * part.mass) / mass;
    let inertia = counted().fold(DMat3::ZERO, |sum, part| {
        // Steiner: m (r^2 1 - r r').
        let r = part.center_of_mass - center_of_mass;
        let outer = DMat3::from_cols(r * r.x, r * r.y, r * r.z);
        sum + part.inertia + (DMat3::from_diagonal(DVec3::splat(r.length_squared())) - outer) * part.mass
    });
    Inertial { mass, center_of_mass, inertia }
}
