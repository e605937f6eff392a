//! Selection of the token: --token-file, else SIMD_TOKEN, else the context's, else one that a person types.

use std::io::{self, IsTerminal as _};

use anyhow::{Context as _, bail};
use simd_client::{Client, ConnectOptions, Error, Token, proto::ErrorReason};

use crate::{context::Choice, options::Options};

/// Source of a token.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Source {
    Flag,
    Environment,
    Context,
}

impl Source {
    /// Returns its name, for people.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Flag => "--token-file",
            Self::Environment => "SIMD_TOKEN",
            Self::Context => "the context",
        }
    }
}

/// Returns the options of a connection: flags override the environment, which overrides the context.
pub(crate) fn connect_options(options: &Options, choice: &Choice) -> anyhow::Result<ConnectOptions> {
    let default = ConnectOptions::default();
    let authorities = options.tls_ca.clone().or(default.tls_authorities);
    Ok(ConnectOptions {
        token: token(options, choice)?.map(|(token, _)| token),
        tls_authorities: authorities.or(choice.tls_authorities.clone()),
        tls_certificate: options.tls_client_cert.clone().or(default.tls_certificate),
        tls_key: options.tls_client_key.clone().or(default.tls_key),
        connect_timeout: options.timeout.min(default.connect_timeout),
        timeout: options.timeout,
    })
}

/// Returns the given token, with its source.
pub(crate) fn token(options: &Options, choice: &Choice) -> anyhow::Result<Option<(Token, Source)>> {
    let environment = ConnectOptions::default().token;
    Ok(match (&options.token_file, environment, &choice.token) {
        (Some(path), _, _) => Some((Token::from_file(path)?, Source::Flag)),
        (None, Some(token), _) => Some((token, Source::Environment)),
        (None, None, Some(token)) => Some((Token::from(token.clone()), Source::Context)),
        (None, None, None) => None,
    })
}

/// Connects. If the daemon asks for a token and none is given, asks the user for it.
pub(crate) async fn connect(options: &Options, choice: &Choice) -> anyhow::Result<Client> {
    let mut connect = connect_options(options, choice)?;
    let client = Client::connect_with(&choice.endpoint, connect.clone()).await?;
    // A script must not hang at a question.
    if connect.token.is_some() || !io::stdin().is_terminal() || !io::stderr().is_terminal() {
        return Ok(client);
    }
    match client.simulator_info().await {
        Err(Error::Refused(refusal)) if refusal.reason == ErrorReason::Unauthenticated => {
            connect.token = Some(ask(&choice.endpoint).await?);
            Ok(Client::connect_with(&choice.endpoint, connect).await?)
        }
        // The command itself reports other errors.
        _ => Ok(client),
    }
}

/// Asks a person for a token, which is not shown.
async fn ask(endpoint: &str) -> anyhow::Result<Token> {
    let question = format!("token for {}: ", simd_client::printable(endpoint));
    let typed = tokio::task::spawn_blocking(move || rpassword::prompt_password(question)).await?;
    let typed = typed.context("cannot ask for a token")?;
    match typed.trim() {
        "" => bail!("no token was typed"),
        token => Ok(Token::from(token.to_owned())),
    }
}

#[cfg(test)]
mod tests {
    use clap::Parser as _;

    use super::*;
    use crate::commands::Arguments;

    #[test]
    fn the_flag_beats_the_context() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("token");
        std::fs::write(&path, "simd_1\n").unwrap();
        let line = format!("simctl robot list --token-file {}", path.display());
        let options = Arguments::try_parse_from(line.split(' ')).unwrap().options;
        let choice = Choice {
            endpoint: "lab".into(),
            token: Some("simd_2".into()),
            tls_authorities: None,
            source: "context lab".into(),
        };
        assert_eq!(token(&options, &choice).unwrap().unwrap().1, Source::Flag);
    }
}
