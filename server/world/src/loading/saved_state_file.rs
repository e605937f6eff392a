//! The file of a saved state: a header with a hash, then the content in the format of [postcard].
//!
//! The numbers of the header are little-endian:
//!
//! ```text
//! bytes 0 to 7    simdsave
//! bytes 8 to 11   the version of this format
//! bytes 12 to 43  the SHA-256 of all that follows
//! bytes 44 to 45  the length of the next entry
//! then            the release of the daemon that wrote it, for instance 0.1.0
//! ```
//!
//! The content is a sequence of values of postcard. First come the name of the saved state, and the numbers
//! of robots and files. Then come each robot, with its source, the hash of its layout and its state, and the
//! state of the world beside its robots. The files are last, each named by its SHA-256. Equal worlds give
//! equal files.
//!
//! [postcard]: https://postcard.jamesmunns.com

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use simd_core::collision::MeshShapes;
use simd_core::simulation::world_state::{RobotState, WorldState};
use simd_core::simulation::{RobotParts, Saved};
use simd_model::RobotModel;
use simd_model::robot::Sha256;

use crate::call_error::CallError;

/// First bytes of a file.
const MAGIC: &[u8; 8] = b"simdsave";

/// The format that is read and written. It grows with every change of what a state is.
pub const FORMAT: u32 = 14;

/// Maximum number of list entries that take more memory than bytes of the file, of all robots together. Such
/// an entry has some fifty bytes in memory, and three in a file. The limit is far above a thousand robots
/// with a hundred meshes each.
const MAX_ENTRIES: usize = 1_000_000;

/// Maximum length of a refusal, characters: it may contain a name from the file.
const MAX_MESSAGE: usize = 2_000;

/// An opened file.
#[derive(Debug)]
pub struct Opened {
    /// Release of the daemon that wrote it.
    pub written_by: String,
    /// Content.
    pub content: Content,
}

/// Content of a file.
#[derive(Clone, Debug)]
pub struct Content {
    /// Name of the saved state.
    pub name: String,
    /// Robots in spawn order.
    pub robots: Vec<SavedRobot>,
    /// State of the world, beside its robots.
    pub world: WorldState,
    /// Each description and each mesh file, once.
    pub files: Vec<Arc<[u8]>>,
}

/// A robot in a file.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SavedRobot {
    /// Source.
    pub source: RobotSource,
    /// Hash by [`layout`]: it shows whether another release reads a description differently.
    pub layout: Sha256,
    /// State.
    pub state: RobotState,
}

/// Source of a robot.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct RobotSource {
    /// Hash of the URDF.
    pub description: Sha256,
    /// Hashes of the mesh files, by URI.
    pub assets: BTreeMap<String, Sha256>,
    /// Bits of the factor of all lengths.
    pub scale: u64,
    /// Conversion of the collision meshes.
    pub mesh_shapes: MeshShapes,
    /// Whether the root link cannot move.
    pub fixed_base: bool,
}

/// First value of a content: the name, and the numbers of robots and files.
type Head = (String, usize, usize);

impl Content {
    /// Makes the content of a saved state; `sources` are in the order of the robots, and `files` are for all
    /// of them.
    pub fn new(name: &str, saved: &Saved, sources: Vec<RobotSource>, files: Vec<Arc<[u8]>>) -> Self {
        let world = saved.world_state();
        let robots = sources.into_iter().zip(saved.models()).zip(&world.robots);
        let robot = |((source, model), state): ((RobotSource, &Arc<RobotModel>), &RobotState)| SavedRobot {
            source,
            layout: layout(model),
            state: state.clone(),
        };
        Self {
            name: name.to_owned(),
            robots: robots.map(robot).collect(),
            world: WorldState {
                robots: Vec::new(),
                contacts: world.contacts.clone(),
                ignored_overlaps: world.ignored_overlaps.clone(),
                collision_pairs: Arc::clone(&world.collision_pairs),
                constraints: world.constraints.clone(),
                ..*world
            },
            files,
        }
    }

    /// Returns the state with newly made robots, in their order.
    ///
    /// # Errors
    /// Returns an error if a robot is made differently than before, or no world can be in such a state.
    pub fn into_saved(self, made: Vec<RobotParts>) -> Result<Saved, CallError> {
        let Self { name: _, robots, mut world, files: _ } = self;
        for (robot, (model, _shapes)) in robots.iter().zip(&made) {
            if layout(model) != robot.layout {
                return Err(invalid(format!(
                    "the saved state's robot {:?} has another layout: its description must give the links and joints \
                     that it gave where the saved state was exported, and this daemon reads it otherwise",
                    robot.state.entity.name
                )));
            }
        }
        world.robots = robots.into_iter().map(|robot| robot.state).collect();
        Saved::new(world, made).map_err(|why| invalid(format!("the saved state is not valid: {why}")))
    }

