//! A connection to a daemon, through which every call goes.

use std::{
    convert::Infallible,
    ffi::OsStr,
    future::Future,
    path::{Path, PathBuf},
    sync::Arc,
    time::Duration,
};

use simd_proto::proof::Claiming;
use simd_proto::{
    API_VERSION, API_VERSION_HEADER, CLIENT_HEADER,
    access::{TOKEN_HEADER, bearer},
    v1::{
        GetSimulatorInfoRequest, camera_service_client::CameraServiceClient,
        client_service_client::ClientServiceClient, constraint_service_client::ConstraintServiceClient,
        contact_service_client::ContactServiceClient, entity_service_client::EntityServiceClient,
        event_service_client::EventServiceClient, joint_service_client::JointServiceClient,
        kinematics_service_client::KinematicsServiceClient, parameter_service_client::ParameterServiceClient,
        recording_service_client::RecordingServiceClient, rollout_service_client::RolloutServiceClient,
        sensor_service_client::SensorServiceClient, simulation_service_client::SimulationServiceClient,
        view_service_client::ViewServiceClient,
    },
};
use tonic::{
    Request, Response, Status,
    body::Body,
    codegen::{Service, http},
    metadata::{Ascii, MetadataValue},
    service::{Interceptor, interceptor::InterceptedService},
    transport::Endpoint,
};

use crate::{
    Error,
    channel::{Channel, Local},
    endpoint::{self, DaemonEndpoint},
    error::root_cause,
    silence::until_silent,
    tls,
    token::Token,
    zenoh::Network,
};

/// Larger answers are refused, so that a faulty daemon cannot fill the client's memory. Scenes and assets are
/// the largest answers.
const MAX_ANSWER_BYTES: usize = 64 * 1024 * 1024;

/// A connection to one daemon. Cheap to clone; clones share the connection, which reconnects automatically
/// after a break.
#[derive(Clone, Debug)]
pub struct Client {
    bare: Channel,
    headers: ClientHeaders,
    channel: WithHeaders,
    endpoint: Arc<str>,
    timeout: Duration,
    /// Secret of the claim; empty for none.
    claim: Arc<str>,
    pub(crate) takes_over: bool,
}

/// Options of a connection, and timeouts.
#[derive(Clone, Debug)]
pub struct ConnectOptions {
    /// Token of this client, for a daemon that asks for tokens. The default is the variable `SIMD_TOKEN`.
    pub token: Option<Token>,
    /// File of authorities (PEM), one of which must have signed the certificate of a daemon at `https://` or
    /// `tls/`. The default is the file that `SIMD_TLS_CA` names.
    pub tls_authorities: Option<PathBuf>,
    /// File with the certificate of this client (PEM), for a daemon that asks its clients for one. The
    /// default is the file that `SIMD_TLS_CLIENT_CERT` names.
    pub tls_certificate: Option<PathBuf>,
    /// File with the private key of that certificate (PEM). The default is the file that
    /// `SIMD_TLS_CLIENT_KEY` names.
    pub tls_key: Option<PathBuf>,
    /// Timeout of the connection itself.
    pub connect_timeout: Duration,
    /// Timeout of each call, except streams and calls that say otherwise.
    pub timeout: Duration,
}

impl Default for ConnectOptions {
    fn default() -> Self {
        let set = |name| std::env::var_os(name).filter(|value| !value.is_empty());
        Self {
            token: set("SIMD_TOKEN").and_then(|token| token.into_string().ok()).map(Token),
            tls_authorities: set(tls::AUTHORITIES).map(PathBuf::from),
            tls_certificate: set(tls::CERTIFICATE).map(PathBuf::from),
            tls_key: set(tls::KEY).map(PathBuf::from),
            connect_timeout: Duration::from_secs(3),
            timeout: Duration::from_secs(10),
        }
    }
}

impl Client {
    /// Connects to the daemon at `endpoint`.
    ///
    /// * gRPC: `host`, `host:port`, `http://host:port`, with TLS `https://host:port`, or `unix:PATH` for a
    ///   daemon's Unix socket. Without a port, it is [`DEFAULT_PORT`](crate::DEFAULT_PORT).
    /// * Zenoh: a locator such as `tcp/host:7447`. If several daemons are behind it, `tcp/host:7447#NAME`
    ///   selects one.
    ///
    /// Zenoh needs a tokio runtime of the multi-thread flavor.
    ///
    /// # Errors
    /// * [`Error::Endpoint`] if the text is not an endpoint.
    /// * [`Error::SeveralDaemons`] if it does not select one of several daemons.
    /// * [`Error::Unreachable`] if no daemon answers.
    /// * [`Error::Certificate`] if a file of this side is wrong.
    /// * [`Error::Untrusted`] if the two sides do not trust each other's certificates.
    pub async fn connect(endpoint: &str) -> Result<Self, Error> {
        Self::connect_with(endpoint, ConnectOptions::default()).await
    }

