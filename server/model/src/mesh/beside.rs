//! Files that a mesh file names: materials of an OBJ, textures, buffers of a glTF.
//!
//! Their names are relative to the folder of the mesh, like the description's own files. A client that
//! uploads a robot finds the names in the mesh, without parsing all of it.

use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::sync::Arc;

use super::{gltf, image, mtl};
use crate::assets::{Asset, Assets};
use crate::limits;
use crate::robot::{FileBeside, Image, Sha256};

/// Begins a sentence about missing or unusable materials.
pub(crate) const MATERIALS: &str = "the materials";

/// Use of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Role {
    /// Materials of an OBJ.
    Materials,
    /// Numbers of a glTF.
    Buffer,
    /// A picture.
    Image,
}

/// A file that a mesh names.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Named {
    /// Its path from the folder of the mesh.
    pub(super) name: String,
    pub(super) role: Role,
}

/// Files that were found beside a mesh.
#[derive(Default)]
pub(crate) struct Beside {
    images: BTreeMap<String, Arc<Image>>,
    bytes: BTreeMap<String, Arc<[u8]>>,
    /// Picture that the description puts on the mesh.
    cover: Option<Arc<Image>>,
    /// All files that were found.
    pub(crate) files: Vec<FileBeside>,
    /// Sentences about missing or unusable files.
    pub(crate) notes: Vec<String>,
}

impl Beside {
    /// Looks for all files that a mesh names, and for the files that those name.
    pub(crate) fn gather(uri: &str, bytes: &[u8], assets: &dyn Assets) -> Self {
        let mut beside = Self::default();
        let mut size = 0;
        walk(uri, bytes, &mut |named| {
            let Named { name, role } = named;
            let (what, lost) = match role {
                Role::Materials => (MATERIALS, "without them it has no colours"),
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

    /// Adds the picture of the description's material, for triangles without a picture.
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
                return Err(format!("it has {size} bytes; the limit is {most}"));
            }
            Role::Materials | Role::Buffer => {
                self.bytes.insert(name.clone(), Arc::clone(bytes));
            }
        }
        Ok(())
    }

    fn note(&mut self, note: String) {
        const MAX: usize = 16;
        if self.notes.len() < MAX {
            self.notes.push(note);
        }
    }

    /// Returns whether there are pictures; without one, texture coordinates are not needed.
    pub(super) fn has_images(&self) -> bool {
        !self.images.is_empty() || self.cover.is_some()
    }

    /// Returns the picture that the description puts on the mesh.
    pub(super) fn cover(&self) -> Option<&Arc<Image>> {
        self.cover.as_ref()
    }

    /// Returns a picture, by its name in the mesh.
    pub(super) fn image(&self, name: &str) -> Option<Arc<Image>> {
        self.images.get(&relative(name)?).cloned()
    }

    /// Returns another file, by its name in the mesh.
    pub(super) fn bytes(&self, name: &str) -> Option<&Arc<[u8]>> {
        self.bytes.get(&relative(name)?)
    }
}

/// Returns the URIs that a mesh names, as far as the files are known. Known files are searched for further
/// names.
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

/// Calls `each` once with each file that a mesh names, and with the files named in the bytes that `each`
/// returns.
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

/// Returns the files that the file itself names.
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

/// Returns the files of `<image>` elements. They are searched as text, since parsing the whole document takes
/// long. Each byte is searched once: a short file of nothing but opening tags would take hours otherwise.
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

/// Replaces the five predefined entities of XML.
fn unescaped(text: &str) -> String {
    let known = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&apos;", "'"), ("&amp;", "&")];
    known.iter().fold(text.to_owned(), |text, (from, to)| text.replace(from, to))
}

fn after<'a>(bytes: &'a [u8], word: &[u8]) -> Option<&'a [u8]> {
    bytes.get(find(bytes, word)? + word.len()..)
}

/// Returns the first position of a word.
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

/// Returns a name as a path from the folder of the naming file. If it is a path of another machine, only its
/// last part can exist.
pub(super) fn relative(name: &str) -> Option<String> {
    const MAX: usize = 512;
    let name = name.trim();
    if name.is_empty() || name.len() > MAX || name.contains('\0') {
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
    // Nothing is fetched, and `data:` is not a file.
    if path.contains("://") || path.starts_with("data:") {
        return None;
    }
    let is_absolute = path.starts_with('/') || path.get(1..2) == Some(":") || (is_file && path.contains(':'));
    let path =
        if is_absolute { path.rsplit('/').next().unwrap_or_default() } else { path.trim_start_matches("./") };
    (!path.is_empty() && !path.ends_with('/')).then(|| path.to_owned())
}

/// Returns the path, from the mesh's folder, of a name in a file beside the mesh.
pub(super) fn joined(file: &str, name: &str) -> Option<String> {
    Some(format!("{}{}", folder(file), relative(name)?))
}

/// Returns the URI of a file that a mesh names, by its path from the mesh's folder.
pub fn address(mesh: &str, name: &str) -> String {
    format!("{}{name}", folder(mesh.trim_start()))
}

/// Returns the path up to the last slash.
fn folder(path: &str) -> &str {
    path.rfind(['/', '\\']).and_then(|last| path.get(..=last)).unwrap_or_default()
}

#[cfg(test)]
mod tests;
