//! A world within another program: the daemon's world and services, without a socket.
//!
//! A call is a method's name and the bytes of its request, as over Zenoh. It passes the same services, with
//! the same checks and refusals. The calling thread executes it ([`Embedded::call`]). Reads need no other
//! thread. For commands and steps of a paused world, the caller drives the world itself
//! (`driver/callers.rs`). Long calls are begun ([`Embedded::begin`], [`Embedded::subscribe`]), and notices
//! report their results.
//!
//! * `answers`: answers of a method. `direct`: a shorter path for the calls of loops.
//! * `notices`: results of begun calls. `publications`: data of subscriptions.
//!
//! Bounded: [`UNDER_WAY`] begun calls and subscriptions, and `notices::WAITING` notices; beyond that, their
//! tasks wait until notices are read.

mod answers;
mod direct;
mod kept_step;
mod notices;
mod publications;
mod serving;
#[cfg(test)]
mod tests;

use simd_api::service::status::OrStatus as _;
use std::collections::HashMap;
use std::pin::pin;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use bytes::Bytes;
use futures_util::stream;
use simd_proto::methods::{self, Method};
use simd_proto::v1::ErrorReason;
use simd_proto::{API_VERSION_HEADER, CLIENT_HEADER};
use tokio::runtime::{Builder, Runtime};
use tokio::task::AbortHandle;
use tokio_util::sync::CancellationToken;
use tonic::metadata::{MetadataMap, MetadataValue};
use tonic::service::Routes;
use tonic::{Request, Status};

use self::answers::{Prepared, answer, late, notify_of_all, within};
use self::direct::Direct;
pub use self::kept_step::KeptStep;
pub use self::notices::{Notice, Ticket, What};
use self::notices::{Notices, Notifier};
pub use self::publications::Topic;
pub use self::serving::Served;
use self::serving::Serving;
use crate::config::{Autosave, Config};
use crate::daemon::{self, Error};
use simd_api::service::routes;
use simd_api::service::status::Explained;
use simd_api::service::transport::{in_full, with_reason};
use simd_world::SimHandle;
use simd_world::access::Access;
use simd_world::handle::{CallError, Disconnect, Transport};

/// Maximum number of begun calls and subscriptions that have not ended.
const UNDER_WAY: usize = 1024;
/// Number of threads for waiting: deadlines, begun calls, publications. Callers execute calls themselves.
const WORKERS: usize = 2;
/// Maximum number of threads for files and long computations.
const BLOCKING_THREADS: usize = 16;
/// Time between two checks whether a waiting call continues.
const CHECK_INTERVAL: Duration = Duration::from_millis(100);
/// Longest time of the last step, and of the end of a recording.
const LAST_STEP: Duration = Duration::from_millis(2000);

/// A world within this program, and its services.
#[derive(Debug)]
pub struct Embedded {
    /// `None` while it is dropped.
    runtime: Option<Runtime>,
    handle: SimHandle,
    services: Routes,
    direct: Direct,
    /// Headers of each call that describe the caller.
    said: MetadataMap,
    /// Cancelled at the end, which ends everything bound to a connection.
    connection: CancellationToken,
    state_rate: f64,
    autosave: Option<Autosave>,
    under_way: Arc<Mutex<UnderWay>>,
    notifier: Notifier,
    notices: Mutex<Notices>,
    serving: Serving,
}

/// Begun calls and subscriptions, by ticket.
#[derive(Debug, Default)]
struct UnderWay {
    tasks: HashMap<Ticket, AbortHandle>,
    given: Ticket,
}

impl Embedded {
    /// Opens a world, with the robots of its configuration. Its addresses, TLS and tokens are ignored, since
    /// there is no socket. `version` is the caller's version of the schema, `MAJOR.MINOR`, and `client` is
    /// its name for others. Do not call this within a tokio runtime: use [`SimHandle`] there.
    ///
    /// # Errors
    /// Returns an error if a folder or a robot of the configuration cannot be used, or the system refuses
    /// threads.
    pub fn start(config: Config, version: &str, client: &str) -> Result<Self, Error> {
        let mut builder = Builder::new_multi_thread();
        let builder = builder.enable_all().worker_threads(WORKERS).max_blocking_threads(BLOCKING_THREADS);
        let runtime = builder.thread_name("simd-embedded").build().map_err(Error::System)?;
        let mut config = config;
        config.driver.callers_drive = true;
        // Steps with several threads need the driver's thread; a program with one world has one thread for
        // it.
        config.driver.step_threads = config.driver.step_threads.max(1);
        let handle = runtime.block_on(open(&config))?;
        let mut said = MetadataMap::new();
        for (header, value) in [(API_VERSION_HEADER, version), (CLIENT_HEADER, client)] {
            if let Ok(value) = MetadataValue::try_from(value) {
                said.insert(header, value);
            }
        }
        let (notifier, notices) = notices::channel();
        let serving = Serving::of(&config);
        let connection = CancellationToken::new();
        Ok(Self {
            services: routes(&handle, Transport::Handle),
            direct: Direct::new(&handle, &said, client, Disconnect(connection.clone())),
            runtime: Some(runtime),
            handle,
            said,
            connection,
            state_rate: config.zenoh.state_rate,
            autosave: config.autosave,
            under_way: Arc::default(),
            notifier,
            notices: Mutex::new(notices),
            serving,
        })
    }

