//! Memory for decoding a request of any bytes: at most what its bytes justify. Counted, not timed: the
//! allocations of one thread are the same on every machine.
#![cfg(test)]

use std::collections::BTreeMap;

use fastrand::Rng;
use prost::Message as _;
use prost::encoding::{WireType, encode_key, encode_varint};
use prost_types::field_descriptor_proto::{Label, Type};
use prost_types::{DescriptorProto, FileDescriptorSet};
use simd_proto::checked::{Refused, Request, most, requests};
use simd_proto::v1;

/// Bytes of a hostile message.
const LONG: usize = 512 << 10;
/// Levels of messages within each other that are gone down.
const LEVELS: usize = 6;

struct Schema(BTreeMap<String, DescriptorProto>);

impl Schema {
    fn read() -> Self {
        let schema = FileDescriptorSet::decode(v1::FILE_DESCRIPTOR_SET).unwrap();
        let mut messages = BTreeMap::new();
        for message in schema.file.into_iter().flat_map(|file| file.message_type) {
            for nested in &message.nested_type {
                messages.insert(format!(".simd.v1.{}.{}", message.name(), nested.name()), nested.clone());
            }
            messages.insert(format!(".simd.v1.{}", message.name()), message);
        }
        Self(messages)
    }

    /// For each list and map that a message has at any depth: the message with as many empty elements as fit.
    fn hostile(&self, name: &str, room: usize, levels: usize) -> Vec<Vec<u8>> {
        let mut found = Vec::new();
        let Some(message) = self.0.get(name).filter(|_| levels > 0) else { return found };
        for field in &message.field {
            let number = field.number() as u32;
            if field.label() == Label::Repeated {
                let element = key(number, 0);
                found.push(element.repeat(room / element.len()));
                // One list that is packed, of numbers of one byte.
                found.push([key(number, room), vec![1; room]].concat());
            }
            if field.r#type() == Type::Message {
                for inside in self.hostile(field.type_name(), room, levels - 1) {
                    found.push([key(number, inside.len()), inside].concat());
                }
                // And many of them with one element each.
                if field.label() == Label::Repeated {
                    for inside in self.hostile(field.type_name(), 4, levels - 1) {
                        let element = [key(number, inside.len()), inside].concat();
                        found.push(element.repeat(room / element.len()));
                    }
                }
            }
        }
        found
    }
}

fn key(number: u32, length: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    encode_key(number, WireType::LengthDelimited, &mut bytes);
    encode_varint(length as u64, &mut bytes);
    bytes
}

/// Returns true if it was decoded, within the memory that its bytes justify.
fn check((name, decode): &Request, bytes: &[u8]) -> bool {
    let mut decoded = Ok(());
    let peak = allocation_counter::measure(|| decoded = decode(bytes)).bytes_max;
    assert!(
        peak <= most(bytes.len()) as u64,
        "{name}: {peak} bytes for {} of {:?}...",
        bytes.len(),
        bytes.get(..16)
    );
    if let Err(Refused::TooMuch { .. }) = decoded {
        assert_eq!(peak, 0, "{name} is refused before it takes memory");
    }
    decoded.is_ok()
}

#[test]
fn no_list_of_any_request_takes_more_memory_than_its_bytes_justify() {
    let schema = Schema::read();
    let (mut decoded, mut refused) = (0, 0);
    for request in requests() {
        for bytes in schema.hostile(&format!(".simd.v1.{}", request.0), LONG, LEVELS) {
            match check(request, &bytes) {
                true => decoded += 1,
                false => refused += 1,
            }
        }
    }
    assert!(decoded > 20 && refused > 50, "{decoded} decoded, {refused} refused");
}

/// Random keys and lengths, most of which fit.
fn message(random: &mut Rng, depth: usize) -> Vec<u8> {
    let mut bytes = Vec::new();
    for _ in 0..random.usize(0..12) {
        let inside =
            if depth > 0 { message(random, depth - 1) } else { vec![random.u8(..); random.usize(0..9)] };
        let claimed = if random.u8(0..50) == 0 { random.usize(..1 << 20) } else { inside.len() };
        match random.u8(0..8) {
            0 => bytes.extend([random.u8(1..12) << 3, random.u8(..)]),
            1 => bytes.extend([random.u8(1..12) << 3 | 1, 0, 0, 0, 0, 0, 0, 0, 0]),
            _ => {
                bytes.extend(key(random.u32(1..12), claimed));
                bytes.extend(inside);
            }
        }
    }
    bytes
}

#[test]
fn messages_at_random_take_no_more_memory_than_their_bytes_justify() {
    let mut random = Rng::with_seed(12);
    let mut decoded = 0;
    for _ in 0..3000 {
        let bytes = message(&mut random, 3);
        for request in requests() {
            decoded += u32::from(check(request, &bytes));
        }
    }
    assert!(decoded > 1000, "{decoded} decoded");
}
