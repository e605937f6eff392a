//! All methods of the schema, called with a token for another robot and under claims of others. Each must be
//! refused as the table of methods says, and the documents show the table.

mod requests;

use bytes::Bytes;
use prost::Message;
use simd_client::access::{Role, TOKEN_HEADER, bearer};
use simd_client::proto::NameTakenPolicy;
use simd_client::{Client, every_joint};
use simd_proto::methods::{self, Method};
use simd_proto::raw::RawCodec;
use simd_proto::v1;
use simd_tests::process::{repository, soon};
use simd_world::access::{Claims, Concern, claims_of, concern_of, role_of};
use simd_world::handle::RunState;
use tonic::codegen::http::uri::PathAndQuery;
use tonic::transport::{Channel, Endpoint};
use tonic::{Request, Status};
use tonic_types::StatusExt as _;

use self::requests::{binding, request, sensor, spawn, trajectory, weld};
use crate::security::{Guarded, guarded, of, of_arm, of_second, options};

/// Returns a paused daemon with the robots "arm" and "other", and things that hang on "other": a slider, a
/// constraint, a sensor. The world is saved as "here".
pub(crate) async fn two_robots() -> (Guarded, Client) {
    let guarded = guarded(|config, _| config.driver.state = RunState::Paused).await;
    let admin = Client::connect_with(&guarded.grpc(), options(Some(of(Role::Admin)), None)).await.unwrap();
    admin.spawn(spawn("arm")).await.unwrap();
    furnish(&admin).await;
    let added = admin.add_bound_slider("of other", (0.0, 1.0), 0.0, binding(), NameTakenPolicy::Refuse).await;
    added.unwrap();
    admin.save_state("here").await.unwrap();
    (guarded, admin)
}

async fn furnish(admin: &Client) {
    admin.spawn(spawn("other")).await.unwrap();
    admin.create_constraint(weld()).await.unwrap();
    admin.create_sensor(sensor("held")).await.unwrap();
}

pub(crate) async fn channel(guarded: &Guarded) -> Channel {
    Endpoint::from_shared(guarded.grpc()).unwrap().connect().await.unwrap()
}

/// Returns the first answer to one message, with a token.
pub(crate) async fn call(
    channel: &Channel,
    path: &'static str,
    token: &str,
    message: Vec<u8>,
) -> Result<Bytes, Status> {
    let mut grpc = tonic::client::Grpc::new(channel.clone());
    grpc.ready().await.unwrap();
    let mut request = Request::new(tokio_stream::iter([Bytes::from(message)]));
    request.metadata_mut().insert(TOKEN_HEADER, bearer(token).parse().unwrap());
    let mut answers = grpc.streaming(request, PathAndQuery::from_static(path), RawCodec).await?.into_inner();
    // A stream that only reads may have nothing to say. It was admitted.
    if path.contains("/Watch") {
        return Ok(Bytes::new());
    }
    let mut answer = answers.message().await?.unwrap_or_default();
    // Progress comes before the result.
    while path.ends_with("WithProgress")
        && let Some(next) = answers.message().await?
    {
        answer = next;
    }
    Ok(answer)
}

/// Returns the answer of a method to the token's owner, or the reason of the refusal.
async fn ask(channel: &Channel, name: &str, method: &'static Method, token: &str) -> Result<Bytes, String> {
    let answer = soon(&method.path, call(channel, &method.path, token, request(name))).await;
    let answer = answer.map_err(|status| {
        status.get_details_error_info().map_or_else(|| status.to_string(), |info| info.reason)
    })?;
    if name == "Control" {
        // A stream continues, with an error in it.
        let answer = v1::ControlResponse::decode(answer.clone()).unwrap();
        if let Some(refusal) = answer.refusal {
            let reason = refusal.reason().as_str_name();
            return Err(reason.trim_start_matches("ERROR_REASON_").to_owned());
        }
    }
    Ok(answer)
}

/// A method as the walks found it.
struct Walked {
    service: &'static str,
    name: &'static str,
    /// Whether a token for another robot was refused.
    is_refused_to_limited: bool,
    /// Places of a claim that refused it.
    claims: Vec<Place>,
}

/// Place of another client's claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    /// The joint that the requests name.
    Joint,
    /// Another joint of the robot.
    OtherJoint,
    Robot,
    World,
}

impl Place {
    const ALL: [Self; 4] = [Self::Joint, Self::OtherJoint, Self::Robot, Self::World];

    /// Returns a request for a claim there.
    fn claim(self) -> v1::ClaimJointsRequest {
        let joint = |joint: &str| v1::JointSelection { robot: "other".into(), joints: vec![joint.into()] };
        let selections = match self {
            Self::Joint => vec![joint("shoulder")],
            Self::OtherJoint => vec![joint("elbow")],
            Self::Robot => vec![every_joint("other")],
            Self::World => Vec::new(),
        };
        let (world, lease) = (self == Self::World, 3600.0);
        v1::ClaimJointsRequest { selections, world, holder: "holder".into(), lease, ..Default::default() }
    }

    /// Returns whether a claim there refuses a method with these claims.
    fn refuses(self, claims: Claims) -> bool {
        match claims {
            Claims::None => false,
            Claims::Joints => matches!(self, Self::Joint | Self::Robot),
            Claims::Robots => matches!(self, Self::Joint | Self::OtherJoint | Self::Robot),
            Claims::World => self == Self::World,
            Claims::All => true,
        }
    }
}