    /// Returns the handle on its world, for Rust programs.
    pub fn handle(&self) -> &SimHandle {
        &self.handle
    }

    /// Makes a call and waits for its answer, on this thread. `method` is `SERVICE/METHOD`, `request` its
    /// message. For a streaming method, the answer is the first one. While waiting, it checks ten times per
    /// second whether it `goes_on`.
    ///
    /// # Errors
    /// Returns the refusal of the service, `DEADLINE_EXCEEDED` if the answer takes longer than `time_limit`,
    /// or `CANCELLED` if it does not continue.
    pub fn call(
        &self,
        method: &str,
        request: Bytes,
        time_limit: Duration,
        goes_on: impl FnMut() -> bool,
    ) -> Result<Bytes, Status> {
        let method = self.find(method)?;
        let answer = async {
            match self.direct.call(method, &request).await {
                Some(answer) => answer,
                None => answer(self.prepare(method, request)).await,
            }
        };
        self.wait(answer, time_limit, goes_on)
    }

    /// Waits for an answer on this thread, as [`call`](Self::call) does.
    fn wait<A>(
        &self,
        answer: impl Future<Output = Result<A, Status>>,
        time_limit: Duration,
        mut goes_on: impl FnMut() -> bool,
    ) -> Result<A, Status> {
        let mut answer = pin!(answer);
        let runtime = self.runtime()?;
        let mut left = time_limit;
        loop {
            let turn = left.min(CHECK_INTERVAL);
            // Within the runtime, whose clock it needs.
            let answered = runtime.block_on(async { tokio::time::timeout(turn, answer.as_mut()).await });
            if let Ok(answer) = answered {
                return answer.map_err(with_reason);
            }
            left -= turn;
            if left.is_zero() {
                return Err(late(time_limit));
            }
            if !goes_on() {
                return Err(Status::cancelled("the caller does not wait any longer"));
            }
        }
    }

    /// Returns a refusal as a `google.rpc.Status` with its details, for programs in other languages.
    pub fn refusal(&self, status: &Status) -> Vec<u8> {
        in_full(status)
    }

    /// Begins a call. Its answers arrive as notices with this ticket, within `time_limit`: one answer, all
    /// answers of a stream, or a refusal. Its end follows.
    ///
    /// # Errors
    /// Returns an error if the method does not exist, or too many calls are in progress.
    pub fn begin(&self, method: &str, request: Bytes, time_limit: Duration) -> Result<Ticket, Status> {
        let prepared = self.prepare(self.find(method)?, request);
        let notifier = self.notifier.clone();
        self.spawn(move |ticket| async move {
            let outcome = match prepared.method.gives_many && !prepared.method.takes_many {
                true => notify_of_all(prepared, time_limit, ticket, &notifier).await,
                false => match within(time_limit, answer(prepared)).await {
                    Ok(answer) => {
                        notifier.notify(ticket, What::Answer(answer)).await;
                        Ok(())
                    }
                    Err(refused) => Err(refused),
                },
            };
            if let Err(status) = outcome {
                notifier.notify(ticket, What::Refused(in_full(&with_reason(status)))).await;
            }
            notifier.notify(ticket, What::Ended).await;
        })
    }

    /// Subscribes to a topic: publications arrive as notices with this ticket, until [`end`](Self::end). If
    /// notices are not read, the newest wins; a gap in the events shows in their numbers.
    ///
    /// # Errors
    /// Returns an error if too many are in progress.
    pub fn subscribe(&self, topic: Topic) -> Result<Ticket, Status> {
        let (handle, notifier, rate) = (self.handle.clone(), self.notifier.clone(), self.state_rate);
        self.spawn(move |ticket| async move {
            publications::publish(&handle, topic, rate, ticket, &notifier).await;
        })
    }

