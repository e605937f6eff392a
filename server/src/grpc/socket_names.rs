//! Names of a Unix socket in requests. Clients on gRPC's C core name the daemon by the path of its socket,
//! with `%2F` for `/`. h2 refuses that as an authority. The daemon does not use the name, so `-` takes the
//! place of `%`.

use super::incoming::PREFACE;

/// Kinds of frames with header fields: HEADERS and CONTINUATION (RFC 9113, section 6).
const WITH_FIELDS: [u8; 2] = [1, 9];
/// Bytes before the payload of a frame.
const HEAD: usize = 9;
/// The name as the C core has it: its length, and no Huffman code (RFC 7541, section 5.2).
const NAME: &[u8] = b"\x0a:authority";
/// The length that is continued in the next bytes.
const LONG: u8 = 0x7f;

/// Follows the bytes that a client sends, and changes names in place.
#[derive(Debug, Default)]
pub(super) struct SocketNames {
    place: Place,
    field: Field,
}

/// Position of the next byte in the connection.
#[derive(Debug, Default)]
enum Place {
    #[default]
    Begin,
    /// After this many bytes of the preface.
    Preface(usize),
    /// After this many bytes of a frame's head, which are kept.
    Head([u8; HEAD], usize),
    Payload {
        left: usize,
        has_fields: bool,
    },
    Http1,
}

/// Position of the next byte in the header fields.
#[derive(Debug)]
enum Field {
    /// After this many bytes that equal the name's.
    Name(usize),
    Length,
    /// Within a length of several bytes: its value so far, and the shift of the next byte.
    LongLength(usize, u32),
    Value(usize),
}

impl Default for Field {
    fn default() -> Self {
        Self::Name(0)
    }
}

impl SocketNames {
    /// Changes names in the next bytes of a client.
    pub(super) fn change(&mut self, mut bytes: &mut [u8]) {
        while !bytes.is_empty() {
            let taken = match &mut self.place {
                Place::Http1 => return,
                Place::Payload { left, has_fields } => {
                    let part = bytes.len().min(*left);
                    *left -= part;
                    let is_over = *left == 0;
                    if *has_fields {
                        bytes.iter_mut().take(part).for_each(|byte| self.field.next(byte));
                    }
                    if is_over {
                        self.place = Place::Head([0; HEAD], 0);
                    }
                    part
                }
                place => {
                    place.next(bytes.first().copied().unwrap_or_default());
                    1
                }
            };
            bytes = bytes.get_mut(taken..).unwrap_or_default();
        }
    }
}

impl Place {
    /// Goes on to the byte after this one, which is in no payload.
    fn next(&mut self, byte: u8) {
        let sent = match self {
            Self::Begin => 0,
            Self::Preface(sent) => *sent,
            Self::Head(head, count) => {
                if let Some(place) = head.get_mut(*count) {
                    *place = byte;
                }
                *count += 1;
                let [a, b, c, kind, ..] = *head;
                let left = u32::from_be_bytes([0, a, b, c]) as usize;
                if *count == HEAD {
                    *self = match left {
                        0 => Self::Head([0; HEAD], 0),
                        _ => Self::Payload { left, has_fields: WITH_FIELDS.contains(&kind) },
                    };
                }
                return;
            }
            Self::Payload { .. } | Self::Http1 => return,
        };
        *self = match PREFACE.get(sent) == Some(&byte) {
            false => Self::Http1,
            true if sent + 1 == PREFACE.len() => Self::Head([0; HEAD], 0),
            true => Self::Preface(sent + 1),
        };
    }
}

impl Field {
    fn next(&mut self, byte: &mut u8) {
        *self = match self {
            Self::Name(known) if NAME.get(*known) == Some(byte) => match *known + 1 {
                known if known == NAME.len() => Self::Length,
                known => Self::Name(known),
            },
            Self::Name(_) => Self::Name(usize::from(NAME.first() == Some(byte))),
            Self::Length => match *byte {
                LONG => Self::LongLength(usize::from(LONG), 0),
                length @ 1..LONG => Self::Value(usize::from(length)),
                // No text, or a Huffman code.
                _ => Self::Name(0),
            },
            Self::LongLength(length, shift) => {
                let length = *length + (usize::from(*byte & 0x7f) << *shift);
                match (*byte & 0x80, *shift) {
                    (0, _) => Self::Value(length),
                    (_, 14) => Self::Name(0),
                    (_, shift) => Self::LongLength(length, shift + 7),
                }
            }
            Self::Value(left) => {
                if *byte == b'%' {
                    *byte = b'-';
                }
                match *left {
                    1 => Self::Name(0),
                    left => Self::Value(left - 1),
                }
            }
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(kind: u8, payload: &[u8]) -> Vec<u8> {
        let length = u32::try_from(payload.len()).unwrap().to_be_bytes();
        [&length[1..], &[kind, 4, 0, 0, 0, 1], payload].concat()
    }

    /// A field with a new name, as the C core writes it.
    fn field(name: &str, value: &str) -> Vec<u8> {
        let length = match value.len() {
            length @ 0..127 => vec![u8::try_from(length).unwrap()],
            length => vec![
                LONG,
                u8::try_from((length - 127) & 0x7f | 0x80).unwrap(),
                u8::try_from((length - 127) >> 7).unwrap(),
            ],
        };
        [&[0x40, u8::try_from(name.len()).unwrap()], name.as_bytes(), &length, value.as_bytes()].concat()
    }

    /// Parts of any size give the same.
    #[test]
    fn names_are_changed_in_header_fields_alone_however_the_bytes_come() {
        let long = "run%2Fuser%2F1000%2F".repeat(10);
        for path in ["tmp%2Fsimd.sock", &long] {
            let connection = |name: &str| {
                let path = field(":path", "/simd.v1.JointService/%2F");
                let fields = [path, field(":authority", name), field("simd-client", "a%2Fb")].concat();
                let (first, rest) = fields.split_at(40);
                let body = field(":authority", "tmp%2Fsimd.sock");
                let frames =
                    [frame(4, &[]), frame(1, first), frame(9, rest), frame(0, &body), frame(1, &fields)];
                [PREFACE.to_vec(), frames.concat()].concat()
            };
            let expected = connection(&path.replace('%', "-"));
            for size in [1, 2, 7, 4096] {
                let (mut bytes, mut names) = (connection(path), SocketNames::default());
                bytes.chunks_mut(size).for_each(|part| names.change(part));
                assert_eq!(bytes, expected, "in parts of {size}");
            }
        }
    }

    #[test]
    fn any_bytes_keep_their_number_and_http1_is_left_alone() {
        let text = b"GET /%2F HTTP/1.1\r\nHost: \x0a:authority\x05a%2Fb\r\n\r\n";
        let mut bytes = text.to_vec();
        SocketNames::default().change(&mut bytes);
        assert_eq!(bytes, text);
        for seed in 0..200_u64 {
            let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
            let mut random = || {
                state ^= state << 13;
                state ^= state >> 7;
                state ^= state << 17;
                state.to_be_bytes()[3]
            };
            let noise: Vec<u8> = (0..500).map(|_| random()).collect();
            let mut bytes = [PREFACE, &noise].concat();
            SocketNames::default().change(&mut bytes);
            let changed =
                bytes.iter().zip([PREFACE, &noise].concat()).filter(|(now, before)| **now != *before);
            assert!(changed.into_iter().all(|(now, before)| (*now, before) == (b'-', b'%')), "seed {seed}");
        }
    }
}
