//! The page in the browser, as files in memory: the viewer that was built into this binary, or a simpler
//! page.

use std::borrow::Cow;
use std::collections::BTreeMap;

use axum::body::Body;
use axum::http::header::{self, HeaderValue};
use axum::http::{HeaderMap, Response, StatusCode};
use bytes::Bytes;
use rust_embed::RustEmbed;

use super::caching;

/// Output of `npm run build` in `client/web`, if it was run.
#[derive(RustEmbed)]
#[folder = "../client/web/dist"]
#[allow_missing = true]
struct Viewer;

const INDEX: &str = "index.html";

/// Files by their path below `/`.
#[derive(Clone, Debug, Default)]
pub struct Bundle {
    files: BTreeMap<String, File>,
}

#[derive(Clone, Debug)]
struct File {
    bytes: Bytes,
    /// Bytes as `Content-Encoding: gzip`.
    gzip: Option<Bytes>,
    /// ETag of `bytes`.
    tag: HeaderValue,
}

impl Bundle {
    /// Returns the viewer; in a binary without it, [`Bundle::fallback`].
    pub fn embedded() -> Self {
        if !Self::is_built() {
            return Self::fallback();
        }
        let file = |path: Cow<'static, str>| Some((path.to_string(), Viewer::get(&path)?.data));
        Self::of(Viewer::iter().filter_map(file))
    }

    /// Returns whether the viewer was built into this binary.
    pub fn is_built() -> bool {
        Viewer::get(INDEX).is_some()
    }

