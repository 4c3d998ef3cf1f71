//! `nicolson new`: commented scenes to begin with.
#![allow(clippy::print_stdout, reason = "this is the command line's output")]

use std::path::{Path, PathBuf};

use clap::Args;

use super::console::complain;
use super::render::report_output;
use super::{DONE, WRONG_INPUT};
use crate::expression::closest;
use crate::output::write_atomically;

/// A scene or study, and the files that it needs beside it.
struct Template {
    name: &'static str,
    what: &'static str,
    text: &'static str,
    beside: &'static [(&'static str, &'static [u8])],
}

const TEMPLATES: [Template; 6] = [
    Template {
        name: "cantilever",
        what: "an elastic beam, clamped and loaded, swinging (2D solid)",
        text: include_str!("templates/cantilever.toml"),
        beside: &[],
    },
    Template {
        name: "impact",
        what: "a rubber bar hits a wall (2D solid, upwinding)",
        text: include_str!("templates/impact.toml"),
        beside: &[],
    },
    Template {
        name: "dam-break",
        what: "a column of water collapses (2D fluid)",
        text: include_str!("templates/dam-break.toml"),
        beside: &[],
    },
    Template {
        name: "stl-part",
        what: "a part from an STL file, clamped and hit (3D solid)",
        text: include_str!("templates/stl-part.toml"),
        beside: &[("bracket.stl", include_bytes!("../../examples/bracket.stl"))],
    },
    Template {
        name: "static",
        what: "a rubber strip under a slow stretch, without inertia (2D solid)",
        text: include_str!("templates/static.toml"),
        beside: &[],
    },
    Template {
        name: "convergence",
        what: "a study with observed orders, for `nicolson sweep`",
        text: include_str!("templates/convergence.toml"),
        beside: &[("swinging-bar.toml", include_bytes!("templates/swinging-bar.toml"))],
    },
];

/// What to begin with, as given on the command line.
#[derive(Debug, Args)]
pub struct NewArguments {
    /// Template; --list tells which there are.
    #[arg(value_name = "TEMPLATE", required_unless_present = "list")]
    template: Option<String>,
    /// File to write [default: TEMPLATE.toml].
    #[arg(value_name = "FILE.toml")]
    file: Option<PathBuf>,
    /// List the templates.
    #[arg(long)]
    list: bool,
}

/// Writes the template, and prints the names of the files.
pub fn run_new(arguments: &NewArguments) -> u8 {
    let Some(wanted) = arguments.template.as_deref().filter(|_| !arguments.list) else {
        TEMPLATES.iter().for_each(|template| println!("{:12} {}", template.name, template.what));
        return DONE;
    };
    let Some(template) = TEMPLATES.iter().find(|template| template.name == wanted) else {
        let names = TEMPLATES.map(|template| template.name);
        let guess = closest(wanted, names).map(|near| format!("did you mean `{near}`? ")).unwrap_or_default();
        complain(&format!("there is no template `{wanted}`; {guess}there are {}", names.join(", ")));
        return WRONG_INPUT;
    };
    let file = arguments.file.clone().unwrap_or_else(|| PathBuf::from(format!("{wanted}.toml")));
    let folder = file.parent().unwrap_or(Path::new(""));
    let mut files = vec![(file.clone(), template.text.as_bytes())];
    files.extend(template.beside.iter().map(|(name, content)| (folder.join(name), *content)));
    // Before anything is written. A dangling link counts as a file.
    if let Some((taken, _)) = files.iter().find(|(file, _)| std::fs::symlink_metadata(file).is_ok()) {
        complain(&format!("{} exists already and is left as it is; give another name, or remove it", taken.display()));
        return WRONG_INPUT;
    }
    for (file, content) in &files {
        if let Err(error) = write_atomically(file, |writer| writer.write_all(content)) {
            return report_output(&error);
        }
        println!("{}", file.display());
    }
    DONE
}
