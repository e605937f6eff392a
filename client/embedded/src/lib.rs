//! The Python module `simd_embedded`: a world within a Python program. A call is a method's name and the
//! bytes of its request. `simd_client` has the messages and the API for people.
//!
//! No function holds Python's lock while it waits or steps. Threads of Rust never call Python. A thread of
//! Python asks for the results of pending calls, so that no thread of Rust blocks the end of the interpreter.

mod damped_steps;

use std::ffi::OsString;
use std::net::SocketAddr;
use std::sync::{Arc, Mutex, PoisonError, Weak};
use std::time::Duration;

use bytes::Bytes;
use pyo3::create_exception;
use pyo3::exceptions::{PyException, PyOSError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyList};
use simd_server::config::{Config, ConfigError};
use simd_server::daemon::Error;
use simd_server::embedded::{Embedded, KeptStep, Notice, Served, Topic, What};

create_exception!(
    simd_embedded,
    Refused,
    PyException,
    "A call was refused. Its one argument is a google.rpc.Status, as bytes."
);

/// Maximum time limit, in seconds: a year.
const LONGEST: f64 = 365.0 * 24.0 * 3600.0;

/// A world with the services of a daemon. May be used from several threads.
#[pyclass(frozen, module = "simd_embedded")]
struct World {
    /// `None` once it is closed.
    embedded: Mutex<Option<Arc<Embedded>>>,
    name: String,
}

#[pymethods]
impl World {
    /// Opens a world. `arguments` are flags of the program `simd`, such as `--paused` and `--set
    /// service.robots=50`; flags for addresses, TLS and tokens are ignored. `version` is the caller's schema
    /// version, as MAJOR.MINOR, and `client` the caller's name.
    ///
    /// Raises `ValueError` for a mistake in the arguments, `OSError` if a file does not match them.
    #[new]
    fn new(py: Python<'_>, arguments: Vec<OsString>, version: &str, client: &str) -> PyResult<Self> {
        let words = std::iter::once(OsString::from("simd")).chain(arguments);
        let config = Config::from_args(words).map_err(|error| match error {
            ConfigError::Usage(sentence)
            | ConfigError::File(sentence)
            | ConfigError::HelpOrVersion(sentence) => PyValueError::new_err(sentence),
        })?;
        let name = config.name.clone();
        let started = py.detach(|| Embedded::start(config, version, client));
        let embedded = started.map_err(|error| PyOSError::new_err(error.to_string()))?;
        Ok(Self { embedded: Mutex::new(Some(Arc::new(embedded))), name })
    }

    /// Returns the world's name, as of a daemon.
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// Returns whether `close` was called.
    #[getter]
    fn is_closed(&self) -> bool {
        self.embedded.lock().unwrap_or_else(PoisonError::into_inner).is_none()
    }

    /// Calls `SERVICE/METHOD` with the bytes of its request, and returns the bytes of its answer, within
    /// `time_limit` seconds. Raises `Refused`. Checks for signals, such as Ctrl-C, while it waits.
    fn call<'py>(
        &self,
        py: Python<'py>,
        method: &str,
        request: &[u8],
        time_limit: f64,
    ) -> PyResult<Bound<'py, PyBytes>> {
        let (embedded, time_limit) = (self.open()?, seconds(time_limit)?);
        let request = Bytes::copy_from_slice(request);
        let mut signal = None;
        let answer = py.detach(|| embedded.call(method, request, time_limit, || goes_on(&mut signal)));
        match (answer, signal) {
            (_, Some(signal)) => Err(signal),
            (Ok(answer), None) => Ok(PyBytes::new(py, &answer)),
            (Err(status), None) => Err(refused(py, &embedded.refusal(&status))),
        }
    }

    /// Keeps a `StepSimulationRequest`, for loops that change one number of each target. Raises `Refused`.
    fn keep_step(&self, py: Python<'_>, request: &[u8]) -> PyResult<Step> {
        let embedded = self.open()?;
        let kept = embedded.keep_step(request).map_err(|status| refused(py, &embedded.refusal(&status)))?;
        Ok(Step { embedded: Arc::downgrade(&embedded), kept: Mutex::new(kept) })
    }

    /// Serves the page and the services at `HOST:PORT` until the world ends. Returns the address with the port that it got, and the
    /// descriptor of its socket. Raises `OSError` if it cannot be listened on, `ValueError` for any other reason.
    fn serve(&self, py: Python<'_>, address: &str) -> PyResult<(String, i32)> {
        let embedded = self.open()?;
        let parsed = address.parse::<SocketAddr>();
        let parsed = parsed.map_err(|_| {
            PyValueError::new_err(format!(
                "`{address}` is not an address to serve at: give IP:PORT, as 127.0.0.1:7400"
            ))
        })?;
        match py.detach(|| embedded.serve(parsed)) {
            Ok(Served { address, descriptor }) => Ok((address.to_string(), descriptor)),
            Err(error @ Error::Listen { .. }) => Err(PyOSError::new_err(error.to_string())),
            Err(error) => Err(PyValueError::new_err(error.to_string())),
        }
    }

    /// Begins a call; returns its ticket. `next_notices` says what becomes of it. Raises `Refused` where too many are under way.
    fn begin(&self, py: Python<'_>, method: &str, request: &[u8], time_limit: f64) -> PyResult<u64> {
        let (embedded, time_limit) = (self.open()?, seconds(time_limit)?);
        let request = Bytes::copy_from_slice(request);
        let begun = py.detach(|| embedded.begin(method, request, time_limit));
        begun.map_err(|status| refused(py, &embedded.refusal(&status)))
    }

    /// Subscribes to the publications under a Zenoh key; returns a ticket. Raises `ValueError` if nothing is
    /// published under it.
    fn subscribe(&self, py: Python<'_>, key: &str) -> PyResult<u64> {
        let topic = Topic::parse(key)
            .ok_or_else(|| PyValueError::new_err(format!("nothing is published under `{key}`")))?;
        let embedded = self.open()?;
        embedded.subscribe(topic).map_err(|status| refused(py, &embedded.refusal(&status)))
    }

    /// Ends the call or subscription with this ticket.
    fn end(&self, ticket: u64) {
        if let Ok(embedded) = self.open() {
            embedded.end(ticket);
        }
    }

    /// Waits at most `time_limit` seconds for notices: a list of (ticket, kind, key, payload), where kind is
    /// `answer`, `refused`, `ended` or `published`. `None` once the world is closed. Only one thread may call
    /// it at a time.
    fn next_notices<'py>(&self, py: Python<'py>, time_limit: f64) -> PyResult<Option<Bound<'py, PyList>>> {
        let Ok(embedded) = self.open() else { return Ok(None) };
        let time_limit = seconds(time_limit)?;
        let waited = py.detach(move || embedded.next_notices(time_limit));
        let Some(notices) = waited else { return Ok(None) };
        let tuples = notices.into_iter().map(|Notice { ticket, what }| match what {
            What::Answer(bytes) => (ticket, "answer", String::new(), PyBytes::new(py, &bytes)),
            What::Refused(status) => (ticket, "refused", String::new(), PyBytes::new(py, &status)),
            What::Ended => (ticket, "ended", String::new(), PyBytes::new(py, &[])),
            What::Published { key, payload } => (ticket, "published", key, PyBytes::new(py, &payload)),
        });
        PyList::new(py, tuples.collect::<Vec<_>>()).map(Some)
    }

    /// Ends the world. Pending calls are refused.
    fn close(&self, py: Python<'_>) {
        let taken = self.embedded.lock().unwrap_or_else(PoisonError::into_inner).take();
        if let Some(embedded) = taken {
            py.detach(move || {
                embedded.close();
                drop(embedded);
            });
        }
    }
}

