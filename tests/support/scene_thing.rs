//! Things of a scene with contact: primitives, meshes and heights, one or a grid of them.

use std::sync::Arc;

use glamx::{DMat3, DPose3, DQuat, DVec3};
use serde::Deserialize;
use simd_core::collision::{MeshShapes, Shapes};
use simd_core::simulation::command::{LinkWrench, Spawn, WrenchDuration};
use simd_core::{Command, Simulation};
use simd_model::RobotModel;
use simd_model::robot::{Geometry, Grid, MeshAsset, Sha256};

use crate::scenes;

/// A body of one shape, or a grid of them; fixed without a mass.
#[derive(Clone, Debug, Deserialize)]
pub(crate) struct Thing {
    name: String,
    /// `box`, `sphere`, `cylinder`, `plane`, `mesh` or `heights`.
    shape: String,
    size: Vec<f64>,
    at: [f64; 3],
    pub(crate) mass: f64,
    pub(crate) friction: f64,
    pub(crate) restitution: f64,
    pub(crate) linear: [f64; 3],
    grid: [u32; 3],
    pitch: f64,
    /// Layer k is moved along x and y by k modulo 3 of these.
    shift: [f64; 2],
    #[serde(default = "upright")]
    turn: [f64; 4],
    #[serde(default)]
    pub(crate) angular: [f64; 3],
    /// Principal moments of a mesh that moves.
    #[serde(default)]
    moment: Vec<f64>,
    #[serde(default)]
    vertices: Vec<[f64; 3]>,
    #[serde(default)]
    triangles: Vec<[u32; 3]>,
    /// Heights, from the largest y to the smallest.
    #[serde(default)]
    rows: Vec<Vec<f64>>,
}

fn upright() -> [f64; 4] {
    DQuat::IDENTITY.to_array()
}

impl Thing {
    /// Puts it into a world. Nothing of it ever sleeps.
    ///
    /// # Panics
    /// Panics if the world refuses it: then the test has failed.
    pub(crate) fn put_into(&self, world: &mut Simulation) {
        let model = self.model();
        let fixed = self.mass == 0.0;
        let shapes = Arc::new(Shapes::reusing(&model, fixed, MeshShapes::Mesh, &[]));
        for (name, at) in self.places() {
            let contact_settings = scenes::surface(self.friction, self.restitution);
            let shapes = Arc::clone(&shapes);
            scenes::spawn(
                world,
                Spawn { shapes, contact_settings, ..scenes::robot(&name, &model, at, fixed) },
            );
            if !fixed {
                scenes::throw(world, &name, self.linear.into(), self.angular.into());
                keep_awake(world, &name);
            }
        }
    }

    /// Returns the name and the place of each, x first.
    pub(crate) fn places(&self) -> impl Iterator<Item = (String, DPose3)> {
        let [nx, ny, nz] = self.grid;
        let places = (0..nz).flat_map(move |z| (0..ny).flat_map(move |y| (0..nx).map(move |x| [x, y, z])));
        places.enumerate().map(move |(i, place)| {
            let [x, y, z] = place.map(f64::from);
            let layer = f64::from(place[2] % 3);
            let shift = DVec3::new(self.shift[0] * layer, self.shift[1] * layer, 0.0);
            let at = DVec3::from(self.at) + DVec3::new(x, y, z) * self.pitch + shift;
            let name = if nx * ny * nz == 1 { self.name.clone() } else { format!("{}-{i}", self.name) };
            (name, DPose3::from_parts(at, DQuat::from_array(self.turn)))
        })
    }

    pub(crate) fn model(&self) -> Arc<RobotModel> {
        let geometry = match (&self.shape[..], &self.size[..]) {
            ("sphere", &[radius]) => Geometry::Sphere { radius },
            ("box", &[x, y, z]) => Geometry::Box { size: DVec3::new(x, y, z) },
            ("cylinder", &[radius, length]) => Geometry::Cylinder { radius, length },
            ("cone", &[radius, length]) => Geometry::Cone { radius, length },
            ("mesh", _) => self.mesh(),
            ("heights", &[long, wide]) => self.field(long, wide),
            _ => Geometry::Plane { normal: DVec3::Z },
        };
        let mass = if self.mass == 0.0 { 1.0 } else { self.mass };
        let mut model = scenes::solid(&[(DPose3::IDENTITY, geometry)], mass);
        if let &[x, y, z] = &self.moment[..] {
            for link in &mut Arc::make_mut(&mut model).links {
                link.inertial.inertia = DMat3::from_diagonal(DVec3::new(x, y, z));
            }
        }
        model
    }

    fn mesh(&self) -> Geometry {
        // A hull needs only vertices; without triangles in the file, any triangles of all of them will do.
        let all = [[0, 1, 2], [1, 2, 3]];
        let triangles = if self.triangles.is_empty() { all.to_vec() } else { self.triangles.clone() };
        let vertices = self.vertices.iter().copied().map(DVec3::from).collect();
        geometry(vertices, triangles, None, DVec3::ONE)
    }

    fn field(&self, long: f64, wide: f64) -> Geometry {
        let (rows, columns) = (self.rows.len(), self.rows.first().map_or(0, Vec::len));
        let part = |i: usize, of: usize| i as f64 / (of - 1) as f64 - 0.5;
        let corner = |(j, row): (usize, &Vec<f64>)| -> Vec<DVec3> {
            let height = |(i, height): (usize, &f64)| DVec3::new(part(i, columns), -part(j, rows), *height);
            row.iter().enumerate().map(height).collect()
        };
        let vertices = self.rows.iter().enumerate().flat_map(corner).collect();
        geometry(vertices, vec![[0, 1, 2]], Some(Grid { rows, columns }), DVec3::new(long, wide, 1.0))
    }
}

fn geometry(vertices: Vec<DVec3>, triangles: Vec<[u32; 3]>, grid: Option<Grid>, scale: DVec3) -> Geometry {
    let numbers = vertices.iter().flat_map(|vertex| vertex.to_array()).flat_map(f64::to_le_bytes);
    let sha256 = Sha256::of(&numbers.collect::<Vec<u8>>());
    let asset = MeshAsset { sha256, vertices, triangles, paints: Vec::new(), files: Vec::new(), grid };
    Geometry::Mesh { uri: "thing".into(), scale, asset: Some(Arc::new(asset)) }
}

/// Keeps a body from falling asleep, by a push that moves nothing.
pub fn keep_awake(world: &mut Simulation, robot: &str) {
    let push = LinkWrench {
        robot: robot.into(),
        link: "body".into(),
        force: DVec3::Z * 1e-12,
        torque: DVec3::ZERO,
        in_link_axes: false,
        point: DVec3::ZERO,
        duration: WrenchDuration::UntilCleared,
    };
    scenes::apply(world, Command::ApplyWrench(push));
}
