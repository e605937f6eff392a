//! Written files are read back, and broken files are refused without harm.

use super::*;
use crate::Writer;

/// Returns a file with two channels and metadata, in several chunks.
fn file() -> Vec<u8> {
    let mut writer = Writer::new(Vec::new(), "ros2", "tests").unwrap();
    let schema = writer.add_schema("a/msg/B", "ros2msg", b"float64 x").unwrap();
    let first = writer.add_channel(schema, "/first", "cdr", &BTreeMap::new()).unwrap();
    let metadata = BTreeMap::from([("key".to_owned(), "value".to_owned())]);
    let second = writer.add_channel(0, "/second", "protobuf", &metadata).unwrap();
    writer.add_metadata("it", &metadata).unwrap();
    for number in 0..200u64 {
        writer.write(first, 1000 + number, &number.to_le_bytes()).unwrap();
        if number % 3 == 0 {
            writer.write(second, 1000 + number, &vec![7; usize::try_from(number).unwrap()]).unwrap();
        }
        if number % 50 == 49 {
            writer.flush().unwrap();
        }
    }
    writer.finish().unwrap()
}

/// Topic, time and data.
type Read = (String, u64, Vec<u8>);

/// Returns all messages, and the error at the end, if any.
fn read(file: &[u8]) -> (Vec<Read>, Result<(), Error>) {
    let mut messages = Vec::new();
    let ended = (|| {
        let mut reader =
            Reader::new(file, ReadLimits { record: 1 << 20, chunk: 1 << 20, definitions: 1 << 16 })?;
        while let Some(item) = reader.next()? {
            if let Item::Message { channel, time, data } = item {
                messages.push((channel.topic.clone(), time, data.to_vec()));
            }
        }
        Ok(())
    })();
    (messages, ended)
}

#[test]
fn written_records_are_read_in_order() {
    let file = file();
    let (messages, ended) = read(&file);
    ended.unwrap();
    assert_eq!(messages.len(), 267);
    assert_eq!(messages[0], ("/first".into(), 1000, vec![0; 8]));
    assert_eq!(messages[1], ("/second".into(), 1000, vec![]));
    assert_eq!(messages[265], ("/second".into(), 1198, vec![7; 198]));
    let mut reader = Reader::new(&file[..], ReadLimits::default()).unwrap();
    let Some(Item::Metadata { name, metadata }) = reader.next().unwrap() else { panic!("no metadata") };
    assert_eq!((&*name, &*metadata["key"]), ("it", "value"));
    let Some(Item::Message { channel, .. }) = reader.next().unwrap() else { panic!("no message") };
    let schema = channel.schema.as_ref().unwrap();
    assert_eq!((&*schema.name, &*schema.encoding, &*schema.data), ("a/msg/B", "ros2msg", &b"float64 x"[..]));
}

#[test]
fn a_file_that_is_cut_anywhere_is_read_as_far_as_it_goes() {
    let file = file();
    let (all, _) = read(&file);
    let mut seen = 0;
    for end in 0..file.len() {
        let (messages, ended) = read(&file[..end]);
        assert!(messages.len() >= seen && all.starts_with(&messages), "cut at {end}");
        seen = messages.len();
        match ended {
            Ok(()) => assert_eq!(messages.len(), all.len(), "cut at {end}"),
            Err(Error::NotMcap) => assert!(end < 8),
            Err(Error::EndsEarly { at }) => assert!(at <= end as u64),
            Err(other) => panic!("cut at {end}: {other}"),
        }
    }
    assert_eq!(seen, all.len());
}

#[test]
fn most_flipped_bits_are_noticed() {
    let file = file();
    let mut noticed = 0;
    for byte in 0..file.len() {
        let mut file = file.clone();
        file[byte] ^= 1 << (byte % 8);
        let (_, ended) = read(&file);
        // Indexes are not read, and kinds and lengths of records have no checksum: only the contents of
        // chunks have one.
        noticed += usize::from(ended.is_err());
    }
    assert!(noticed > 500, "{noticed} of {}", file.len());
}

#[test]
fn a_bomb_takes_no_more_memory_than_a_chunk_may() {
    let zeros = vec![0; 64 << 20];
    let mut encoder = lz4_flex::frame::FrameEncoder::new(Vec::new());
    io::Write::write_all(&mut encoder, &zeros).unwrap();
    let bomb = encoder.finish().unwrap();
    for said in [64u64 << 20, 1 << 10, u64::MAX] {
        let mut file = MAGIC.to_vec();
        let head = crate::record::Builder::default().u64(0).u64(0).u64(said).u32(0).text("lz4");
        let chunk = head.u64(bomb.len() as u64);
        let record = crate::record::Builder([chunk.0, bomb.clone()].concat()).record(op::CHUNK);
        file.extend(record);
        let (messages, ended) = read(&file);
        let sentence = ended.unwrap_err().to_string();
        assert!(messages.is_empty());
        assert!(
            sentence.contains("the limit is 1048576") || sentence.contains("another size than it declares"),
            "{sentence}"
        );
    }
}

#[test]
fn lengths_that_a_file_claims_take_no_memory() {
    for opcode in 0..=255 {
        let record = |length: u64| [&MAGIC[..], &[opcode], &length.to_le_bytes(), b"abc"].concat();
        for length in [4, 1 << 19, 1 << 40, u64::MAX] {
            let (_, ended) = read(&record(length));
            let error = ended.unwrap_err();
            assert!(matches!(error, Error::EndsEarly { .. } | Error::TooLarge { .. }), "{opcode}: {error}");
        }
    }
}

#[test]
fn definitions_without_end_are_refused() {
    let mut writer = Writer::new(Vec::new(), "", "").unwrap();
    for number in 0..70 {
        writer.add_schema(&format!("s{number}"), "x", &[0; 1000]).unwrap();
    }
    let (_, ended) = read(&writer.finish().unwrap());
    assert!(ended.unwrap_err().to_string().contains("schemas and channels"));
}
