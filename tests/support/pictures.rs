//! Pictures for tests, byte by byte.

/// Returns a grey PNG with this many bits a pixel, whose compressed rows are these bytes. Its checksums are
/// wrong, and are not checked.
///
/// # Panics
/// Panics if there are 4 GiB of them.
#[allow(clippy::unwrap_used, reason = "the test has failed")]
pub fn grey_png(bits: u8, [width, height]: [u32; 2], packed: &[u8]) -> Vec<u8> {
    let mut bytes = b"\x89PNG\r\n\x1a\n".to_vec();
    let header = [&width.to_be_bytes()[..], &height.to_be_bytes(), &[bits, 0, 0, 0, 0]].concat();
    for (kind, data) in [(b"IHDR", header.as_slice()), (b"IDAT", packed), (b"IEND", b"")] {
        bytes.extend(u32::try_from(data.len()).unwrap().to_be_bytes());
        bytes.extend(kind);
        bytes.extend(data);
        bytes.extend([0; 4]);
    }
    bytes
}
