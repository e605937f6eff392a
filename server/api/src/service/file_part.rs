//! Files that go out in parts which fit a message.

/// Largest part of a file in one answer, in bytes: with what is around it, it
/// fits the 4 MiB that gRPC clients accept where nothing else is said.
const MAX_PART: u64 = (4 << 20) - (64 << 10);

/// At most `max` bytes (0: as much as fits) from `offset`; `None` beyond the end.
pub(super) fn part(file: &[u8], offset: u64, max: u64) -> Option<&[u8]> {
    let rest = file.get(usize::try_from(offset).ok()?..)?;
    let most = if max == 0 { MAX_PART } else { max.min(MAX_PART) };
    let length = usize::try_from(most).unwrap_or(usize::MAX).min(rest.len());
    rest.get(..length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_comes_in_parts_that_fit_a_message() {
        let file = vec![7_u8; MAX_PART as usize + 10];
        assert_eq!(part(&file, 0, 0).map(<[u8]>::len), Some(MAX_PART as usize));
        assert_eq!(part(&file, MAX_PART, 0).map(<[u8]>::len), Some(10));
        assert_eq!(part(&file, 0, u64::MAX).map(<[u8]>::len), Some(MAX_PART as usize));
        assert_eq!(part(&file, 3, 4).map(<[u8]>::len), Some(4));
        assert_eq!(part(&file, file.len() as u64, 0).map(<[u8]>::len), Some(0));
        assert_eq!(part(&file, file.len() as u64 + 1, 0), None);
        assert_eq!(part(&file, u64::MAX, 0), None);
    }
}
