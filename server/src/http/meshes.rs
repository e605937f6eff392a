//! Meshes that were written as glTF: each once, off the physics thread, and kept while there is room.

use std::collections::{HashMap, VecDeque};
use std::io::Write as _;
use std::sync::{Mutex, PoisonError};

use bytes::Bytes;
use flate2::Compression;
use flate2::write::GzEncoder;
use simd_model::robot::Sha256;

use super::glb;
use crate::SimHandle;
use crate::handle::CallError;

/// Bytes of glTF that are kept.
const KEPT: usize = 256 << 20;
/// Smaller files are not worth compressing.
const WORTH_IT: usize = 4 << 10;

/// A mesh as a browser gets it.
#[derive(Clone, Debug)]
pub(super) struct Glb {
    pub(super) bytes: Bytes,
    /// Where that is smaller.
    pub(super) gzip: Option<Bytes>,
}

/// Those that were written.
#[derive(Debug, Default)]
pub(super) struct Meshes {
    /// Held for a look or a change.
    kept: Mutex<Kept>,
    /// One is written at a time: each takes a processor and, while it is written, a few times its memory.
    turn: tokio::sync::Mutex<()>,
}

#[derive(Debug, Default)]
struct Kept {
    by_hash: HashMap<Sha256, Glb>,
    /// Longest unused first.
    order: VecDeque<Sha256>,
    bytes: usize,
}

impl Meshes {
    /// A mesh that a robot uses, or that was written before; `None` where there is neither.
    ///
    /// # Errors
    /// Where too many descriptions and files wait to be read.
    pub(super) async fn get(&self, handle: &SimHandle, sha256: Sha256) -> Result<Option<Glb>, CallError> {
        if let Some(known) = self.known(&sha256) {
            return Ok(Some(known));
        }
        let _turn = self.turn.lock().await;
        if let Some(known) = self.known(&sha256) {
            return Ok(Some(known));
        }
        let written = handle.with_mesh(&sha256, |mesh| Glb::of(glb::write(mesh))).await?;
        if let Some(written) = &written {
            self.lock().insert(sha256, written.clone());
        }
        Ok(written)
    }

    fn known(&self, sha256: &Sha256) -> Option<Glb> {
        let mut kept = self.lock();
        let known = kept.by_hash.get(sha256).cloned()?;
        kept.order.retain(|other| other != sha256);
        kept.order.push_back(*sha256);
        Some(known)
    }

    fn lock(&self) -> std::sync::MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Kept {
    /// What is too large to be kept is written anew each time.
    fn insert(&mut self, sha256: Sha256, glb: Glb) {
        let size = glb.size();
        if size > KEPT {
            return;
        }
        while self.bytes + size > KEPT
            && let Some(oldest) = self.order.pop_front()
        {
            self.bytes -= self.by_hash.remove(&oldest).map_or(0, |glb| glb.size());
        }
        self.bytes += size;
        self.order.push_back(sha256);
        self.by_hash.insert(sha256, glb);
    }
}

impl Glb {
    fn of(bytes: Vec<u8>) -> Self {
        let gzip = compressed(&bytes).filter(|gzip| gzip.len() < bytes.len() / 10 * 9);
        Self { bytes: bytes.into(), gzip: gzip.map(Bytes::from) }
    }

    fn size(&self) -> usize {
        self.bytes.len() + self.gzip.as_ref().map_or(0, Bytes::len)
    }
}

/// Fast rather than small: somebody waits for it.
fn compressed(bytes: &[u8]) -> Option<Vec<u8>> {
    if bytes.len() < WORTH_IT {
        return None;
    }
    let mut encoder = GzEncoder::new(Vec::new(), Compression::fast());
    encoder.write_all(bytes).ok()?;
    encoder.finish().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn glb(bytes: usize) -> Glb {
        Glb { bytes: vec![0; bytes].into(), gzip: None }
    }

    #[test]
    fn the_longest_unused_makes_room() {
        let meshes = Meshes::default();
        let hashes = [0_u8, 1, 2].map(|n| Sha256::of(&[n]));
        meshes.lock().insert(hashes[0], glb(KEPT / 2));
        meshes.lock().insert(hashes[1], glb(KEPT / 2));
        meshes.known(&hashes[0]).unwrap();
        meshes.lock().insert(hashes[2], glb(KEPT / 4));
        assert_eq!(hashes.map(|hash| meshes.known(&hash).is_some()), [true, false, true]);
        assert_eq!(meshes.lock().bytes, KEPT / 2 + KEPT / 4);
        meshes.lock().insert(hashes[1], glb(KEPT + 1));
        assert!(meshes.known(&hashes[1]).is_none());
    }

    #[test]
    fn what_is_compressed_is_the_same() {
        let bytes: Vec<u8> = (0..100_000_u32).flat_map(|n| (n / 7).to_le_bytes()).collect();
        let glb = Glb::of(bytes.clone());
        let mut decoder = flate2::write::GzDecoder::new(Vec::new());
        decoder.write_all(glb.gzip.as_ref().unwrap()).unwrap();
        assert_eq!(decoder.finish().unwrap(), bytes);
        assert!(Glb::of(vec![0; 100]).gzip.is_none());
    }
}
