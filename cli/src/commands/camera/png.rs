//! Writes pictures as PNG files (ISO/IEC 15948): colours with 8 bits, and grey with 16.

use std::io::{self, Write as _};

use flate2::{Compression, Crc, write::ZlibEncoder};

const SIGNATURE: [u8; 8] = *b"\x89PNG\r\n\x1a\n";

/// Format of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Pixels {
    /// Red, green and blue, a byte each.
    Color,
    /// 16 bits, big-endian.
    Grey,
}

/// Returns the file of a picture with consecutive rows.
pub(super) fn write(width: u32, height: u32, pixels: Pixels, rows: &[u8]) -> io::Result<Vec<u8>> {
    let (bits, color_type, bytes) = match pixels {
        Pixels::Color => (8, 2, 3),
        Pixels::Grey => (16, 0, 2),
    };
    let mut header = Vec::new();
    header.extend_from_slice(&width.to_be_bytes());
    header.extend_from_slice(&height.to_be_bytes());
    header.extend_from_slice(&[bits, color_type, 0, 0, 0]);
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::fast());
    for row in rows.chunks(bytes * (width as usize).max(1)) {
        // Each row begins with its filter: none.
        encoder.write_all(&[0])?;
        encoder.write_all(row)?;
    }
    let mut file = SIGNATURE.to_vec();
    chunk(&mut file, *b"IHDR", &header);
    chunk(&mut file, *b"IDAT", &encoder.finish()?);
    chunk(&mut file, *b"IEND", &[]);
    Ok(file)
}

fn chunk(file: &mut Vec<u8>, name: [u8; 4], data: &[u8]) {
    let mut sum = Crc::new();
    sum.update(&name);
    sum.update(data);
    file.extend_from_slice(&u32::try_from(data.len()).unwrap_or(u32::MAX).to_be_bytes());
    file.extend_from_slice(&name);
    file.extend_from_slice(data);
    file.extend_from_slice(&sum.sum().to_be_bytes());
}

#[cfg(test)]
mod tests {
    use std::io::Read as _;

    use flate2::read::ZlibDecoder;

    use super::*;

    #[test]
    fn a_file_has_the_chunks_and_rows_of_its_picture() {
        let file = write(2, 2, Pixels::Color, &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]).unwrap();
        assert_eq!(file[..8], SIGNATURE);
        assert_eq!(file[8..29], [0, 0, 0, 13, b'I', b'H', b'D', b'R', 0, 0, 0, 2, 0, 0, 0, 2, 8, 2, 0, 0, 0]);
        // The end chunk and its checksum are the same in every PNG.
        assert_eq!(file[file.len() - 12..], *b"\0\0\0\0IEND\xaeB`\x82");
        let length = u32::from_be_bytes(file[33..37].try_into().unwrap()) as usize;
        assert_eq!(file[37..41], *b"IDAT");
        let mut rows = Vec::new();
        ZlibDecoder::new(&file[41..41 + length]).read_to_end(&mut rows).unwrap();
        assert_eq!(rows, [0, 1, 2, 3, 4, 5, 6, 0, 7, 8, 9, 10, 11, 12]);
        let grey = write(1, 1, Pixels::Grey, &[1, 2]).unwrap();
        assert_eq!(grey[24..26], [16, 0]);
    }
}
