//! Transports: TLS, Zenoh, ROS 2.

use crate::config::key::{Access, Key};
use crate::config::ros2::{Distro, MAX_DOMAIN_ID, MAX_RATE};

pub(super) fn keys() -> Vec<Key> {
    [tls(), zenoh(), ros2()].into_iter().flatten().collect()
}

fn tls() -> Vec<Key> {
    vec![
        Key::new(
            "tls.certificate",
            "certificate of the daemon",
            Access::File(|draft| &mut draft.certificate),
        )
        .flag("tls-certificate")
        .example("\"/var/lib/simd/tls/server.pem\""),
        Key::new("tls.key", "private key of the certificate", Access::File(|draft| &mut draft.key))
            .flag("tls-key")
            .example("\"/var/lib/simd/tls/server.key\""),
        Key::new(
            "tls.client_authorities",
            "authorities of clients' certificates; clients then need one",
            Access::File(|draft| &mut draft.client_authorities),
        )
        .flag("tls-client-authorities")
        .example("\"/var/lib/simd/tls/ca.pem\""),
    ]
}

fn zenoh() -> Vec<Key> {
    vec![
        Key::new(
            "zenoh.listen",
            "locators to listen on, or `off`; port 0 takes a free one. Left out: `tcp/127.0.0.1:7447`, or none if \
             there are routers to join",
            Access::Texts(
                |draft| draft.config.zenoh.listen.clone().unwrap_or_default(),
                |draft, locators| draft.config.zenoh.set_listen(locators),
            ),
        )
        .flag("zenoh")
        .example("[\"tcp/127.0.0.1:7447\"]"),
        Key::new(
            "zenoh.connect",
            "routers to join",
            Access::Texts(
                |draft| draft.config.zenoh.connect.clone(),
                |draft, locators| draft.config.zenoh.set_connect(locators),
            ),
        )
        .flag("zenoh-connect")
        .example("[\"tls/router.lab:7447\"]"),
        Key::new(
            "zenoh.config",
            "file with settings of Zenoh (JSON5), which override the daemon's",
            Access::File(|draft| &mut draft.config.zenoh.file),
        )
        .flag("zenoh-config")
        .example("\"zenoh.json5\""),
        Key::new(
            "zenoh.state_rate",
            "maximum number of published joint states per second; 0 disables them",
            Access::Number(
                0.0..=crate::config::zenoh::MAX_STATE_RATE,
                |draft| draft.config.zenoh.state_rate,
                |draft, rate| {
                    draft.config.zenoh.state_rate = rate;
                    Ok(())
                },
            ),
        ),
        Key::new(
            "zenoh.enabled",
            "whether the daemon is served over Zenoh",
            Access::Switch(
                |draft| draft.config.zenoh.enabled,
                |draft, enabled| draft.config.zenoh.enabled = enabled,
            ),
        ),
    ]
}

fn ros2() -> Vec<Key> {
    vec![
        Key::new(
            "ros2.enabled",
            "whether the daemon joins the graph as a node",
            Access::Switch(
                |draft| draft.config.ros2.enabled,
                |draft, enabled| draft.config.ros2.enabled = enabled,
            ),
        )
        .flag("ros2"),
        Key::new(
            "ros2.router",
            "locator of `rmw_zenohd`",
            Access::Text(
                |draft| draft.config.ros2.router.clone(),
                |draft, router| draft.config.ros2.set_router(router),
            ),
        ),
        Key::new(
            "ros2.domain_id",
            "`ROS_DOMAIN_ID`",
            Access::Count(0..=MAX_DOMAIN_ID.into(), |draft| &mut draft.config.ros2.domain_id),
        ),
        Key::new(
            "ros2.namespace",
            "prefix of the names of topics and services: `/`, or words like `/lab/cell_1`",
            Access::Text(
                |draft| draft.config.ros2.namespace.clone(),
                |draft, namespace| draft.config.ros2.set_namespace(namespace),
            ),
        ),
        Key::new(
            "ros2.plain_names",
            "robot whose topics have plain names such as `/joint_states`: `first`, the first one with joints; `none`; or \
             `robot:NAME`. The topics of all others begin with their name",
            Access::Text(
                |draft| draft.config.ros2.plain_names(),
                |draft, names| draft.config.ros2.set_plain_names(&names),
            ),
        ),
        Key::new(
            "ros2.distro",
            "distribution of the other nodes",
            Access::Word(
                &Distro::NAMES,
                |draft| draft.config.ros2.distro.name(),
                |draft, name| {
                    draft.config.ros2.distro = Distro::named(&name).unwrap_or(draft.config.ros2.distro);
                    Ok(())
                },
            ),
        ),
        Key::new(
            "ros2.rate",
            "maximum number of states of each topic per second",
            Access::Number(
                0.001..=MAX_RATE,
                |draft| draft.config.ros2.rate,
                |draft, rate| {
                    draft.config.ros2.rate = rate;
                    Ok(())
                },
            ),
        ),
    ]
}
