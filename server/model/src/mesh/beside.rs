//! The files that a mesh's file names: materials of an OBJ, textures, buffers of a glTF.
//!
//! They are found from the folder of the mesh, as the description's own files are. A client that uploads a robot finds
//! their names in the mesh, without reading all of it.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

use super::{gltf, image, mtl};
use crate::limits;
use crate::robot::{FileBeside, Image, Sha256};
use crate::urdf::{Asset, Assets};

/// What a file is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Role {
    /// Materials of an OBJ.
    Materials,
    /// Numbers of a glTF.
    Buffer,
    /// A picture.
    Image,
}

/// A file as a mesh names it.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Named {
    /// Its path from the folder of the mesh.
    pub(super) name: String,
    pub(super) role: Role,
}

/// What was found beside a mesh.
#[derive(Default)]
pub(crate) struct Beside {
    images: BTreeMap<String, Arc<Image>>,
    bytes: BTreeMap<String, Arc<[u8]>>,
    /// The picture that the description puts on the mesh.
    cover: Option<Arc<Image>>,
    /// All that was found.
    pub(crate) files: Vec<FileBeside>,
    /// What was not, or cannot be used: sentences.
    pub(crate) notes: Vec<String>,
}

impl Beside {
    /// Looks for all that a mesh names, and what that names.
    pub(crate) fn gather(uri: &str, bytes: &[u8], assets: &dyn Assets) -> Self {
        let mut beside = Self::default();
        let mut size = 0;
        walk(uri, bytes, &mut |named| {
            let Named { name, role } = named;
            let (what, lost) = match role {
                Role::Materials => ("the materials", "without them it has no colours"),
                Role::Buffer => ("the buffer", "without it there is no mesh"),
                Role::Image => ("the texture", "the colour of its material is shown"),
            };
            let asset = match assets.find(&address(uri, name)) {
                Ok(asset) => asset,
                Err(places) => {
                    let places = crate::first_places(places);
                    let looked = if places.is_empty() { String::new() } else { "; looked in: ".to_owned() };
                    let places = places.join(", ");
                    beside.note(format!("{what} {name:?} is not found{looked}{places}; {lost}"));
                    return None;
                }
            };
            size += asset.bytes.len();
            if size > limits::BESIDE_BYTES {
                let most = limits::BESIDE_BYTES;
                beside.note(format!(
                    "{what} {name:?} is not read: all files beside the mesh have more than {most} bytes; {lost}"
                ));
                return None;
            }
            let Asset { sha256, bytes } = asset;
            match beside.keep(named, sha256, &bytes) {
                Ok(()) => {
                    beside.files.push(FileBeside { name: name.clone(), sha256 });
                    (role == &Role::Materials).then_some(bytes)
                }
                Err(why) => {
                    beside.note(format!("{what} {name:?} is not read: {why}; {lost}"));
                    None
                }
            }
        });
        beside
    }

    /// With the picture of the description's material, for the triangles that have none of their own.
    pub(crate) fn covered_by(mut self, cover: Option<&Arc<Image>>) -> Self {
        if let Some(cover) = cover {
            self.cover = Some(Arc::clone(cover));
            self.files.push(FileBeside { name: String::new(), sha256: cover.sha256 });
        }
        self
    }

    fn keep(
        &mut self,
        Named { name, role }: &Named,
        sha256: Sha256,
        bytes: &Arc<[u8]>,
    ) -> Result<(), String> {
        match role {
            Role::Image => {
                self.images.insert(name.clone(), Arc::new(image::check(sha256, Arc::clone(bytes))?));
            }
            Role::Materials if bytes.len() > limits::MATERIAL_BYTES => {
                let (size, most) = (bytes.len(), limits::MATERIAL_BYTES);
                return Err(format!("it has {size} bytes; the most is {most}"));
            }
            Role::Materials | Role::Buffer => {
                self.bytes.insert(name.clone(), Arc::clone(bytes));
            }
        }
        Ok(())
    }

    fn note(&mut self, note: String) {
        const MOST: usize = 16;
        if self.notes.len() < MOST {
            self.notes.push(note);
        }
    }

    /// Whether there is a picture, without which texture coordinates are of no use.
    pub(super) fn has_images(&self) -> bool {
        !self.images.is_empty() || self.cover.is_some()
    }

    /// The picture that the description puts on the mesh.
    pub(super) fn cover(&self) -> Option<&Arc<Image>> {
        self.cover.as_ref()
    }

    /// A picture, as a mesh names it from its folder.
    pub(super) fn image(&self, name: &str) -> Option<Arc<Image>> {
        self.images.get(&relative(name)?).cloned()
    }

    /// Another file.
    pub(super) fn bytes(&self, name: &str) -> Option<&Arc<[u8]>> {
        self.bytes.get(&relative(name)?)
    }
}

/// The URIs of what a mesh names, of those files that are known. Known ones that name more are looked into.
pub(crate) fn uris(uri: &str, assets: &dyn Assets) -> Vec<String> {
    let mut found = Vec::new();
    if !matches!(super::format(uri).as_str(), "obj" | "dae" | "gltf" | "glb") {
        return found;
    }
    let Ok(mesh) = assets.find(uri) else { return found };
    if mesh.bytes.len() > limits::MESH_BYTES {
        return found;
    }
    walk(uri, &mesh.bytes, &mut |named| {
        let address = address(uri, &named.name);
        let bytes = match named.role {
            Role::Materials => assets.find(&address).ok().map(|asset| asset.bytes),
            Role::Buffer | Role::Image => None,
        };
        found.push(address);
        bytes.filter(|bytes| bytes.len() <= limits::MATERIAL_BYTES)
    });
    found
}