/// Calls all methods with a token for another robot. Returns whether each was refused.
async fn walk_with_limited_token() -> Vec<bool> {
    let (guarded, _admin) = two_robots().await;
    let channel = channel(&guarded).await;
    let mut refused = Vec::new();
    for (service, name, method) in methods::all() {
        let answer = ask(&channel, name, method, &of_arm()).await;
        let is_refused = answer.as_ref().is_err_and(|reason| reason == "ROBOT_NOT_ALLOWED");
        let concern = concern_of(service, name);
        // Robots of cameras have a separate test.
        let must_be = !matches!(concern, Concern::Nothing | Concern::Camera);
        assert_eq!(is_refused, must_be, "{service}/{name} concerns {concern}: {answer:?}");
        refused.push(is_refused);
    }
    refused
}

/// Calls all methods while another client holds a claim. Returns whether each was refused.
async fn walk_under_claim(place: Place) -> Vec<bool> {
    let (guarded, admin) = two_robots().await;
    let holder = admin.clone().with_claim(&admin.claim(place.claim()).await.unwrap());
    // Its end is refused as well.
    holder.follow_trajectory(trajectory()).await.unwrap();
    let channel = channel(&guarded).await;
    let mut refused = Vec::new();
    for (service, name, method) in methods::all() {
        let answer = ask(&channel, name, method, &of_second()).await;
        let reasons = ["JOINT_CLAIMED", "ROBOT_CLAIMED", "WORLD_CLAIMED", "WORLD_NOT_CLAIMED"];
        let is_refused = answer.as_ref().is_err_and(|reason| reasons.contains(&reason.as_str()));
        let claims = claims_of(service, name);
        let must_be = place.refuses(claims);
        assert_eq!(is_refused, must_be, "{service}/{name} under a claim on {place:?}: {answer:?}");
        // A method that is refused by other claims has a request that the world takes, or this shows nothing.
        if claims != Claims::None && !must_be {
            let answer = answer.unwrap_or_else(|reason| panic!("{service}/{name}: {reason}"));
            undo(name, &answer, &admin, &holder).await;
        }
        refused.push(is_refused);
    }
    refused
}

/// Puts back what the following methods need.
async fn undo(name: &str, answer: &Bytes, admin: &Client, holder: &Client) {
    match name {
        "ClaimJoints" => {
            let claim = v1::ClaimJointsResponse::decode(answer.clone()).unwrap().claim;
            admin.release_joints(&claim).await.unwrap();
        }
        "DeleteEntity" => furnish(admin).await,
        "DeleteConstraint" => drop(admin.create_constraint(weld()).await.unwrap()),
        // Others make no steps while there are members.
        "JoinLockstep" => {
            let left = async { while !holder.lockstep_members().await.unwrap().is_empty() {} };
            soon("the end of a membership", left).await;
        }
        _ => {}
    }
}

async fn walk() -> Vec<Walked> {
    let limited = walk_with_limited_token().await;
    let mut under = Vec::new();
    for place in Place::ALL {
        under.push((place, walk_under_claim(place).await));
    }
    let walked = methods::all().zip(limited).enumerate().map(|(index, ((service, name, _), limited))| {
        let claims = under.iter().filter(|(_, refused)| refused[index]).map(|(place, _)| *place);
        Walked { service, name, is_refused_to_limited: limited, claims: claims.collect() }
    });
    walked.collect()
}

/// Methods of a row of the table.
type Row = (&'static str, Role, Concern, bool, Claims);

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn limited_tokens_and_claims_refuse_each_method_as_the_documents_show() {
    let mut rows: Vec<(Row, Vec<String>)> = Vec::new();
    for Walked { service, name, is_refused_to_limited, claims } in walk().await {
        let declared = claims_of(service, name);
        let all = [Claims::None, Claims::Joints, Claims::Robots, Claims::World, Claims::All];
        let is_found =
            |kind: &Claims| Place::ALL.iter().all(|place| claims.contains(place) == place.refuses(*kind));
        let found = all.into_iter().find(is_found);
        assert_eq!(found, Some(declared), "{service}/{name}: {claims:?}");
        let row =
            (service, role_of(service, name), concern_of(service, name), is_refused_to_limited, declared);
        match rows.iter_mut().find(|(known, _)| *known == row) {
            Some((_, names)) => names.push(format!("`{name}`")),
            None => rows.push((row, vec![format!("`{name}`")])),
        }
    }
    rows.sort();
    let mut table = "| service | role | concerns | a token for other robots | claims of others that refuse it | methods |\n\
                     |---|---|---|---|---|---|\n"
        .to_owned();
    for ((service, role, concern, is_refused, claims), names) in rows {
        let service = service.trim_end_matches("Service");
        let limited = if is_refused { "refused" } else { "served" };
        table +=
            &format!("| {service} | `{role}` | {concern} | {limited} | {claims} | {} |\n", names.join(", "));
    }
    let document = std::fs::read_to_string(repository().join("docs/security.md")).unwrap();
    assert!(document.contains(&table), "docs/security.md must have this table:\n{table}");
}
