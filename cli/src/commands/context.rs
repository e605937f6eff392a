//! `simctl context`: the daemons of the configuration file.

use clap::Subcommand;
use serde::Serialize;

use crate::{
    args::Options,
    context::{choose, configuration_path, read},
    output::{
        Output,
        table::{Column, Page, Table},
    },
};

#[derive(Debug, Subcommand)]
pub(crate) enum Context {
    /// Shows the daemons of the configuration file, and which one is used
    List,
}

pub(crate) fn run(command: Context, options: &Options, output: Output) -> anyhow::Result<()> {
    let Context::List = command;
    let choice = choose(options)?;
    let configuration = read(configuration_path().as_deref())?;
    let mut contexts: Vec<ContextView> = configuration
        .contexts
        .into_iter()
        .map(|(name, daemon)| ContextView {
            is_used: choice.source == format!("context {name}"),
            name: Some(name),
            endpoint: daemon.endpoint,
            source: "configuration".to_owned(),
        })
        .collect();
    if !contexts.iter().any(|context| context.is_used) {
        contexts.push(ContextView {
            name: None,
            endpoint: choice.endpoint,
            source: choice.source,
            is_used: true,
        });
    }
    output.list(&contexts, list)
}

#[derive(Serialize)]
struct ContextView {
    /// Null for an endpoint that is no context.
    name: Option<String>,
    endpoint: String,
    /// `configuration`, `--endpoint`, `SIMD_ENDPOINT` or `default`.
    source: String,
    is_used: bool,
}

fn list(contexts: &[ContextView]) -> Page {
    let columns = ["USED", "CONTEXT", "ENDPOINT", "FROM"].map(Column::left).into();
    let row = |context: &ContextView| {
        vec![
            if context.is_used { "*" } else { "" }.to_owned(),
            context.name.clone().unwrap_or_else(|| "-".to_owned()),
            context.endpoint.clone(),
            context.source.clone(),
        ]
    };
    Page::new().table(Table::new(columns, contexts.iter().map(row).collect()))
}
