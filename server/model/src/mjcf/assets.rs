//! `<asset>`: meshes, height fields, textures and materials, by name.

use std::cell::RefCell;
use std::collections::BTreeMap;

use glamx::{DPose3, DQuat, DVec3};

use super::builtin_texture;
use super::compiler::Compiler;
use super::defaults::Classes;
use super::files::beside;
use super::inline_mesh::{self, Made};
use super::value;
use crate::assets::Assets;
use crate::report::Disposition::{Ignored, Repaired};
use crate::robot::{Inertial, TextureRepeat};
use crate::translation::element::Element;
use crate::translation::notes::{Notes, Stop};

/// Assets that geoms name.
#[derive(Default)]
pub(super) struct Library {
    pub(super) meshes: BTreeMap<String, Mesh>,
    /// URI, and size along x, y and upwards.
    pub(super) heights: BTreeMap<String, (String, DVec3)>,
    materials: BTreeMap<String, Material>,
    textures: BTreeMap<String, Texture>,
    /// Meshes filled with water, as far as they were requested.
    pub(super) weights: RefCell<BTreeMap<String, Option<Inertial>>>,
}

/// Look of a geom.
struct Material {
    color: Option<[f64; 4]>,
    /// Name of its texture.
    texture: Option<String>,
    /// Repetitions of the texture, across and up.
    repeat: [f64; 2],
    /// Whether repetitions are per two metres; otherwise per geom.
    uniform: bool,
}

/// A picture from a file or made by MuJoCo.
struct Texture {
    uri: String,
    /// Whether it has the type `2d`: it lies at a mesh's texture coordinates. Other types are wrapped around.
    is_flat: bool,
}

/// A mesh file, or a replacement of one, and its placement in a geom.
#[derive(Clone, Debug)]
pub(super) struct Mesh {
    pub(super) uri: String,
    pub(super) scale: DVec3,
    /// `geom_from_mesh`, for the scaled mesh.
    pub(super) geom_from_mesh: DPose3,
    pub(super) inertia: MeshInertia,
}

/// Computation of a mesh's inertia from its triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum MeshInertia {
    /// From the volume, which counts as positive, or with its sign.
    Volume { signed: bool },
    /// From the volume of the convex hull.
    Hull,
    /// From the surface, with a density in kg/m^2.
    Shell,
}

impl Library {
    pub(super) fn read<'a>(
        &mut self,
        elements: &[Element<'a>],
        files: &dyn Assets,
        compiler: &Compiler,
        classes: &Classes<'a>,
        made: &mut Made,
        notes: &mut Notes,
    ) -> Result<(), Stop> {
        for element in elements.iter().copied() {
            match element.tag() {
                "mesh" => self.mesh(element, files, compiler, classes, made, notes)?,
                "hfield" => self.height_field(element, files, compiler, notes)?,
                "material" => {
                    let material = classes.of(element, None, ["material", "material"]);
                    let color = material.numbers("rgba", notes).unwrap_or_else(|stop| {
                        notes.pass_over(stop);
                        None
                    });
                    // Layers exist since MuJoCo 3.2: one for each part of the look.
                    let of_color = |layer: &Element| matches!(layer.word("role"), Some("rgb" | "rgba"));
                    for layer in element.children("layer").filter(|layer| !of_color(layer)) {
                        notes.info(layer, Ignored, "its role is not drawn; only rgb and rgba are");
                    }
                    let layer = element.children("layer").find(of_color);
                    let layer = layer.and_then(|layer| layer.word("texture"));
                    let texture = material.word("texture").or(layer).map(str::to_owned);
                    let repeat = material.numbers("texrepeat", notes).unwrap_or_else(|stop| {
                        notes.pass_over(stop);
                        None
                    });
                    let repeat = repeat.unwrap_or([1.0, 1.0]);
                    let uniform = material.word("texuniform") == Some("true");
                    if let Some(name) = element.word("name") {
                        let material = Material { color, texture, repeat, uniform };
                        self.materials.insert(name.to_owned(), material);
                    }
                }
                "texture" => self.texture(element, files, compiler, classes, made, notes)?,
                // Belongs to `attach`.
                "model" => {}
                "skin" => notes.warn(element, Ignored, "not read by simd: it is not drawn"),
                _ => notes.info(element, Ignored, "not read by simd"),
            }
        }
        Ok(())
    }

    /// Returns the colour of a material.
    pub(super) fn color(&self, material: &str) -> Option<[f64; 4]> {
        self.materials.get(material)?.color
    }

    /// Returns the URI and the repetitions of a material's picture, if a geom of this type is drawn with it.
    /// `half` are the half sizes of a plane, 0 if it has none.
    pub(super) fn picture(
        &self,
        material: &str,
        geom: &str,
        half: [f64; 2],
    ) -> Option<(String, TextureRepeat)> {
        let material = self.materials.get(material)?;
        let texture = self.textures.get(material.texture.as_ref()?)?;
        // A picture for all six sides of a cube appears on each side of a box.
        if !texture.is_flat && geom != "box" {
            return None;
        }
        let uri = texture.uri.clone();
        // As MuJoCo draws it: a picture is as wide as the geom, or two metres, divided by the number. Meshes
        // have their own coordinates, and so do pictures that are wrapped around.
        let repeat = match geom {
            "mesh" | "sdf" => TextureRepeat::default(),
            _ if !texture.is_flat => TextureRepeat::default(),
            "plane" => {
                let wide = half.map(|half| if material.uniform || half <= 0.0 { 1.0 } else { half });
                let often = [material.repeat[0] / wide[0], material.repeat[1] / wide[1]];
                TextureRepeat::PerMetre(often.map(|often| 0.5 * often))
            }
            "box" if material.uniform => TextureRepeat::PerMetre(material.repeat.map(|often| 0.5 * often)),
            _ => TextureRepeat::Times(material.repeat),
        };
        Some((uri, repeat))
    }

