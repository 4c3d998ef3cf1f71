//! Whatever is written, nothing panics.

use std::path::Path;

use super::{GOOD, set_up};

/// Numbers that look random but are the same in every run.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, bound: usize) -> usize {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as usize % bound
    }
}

#[test]
fn no_mutation_of_a_scene_panics() {
    const ALPHABET: &[u8] = b"0123456789.eE+-*/^()[]{}=\"'#,_ \n\t\\XYZtinfnanabcxyz\x00\x7f\xc3\xa9<>&|!";
    let mut numbers = Numbers(1);
    let mut good = 0;
    for _ in 0..3000 {
        let mut bytes = GOOD.as_bytes().to_vec();
        for _ in 0..=numbers.below(4) / 2 {
            let at = numbers.below(bytes.len());
            match numbers.below(8) {
                0 => drop(bytes.remove(at)),
                1 => bytes.insert(at, ALPHABET[numbers.below(ALPHABET.len())]),
                2 => bytes[at] = ALPHABET[numbers.below(ALPHABET.len())],
                3 => {
                    let end = (at + numbers.below(40)).min(bytes.len());
                    bytes.drain(at..end);
                }
                // Most mutations of other kinds end in the parser; another digit goes further.
                4..=6 => {
                    if let Some(digit) = bytes[at..].iter_mut().find(|byte| byte.is_ascii_digit()) {
                        *digit = b"0123456789-e"[numbers.below(12)];
                    }
                }
                _ => {
                    let end = (at + numbers.below(40)).min(bytes.len());
                    let piece = bytes[at..end].to_vec();
                    let to = numbers.below(bytes.len());
                    bytes.splice(to..to, piece);
                }
            }
        }
        let text = String::from_utf8_lossy(&bytes);
        match set_up(&text, "scene.toml", Path::new("/nowhere"), &[]) {
            Ok(()) => good += 1,
            Err(errors) => {
                assert!(!errors.is_empty(), "{text}");
                assert!(errors.iter().all(|error| !error.message.is_empty() && !error.remedy.is_empty()));
                assert!(!errors.to_string().is_empty());
            }
        }
    }
    assert!(good > 100, "only {good} mutations were harmless: the loop would test nothing but the parser");
}

#[test]
fn no_override_panics() {
    let keys = [
        "body.0.spacing",
        "body.1.counts.0",
        "time",
        "boundary.0.select",
        "a.b.c",
        "body.0.material.x",
        "probe.0.at.9",
    ];
    let values = ["", "1", "[", "\"", "{}", "[[]]", "{ a = { b = 1 } }", "nan", "1979-05-27", "\n", "é", "all", "9e99"];
    for key in keys {
        for value in values {
            let changes = [(key.to_owned(), value.to_owned()), ("time.end".to_owned(), "1".to_owned())];
            if let Err(errors) = set_up(GOOD, "scene.toml", Path::new(""), &changes) {
                assert!(!errors.is_empty() && !errors.to_string().is_empty());
            }
        }
    }
}
