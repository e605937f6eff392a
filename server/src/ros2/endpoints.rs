//! Publishers, subscriptions and servers in the form of `rmw_zenoh`: a key, a token that shows them to
//! others, and an attachment with each message.

use std::sync::atomic::{AtomicI64, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{SystemTime, UNIX_EPOCH};

use simd_ros2::wire::{Attachment, EndpointKind, Node, Qos, TypeInfo, gid, word};
use simd_ros2::{Message, Service};
use zenoh::bytes::Encoding;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::CongestionControl;
use zenoh::query::{Query, Queryable};
use zenoh::sample::Sample;
use zenoh::{Session, Wait as _};

use super::calls::Calls;
use crate::config::Ros2;

/// The node, which declares endpoints.
#[derive(Debug)]
pub(super) struct Graph {
    session: Session,
    node: Node,
    has_hashes: bool,
    next_id: AtomicU32,
    calls: Arc<Calls>,
    waiting: Arc<Calls>,
    _token: LivelinessToken,
}

impl Graph {
    /// Shows the node to the others. It has the daemon's name.
    pub(super) async fn join(
        session: Session,
        settings: &Ros2,
        name: &str,
        [calls, waiting]: [Calls; 2],
    ) -> Result<Self, zenoh::Error> {
        let node = Node {
            domain_id: settings.domain_id,
            zid: session.zid().to_string(),
            namespace: settings.namespace.clone(),
            name: word(name),
        };
        let token = session.liveliness().declare_token(node.token()).await?;
        let has_hashes = settings.distro.has_type_hashes();
        let (next_id, calls, waiting) = (AtomicU32::new(1), Arc::new(calls), Arc::new(waiting));
        Ok(Self { session, node, has_hashes, next_id, calls, waiting, _token: token })
    }

    /// Returns the calls for normal queries.
    pub(super) fn calls(&self) -> &Arc<Calls> {
        &self.calls
    }

    /// Returns the calls for queries that wait for an event.
    pub(super) fn waiting_calls(&self) -> &Arc<Calls> {
        &self.waiting
    }

    /// Returns a name within the node's namespace.
    pub(super) fn name(&self, relative: &str) -> String {
        format!("{}/{relative}", self.node.namespace.trim_end_matches('/'))
    }

    /// Returns the key of an endpoint, and declares its token.
    async fn endpoint(
        &self,
        kind: EndpointKind,
        name: &str,
        of: TypeInfo,
        qos: Qos,
    ) -> Result<(String, String, LivelinessToken), zenoh::Error> {
        let id = self.next_id.fetch_add(1, Ordering::Relaxed);
        let text = self.node.endpoint_token(id, kind, name, of, qos);
        let token = self.session.liveliness().declare_token(text.as_str()).await?;
        Ok((self.node.data_key(name, of), text, token))
    }

    /// Declares a publisher of a topic by its full name.
    pub(super) async fn publisher<M: Message>(
        &self,
        topic: &str,
        qos: Qos,
    ) -> Result<Topic<M>, zenoh::Error> {
        let (key, text, token) =
            self.endpoint(EndpointKind::Publisher, topic, TypeInfo::of::<M>(self.has_hashes), qos).await?;
        let publisher = self
            .session
            .declare_publisher(key.clone())
            .encoding(Encoding::from("application/cdr"))
            .congestion_control(CongestionControl::Drop)
            .express(true)
            .await?;
        let last = match qos.transient_local {
            true => Some(Last::declare(&self.session, key, Arc::clone(&self.calls)).await?),
            false => None,
        };
        Ok(Topic {
            session: self.session.clone(),
            publisher,
            gid: gid(&text),
            sent: AtomicI64::new(0),
            last,
            _token: token,
            message: std::marker::PhantomData,
        })
    }

    /// Declares a subscription to a topic by its full name. `take` runs on Zenoh's own thread and must not
    /// wait.
    pub(super) async fn subscription<M: Message>(
        &self,
        topic: &str,
        take: impl Fn(&Sample) + Send + Sync + 'static,
    ) -> Result<Subscription, zenoh::Error> {
        let of = TypeInfo::of::<M>(self.has_hashes);
        let (key, _, token) = self.endpoint(EndpointKind::Subscription, topic, of, Qos::DEFAULT).await?;
        let subscriber = self.session.declare_subscriber(key).callback(move |sample| take(&sample)).await?;
        Ok(Subscription { _subscriber: subscriber, _token: token })
    }

    /// Declares the server of a service by its full name. `take` runs on Zenoh's own thread and must not
    /// wait.
    pub(super) async fn server<S: Service>(
        &self,
        name: &str,
        take: impl Fn(Query) + Send + Sync + 'static,
    ) -> Result<Server, zenoh::Error> {
        let of = TypeInfo::of_service::<S>(self.has_hashes);
        let (key, _, token) = self.endpoint(EndpointKind::Server, name, of, Qos::DEFAULT).await?;
        // Clients query all servers with the complete key.
        let queryable = self.session.declare_queryable(key).complete(true).callback(take).await?;
        Ok(Server { _queryable: queryable, _token: token })
    }
}

/// A subscription to a topic, until it is dropped.
#[derive(Debug)]
pub(super) struct Subscription {
    _subscriber: Subscriber<()>,
    _token: LivelinessToken,
}

/// A served service, until it is dropped.
#[derive(Debug)]
pub(super) struct Server {
    _queryable: Queryable<()>,
    _token: LivelinessToken,
}

/// A published topic, until it is dropped.
#[derive(Debug)]
pub(super) struct Topic<M> {
    session: Session,
    publisher: Publisher<'static>,
    gid: [u8; 16],
    sent: AtomicI64,
    last: Option<Last>,
    _token: LivelinessToken,
    message: std::marker::PhantomData<fn(&M)>,
}

impl<M: Message> Topic<M> {
    /// Returns whether publishing has any effect.
    pub(super) fn is_wanted(&self) -> bool {
        self.last.is_some() || self.publisher.matching_status().wait().is_ok_and(|status| status.matching())
    }

    /// Publishes a message. It may wait some milliseconds for a receiver that does not read: see
    /// [`super::publications`].
    pub(super) fn put(&self, message: &M) {
        let payload = message.to_cdr();
        let sequence = self.sent.fetch_add(1, Ordering::Relaxed) + 1;
        let attachment = Attachment { sequence, source_time: wall_time(), gid: self.gid }.bytes();
        let timestamp = self.session.new_timestamp();
        if let Some(last) = &self.last {
            last.keep(Kept { payload: payload.clone(), attachment, timestamp });
        }
        if let Err(error) = self.publisher.put(payload).attachment(attachment).timestamp(timestamp).wait() {
            tracing::debug!("a message of ROS 2 is not sent: {error}");
        }
    }
}

/// Returns nanoseconds since 1970.
pub(super) fn wall_time() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
}

