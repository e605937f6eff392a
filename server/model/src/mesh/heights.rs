//! Height fields: grey PNG pictures, and rows of numbers as text.
//!
//! Both become a grid of one by one, which the scale of the mesh stretches to its size in metres. In a
//! picture, black is 0 and white 1; numbers do not change. The first row has the greatest y, as a picture is
//! seen.

use std::io::Cursor;

use glamx::DVec3;
use png::{BitDepth, Decoder, Limits, Transformations};

use super::builder::Builder;
use super::{Content, shown};
use crate::limits;
use crate::robot::Grid;

/// Maximum memory of the decoder in addition to the samples, bytes.
const DECODER_BYTES: usize = 32 << 20;

/// Reads a PNG, grey or with grey colours. Ignores checksums: a file comes with its hash.
pub(super) fn png(bytes: &[u8]) -> Result<Content, String> {
    let mut decoder = Decoder::new_with_limits(Cursor::new(bytes), Limits { bytes: DECODER_BYTES });
    decoder.ignore_checksums(true);
    // Palettes become colours, and fewer than 8 bits become 8.
    decoder.set_transformations(Transformations::EXPAND);
    let info = decoder.read_header_info().map_err(|error| format!("it is not a PNG file: {error}"))?;
    // Checked before any of it is decompressed.
    let grid = grid(info.height as usize, info.width as usize)?;
    let unreadable = |error| format!("its pixels cannot be unpacked: {error}");
    let mut reader = decoder.read_info().map_err(unreadable)?;
    let mut samples = vec![0; reader.output_buffer_size().ok_or("it is too large")?];
    let frame = reader.next_frame(&mut samples).map_err(unreadable)?;
    let bytes_each = if frame.bit_depth == BitDepth::Sixteen { 2 } else { 1 };
    let channels = frame.color_type.samples();
    let mut heights = Vec::with_capacity(grid.rows * grid.columns);
    for pixel in samples.chunks_exact(bytes_each * channels) {
        let mut samples = pixel.chunks_exact(bytes_each);
        let first = samples.next().unwrap_or_default();
        if channels >= 3 && samples.take(2).any(|sample| sample != first) {
            return Err("it has colours; the picture of a height field is grey".to_owned());
        }
        heights.push(match *first {
            [high, low] => f64::from(u16::from_be_bytes([high, low])) / f64::from(u16::MAX),
            [one] => f64::from(one) / f64::from(u8::MAX),
            _ => 0.0,
        });
    }
    surface(grid, &heights)
}

/// Reads rows of numbers, separated by commas, semicolons or blanks. Skips lines that are empty or begin with
/// #.
pub(super) fn text(bytes: &[u8]) -> Result<Content, String> {
    let mut heights = Vec::new();
    let mut columns = None;
    let mut rows = 0;
    for (number, line) in (1..).zip(bytes.split(|byte| *byte == b'\n')) {
        let line = line.trim_ascii();
        if line.is_empty() || line.starts_with(b"#") {
            continue;
        }
        let before = heights.len();
        let is_between = |byte: &u8| matches!(byte, b',' | b';') || byte.is_ascii_whitespace();
        for word in line.split(is_between).filter(|word| !word.is_empty()) {
            if heights.len() >= MAX_SAMPLES {
                return Err(format!("it has more than {MAX_SAMPLES} samples"));
            }
            let word = String::from_utf8_lossy(word.get(..100).unwrap_or(word));
            let height = word.parse::<f64>().ok().filter(|height| height.is_finite());
            let height = height.ok_or_else(|| format!("line {number}: {} is not a number", shown(&word)))?;
            heights.push(height);
        }
        let here = heights.len() - before;
        match columns {
            Some(columns) if here != columns => {
                return Err(format!("line {number} has {here} numbers, and the lines before it {columns}"));
            }
            _ => columns = Some(here),
        }
        rows += 1;
    }
    surface(grid(rows, columns.unwrap_or(0))?, &heights)
}

