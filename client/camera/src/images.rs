//! Decodes PNG and JPEG files of textures.

use jpeg_decoder::PixelFormat;

use crate::scene::Image;

/// Maximum number of pixels of an image; the daemon has a separate, smaller limit.
const MAX_PIXELS: u64 = 32 << 20;

/// Reads an image by its first bytes. The error is a fragment of a sentence.
pub(crate) fn read(bytes: &[u8]) -> Result<Image, String> {
    if bytes.starts_with(b"\x89PNG") {
        png(bytes)
    } else if bytes.starts_with(b"\xff\xd8") {
        jpeg(bytes)
    } else {
        Err("it is neither PNG nor JPEG".to_owned())
    }
}

fn png(bytes: &[u8]) -> Result<Image, String> {
    let unreadable = |error: png::DecodingError| format!("its PNG cannot be read: {error}");
    let mut decoder = png::Decoder::new(std::io::Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::normalize_to_color8() | png::Transformations::ALPHA);
    let mut reader = decoder.read_info().map_err(unreadable)?;
    let (width, height) = (reader.info().width, reader.info().height);
    bounded(width, height)?;
    let size = reader.output_buffer_size().ok_or("its PNG is too large")?;
    let mut pixels = vec![0; size];
    let frame = reader.next_frame(&mut pixels).map_err(unreadable)?;
    pixels.truncate(frame.buffer_size());
    let rgba = match frame.color_type {
        png::ColorType::GrayscaleAlpha => {
            pixels.chunks_exact(2).flat_map(|pixel| [pixel[0], pixel[0], pixel[0], pixel[1]]).collect()
        }
        _ => pixels,
    };
    whole(width, height, rgba)
}

fn jpeg(bytes: &[u8]) -> Result<Image, String> {
    let unreadable = |error: jpeg_decoder::Error| format!("its JPEG cannot be read: {error}");
    let mut decoder = jpeg_decoder::Decoder::new(bytes);
    decoder.read_info().map_err(unreadable)?;
    let info = decoder.info().ok_or("its JPEG has no header")?;
    let (width, height) = (u32::from(info.width), u32::from(info.height));
    bounded(width, height)?;
    let pixels = decoder.decode().map_err(unreadable)?;
    let opaque = u8::MAX;
    let rgba = match info.pixel_format {
        PixelFormat::RGB24 => pixels.chunks_exact(3).flat_map(|at| [at[0], at[1], at[2], opaque]).collect(),
        PixelFormat::L8 => pixels.iter().flat_map(|at| [*at, *at, *at, opaque]).collect(),
        PixelFormat::L16 => pixels.chunks_exact(2).flat_map(|at| [at[1], at[1], at[1], opaque]).collect(),
        // Adobe's programs write it inverted.
        PixelFormat::CMYK32 => pixels
            .chunks_exact(4)
            .flat_map(|at| {
                let part = |ink: u8| u8::try_from(u16::from(ink) * u16::from(at[3]) / 255).unwrap_or(opaque);
                [part(at[0]), part(at[1]), part(at[2]), opaque]
            })
            .collect(),
    };
    whole(width, height, rgba)
}

fn bounded(width: u32, height: u32) -> Result<(), String> {
    if width == 0 || height == 0 || u64::from(width) * u64::from(height) > MAX_PIXELS {
        return Err(format!("it has {width} x {height} pixels; the limit is {MAX_PIXELS} in all"));
    }
    Ok(())
}

fn whole(width: u32, height: u32, rgba: Vec<u8>) -> Result<Image, String> {
    if rgba.len() as u64 != 4 * u64::from(width) * u64::from(height) {
        return Err("its pixels do not match its header".to_owned());
    }
    Ok(Image { width, height, rgba })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn encoded(width: u32, height: u32, color: png::ColorType, pixels: &[u8]) -> Vec<u8> {
        let mut file = Vec::new();
        let mut encoder = png::Encoder::new(&mut file, width, height);
        encoder.set_color(color);
        encoder.set_depth(png::BitDepth::Eight);
        encoder.write_header().unwrap().write_image_data(pixels).unwrap();
        file
    }

    #[test]
    fn pngs_of_each_kind_become_four_bytes_a_pixel() {
        for (color, pixels, expected) in [
            (png::ColorType::Rgb, &[1, 2, 3, 4, 5, 6][..], [1, 2, 3, 255, 4, 5, 6, 255]),
            (png::ColorType::Rgba, &[1, 2, 3, 4, 5, 6, 7, 8], [1, 2, 3, 4, 5, 6, 7, 8]),
            (png::ColorType::Grayscale, &[9, 8], [9, 9, 9, 255, 8, 8, 8, 255]),
            (png::ColorType::GrayscaleAlpha, &[9, 8, 7, 6], [9, 9, 9, 8, 7, 7, 7, 6]),
        ] {
            let image = read(&encoded(2, 1, color, pixels)).unwrap();
            assert_eq!((image.width, image.height, image.rgba.as_slice()), (2, 1, &expected[..]));
        }
    }

    #[test]
    fn other_files_than_images_are_refused_with_a_reason() {
        assert_eq!(read(b"GIF89a").unwrap_err(), "it is neither PNG nor JPEG");
        let file = encoded(2, 1, png::ColorType::Rgb, &[1, 2, 3, 4, 5, 6]);
        for length in 4..file.len() - 12 {
            assert!(read(&file[..length]).is_err(), "{length}");
        }
        assert!(read(b"\xff\xd8\xff").unwrap_err().starts_with("its JPEG cannot be read"));
        let mut large = file;
        // Width in its header.
        large[16..20].copy_from_slice(&[0, 1, 0, 0]);
        large[20..24].copy_from_slice(&[0, 1, 0, 0]);
        assert!(read(&large).is_err());
    }
}
