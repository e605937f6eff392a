//! Generates the Rust code of the schema: messages and services, the compiled schema, and the tables of
//! `proto/src/checked.rs` and `proto/src/proof.rs`. Run it with `make schema`.

mod shapes;

use std::error::Error;
use std::fs;
use std::path::{Path, PathBuf};

use prost::Message as _;
use sha2::{Digest as _, Sha256};

fn main() -> Result<(), Box<dyn Error>> {
    let proto = Path::new(env!("CARGO_MANIFEST_DIR")).parent().ok_or("the generator is not in proto")?;
    let generated = proto.join("src/generated");
    let mut schema: Vec<PathBuf> =
        fs::read_dir(proto.join("simd/v1"))?.map(|entry| Ok(entry?.path())).collect::<Result<_, Box<dyn Error>>>()?;
    schema.retain(|path| path.extension().is_some_and(|extension| extension == "proto"));
    schema.sort();

    let descriptors = protox::compile(&schema, [proto])?;
    fs::create_dir_all(&generated)?;
    fs::write(generated.join("simd.v1.bin"), descriptors.encode_to_vec())?;
    fs::write(generated.join("shapes.rs"), shapes::generate(&descriptors))?;
    fs::write(generated.join("claiming.rs"), shapes::generate_claiming(&descriptors))?;
    tonic_prost_build::configure()
        .out_dir(&generated)
        .server_mod_attribute(".", "#[cfg(feature = \"server\")]")
        .client_mod_attribute(".", "#[cfg(feature = \"client\")]")
        .build_transport(false)
        // Ordered maps, so that equal messages have equal bytes.
        .btree_map(".")
        // Requests are checked before they are decoded.
        .codec_path("crate::checked::CheckedCodec")
        .compile_fds(descriptors)?;
    fs::write(generated.join("digest"), digest(proto)? + "\n")?;
    Ok(())
}

/// Returns the SHA-256, in hexadecimal, of the schema, of this generator and of its output.
/// `proto/src/lib.rs` computes the same in a test.
fn digest(proto: &Path) -> Result<String, Box<dyn Error>> {
    let mut files = Vec::new();
    for folder in ["simd/v1", "generate/src", "src/generated"] {
        for entry in fs::read_dir(proto.join(folder))? {
            files.push(entry?.path());
        }
    }
    files.retain(|path| path.file_name().is_some_and(|name| name != "digest"));
    files.push(proto.join("generate/Cargo.lock"));
    files.sort();
    let mut hash = Sha256::new();
    for file in files {
        hash.update(Sha256::digest(fs::read(file)?));
    }
    Ok(hash.finalize().iter().map(|byte| format!("{byte:02x}")).collect())
}
