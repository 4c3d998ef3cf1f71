//! What all programs of this directory share.

use std::path::Path;

/// A failure with the file that it is about, in words.
pub fn reason<E: std::fmt::Display>(path: &Path) -> impl FnOnce(E) -> String {
    move |error| format!("{}: {error}", path.display())
}

/// A pool of one thread: the library shares loops among the threads of the pool that it is called in.
///
/// # Errors
/// If the system has no thread to give.
pub fn alone() -> Result<rayon::ThreadPool, String> {
    rayon::ThreadPoolBuilder::new().num_threads(1).build().map_err(|error| error.to_string())
}
