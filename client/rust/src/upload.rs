//! Sends a robot's URDF and the files that the daemon lacks, then spawns it.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs::File,
    io::{self, Read, Seek as _, SeekFrom},
    path::{Path, PathBuf},
};

use sha2::{Digest as _, Sha256};
use simd_proto::v1::{
    AssetSearch, AssetState, DescriptionSource, PrepareDescriptionRequest, PrepareDescriptionResponse,
    Primitive, ReloadEntityRequest, SpawnEntityRequest, UploadAssetRequest, description_source::Source,
};

use crate::{Client, Error, NotFound, Package, Reloaded, Spawned};

/// Size of one message: far below the daemon's limit, and large enough that the number of round trips does
/// not matter.
const PART_BYTES: usize = 1024 * 1024;

/// Spawning of robots from this disk.
impl Client {
    /// Uploads a robot and spawns it: a URDF file, or a package folder that holds one. The request has all
    /// but the source. Missing files are warnings in the report.
    ///
    /// # Errors
    /// As [`Package::open`], [`upload`](Self::upload) and [`spawn`](Self::spawn).
    pub async fn load(&self, path: impl AsRef<Path>, request: SpawnEntityRequest) -> Result<Spawned, Error> {
        let source = self.upload(&Package::open(path)?).await?;
        self.spawn(SpawnEntityRequest { source: Some(source), ..request }).await
    }

    /// Sends a robot's new export, and reloads the robot of that name from it.
    ///
    /// # Errors
    /// As [`Package::open`], [`upload`](Self::upload) and [`reload`](Self::reload).
    pub async fn reload_from(
        &self,
        path: impl AsRef<Path>,
        request: ReloadEntityRequest,
    ) -> Result<Reloaded, Error> {
        let source = self.upload(&Package::open(path)?).await?;
        self.reload(ReloadEntityRequest { source: Some(source), ..request }).await
    }

    /// Sends a URDF and those of its files that the daemon lacks. Returns a source to spawn, validate or
    /// reload.
    ///
    /// # Errors
    /// `INVALID_DESCRIPTION` if the URDF cannot be read at all, `LIMIT_EXCEEDED`, [`Error::File`] if a file
    /// of the robot cannot be read.
    pub async fn upload(&self, package: &Package) -> Result<DescriptionSource, Error> {
        let mut files = Files::default();
        let mut sent = BTreeSet::new();
        let mut prepared = self.prepare(package, BTreeMap::new()).await?;
        // Included files of an SDF or MJCF name more files, and so do meshes: pictures, and materials. Each
        // file is looked for once, so that this loop ends.
        loop {
            let named: Vec<String> = prepared.assets.iter().map(|asset| asset.uri.clone()).collect();
            let new: Vec<String> = named.into_iter().filter(|uri| !files.knows(uri)).collect();
            for uri in &new {
                files.find(package, uri).await?;
            }
            let is_done = new.is_empty() || files.hashes.is_empty();
            if is_done || new.iter().all(|uri| !files.hashes.contains_key(uri)) {
                break;
            }
            prepared = self.prepare(package, files.hashes.clone()).await?;
            let mut names_more = false;
            for requirement in prepared.assets.iter().filter(|asset| asset.state() == AssetState::Lacking) {
                let Some(hash) = files.hashes.get(&requirement.uri) else { continue };
                let Some(path) = files.paths.get(hash) else { continue };
                if sent.insert(hash.clone()) {
                    self.send(path, hash).await?;
                    names_more |= package.includes() || may_name_more(&requirement.uri);
                }
            }
            if names_more {
                prepared = self.prepare(package, files.hashes.clone()).await?;
            }
        }
        Ok(DescriptionSource {
            source: Some(Source::Description(prepared.description)),
            assets: files.hashes,
            missing: files.missing,
        })
    }

    /// Sends a mesh or a height field for a primitive, which names it by `uri`. Returns the source of the
    /// primitive.
    ///
    /// # Errors
    /// `LIMIT_EXCEEDED`, [`Error::File`] if the file cannot be read.
    pub async fn upload_primitive(
        &self,
        path: &Path,
        uri: &str,
        primitive: Primitive,
    ) -> Result<DescriptionSource, Error> {
        let hash = hash_of(path).await;
        let hash = hash.map_err(|reason| Error::File { path: path.to_path_buf(), reason })?;
        self.send(path, &hash).await?;
        Ok(DescriptionSource {
            source: Some(Source::Primitive(primitive)),
            assets: BTreeMap::from([(uri.to_owned(), hash)]),
            missing: BTreeMap::new(),
        })
    }

    async fn prepare(
        &self,
        package: &Package,
        assets: BTreeMap<String, String>,
    ) -> Result<PrepareDescriptionResponse, Error> {
        let request = PrepareDescriptionRequest { urdf: package.urdf.clone(), assets };
        self.unary_while_alive(self.entity().prepare_description(request)).await
    }

