//! How `rmw_zenoh` names what it carries: keys of data, liveliness tokens, quality of service, attachments. After
//! `docs/design.md` of `rmw_zenoh` and its `liveliness_utils.cpp`, `qos.cpp` and `attachment_helpers.cpp`.

use crate::message::{Message, Service};

/// The longest name of a topic or service that is taken: far more than anyone has.
pub const MAX_NAME: usize = 255;

/// What ROS 2 Humble has instead of a hash.
pub const NO_HASH: &str = "TypeHashNotSupported";

/// A type as keys have it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TypeInfo {
    /// `sensor_msgs/msg/JointState`.
    pub name: &'static str,
    /// RIHS01, or [`NO_HASH`].
    pub hash: &'static str,
}

impl TypeInfo {
    /// Of a message. `hashed` says whether the distribution has hashes.
    pub fn of<M: Message>(hashed: bool) -> Self {
        Self { name: M::NAME, hash: if hashed { M::type_hash() } else { NO_HASH } }
    }

    /// Of a service.
    pub fn of_service<S: Service>(hashed: bool) -> Self {
        Self { name: S::NAME, hash: if hashed { S::type_hash() } else { NO_HASH } }
    }

    /// `sensor_msgs::msg::dds_::JointState_`.
    fn dds(&self) -> String {
        let mut words = self.name.split('/');
        let [package, kind, name] = [(); 3].map(|()| words.next().unwrap_or_default());
        format!("{package}::{kind}::dds_::{name}_")
    }
}

/// How a topic is carried, as far as it is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Qos {
    /// Nothing is dropped on the way but what is old.
    pub reliable: bool,
    /// Who comes later gets the last messages.
    pub transient_local: bool,
    /// How many messages are kept.
    pub depth: u32,
}

impl Qos {
    /// For topics of which the newest message counts.
    pub const SENSOR: Self = Self { reliable: false, transient_local: false, depth: 5 };
    /// For topics like any.
    pub const DEFAULT: Self = Self { reliable: true, transient_local: false, depth: 10 };
    /// For topics whose last message is for everyone who comes.
    pub const LATCHED: Self = Self { reliable: true, transient_local: true, depth: 1 };

    /// `reliability:durability:history,depth:deadline:lifespan:liveliness`: what is as by default is left out.
    pub fn text(self) -> String {
        let reliability = if self.reliable { "" } else { "2" };
        let durability = if self.transient_local { "1" } else { "" };
        format!("{reliability}:{durability}:,{}:,:,:,,", self.depth)
    }
}

/// What an endpoint is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndpointKind {
    /// Of a topic.
    Publisher,
    /// Of a topic.
    Subscription,
    /// The server of a service.
    Server,
}

impl EndpointKind {
    const fn text(self) -> &'static str {
        match self {
            Self::Publisher => "MP",
            Self::Subscription => "MS",
            Self::Server => "SS",
        }
    }
}

/// A node of ROS 2 on a session of Zenoh.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Node {
    /// Worlds of ROS 2 that do not see each other.
    pub domain_id: u32,
    /// Of the session.
    pub zid: String,
    /// `/`, or `/lab`.
    pub namespace: String,
    /// Without a namespace.
    pub name: String,
}

impl Node {
    /// The token that shows the node.
    pub fn token(&self) -> String {
        format!("@ros2_lv/{}/{}/0/0/NN/{}", self.domain_id, self.zid, self.qualified_name())
    }

    /// The token that shows an endpoint. `topic` begins with a slash.
    pub fn endpoint_token(
        &self,
        id: u32,
        kind: EndpointKind,
        topic: &str,
        kind_of_message: TypeInfo,
        qos: Qos,
    ) -> String {
        let TypeInfo { name: _, hash } = kind_of_message;
        format!(
            "@ros2_lv/{}/{}/0/{id}/{}/{}/{}/{}/{hash}/{}",
            self.domain_id,
            self.zid,
            kind.text(),
            self.qualified_name(),
            mangled(topic),
            kind_of_message.dds(),
            qos.text()
        )
    }

    /// The key on which the messages of a topic, or the calls of a service, go.
    pub fn data_key(&self, topic: &str, kind_of_message: TypeInfo) -> String {
        let topic = topic.trim_matches('/');
        format!("{}/{topic}/{}/{}", self.domain_id, kind_of_message.dds(), kind_of_message.hash)
    }

    /// Enclave, namespace and name. An enclave is of DDS security: there is none.
    fn qualified_name(&self) -> String {
        format!("%/{}/{}", mangled(&self.namespace), mangled(&self.name))
    }
}

/// Slashes as `%`. The root namespace is one, and an empty one is alike.
fn mangled(name: &str) -> String {
    if name.is_empty() { "%".to_owned() } else { name.replace('/', "%") }
}

/// Who an endpoint is to those that get its messages: XXH3-128 of its own token, the low half first.
pub fn gid(token: &str) -> [u8; 16] {
    xxhash_rust::xxh3::xxh3_128(token.as_bytes()).to_le_bytes()
}

/// What goes with each message, request and reply. Who gets one without it drops it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// Counts what its source has sent, from 1.
    pub sequence: i64,
    /// When it was sent, in nanoseconds since 1970.
    pub source_time: i64,
    /// Of its source.
    pub gid: [u8; 16],
}

