//! `simd-camera` draws the cameras of a world: the real programs, over both transports, with the Vulkan
//! device of this machine (`make vulkan` installs Mesa's software renderer).

use std::collections::BTreeMap;
use std::time::Duration;

use simd_client::proto::{
    self, CameraPicture, PicturePlane, Pose, Vector3, primitive::Geometry, sensor::Kind,
};
use simd_client::{Client, plane_bytes};
use simd_tests::process::{Home, Process, binaries, soon};
use tokio::process::Child;
use tokio::task::JoinSet;

const WIDTH: u32 = 128;
const HEIGHT: u32 = 96;
/// Red, green and blue of the crate.
const CRATE: [f64; 3] = [0.8, 0.4, 0.2];

/// A renderer. Dropping it kills it.
struct Renderer {
    child: Child,
    _home: Home,
}

impl Renderer {
    /// Returns once the daemon knows it.
    async fn start(client: &Client, endpoint: &str, name: &str) -> Self {
        let home = Home::new();
        let program = binaries().join("simd-camera");
        assert!(program.exists(), "there is no {}: `make camera` builds it", program.display());
        let mut command = home.command(program);
        command.args(["--endpoint", endpoint, "--name", name]).stderr(std::process::Stdio::inherit());
        let child = command.spawn().unwrap();
        let known = async {
            let mut looks = tokio::time::interval(Duration::from_millis(20));
            while !client.list_cameras().await.unwrap().renderers.iter().any(|renderer| renderer.name == name)
            {
                looks.tick().await;
            }
        };
        soon("a renderer", known).await;
        Self { child, _home: home }
    }
}

/// A crate of 1 m, and an arm to the left of it. The near side of the crate is 2.5 m in front of a post with
/// a camera at its middle.
async fn world(client: &Client) {
    let color = |[red, green, blue]: [f64; 3]| Some(proto::Color { red, green, blue, alpha: 1.0 });
    spawn(client, "post", 0.02, color([0.1; 3]), [0.0, 0.0, 0.5]).await;
    spawn(client, "crate", 1.0, color(CRATE), [3.0, 0.0, 0.5]).await;
    let request = proto::SpawnEntityRequest {
        name: "arm".into(),
        pose: at([3.0, 1.5, 0.0]),
        base: proto::Base::Fixed.into(),
        ..Default::default()
    };
    client
        .load(simd_tests::process::repository().join("tests/assets/Bench_Arm-1.2 rev B"), request)
        .await
        .unwrap();
    let picture = proto::Picture::ColorAndDepth.into();
    let (near, far, horizontal_field_of_view) = (0.1, 20.0, std::f64::consts::FRAC_PI_2);
    let kind =
        proto::CameraSensor { picture, width: WIDTH, height: HEIGHT, horizontal_field_of_view, near, far };
    let sensor = proto::Sensor {
        robot: "post".into(),
        name: "eye".into(),
        kind: Some(Kind::Camera(kind)),
        ..Default::default()
    };
    client.create_sensor(sensor).await.unwrap();
}

async fn spawn(client: &Client, name: &str, side: f64, color: Option<proto::Color>, position: [f64; 3]) {
    let size = Some(Vector3 { x: side, y: side, z: side });
    let geometry = Some(Geometry::Box(proto::BoxGeometry { size }));
    let primitive = proto::Primitive { geometry, mass: 1.0, color };
    let source = proto::description_source::Source::Primitive(primitive);
    let request = proto::SpawnEntityRequest {
        source: Some(proto::DescriptionSource { source: Some(source), ..Default::default() }),
        name: name.into(),
        pose: at(position),
        base: proto::Base::Fixed.into(),
        ..Default::default()
    };
    client.spawn(request).await.unwrap();
}

fn at([x, y, z]: [f64; 3]) -> Option<Pose> {
    Some(Pose { position: Some(Vector3 { x, y, z }), orientation: None })
}

/// Returns the bytes of a pixel.
fn pixel<const N: usize>(picture: &CameraPicture, plane: &Option<PicturePlane>, x: u32, y: u32) -> [u8; N] {
    let bytes = plane_bytes(picture, plane.as_ref().unwrap(), N as u64).unwrap();
    let offset = N * (y * picture.width + x) as usize;
    bytes[offset..offset + N].try_into().unwrap()
}

fn depth(picture: &CameraPicture, x: u32, y: u32) -> f64 {
    f64::from(f32::from_le_bytes(pixel(picture, &picture.depth, x, y)))
}

/// Returns the robot that is seen, and its link.
fn seen(picture: &CameraPicture, x: u32, y: u32) -> Option<(&str, u32)> {
    let number = u32::from_le_bytes(pixel(picture, &picture.segmentation, x, y));
    let has =
        |robot: &&proto::PictureRobot| (robot.first_link..robot.first_link + robot.links).contains(&number);
    let robot = picture.robots.iter().find(has);
    assert_eq!(robot.is_some(), number > 0, "{number} is of no robot");
    robot.map(|robot| (robot.robot.as_str(), number - robot.first_link))
}

