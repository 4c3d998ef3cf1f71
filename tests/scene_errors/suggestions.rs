//! Typing mistakes and what is suggested for them: keys, choices, names, functions, units.

use super::check;

#[test]
fn keys() {
    check(&[
        ("gravity = [0.0", "▶gravty = [0.0", "unknown key `gravty`", "did you mean `gravity`?"),
        ("title = \"good\"", "▶tilte = \"good\"", "unknown key `tilte`", "did you mean `title`?"),
        ("smoothing = 1.2", "▶smooting = 1.2", "unknown key `smooting`", "did you mean `smoothing`?"),
        ("kernel = \"cubic_spline\"", "▶kernal = \"cubic_spline\"", "unknown key `kernal`", "did you mean `kernel`?"),
        ("tau_v = 0.5", "▶tauv = 0.5", "unknown key `tauv`", "did you mean `tau_v`?"),
        ("max_iterations = 25", "▶max_iter = 25", "unknown key `max_iter`", "did you mean `max_iterations`?"),
        ("restart = 50", "▶restarts = 50", "unknown key `restarts`", "did you mean `restart`?"),
        ("interval = 0.05", "▶intervall = 0.05", "unknown key `intervall`", "did you mean `interval`?"),
        (
            "density = 1000.0, gamma",
            "▶densty = 1000.0, density = 1000.0, gamma",
            "unknown key `densty`",
            "did you mean `density`?",
        ),
        (
            "youngs_modulus = 1e6",
            "▶young_modulus = 1e6, youngs_modulus = 1e6",
            "unknown key `young_modulus`",
            "did you mean `youngs_modulus`?",
        ),
        (
            "poissons_ratio = 0.3",
            "▶poisson_ratio = 0.3, poissons_ratio = 0.3",
            "unknown key `poisson_ratio`",
            "did you mean `poissons_ratio`?",
        ),
        ("[exact]", "[▶outptu]\n[exact]", "unknown key `outptu`", "did you mean `output`?"),
        ("[exact]", "[[▶bondary]]\n[exact]", "unknown key `bondary`", "did you mean `boundary`?"),
    ]);
}

#[test]
fn choices() {
    check(&[
        ("layout = \"vertex\"", "layout = ▶\"vertx\"", "`vertx` is not one", "did you mean `vertex`?"),
        ("kernel = \"cubic_spline\"", "kernel = ▶\"wendland\"", "`wendland` is not one", "did you mean `wendland_c2`?"),
        ("face = \"upper_x\"", "face = ▶\"uper_x\"", "`uper_x` is not one", "did you mean `upper_x`?"),
        ("scheme = \"crank_nicolson\"", "scheme = ▶\"crank-nicolson\"", "is not one", "did you mean `crank_nicolson`?"),
        ("solver = \"gmres\"", "solver = ▶\"gmers\"", "`gmers` is not one", "did you mean `gmres`?"),
        ("\"pressure\", \"velocity\"", "▶\"presure\", \"velocity\"", "`presure` is not", "did you mean `pressure`?"),
        ("fix = [\"x\"]", "fix = [▶\"X\"]", "`X` is not one", "x, y, z"),
        ("select.where = \"Y > 2.4\"", "select = ▶\"al\"", "`al` is not one", "did you mean `all`?"),
        ("select.where", "select.▶were", "`were` is not one", "did you mean `where`?"),
        ("select.half_space = {", "select.▶halfspace = {", "`halfspace` is not one", "did you mean `half_space`?"),
        (
            "material.linear_volumetric",
            "material.▶linear_volumetrc",
            "`linear_volumetrc` is not one",
            "did you mean `linear_volumetric`?",
        ),
        ("title = \"good\"", "title = \"good\"\nunits = ▶\"mm-ton-s\"", "`mm-ton-s` is not one", "`mm-tonne-s`?"),
    ]);
}

#[test]
fn names_and_functions() {
    const LID: &str = "displacement = { y = \"0.1*sin(t)\" }";
    check(&[
        ("name = \"lid\"\nbody = \"column\"", "name = \"lid\"\nbody = ▶\"colum\"", "no body 'colum'", "mean 'column'?"),
        ("body = \"block\"\n[exact]", "body = ▶\"Block\"\n[exact]", "no body 'Block'", "did you mean 'block'?"),
        (LID, "displacement = { y = \"0.1*▶sine(t)\" }", "unknown function `sine`", "did you mean `sin(…)`?"),
        (LID, "displacement = { y = \"0.1*▶sqr(t)\" }", "unknown function `sqr`", "did you mean `sqrt(…)`?"),
        (LID, "displacement = { y = \"0.1*sin(▶time)\" }", "unknown name `time`", "the time is `t`"),
        (LID, "displacement = { y = \"0.1*sin(▶x)\" }", "unknown name `x`", "use `X`"),
        (LID, "displacement = { y = \"sin(▶PI*t)\" }", "unknown name `PI`", "write `pi`"),
    ]);
}
