//! The corpus with bytes changed, cut, doubled and mixed: no mutation breaks a promise. A seed makes each run
//! the same; `SIMD_MUTATIONS` asks for more of each file.

use std::fs;
use std::path::Path;

use fastrand::Rng;
use simd_fuzz_targets::TARGETS;

/// Frequent errors of numbers.
const WORDS: &[&str] = &[
    "-1",
    "0",
    "4294967295",
    "18446744073709551615",
    "1e308",
    "nan",
    "inf",
    "\"",
    "<",
    ">",
    "${",
    "}",
    "#",
    "../",
    "\0",
    "%2e",
];

fn mutate(random: &mut Rng, bytes: &mut Vec<u8>, others: &[Vec<u8>]) {
    for _ in 0..random.usize(1..6) {
        let at = random.usize(0..=bytes.len());
        let end = (at + random.usize(0..40)).min(bytes.len());
        match random.u8(0..7) {
            0 => bytes.iter_mut().skip(at).take(1).for_each(|byte| *byte ^= 1 << random.u8(0..8)),
            1 => drop(bytes.drain(at..end)),
            2 => {
                let part = bytes[at..end].to_vec();
                bytes.splice(at..at, part);
            }
            3 => {
                let word = WORDS[random.usize(0..WORDS.len())];
                bytes.splice(at..end, word.bytes());
            }
            4 => {
                let other = &others[random.usize(0..others.len())];
                let from = random.usize(0..=other.len());
                let to = (from + random.usize(0..200)).min(other.len());
                bytes.splice(at..end, other[from..to].iter().copied());
            }
            5 => bytes.truncate(at),
            _ => bytes.iter_mut().skip(at).take(4).for_each(|byte| *byte = random.u8(..)),
        }
    }
}

#[test]
fn no_mutation_of_the_corpus_breaks_a_promise() {
    let each: u32 = std::env::var("SIMD_MUTATIONS").ok().and_then(|text| text.parse().ok()).unwrap_or(60);
    let mut random = Rng::with_seed(6);
    for (name, target) in TARGETS {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("corpus").join(name);
        let mut paths: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
        paths.sort();
        let files: Vec<Vec<u8>> = paths.iter().map(|path| fs::read(path).unwrap()).collect();
        for file in &files {
            for _ in 0..each {
                let mut bytes = file.clone();
                mutate(&mut random, &mut bytes, &files);
                if std::panic::catch_unwind(|| target(&bytes)).is_err() {
                    let found = std::env::temp_dir().join(format!("simd_{name}_found"));
                    fs::write(&found, &bytes).unwrap();
                    panic!("{name} breaks on the bytes in {}", found.display());
                }
            }
        }
    }
}