    /// Like [`connect`](Self::connect), with options.
    ///
    /// # Errors
    /// As [`connect`](Self::connect).
    pub async fn connect_with(endpoint: &str, options: ConnectOptions) -> Result<Self, Error> {
        match endpoint::read(endpoint)? {
            DaemonEndpoint::Grpc { url, name } => {
                let client = Self::connect_grpc(endpoint, url, options).await?;
                match name {
                    Some(name) => client.of_name(&name).await,
                    None => Ok(client),
                }
            }
            DaemonEndpoint::Zenoh { locator, name } => {
                let network = Network::open(&locator, options).await?;
                Ok(Self { endpoint: endpoint.into(), ..network.find(name.as_deref())? })
            }
        }
    }

    /// Makes a client of services within this process, for instance of a daemon that a test holds. Calls go
    /// the whole way except for the network.
    pub fn within<S>(service: S) -> Self
    where
        S: Service<http::Request<Body>, Response = http::Response<Body>, Error = Infallible>,
        S: Clone + Send + Sync + 'static,
        S::Future: Send,
    {
        let channel = Channel::Local(Local::new(service));
        Self::over(channel, "this process".into(), &ConnectOptions::default())
    }

    async fn connect_grpc(endpoint: &str, url: String, options: ConnectOptions) -> Result<Self, Error> {
        let to_endpoint = Endpoint::from_shared(url)
            .map_err(|error| Error::Endpoint { endpoint: endpoint.to_owned(), reason: root_cause(&error) })?;
        let is_tls = to_endpoint.uri().scheme_str() == Some("https");
        let authority = to_endpoint.uri().authority().map(ToString::to_string).unwrap_or_default();
        let to_endpoint = if is_tls { with_tls(endpoint, to_endpoint, &options)? } else { to_endpoint };
        let connected = to_endpoint
            .connect_timeout(options.connect_timeout)
            // Small targets must not wait for others to fill a packet.
            .tcp_nodelay(true)
            // A silent watch must still notice that the daemon is gone.
            .http2_keep_alive_interval(Duration::from_secs(10))
            .keep_alive_timeout(Duration::from_secs(10))
            .connect()
            .await
            .map_err(|error| root_cause(&error));
        let failed = match &connected {
            Err(reason) => Some(reason.clone()),
            Ok(channel) if is_tls => tls::first_call(channel.clone(), options.connect_timeout).await,
            Ok(_) => None,
        };
        if is_tls && let Some(reason) = &failed {
            let found = tls::probe(&authority, &tls::read(&options)?, options.connect_timeout).await;
            return Err(Error::unreachable(endpoint, found.unwrap_or_else(|| reason.clone())));
        }
        let channel = connected.map_err(|reason| Error::unreachable(endpoint, reason))?;
        Ok(Self::over(channel.into(), endpoint.into(), &options))
    }

    /// This connection, if the daemon has the name.
    async fn of_name(self, name: &str) -> Result<Self, Error> {
        let other = self.simulator_info().await?.name;
        match other == name {
            true => Ok(self),
            false => Err(Error::Endpoint {
                endpoint: self.endpoint.to_string(),
                reason: format!("the daemon there is called `{other}`"),
            }),
        }
    }

    pub(crate) fn over(channel: Channel, endpoint: Arc<str>, options: &ConnectOptions) -> Self {
        let headers = ClientHeaders::new(options.token.as_ref());
        let with_headers = InterceptedService::new(channel.clone(), headers.clone());
        Self {
            bare: channel,
            headers,
            channel: with_headers,
            endpoint,
            timeout: options.timeout,
            claim: Arc::default(),
            takes_over: false,
        }
    }

    /// Returns the same connection for the holder of a claim (see [`claim`](Self::claim)): requests without a
    /// claim carry this one. Empty for none.
    #[must_use]
    pub fn with_claim(self, claim: &str) -> Self {
        Self { claim: claim.into(), ..self }
    }

