//! `simctl mcp`: commands of simctl as tools of an agent, by the Model Context Protocol over stdin and stdout.
//!
//! * This file: the server, and a call of a tool.
//! * `tools`: the table of tools, their schema, and their arguments as words of a command.

mod tools;

use std::fs;

use anyhow::Context as _;
use base64::{Engine as _, prelude::BASE64_STANDARD};
use clap::Args;
use rmcp::{
    ErrorData, RoleServer, ServerHandler, ServiceExt as _,
    model::{
        CallToolRequestParams, CallToolResponse, CallToolResult, ContentBlock, Implementation,
        ListToolsResult, PaginatedRequestParams, ServerCapabilities, ServerConfig,
    },
    service::RequestContext,
    transport::stdio,
};
use tokio::sync::Mutex;

use self::tools::{TOOLS, Tool};
use super::{Arguments, perform};
use crate::{failure, options::Options, output::captured, typed};

/// Maximum length of a text, bytes: an agent reads all of it.
const MAX_TEXT: usize = 16 << 10;
const INSTRUCTIONS: &str = "\
Robots in a physics simulation. Units are SI: metres, radians, kilograms, newtons, seconds of simulated time; x y z with z \
up. Begin with `world_status` and `list_robots`. Time passes only while the world plays (`play`), or by `step`. \
`set_joint_targets` with `wait` returns when the joints are there. An error may advise a command: `simctl joint list` is the \
tool `list_joints`.";

/// An agent gets tools to see and to move robots. Its program starts `simctl mcp` and speaks over stdin and stdout.
#[derive(Args, Debug)]
pub(crate) struct Mcp {
    /// Only tools that change nothing. A token of a viewer enforces the same at the daemon
    #[arg(long)]
    read_only: bool,
}

/// Serves tools until stdin ends. The options choose the daemon and the token of all calls.
pub(super) async fn run(arguments: &Mcp, options: Options) -> anyhow::Result<()> {
    let agent = Agent { options, read_only: arguments.read_only, turn: Mutex::default() };
    let service =
        agent.serve(stdio()).await.context("the agent does not speak the Model Context Protocol")?;
    service.waiting().await?;
    Ok(())
}

struct Agent {
    options: Options,
    read_only: bool,
    /// Calls are made one after the other, in the order in which they arrive.
    turn: Mutex<()>,
}

impl Agent {
    fn tools(&self) -> impl Iterator<Item = &'static Tool> {
        let read_only = self.read_only;
        TOOLS.iter().filter(move |tool| tool.reads || !read_only)
    }

    /// Runs the command of a tool. Returns its text and its picture.
    async fn call(&self, request: CallToolRequestParams) -> anyhow::Result<Vec<ContentBlock>> {
        let tool = self.tools().find(|tool| tool.name == request.name);
        let tool = tool.with_context(|| format!("there is no tool {:?} here", request.name))?;
        let mut words = tool.words(&request.arguments.unwrap_or_default())?;
        let folder = if tool.draws { Some(tempfile::tempdir()?) } else { None };
        let picture = folder.as_ref().map(|folder| folder.path().join("picture.png"));
        if let Some(picture) = &picture {
            words.insert(tool.command.len(), format!("--file={}", picture.display()));
        }
        let typed = std::iter::once("simctl".to_owned()).chain(words).map(Into::into).collect();
        let Arguments { command, .. } = typed::command(typed).map_err(anyhow::Error::msg)?;
        let (result, mut text) = captured(perform(command, &self.options)).await;
        if let Err(error) = result {
            text += &failure::text(&error);
            anyhow::bail!(shortened(text));
        }
        Ok(vec![match picture {
            Some(picture) => ContentBlock::image(BASE64_STANDARD.encode(fs::read(picture)?), "image/png"),
            None => ContentBlock::text(shortened(text)),
        }])
    }
}

impl ServerHandler for Agent {
    fn get_info(&self) -> ServerConfig {
        let mut config = ServerConfig::new(ServerCapabilities::builder().enable_tools().build());
        config.server_info = Implementation::new("simctl", simd_client::PROGRAM_VERSION.as_str());
        config.with_instructions(INSTRUCTIONS)
    }

    async fn list_tools(
        &self,
        _page: Option<PaginatedRequestParams>,
        _context: RequestContext<RoleServer>,
    ) -> Result<ListToolsResult, ErrorData> {
        Ok(ListToolsResult::with_all_items(self.tools().map(Tool::described).collect()))
    }

    async fn call_tool(
        &self,
        request: CallToolRequestParams,
        context: RequestContext<RoleServer>,
    ) -> Result<CallToolResponse, ErrorData> {
        let _turn = self.turn.lock().await;
        // On the heap: the future of all commands is large for a worker's stack.
        let called = context.ct.run_until_cancelled(Box::pin(self.call(request))).await;
        let called = called.unwrap_or_else(|| Err(anyhow::anyhow!("the call was cancelled")));
        let result = match called {
            Ok(content) => CallToolResult::success(content),
            Err(error) => CallToolResult::error(vec![ContentBlock::text(format!("{error:#}"))]),
        };
        Ok(result.into())
    }
}

/// Returns the beginning of a long text, and says so.
fn shortened(mut text: String) -> String {
    let length = text.len();
    if length > MAX_TEXT {
        text.truncate(text.floor_char_boundary(MAX_TEXT));
        text += &format!("\n... {} bytes more: ask for one robot, joint or sensor", length - text.len());
    }
    text
}