/// Number of samples that give about the maximum number of triangles.
const MAX_SAMPLES: usize = limits::MESH_TRIANGLES / 2;

/// Returns a grid of at least two by two samples, within the limit.
fn grid(rows: usize, columns: usize) -> Result<Grid, String> {
    if rows < 2 || columns < 2 {
        return Err(format!("it has {rows} rows of {columns} samples; a height field has at least 2 by 2"));
    }
    if rows.checked_mul(columns).is_none_or(|samples| samples > MAX_SAMPLES) {
        return Err(format!("it has {rows} rows of {columns} samples; the limit is {MAX_SAMPLES} in all"));
    }
    Ok(Grid { rows, columns })
}

/// Returns the triangles of heights, row by row.
fn surface(grid: Grid, heights: &[f64]) -> Result<Content, String> {
    let Grid { rows, columns } = grid;
    let mut mesh = Builder::with_capacity(rows * columns, 2 * (rows - 1) * (columns - 1));
    if heights.len() != rows * columns {
        return Err("it ends before its last sample".to_owned());
    }
    let part = |at: usize, of: usize| at as f64 / (of - 1) as f64;
    for (at, height) in heights.iter().enumerate() {
        let (row, column) = (at / columns, at % columns);
        mesh.corner(DVec3::new(part(column, columns) - 0.5, 0.5 - part(row, rows), *height))?;
    }
    for row in 0..rows - 1 {
        for column in 0..columns - 1 {
            let corner = |down: usize, right: usize| {
                u32::try_from((row + down) * columns + column + right).map_err(|_| "it has too many samples")
            };
            let [a, b, c, d] = [corner(0, 0)?, corner(1, 0)?, corner(0, 1)?, corner(1, 1)?];
            mesh.triangle([a, b, c])?;
            mesh.triangle([b, d, c])?;
        }
    }
    Ok(Content { triangles: mesh.finish()?, paints: Vec::new(), grid: Some(grid) })
}

#[cfg(test)]
mod tests {
    use png::ColorType::{self, Grayscale, GrayscaleAlpha, Indexed, Rgb, Rgba};
    use png::{Encoder, Filter};

    use super::*;