    /// Returns the same connection for a client that may also replace and delete saved states and parameters
    /// of other owners. If the daemon asks for tokens, that needs the role `admin`.
    #[must_use]
    pub fn taking_over(self) -> Self {
        Self { takes_over: true, ..self }
    }

    /// Returns the claim of this client; empty for none.
    pub fn held_claim(&self) -> &str {
        &self.claim
    }

    /// Adds the claim of this client to a request that has none.
    pub(crate) fn claimed<R: Claiming>(&self, mut request: R) -> R {
        if request.claim_mut().is_empty() {
            (*self.claim).clone_into(request.claim_mut());
        }
        request
    }

    /// Returns the same connection under another name, which viewers show: printable ASCII, cut after 64
    /// characters. The default name is the file name of the program.
    #[must_use]
    pub fn with_name(self, name: &str) -> Self {
        let headers = ClientHeaders { client: MetadataValue::try_from(name).ok(), ..self.headers.clone() };
        Self { channel: InterceptedService::new(self.bare.clone(), headers.clone()), headers, ..self }
    }

    /// Returns the endpoint as given to [`connect`](Self::connect).
    pub fn endpoint(&self) -> &str {
        &self.endpoint
    }

    /// Returns the timeout of calls.
    pub fn timeout(&self) -> Duration {
        self.timeout
    }

    /// Returns the same connection with another timeout of calls.
    #[must_use]
    pub fn with_timeout(mut self, timeout: Duration) -> Self {
        self.timeout = timeout;
        self
    }

    pub(crate) fn simulation(&self) -> SimulationServiceClient<WithHeaders> {
        SimulationServiceClient::new(self.channel.clone()).max_decoding_message_size(MAX_ANSWER_BYTES)
    }

    pub(crate) fn camera_service(&self) -> CameraServiceClient<WithHeaders> {
        CameraServiceClient::new(self.channel.clone()).max_decoding_message_size(MAX_ANSWER_BYTES)
    }

    pub(crate) fn clients_service(&self) -> ClientServiceClient<WithHeaders> {
        ClientServiceClient::new(self.channel.clone()).max_decoding_message_size(MAX_ANSWER_BYTES)
    }

    pub(crate) fn constraint(&self) -> ConstraintServiceClient<WithHeaders> {
        ConstraintServiceClient::new(self.channel.clone()).max_decoding_message_size(MAX_ANSWER_BYTES)
    }

    pub(crate) fn contact(&self) -> ContactServiceClient<WithHeaders> {
        ContactServiceClient::new(self.channel.clone()).max_decoding_message_size(MAX_ANSWER_BYTES)
    }

    pub(crate) fn entity(&self) -> EntityServiceClient<WithHeaders> {
        EntityServiceClient::new(self.channel.clone()).max_decoding_message_size(MAX_ANSWER_BYTES)
    }

    pub(crate) fn joint(&self) -> JointServiceClient<WithHeaders> {
        JointServiceClient::new(self.channel.clone()).max_decoding_message_size(MAX_ANSWER_BYTES)
    }

    pub(crate) fn event(&self) -> EventServiceClient<WithHeaders> {
        EventServiceClient::new(self.channel.clone()).max_decoding_message_size(MAX_ANSWER_BYTES)
    }

    pub(crate) fn kinematics(&self) -> KinematicsServiceClient<WithHeaders> {
        KinematicsServiceClient::new(self.channel.clone()).max_decoding_message_size(MAX_ANSWER_BYTES)
    }

    pub(crate) fn recording_service(&self) -> RecordingServiceClient<WithHeaders> {
        RecordingServiceClient::new(self.channel.clone()).max_decoding_message_size(MAX_ANSWER_BYTES)
    }

    pub(crate) fn sensor(&self) -> SensorServiceClient<WithHeaders> {
        SensorServiceClient::new(self.channel.clone()).max_decoding_message_size(MAX_ANSWER_BYTES)
    }

    pub(crate) fn rollout_service(&self) -> RolloutServiceClient<WithHeaders> {
        RolloutServiceClient::new(self.channel.clone()).max_decoding_message_size(MAX_ANSWER_BYTES)
    }

    pub(crate) fn parameter(&self) -> ParameterServiceClient<WithHeaders> {
        ParameterServiceClient::new(self.channel.clone()).max_decoding_message_size(MAX_ANSWER_BYTES)
    }

    pub(crate) fn view(&self) -> ViewServiceClient<WithHeaders> {
        ViewServiceClient::new(self.channel.clone()).max_decoding_message_size(MAX_ANSWER_BYTES)
    }

