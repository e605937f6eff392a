//! Other files: `<include>`, which is replaced by its content, and `<model>` of the assets, whose parts are
//! attached. As in MuJoCo each file is included once. Names are relative to the folder of the main file, or
//! to the folder of the including file.

use std::collections::{BTreeMap, BTreeSet};

use roxmltree::Node;

use crate::assets::Assets;
use crate::limits::LoadLimits;
use crate::translation::element::Element;
use crate::translation::notes::Stop;
use crate::translation::sources::{Source, Texts};

/// Nesting depth of includes.
const MAX_DEPTH: usize = 50;

/// Indices of other files, by their names.
#[derive(Default)]
pub(super) struct FileIndices {
    /// By the folder of the including file, and the name.
    includes: BTreeMap<(String, String), usize>,
    pub(super) models: BTreeMap<String, usize>,
}

/// Requests the files that the main file and its includes and attachments name.
pub(super) fn gather(
    texts: &mut Texts,
    assets: &dyn Assets,
    limits: &LoadLimits,
) -> Result<FileIndices, Stop> {
    let mut file_indices = FileIndices::default();
    let mut by_uri: BTreeMap<String, usize> = BTreeMap::new();
    let mut included: BTreeSet<String> = BTreeSet::new();
    let mut count = 1;
    let mut index = 0;
    while index < count {
        let (folder, named): (String, Vec<(String, u32, bool)>) = {
            let source = texts.parse_one(index, limits)?;
            let is_model = |node: &Node| {
                let above = node.parent_element().map(|above| above.tag_name().name());
                node.tag_name().name() == "model" && above == Some("asset") && node.has_attribute("file")
            };
            let is_named = |node: &Node| node.tag_name().name() == "include" || is_model(node);
            let named = source.document.descendants().filter(is_named).map(|node| {
                let file = node.attribute("file").unwrap_or_default().trim().to_owned();
                (file, source.line(node.range().start), is_model(&node))
            });
            let end = source.uri.rfind('/').map_or(0, |end| end + 1);
            (source.uri.get(..end).unwrap_or_default().to_owned(), named.collect())
        };
        for (file, line, is_model) in named {
            if is_model && !file.is_empty() {
                if file_indices.models.contains_key(&file) {
                    continue;
                }
                let known = by_uri.get(&file).copied();
                if known.is_some() || texts.include(&file, assets, limits)? {
                    by_uri.insert(file.clone(), known.unwrap_or(count));
                    file_indices.models.insert(file, known.unwrap_or(count));
                    count += usize::from(known.is_none());
                }
                continue;
            }
            let of = texts.get(index).map(|(uri, _)| uri.to_owned()).filter(|uri| !uri.is_empty());
            if file.is_empty() {
                return Err(Stop::of_file(of, Some(line), "it does not name its file".to_owned()));
            }
            let beside = beside(&folder, &file);
            let mut found = None;
            for uri in [Some(&file), beside.as_ref()].into_iter().flatten() {
                if texts.include(uri, assets, limits)? {
                    found = Some(uri.clone());
                    break;
                }
            }
            // A missing file is still listed among the requested ones.
            let Some(uri) = found else { continue };
            if !included.insert(uri.clone()) {
                let message = format!("the file {uri:?} is included twice, which MJCF does not allow");
                return Err(Stop::of_file(of, Some(line), message));
            }
            // It may already exist as a model.
            let known = by_uri.get(&uri).copied();
            file_indices.includes.insert((folder.clone(), file), known.unwrap_or(count));
            by_uri.insert(uri, known.unwrap_or(count));
            count += usize::from(known.is_none());
        }
        index += 1;
    }
    Ok(file_indices)
}

/// Returns the path of a file relative to the folder of the naming file, if that differs from the folder of
/// the main file.
pub(super) fn beside(folder: &str, file: &str) -> Option<String> {
    let is_relative = !file.starts_with('/') && !file.contains("://");
    (is_relative && !folder.is_empty()).then(|| format!("{folder}{}", file.trim_start_matches("./")))
}

/// Returns the elements of a section, with included files' elements in place of each include.
pub(super) fn expanded<'a>(
    section: Element<'a>,
    sources: &'a [Source<'a>],
    file_indices: &FileIndices,
) -> Result<Vec<Element<'a>>, Stop> {
    let mut all = Vec::new();
    // The last one is read next.
    let mut open: Vec<(Element<'a>, usize)> = section.elements().map(|element| (element, 0)).collect();
    open.reverse();
    while let Some((element, depth)) = open.pop() {
        if element.tag() != "include" {
            all.push(element);
            continue;
        }
        let file = element.word("file").unwrap_or_default();
        let key = (element.folder().to_owned(), file.to_owned());
        let root = file_indices.includes.get(&key).and_then(|index| Element::root(sources, *index));
        let Some(root) = root else {
            return Err(Stop::at(element, format!("the file {file:?} is not found")));
        };
        if depth >= MAX_DEPTH {
            return Err(Stop::at(element, format!("includes are nested deeper than {MAX_DEPTH} levels")));
        }
        let inside: Vec<Element<'a>> = root.elements().collect();
        open.extend(inside.into_iter().rev().map(|inner| (inner, depth + 1)));
    }
    Ok(all)
}
