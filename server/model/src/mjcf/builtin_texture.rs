//! Textures that MuJoCo makes itself: a checker pattern, a gradient, one colour, with marks. They become PNG
//! files, which the URDF names like any other picture.

use super::defaults::Classed;
use super::inline_mesh::Made;
use crate::report::Disposition::Repaired;
use crate::translation::notes::{Notes, Stop};

/// Maximum pixels of a side; larger pictures are drawn with this size.
const MAX_SIDE: usize = 1024;

type Rgb = [u8; 3];

/// Returns the PNG of a texture with a pattern. `None` if it has none, or one that differs between the sides
/// of a box.
pub(super) fn png(
    texture: &Classed,
    is_flat: bool,
    made: &Made,
    notes: &mut Notes,
) -> Result<Option<Vec<u8>>, Stop> {
    let pattern: fn(&Colours, [usize; 2], [usize; 2]) -> Rgb = match texture.word("builtin") {
        Some("checker") => checker,
        Some("gradient") if is_flat => gradient,
        Some("flat") => flat,
        _ => return Ok(None),
    };
    let mut color = |name: &str, default: f64| -> Result<[f64; 3], Stop> {
        Ok(texture.numbers(name, notes)?.unwrap_or([default; 3]))
    };
    let colours =
        Colours { first: color("rgb1", 0.8)?, second: color("rgb2", 0.5)?, mark: color("markrgb", 0.0)? };
    let wide = texture.number("width")?.unwrap_or(0.0);
    // The sides of a cube are squares.
    let high = if is_flat { texture.number("height")?.unwrap_or(0.0) } else { wide };
    if !(wide >= 1.0 && high >= 1.0) {
        return Ok(None);
    }
    let size = [wide, high].map(|side| (side as usize).min(MAX_SIDE));
    if wide > MAX_SIDE as f64 || high > MAX_SIDE as f64 {
        notes.info(
            texture.element,
            Repaired,
            format!("it is drawn with at most {MAX_SIDE} pixels along a side"),
        );
    }
    made.spend(size[0] * size[1], texture.element)?;
    let mark = texture.word("mark").unwrap_or("none");
    let random = texture.number("random")?.unwrap_or(0.01);
    let mut rows = Vec::with_capacity(size[1] * 3 * size[0]);
    for row in 0..size[1] {
        for column in 0..size[0] {
            let pixel = [column, row];
            let is_marked = match mark {
                "edge" => pixel.iter().zip(size).any(|(index, side)| *index == 0 || *index + 1 == side),
                "cross" => pixel.iter().zip(size).any(|(index, side)| *index == side / 2),
                // MuJoCo's own random numbers are unknown: the number of pixels is equal, their positions
                // differ.
                "random" => noise(pixel) < random,
                _ => false,
            };
            rows.extend(if is_marked { bytes(colours.mark) } else { pattern(&colours, pixel, size) });
        }
    }
    // Writing to memory cannot fail, and the sides are within the format's.
    Ok(written(size, &rows).ok())
}

/// Colours in the file.
struct Colours {
    first: [f64; 3],
    second: [f64; 3],
    mark: [f64; 3],
}

fn bytes(color: [f64; 3]) -> Rgb {
    color.map(|part| (255.0 * part.clamp(0.0, 1.0)) as u8)
}

fn flat(colours: &Colours, _pixel: [usize; 2], _size: [usize; 2]) -> Rgb {
    bytes(colours.first)
}

/// Returns a pixel of two by two fields.
fn checker(colours: &Colours, pixel: [usize; 2], size: [usize; 2]) -> Rgb {
    let [right, low] = [pixel[0] >= size[0] / 2, pixel[1] >= size[1] / 2];
    bytes(if right == low { colours.first } else { colours.second })
}

/// Returns a pixel of a gradient from the first colour in the middle to the second outside, by a sigmoid of
/// the distance.
fn gradient(colours: &Colours, pixel: [usize; 2], size: [usize; 2]) -> Rgb {
    let coordinate = |axis: usize| 2.0 * pixel[axis] as f64 / (size[axis].max(2) - 1) as f64 - 1.0;
    let out = 2.0 * coordinate(0).hypot(coordinate(1)) - 1.0;
    let share = (0.5 * (1.0 + out / out.hypot(1.0) * std::f64::consts::SQRT_2)).clamp(0.0, 1.0);
    let mixed = |part: usize| share * colours.second[part] + (1.0 - share) * colours.first[part];
    bytes([mixed(0), mixed(1), mixed(2)])
}

/// Returns a pseudo-random number from 0 to 1, the same at each reading (the finalizer of SplitMix64).
fn noise([column, row]: [usize; 2]) -> f64 {
    let mut bits = ((row as u64) << 32 | column as u64).wrapping_add(0x9E37_79B9_7F4A_7C15);
    bits = (bits ^ (bits >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    bits = (bits ^ (bits >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Returns a PNG with 8 bits per component.
fn written([width, height]: [usize; 2], rows: &[u8]) -> Result<Vec<u8>, png::EncodingError> {
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(rows)?;
    writer.finish()?;
    Ok(file)
}