    /// Sends one file in parts.
    pub(crate) async fn send(&self, path: &Path, sha256: &str) -> Result<(), Error> {
        let unreadable = |reason| Error::File { path: path.to_path_buf(), reason };
        let total_bytes = std::fs::metadata(path).map_err(unreadable)?.len();
        let mut offset = 0;
        loop {
            let data = read_part(path, offset).await.map_err(unreadable)?;
            let length = data.len() as u64;
            let request = UploadAssetRequest { sha256: sha256.to_owned(), total_bytes, offset, data };
            self.unary(self.entity().upload_asset(request)).await?;
            offset += length;
            // A file that shrank in the meantime ends early; the daemon notices it by the hash.
            if length == 0 || offset >= total_bytes {
                return Ok(());
            }
        }
    }
}

/// Returns whether a file of this name may name others that it is drawn with.
fn may_name_more(uri: &str) -> bool {
    let extension = uri.trim_end().rsplit_once('.').map(|(_, extension)| extension.to_ascii_lowercase());
    extension.is_some_and(|extension| ["obj", "mtl", "dae", "gltf", "glb"].contains(&extension.as_str()))
}

/// Files that were found for a robot's URIs.
#[derive(Default)]
struct Files {
    /// By URI.
    hashes: BTreeMap<String, String>,
    /// By hash.
    paths: BTreeMap<String, PathBuf>,
    /// By URI.
    missing: BTreeMap<String, AssetSearch>,
    /// Hashes by path: a visual and its collision shape often share a file.
    known: BTreeMap<PathBuf, String>,
}

impl Files {
    /// Returns whether a URI was looked for.
    fn knows(&self, uri: &str) -> bool {
        self.hashes.contains_key(uri) || self.missing.contains_key(uri)
    }

    async fn find(&mut self, package: &Package, uri: &str) -> Result<(), Error> {
        let path = match package.locator.find(uri) {
            Ok(path) => path,
            Err(not_found) => {
                self.missing.insert(uri.to_owned(), AssetSearch { places: places(not_found) });
                return Ok(());
            }
        };
        let hash = match self.known.get(&path) {
            Some(hash) => hash.clone(),
            None => hash_of(&path).await.map_err(|reason| Error::File { path: path.clone(), reason })?,
        };
        self.known.insert(path.clone(), hash.clone());
        self.paths.insert(hash.clone(), path);
        self.hashes.insert(uri.to_owned(), hash);
        Ok(())
    }
}

/// Lists the places for the report, after "looked in". A file that may not be sent says so: otherwise its
/// owner would keep searching for it.
fn places(not_found: NotFound) -> Vec<String> {
    let mut places: Vec<String> = not_found.places.iter().map(|place| place.display().to_string()).collect();
    match places.last_mut() {
        Some(last) if not_found.is_refused() => last.push_str(&format!(" (refused: {})", not_found.reason())),
        Some(_) => {}
        None => places.push(format!("no place, because {}", not_found.reason())),
    }
    places
}

/// Returns the SHA-256 of a file, in lower-case hexadecimal.
pub(crate) async fn hash_of(path: &Path) -> io::Result<String> {
    let path = path.to_path_buf();
    off_the_runtime(move || {
        let mut hasher = Sha256::new();
        io::copy(&mut File::open(path)?, &mut hasher)?;
        Ok(hexadecimal(&hasher.finalize()))
    })
    .await
}

/// Returns lower-case hexadecimal.
pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

async fn read_part(path: &Path, offset: u64) -> io::Result<Vec<u8>> {
    let path = path.to_path_buf();
    off_the_runtime(move || {
        let mut file = File::open(path)?;
        file.seek(SeekFrom::Start(offset))?;
        let mut data = Vec::new();
        file.take(PART_BYTES as u64).read_to_end(&mut data)?;
        Ok(data)
    })
    .await
}

/// Runs file operations outside of the runtime's threads, which must not wait for slow files.
pub(crate) async fn off_the_runtime<T: Send + 'static>(
    work: impl FnOnce() -> io::Result<T> + Send + 'static,
) -> io::Result<T> {
    tokio::task::spawn_blocking(work).await.map_err(io::Error::other)?
}

#[cfg(test)]
mod tests {
    use simd_assets::Why;

    use super::*;

    fn not_found(places: &[&str], why: Why) -> NotFound {
        NotFound { uri: "x".into(), why, places: places.iter().map(PathBuf::from).collect() }
    }

    #[test]
    fn the_places_of_a_refused_file_say_why() {
        let phrase = "`x` climbs out of the robot's package with `..`";
        assert_eq!(places(not_found(&["/a", "/b"], Why::Missing)), ["/a", "/b"]);
        assert_eq!(
            places(not_found(&["/a", "/b"], Why::ClimbsOut)),
            ["/a", &format!("/b (refused: {phrase})")]
        );
        assert_eq!(places(not_found(&[], Why::ClimbsOut)), [format!("no place, because {phrase}")]);
    }

    #[tokio::test]
    async fn a_hash_is_lower_case_hexadecimal_and_a_part_begins_at_its_offset() {
        let dir = tempfile::TempDir::new().unwrap();
        let path = dir.path().join("a.stl");
        std::fs::write(&path, "abc").unwrap();
        // From FIPS 180-2, appendix B.1.
        let expected = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(hash_of(&path).await.unwrap(), expected);
        assert_eq!(read_part(&path, 1).await.unwrap(), b"bc");
        assert_eq!(read_part(&path, 3).await.unwrap(), b"");
        assert!(hash_of(&dir.path().join("none")).await.is_err());
    }
}