    /// Returns a PNG of rows without filters.
    fn picture([width, height]: [u32; 2], depth: BitDepth, color: ColorType, rows: &[u8]) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = Encoder::new(&mut bytes, width, height);
        encoder.set_depth(depth);
        encoder.set_color(color);
        encoder.set_filter(Filter::Adaptive);
        if color == Indexed {
            encoder.set_palette(vec![0, 0, 0, 51, 51, 51, 255, 0, 0]);
        }
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(rows).unwrap();
        writer.finish().unwrap();
        bytes
    }

    /// Returns a picture whose header has another size.
    fn resized(size: [u32; 2]) -> Vec<u8> {
        let mut bytes = picture([2, 2], BitDepth::Eight, Grayscale, &[0; 4]);
        bytes[16..24].copy_from_slice(&size.map(u32::to_be_bytes).concat());
        bytes
    }

    fn heights(content: &Content) -> Vec<f64> {
        content.triangles.0.iter().map(|corner| corner.z).collect()
    }

    fn refused(read: Result<Content, String>) -> String {
        read.map(|_| ()).unwrap_err()
    }

    #[test]
    fn a_picture_and_rows_of_numbers_become_the_same_surface() {
        let rows = [0, 51, 102, 51, 102, 153, 255, 255, 0];
        let picture = png(&picture([3, 3], BitDepth::Eight, Grayscale, &rows)).unwrap();
        let text = text(b"# heights\n0, 0.2 ,0.4\n\n0.2;0.4\t0.6\r\n1 1 0").unwrap();
        assert_eq!(heights(&picture), [0.0, 0.2, 0.4, 0.2, 0.4, 0.6, 1.0, 1.0, 0.0]);
        assert_eq!(heights(&text), heights(&picture));
        assert_eq!(text.grid, Some(Grid { rows: 3, columns: 3 }));
        let (corners, triangles) = &text.triangles;
        assert_eq!(corners[0], DVec3::new(-0.5, 0.5, 0.0));
        assert_eq!(corners[5], DVec3::new(0.5, 0.0, 0.6));
        assert_eq!(triangles.len(), 8);
        // All triangles face up.
        for triangle in triangles {
            let [a, b, c] = triangle.map(|corner| corners[corner as usize]);
            assert!((b - a).cross(c - a).z > 0.0);
        }
    }

    #[test]
    fn samples_of_any_depth_and_grey_colours_are_read() {
        let rows = [0x12, 0x34, 0xff, 0xff, 0, 0, 0, 1];
        let wide = png(&picture([2, 2], BitDepth::Sixteen, Grayscale, &rows)).unwrap();
        assert_eq!(heights(&wide), [0x1234, 0xffff, 0, 1].map(|value| f64::from(value) / 65535.0));
        let grey = [9, 9, 9, 255, 8, 8, 8, 255, 7, 7, 7, 0, 6, 6, 6, 0];
        let colours = png(&picture([2, 2], BitDepth::Eight, Rgba, &grey)).unwrap();
        assert_eq!(heights(&colours), [9.0, 8.0, 7.0, 6.0].map(|grey| grey / 255.0));
        let clear =
            png(&picture([2, 2], BitDepth::Eight, GrayscaleAlpha, &[255, 0, 0, 9, 0, 0, 255, 1])).unwrap();
        assert_eq!(heights(&clear), [1.0, 0.0, 0.0, 1.0]);
        // Two bits a sample, one byte a row.
        let narrow = png(&picture([2, 2], BitDepth::Two, Grayscale, &[0b0111_0000, 0b1000_0000])).unwrap();
        assert_eq!(heights(&narrow), [1.0 / 3.0, 1.0, 2.0 / 3.0, 0.0]);
        let palette = png(&picture([2, 2], BitDepth::Eight, Indexed, &[0, 1, 1, 0])).unwrap();
        assert_eq!(heights(&palette), [0.0, 0.2, 0.2, 0.0]);
    }

    #[test]
    fn other_files_than_height_fields_are_refused_with_a_sentence() {
        let said = |size| refused(png(&resized(size)));
        assert!(said([100_000, 100_000]).starts_with("it has 100000 rows of 100000 samples; the limit"));
        assert!(said([i32::MAX as u32; 2]).contains("the limit is 1000000 in all"));
        assert!(said([5, 1]).contains("at least 2 by 2"));
        assert!(said([2, 3]).contains("cannot be unpacked"));
        assert!(refused(png(b"\x89PNG")).contains("not a PNG file"));
        for (color, rows) in [(Rgb, &[0, 0, 0, 1, 2, 3, 0, 0, 0, 0, 0, 0][..]), (Indexed, &[0, 2, 0, 0])] {
            let picture = picture([2, 2], BitDepth::Eight, color, rows);
            assert_eq!(refused(png(&picture)), "it has colours; the picture of a height field is grey");
        }
        let whole = picture([2, 2], BitDepth::Eight, Grayscale, &[0; 4]);
        // The end of the pixels, their checksum, and the last chunk.
        for cut in 0..whole.len() - 20 {
            assert!(png(&whole[..cut]).is_err(), "{cut}");
        }
        for (given, phrase) in [
            ("1 2 3", "1 rows of 3 samples; a height field has at least 2 by 2"),
            ("", "0 rows of 0"),
            ("1\n2\n3", "3 rows of 1"),
            ("1 2\n3", "line 2 has 1 numbers, and the lines before it 2"),
            ("1 2\n3 nan", "line 2: \"nan\" is not a number"),
            ("1 2\n3 1e999", "is not a number"),
            ("1 2\n3 1e300", "further than"),
        ] {
            let said = refused(text(given.as_bytes()));
            assert!(said.contains(phrase), "{given:?}: {said}");
        }
        let many = "0 ".repeat(MAX_SAMPLES + 1);
        assert_eq!(refused(text(many.as_bytes())), "it has more than 1000000 samples");
    }
}
