//! Files that a description names.

use std::sync::Arc;

use crate::report::cut;
use crate::robot::{MeshAsset, Sha256};

/// A file that a description names.
#[derive(Clone, Debug, PartialEq)]
pub struct Asset {
    /// SHA-256 of `bytes`.
    pub sha256: Sha256,
    /// The whole file.
    pub bytes: Arc<[u8]>,
}

/// Source of the files that a description names.
pub trait Assets {
    /// Returns the file for a URI as the description writes it, or the places where it was looked for.
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>>;

    /// Returns, as a fragment of a sentence, a deviation that was accepted to find it, such as letter case.
    fn note(&self, uri: &str) -> Option<String> {
        let _ = uri;
        None
    }

    /// Returns the mesh with this look, which is its file's hash if it names no other files. It is read in
    /// this format by `read`, whose error is a fragment of a sentence, or comes from a cache. By default
    /// nothing is cached.
    fn mesh(
        &self,
        look: Sha256,
        format: &str,
        read: &mut dyn FnMut() -> Result<MeshAsset, String>,
    ) -> Result<Arc<MeshAsset>, String> {
        let _ = (look, format);
        read().map(Arc::new)
    }
}

/// Maximum number of places in a report.
const PLACES: usize = 8;
/// Maximum bytes of a place; a longer one is cut.
const PLACE_BYTES: usize = 500;

/// Returns the first of the places where a file was looked for, and the number of further ones.
pub fn first_places(mut places: Vec<String>) -> Vec<String> {
    if places.len() > PLACES {
        let more = places.len() + 1 - PLACES;
        places.truncate(PLACES - 1);
        places.push(format!("{more} more places"));
    }
    places.shrink_to_fit();
    places.into_iter().map(|place| cut(place, PLACE_BYTES)).collect()
}