    fn texture<'a>(
        &mut self,
        element: Element<'a>,
        files: &dyn Assets,
        compiler: &Compiler,
        classes: &Classes<'a>,
        made: &mut Made,
        notes: &mut Notes,
    ) -> Result<(), Stop> {
        let texture = classes.of(element, None, ["texture", "texture"]);
        let kind = texture.word("type").unwrap_or("cube");
        if kind == "skybox" {
            return Ok(());
        }
        let file = texture.word("file").filter(|_| texture.word("gridsize").is_none());
        let uri = match file {
            Some(file) => found(element, file, compiler.texture_uri(file), files),
            None => match builtin_texture::png(&texture, kind == "2d", made, notes)? {
                Some(png) => made.add_picture(element, element.word("name").unwrap_or("texture"), png)?,
                None => {
                    let message = "simd reads textures only from whole pictures: its material has its colour";
                    notes.info(element, Ignored, message);
                    return Ok(());
                }
            },
        };
        let name = element.word("name").or_else(|| file.map(stem)).unwrap_or_default().to_owned();
        self.textures.insert(name, Texture { uri, is_flat: kind == "2d" });
        Ok(())
    }

    fn mesh<'a>(
        &mut self,
        element: Element<'a>,
        files: &dyn Assets,
        compiler: &Compiler,
        classes: &Classes<'a>,
        made: &mut Made,
        notes: &mut Notes,
    ) -> Result<(), Stop> {
        let mesh = classes.of(element, None, ["mesh", "mesh"]);
        let Some(name) = element.word("name").or_else(|| Some(stem(mesh.word("file")?))) else {
            notes.warn(element, Ignored, "it has no name that a geom could use; left out");
            return Ok(());
        };
        let scale = mesh.numbers("scale", notes)?.map_or(DVec3::ONE, DVec3::from_array);
        let at = mesh.numbers("refpos", notes)?.map_or(DVec3::ZERO, DVec3::from_array);
        let [w, x, y, z] = mesh.numbers("refquat", notes)?.unwrap_or([1.0, 0.0, 0.0, 0.0]);
        let turn = DQuat::from_xyzw(x, y, z, w);
        if turn.length() < 1e-9 {
            return Err(Stop::at(element, "its refquat is 0"));
        }
        let reference = DPose3::from_parts(at * scale, turn.normalize());
        let uneven = scale.max_element() != scale.min_element();
        if uneven && reference.rotation.to_scaled_axis().length() > 1e-9 {
            notes.warn(element, Repaired, "it is scaled before it is turned by its refquat");
        }
        let inertia = match mesh.word("inertia").unwrap_or("legacy") {
            "legacy" => MeshInertia::Volume { signed: false },
            "exact" => MeshInertia::Volume { signed: true },
            "convex" => MeshInertia::Hull,
            "shell" => MeshInertia::Shell,
            other => {
                let message = format!("simd has no inertia {other:.20}: the inertia of its volume is used");
                notes.warn(element, Repaired, message);
                MeshInertia::Volume { signed: false }
            }
        };
        let uri = match mesh.word("file") {
            Some(file) => found(element, file, compiler.mesh_uri(file), files),
            None if element.word("vertex").is_some() => match inline_mesh::obj(element, made, notes)? {
                Some(text) => made.add(element, name, text)?,
                None => return Ok(()),
            },
            None => {
                let message = "simd reads meshes from files and from corners that stand here: geoms of this one are left out";
                notes.warn(element, Ignored, message);
                return Ok(());
            }
        };
        self.meshes
            .insert(name.to_owned(), Mesh { uri, scale, geom_from_mesh: reference.inverse(), inertia });
        Ok(())
    }

    fn height_field(
        &mut self,
        element: Element,
        files: &dyn Assets,
        compiler: &Compiler,
        notes: &mut Notes,
    ) -> Result<(), Stop> {
        let name = element.word("name").or_else(|| element.word("file").map(stem));
        let (Some(name), Some(file)) = (name, element.word("file")) else {
            let message = "simd reads height fields only from pictures: geoms of this one are left out";
            notes.warn(element, Ignored, message);
            return Ok(());
        };
        let [x, y, up, _below] = value::numbers::<4>(element, "size", notes)?
            .ok_or_else(|| Stop::at(element, "it has no size"))?;
        let uri = found(element, file, compiler.mesh_uri(file), files);
        self.heights.insert(name.to_owned(), (uri, DVec3::new(2.0 * x, 2.0 * y, up)));
        Ok(())
    }
}

/// Returns the URI of a file: from the compiler's folder, or beside the included file that names it, as in
/// MuJoCo.
fn found(element: Element, file: &str, uri: String, files: &dyn Assets) -> String {
    let beside = beside(element.folder(), file).filter(|beside| *beside != uri);
    match beside {
        Some(beside) if files.find(&uri).is_err() && files.find(&beside).is_ok() => beside,
        _ => uri,
    }
}

/// Returns the default name: the name of the file.
fn stem(file: &str) -> &str {
    let name = file.rsplit(['/', '\\']).next().unwrap_or(file);
    name.rsplit_once('.').map_or(name, |(stem, _)| stem)
}
