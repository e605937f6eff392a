//! Headers of pictures on meshes. Pictures are only decoded where they are drawn.

use std::sync::Arc;

use crate::limits;
use crate::robot::{Image, ImageKind, Sha256};

/// Returns a picture that browsers can draw. The error is a fragment of a sentence.
pub(crate) fn check(sha256: Sha256, bytes: Arc<[u8]>) -> Result<Image, String> {
    if bytes.len() > limits::IMAGE_BYTES {
        return Err(format!("it has {} bytes; the limit is {}", bytes.len(), limits::IMAGE_BYTES));
    }
    let (kind, size) = header(&bytes)?;
    let [width, height] = size;
    if width == 0 || height == 0 {
        return Err("it has no pixels".to_owned());
    }
    let side = limits::IMAGE_SIDE;
    if width > side || height > side || u64::from(width) * u64::from(height) > limits::IMAGE_PIXELS {
        let most = limits::IMAGE_PIXELS;
        return Err(format!(
            "it has {width} by {height} pixels; the limit is {most} in all and {side} along a side"
        ));
    }
    Ok(Image { sha256, kind, size, bytes })
}

fn header(bytes: &[u8]) -> Result<(ImageKind, [u32; 2]), String> {
    if let Some(rest) = bytes.strip_prefix(b"\x89PNG\r\n\x1a\n") {
        // The header is the first chunk: its length, its name, width and height.
        let cut = "it is a PNG without a header";
        let (start, rest) = rest.split_first_chunk::<8>().ok_or(cut)?;
        if start != b"\0\0\0\x0DIHDR" {
            return Err(cut.to_owned());
        }
        let (sizes, _) = rest.as_chunks::<4>();
        let &[width, height, ..] = sizes else { return Err(cut.to_owned()) };
        return Ok((ImageKind::Png, [width, height].map(u32::from_be_bytes)));
    }
    if bytes.starts_with(b"\xFF\xD8\xFF") {
        return Ok((ImageKind::Jpeg, jpeg(bytes)?));
    }
    Err("it is neither PNG nor JPEG; convert it".to_owned())
}

/// Returns width and height of the frame (ISO/IEC 10918-1, B.2.2).
fn jpeg(bytes: &[u8]) -> Result<[u32; 2], String> {
    let cut = "it is a JPEG without a header";
    let mut rest = bytes.get(2..).ok_or(cut)?;
    while let [0xFF, marker, after @ ..] = rest {
        match marker {
            // Fill bytes before the marker.
            0xFF => {
                rest = rest.get(1..).unwrap_or_default();
                continue;
            }
            // Markers without data.
            0x01 | 0xD0..=0xD8 => {
                rest = after;
                continue;
            }
            _ => {}
        }
        let (length, _) = after.split_first_chunk::<2>().ok_or(cut)?;
        let length = usize::from(u16::from_be_bytes(*length));
        let is_frame = matches!(marker, 0xC0..=0xCF) && !matches!(marker, 0xC4 | 0xC8 | 0xCC);
        if is_frame {
            let Some(&[h0, h1, w0, w1]) = after.get(3..7) else { break };
            return Ok([[w0, w1], [h0, h1]].map(u16::from_be_bytes).map(u32::from));
        }
        if length < 2 {
            break;
        }
        rest = after.get(length..).ok_or(cut)?;
    }
    Err(cut.to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(bytes: &[u8]) -> Result<Image, String> {
        check(Sha256::of(bytes), Arc::from(bytes))
    }

    fn png(width: u32, height: u32) -> Vec<u8> {
        let start = b"\x89PNG\r\n\x1a\n\0\0\0\x0DIHDR".to_vec();
        [start, width.to_be_bytes().to_vec(), height.to_be_bytes().to_vec(), b"\x08\x02\0\0\0".to_vec()]
            .concat()
    }

    const JPEG: &[u8] =
        b"\xFF\xD8\xFF\xE0\0\x04ab\xFF\xFF\xDB\0\x02\xFF\xC2\0\x0B\x08\0\x03\0\x05\x01\x01\x11\0";

    #[test]
    fn the_header_says_the_kind_and_the_pixels() {
        let image = read(&png(3, 5)).unwrap();
        assert_eq!((image.kind, image.size), (ImageKind::Png, [3, 5]));
        let image = read(JPEG).unwrap();
        assert_eq!((image.kind, image.size), (ImageKind::Jpeg, [5, 3]));
    }

    #[test]
    fn a_picture_that_unpacks_beyond_the_limit_is_refused_by_its_header() {
        for (width, height) in [(8193, 1), (1, u32::MAX), (8192, 8192)] {
            let why = read(&png(width, height)).unwrap_err();
            assert!(why.starts_with(&format!("it has {width} by {height} pixels; the limit is")), "{why}");
        }
        assert_eq!(read(&png(0, 4)).unwrap_err(), "it has no pixels");
        let large = [png(1, 1), vec![0; limits::IMAGE_BYTES]].concat();
        assert!(read(&large).unwrap_err().contains("bytes; the limit is"));
    }

    #[test]
    fn truncated_files_and_other_files_are_refused() {
        for end in 0..24 {
            read(&png(3, 5)[..end]).unwrap_err();
        }
        // The sizes of the frame end there.
        for end in 0..22 {
            read(&JPEG[..end]).unwrap_err();
        }
        assert_eq!(read(b"GIF89a").unwrap_err(), "it is neither PNG nor JPEG; convert it");
        read(b"\xFF\xD8\xFF\xE0\0\0").unwrap_err();
    }
}
