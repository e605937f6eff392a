//! Compiles `simd/v1/*.proto` with protox, so that no `protoc` is needed.

#[path = "build/shapes.rs"]
mod shapes;

use std::{env, error::Error, fs, path::PathBuf};

use prost::Message as _;

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo:rerun-if-changed=simd");
    println!("cargo:rerun-if-changed=build");
    let mut files: Vec<PathBuf> =
        fs::read_dir("simd/v1")?.map(|entry| entry.map(|e| e.path())).collect::<Result<_, _>>()?;
    files.retain(|path| path.extension().is_some_and(|ext| ext == "proto"));
    files.sort();

    let descriptors = protox::compile(&files, ["."])?;
    let out = PathBuf::from(env::var("OUT_DIR")?);
    fs::write(out.join("simd.v1.bin"), descriptors.encode_to_vec())?;
    fs::write(out.join("shapes.rs"), shapes::generate(&descriptors))?;
    fs::write(out.join("claiming.rs"), shapes::generate_claiming(&descriptors))?;
    tonic_prost_build::configure()
        .build_server(env::var_os("CARGO_FEATURE_SERVER").is_some())
        .build_client(env::var_os("CARGO_FEATURE_CLIENT").is_some())
        .build_transport(false)
        // Ordered maps, so that equal messages have equal bytes.
        .btree_map(".")
        // Requests are weighed before they are decoded.
        .codec_path("crate::checked::CheckedCodec")
        .compile_fds(descriptors)?;
    Ok(())
}
