//! The long texts of `--help`. Every line of an example that begins with `nicolson` is parsed by a test.

/// Below the help of the whole program.
pub const PROGRAM: &str = "\
Examples:
  nicolson new cantilever beam.toml     a commented scene to begin with
  nicolson check beam.toml --preview    mistakes, size, cost; a picture of what is held and loaded
  nicolson run beam.toml                results/beam: report.json, tables, frames, plots
  nicolson render results/beam          a picture of the last frame

Exit codes:
  0    done
  2    wrong usage, an impossible scene, or no such run: nothing was computed
  3    a step could not be done at any size, or the disk refused: the results so far are on disk
  130  interrupted (Ctrl-C, SIGTERM): the results so far are on disk, with a checkpoint for `nicolson restart`

Environment:
  RAYON_NUM_THREADS  threads where --threads is not given; results do not depend on it

`nicolson COMMAND --help` says more of each command, with examples. Scenes are TOML; all keys are in src/scene/reference.md.";

/// What it does.
pub const RUN: &str = "\
Run a scene and write its results.

A mistake in the scene is shown with its place and a remedy, and nothing is written. A step that fails is tried again \
shorter; if no step is possible, the results so far are kept, and the message says where and why. Ctrl-C or SIGTERM \
ends the run after the present step, with a checkpoint; a second one ends it at once. SIGUSR1 asks for a checkpoint. Lines on standard error tell time, step over the explicit limit, and what is left; a summary \
on standard output tells energies, errors and where the time went.";
/// How it is used.
pub const RUN_EXAMPLES: &str = "\
Examples:
  nicolson run examples/dam-break.toml
  nicolson run beam.toml --out results/fine --set body.0.spacing=0.005 --set time.step=1e-3
  nicolson run beam.toml --threads 4 --solve-report
  nicolson run beam.toml --quiet --solve-log solves.jsonl

Exit codes: 0 done, 2 wrong scene or usage, 3 failed (results so far on disk), 130 interrupted (likewise).";

/// What it does.
pub const RESTART: &str = "\
Go on from a checkpoint, as if the run had never ended.

PATH is a checkpoint, or a directory of results, whose newest checkpoint that can be read is taken. Tables, index of \
frames and solve log are cut back to it and continued; the files end as those of a run in one piece, byte for byte, with \
any number of threads. A checkpoint is left by a run that is interrupted (Ctrl-C, SIGTERM) or fails, by one that gets \
SIGUSR1, and as often as the table [checkpoint] of its scene says.

The scene is that of the checkpoint. One that differs is refused with the keys that do, unless forced: then the state \
goes on, and scheme and solvers begin anew. The keys `time.end`, `output` and `checkpoint` may change.";
/// How it is used.
pub const RESTART_EXAMPLES: &str = "\
Examples:
  nicolson restart results/beam
  nicolson restart results/beam --set time.end=2.0
  nicolson restart results/beam/checkpoints/step-0000000200.safetensors --out results/branch
  nicolson restart results/beam --out results/finer-steps --set time.step=1e-3 --force

Exit codes: 0 done, 2 no such checkpoint, a damaged or changed one, 3 failed, 130 interrupted.";

/// What it does.
pub const CHECK: &str = "\
Validate a scene and predict its cost; runs nothing.

Prints numbers of particles, unknowns and steps, memory, the explicit step limit, and the explicit steps that an \
implicit run avoids; for bodies cut out of a lattice or read from a file also volumes, masses and open edges.";
/// How it is used.
pub const CHECK_EXAMPLES: &str = "\
Examples:
  nicolson check examples/bracket.toml
  nicolson check examples/bracket.toml --preview bracket.png
  nicolson check beam.toml --set body.0.spacing=0.001

Exit codes: 0 the scene can be run, 2 it cannot, 3 the picture could not be written.";

/// What it does.
pub const JACOBIAN: &str = "\
Check the analytic Jacobian of a scene: Taylor remainders per block and term, and differences.

Remainders of a correct Jacobian fall with the square of the perturbation. Scenes of up to 20 000 particles are also \
compared with differences, entry by entry.";
/// How it is used.
pub const JACOBIAN_EXAMPLES: &str = "\
Examples:
  nicolson jacobian examples/impact-hyperelastic.toml
  nicolson jacobian examples/csm1.toml --json
  nicolson jacobian examples/csm1.toml --export-tangent tangent.mtx

Exit codes: 0 it agrees, 2 wrong scene or usage, 3 it does not agree, or the file could not be written.";

/// What it does.
pub const RENDER: &str = "\
Draw frames of a run: a picture (PNG, SVG) or an animation (GIF).

Particles are as large as their volume, coloured by a field, with a bar, the title and the time. The run may still be \
going on.";
/// How it is used.
pub const RENDER_EXAMPLES: &str = "\
Examples:
  nicolson render results/dam-break
  nicolson render results/dam-break --field velocity --component x --frame 3 --out front.png
  nicolson render results/bracket --view iso --perspective --out bracket.gif
  nicolson render results/csm3 --field displacement --range 0,0.13 --reference

Exit codes: 0 done, 2 no such run or field, 3 the disk refused.";

/// What it does.
pub const PLOT: &str = "\
Plot a probe or a quantity of the history of several runs together.

Columns are those of probes.csv and history.csv; without --probe and --quantity the message names them.";
/// How it is used.
pub const PLOT_EXAMPLES: &str = "\
Examples:
  nicolson plot results/coarse results/fine --probe tip.uy
  nicolson plot results/a results/b --quantity total --quantity kinetic --out energy.png