    /// Waits for an answer for at most the usual timeout.
    pub(crate) async fn unary<T>(
        &self,
        call: impl Future<Output = Result<Response<T>, Status>>,
    ) -> Result<T, Error> {
        self.unary_for(Duration::ZERO, call).await
    }

    /// Waits `longer` than the usual timeout, for calls in which the daemon itself waits.
    ///
    /// Giving up drops the call, which notifies the daemon; a `grpc-timeout` header would only add a second
    /// clock to disagree with.
    pub(crate) async fn unary_for<T>(
        &self,
        longer: Duration,
        call: impl Future<Output = Result<Response<T>, Status>>,
    ) -> Result<T, Error> {
        let after = self.timeout.saturating_add(longer);
        match tokio::time::timeout(after, call).await {
            Ok(answer) => self.opened(answer),
            Err(_) => Err(Error::TimedOut { endpoint: self.endpoint.to_string(), after }),
        }
    }

    /// Waits for an answer for as long as the daemon answers at all, for calls in which it works. It may read a
    /// description, for example, after others. Each time the usual timeout ends, the daemon is asked for its name. It
    /// bounds its work.
    pub(crate) async fn unary_while_alive<T>(
        &self,
        call: impl Future<Output = Result<Response<T>, Status>>,
    ) -> Result<T, Error> {
        let is_alive =
            || async { self.simulation().get_simulator_info(GetSimulatorInfoRequest {}).await.is_ok() };
        match until_silent(self.timeout, call, is_alive).await {
            Ok(answer) => self.opened(answer),
            Err(after) => Err(Error::TimedOut { endpoint: self.endpoint.to_string(), after }),
        }
    }

    /// Returns the message of an answer.
    pub(crate) fn opened<T>(&self, answer: Result<Response<T>, Status>) -> Result<T, Error> {
        answer.map(Response::into_inner).map_err(|status| Error::from_status(&status, &self.endpoint))
    }
}

/// Returns a field that the schema promises but the type does not.
pub(crate) fn present<T>(field: Option<T>, name: &str) -> Result<T, Error> {
    field.ok_or_else(|| Error::Answer { reason: format!("it lacks `{name}`") })
}

/// Calls with the headers of the client.
pub(crate) type WithHeaders = InterceptedService<Channel, ClientHeaders>;

/// TLS with the files of the options.
fn with_tls(endpoint: &str, to: Endpoint, options: &ConnectOptions) -> Result<Endpoint, Error> {
    let pems = tls::read(options)?;
    if !pems.has_authorities() {
        let reason = format!(
            "{endpoint} needs the authority that signed the daemon's certificate: {} names its file",
            tls::AUTHORITIES
        );
        return Err(Error::Certificate { reason });
    }
    let unusable = |error| Error::Certificate {
        reason: format!("the certificates for {endpoint} cannot be used: {}", root_cause(&error)),
    };
    to.tls_config(pems.config()).map_err(unusable)
}

/// Adds the client's version, name and token to each call. So the daemon can say which side is older, list
/// its clients, and check their rights.
#[derive(Clone, Debug)]
pub(crate) struct ClientHeaders {
    version: Option<MetadataValue<Ascii>>,
    client: Option<MetadataValue<Ascii>>,
    token: Option<MetadataValue<Ascii>>,
}

impl ClientHeaders {
    fn new(token: Option<&Token>) -> Self {
        let mut token: Option<MetadataValue<Ascii>> =
            token.and_then(|Token(token)| MetadataValue::try_from(bearer(token)).ok());
        if let Some(token) = &mut token {
            token.set_sensitive(true);
        }
        let program = std::env::current_exe().ok();
        let program = program.as_deref().and_then(Path::file_stem).and_then(OsStr::to_str);
        Self {
            version: MetadataValue::try_from(API_VERSION.to_string()).ok(),
            client: program.and_then(|program| MetadataValue::try_from(program).ok()),
            token,
        }
    }
}

impl Interceptor for ClientHeaders {
    fn call(&mut self, mut request: Request<()>) -> Result<Request<()>, Status> {
        let said =
            [(API_VERSION_HEADER, &self.version), (CLIENT_HEADER, &self.client), (TOKEN_HEADER, &self.token)];
        for (header, value) in said {
            if let Some(value) = value {
                request.metadata_mut().insert(header, value.clone());
            }
        }
        Ok(request)
    }
}