/// The last message of a topic for late subscribers. It is the cache of an advanced publisher in `zenoh-ext`,
/// with the key and the token by which its subscribers find it.
#[derive(Debug)]
struct Last {
    kept: Arc<Mutex<Option<Kept>>>,
    _queryable: Queryable<()>,
    _token: LivelinessToken,
}

#[derive(Clone, Debug)]
struct Kept {
    payload: Vec<u8>,
    attachment: [u8; 33],
    timestamp: zenoh::time::Timestamp,
}

impl Last {
    async fn declare(session: &Session, key: String, calls: Arc<Calls>) -> Result<Self, zenoh::Error> {
        let kept: Arc<Mutex<Option<Kept>>> = Arc::default();
        // Identified by the session, and not by a publisher's number: messages differ by their times.
        let cache = format!("{key}/@adv/pub/{}/uhlc/_", session.zid());
        let answers = Arc::clone(&kept);
        let answer = move |query: &Query| {
            let last = answers.lock().unwrap_or_else(PoisonError::into_inner).clone();
            let Some(Kept { payload, attachment, timestamp }) = last else { return };
            let reply = query.reply(&key, payload).encoding(Encoding::from("application/cdr"));
            if let Err(error) = reply.attachment(attachment).timestamp(timestamp).wait() {
                tracing::debug!("a last message is not sent: {error}");
            }
        };
        let queryable = session.declare_queryable(cache.clone()).callback(move |query| {
            let answer = answer.clone();
            // If there is no room, the subscriber asks again, or waits for the next message.
            calls.serve(move || async move { Some(move || answer(&query)) });
        });
        let queryable = queryable.await?;
        let token = session.liveliness().declare_token(cache).await?;
        Ok(Self { kept, _queryable: queryable, _token: token })
    }

    fn keep(&self, kept: Kept) {
        *self.kept.lock().unwrap_or_else(PoisonError::into_inner) = Some(kept);
    }
}