#[tokio::test]
async fn a_camera_sees_a_crate_at_its_distance_and_in_its_colour() {
    let daemon = Process::start(["--paused"]).await;
    let client = daemon.client().await;
    world(&client).await;
    let _renderer = Renderer::start(&client, &daemon.endpoint, "one").await;
    let picture = client.picture("post", "eye").await.unwrap();
    assert_eq!((picture.width, picture.height, picture.renderer.as_str()), (WIDTH, HEIGHT, "one"));
    // The side is 1 m wide of the 5 m that are seen 2.5 m away: a fifth of 128 pixels about the middle.
    for (x, y) in [(53, 37), (64, 48), (75, 59)] {
        assert!((depth(&picture, x, y) - 2.5).abs() < 1e-3, "{}", depth(&picture, x, y));
        // The light comes from (-0.5, 0.3, 1), so the cosine at the side is 0.5 / 1.1576: 0.6 + 0.35 x 0.432,
        // and no gloss.
        for (part, expected) in pixel::<3>(&picture, &picture.color, x, y).iter().zip(CRATE) {
            assert!((f64::from(*part) - 255.0 * expected * 0.751).abs() <= 2.0, "{part} {expected}");
        }
    }
    for (x, y) in [(79, 48), (64, 30), (64, 66), (127, 0)] {
        assert_eq!(depth(&picture, x, y), f64::INFINITY);
        assert_eq!(pixel::<3>(&picture, &picture.color, x, y), [255; 3]);
    }
    // The crate moves nearer, and the picture shows it there.
    let request = proto::SetEntityStateRequest {
        robot: "crate".into(),
        pose: at([2.0, 0.0, 0.5]),
        ..Default::default()
    };
    client.set_robot_state(request).await.unwrap();
    client.step(3).await.unwrap();
    let nearer = client.picture("post", "eye").await.unwrap();
    assert!((depth(&nearer, 64, 48) - 1.5).abs() < 1e-3, "{}", depth(&nearer, 64, 48));
    assert_eq!(nearer.stamp.unwrap().step, 3);
}

#[tokio::test]
async fn a_picture_from_any_point_of_view_says_which_link_is_seen_over_zenoh_too() {
    let daemon = Process::start_with(["--zenoh", "tcp/127.0.0.1:0"], ["--paused"]).await;
    let client = daemon.client().await;
    world(&client).await;
    let _renderer = Renderer::start(&client, daemon.locator.as_ref().unwrap(), "far").await;
    // From 4 m above the crate and the arm, looking down, with the world's x upwards: a field of 8 m at the
    // ground.
    let mut view = vec![0.0; 16];
    for (index, number) in [(1, 1.0), (4, -1.0), (10, 1.0), (12, 1.0), (13, -3.0), (14, -4.0), (15, 1.0)] {
        view[index] = number;
    }
    let (near, far) = (0.1, 10.0);
    let mut projection = vec![0.0; 16];
    for (index, number) in [
        (0, 1.0),
        (5, 1.0),
        (10, -(far + near) / (far - near)),
        (11, -1.0),
        (14, -2.0 * far * near / (far - near)),
    ] {
        projection[index] = number;
    }
    let planes = Some(proto::PicturePlanes { color: false, depth: true, segmentation: true });
    let request =
        proto::TakePictureRequest { view, projection, width: 100, height: 100, planes, ..Default::default() };
    let picture = client.take_picture(request).await.unwrap();
    assert!(picture.color.is_none());
    // The camera is above (3, 1): the crate is 1 m to its right, and its upper side 3 m below.
    let x = 50 + (50.0 / 3.0) as u32;
    assert_eq!(seen(&picture, x, 50), Some(("crate", 0)));
    assert!((depth(&picture, x, 50) - 3.0).abs() < 1e-3, "{}", depth(&picture, x, 50));
    assert_eq!(seen(&picture, 99, 99), None);
    // The arm is half a metre to its left, and has meshes.
    let links = client.robot_info("arm").await.unwrap().links.len() as u32;
    let all = (0..100).flat_map(|y| (0..100).map(move |x| (x, y)));
    let of_arm: Vec<u32> = all
        .filter_map(|(x, y)| seen(&picture, x, y))
        .filter(|(robot, _)| *robot == "arm")
        .map(|seen| seen.1)
        .collect();
    assert!(!of_arm.is_empty() && of_arm.iter().all(|link| *link < links), "{of_arm:?}");
}