/// Calls `each` with what a mesh names, once each, and with what the bytes name that it gives.
fn walk(uri: &str, bytes: &[u8], each: &mut dyn FnMut(&Named) -> Option<Arc<[u8]>>) {
    let mut ahead = VecDeque::from(named(&super::format(uri), bytes));
    let mut seen = BTreeSet::new();
    while let Some(next) = ahead.pop_front() {
        if seen.len() >= limits::FILES_BESIDE {
            return;
        }
        if !seen.insert(next.clone()) {
            continue;
        }
        if let Some(materials) = each(&next) {
            let images = mtl::images(&materials).filter_map(|image| joined(&next.name, &image));
            ahead.extend(images.map(|name| Named { name, role: Role::Image }).take(limits::FILES_BESIDE));
        }
    }
}

/// What the file itself names.
fn named(format: &str, bytes: &[u8]) -> Vec<Named> {
    match format {
        "obj" => mtl::libraries(bytes)
            .filter_map(|name| Some(Named { name: relative(&name)?, role: Role::Materials }))
            .take(limits::FILES_BESIDE)
            .collect(),
        "dae" => collada(bytes),
        "gltf" | "glb" => gltf::named(bytes),
        _ => Vec::new(),
    }
}

/// The files of `<image>`: found as text, since the whole document would take long to read. What was looked at is not looked
/// at again: a short file of nothing but beginnings would take hours.
fn collada(bytes: &[u8]) -> Vec<Named> {
    let mut found = Vec::new();
    let mut rest = bytes;
    while let Some(image) = after(rest, b"<image") {
        rest = image;
        if !image.first().is_some_and(|next| next.is_ascii_whitespace() || *next == b'>') {
            continue;
        }
        let end = find(image, b"</image").unwrap_or(image.len());
        rest = image.get(end..).unwrap_or_default();
        let Some(file) = image.get(..end).and_then(|image| after(image, b"<init_from")) else { continue };
        // COLLADA 1.5 has the name in a <ref>.
        let file = after(file, b"<ref").unwrap_or(file);
        let text = after(file, b">").and_then(|text| text.get(..find(text, b"<")?));
        let text = text.map(|text| unescaped(&String::from_utf8_lossy(text)));
        if let Some(name) = text.as_deref().and_then(relative) {
            found.push(Named { name, role: Role::Image });
            if found.len() >= limits::FILES_BESIDE {
                break;
            }
        }
    }
    found
}

/// The five entities that XML has of itself.
fn unescaped(text: &str) -> String {
    let known = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&apos;", "'"), ("&amp;", "&")];
    known.iter().fold(text.to_owned(), |text, (from, to)| text.replace(from, to))
}

fn after<'a>(bytes: &'a [u8], word: &[u8]) -> Option<&'a [u8]> {
    bytes.get(find(bytes, word)? + word.len()..)
}

/// Where a word stands first.
fn find(bytes: &[u8], word: &[u8]) -> Option<usize> {
    let first = *word.first()?;
    let mut from = 0;
    loop {
        from += bytes.get(from..)?.iter().position(|byte| *byte == first)?;
        if bytes.get(from..)?.starts_with(word) {
            return Some(from);
        }
        from += 1;
    }
}

/// A name as a path from the folder of who names it. Of a path of another machine only the last part can be there.
pub(super) fn relative(name: &str) -> Option<String> {
    const MOST: usize = 512;
    let name = name.trim();
    if name.is_empty() || name.len() > MOST || name.contains('\0') {
        return None;
    }
    let mut path = Cow::Borrowed(name);
    if path.contains('\\') {
        path = Cow::Owned(path.replace('\\', "/"));
    }
    let (path, is_file) = match path.strip_prefix("file:") {
        Some(rest) => (rest.trim_start_matches("//").to_owned(), rest.starts_with("//")),
        None => (path.into_owned(), false),
    };
    // Nothing is fetched, and `data:` is no file.
    if path.contains("://") || path.starts_with("data:") {
        return None;
    }
    let is_absolute = path.starts_with('/') || path.get(1..2) == Some(":") || (is_file && path.contains(':'));
    let path =
        if is_absolute { path.rsplit('/').next().unwrap_or_default() } else { path.trim_start_matches("./") };
    (!path.is_empty() && !path.ends_with('/')).then(|| path.to_owned())
}

/// The path of what a file beside a mesh names, from the mesh's folder.
pub(super) fn joined(file: &str, name: &str) -> Option<String> {
    Some(format!("{}{}", folder(file), relative(name)?))
}

/// The URI of a file that a mesh names, by its path from the mesh's folder.
pub fn address(mesh: &str, name: &str) -> String {
    format!("{}{name}", folder(mesh.trim_start()))
}

/// Up to the last slash.
fn folder(path: &str) -> &str {
    path.rfind(['/', '\\']).and_then(|last| path.get(..=last)).unwrap_or_default()
}

#[cfg(test)]
mod tests;