/// The bytes of an attachment: two numbers, the length of a gid, and it.
const ATTACHMENT: usize = 8 + 8 + 1 + 16;

impl Attachment {
    /// As `zenoh-ext` serialises the three.
    pub fn bytes(&self) -> [u8; ATTACHMENT] {
        let mut bytes = [0; ATTACHMENT];
        let (numbers, gid) = bytes.split_at_mut(16);
        numbers[..8].copy_from_slice(&self.sequence.to_le_bytes());
        numbers[8..].copy_from_slice(&self.source_time.to_le_bytes());
        gid[0] = 16;
        gid[1..].copy_from_slice(&self.gid);
        bytes
    }

    /// What bytes say, if they are an attachment.
    pub fn parse(bytes: &[u8]) -> Option<Self> {
        let bytes: &[u8; ATTACHMENT] = bytes.try_into().ok()?;
        let (sequence, rest) = bytes.split_first_chunk::<8>()?;
        let (source_time, rest) = rest.split_first_chunk::<8>()?;
        let (&16, gid) = rest.split_first()? else {
            return None;
        };
        Some(Self {
            sequence: i64::from_le_bytes(*sequence),
            source_time: i64::from_le_bytes(*source_time),
            gid: gid.try_into().ok()?,
        })
    }
}

/// A name as one word of a topic: letters, digits and single underscores, with a letter or an underscore at the front, as
/// `rmw_validate_full_topic_name` asks. What no topic can have becomes an underscore.
pub fn word(name: &str) -> String {
    let mut word = String::new();
    for letter in name.chars() {
        let letter = if letter.is_ascii_alphanumeric() { letter } else { '_' };
        if word.is_empty() && letter.is_ascii_digit() {
            word.push('_');
        }
        // Two in a row are reserved.
        if letter != '_' || !word.ends_with('_') {
            word.push(letter);
        }
        if word.len() >= MAX_NAME / 2 {
            break;
        }
    }
    if word.is_empty() { "_".to_owned() } else { word }
}

/// Whether a text is a namespace: `/`, or words with a slash before each.
pub fn is_namespace(text: &str) -> bool {
    text == "/"
        || text.len() <= MAX_NAME / 2
            && text.strip_prefix('/').is_some_and(|words| words.split('/').all(|one| word(one) == one))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::messages::rosgraph_msgs::Clock;
    use crate::messages::sensor_msgs::JointState;

    fn node(namespace: &str) -> Node {
        Node {
            domain_id: 0,
            zid: "aa11".to_owned(),
            namespace: namespace.to_owned(),
            name: "simd".to_owned(),
        }
    }

    #[test]
    fn keys_and_tokens_are_those_of_rmw_zenoh() {
        let info = TypeInfo::of::<JointState>(true);
        let hash = "RIHS01_a13ee3a330e346c9d87b5aa18d24e11690752bd33a0350f11c5882bc9179260e";
        assert_eq!(
            node("/").data_key("/joint_states", info),
            format!("0/joint_states/sensor_msgs::msg::dds_::JointState_/{hash}")
        );
        assert_eq!(node("/").token(), "@ros2_lv/0/aa11/0/0/NN/%/%/simd");
        assert_eq!(
            node("/lab").endpoint_token(7, EndpointKind::Publisher, "/lab/joint_states", info, Qos::DEFAULT),
            format!(
                "@ros2_lv/0/aa11/0/7/MP/%/%lab/simd/%lab%joint_states/sensor_msgs::msg::dds_::JointState_/{hash}\
                 /::,10:,:,:,,"
            )
        );
        assert_eq!(Qos::LATCHED.text(), ":1:,1:,:,:,,");
        assert_eq!(Qos::SENSOR.text(), "2::,5:,:,:,,");
    }

    #[test]
    fn a_distribution_without_hashes_says_so() {
        let key = node("/").data_key("/clock", TypeInfo::of::<Clock>(false));
        assert_eq!(key, "0/clock/rosgraph_msgs::msg::dds_::Clock_/TypeHashNotSupported");
    }

    #[test]
    fn an_attachment_is_two_numbers_and_a_gid_with_its_length() {
        let sent = Attachment { sequence: 3, source_time: -2, gid: gid("@ros2_lv/0/aa11/0/0/NN/%/%/simd") };
        let bytes = sent.bytes();
        assert_eq!(bytes[..17], [3, 0, 0, 0, 0, 0, 0, 0, 254, 255, 255, 255, 255, 255, 255, 255, 16]);
        assert_eq!(Attachment::parse(&bytes), Some(sent));
        assert_eq!(Attachment::parse(&bytes[..32]), None);
        let mut other = bytes;
        other[16] = 15;
        assert_eq!(Attachment::parse(&other), None);
    }

    #[test]
    fn any_name_becomes_a_word() {
        for (name, expected) in [
            ("arm", "arm"),
            ("arm-2", "arm_2"),
            ("2nd arm", "_2nd_arm"),
            ("a__b", "a_b"),
            ("müller", "m_ller"),
            ("", "_"),
            ("/../", "_"),
        ] {
            assert_eq!(word(name), expected, "{name}");
            assert!(is_namespace(&format!("/{}", word(name))));
        }
        assert!(is_namespace("/") && is_namespace("/a/b") && !is_namespace("") && !is_namespace("a"));
        assert!(!is_namespace("/a/") && !is_namespace("/1a") && !is_namespace("/a*"));
    }
}