    /// Encodes the content, without a header.
    pub fn encode(&self) -> Vec<u8> {
        let Self { name, robots, world, files } = self;
        let mut out = encoded(&(name, robots.len(), files.len()));
        robots.iter().for_each(|robot| out.extend(encoded(robot)));
        out.extend(encoded(world));
        for file in files {
            // Same bytes as postcard writes, but not one by one.
            out.extend(encoded(&file.len()));
            out.extend_from_slice(file);
        }
        out
    }

    /// Decodes bytes without a header, for a daemon with at most `most_robots` robots. Allocations are
    /// bounded by the available bytes, and not by lengths in the file.
    fn decode(bytes: &[u8], most_robots: usize) -> Result<Self, CallError> {
        let rest = &mut &*bytes;
        let (name, robot_count, file_count): Head = take(rest)?;
        at_most("the number of robots in the saved state", robot_count, most_robots)?;
        let check_entries =
            |count| at_most("the number of entries in the saved state's file", count, MAX_ENTRIES);
        let mut entries = file_count;
        check_entries(entries)?;
        let mut robots = Vec::new();
        for _ in 0..robot_count {
            let robot: SavedRobot = take(rest)?;
            entries += robot.source.assets.len() + robot.state.entity.contact_settings.links.len();
            check_entries(entries)?;
            robots.push(robot);
        }
        let world = take(rest)?;
        let mut files = Vec::new();
        for _ in 0..file_count {
            let (file, after) =
                postcard::take_from_bytes::<&[u8]>(rest).map_err(|why| damaged(&why.to_string()))?;
            *rest = after;
            files.push(Arc::from(file));
        }
        if !rest.is_empty() {
            return Err(damaged("there are bytes after its end"));
        }
        Ok(Self { name, robots, world, files })
    }
}

/// Encodes a value. It fails only for lists of unknown length, and there are none.
fn encoded(value: &impl Serialize) -> Vec<u8> {
    postcard::to_allocvec(value).unwrap_or_default()
}

/// Takes a value from the start of some bytes.
fn take<T: DeserializeOwned>(bytes: &mut &[u8]) -> Result<T, CallError> {
    let (value, rest) = postcard::take_from_bytes(bytes).map_err(|why| damaged(&why.to_string()))?;
    *bytes = rest;
    Ok(value)
}

fn at_most(what: &str, value: usize, limit: usize) -> Result<(), CallError> {
    if value <= limit {
        return Ok(());
    }
    Err(CallError::LimitExceeded { what: what.into(), value: value as u64, limit: limit as u64 })
}

/// Returns the hash of the names and kinds of a robot's links and joints.
pub fn layout(model: &RobotModel) -> Sha256 {
    let links = model.links.iter().map(|link| format!("link {:?}\n", link.name));
    let joints = model.joints.iter().map(|joint| {
        let follows = joint.mimic.map(|mimic| mimic.joint);
        format!("joint {:?} {:?} {} {} {follows:?}\n", joint.name, joint.kind, joint.parent, joint.child)
    });
    Sha256::of(links.chain(joints).collect::<String>().as_bytes())
}

/// Returns a file with this content.
pub fn seal(content: &Content) -> Vec<u8> {
    seal_encoded(&content.encode())
}

/// Returns a file with this encoded content.
pub fn seal_encoded(content: &[u8]) -> Vec<u8> {
    let release = env!("CARGO_PKG_VERSION").as_bytes();
    // No release has more than 65,535 letters.
    let length = u16::try_from(release.len()).unwrap_or(0).to_le_bytes();
    let rest = [&length, release, content].concat();
    let Sha256(hash) = Sha256::of(&rest);
    [&MAGIC[..], &FORMAT.to_le_bytes(), &hash, &rest].concat()
}

/// Opens a file for a daemon with at most `robots` robots.
///
/// # Errors
/// Returns an error if it is not a saved state, has another format, is damaged, or has too many entries.
pub fn open(file: &[u8], robots: usize) -> Result<Opened, CallError> {
    let Some((magic, rest)) = file.split_first_chunk::<8>() else { return Err(no_saved_state()) };
    let (Some((format, rest)), true) = (rest.split_first_chunk::<4>(), magic == MAGIC) else {
        return Err(no_saved_state());
    };
    match u32::from_le_bytes(*format) {
        FORMAT => {}
        older @ 0..FORMAT => {
            return Err(invalid(format!(
                "the saved state's file is of format {older}, and this daemon reads only {FORMAT}: make it again with this \
                 release"
            )));
        }
        newer => {
            return Err(invalid(format!(
                "the saved state's file is of format {newer}, and this daemon reads only {FORMAT}; the daemon is \
                 older: update the daemon, or export the state with this one"
            )));
        }
    }
    let Some((hash, rest)) = rest.split_first_chunk::<32>() else { return Err(damaged("it ends early")) };
    if Sha256::of(rest) != Sha256(*hash) {
        return Err(damaged("its content does not match the hash in its header"));
    }
    let split = rest.split_first_chunk::<2>();
    let release = split.and_then(|(len, rest)| rest.split_at_checked(u16::from_le_bytes(*len).into()));
    let Some((release, content)) = release else { return Err(damaged("it ends early")) };
    let written_by = String::from_utf8_lossy(release).into_owned();
    Ok(Opened { written_by, content: Content::decode(content, robots)? })
}

