//! The worker of `peers.py`: steps robots in simd and in rapier. It steps a batch at a time, so that the
//! driver can let the simulators take turns.
//!
//! The argument is a file with a list of [`Scene`]s. Each line of the input is answered with a line of JSON:
//! * `simd 3 2000`: the time of 2000 steps of scene 3
//! * `joints 3`: the positions that its joints hold, and their gains
//! * `rays 3 20 0 0 2 100 10000`: the time of 20 calls that cast 10000 rays of 100 m from a point, and the
//!   distance of each
//! * `room FOLDER 20 0 0 1.5`: the time of 20 scans of a lidar there in a room of 100,000 triangles, which is
//!   written into the folder

mod contacts_simd;
mod in_rapier;
mod in_simd;
mod rays;
mod room;
mod scene;

use std::collections::BTreeMap;
use std::collections::btree_map::Entry;
use std::error::Error;
use std::io::{BufRead as _, Write as _};
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use scene::Scene;
use simd_core::Integrator;
use simd_core::pool::Pool;
use simd_world::driver::{RealTime, StepThreads};

/// A world that can be stepped.
trait World {
    /// Puts it back to the start: still, in the pose that its actuators hold.
    fn put_back(&mut self);
    fn step(&mut self);
    /// Lends it threads.
    fn lend(&mut self, _threads: Arc<dyn Pool>) {}
    /// Returns the largest distance of a joint from the position that it should hold, rad or m.
    fn error(&self) -> f64;
}

/// Threads of the engine `threads`.
const THREADS: usize = 2;

/// Steps before the measurement, as a part of the measured ones.
const WARM_UP: usize = 10;

fn main() -> Result<(), Box<dyn Error>> {
    let Some(path) = std::env::args().nth(1).filter(|argument| argument != "--bench") else {
        return Ok(());
    };
    let scenes: Vec<Scene> = serde_json::from_slice(&std::fs::read(path)?)?;
    let (mut worlds, mut rooms) = (BTreeMap::new(), BTreeMap::new());
    let threads = StepThreads::start(THREADS, RealTime::default())?;
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        let words: Vec<&str> = line.split_whitespace().collect();
        let answer = match words[..] {
            ["joints", scene] => serde_json::to_value(scenes[scene.parse::<usize>()?].joints())?,
            ["rays", scene, calls, x, y, z, reach, count] => {
                let scene = &scenes[scene.parse::<usize>()?];
                let contact = scene.contact.as_ref().ok_or("rays need a scene with contact")?;
                let world = contacts_simd::InContact::new(scene, contact, false);
                let start = [x.parse()?, y.parse()?, z.parse()?].into();
                rays::timed(world.world(), calls.parse()?, start, reach.parse()?, count.parse()?)?
            }
            ["room", folder, calls, x, y, z] => {
                let start = [x.parse()?, y.parse()?, z.parse()?].into();
                let key = folder.to_owned();
                let world = match rooms.entry(key) {
                    Entry::Occupied(known) => known.into_mut(),
                    Entry::Vacant(new) => new.insert(room::world(Path::new(folder), start)?),
                };
                room::timed(world, calls.parse()?)?
            }
            [engine, scene, steps] => {
                let key = (engine.to_owned(), scene.parse::<usize>()?);
                let scene = &scenes[key.1];
                let world = worlds.entry(key).or_insert_with(|| build(engine, scene));
                if let ("threads", Some(threads)) = (engine, &threads) {
                    world.lend(Arc::clone(threads) as Arc<dyn Pool>);
                }
                batch(world.as_mut(), steps.parse()?)
            }
            _ => return Err(format!("{line:?} is not a request").into()),
        };
        let mut out = std::io::stdout().lock();
        writeln!(out, "{answer}")?;
        out.flush()?;
    }
    Ok(())
}

fn build(engine: &str, scene: &Scene) -> Box<dyn World> {
    match (engine, &scene.contact) {
        ("simd" | "threads", Some(contact)) => Box::new(contacts_simd::InContact::new(scene, contact, false)),
        ("asleep", Some(contact)) => Box::new(contacts_simd::InContact::new(scene, contact, true)),
        ("simd" | "threads", None) => Box::new(in_simd::Simd::new(scene, Integrator::default())),
        ("euler", None) => Box::new(in_simd::Simd::new(scene, Integrator::Euler)),
        _ => Box::new(in_rapier::Rapier::new(scene)),
    }
}

fn batch(world: &mut dyn World, steps: usize) -> serde_json::Value {
    world.put_back();
    (0..steps / WARM_UP).for_each(|_| world.step());
    let start = Instant::now();
    (0..steps).for_each(|_| world.step());
    let seconds = start.elapsed().as_secs_f64();
    serde_json::json!({ "seconds": seconds, "error": world.error() })
}
