//! Build script: tells the program which commit it is built from, as `NICOLSON_COMMIT`.
//!
//! Reads the files of `.git` itself: no git is needed, no other owner of the directory matters, and what is
//! read is exactly what is watched. Where there is no repository, or it keeps its references in another
//! format, nothing is set and the program reports an empty commit. Uncommitted changes are not looked at:
//! watching every file would rebuild the program each time.
#![expect(clippy::print_stdout, reason = "this is how a build script talks to cargo")]

use std::env;
use std::fs;
use std::path::{Path, PathBuf};

/// Digits of the commit that are kept.
const DIGITS: usize = 12;

fn main() {
    watch(Path::new("src/build_commit.rs"));
    // Only the repository of this very directory: sources unpacked inside another one are not its commit.
    let root = env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from).unwrap_or_default();
    if let Some(commit) = commit(&root.join(".git")) {
        println!("cargo::rustc-env=NICOLSON_COMMIT={commit}");
    }
}

/// First digits of the commit that is checked out.
fn commit(git: &Path) -> Option<String> {
    let own = own_directory(git)?;
    let head = own.join("HEAD");
    let text = read(&head)?;
    watch(&head);
    let hash = match text.strip_prefix("ref:") {
        Some(name) => resolve(&shared_directory(&own), name.trim())?,
        None => text,
    };
    let is_hash = hash.len() >= DIGITS && hash.bytes().all(|byte| byte.is_ascii_hexdigit());
    is_hash.then(|| hash[..DIGITS].to_owned())
}

/// `.git` itself, or where it points to: in a work tree it is a file, `gitdir: PATH`.
fn own_directory(git: &Path) -> Option<PathBuf> {
    if git.is_dir() {
        return Some(git.to_owned());
    }
    let text = read(git)?;
    watch(git);
    Some(git.parent()?.join(text.strip_prefix("gitdir:")?.trim()))
}

/// Where the branches are: work trees share those of their repository.
fn shared_directory(own: &Path) -> PathBuf {
    read(&own.join("commondir")).map_or_else(|| own.to_owned(), |shared| own.join(shared))
}

/// The commit of a branch: in a file of its own, or in the list of packed ones.
fn resolve(shared: &Path, name: &str) -> Option<String> {
    let loose = shared.join(name);
    if let Some(hash) = read(&loose) {
        watch(&loose);
        return Some(hash);
    }
    // The next commit will make a file of its own: watch for it where it will appear.
    watch(loose.ancestors().skip(1).find(|directory| directory.is_dir())?);
    let packed = shared.join("packed-refs");
    let text = read(&packed)?;
    watch(&packed);
    text.lines().find_map(|line| line.strip_suffix(name)?.strip_suffix(' ')).map(str::to_owned)
}

fn read(path: &Path) -> Option<String> {
    fs::read_to_string(path).ok().map(|text| text.trim().to_owned())
}

/// Only for what exists: cargo takes a missing file for a changed one, and would rebuild every time.
fn watch(path: &Path) {
    println!("cargo::rerun-if-changed={}", path.display());
}
