//! Churn: robots, worlds, claims, parameters, uploads and clients that are added and deleted. Each has a
//! unique name, so that anything that the daemon keeps by name shows as growth.

use std::ops::Range;
use std::time::{Duration, Instant};

use fastrand::Rng;
use simd_client::proto::entity_service_client::EntityServiceClient;
use simd_client::proto::primitive::Geometry;
use simd_client::proto::{self, ClaimJointsRequest, NameTakenPolicy, description_source::Source};
use simd_client::{Client, Error, Package, Target, every_joint, joint_target, slide};
use tokio::task::JoinSet;
use tokio::time::timeout;
use tonic::transport::Channel;

use super::Stage;
use crate::daemon::fixed;
use crate::http;
use crate::robots::assets;

/// Number of clients that add and delete all the time.
pub(super) const CHURNS: usize = 2;
const SECOND: Duration = Duration::from_secs(1);

/// Clients of these numbers, until then.
pub(super) fn start(stage: &Stage, numbers: Range<usize>, ends: Instant, actors: &mut JoinSet<()>) {
    for number in numbers {
        let stage = stage.clone();
        actors.spawn(async move {
            let connected = async {
                let channel = Channel::from_shared(stage.endpoint.clone()).ok()?.connect().await.ok()?;
                Some((stage.client(number).await.ok()?, EntityServiceClient::new(channel)))
            };
            let Some((client, raw)) = connected.await else {
                return stage.tally.fail("the churn cannot connect".to_owned());
            };
            let client = client.with_name("churn");
            let mut churn =
                Churn { stage, client, raw, random: Rng::with_seed(number as u64), number, turn: 0 };
            while Instant::now() < ends {
                churn.turn().await;
            }
        });
    }
}

struct Churn {
    stage: Stage,
    client: Client,
    /// For unfinished uploads.
    raw: EntityServiceClient<Channel>,
    random: Rng,
    number: usize,
    turn: u64,
}

impl Churn {
    async fn turn(&mut self) {
        self.turn += 1;
        let world = self.stage.world.clone();
        if self.turn % 20 == 10 {
            let _no_checks = world.write().await;
            self.worlds().await;
            return;
        }
        let _no_restores = world.read().await;
        // Each kind once, so that a run of seconds on a slow machine has seen them all.
        let kind = if self.turn < 10 { self.turn - 1 } else { self.random.u64(0..9) };
        match kind {
            0 => self.robots().await,
            1 => self.shapes().await,
            2 => self.claims().await,
            3 => self.parameters().await,
            4 => self.uploads().await,
            5 => self.visitors().await,
            6 => self.refusals().await,
            7 => self.gone_callers().await,
            _ => self.readings().await,
        }
    }

    fn name(&self, what: &str) -> String {
        format!("{what}_{}_{}", self.number, self.turn)
    }

    fn note<T>(&self, kind: &'static str, result: Result<T, Error>) -> Option<T> {
        self.stage.tally.note(kind, result)
    }

    /// After an acknowledged spawn or deletion.
    async fn check_robot(&self, robot: &str, is_there: bool) {
        let Some(robots) = self.note("robots", self.client.robots().await) else { return };
        if robots.iter().any(|it| it.name == robot) != is_there {
            let what = if is_there { "spawned" } else { "deleted" };
            self.stage.tally.fail(format!("{robot} was {what}, and the list of robots says otherwise"));
        }
    }

    /// Deletes until the robot is gone. A call may be refused, for instance while the world is claimed; the
    /// world would fill with overlapping robots.
    async fn delete(&self, robot: &str) {
        while self.note("delete", self.client.delete_robot(robot).await).is_none() {
            let there = self.note("robots", self.client.robots().await);
            if !self.stage.is_on() || there.is_some_and(|robots| robots.iter().all(|it| it.name != robot)) {
                return;
            }
            tokio::time::sleep(SECOND / 10).await;
        }
        self.check_robot(robot, false).await;
    }

    /// A robot with meshes comes, is moved, loaded again and taken out.
    async fn robots(&mut self) {
        let robot = self.name("visitor");
        let package = assets().join("Two Link.v2");
        let pose = Some(self.pose());
        let request = proto::SpawnEntityRequest { pose, ..fixed(&robot) };
        if self.note("spawn", self.client.load(&package, request).await).is_none() {
            return;
        }
        self.check_robot(&robot, true).await;
        let target = joint_target("elbow joint", Target::position(self.random.f64()));
        self.note("targets", self.client.set_robot_targets(&robot, [target]).await);
        self.note("reset joints", self.client.reset_joints(&robot, Vec::new()).await);
        let reload = proto::ReloadEntityRequest { robot: robot.clone(), ..Default::default() };
        self.note("reload", self.client.reload_from(&package, reload).await);
        let states = self.note("joint states", self.client.joint_states(Vec::new()).await);
        let sequence = states.and_then(|states| states.stamp);
        let after = sequence.map_or(0, |stamp| stamp.sequence + 50);
        self.note("next states", self.client.next_states(after, SECOND, Vec::new()).await);
        self.delete(&robot).await;
    }

