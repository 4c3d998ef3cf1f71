//! The `nicolson` command. Everything it does is in [`nicolson::cli`], where it is tested.

use std::process::ExitCode;

fn main() -> ExitCode {
    ExitCode::from(nicolson::cli::run(std::env::args_os()))
}
