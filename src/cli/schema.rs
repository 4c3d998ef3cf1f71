//! `nicolson schema`: the keys of a scene for editors and readers.
#![allow(clippy::print_stdout, reason = "this is the command line's output")]

use clap::Args;

use super::DONE;
use crate::scene::schema;

/// Arguments of `schema`.
#[derive(Debug, Args)]
pub struct SchemaArguments {
    /// Print a page of Markdown with all keys instead.
    #[arg(long)]
    reference: bool,
}

/// Prints the schema, or the page.
pub fn schema(arguments: &SchemaArguments) -> u8 {
    if arguments.reference {
        print!("{}", schema::reference());
    } else {
        print!("{}", schema::TEXT);
    }
    DONE
}
