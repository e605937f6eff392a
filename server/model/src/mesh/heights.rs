//! Height fields: grey PNG pictures, and rows of numbers as text.
//!
//! Both become a grid of one by one, which the scale of the mesh stretches to its size in metres. In a
//! picture, black is 0 and white 1; numbers do not change. The first row has the greatest y, as a picture is
//! seen.

use std::io::Read as _;

use flate2::read::ZlibDecoder;
use glamx::DVec3;

use super::builder::Builder;
use super::{Content, shown};
use crate::limits;
use crate::robot::Grid;

/// Header of a picture.
struct Header {
    grid: Grid,
    /// 1 or 2.
    bytes_each: usize,
    channels: usize,
}

/// Reads a PNG of 8 or 16 bits, grey or with grey colours. ISO/IEC 15948, without checksums: a file comes
/// with its hash.
pub(super) fn png(bytes: &[u8]) -> Result<Content, String> {
    let mut rest = bytes.strip_prefix(b"\x89PNG\r\n\x1a\n").ok_or("it is not a PNG file")?;
    let mut header = None;
    let mut packed = Vec::new();
    while let Some((size, after)) = rest.split_first_chunk::<4>() {
        let (kind, after) = after.split_first_chunk::<4>().ok_or(CUT)?;
        let size = u32::from_be_bytes(*size) as usize;
        let chunk = after.get(..size).ok_or(CUT)?;
        match kind {
            b"IHDR" => header = Some(self::header(chunk)?),
            b"IDAT" => packed.extend_from_slice(chunk),
            b"IEND" => break,
            _ => {}
        }
        rest = after.get(size + 4..).ok_or(CUT)?;
    }
    let Header { grid, bytes_each, channels } = header.ok_or("it is a PNG without a header")?;
    let pixel = bytes_each * channels;
    let mut unpacked = ZlibDecoder::new(packed.as_slice());
    let mut heights = Vec::with_capacity(grid.rows * grid.columns);
    let (mut before, mut row) = (vec![0; grid.columns * pixel], vec![0; grid.columns * pixel]);
    for _ in 0..grid.rows {
        let mut filter = [0];
        unpacked
            .read_exact(&mut filter)
            .map_err(|error| format!("its pixels cannot be unpacked: {error}"))?;
        unpacked.read_exact(&mut row).map_err(|error| format!("its pixels cannot be unpacked: {error}"))?;
        unfilter(filter[0], pixel, &before, &mut row)?;
        for pixel in row.chunks_exact(pixel) {
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
        std::mem::swap(&mut before, &mut row);
    }
    surface(grid, &heights)
}

const CUT: &str = "it is a PNG that ends too early";

fn header(chunk: &[u8]) -> Result<Header, String> {
    let &[w0, w1, w2, w3, h0, h1, h2, h3, depth, color, 0, 0, interlaced] = chunk else {
        return Err("it is a PNG with an unknown header".to_owned());
    };
    let [width, height] = [[w0, w1, w2, w3], [h0, h1, h2, h3]].map(u32::from_be_bytes);
    // Checked before any of it is decompressed.
    let grid = grid(height as usize, width as usize)?;
    let channels = match color {
        0 => 1,
        4 => 2,
        2 => 3,
        6 => 4,
        _ => return Err("it has a palette; the picture of a height field is grey".to_owned()),
    };
    if interlaced != 0 {
        return Err("it is interlaced; save it without interlacing".to_owned());
    }
    match depth {
        8 => Ok(Header { grid, bytes_each: 1, channels }),
        16 => Ok(Header { grid, bytes_each: 2, channels }),
        _ => Err(format!("it has {depth} bits a sample; only 8 and 16 are supported")),
    }
}

/// Undoes a row's filter, for pixels of `pixel` bytes, with the row before it.
fn unfilter(filter: u8, pixel: usize, before: &[u8], row: &mut [u8]) -> Result<(), String> {
    if filter > 4 {
        return Err(format!("its pixels have the unknown filter {filter}"));
    }
    for at in 0..row.len() {
        let left = at.checked_sub(pixel);
        let [a, c] = [&*row, before].map(|row| left.and_then(|left| row.get(left)).copied().unwrap_or(0));
        let b = before.get(at).copied().unwrap_or(0);
        let guess = match filter {
            0 => 0,
            1 => a,
            2 => b,
            // Half of the sum of two bytes is a byte.
            3 => u16::midpoint(u16::from(a), u16::from(b)) as u8,
            _ => paeth(a, b, c),
        };
        if let Some(value) = row.get_mut(at) {
            *value = value.wrapping_add(guess);
        }
    }
    Ok(())
}

/// Returns the value among left, above and above left that is nearest to the plane through them.
fn paeth(a: u8, b: u8, c: u8) -> u8 {
    let [left, above, corner] = [a, b, c].map(i16::from);
    let plane = left + above - corner;
    let off = |value: i16| (plane - value).abs();
    if off(left) <= off(above) && off(left) <= off(corner) {
        a
    } else if off(above) <= off(corner) {
        b
    } else {
        c
    }
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
            if heights.len() >= MOST_SAMPLES {
                return Err(format!("it has more than {MOST_SAMPLES} samples"));
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
const MOST_SAMPLES: usize = limits::MESH_TRIANGLES / 2;

/// Returns a grid of at least two by two samples, within the limit.
fn grid(rows: usize, columns: usize) -> Result<Grid, String> {
    if rows < 2 || columns < 2 {
        return Err(format!("it has {rows} rows of {columns} samples; a height field has at least 2 by 2"));
    }
    if rows.checked_mul(columns).is_none_or(|samples| samples > MOST_SAMPLES) {
        return Err(format!("it has {rows} rows of {columns} samples; the limit is {MOST_SAMPLES} in all"));
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
    use std::io::Write as _;

    use flate2::Compression;
    use flate2::write::ZlibEncoder;

    use super::*;

    /// Returns a PNG of filtered rows, each with its filter before it.
    fn picture([width, height]: [u32; 2], [depth, color]: [u8; 2], rows: &[u8]) -> Vec<u8> {
        let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
        let mut chunk = |kind: &[u8; 4], data: &[u8]| {
            bytes.extend(u32::try_from(data.len()).unwrap().to_be_bytes());
            bytes.extend(kind);
            bytes.extend(data);
            bytes.extend([0; 4]);
        };
        let mut header = [width.to_be_bytes(), height.to_be_bytes()].concat();
        header.extend([depth, color, 0, 0, 0]);
        chunk(b"IHDR", &header);
        chunk(b"tEXt", b"made by hand");
        let mut packed = ZlibEncoder::new(Vec::new(), Compression::default());
        packed.write_all(rows).unwrap();
        let packed = packed.finish().unwrap();
        let (first, second) = packed.split_at(packed.len() / 2);
        chunk(b"IDAT", first);
        chunk(b"IDAT", second);
        chunk(b"IEND", b"");
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
        // The second row is filtered by the one above it, the third by the pixel on its left.
        let rows = [0, 0, 51, 102, 2, 51, 51, 51, 1, 255, 0, 1];
        let picture = png(&picture([3, 3], [8, 0], &rows)).unwrap();
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
    fn samples_of_two_bytes_and_grey_colours_are_read() {
        let rows = [0, 0x12, 0x34, 0xff, 0xff, 4, 0, 0, 0, 1];
        let wide = png(&picture([2, 2], [16, 0], &rows)).unwrap();
        let [a, b] = [f64::from(0x1234) / 65535.0, 1.0];
        // Paeth's prediction is above on the left, and also on the right.
        assert_eq!(heights(&wide), [a, b, a, f64::from(0xff00) / 65535.0]);
        let grey = [0, 9, 9, 9, 255, 8, 8, 8, 255, 0, 7, 7, 7, 0, 6, 6, 6, 0];
        let colours = png(&picture([2, 2], [8, 6], &grey)).unwrap();
        assert_eq!(heights(&colours), [9.0, 8.0, 7.0, 6.0].map(|grey| grey / 255.0));
    }

    #[test]
    fn what_is_no_height_field_is_refused_in_a_sentence() {
        let of = |size, kind, rows: &[u8]| refused(png(&picture(size, kind, rows)));
        assert!(
            of([100_000, 100_000], [8, 0], &[]).starts_with("it has 100000 rows of 100000 samples; the most")
        );
        assert!(of([u32::MAX, u32::MAX], [16, 6], &[]).contains("the limit is 1000000 in all"));
        assert!(of([5, 1], [8, 0], &[]).contains("at least 2 by 2"));
        assert!(of([2, 2], [8, 3], &[]).contains("palette"));
        assert!(of([2, 2], [4, 0], &[]).contains("4 bits a sample"));
        assert!(of([2, 2], [8, 0], &[0, 1, 2]).contains("cannot be unpacked"));
        assert!(of([2, 2], [8, 0], &[9, 1, 2, 0, 0, 0]).contains("unknown filter 9"));
        assert!(of([2, 2], [8, 2], &[0, 1, 2, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0]).contains("colours"));
        // Data beyond the header's size is not decompressed: a megabyte of it is a kilobyte of file.
        assert!(png(&picture([2, 2], [8, 0], &vec![0; 1 << 20])).is_ok());
        let whole = picture([2, 2], [8, 0], &[0; 6]);
        for cut in 0..whole.len() - 12 {
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
        let many = "0 ".repeat(MOST_SAMPLES + 1);
        assert_eq!(refused(text(many.as_bytes())), "it has more than 1000000 samples");
    }
}