/// A step whose request is kept.
#[pyclass(frozen, module = "simd_embedded")]
struct Step {
    embedded: Weak<Embedded>,
    kept: Mutex<KeptStep>,
}

/// Joint states of a robot: its name, the version of its layout, positions, velocities, efforts.
type RobotStates<'py> = (String, u64, Bound<'py, PyList>, Bound<'py, PyList>, Bound<'py, PyList>);

#[pymethods]
impl Step {
    /// Makes the step with other numbers of its targets, one each, or with the last ones if there are none. Returns the sequence number
    /// and the simulation time of the state after it, and the joint states of each robot. Waits as `call` does. Raises `Refused`, and
    /// `ValueError` once the world is closed.
    fn run<'py>(
        &self,
        py: Python<'py>,
        numbers: Vec<f64>,
        time_limit: f64,
    ) -> PyResult<(u64, f64, Vec<RobotStates<'py>>)> {
        let embedded = self.embedded.upgrade().ok_or_else(|| PyValueError::new_err("the world is closed"))?;
        let time_limit = seconds(time_limit)?;
        let mut signal = None;
        let stepped = py.detach(|| {
            let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
            embedded.step_kept(&mut kept, &numbers, time_limit, || goes_on(&mut signal))
        });
        if let Some(signal) = signal {
            return Err(signal);
        }
        let answer = stepped.map_err(|status| refused(py, &embedded.refusal(&status)))?;
        let states = answer.states.unwrap_or_default();
        let stamp = states.stamp.unwrap_or_default();
        let robots = states.robots.into_iter().map(|robot| {
            let list = |numbers: &[f64]| PyList::new(py, numbers);
            let (position, velocity) = (list(&robot.position)?, list(&robot.velocity)?);
            Ok((robot.robot, robot.layout_version, position, velocity, list(&robot.effort)?))
        });
        Ok((stamp.sequence, stamp.sim_time, robots.collect::<PyResult<_>>()?))
    }
}

impl World {
    fn open(&self) -> PyResult<Arc<Embedded>> {
        let embedded = self.embedded.lock().unwrap_or_else(PoisonError::into_inner);
        embedded.clone().ok_or_else(|| PyValueError::new_err("the world is closed"))
    }
}

/// Whether no signal, such as Ctrl-C's, has come.
fn goes_on(signal: &mut Option<PyErr>) -> bool {
    *signal = Python::attach(|py| py.check_signals()).err();
    signal.is_none()
}

fn seconds(time_limit: f64) -> PyResult<Duration> {
    let within = if time_limit > LONGEST { LONGEST } else { time_limit };
    Duration::try_from_secs_f64(within)
        .map_err(|_| PyValueError::new_err(format!("{time_limit} is not a number of seconds")))
}

fn refused(py: Python<'_>, status: &[u8]) -> PyErr {
    Refused::new_err(PyBytes::new(py, status).unbind())
}

/// A simd world in this program, which `simd_client.connect("embedded")` uses.
#[pymodule]
mod simd_embedded {
    use pyo3::prelude::*;

    #[pymodule_export]
    use super::Refused;
    #[pymodule_export]
    use super::Step;
    #[pymodule_export]
    use super::World;
    #[pymodule_export]
    use super::damped_steps::Chain;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
