//! One program for all targets; `NICOLSON_FUZZ_TARGET` names the one, the arguments are those of libFuzzer.
#![no_main]

#[path = "targets.rs"]
mod targets;

use std::sync::OnceLock;

use libfuzzer_sys::fuzz_target;

static CHOSEN: OnceLock<fn(&[u8])> = OnceLock::new();

fn choose() -> fn(&[u8]) {
    let wanted = std::env::var("NICOLSON_FUZZ_TARGET").unwrap_or_default();
    let found = targets::TARGETS.iter().find(|target| target.name == wanted);
    found.unwrap_or_else(|| panic!("NICOLSON_FUZZ_TARGET = `{wanted}`: there is no such target")).run
}

fuzz_target!(|data: &[u8]| CHOSEN.get_or_init(choose)(data));
