//! `simctl robot shape`: single shapes, such as the ground or a box to push, and bodies of several shapes.

use std::path::{Path, PathBuf};

use anyhow::Context as _;
use clap::Args;
use simd_client::{
    Client,
    proto::{
        Base, BoxGeometry, CapsuleGeometry, CompoundGeometry, CompoundPart, ConeGeometry, CylinderGeometry,
        DescriptionSource, MeshGeometry, PlaneGeometry, Pose, Primitive, SpawnEntityRequest, SphereGeometry,
        Vector3, compound_part, description_source::Source, primitive::Geometry,
    },
};

use super::view::Loaded;
use crate::{
    commands::contact::Surface,
    output::Output,
    pose,
    quantity::{Kind, parse},
};

#[derive(Args, Debug)]
pub(crate) struct Shape {
    /// plane, box:X,Y,Z, sphere:RADIUS, cylinder:RADIUS,LENGTH, capsule:RADIUS,LENGTH or cone:RADIUS,LENGTH; metres. mesh:FILE,FACTOR is an STL, OBJ or COLLADA file. heightfield:FILE,X,Y,HEIGHT is ground of this size: a grey PNG, white being HEIGHT above black, or a CSV file of heights, which HEIGHT multiplies. Several are one body, each at @X,Y,Z[,ROLL,PITCH,YAW] after it
    #[arg(value_name = "SHAPE", value_parser = part, required = true)]
    shapes: Vec<Part>,
    /// Name of the robot; the shape's kind if left out
    #[arg(long)]
    name: Option<String>,
    /// Mass, kilograms; the mass of water if left out
    #[arg(long, value_name = "KG", default_value_t = 0.0, hide_default_value = true)]
    mass: f64,
    /// Pose: metres, and radians about the fixed axes
    #[arg(long, value_name = "X,Y,Z[,ROLL,PITCH,YAW]", value_parser = pose::parse, allow_hyphen_values = true)]
    pose: Option<Pose>,
    /// Stand beside all other robots, and on the ground
    #[arg(long)]
    beside: bool,
    /// Fix it to the world, as planes and height fields always are
    #[arg(long)]
    fixed: bool,
    /// Add _1, _2, ... to a name that is taken
    #[arg(long)]
    rename: bool,
    #[command(flatten)]
    surface: Surface,
}

pub(super) async fn run(arguments: Shape, client: &Client, output: Output) -> anyhow::Result<()> {
    let Shape { shapes, name, mass, pose, beside, fixed, rename, surface } = arguments;
    let (is_ground, source) = match whole(shapes)? {
        Wanted::Shape(geometry) => {
            let is_plane = matches!(geometry, Geometry::Plane(_));
            let primitive = Primitive { geometry: Some(geometry), mass, color: None };
            let source = Source::Primitive(primitive);
            (is_plane, DescriptionSource { source: Some(source), ..DescriptionSource::default() })
        }
        Wanted::File { path, scale, is_ground } => {
            let uri = path.file_name().context("the file of a shape has a name")?;
            let uri = uri.to_string_lossy().into_owned();
            let mesh = MeshGeometry { uri: uri.clone(), scale: Some(scale), ..MeshGeometry::default() };
            let primitive = Primitive { geometry: Some(Geometry::Mesh(mesh)), mass, color: None };
            (is_ground, client.upload_primitive(&path, &uri, primitive).await?)
        }
    };
    let request = SpawnEntityRequest {
        source: Some(source),
        name: name.unwrap_or_default(),
        allow_renaming: rename,
        pose,
        beside_others: beside,
        on_ground: beside,
        base: if fixed || is_ground { Base::Fixed } else { Base::Free }.into(),
        link_properties: surface.of(None).into_iter().collect(),
        ..SpawnEntityRequest::default()
    };
    let spawned = client.spawn(request).await?;
    super::warn_of(&spawned.report, None);
    output.one(&Loaded::from(spawned))
}

/// Shape to spawn.
#[derive(Clone, Debug, PartialEq)]
enum Wanted {
    Shape(Geometry),
    /// A mesh, or ground.
    File {
        path: PathBuf,
        scale: Vector3,
        is_ground: bool,
    },
}

/// A shape with its pose in the body.
#[derive(Clone, Debug, PartialEq)]
struct Part {
    shape: Wanted,
    pose: Option<Pose>,
}

/// Parses a shape, optionally with `@` and a pose.
fn part(text: &str) -> Result<Part, String> {
    // A file may have an @ in its name, and has no pose.
    let is_file = text.starts_with("mesh:") || text.starts_with("heightfield:");
    let (shape, pose) = if is_file { (text, None) } else { pose::split(text)? };
    Ok(Part { shape: wanted(shape)?, pose })
}

