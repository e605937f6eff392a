//! A daemon whose memory is limited: what clients ask for beyond it is refused, and the world is saved.

use simd_client::Package;
use simd_client::proto::ErrorReason;
use simd_tests::process::{Home, Process, soon};

/// Enough for a daemon and some uploads.
const LIMIT: u64 = 192 << 20;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn calls_beyond_the_memory_limit_are_refused_and_the_world_is_saved() {
    let home = Home::new();
    let file = home.path().join("world.simdstate");
    let flags = [format!("service.memory_limit={LIMIT}"), format!("autosave.file={}", file.display())];
    let flags = flags.iter().flat_map(|flag| ["--set", flag.as_str()]);
    let daemon = Process::start(["--config", "tests/assets/demo.toml"].into_iter().chain(flags)).await;
    let client = daemon.client().await;
    let mut refused = None;
    for number in 0..40_u8 {
        let folder = home.path().join(format!("robot{number}"));
        std::fs::create_dir(&folder).unwrap();
        // Binary STL with one triangle, and many bytes after it that differ from file to file.
        let mut mesh = vec![number; 8 << 20];
        mesh[80..84].copy_from_slice(&1_u32.to_le_bytes());
        std::fs::write(folder.join("part.stl"), mesh).unwrap();
        let link = r#"<visual><geometry><mesh filename="part.stl"/></geometry></visual>"#;
        std::fs::write(
            folder.join("robot.urdf"),
            format!("<robot name=\"r\"><link name=\"l\">{link}</link></robot>"),
        )
        .unwrap();
        let package = Package::open(folder.join("robot.urdf")).unwrap();
        if let Err(error) = client.upload(&package).await {
            refused = Some(error);
            break;
        }
    }
    let Some(refused) = refused else { panic!("no upload was refused") };
    assert_eq!(refused.reason(), Some(ErrorReason::LimitExceeded), "{refused}");
    assert!(refused.to_string().contains("service.memory_limit"), "{refused}");
    // The daemon continues, and so do calls that take no memory.
    client.pause().await.unwrap();
    soon("the world in a file", async {
        while !file.exists() {
            tokio::task::yield_now().await;
        }
    })
    .await;
}
