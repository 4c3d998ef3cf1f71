//! `nicolson completions` and `nicolson man`: what shells and manuals want to know of the command line.
#![allow(clippy::print_stdout, reason = "this is the command line's output")]

use std::io::Write;
use std::path::{Path, PathBuf};

use clap::{Args, Command};
use clap_complete::Shell;

use super::render::report_output;
use super::{DONE, FAILED};
use crate::output::{OutputError, prepare_directory, write_atomically};

/// For which shell, as given on the command line.
#[derive(Debug, Args)]
pub struct CompletionsArguments {
    /// Shell.
    shell: Shell,
}

/// Where the manual goes, as given on the command line.
#[derive(Debug, Args)]
pub struct ManArguments {
    /// Directory for nicolson.1, nicolson-run.1, ….
    #[arg(value_name = "DIR")]
    directory: PathBuf,
}

/// Prints the script.
pub fn completions(arguments: &CompletionsArguments, mut program: Command) -> u8 {
    let mut script = Vec::new();
    clap_complete::generate(arguments.shell, &mut program, "nicolson", &mut script);
    // A reader that has enough of it closes the pipe.
    match std::io::stdout().write_all(&script) {
        Ok(()) => DONE,
        Err(_) => FAILED,
    }
}

/// Writes the pages, and prints the names of the files.
pub fn man(arguments: &ManArguments, program: &Command) -> u8 {
    let pages =
        std::iter::once(("nicolson".to_owned(), program.clone())).chain(program.get_subcommands().map(|command| {
            let name = format!("nicolson-{}", command.get_name());
            (name.clone(), command.clone().name(name))
        }));
    let written = prepare_directory(&arguments.directory).and_then(|()| {
        pages.map(|(name, command)| page(&name, command, &arguments.directory)).collect::<Result<Vec<_>, _>>()
    });
    match written {
        Ok(files) => {
            files.iter().for_each(|file| println!("{}", file.display()));
            DONE
        }
        Err(error) => report_output(&error),
    }
}

fn page(name: &str, command: Command, directory: &Path) -> Result<PathBuf, OutputError> {
    let file = directory.join(format!("{name}.1"));
    write_atomically(&file, |mut writer| clap_mangen::Man::new(command).render(&mut writer))?;
    Ok(file)
}
