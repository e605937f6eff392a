//! `simctl context`: the daemons of the configuration file.

use anyhow::Context as _;
use clap::Subcommand;
use serde::Serialize;

use crate::{
    candidates,
    configuration::{Configuration, configuration_path, read},
    context::{choose, use_context},
    credentials::{self, Source},
    failure::warn,
    options::Options,
    output::{
        Output, View,
        number::ABSENT,
        table::{Column, Page, Table},
    },
};

#[derive(Debug, Subcommand)]
pub(crate) enum Context {
    /// Shows the daemons of the configuration file, and the selected one
    List,
    /// Shows the selected daemon, its settings, and their source
    Show,
    /// Selects the default context of the configuration file
    Use {
        /// Name of the context
        #[arg(add = candidates::contexts())]
        name: String,
    },
}

pub(crate) fn run(command: &Context, options: &Options, output: Output) -> anyhow::Result<()> {
    match command {
        Context::List => list(options, output),
        Context::Show => show(options, output),
        Context::Use { name } => {
            let path =
                configuration_path().context("there is no home directory for the configuration file")?;
            let endpoint = use_context(&path, name)?;
            output.one(&Used { context: name.clone(), endpoint })?;
            let choice = choose(options)?;
            if choice.source != format!("context {name}") {
                warn(&format!("{} overrides it: simctl uses {}", choice.source, choice.endpoint));
            }
            Ok(())
        }
    }
}

fn list(options: &Options, output: Output) -> anyhow::Result<()> {
    let configuration = read(configuration_path().as_deref())?;
    let choice = match choose(options) {
        // An unknown context must not hide the others.
        Err(_) if options.context.is_none() => None,
        choice => Some(choice?),
    };
    let dangling = configuration.context.clone().filter(|name| !configuration.contexts.contains_key(name));
    let source = choice.as_ref().map(|choice| choice.source.clone()).unwrap_or_default();
    let Configuration { contexts, .. } = configuration;
    let mut contexts: Vec<ContextView> = contexts
        .into_iter()
        .map(|(name, daemon)| ContextView {
            is_used: source == format!("context {name}"),
            name: Some(name),
            endpoint: daemon.endpoint,
            source: "configuration".to_owned(),
        })
        .collect();
    match choice {
        Some(choice) if !contexts.iter().any(|context| context.is_used) => contexts.push(ContextView {
            name: None,
            endpoint: choice.endpoint,
            source: choice.source,
            is_used: true,
        }),
        _ => {}
    }
    output.list(&contexts, page)?;
    if let (Some(name), None) = (dangling, &options.context) {
        warn(&format!(
            "the configuration file chooses `{name}`, which it does not define: choose another with `simctl \
             context use`"
        ));
    }
    Ok(())
}

fn show(options: &Options, output: Output) -> anyhow::Result<()> {
    let choice = choose(options)?;
    let token = credentials::token(options, &choice)?.map(|(_, source)| source);
    let connect = credentials::connect_options(options, &choice)?;
    let path = configuration_path();
    let is_there = path.as_ref().is_some_and(|path| path.exists());
    output.one(&Shown {
        endpoint: choice.endpoint,
        source: choice.source,
        token: token.map(Source::name),
        tls_authorities: connect.tls_authorities.map(|path| path.display().to_string()),
        configuration: path.filter(|_| is_there).map(|path| path.display().to_string()),
    })
}

#[derive(Serialize)]
struct ContextView {
    /// Null for an endpoint without a context.
    name: Option<String>,
    endpoint: String,
    /// `configuration`, `--endpoint`, `SIMD_ENDPOINT` or `default`.
    source: String,
    is_used: bool,
}

fn page(contexts: &[ContextView]) -> Page {
    let columns = ["USED", "CONTEXT", "ENDPOINT", "FROM"].map(Column::left).into();
    let row = |context: &ContextView| {
        vec![
            if context.is_used { "*" } else { "" }.to_owned(),
            context.name.clone().unwrap_or_else(|| ABSENT.to_owned()),
            context.endpoint.clone(),
            context.source.clone(),
        ]
    };
    Page::new().table(Table::new(columns, contexts.iter().map(row).collect()))
}

/// `context show`.
#[derive(Serialize)]
struct Shown {
    endpoint: String,
    /// `--endpoint`, `SIMD_ENDPOINT`, `context NAME` or `default`.
    source: String,
    /// Source of the token; null if none. The token itself is not shown.
    token: Option<&'static str>,
    tls_authorities: Option<String>,
    /// Configuration file, if it exists.
    configuration: Option<String>,
}

impl View for Shown {
    fn page(&self) -> Page {
        let or_absent = |text: &Option<String>| text.clone().unwrap_or_else(|| ABSENT.to_owned());
        Page::new().pairs([
            ("endpoint", self.endpoint.clone()),
            ("from", self.source.clone()),
            ("token", self.token.map_or_else(|| "none".to_owned(), |source| format!("from {source}"))),
            ("authorities", or_absent(&self.tls_authorities)),
            ("configuration", or_absent(&self.configuration)),
        ])
    }
}

/// `context use`.
#[derive(Serialize)]
struct Used {
    context: String,
    endpoint: String,
}

impl View for Used {
    fn page(&self) -> Page {
        Page::of_line(format!("simctl uses {}, at {}", self.context, self.endpoint))
    }
}