    fn pose(&mut self) -> proto::Pose {
        let mut at = || 5.0 + 20.0 * self.random.f64();
        let position = Some(proto::Vector3 { x: at(), y: at(), z: at() });
        proto::Pose { position, ..Default::default() }
    }

    /// Returns a request for a fixed robot at a place that no other has.
    fn aside(&self, robot: &str) -> proto::SpawnEntityRequest {
        let position = Some(proto::Vector3 { x: 0.0, y: -5.0 - 2.0 * self.number as f64, z: 0.0 });
        let pose = Some(proto::Pose { position, ..Default::default() });
        proto::SpawnEntityRequest { pose, ..fixed(robot) }
    }

    /// Balls and boxes that fall, some of them onto each other.
    async fn shapes(&mut self) {
        let size = Some(proto::Vector3 { x: 0.2, y: 0.2, z: 0.2 });
        let mut names = Vec::new();
        let pose = self.pose();
        for (at, geometry) in [
            (0.0, Geometry::Box(proto::BoxGeometry { size })),
            (0.25, Geometry::Sphere(proto::SphereGeometry { radius: 0.1 })),
        ] {
            let mut pose = pose;
            if let Some(position) = &mut pose.position {
                position.z += at;
            }
            let primitive = proto::Primitive { geometry: Some(geometry), mass: 1.0, color: None };
            let source =
                proto::DescriptionSource { source: Some(Source::Primitive(primitive)), ..Default::default() };
            let request = proto::SpawnEntityRequest {
                name: self.name("shape"),
                allow_renaming: true,
                source: Some(source),
                pose: Some(pose),
                ..Default::default()
            };
            if let Some(spawned) = self.note("spawn", self.client.spawn(request).await) {
                names.push(spawned.entity.name);
            }
        }
        for name in names {
            self.delete(&name).await;
        }
    }

    /// The world is saved, changed and restored; its file is exported and imported.
    async fn worlds(&mut self) {
        let (kept, robot) = (self.name("world"), self.name("passing"));
        self.note("save", self.client.save_state(&kept).await);
        let package = assets().join("Bench_Arm-1.2 rev B");
        self.note("spawn", self.client.load(&package, self.aside(&robot)).await);
        if self.turn % 100 == 10
            && let Ok(folder) = tempfile::tempdir()
        {
            let (file, other) = (folder.path().join("world"), self.name("import"));
            self.note("export", self.client.export_saved_state(&kept, &file).await);
            self.note("import", self.client.import_saved_state(&file, &other).await);
            self.note("delete state", self.client.delete_saved_state(&other).await);
        }
        // Others hold claims on robots meanwhile.
        let world = ClaimJointsRequest { world: true, holder: self.name("operator"), ..Default::default() };
        let Some(secret) = self.note("claim the world", self.client.claim(world).await) else { return };
        let operator = self.client.clone().with_claim(&secret);
        if self.note("restore", operator.restore_state(&kept).await).is_some() {
            self.check_robot(&robot, false).await;
        }
        self.note("delete state", self.client.delete_saved_state(&kept).await);
        self.note("pause", operator.pause().await);
        self.note("step", operator.step(5).await);
        self.note("play", operator.play().await);
        self.note("release", operator.release_joints(&secret).await);
    }

    /// Claims that are refused, released, and left to run out.
    async fn claims(&mut self) {
        let writer = || vec![every_joint("writer_0")];
        self.note("claim", self.client.claim_joints(writer(), "other", SECOND).await);
        let robot = self.name("claimed");
        let package = assets().join("Bench_Arm-1.2 rev B");
        if self.note("spawn", self.client.load(&package, self.aside(&robot)).await).is_none() {
            return;
        }
        let holder = self.name("holder");
        let claimed = self.client.claim_joints(vec![every_joint(&robot)], &holder, SECOND).await;
        if let Some(secret) = self.note("claim", claimed)
            && self.random.bool()
        {
            self.note("release", self.client.release_joints(&secret).await);
        }
        // If it was not released, the claim expires first.
        self.delete(&robot).await;
    }