/// Returns a single shape, or a body of several.
fn whole(mut parts: Vec<Part>) -> anyhow::Result<Wanted> {
    if let [Part { pose: None, .. }] = parts[..] {
        // The pattern guarantees one.
        return parts.pop().map(|part| part.shape).context("a body has a shape");
    }
    let parts = parts.into_iter().map(|Part { shape, pose }| {
        let geometry = match shape {
            Wanted::Shape(Geometry::Box(shape)) => compound_part::Geometry::Box(shape),
            Wanted::Shape(Geometry::Sphere(shape)) => compound_part::Geometry::Sphere(shape),
            Wanted::Shape(Geometry::Cylinder(shape)) => compound_part::Geometry::Cylinder(shape),
            Wanted::Shape(Geometry::Capsule(shape)) => compound_part::Geometry::Capsule(shape),
            Wanted::Shape(Geometry::Cone(shape)) => compound_part::Geometry::Cone(shape),
            Wanted::Shape(_) | Wanted::File { .. } => {
                anyhow::bail!(
                    "a plane, a mesh or a height field cannot be combined with other shapes: give it alone, \
                     without @"
                )
            }
        };
        Ok(CompoundPart { pose, geometry: Some(geometry) })
    });
    Ok(Wanted::Shape(Geometry::Compound(CompoundGeometry { parts: parts.collect::<anyhow::Result<_>>()? })))
}

/// Reads `plane`, `KIND:LENGTHS`, `mesh:FILE,FACTOR` or `heightfield:FILE,X,Y,HEIGHT`.
fn wanted(text: &str) -> Result<Wanted, String> {
    let numbers = |text: &str, kind| -> Result<Vec<f64>, String> {
        text.split(',').map(|number| parse(number, kind).map(|quantity| quantity.value)).collect()
    };
    let extension = |path: &str| Path::new(path).extension().map(|it| it.to_ascii_lowercase());
    if let Some(rest) = text.strip_prefix("heightfield:") {
        let mut parts = rest.rsplitn(4, ',').collect::<Vec<_>>();
        parts.reverse();
        let [path, x, y, height] = parts[..] else {
            return Err("a height field is written heightfield:FILE,X,Y,HEIGHT".to_owned());
        };
        let is_known = extension(path).is_some_and(|it| it == "png" || it == "csv");
        let size = numbers(&format!("{x},{y},{height}"), Kind::Position)?;
        return match size[..] {
            _ if !is_known => Err(format!("{path} is neither a .png nor a .csv file")),
            [x, y, z] if x > 0.0 && y > 0.0 && z > 0.0 => {
                Ok(Wanted::File { path: path.into(), scale: Vector3 { x, y, z }, is_ground: true })
            }
            _ => Err("the size of a height field must be above 0".to_owned()),
        };
    }
    if let Some(rest) = text.strip_prefix("mesh:") {
        let factor = rest.rsplit_once(',').and_then(|(path, factor)| Some((path, factor.parse().ok()?)));
        let (path, factor): (&str, f64) = factor.unwrap_or((rest, 1.0));
        if !(factor > 0.0 && factor.is_finite()) {
            return Err("the factor of a mesh must be above 0".to_owned());
        }
        let scale = Vector3 { x: factor, y: factor, z: factor };
        return Ok(Wanted::File { path: path.into(), scale, is_ground: false });
    }
    geometry(text).map(Wanted::Shape)
}

/// Reads `plane` or `KIND:LENGTHS`.
pub(crate) fn geometry(text: &str) -> Result<Geometry, String> {
    let (kind, lengths) = text.split_once(':').unwrap_or((text, ""));
    let lengths = lengths.split(',').filter(|length| !length.is_empty());
    let lengths: Vec<f64> = lengths
        .map(|length| parse(length, Kind::Position).map(|quantity| quantity.value))
        .collect::<Result<_, _>>()?;
    match (kind, lengths.as_slice()) {
        ("plane", []) => Ok(Geometry::Plane(PlaneGeometry { normal: None })),
        ("box", &[x, y, z]) => Ok(Geometry::Box(BoxGeometry { size: Some(Vector3 { x, y, z }) })),
        ("sphere", &[radius]) => Ok(Geometry::Sphere(SphereGeometry { radius })),
        ("cylinder", &[radius, length]) => Ok(Geometry::Cylinder(CylinderGeometry { radius, length })),
        ("capsule", &[radius, length]) => Ok(Geometry::Capsule(CapsuleGeometry { radius, length })),
        ("cone", &[radius, length]) => Ok(Geometry::Cone(ConeGeometry { radius, length })),
        ("plane" | "box" | "sphere" | "cylinder" | "capsule" | "cone", _) => {
            Err(format!("a {kind} is written {}", written(kind)))
        }
        _ => Err("must be plane, box:X,Y,Z, sphere:RADIUS, cylinder:RADIUS,LENGTH, capsule:RADIUS,LENGTH, \
                  cone:RADIUS,LENGTH, mesh:FILE,FACTOR or heightfield:FILE,X,Y,HEIGHT"
            .to_owned()),
    }
}

