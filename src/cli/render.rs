//! `nicolson render`: pictures and animations of a run.
#![allow(clippy::print_stdout, reason = "this is the command line's output")]

use std::path::PathBuf;

use clap::Args;

use super::console::complain;
use super::{DONE, FAILED, WRONG_INPUT};
use crate::output::{FrameChoice, OutputError, Rendering, View};

/// What to draw, as given on the command line.
#[derive(Debug, Args)]
pub struct RenderArguments {
    /// Directory of a run, finished or not.
    #[arg(value_name = "RUN_DIR")]
    run: PathBuf,
    /// Field to colour by [default: von_mises, else pressure].
    #[arg(long, value_name = "FIELD")]
    field: Option<String>,
    /// Component: magnitude, x, y, z; for tensors von_mises, trace, xx, xy, ….
    #[arg(long, value_name = "NAME")]
    component: Option<String>,
    /// Frame, counted from 0; or first, last, all [default: last; all for a GIF].
    #[arg(long, value_name = "N|all", value_parser = frame)]
    frame: Option<FrameChoice>,
    /// Picture to write: .png, .svg or .gif [default: FIELD-FRAME.png or FIELD.gif in RUN_DIR].
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
    /// From where space is seen: iso, front, back, left, right, top, bottom, or AZIMUTH,ELEVATION in degrees.
    #[arg(long, value_name = "VIEW", allow_hyphen_values = true)]
    view: Option<String>,
    /// What is farther is smaller (three dimensions).
    #[arg(long)]
    perspective: bool,
    /// Width in pixels [default: what suits the shape].
    #[arg(long, value_name = "PIXELS")]
    width: Option<usize>,
    /// Height in pixels [default: what suits the shape].
    #[arg(long, value_name = "PIXELS")]
    height: Option<usize>,
    /// Values at the ends of the colour bar [default: those of the frames drawn].
    #[arg(long, value_name = "LOW,HIGH", value_parser = range, allow_hyphen_values = true)]
    range: Option<(f64, f64)>,
    /// Also draw the outline of the reference configuration (two dimensions).
    #[arg(long)]
    reference: bool,
    /// Frames of a GIF per second [default: all frames within six seconds].
    #[arg(long, value_name = "RATE")]
    rate: Option<f64>,
}

fn frame(text: &str) -> Result<FrameChoice, String> {
    match text {
        "first" => Ok(FrameChoice::One(0)),
        "last" => Ok(FrameChoice::Last),
        "all" => Ok(FrameChoice::All),
        number => {
            number.parse().map(FrameChoice::One).map_err(|_| "give a number from 0, first, last or all".to_owned())
        }
    }
}

fn range(text: &str) -> Result<(f64, f64), String> {
    let ends = text.split_once(',').and_then(|(low, high)| Some((low.trim().parse().ok()?, high.trim().parse().ok()?)));
    ends.ok_or_else(|| "give two numbers, as in --range 0,1e6".to_owned())
}

/// Draws, and prints the names of the files.
pub fn render(arguments: RenderArguments) -> u8 {
    let run = arguments.run.clone();
    match rendering(arguments).and_then(|rendering| rendering.write(&run)) {
        Ok(files) => {
            files.iter().for_each(|file| println!("{}", file.display()));
            DONE
        }
        Err(error) => report_output(&error),
    }
}

fn rendering(arguments: RenderArguments) -> Result<Rendering, OutputError> {
    let RenderArguments {
        field, component, frame, out, view, perspective, width, height, range, reference, rate, ..
    } = arguments;
    let mut view = view.as_deref().map(View::parse).transpose()?;
    if perspective {
        view = Some(View { perspective, ..view.unwrap_or_default() });
    }
    Ok(Rendering { field, component, frames: frame, out, view, width, height, range, reference, rate })
}

/// Prints an error and returns its exit code.
pub fn report_output(error: &OutputError) -> u8 {
    complain(&error.to_string());
    if error.is_input() { WRONG_INPUT } else { FAILED }
}
