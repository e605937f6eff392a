//! The front-end without a network: requests into the routes, answers out of them.

use axum::http::HeaderMap;
use simd_core::simulation::WorldLimits;
use simd_core::{PhysicsSettings, Simulation};
use tonic::codegen::Service as _;
use tonic::service::Routes;

use super::*;
use crate::convert::test_world::spawn;
use crate::driver;
use crate::handle::{DaemonInfo, Limits, RunState, Transport};
use crate::loading::Loader;

/// The routes of a daemon with `arm`, as they are where no viewer was built.
async fn routes() -> Router {
    let limits = Limits::default();
    let world = Simulation::new(PhysicsSettings::default(), WorldLimits::default());
    let driver =
        driver::start(world, driver::Config { state: RunState::Paused, ..Default::default() }).unwrap();
    let info = DaemonInfo { name: "test".into(), version: "0.0.0", limits };
    let handle = SimHandle::new(driver, Loader::new(limits, &[]).unwrap(), info);
    handle.command(spawn("arm", &[])).await.unwrap();
    let services: Routes = crate::service::routes(&handle, Transport::Grpc);
    let settings = Settings { bundle: Bundle::fallback(), hosts: Hosts::default() };
    beside(services.into_axum_router(), &handle, settings)
}

async fn get(routes: &mut Router, path: &str) -> (StatusCode, HeaderMap, String) {
    let request = Request::builder().uri(path).header(header::HOST, "localhost").body(Body::empty()).unwrap();
    let response = routes.call(request).await.unwrap();
    let (parts, body) = response.into_parts();
    let bytes = axum::body::to_bytes(body, 1 << 20).await.unwrap();
    (parts.status, parts.headers, String::from_utf8(bytes.to_vec()).unwrap())
}

#[tokio::test]
async fn without_the_viewer_a_page_has_the_tables_and_says_how_to_get_it() {
    let mut routes = routes().await;
    let (status, headers, page) = get(&mut routes, "/").await;
    assert_eq!(
        (status, &headers[header::CONTENT_TYPE]),
        (StatusCode::OK, &"text/html; charset=utf-8".parse().unwrap())
    );
    assert!(page.contains("make build") && page.contains("Node"), "{page}");
    // What the policy forbids is not there.
    assert!(!page.contains("<style") && !page.contains("style=") && !page.contains("onclick"), "{page}");
    assert!(page.split("<script").skip(1).all(|script| script.contains("src=")), "{page}");
    for path in ["/style.css", "/page.js", "/robots"] {
        assert!(page.contains(&format!("\"{path}\"")), "{path}");
        assert_eq!(get(&mut routes, path).await.0, StatusCode::OK, "{path}");
    }
    assert!(get(&mut routes, "/page.js").await.2.contains("\"/robots\""));
}

#[tokio::test]
async fn a_robot_whose_description_is_not_kept_has_none() {
    let mut routes = routes().await;
    let (status, _, sentence) = get(&mut routes, "/robots/arm/robot.urdf").await;
    assert_eq!(status, StatusCode::NOT_FOUND);
    assert!(sentence.contains("no longer kept"), "{sentence}");
}