    /// Returns a page without a scene: tables of joints.
    pub fn fallback() -> Self {
        let files: [(&str, &'static [u8]); 3] = [
            (INDEX, include_bytes!("fallback/index.html")),
            ("style.css", include_bytes!("fallback/style.css")),
            ("page.js", include_bytes!("fallback/page.js")),
        ];
        Self::of(files.map(|(path, bytes)| (path.to_owned(), bytes.into())))
    }

    /// Makes a bundle of files by path. `FILE.gz` is `FILE`, compressed.
    fn of(files: impl IntoIterator<Item = (String, Cow<'static, [u8]>)>) -> Self {
        let mut all: BTreeMap<String, Bytes> = files
            .into_iter()
            .map(|(path, bytes)| match bytes {
                Cow::Borrowed(bytes) => (path, Bytes::from_static(bytes)),
                Cow::Owned(bytes) => (path, bytes.into()),
            })
            .collect();
        let compressed: Vec<String> = all.keys().filter(|path| path.ends_with(".gz")).cloned().collect();
        let mut gzips: BTreeMap<String, Bytes> = compressed
            .into_iter()
            .filter_map(|path| {
                let whole = path.strip_suffix(".gz").filter(|whole| all.contains_key(*whole))?.to_owned();
                Some((whole, all.remove(&path)?))
            })
            .collect();
        let files = all.into_iter().map(|(path, bytes)| {
            let (gzip, tag) = (gzips.remove(&path), caching::tag_of(&bytes));
            (path, File { bytes, gzip, tag })
        });
        Self { files: files.collect() }
    }

    /// Returns the answer to a request for `/PATH`; `None` if there is no such file. The path is looked up in
    /// the table unchanged, and is never a path of a disk.
    pub(super) fn answer(&self, path: &str, asked: &HeaderMap) -> Option<Response<Body>> {
        let path = if path.is_empty() { INDEX } else { path };
        let file = self.files.get(path)?;
        let mut response = Response::new(Body::empty());
        let headers = response.headers_mut();
        headers.insert(header::ETAG, file.tag.clone());
        // The build tool adds a hash of the content to the names of all files except the page itself.
        let lasts = if path.starts_with("assets/") { caching::IMMUTABLE } else { caching::CHECKED };
        headers.insert(header::CACHE_CONTROL, HeaderValue::from_static(lasts));
        headers.insert(header::CONTENT_TYPE, HeaderValue::from_static(media_type(path)));
        headers.insert(header::VARY, HeaderValue::from_static("accept-encoding"));
        if caching::has(asked, &file.tag) {
            *response.status_mut() = StatusCode::NOT_MODIFIED;
            return Some(response);
        }
        let bytes = match file.gzip.as_ref().filter(|_| caching::takes_gzip(asked)) {
            Some(gzip) => {
                headers.insert(header::CONTENT_ENCODING, HeaderValue::from_static("gzip"));
                gzip
            }
            None => &file.bytes,
        };
        *response.body_mut() = Body::from(bytes.clone());
        Some(response)
    }
}

/// Returns the media type by the extension of a file's name.
fn media_type(path: &str) -> &'static str {
    match path.rsplit_once('.').map(|(_, extension)| extension) {
        Some("html") => "text/html; charset=utf-8",
        Some("js" | "mjs") => "text/javascript; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("json" | "map") => "application/json",
        Some("webmanifest") => "application/manifest+json",
        Some("svg") => "image/svg+xml",
        Some("png") => "image/png",
        Some("ico") => "image/x-icon",
        Some("woff2") => "font/woff2",
        Some("wasm") => "application/wasm",
        Some("txt") => "text/plain; charset=utf-8",
        _ => "application/octet-stream",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bundle() -> Bundle {
        let files: [(&str, &'static [u8]); 5] = [
            ("index.html", b"<page>"),
            ("assets/app-1a2b.js", b"code"),
            ("assets/app-1a2b.js.gz", b"packed"),
            ("assets/logo.png", b"pixels"),
            ("lonely.gz", b"archive"),
        ];
        Bundle::of(files.map(|(path, bytes)| (path.to_owned(), bytes.into())))
    }

    fn asked(headers: &[(header::HeaderName, &'static str)]) -> HeaderMap {
        headers.iter().map(|(name, value)| (name.clone(), HeaderValue::from_static(value))).collect()
    }

    async fn text(response: Response<Body>) -> String {
        let bytes = axum::body::to_bytes(response.into_body(), 1000).await.unwrap();
        String::from_utf8(bytes.to_vec()).unwrap()
    }

    #[tokio::test]
    async fn a_file_comes_compressed_to_those_who_take_it() {
        let path = "assets/app-1a2b.js";
        let plain = bundle().answer(path, &HeaderMap::new()).unwrap();
        assert_eq!(plain.headers().get(header::CONTENT_ENCODING), None);
        assert_eq!(text(plain).await, "code");
        let gzip = asked(&[(header::ACCEPT_ENCODING, "br, gzip;q=0.8")]);
        let packed = bundle().answer(path, &gzip).unwrap();
        assert_eq!(packed.headers()[header::CONTENT_ENCODING], "gzip");
        assert_eq!(packed.headers()[header::CONTENT_TYPE], "text/javascript; charset=utf-8");
        assert_eq!(text(packed).await, "packed");
        let none = asked(&[(header::ACCEPT_ENCODING, "gzip;q=0, identity")]);
        assert_eq!(text(bundle().answer(path, &none).unwrap()).await, "code");
        assert!(bundle().answer("assets/app-1a2b.js.gz", &gzip).is_none());
        assert_eq!(text(bundle().answer("lonely.gz", &gzip).unwrap()).await, "archive");
    }

    #[tokio::test]
    async fn hashed_files_last_and_the_page_is_checked() {
        let lasts = |path: &str| {
            let response = bundle().answer(path, &HeaderMap::new()).unwrap();
            response.headers()[header::CACHE_CONTROL].to_str().unwrap().to_owned()
        };
        assert!(lasts("assets/app-1a2b.js").contains("immutable"));
        assert_eq!(lasts(""), "no-cache");
        let page = bundle().answer("", &HeaderMap::new()).unwrap();
        let tag = page.headers()[header::ETAG].clone();
        assert_eq!(text(page).await, "<page>");
        let known = HeaderMap::from_iter([(header::IF_NONE_MATCH, tag)]);
        let same = bundle().answer("index.html", &known).unwrap();
        assert_eq!(same.status(), StatusCode::NOT_MODIFIED);
        assert_eq!(text(same).await, "");
    }

    #[test]
    fn only_what_is_in_the_table_is_there() {
        for path in ["nothing", "assets", "assets/", "../Cargo.toml", "assets/../index.html", "/index.html"] {
            assert!(bundle().answer(path, &HeaderMap::new()).is_none(), "{path}");
        }
        for path in ["", "style.css", "page.js"] {
            assert!(Bundle::fallback().answer(path, &HeaderMap::new()).is_some(), "{path}");
        }
    }
}
