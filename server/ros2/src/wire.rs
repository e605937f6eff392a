//! Names and formats of `rmw_zenoh`: keys of data, liveliness tokens, quality of service, attachments.
//! Sources: `docs/design.md` of `rmw_zenoh` and its `liveliness_utils.cpp`, `qos.cpp` and
//! `attachment_helpers.cpp`.

use crate::latin::latin;
use crate::message::{Message, Service};

/// Maximum length of a topic's or service's name: far more than any real one.
pub const MAX_NAME: usize = 255;

/// Text that replaces the hash in ROS 2 Humble.
pub const NO_HASH: &str = "TypeHashNotSupported";

/// A type, as in keys.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TypeInfo {
    /// `sensor_msgs/msg/JointState`.
    pub name: &'static str,
    /// RIHS01, or [`NO_HASH`].
    pub hash: &'static str,
}

impl TypeInfo {
    /// Makes the type of a message. `hashed` says whether the distribution has hashes.
    pub fn of<M: Message>(hashed: bool) -> Self {
        Self { name: M::NAME, hash: if hashed { M::type_hash() } else { NO_HASH } }
    }

    /// Makes the type of a service.
    pub fn of_service<S: Service>(hashed: bool) -> Self {
        Self { name: S::NAME, hash: if hashed { S::type_hash() } else { NO_HASH } }
    }

    /// Returns the DDS name, such as `sensor_msgs::msg::dds_::JointState_`.
    fn dds(&self) -> String {
        let mut words = self.name.split('/');
        let [package, kind, name] = [(); 3].map(|()| words.next().unwrap_or_default());
        format!("{package}::{kind}::dds_::{name}_")
    }
}

/// Quality of service of a topic, as far as tokens show it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Qos {
    /// Messages are not dropped, except old ones.
    pub reliable: bool,
    /// Late subscribers get the last messages.
    pub transient_local: bool,
    /// Number of kept messages.
    pub depth: u32,
}

impl Qos {
    /// For topics of which only the newest message counts.
    pub const SENSOR: Self = Self { reliable: false, transient_local: false, depth: 5 };
    /// For ordinary topics.
    pub const DEFAULT: Self = Self { reliable: true, transient_local: false, depth: 10 };
    /// For topics whose last message is for every late subscriber.
    pub const LATCHED: Self = Self { reliable: true, transient_local: true, depth: 1 };

    /// Returns `reliability:durability:history,depth:deadline:lifespan:liveliness`, with defaults left out.
    pub fn text(self) -> String {
        let reliability = if self.reliable { "" } else { "2" };
        let durability = if self.transient_local { "1" } else { "" };
        format!("{reliability}:{durability}:,{}:,:,:,,", self.depth)
    }
}

/// Kind of an endpoint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndpointKind {
    /// Publisher of a topic.
    Publisher,
    /// Subscription of a topic.
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
    /// Id of a ROS 2 domain; domains do not see each other.
    pub domain_id: u32,
    /// Id of the session.
    pub zid: String,
    /// `/`, or `/lab`.
    pub namespace: String,
    /// Name without the namespace.
    pub name: String,
}

impl Node {
    /// Returns the liveliness token of the node.
    pub fn token(&self) -> String {
        format!("@ros2_lv/{}/{}/0/0/NN/{}", self.domain_id, self.zid, self.qualified_name())
    }

    /// Returns the liveliness token of an endpoint. `topic` begins with a slash.
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

    /// Returns the key of a topic's messages, or of a service's calls.
    pub fn data_key(&self, topic: &str, kind_of_message: TypeInfo) -> String {
        let topic = topic.trim_matches('/');
        format!("{}/{topic}/{}/{}", self.domain_id, kind_of_message.dds(), kind_of_message.hash)
    }

    /// Returns enclave, namespace and name. The enclave, of DDS security, is empty.
    fn qualified_name(&self) -> String {
        format!("%/{}/{}", mangled(&self.namespace), mangled(&self.name))
    }
}

/// Replaces slashes by `%`. The root namespace, and an empty one, become `%`.
fn mangled(name: &str) -> String {
    if name.is_empty() { "%".to_owned() } else { name.replace('/', "%") }
}

/// Returns the id of an endpoint for its subscribers: XXH3-128 of its token, the low half first.
pub fn gid(token: &str) -> [u8; 16] {
    xxhash_rust::xxh3::xxh3_128(token.as_bytes()).to_le_bytes()
}

/// Attachment of each message, request and reply. Receivers drop messages without it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Attachment {
    /// Counts the messages of its source, from 1.
    pub sequence: i64,
    /// Time of sending, in nanoseconds since 1970.
    pub source_time: i64,
    /// Id of its source.
    pub gid: [u8; 16],
}

/// Bytes of an attachment: two numbers, the length of a gid, and the gid.
const ATTACHMENT: usize = 8 + 8 + 1 + 16;

impl Attachment {
    /// Returns its bytes, as `zenoh-ext` serialises the three.
    pub fn bytes(&self) -> [u8; ATTACHMENT] {
        let mut bytes = [0; ATTACHMENT];
        let (numbers, gid) = bytes.split_at_mut(16);
        numbers[..8].copy_from_slice(&self.sequence.to_le_bytes());
        numbers[8..].copy_from_slice(&self.source_time.to_le_bytes());
        gid[0] = 16;
        gid[1..].copy_from_slice(&self.gid);
        bytes
    }

    /// Parses an attachment.
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

/// Returns a name as one word of a topic, as `rmw_validate_full_topic_name` requires: letters of ASCII, digits and
/// single underscores. It begins with a letter or an underscore. Latin, Greek and Cyrillic letters are transliterated.
/// Letters of other scripts become their numbers, such as `u673a`, and all else an underscore.
pub fn word(name: &str) -> String {
    let mut word = String::new();
    for letter in name.chars() {
        let part = match letter {
            letter if letter.is_ascii_alphanumeric() => letter.to_string(),
            letter if letter.is_ascii() => "_".to_owned(),
            letter => latin(letter).unwrap_or_else(|| match letter.is_alphanumeric() {
                true => format!("u{:04x}", u32::from(letter)),
                false => "_".to_owned(),
            }),
        };
        if word.is_empty() && part.starts_with(|first: char| first.is_ascii_digit()) {
            word.push('_');
        }
        // Repeated underscores are reserved.
        if part != "_" || !word.ends_with('_') {
            word += &part;
        }
        if word.len() >= MAX_NAME / 2 {
            break;
        }
    }
    if word.is_empty() { "_".to_owned() } else { word }
}

/// Returns whether a text is a namespace: `/`, or words with a slash before each.
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
            ("müller", "muller"),
            ("Тест-2", "Test_2"),
            ("机器 人", "u673au5668_u4eba"),
            ("ь", "_"),
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
