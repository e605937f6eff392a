//! Scans in simd: a lidar's reading of a room of 100,000 triangles, with the tree of shapes that each makes.

use std::error::Error;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use glamx::{DPose3, DVec3};
use simd_assets::Locator;
use simd_core::simulation::command::CreateSensor;
use simd_core::simulation::measure::Measurement;
use simd_core::{Command, PublishedState, Simulation};
use simd_model::robot::Sha256;
use simd_model::sensor::{RangeLimits, Scan, SensorKind, Sweep};
use simd_model::{Asset, Assets, ReadOptions};
use simd_tests::{room, scenes};

/// Rays of a scan: rows and columns.
const RAYS: [u32; 2] = [16, 1_024];
/// Metres.
const REACH: f64 = 100.0;

struct OnDisk(Locator);

impl Assets for OnDisk {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        let path = self.0.find(uri).map_err(|_missing| Vec::new())?;
        let bytes: Arc<[u8]> = std::fs::read(&path).map_err(|error| vec![error.to_string()])?.into();
        Ok(Asset { sha256: Sha256::of(&bytes), bytes })
    }
}

/// Returns a world of the room, which is written into this folder, and a lidar at a point that takes a sample
/// each step.
pub(crate) fn world(folder: &Path, start: DVec3) -> Result<Simulation, Box<dyn Error>> {
    let urdf = room::write(folder)?;
    let files = OnDisk(Locator::new(&urdf));
    let (model, _) = simd_model::read(&std::fs::read(&urdf)?, &files, &ReadOptions::default())?;
    let mut world = scenes::world(1e-3);
    scenes::spawn(&mut world, scenes::robot("room", &Arc::new(model), DPose3::IDENTITY, true));
    let bearer = scenes::cuboid(DVec3::splat(0.01), 1.0);
    scenes::spawn(&mut world, scenes::robot("bearer", &bearer, DPose3::from_translation(start), true));
    let [rows, columns] = RAYS;
    let sweep = |samples, most: f64| Sweep { samples, least: -most, most };
    let scan = Scan {
        horizontal: sweep(columns, std::f64::consts::PI),
        vertical: sweep(rows, 0.26),
        range: RangeLimits { least: 0.0, most: REACH },
        rolling: false,
    };
    let create = CreateSensor {
        robot: "bearer".into(),
        name: String::new(),
        link: "body".into(),
        joint: String::new(),
        pose: DPose3::IDENTITY,
        rate: None,
        kind: SensorKind::Lidar(scan),
        noise: Vec::new(),
        seed: None,
    };
    scenes::apply(&mut world, Command::CreateSensor(Box::new(create)));
    Ok(world)
}

/// Returns the time of this many scans, and the ranges of the last, row by row.
pub(crate) fn timed(world: &mut Simulation, calls: usize) -> Result<serde_json::Value, Box<dyn Error>> {
    let (mut due, mut state) = (Vec::new(), PublishedState::default());
    world.step();
    world.observe(&mut state);
    world.take_due_samples(&mut due);
    let due = due.first().ok_or("no scan is due")?;
    let mut ranges = Vec::new();
    let begin = Instant::now();
    for _ in 0..calls {
        let reading = state.reading(due, &|| false).ok_or("a scan is not measured")?;
        if let Measurement::Lidar(of) = reading.measurement {
            ranges = of;
        }
    }
    let seconds = begin.elapsed().as_secs_f64();
    // JSON has no infinity.
    let ranges = ranges.iter().map(|range| if range.is_finite() { f64::from(*range) } else { REACH });
    Ok(serde_json::json!({ "seconds": seconds, "distances": ranges.collect::<Vec<_>>() }))
}
