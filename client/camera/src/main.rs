//! simd-camera: draws the pictures of a world's cameras. It is a client of the daemon. So it may run on
//! another machine, and several share the work. This file goes from options to an exit code.
//!
//! * `options`: the command line.
//! * `work`: the loop, which asks for pictures to draw. `task`: converts tasks to scenes, and pictures to
//!   answers.
//! * `appearance`: appearance of robots, from the daemon. `glb`, `images`: readers of its files.
//!   `primitives`: triangles of primitives.
//! * `scene`: contents of a picture. `drawing`: the thread that draws it. `draw`: the renderer. `gpu`: the
//!   device. None of them knows the daemon.

mod appearance;
mod draw;
mod drawing;
mod glb;
mod gpu;
mod images;
mod options;
mod primitives;
mod scene;
mod task;
mod work;

use std::io::{self, IsTerminal as _, Write as _};
use std::process::ExitCode;
use std::time::Duration;

use anyhow::Context as _;
use clap::Parser as _;
use tokio::sync::oneshot;
use tracing_subscriber::EnvFilter;

use draw::Renderer;
use drawing::Drawing;
use gpu::Gpu;
use options::Options;
use work::Work;

/// Bytes.
const MIB: u64 = 1 << 20;

/// Longest wait for the end of a picture that is being drawn.
const LAST_PICTURE: Duration = Duration::from_secs(5);

fn main() -> ExitCode {
    let options = Options::parse();
    if options.man {
        // If stdout is closed, the error cannot be reported.
        let _ = options::write_manual(&mut io::stdout());
        return ExitCode::SUCCESS;
    }
    log();
    match run(&options) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            let sentence = format!("{error:#}");
            // If stderr is closed, the error cannot be reported.
            let _ = writeln!(io::stderr(), "simd-camera: {}", simd_client::printable_lines(&sentence));
            ExitCode::FAILURE
        }
    }
}

/// Logs to stderr, at the level in `RUST_LOG`.
fn log() {
    let filter =
        EnvFilter::try_from_default_env().unwrap_or_else(|_| EnvFilter::new("warn,simd_camera=info"));
    let log = tracing_subscriber::fmt().with_env_filter(filter).with_writer(io::stderr);
    // Colours only for terminals.
    log.with_ansi(io::stderr().is_terminal()).init();
}

fn run(options: &Options) -> anyhow::Result<()> {
    // Before the connection: users without a GPU learn of it at once.
    let mut gpu = Gpu::open(options.adapter.as_deref())?;
    gpu.smooths = gpu.smooths && options.smooth.unwrap_or(!gpu.is_software);
    tracing::info!("drawing with {}", gpu.name);
    let renderer = Renderer::new(gpu).context("the Vulkan device cannot be used")?;
    let (drawing, drawn) = Drawing::start(renderer).context("the thread that draws cannot be started")?;
    let work = Work {
        endpoint: options.endpoint(),
        connect: options.connect()?,
        name: options.name(),
        workers: usize::from(options.at_once),
        mesh_bytes: u64::from(options.memory) * MIB,
        once: options.once,
    };
    // Zenoh needs this flavor; long work runs on separate threads.
    let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build();
    let runtime = runtime.context("no runtime")?;
    let ended = runtime.block_on(async {
        tokio::select! {
            ended = work::run(work, drawing) => ended,
            interrupted = tokio::signal::ctrl_c() => Ok(interrupted?),
            closed = end_of_stdin(), if options.until_stdin_closes => Ok(closed?),
        }
    });
    // A process that ends while a driver draws may crash.
    drop(runtime);
    let _ = drawn.recv_timeout(LAST_PICTURE);
    ended
}

/// Reads stdin to its end on a separate thread, which the process does not wait for.
async fn end_of_stdin() -> io::Result<()> {
    let (ended, end) = oneshot::channel();
    std::thread::Builder::new().name("simd-stdin".into()).spawn(move || {
        let _ = io::copy(&mut io::stdin().lock(), &mut io::sink());
        let _ = ended.send(());
    })?;
    // If the thread ends without a word, stdin cannot be read either.
    let _ = end.await;
    Ok(())
}