#[tokio::test]
async fn another_renderer_takes_over_where_one_dies() {
    let daemon = Process::start(["--paused"]).await;
    let client = daemon.client().await;
    world(&client).await;
    let mut first = Renderer::start(&client, &daemon.endpoint, "first").await;
    assert_eq!(client.picture("post", "eye").await.unwrap().renderer, "first");
    first.child.kill().await.unwrap();
    let _second = Renderer::start(&client, &daemon.endpoint, "second").await;
    client.step(1).await.unwrap();
    assert_eq!(client.picture("post", "eye").await.unwrap().renderer, "second");
}

/// Takes ten more cameras' pictures of the present step at once, and returns the number drawn by each
/// renderer.
async fn drawn_by(client: &Client) -> BTreeMap<String, usize> {
    client.step(1).await.unwrap();
    let mut asked = JoinSet::new();
    for camera in 0..10 {
        let client = client.clone();
        asked.spawn(async move { client.picture("post", &format!("eye_{camera}")).await.unwrap() });
    }
    let mut drawn = BTreeMap::new();
    let all = async {
        while let Some(picture) = asked.join_next().await {
            *drawn.entry(picture.unwrap().renderer).or_default() += 1;
        }
    };
    soon("ten pictures", all).await;
    drawn
}

/// Asks for ten pictures of each step until both of two programs draw some of one step.
async fn both_draw(client: &Client) {
    let shared = async {
        loop {
            let drawn = drawn_by(client).await;
            assert_eq!(drawn.values().sum::<usize>(), 10, "{drawn:?}");
            if drawn.len() == 2 {
                return;
            }
        }
    };
    soon("pictures of both", shared).await;
}

/// Over Zenoh, like several machines. No picture is lost if one of two is killed, and it draws again once it
/// is back under its name.
#[tokio::test]
async fn two_renderers_share_ten_cameras_and_one_that_died_comes_back() {
    let daemon = Process::start_with(["--zenoh", "tcp/127.0.0.1:0"], ["--paused"]).await;
    let client = daemon.client().await;
    world(&client).await;
    for camera in 0..10 {
        let picture = proto::Picture::Depth.into();
        let lens = proto::CameraSensor {
            picture,
            width: 32,
            height: 24,
            horizontal_field_of_view: 1.0,
            near: 0.1,
            far: 20.0,
        };
        let sensor = proto::Sensor {
            robot: "post".into(),
            name: format!("eye_{camera}"),
            kind: Some(Kind::Camera(lens)),
            ..Default::default()
        };
        client.create_sensor(sensor).await.unwrap();
    }
    let none = client.picture("post", "eye_3").await.unwrap_err();
    assert_eq!(none.reason(), Some(proto::ErrorReason::NoRenderer), "{none}");
    let endpoint = daemon.locator.as_ref().unwrap();
    let _one = Renderer::start(&client, endpoint, "one").await;
    let mut two = Renderer::start(&client, endpoint, "two").await;
    both_draw(&client).await;
    // Some of the ten are with it.
    let (drawn, killed) = tokio::join!(drawn_by(&client), two.child.kill());
    killed.unwrap();
    assert_eq!(drawn.values().sum::<usize>(), 10, "{drawn:?}");
    assert_eq!(drawn_by(&client).await.get("one"), Some(&10));
    let _again = Renderer::start(&client, endpoint, "two").await;
    both_draw(&client).await;
}

#[tokio::test]
async fn a_renderer_says_in_a_sentence_why_it_does_not_start() {
    let home = Home::new();
    let said = home.run("simd-camera", ["--adapter", "no such device"]).await;
    assert_eq!(said.code, 1);
    assert!(
        said.err.contains("no Vulkan device has \"no such device\" in its name; there is "),
        "{}",
        said.err
    );
    let mut command = home.command(binaries().join("simd-camera"));
    command.env("VK_DRIVER_FILES", "/none.json").env("VK_ICD_FILENAMES", "/none.json");
    let said = simd_tests::process::said("simd-camera", command).await;
    assert_eq!(said.code, 1);
    assert!(said.err.contains("no Vulkan device is here: install the driver"), "{}", said.err);
}

#[tokio::test]
async fn a_renderer_ends_with_its_stdin_if_asked() {
    let daemon = Process::start(["--paused"]).await;
    let client = daemon.client().await;
    let home = Home::new();
    let mut command = home.command(binaries().join("simd-camera"));
    command.args(["--endpoint", &daemon.endpoint, "--name", "child", "--until-stdin-closes"]);
    let mut child = command.stdin(std::process::Stdio::piped()).spawn().unwrap();
    let known = async {
        while client.list_cameras().await.unwrap().renderers.is_empty() {
            tokio::time::sleep(Duration::from_millis(20)).await;
        }
    };
    soon("a renderer", known).await;
    drop(child.stdin.take());
    assert!(soon("its end", child.wait()).await.unwrap().success());
}
