//! `simctl robot shape`: single shapes, such as the ground or a box to push.

use clap::Args;
use simd_client::{
    Client,
    proto::{
        Base, BoxGeometry, CapsuleGeometry, CylinderGeometry, DescriptionSource, PlaneGeometry, Pose,
        Primitive, SpawnEntityRequest, SphereGeometry, Vector3, description_source::Source,
        primitive::Geometry,
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
    /// plane, box:X,Y,Z, sphere:RADIUS, cylinder:RADIUS,LENGTH or capsule:RADIUS,LENGTH; metres
    #[arg(value_parser = geometry)]
    shape: Geometry,
    /// Its name; that of the shape where it is left out
    #[arg(long)]
    name: Option<String>,
    /// Kilograms; that of water where it is left out
    #[arg(long, value_name = "KG", default_value_t = 0.0, hide_default_value = true)]
    mass: f64,
    /// Where it is: metres, and radians about the fixed axes
    #[arg(long, value_name = "X,Y,Z[,ROLL,PITCH,YAW]", value_parser = pose::parse, allow_hyphen_values = true)]
    pose: Option<Pose>,
    /// It does not move; a plane never does
    #[arg(long)]
    fixed: bool,
    /// Adds _1, _2, ... to a name that is taken
    #[arg(long)]
    rename: bool,
    #[command(flatten)]
    surface: Surface,
}

pub(super) async fn run(arguments: Shape, client: &Client, output: Output) -> anyhow::Result<()> {
    let Shape { shape, name, mass, pose, fixed, rename, surface } = arguments;
    let is_plane = matches!(shape, Geometry::Plane(_));
    let primitive = Primitive { geometry: Some(shape), mass, color: None };
    let request = SpawnEntityRequest {
        source: Some(DescriptionSource {
            source: Some(Source::Primitive(primitive)),
            ..DescriptionSource::default()
        }),
        name: name.unwrap_or_default(),
        allow_renaming: rename,
        pose,
        base: if fixed || is_plane { Base::Fixed } else { Base::Free }.into(),
        link_properties: surface.of(None).into_iter().collect(),
        ..SpawnEntityRequest::default()
    };
    output.one(&Loaded::from(client.spawn(request).await?))
}

/// Reads `plane` or `KIND:LENGTHS`.
fn geometry(text: &str) -> Result<Geometry, String> {
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
        ("plane" | "box" | "sphere" | "cylinder" | "capsule", _) => {
            Err(format!("a {kind} is written {}", written(kind)))
        }
        _ => Err("must be plane, box:X,Y,Z, sphere:RADIUS, cylinder:RADIUS,LENGTH or capsule:RADIUS,LENGTH"
            .to_owned()),
    }
}

fn written(kind: &str) -> &'static str {
    match kind {
        "plane" => "plane, without numbers",
        "box" => "box:X,Y,Z",
        "sphere" => "sphere:RADIUS",
        "cylinder" => "cylinder:RADIUS,LENGTH",
        _ => "capsule:RADIUS,LENGTH",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shape_is_a_word_and_its_lengths() {
        assert_eq!(geometry("plane").unwrap(), Geometry::Plane(PlaneGeometry { normal: None }));
        assert_eq!(geometry("sphere:50mm").unwrap(), Geometry::Sphere(SphereGeometry { radius: 0.05 }));
        let size = Some(Vector3 { x: 0.1, y: 0.2, z: 0.3 });
        assert_eq!(geometry("box:0.1,0.2,0.3").unwrap(), Geometry::Box(BoxGeometry { size }));
        for (text, phrase) in [
            ("box:1,2", "box:X,Y,Z"),
            ("plane:1", "without numbers"),
            ("cone:1", "must be plane"),
            ("sphere:big", "big"),
        ] {
            let refused = geometry(text).unwrap_err();
            assert!(refused.contains(phrase), "{text}: {refused}");
        }
    }
}
