//! Checks whether the viewer was built, since it becomes part of the binary.

use std::fs;
use std::path::Path;

/// Output folder of `npm run build` in `client/web`.
const VIEWER: &str = "../client/web/dist";
/// If it is 1, a build without the viewer fails.
const REQUIRED: &str = "SIMD_REQUIRE_VIEWER";

fn main() -> Result<(), String> {
    println!("cargo:rerun-if-env-changed={REQUIRED}");
    let viewer = Path::new(VIEWER);
    // Without the folder, Cargo would rebuild each time.
    let _ = fs::create_dir_all(viewer);
    if viewer.is_dir() {
        println!("cargo:rerun-if-changed={VIEWER}");
    }
    let is_required = std::env::var(REQUIRED).is_ok_and(|said| said == "1");
    if is_required && !viewer.join("index.html").is_file() {
        return Err(format!(
            "{REQUIRED} is 1, and {VIEWER}/index.html is not there: build the viewer first, with `make web` (it \
             needs Node 20)"
        ));
    }
    Ok(())
}
