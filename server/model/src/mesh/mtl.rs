//! Materials of Wavefront OBJ files: names, colours, pictures.

use std::collections::HashMap;

use super::beside::{Beside, joined};
use super::builder::Look;
use crate::limits;

/// Returns the material files that an OBJ names.
pub(super) fn libraries(obj: &[u8]) -> impl Iterator<Item = String> {
    statements(obj, b"mtllib")
}

/// Returns the diffuse pictures that a material file names.
pub(super) fn images(mtl: &[u8]) -> impl Iterator<Item = String> {
    statements(mtl, b"map_Kd").map(|statement| file_of(&statement).to_owned())
}

/// Returns the rest of each line that begins with a word.
fn statements<'a>(text: &'a [u8], word: &'static [u8]) -> impl Iterator<Item = String> + 'a {
    let lines = text.split(|byte| *byte == b'\n').map(<[u8]>::trim_ascii);
    lines.filter_map(move |line| {
        let rest =
            line.strip_prefix(word).filter(|rest| rest.first().is_some_and(u8::is_ascii_whitespace))?;
        Some(String::from_utf8_lossy(rest.trim_ascii()).into_owned())
    })
}

/// Returns the file of a statement, which may have options before it. A name may have spaces.
fn file_of(statement: &str) -> &str {
    if statement.starts_with('-') {
        statement.split_ascii_whitespace().last().unwrap_or_default()
    } else {
        statement
    }
}

/// Returns the materials of all files that an OBJ names, by their names.
pub(super) fn read(obj: &[u8], beside: &Beside) -> HashMap<String, Look> {
    let mut looks = HashMap::new();
    if beside.files.is_empty() {
        return looks;
    }
    for library in libraries(obj).take(limits::FILES_BESIDE) {
        let Some(text) = beside.bytes(&library) else { continue };
        let mut name = None;
        let mut look = Look::default();
        for line in text.split(|byte| *byte == b'\n') {
            let line = String::from_utf8_lossy(line);
            let (word, rest) = line.trim().split_once(char::is_whitespace).unwrap_or_default();
            let rest = rest.trim();
            match word {
                "newmtl" => {
                    keep(&mut looks, name.replace(rest.to_owned()), std::mem::take(&mut look));
                }
                "Kd" => look.color = color(rest).or(look.color),
                "d" => look.alpha = number(rest).map_or(look.alpha, |part| part.clamp(0.0, 1.0)),
                // Transparency.
                "Tr" => look.alpha = number(rest).map_or(look.alpha, |part| 1.0 - part.clamp(0.0, 1.0)),
                "map_Kd" => {
                    let file = joined(&library, file_of(rest));
                    look.image = file.and_then(|file| beside.image(&file)).or(look.image.take());
                }
                _ => {}
            }
        }
        keep(&mut looks, name, look);
    }
    looks
}

fn keep(looks: &mut HashMap<String, Look>, name: Option<String>, mut look: Look) {
    let Some(name) = name.filter(|_| looks.len() < limits::MATERIALS) else { return };
    // Some exporters write an invisible material for an opaque one.
    if look.alpha <= 0.0 {
        look.alpha = 1.0;
    }
    // Some exporters write black if the picture has the colour.
    if look.image.is_some() && look.color == Some([0.0; 3]) {
        look.color = None;
    }
    looks.entry(name).or_insert(look);
}

/// Parses three numbers, or one for all; spectra and XYZ are not read.
fn color(text: &str) -> Option<[f64; 3]> {
    let mut parts = text.split_ascii_whitespace().map_while(number);
    let red = parts.next()?;
    let color = [red, parts.next().unwrap_or(red), parts.next().unwrap_or(red)];
    Some(color.map(|part| part.clamp(0.0, 1.0)))
}

fn number(text: &str) -> Option<f64> {
    text.split_ascii_whitespace().next()?.parse().ok().filter(|number: &f64| number.is_finite())
}
