//! What is fuzzed (`tests/fuzz`), without the tools of fuzzing: every target over its corpus, and over mutations of it that
//! are the same in every run. `NICOLSON_MUTATIONS=100000` tries more of them.
#![allow(clippy::print_stdout, reason = "how much was tried is a result, shown by --nocapture")]

#[path = "fuzz/src/targets.rs"]
mod targets;

use std::fs;
use std::panic::catch_unwind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use targets::{TARGETS, Target};

/// Longest time for one input in a debug build on a busy machine.
const LONGEST: Duration = Duration::from_secs(10);

/// Numbers that look random but are the same in every run.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % bound.max(1)
    }
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzz")
}

/// Seeds of a target, in the order of their names.
fn corpus(target: &Target) -> Vec<(String, Vec<u8>)> {
    let folder = folder().join("corpus").join(target.name);
    let mut paths: Vec<PathBuf> = fs::read_dir(&folder)
        .unwrap_or_else(|error| panic!("{}: {error}", folder.display()))
        .map(|entry| entry.expect("an entry").path())
        .collect();
    paths.sort();
    paths.into_iter().map(|path| (path.display().to_string(), fs::read(&path).expect("a seed"))).collect()
}

/// The quoted words of a dictionary.
fn words(target: &Target) -> Vec<Vec<u8>> {
    let text = fs::read_to_string(folder().join(format!("{}.dict", target.name))).unwrap_or_default();
    let lines = text.lines().filter_map(|line| line.strip_prefix('"')?.strip_suffix('"'));
    lines.map(|word| word.replace("\\\"", "\"").replace("\\\\", "\\").into_bytes()).collect()
}

/// One to four changes as a fuzzer makes them.
fn mutated(seed: &[u8], other: &[u8], words: &[Vec<u8>], numbers: &mut Numbers) -> Vec<u8> {
    const NUMBERS: [&str; 12] = [
        "0",
        "-1",
        "1e308",
        "1e-320",
        "nan",
        "-inf",
        "18446744073709551615",
        "-9223372036854775808",
        "1e400",
        "0.5",
        "7",
        "",
    ];
    let mut bytes = seed.to_vec();
    for _ in 0..=numbers.below(4) {
        let at = numbers.below(bytes.len() + 1);
        let end = (at + numbers.below(30)).min(bytes.len());
        match numbers.below(9) {
            0 => drop(bytes.drain(at..end)),
            1 => {
                let piece = bytes[at..end].to_vec();
                let to = numbers.below(bytes.len() + 1);
                bytes.splice(to..to, piece);
            }
            2 => bytes[at..end].iter_mut().for_each(|byte| *byte = byte.wrapping_add(1)),
            3 if at < bytes.len() => bytes[at] ^= 1 << numbers.below(8),
            4 if at < bytes.len() => bytes[at] = [0, 0xff, 0x7f, 0x80, b'"', b',', b'\n', b'9'][numbers.below(8)],
            5 if !words.is_empty() => drop(bytes.splice(at..end, words[numbers.below(words.len())].clone())),
            6 => {
                let from = numbers.below(other.len() + 1);
                let to = (from + numbers.below(60)).min(other.len());
                bytes.splice(at..at, other[from..to].iter().copied());
            }
            _ => {
                // A number in the text becomes another.
                let digit = |byte: &u8| byte.is_ascii_digit() || b".-+".contains(byte);
                if let Some(start) = bytes[at..].iter().position(|byte| byte.is_ascii_digit()).map(|found| at + found) {
                    let length = bytes[start..].iter().take_while(|byte| digit(byte)).count();
                    bytes.splice(start..start + length, NUMBERS[numbers.below(12)].bytes());
                }
            }
        }
    }
    bytes
}

fn survives(target: &Target, what: &str, bytes: &[u8]) {
    let start = Instant::now();
    let outcome = catch_unwind(|| (target.run)(bytes));
    let took = start.elapsed();
    if outcome.is_err() || took > LONGEST {
        let kept = std::env::temp_dir().join(format!("nicolson-{}-{}", target.name, std::process::id()));
        let _ = fs::write(&kept, bytes);
        panic!("{}: {what}: panicked, or took {took:?}; the input is in {}", target.name, kept.display());
    }
}

/// Runs a target over its corpus and some mutations.
fn tried(name: &str, mutations: usize) {
    let target = TARGETS.iter().find(|target| target.name == name).expect("a target");
    let factor = std::env::var("NICOLSON_MUTATIONS").ok().and_then(|text| text.parse::<usize>().ok());
    let mutations = factor.unwrap_or(mutations);
    let (seeds, words) = (corpus(target), words(target));
    assert!(seeds.len() >= 3, "{name}: {} seeds", seeds.len());
    for (path, bytes) in &seeds {
        survives(target, path, bytes);
    }
    let mut numbers = Numbers(1);
    for _ in 0..mutations {
        let (path, seed) = &seeds[numbers.below(seeds.len())];
        let other = &seeds[numbers.below(seeds.len())].1;
        let bytes = mutated(seed, other, &words, &mut numbers);
        survives(target, path, &bytes);
    }
    println!("{name}: {} seeds, {mutations} mutations", seeds.len());
}

#[test]
fn every_target_has_a_test() {
    let text = include_str!("corpus.rs");
    assert!(TARGETS.iter().all(|target| text.contains(&format!("tried(\"{}\"", target.name))));
}

#[test]
fn scenes() {
    tried("scene", 1500);
}

#[test]
fn expressions() {
    tried("expression", 10_000);
}

#[test]
fn points() {
    tried("points", 10_000);
}

#[test]
fn stl() {
    tried("stl", 10_000);
}

#[test]
fn msh() {
    tried("msh", 10_000);
}

#[test]
fn vtu() {
    tried("vtu", 10_000);
}

#[test]
fn tables() {
    tried("table", 10_000);
}

#[test]
fn checkpoints() {
    tried("checkpoint", 3000);
}

#[test]
fn frames() {
    tried("frame", 10_000);
}