Exit codes: 0 done, 2 no such run or column, 3 the disk refused.";

/// What it does.
pub const REPORT: &str = "\
Write one HTML file that shows a run: ledger, convergence, histories, particles in motion.

It needs no network, stays below 5 MB, and shows the particles with WebGL: play, pause, scrub, choose a field.";
/// How it is used.
pub const REPORT_EXAMPLES: &str = "\
Examples:
  nicolson report results/dam-break
  nicolson report results/dam-break --out dam-break.html

Exit codes: 0 done, 2 no such run, 3 the disk refused.";

/// What it does.
pub const LIST: &str = "\
List schemes, solvers, laws and kernels, and the scenes of a directory.";
/// How it is used.
pub const LIST_EXAMPLES: &str = "\
Examples:
  nicolson list
  nicolson list my/scenes";

/// What it does.
pub const SWEEP: &str = "\
Run one scene with many values of its keys.

A study file names a scene and what varies: [grid] (all combinations), [[case]] (row by row), or [convergence] \
(refinement, with observed orders). Every case has its directory, case-0001 and so on, with the results of a run and \
what was overridden. All scenes are validated before the first of them runs.

A case that needs more memory than there is is refused, and fewer than --jobs run at the same time where the largest do not \
fit beside each other.

Cases whose report says that the very same scene was completed are skipped: start a broken sweep again to go on. A case \
that was interrupted goes on from its checkpoint. One that fails stops no other; it is run again next time unless --keep-failed is given. At the end the reports are \
collected into cases.csv. With --index N (from 1) only one case is run and nothing is collected: for job arrays, after \
which `nicolson collect` makes the table.";
/// How it is used.
pub const SWEEP_EXAMPLES: &str = "\
Examples:
  nicolson sweep examples/studies/dam-break-grid.toml --dry-run
  nicolson sweep examples/studies/dam-break-grid.toml --jobs 4
  nicolson sweep examples/studies/manufactured-orders.toml --out results/orders
  nicolson sweep study.toml --index 7 --threads 8

A study:
  scene = \"beam.toml\"
  [grid]
  body.0.spacing = [0.02, 0.01]
  time.scheme = [\"crank_nicolson\", \"energy_momentum\"]

A convergence study:
  scene = \"beam.toml\"
  [convergence]
  quantity = \"probes.tip.displacement.1\"
  sizes = [0.02, 0.01, 0.005]
  [convergence.refine]
  body.0.spacing = 1.0     # times the size
  time.step = 0.1

A job of a SLURM array (sbatch --array=1-12):
  nicolson sweep study.toml --index $SLURM_ARRAY_TASK_ID --threads $SLURM_CPUS_PER_TASK

Exit codes: 0 all cases are completed, 2 wrong study or scene (nothing was run), 3 a case failed, 130 interrupted.";

/// What it does.
pub const COLLECT: &str = "\
Collect the reports of a study into one table.

A row for every case: its number, the varied keys, status, time, particles, unknowns, steps, iterations, wall-clock \
seconds, energy drift, errors and the final state of probes. Columns are named like --set keys and paths in \
report.json. A convergence study also gets its orders: convergence.csv, and a picture. A sweep does this at its end.";
/// How it is used.
pub const COLLECT_EXAMPLES: &str = "\
Examples:
  nicolson collect results/dam-break-grid
  nicolson collect results/dam-break-grid --out table.csv

Exit codes: 0 done, 2 no such study, 3 the disk refused.";

/// What it does.
pub const NEW: &str = "\
Write a commented scene to begin with.

Templates are complete: they can be checked and run as they are. Files that exist are never overwritten.";
/// How it is used.
pub const NEW_EXAMPLES: &str = "\
Examples:
  nicolson new --list
  nicolson new cantilever
  nicolson new stl-part parts/hook.toml

Exit codes: 0 done, 2 no such template, or a file that exists, 3 the disk refused.";

/// What it does.
pub const COMPLETIONS: &str = "\
Print a script that completes commands, options and files in a shell.

Put it where the shell looks for such scripts, or evaluate it when the shell starts.";
/// How it is used.
pub const COMPLETIONS_EXAMPLES: &str = "\
Examples:
  nicolson completions bash
  nicolson completions zsh
  nicolson completions fish
  nicolson completions powershell
  nicolson completions elvish

Where they go:
  bash        nicolson completions bash > ~/.local/share/bash-completion/completions/nicolson
  zsh         nicolson completions zsh > DIR/_nicolson, with DIR in $fpath
  fish        nicolson completions fish > ~/.config/fish/completions/nicolson.fish
  powershell  nicolson completions powershell | Out-String | Invoke-Expression
  elvish      eval (nicolson completions elvish | slurp)";

/// What it does.
pub const MAN: &str = "\
Write manual pages, one for the program and one for every command.

They say what `--help` says.";
/// How it is used.
pub const MAN_EXAMPLES: &str = "\
Examples:
  nicolson man ~/.local/share/man/man1

Exit codes: 0 done, 3 the disk refused.";

/// What it does.
pub const SCHEMA: &str = "\
Print the JSON Schema of scenes, with which editors complete and check keys.

Editors with a TOML language server (taplo, Even Better TOML) take it from the first line of a scene: \
`#:schema ./scene.schema.json`. With --reference a page of Markdown with all keys is printed instead.";
/// How it is used.
pub const SCHEMA_EXAMPLES: &str = "\
Examples:
  nicolson schema
  nicolson schema --reference

As a file:
  $ nicolson schema > scene.schema.json";