    async fn parameters(&mut self) {
        let (name, value) = (self.name("slider"), self.random.f64());
        let refuse = NameTakenPolicy::Refuse;
        self.note("add parameter", self.client.add_slider(&name, (0.0, 1.0), 0.5, refuse).await);
        self.note("add parameter", self.client.add_slider(&name, (0.0, 1.0), 0.5, refuse).await);
        if self.note("set parameter", self.client.set_parameters([slide(&name, value)]).await).is_some()
            && let Some(list) = self.note("parameters", self.client.parameters(vec![name.clone()]).await)
        {
            let is_set = |it: &proto::Parameter| matches!(&it.kind, Some(proto::parameter::Kind::Slider(slider)) if slider.value == value);
            if !list.parameters.iter().any(is_set) {
                self.stage.tally.fail(format!("{name} was set to {value}, and is {:?}", list.parameters));
            }
        }
        self.note("remove parameter", self.client.remove_parameters(vec![name]).await);
    }

    /// Refused files, and files whose last part never comes.
    async fn uploads(&mut self) {
        let refused = proto::DescriptionSource {
            source: Some(Source::Urdf(format!("<robot name='r{}'><link", self.turn).into())),
            ..Default::default()
        };
        let request = proto::SpawnEntityRequest { source: Some(refused), ..fixed("refused") };
        self.note("spawn", self.client.spawn(request).await);
        // A robot of a unique text, which is never spawned.
        let urdf = format!("<robot name='r'><link name='{}'/></robot>", self.name("link"));
        let prepare = proto::PrepareDescriptionRequest { urdf: urdf.into(), ..Default::default() };
        let prepared = self.raw.prepare_description(prepare).await;
        self.stage.tally.note_status("prepare", prepared);
        let hash = format!("{:064x}", self.random.u128(..));
        let mut data = vec![0; 256 << 10];
        self.random.fill(&mut data);
        let part = proto::UploadAssetRequest { sha256: hash, total_bytes: 1 << 20, offset: 0, data };
        let sent = self.raw.upload_asset(part).await;
        self.stage.tally.note_status("part of an upload", sent);
        // A whole one, with the hash of another.
        let mut data = vec![0; 1 << 10];
        self.random.fill(&mut data);
        let sha256 = "0".repeat(64);
        let part = proto::UploadAssetRequest { sha256, total_bytes: 1 << 10, offset: 0, data };
        let sent = self.raw.upload_asset(part).await;
        if self.stage.tally.note_status("a false upload", sent).is_some() {
            self.stage.tally.fail("a file was taken whose hash is another's".to_owned());
        }
    }

    /// New clients, each with a unique name, over each transport, and a browser.
    async fn visitors(&mut self) {
        for transport in 0..3 {
            let Some(client) = self.note("connect", self.stage.client(transport).await) else { continue };
            let client = client.with_name(&self.name("guest"));
            self.note("robots", client.robots().await);
            self.note("clients", client.clients().await);
        }
        for path in ["/", "/robots", "/nowhere"] {
            http::get(self.stage.address, path, &[]).await;
        }
    }

    async fn refusals(&mut self) {
        let missing = self.name("missing");
        let target = || [joint_target("shoulder", Target::position(0.1))];
        self.note("targets", self.client.set_robot_targets(&missing, target()).await);
        self.note("targets", self.client.set_robot_targets("writer_0", target()).await);
        self.note("delete", self.client.delete_robot(&missing).await);
        self.note("restore", self.client.restore_state(&missing).await);
        self.note("release", self.client.release_joints(&missing).await);
        self.note("step", self.client.step(u64::MAX).await);
    }

    /// Calls whose caller leaves before the answer.
    async fn gone_callers(&mut self) {
        let moment = Duration::from_millis(self.random.u64(0..20));
        let _ = timeout(moment, self.client.next_states(u64::MAX, 30 * SECOND, Vec::new())).await;
        let _ = timeout(moment, self.client.next_parameters(u64::MAX, 30 * SECOND)).await;
        let package = Package::open(assets().join("Two Link.v2"));
        if let Ok(package) = package {
            let _ = timeout(moment, self.client.upload(&package)).await;
        }
    }

    async fn readings(&mut self) {
        self.note("scene", self.client.scene(&[]).await);
        self.note("link poses", self.client.link_poses(&[]).await);
        self.note("layout", self.client.joint_layout("writer_0").await);
        self.note("clients", self.client.clients().await);
        self.note("statistics", self.client.world_statistics().await);
    }
}
