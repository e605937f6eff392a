//! Includes of an SDF: finds and gathers their files.

use std::collections::BTreeMap;

use roxmltree::Node;

use crate::assets::Assets;
use crate::limits::LoadLimits;
use crate::translation::notes::Stop;
use crate::translation::sources::Texts;

/// Index of the file of each include, by the folder of the including file and the URI.
#[derive(Default)]
pub(super) struct FileIndices {
    by_uri: BTreeMap<(String, String), usize>,
}

impl FileIndices {
    /// Returns the file of an include, if it exists.
    pub(super) fn get(&self, folder: &str, uri: &str) -> Option<usize> {
        self.by_uri.get(&(folder.to_owned(), uri.to_owned())).copied()
    }
}

/// Requests the includes of the file and of its includes.
pub(super) fn gather(
    texts: &mut Texts,
    assets: &dyn Assets,
    limits: &LoadLimits,
) -> Result<FileIndices, Stop> {
    let mut file_indices = FileIndices::default();
    let mut by_name: BTreeMap<String, usize> = BTreeMap::new();
    let mut count = 1;
    let mut index = 0;
    while index < count {
        let (folder, uris) = {
            let source = texts.parse_one(index, limits)?;
            let end = source.uri.rfind('/').map_or(0, |end| end + 1);
            let folder = source.uri.get(..end).unwrap_or_default().to_owned();
            let is_include = |node: &Node| node.is_element() && node.tag_name().name() == "include";
            let includes = source.document.descendants().filter(is_include);
            let uri = |include: Node| {
                let uri =
                    include.children().find(|node| node.is_element() && node.tag_name().name() == "uri")?;
                Some(uri.text()?.trim().to_owned())
            };
            (folder, includes.filter_map(uri).collect::<Vec<String>>())
        };
        for uri in uris {
            let key = (folder.clone(), uri);
            if file_indices.by_uri.contains_key(&key) || key.1.is_empty() {
                continue;
            }
            let mut found = find(&joined(&folder, &key.1), texts, assets, limits)?;
            let of_model = as_model(&key.1);
            if found.is_none() && of_model != key.1 {
                found = find(&of_model, texts, assets, limits)?;
            }
            if found.is_none() {
                found = built_in(&of_model, texts, limits)?;
            }
            let Some(name) = found else { continue };
            let index = *by_name.entry(name).or_insert_with(|| {
                count += 1;
                count - 1
            });
            file_indices.by_uri.insert(key, index);
        }
        index += 1;
    }
    Ok(file_indices)
}

/// Returns the name under which the file of a URI is now stored.
fn find(
    uri: &str,
    texts: &mut Texts,
    assets: &dyn Assets,
    limits: &LoadLimits,
) -> Result<Option<String>, Stop> {
    let lower = uri.to_ascii_lowercase();
    if [".sdf", ".world", ".xml", ".urdf"].iter().any(|ending| lower.ends_with(ending)) {
        return Ok(texts.include(uri, assets, limits)?.then(|| uri.to_owned()));
    }
    let folder = uri.trim_end_matches('/');
    let usual = format!("{folder}/model.sdf");
    if texts.include(&usual, assets, limits)? {
        return Ok(Some(usual));
    }
    // The manifest names another file; the last one has the newest version.
    let Ok(manifest) = assets.find(&format!("{folder}/model.config")) else { return Ok(None) };
    let text =
        String::from_utf8_lossy(manifest.bytes.get(..manifest.bytes.len().min(64 << 10)).unwrap_or_default())
            .into_owned();
    let named = text.split("<sdf").skip(1).filter_map(|rest| {
        let (_, rest) = rest.split_once('>')?;
        Some(rest.split_once('<')?.0.trim().to_owned())
    });
    let Some(file) = named.filter(|file| !file.is_empty() && !file.contains("..")).last() else {
        return Ok(None);
    };
    let uri = format!("{folder}/{file}");
    Ok(texts.include(&uri, assets, limits)?.then_some(uri))
}

/// Returns the URI of a model for a name without a scheme: sdformat looks for these in the folders of models too.
fn as_model(uri: &str) -> String {
    match uri.contains("://") || uri.starts_with(['/', '.']) {
        true => uri.to_owned(),
        false => format!("model://{uri}"),
    }
}

/// Returns the last name of a URI, in lower case and without blanks.
fn last_name(uri: &str) -> String {
    let name = uri.trim().trim_end_matches('/').rsplit('/').next().unwrap_or_default();
    name.to_lowercase().replace([' ', '-'], "_").replace("%20", "_")
}

/// Returns whether a URI is the light that nearly every world includes.
pub(super) fn is_sun(uri: &str) -> bool {
    as_model(uri).contains("://") && last_name(uri) == "sun"
}

/// Ground that nearly every world includes, if no file has it.
const GROUND_PLANE: &str = "<sdf version='1.7'><model name='ground_plane'><static>true</static><link name='link'>\
    <inertial><mass>1</mass><inertia><ixx>1</ixx><iyy>1</iyy><izz>1</izz></inertia></inertial>\
    <collision name='collision'><geometry><plane><normal>0 0 1</normal></plane></geometry>\
    <surface><friction><ode><mu>100</mu></ode></friction></surface></collision>\
    <visual name='visual'><geometry><plane><normal>0 0 1</normal></plane></geometry></visual></link></model></sdf>";

/// Returns the name of a built-in model.
fn built_in(uri: &str, texts: &mut Texts, limits: &LoadLimits) -> Result<Option<String>, Stop> {
    if !uri.contains("://") || last_name(uri) != "ground_plane" {
        return Ok(None);
    }
    let name = "built in: ground_plane";
    texts.include_text(name, GROUND_PLANE.as_bytes(), limits)?;
    Ok(Some(name.to_owned()))
}

/// Returns the URI of a file in a folder; an absolute URI does not change.
pub(super) fn joined(folder: &str, uri: &str) -> String {
    let uri = uri.trim();
    if uri.contains("://") || uri.starts_with('/') || folder.is_empty() {
        return uri.to_owned();
    }
    format!("{folder}{}", uri.trim_start_matches("./"))
}
