//! Files that are sent in parts that fit a message.

use tonic::codegen::Bytes;

/// Largest part of a file in one answer, bytes. With its message, it fits the 4 MiB that gRPC clients accept
/// by default.
const MAX_PART: u64 = (4 << 20) - (64 << 10);

/// Returns at most `max` bytes (0: as many as fit) from `offset`; `None` beyond the end. The file's bytes are
/// shared and not copied.
pub(super) fn part(file: &Bytes, offset: u64, max: u64) -> Option<Bytes> {
    let first = usize::try_from(offset).ok()?;
    let rest = file.len().checked_sub(first)?;
    let most = if max == 0 { MAX_PART } else { max.min(MAX_PART) };
    let length = usize::try_from(most).unwrap_or(usize::MAX).min(rest);
    Some(file.slice(first..first + length))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_comes_in_parts_that_fit_a_message() {
        let file = Bytes::from(vec![7; MAX_PART as usize + 10]);
        assert_eq!(part(&file, 0, 0).map(|part| part.len()), Some(MAX_PART as usize));
        assert_eq!(part(&file, MAX_PART, 0).map(|part| part.len()), Some(10));
        assert_eq!(part(&file, 0, u64::MAX).map(|part| part.len()), Some(MAX_PART as usize));
        assert_eq!(part(&file, 3, 4).map(|part| part.len()), Some(4));
        assert_eq!(part(&file, file.len() as u64, 0).map(|part| part.len()), Some(0));
        assert_eq!(part(&file, file.len() as u64 + 1, 0), None);
        assert_eq!(part(&file, u64::MAX, 0), None);
    }
}
