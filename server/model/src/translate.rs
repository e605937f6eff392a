//! Translates a file of any format to URDF, and lists the files that it needs.

use std::cell::RefCell;
use std::collections::BTreeSet;

use crate::assets::{Asset, Assets};
use crate::limits::LoadLimits;
use crate::mesh::beside;
use crate::translation::{Format, Translation};
use crate::urdf::{Description, Refused};
use crate::{mjcf, sdf, urdf};

/// Translates a file of another format to URDF; `None` if it has none of these formats. Meshes are only
/// requested if masses follow from them.
///
/// # Errors
///
/// Returns an error if the file cannot be read, is too large, or has nothing that simd supports.
pub fn translate(
    bytes: &[u8],
    assets: &dyn Assets,
    limits: &LoadLimits,
) -> Result<Option<Translation>, Refused> {
    match Format::of(bytes) {
        Format::Urdf => Ok(None),
        Format::Sdf => sdf::translate(bytes, assets, limits).map(Some),
        Format::Mjcf => mjcf::translate(bytes, assets, limits).map(Some),
    }
}

/// Describes a description of any format. `assets` are the present files of its includes and meshes.
///
/// # Errors
///
/// Returns an error if it cannot be read at all although all of its includes are present.
pub fn describe_with(bytes: &[u8], assets: &dyn Assets, limits: &LoadLimits) -> Result<Description, Refused> {
    /// Maximum number of URIs of pictures and materials.
    const MAX: usize = 10_000;
    let mut description = describe_alone(bytes, assets, limits)?;
    let mut seen: BTreeSet<String> = description.asset_uris.iter().cloned().collect();
    for uri in description.asset_uris.clone() {
        for named in beside::uris(&uri, assets) {
            if seen.len() < MAX && seen.insert(named.clone()) {
                description.asset_uris.push(named);
            }
        }
    }
    Ok(description)
}

/// Returns the description without the files that meshes name.
fn describe_alone(bytes: &[u8], assets: &dyn Assets, limits: &LoadLimits) -> Result<Description, Refused> {
    if Format::of(bytes) == Format::Urdf {
        return urdf::describe(bytes, limits);
    }
    let asked = Asked { assets, found: RefCell::default(), missing: RefCell::default() };
    let translation = match translate(bytes, &asked, limits) {
        Ok(Some(translation)) => translation,
        Ok(None) => return urdf::describe(bytes, limits),
        // A client that sends the missing files learns the rest.
        Err(_) if !asked.missing.borrow().is_empty() => {
            let found = asked.found.into_inner();
            let asset_uris = found.into_iter().chain(asked.missing.into_inner()).collect();
            return Ok(Description { name: String::new(), asset_uris, models: Vec::new() });
        }
        Err(refused) => return Err(refused),
    };
    let mut asset_uris = translation.included.clone();
    let mut seen: BTreeSet<String> = asset_uris.iter().cloned().collect();
    for model in &translation.models {
        let described = urdf::describe(model.urdf.as_bytes(), limits)?;
        asset_uris.extend(
            described
                .asset_uris
                .into_iter()
                .filter(|uri| !translation.meshes.contains_key(uri) && seen.insert(uri.clone())),
        );
    }
    // Other places at which a file may be found.
    asset_uris.extend(asked.missing.into_inner().into_iter().filter(|uri| seen.insert(uri.clone())));
    let models: Vec<String> = translation.models.iter().map(|model| model.name.clone()).collect();
    Ok(Description { name: models.first().cloned().unwrap_or_default(), asset_uris, models })
}

/// Files, with a record of the requested ones.
struct Asked<'a> {
    assets: &'a dyn Assets,
    found: RefCell<Vec<String>>,
    missing: RefCell<Vec<String>>,
}

impl Assets for Asked<'_> {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        let found = self.assets.find(uri);
        let list = if found.is_ok() { &self.found } else { &self.missing };
        let mut list = list.borrow_mut();
        if list.len() < 10_000 && !list.iter().any(|known| known == uri) {
            list.push(uri.to_owned());
        }
        found
    }
}
