//! Daemons for `simctl top`: the given ones, or those that can be found.

use std::time::Duration;

use simd_client::{ConnectOptions, DEFAULT_LOCATOR, DEFAULT_PORT, Network, Token, is_zenoh};
use tokio::sync::oneshot;

use super::watch::{Board, Place};
use crate::{
    configuration::{configuration_path, read},
    context::{Choice, choose, of_context},
    credentials::connect_options,
    options::Options,
};

/// Interval between searches of a network for new daemons.
const CHECK_INTERVAL: Duration = Duration::from_secs(2);

/// Begins to watch them. The future ends once each network was searched for the first time.
pub(super) fn find(
    endpoints: &[String],
    options: &Options,
    board: &Board,
) -> anyhow::Result<impl Future<Output = ()> + use<>> {
    let choice = choose(options)?;
    let connect = connect_options(options, &choice)?;
    let mut searches = Vec::new();
    let mut add = |endpoint: &str, connect: &ConnectOptions, is_default: bool| {
        // With a name it is one daemon; a name has no `#` and no Zenoh settings.
        let is_network =
            is_zenoh(endpoint) && endpoint.rsplit_once('#').is_none_or(|(_, of)| of.contains('='));
        if is_network {
            let (looked, first) = oneshot::channel();
            let search = search(board.clone(), endpoint.to_owned(), connect.clone(), is_default, looked);
            tokio::spawn(search);
            searches.push(first);
        } else {
            board.add(endpoint, Place::Endpoint(endpoint.to_owned(), connect.clone()), is_default);
        }
    };
    if !endpoints.is_empty() {
        // The token of a context is only for its own daemon.
        let said = Choice { token: None, tls_authorities: None, ..choice };
        let connect = connect_options(options, &said)?;
        endpoints.iter().for_each(|endpoint| add(endpoint, &connect, false));
    } else {
        add(&choice.endpoint, &connect, false);
        let is_unsaid = choice.source == "default" || choice.source.starts_with("context ");
        if is_unsaid && options.context.is_none() {
            let configuration = read(configuration_path().as_deref())?;
            for name in configuration.contexts.keys() {
                let other = of_context(&configuration, name)?;
                // The token of one daemon is not sent to another.
                let authorities = other.tls_authorities.or(connect.tls_authorities.clone());
                let token = other.token.map(Token::from);
                let connect = ConnectOptions { token, tls_authorities: authorities, ..connect.clone() };
                add(&other.endpoint, &connect, false);
            }
            let token = if choice.source == "default" { connect.token.clone() } else { None };
            let connect = ConnectOptions { token, ..connect };
            add(&format!("127.0.0.1:{DEFAULT_PORT}"), &connect, true);
            add(DEFAULT_LOCATOR, &connect, true);
        }
    }
    Ok(async move {
        for first in searches {
            // A search that has ended needs no wait.
            let _ = first.await;
        }
    })
}

/// Searches a network for daemons repeatedly.
async fn search(
    board: Board,
    locator: String,
    options: ConnectOptions,
    is_default: bool,
    looked: oneshot::Sender<()>,
) {
    let mut looked = Some(looked);
    let mut network: Option<Network> = None;
    loop {
        let found = async {
            let network = match &network {
                Some(network) => network,
                None => network.insert(Network::join(&locator, options.clone()).await?),
            };
            Ok::<_, simd_client::Error>((network.clone(), network.daemons().await?))
        };
        match found.await {
            Ok((network, daemons)) => {
                if !daemons.is_empty() {
                    board.remove(&locator);
                } else if !is_default {
                    board.add_lost(&locator, "no daemon is on this network");
                }
                for daemon in daemons {
                    let place = Place::Network(network.clone(), daemon.name.clone());
                    board.add(&format!("{locator}#{}", daemon.name), place, is_default);
                }
            }
            Err(error) if !is_default => board.add_lost(&locator, &error.to_string()),
            // No option asked for a network, so a failure is ignored.
            Err(_) => {}
        }
        if let Some(looked) = looked.take() {
            let _ = looked.send(());
        }
        tokio::time::sleep(CHECK_INTERVAL).await;
    }
}
