//! Caching by browsers, and their accepted encodings.

use axum::http::HeaderMap;
use axum::http::header::{self, HeaderValue};
use simd_model::robot::Sha256;

/// For content that never changes at its address.
pub(super) const IMMUTABLE: &str = "public, max-age=31536000, immutable";
/// For content that browsers must request each time, with the tag that they know.
pub(super) const CHECKED: &str = "no-cache";

/// Returns an `ETag` of the content.
pub(super) fn tag_of(bytes: &[u8]) -> HeaderValue {
    tag(&Sha256::of(bytes).to_string())
}

/// Returns an `ETag` of this text, which has only letters and digits.
pub(super) fn tag(text: &str) -> HeaderValue {
    HeaderValue::from_str(&format!("\"{text}\"")).unwrap_or_else(|_| HeaderValue::from_static("\"\""))
}

/// Returns whether a request already knows the content with this tag.
pub(super) fn has(asked: &HeaderMap, tag: &HeaderValue) -> bool {
    let known = asked.get_all(header::IF_NONE_MATCH).iter().filter_map(|known| known.to_str().ok());
    let mut known = known.flat_map(|known| known.split(',')).map(|known| known.trim());
    known.any(|known| known == "*" || known.trim_start_matches("W/").as_bytes() == tag.as_bytes())
}

/// Returns whether a request accepts gzip.
pub(super) fn takes_gzip(asked: &HeaderMap) -> bool {
    let lists = asked.get_all(header::ACCEPT_ENCODING).iter().filter_map(|list| list.to_str().ok());
    lists.flat_map(|list| list.split(',')).any(|choice| {
        let (name, weight) = choice.split_once(';').unwrap_or((choice, ""));
        let weight = weight.trim().strip_prefix("q=").map_or(Ok(1.0), str::parse::<f64>);
        name.trim().eq_ignore_ascii_case("gzip") && weight.is_ok_and(|weight| weight > 0.0)
    })
}
