//! `<include>`: other files, of which the content stands in its place. As in MuJoCo each file is included once, and
//! names are from the folder of the main file.

use std::collections::BTreeMap;

use crate::limits::LoadLimits;
use crate::translation::element::Element;
use crate::translation::notes::Stop;
use crate::translation::sources::{Source, Texts};
use crate::urdf::Assets;

/// Includes inside one another.
const MOST_NESTED: usize = 50;

/// Asks for what the file and what it includes include: the place of each by its name.
pub(super) fn gather(
    texts: &mut Texts,
    assets: &dyn Assets,
    limits: &LoadLimits,
) -> Result<BTreeMap<String, usize>, Stop> {
    let mut places = BTreeMap::new();
    let mut count = 1;
    let mut place = 0;
    while place < count {
        let named: Vec<(String, u32)> = {
            let source = texts.parse_one(place, limits)?;
            let includes = source.document.descendants().filter(|node| node.tag_name().name() == "include");
            let named = includes.map(|node| {
                let file = node.attribute("file").unwrap_or_default().trim().to_owned();
                (file, source.line(node.range().start))
            });
            named.collect()
        };
        for (file, line) in named {
            let of = texts.get(place).map(|(uri, _)| uri.to_owned()).filter(|uri| !uri.is_empty());
            if file.is_empty() {
                return Err(Stop::of_file(of, Some(line), "an include does not name its file".to_owned()));
            }
            if places.contains_key(&file) {
                let message = format!("the file {file:?} is included twice, which MJCF does not allow");
                return Err(Stop::of_file(of, Some(line), message));
            }
            if !texts.include(&file, assets, limits)? {
                // It is among what was asked for all the same.
                continue;
            }
            places.insert(file, count);
            count += 1;
        }
        place += 1;
    }
    Ok(places)
}

/// The elements of a section, with those of included files in the place of each include.
pub(super) fn expanded<'a>(
    section: Element<'a>,
    sources: &'a [Source<'a>],
    places: &BTreeMap<String, usize>,
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
        let root = places.get(file).and_then(|place| Element::root(sources, *place));
        let Some(root) = root else {
            return Err(Stop::at(element, format!("the file {file:?} is not found")));
        };
        if depth >= MOST_NESTED {
            return Err(Stop::at(
                element,
                format!("files include one another, deeper than {MOST_NESTED} levels"),
            ));
        }
        let inside: Vec<Element<'a>> = root.elements().collect();
        open.extend(inside.into_iter().rev().map(|inner| (inner, depth + 1)));
    }
    Ok(all)
}