fn written(kind: &str) -> &'static str {
    match kind {
        "plane" => "plane, without numbers",
        "box" => "box:X,Y,Z",
        "sphere" => "sphere:RADIUS",
        "cylinder" => "cylinder:RADIUS,LENGTH",
        "cone" => "cone:RADIUS,LENGTH",
        _ => "capsule:RADIUS,LENGTH",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_named_with_its_size() {
        let scale = Vector3 { x: 4.0, y: 3.0, z: 0.5 };
        let hills = Wanted::File { path: "a,b/hills.png".into(), scale, is_ground: true };
        assert_eq!(wanted("heightfield:a,b/hills.png,4,3,50cm").unwrap(), hills);
        let scale = Vector3 { x: 2.0, y: 2.0, z: 2.0 };
        assert_eq!(
            wanted("mesh:room.stl,2").unwrap(),
            Wanted::File { path: "room.stl".into(), scale, is_ground: false }
        );
        assert!(matches!(wanted("mesh:room.stl").unwrap(), Wanted::File { .. }));
        for (text, phrase) in [
            ("heightfield:hills.png", "heightfield:FILE,X,Y,HEIGHT"),
            ("heightfield:hills.stl,1,1,1", "neither"),
            ("heightfield:hills.png,1,0,1", "above 0"),
            ("heightfield:hills.png,1,nan,1", "above 0"),
            ("heightfield:hills.png,1,big,1", "big"),
            ("mesh:room.stl,-1", "above 0"),
        ] {
            let refused = wanted(text).unwrap_err();
            assert!(refused.contains(phrase), "{text}: {refused}");
        }
    }

    #[test]
    fn a_shape_is_a_word_and_its_lengths() {
        assert_eq!(geometry("plane").unwrap(), Geometry::Plane(PlaneGeometry { normal: None }));
        assert_eq!(geometry("sphere:50mm").unwrap(), Geometry::Sphere(SphereGeometry { radius: 0.05 }));
        let size = Some(Vector3 { x: 0.1, y: 0.2, z: 0.3 });
        assert_eq!(geometry("box:0.1,0.2,0.3").unwrap(), Geometry::Box(BoxGeometry { size }));
        for (text, phrase) in [
            ("box:1,2", "box:X,Y,Z"),
            ("plane:1", "without numbers"),
            ("cone:1", "cone:RADIUS,LENGTH"),
            ("prism:1", "must be plane"),
            ("sphere:big", "big"),
        ] {
            let refused = geometry(text).unwrap_err();
            assert!(refused.contains(phrase), "{text}: {refused}");
        }
    }

    #[test]
    fn several_shapes_are_one_body() {
        let all = |texts: &[&str]| whole(texts.iter().map(|text| part(text).unwrap()).collect());
        let Wanted::Shape(Geometry::Compound(table)) =
            all(&["box:1,1,0.1@0,0,0.5", "cylinder:0.05,0.5@0,0,0.25,90deg,0,0", "cone:0.1,0.2"]).unwrap()
        else {
            unreachable!()
        };
        assert_eq!(table.parts.len(), 3);
        assert!(table.parts[1].pose.as_ref().unwrap().orientation.is_some() && table.parts[2].pose.is_none());
        // A single shape is itself; with a pose it is a body of one part.
        assert!(matches!(all(&["sphere:1"]).unwrap(), Wanted::Shape(Geometry::Sphere(_))));
        assert!(matches!(all(&["sphere:1@1,0,0"]).unwrap(), Wanted::Shape(Geometry::Compound(_))));
        assert!(matches!(all(&["mesh:a@b.stl"]).unwrap(), Wanted::File { .. }));
        for wrong in [["plane", "sphere:1"], ["sphere:1", "mesh:a.stl"]] {
            assert!(all(&wrong).unwrap_err().to_string().contains("alone"));
        }
        assert!(part("sphere:1@1,0").unwrap_err().contains("x,y,z"));
    }
}