    /// Ends a subscription, or a begun call. Earlier notices of it may still arrive.
    pub fn end(&self, ticket: Ticket) {
        if let Some(task) = self.lock().tasks.remove(&ticket) {
            task.abort();
        }
    }

    /// Returns all waiting notices of calls and subscriptions, or none after `time_limit`. `None` once
    /// [`close`](Self::close) was called. One thread reads them at a time.
    pub fn next_notices(&self, time_limit: Duration) -> Option<Vec<Notice>> {
        let mut notices = self.notices.lock().unwrap_or_else(PoisonError::into_inner);
        let runtime = self.runtime.as_ref()?;
        runtime.block_on(async {
            tokio::select! {
                biased;
                () = self.connection.cancelled() => None,
                read = tokio::time::timeout(time_limit, notices.next()) => Some(read.unwrap_or_default()),
            }
        })
    }

    /// Ends the world like a draining daemon: waiting calls are refused with `SHUTTING_DOWN`, and a recording
    /// is completed.
    pub fn close(&self) {
        let was_open = !self.connection.is_cancelled();
        self.connection.cancel();
        self.handle.draining().cancel();
        // Saved once no more calls arrive.
        if let Some(runtime) = self.runtime.as_ref().filter(|_| was_open) {
            runtime.block_on(self.serving.end());
            runtime.block_on(daemon::world::save_last(self.autosave.as_ref(), &self.handle));
        }
        for (_, task) in self.lock().tasks.drain() {
            task.abort();
        }
        self.handle.end_driver();
        if let Some(runtime) = &self.runtime {
            runtime.block_on(async {
                let recording = tokio::time::timeout(LAST_STEP, self.handle.recording_ended());
                if recording.await.is_err() {
                    tracing::warn!("the recording was not completed in time: the disk is slow");
                }
                let driver = self.handle.driver_ended();
                if tokio::time::timeout(LAST_STEP, driver.cancelled()).await.is_err() {
                    tracing::warn!("the last step did not end in time and was abandoned");
                }
            });
        }
    }

    /// Finds a method of the schema, while the world exists.
    fn find(&self, method: &str) -> Result<&'static Method, Status> {
        if self.connection.is_cancelled() {
            return Err(CallError::ShuttingDown).or_status();
        }
        let found = method.split_once('/').and_then(|(service, method)| methods::find(service, method));
        let none = || with_reason(Status::unimplemented(format!("`{method}` is not a method of simd.v1")));
        found.ok_or_else(none)
    }

    fn prepare(&self, method: &'static Method, request: Bytes) -> Prepared {
        let mut request = Request::new(stream::iter([request]));
        *request.metadata_mut() = self.said.clone();
        request.extensions_mut().insert(Disconnect(self.connection.clone()));
        Prepared { method, request, services: self.services.clone() }
    }

    fn spawn<F>(&self, work: impl FnOnce(Ticket) -> F) -> Result<Ticket, Status>
    where
        F: Future<Output = ()> + Send + 'static,
    {
        let runtime = self.runtime()?;
        let mut under_way = self.lock();
        if under_way.tasks.len() >= UNDER_WAY {
            let message = format!("{UNDER_WAY} calls and subscriptions are already in progress; end some");
            return Err(Explained::new(ErrorReason::MailboxFull, message).into());
        }
        under_way.given += 1;
        let ticket = under_way.given;
        let (work, of_task) = (work(ticket), self.under_way.clone());
        // Its entry already exists: the lock is held until then.
        let task = runtime.spawn(async move {
            work.await;
            of_task.lock().unwrap_or_else(PoisonError::into_inner).tasks.remove(&ticket);
        });
        under_way.tasks.insert(ticket, task.abort_handle());
        Ok(ticket)
    }

    fn runtime(&self) -> Result<&Runtime, Status> {
        self.runtime.as_ref().ok_or(CallError::ShuttingDown).or_status()
    }

    fn lock(&self) -> MutexGuard<'_, UnderWay> {
        self.under_way.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Embedded {
    /// Waits for nothing, so that it also works in a forked process, where the threads do not exist.
    fn drop(&mut self) {
        self.connection.cancel();
        self.handle.draining().cancel();
        self.handle.end_driver();
        if let Some(runtime) = self.runtime.take() {
            runtime.shutdown_background();
        }
    }
}

/// Opens the world of a configuration.
async fn open(config: &Config) -> Result<SimHandle, Error> {
    let loader = daemon::world::loader(config)?;
    let handle = daemon::world::open(config, loader, Access::open())?;
    if let Err(error) = daemon::world::fill(config, &handle).await {
        return Err(daemon::world::not_started(&handle, error));
    }
    daemon::world::keep(config, &handle);
    Ok(handle)
}