/// Makes a refusal of a file.
pub fn invalid(message: impl Into<String>) -> CallError {
    CallError::InvalidSavedState { message: message.into().chars().take(MAX_MESSAGE).collect() }
}

fn no_saved_state() -> CallError {
    invalid("the file is not a saved state of simd: it does not begin as one")
}

fn damaged(why: &str) -> CallError {
    invalid(format!("the saved state's file is damaged: {why}"))
}

#[cfg(test)]
mod tests {
    use simd_core::PhysicsSettings;

    use super::*;

    fn content() -> Content {
        let settings = PhysicsSettings::default();
        let world = WorldState {
            step: 3,
            sim_time: 0.003,
            time_base: (0, -0.0),
            settings,
            robots: Vec::new(),
            contacts: Vec::new(),
            ignored_overlaps: vec![([0, 1], [2, 3])],
            collision_pairs: Arc::default(),
            constraints: Vec::new(),
        };
        Content { name: "a".into(), robots: Vec::new(), world, files: vec![vec![7; 100].into()] }
    }

    fn refusal(file: &[u8]) -> String {
        open(file, 10).unwrap_err().to_string()
    }

    #[test]
    fn a_file_that_was_sealed_is_opened() {
        let opened = open(&seal(&content()), 10).unwrap();
        assert_eq!(opened.written_by, env!("CARGO_PKG_VERSION"));
        let Content { name, robots, world, files } = opened.content;
        assert_eq!((&*name, robots.len(), files), ("a", 0, content().files));
        assert_eq!(world.time_base.1.to_bits(), (-0.0f64).to_bits(), "each number to the bit");
        assert_eq!((world.step, world.ignored_overlaps), (3, content().world.ignored_overlaps));
    }

    #[test]
    fn another_format_is_refused_and_says_who_is_older() {
        let mut file = seal(&content());
        file[8..12].copy_from_slice(&(FORMAT + 1).to_le_bytes());
        let newer = refusal(&file);
        assert!(
            newer.contains(&format!("format {}", FORMAT + 1)) && newer.contains("the daemon is older"),
            "{newer}"
        );
        file[8..12].copy_from_slice(&1u32.to_le_bytes());
        let older = refusal(&file);
        assert!(older.contains(&format!("format 1, and this daemon reads only {FORMAT}")), "{older}");
    }

    #[test]
    fn every_flipped_bit_and_every_cut_is_noticed() {
        let file = seal(&content());
        for bit in 0..8 * file.len() {
            let mut file = file.clone();
            file[bit / 8] ^= 1 << (bit % 8);
            assert!(matches!(open(&file, 10), Err(CallError::InvalidSavedState { .. })), "bit {bit}");
        }
        for end in 0..file.len() {
            assert!(
                matches!(open(&file[..end], 10), Err(CallError::InvalidSavedState { .. })),
                "cut at {end}"
            );
        }
        assert!(refusal(&[&file[..], b"x"].concat()).contains("damaged"));
        assert!(refusal(&seal_encoded(&[&content().encode()[..], b"x"].concat())).contains("after its end"));
        assert!(refusal(b"solid ascii\n").contains("not a saved state of simd"));
    }

    #[test]
    fn counts_are_checked_before_they_take_memory() {
        let robots = refusal(&seal_encoded(&encoded(&("it", 11_usize, 0_usize))));
        assert_eq!(robots, "the number of robots in the saved state would be 11, and the limit is 10");
        let files = refusal(&seal_encoded(&encoded(&("it", 0_usize, MAX_ENTRIES + 1))));
        assert!(files.contains("entries"), "{files}");
        // Lengths above 10^18, of a text and of a list.
        let start = (3_u64, 0.0, (0_u64, 0.0), PhysicsSettings::default());
        let contacts = encoded(&(("it", 0_usize, 0_usize), start, u64::MAX));
        for claim in [encoded(&u64::MAX), encoded(&("it", 10_usize, 10_usize)), contacts] {
            let claim = refusal(&seal_encoded(&claim));
            assert!(claim.contains("damaged"), "{claim}");
        }
    }
}
