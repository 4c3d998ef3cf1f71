//! Lines for standard output and standard error that may have gone away, or lie on a disk that is full. The macros of the
//! standard library would panic; these, which take their names in all of [`cli`](super), remember it.

use std::fmt::Arguments;
use std::io::{ErrorKind, Write};
use std::sync::Mutex;

/// Why a line was lost.
static LOST: Mutex<Option<String>> = Mutex::new(None);

/// Writes text; a reader that has seen enough is no mistake.
pub fn write(mut to: impl Write, text: Arguments<'_>) {
    if let Err(error) = to.write_fmt(text)
        && error.kind() != ErrorKind::BrokenPipe
        && let Ok(mut lost) = LOST.lock()
    {
        lost.get_or_insert(error.to_string());
    }
}

/// Why lines were lost since this was last asked.
pub fn lost() -> Option<String> {
    LOST.lock().ok().and_then(|mut lost| lost.take())
}

/// As that of the standard library, without its panic.
macro_rules! print {
    ($($text:tt)*) => { $crate::cli::standard::write(std::io::stdout(), format_args!($($text)*)) };
}

/// As that of the standard library, without its panic.
macro_rules! println {
    () => { $crate::cli::standard::write(std::io::stdout(), format_args!("\n")) };
    ($($text:tt)*) => {
        $crate::cli::standard::write(std::io::stdout(), format_args!("{}\n", format_args!($($text)*)))
    };
}

/// As that of the standard library, without its panic.
macro_rules! eprintln {
    () => { $crate::cli::standard::write(std::io::stderr(), format_args!("\n")) };
    ($($text:tt)*) => {
        $crate::cli::standard::write(std::io::stderr(), format_args!("{}\n", format_args!($($text)*)))
    };
}
