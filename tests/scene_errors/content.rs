//! Mistakes of meaning: bodies, materials, conditions, numerics.

use super::{GOOD, check, errors};

#[test]
fn bodies() {
    const NO_SHAPE: &str = "▶[[body]]\nname = \"block\"\ncounts = [4, 5]\nlayout = \"cell\"\n";
    check(&[
        ("spacing = 0.25", "spacing = ▶0", "`spacing` is 0", "positive"),
        ("spacing = 0.25", "spacing = ▶-0.25", "`spacing` is -0.25", "positive"),
        ("spacing = 0.25", "spacing = ▶nan", "`spacing` is NaN", "positive"),
        ("spacing = 0.25", "spacing = ▶inf", "`spacing` is inf", "positive"),
        ("spacing = 0.25", "spacing = ▶30", "0 particle(s) along x", "2.5 m long"),
        ("spacing = 0.25", "spacing = ▶1e-9", "more than 100000", "larger spacing"),
        ("spacing = 0.25", "spacing = ▶1e-300", "more than 100000", "larger spacing"),
        ("counts = [4, 5]", "counts = ▶[9000000000000000000, 9000000000000000000]", "8.100e37", "smaller counts"),
        ("counts = [4, 5]", "counts = ▶[4, 1]", "1 particle(s) along y", "more counts"),
        ("counts = [4, 5]", "counts = ▶[4, 5]\nspacing = 0.1", "both set the lattice", "remove one"),
        ("[[body]]\nname = \"block\"\ncounts = [4, 5]", "▶[[body]]\nname = \"block\"", "neither `spacing` nor", "0.1"),
        (
            "shape.box = { lower = [0.0, 0.0], upper = [2.5, 2.5] }",
            "▶shape.box = { lower = [0, 0], upper = [2, 0] }",
            "no extent along y: from 0 to 0",
            "`upper` larger",
        ),
        ("upper = [2.5, 2.5]", "upper = [2.5, ▶nan]", "`upper` is NaN", "finite"),
        (
            "[[body]]\nname = \"block\"\ncounts = [4, 5]\nlayout = \"cell\"\nshape.box = { lower = [5.0, 0.0], upper = [6.0, 1.25] }",
            NO_SHAPE,
            "no shape",
            "shape.box",
        ),
        (
            "counts = [4, 5]",
            "counts = [4, 5]\npoints = ▶{ file = \"a.csv\", spacing = 0.1 }",
            "one of shape, points and mesh",
            "remove",
        ),
        ("smoothing = 1.2", "smoothing = ▶0.5", "does not reach the neighbours", "at least 0.600"),
        ("smoothing = 1.2", "smoothing = ▶99", "too many neighbours", "at most 10"),
        ("counts = [4, 5]", "counts = ▶[60, 2]", "does not reach the neighbours", "at least"),
    ]);
    let twins = errors(&GOOD.replace("name = \"block\"", "name = \"column\""));
    assert_eq!((twins[0].line, twins[0].column), (Some(14), Some(8)));
    assert!(
        twins[0].message.contains("another body is already named 'column'") && twins[0].remedy.contains("own name")
    );
    let without = &GOOD[..GOOD.find("[[body]]").unwrap()];
    let found = errors(&format!("{without}[time]\nend = 1.0\nstep = 0.1\n"));
    assert_eq!((found.len(), found[0].line), (1, Some(1)));
    assert!(found[0].message.contains("no body") && found[0].remedy.contains("[[body]]"));
}

#[test]
fn materials() {
    const MODULUS: &str = "youngs_modulus = 1e6, poissons_ratio = 0.3";
    check(&[
        ("density = 1000.0, gamma", "density = ▶-1000.0, gamma", "`density` is -1000", "positive"),
        ("density = 1000.0, gamma", "density = ▶0, gamma", "`density` is 0", "positive"),
        ("gamma = 7.0", "gamma = ▶0.5", "`gamma` is 0.5", "at least 1"),
        ("poissons_ratio = 0.3", "poissons_ratio = ▶0.5", "`poissons_ratio` is 0.5", "below 0.5"),
        ("poissons_ratio = 0.3", "poissons_ratio = ▶-1", "`poissons_ratio` is -1", "above -1"),
        ("youngs_modulus = 1e6", "youngs_modulus = ▶-1e6", "`youngs_modulus` is -1000000", "positive"),
        ("wave_speed = 10.0", "wave_speed = ▶0", "`wave_speed` is 0", "positive"),
        ("wave_speed = 10.0", "wave_speed = ▶1e200", "bulk modulus becomes inf", "SI units"),
        ("wave_speed = 10.0", "wave_speed = 10.0, bulk_modulus = ▶1e6", "more than one way", "one of the three"),
        (MODULUS, "youngs_modulus = ▶1e6", "needs `poissons_ratio`", "add `poissons_ratio"),
        (MODULUS, "poissons_ratio = ▶0.3", "needs `youngs_modulus`", "add `youngs_modulus"),
        (
            "linear_volumetric = { density = 1000.0, youngs_modulus = 1e6, poissons_ratio = 0.3 }",
            "linear_volumetric = ▶{ density = 1000.0 }",
            "has no modulus",
            "one of the three",
        ),
        (
            "volumetric = { density = 1000.0, gamma",
            "volumetric = ▶{ density = 1e-320, gamma",
            "the density of the material is 1e-320 kg/m³",
            "usual size",
        ),
        (
            "volumetric = { density = 1000.0, gamma",
            "volumetric = ▶{ density = 1e100, gamma",
            "the density of the material is 1e100 kg/m³",
            "usual size",
        ),
    ]);
}

#[test]
fn conditions() {
    const BASE: &str = "select.half_space = { point = [0.0, 0.0], normal = [0.0, -1.0] }";
    const LID: &str = "select.where = \"Y > 2.4\"\ndisplacement = { y = \"0.1*sin(t)\" }";
    const WHERE: &str = "select.where = \"Y > 2.4\"";
    const MOVED: &str = "displacement = { y = \"0.1*sin(t)\" }";
    const NOTHING: &str = "▶[[boundary]]\nname = \"side\"\nbody = \"block\"\nselect = \"all\"\n";
    const SIDE: &str = "[[boundary]]\nname = \"side\"\nbody = \"block\"\nselect.box = { lower = [5.0, 0.0], upper = [5.2, 9.0] }\nfix = [\"x\"]\n";
    const PULL: &str = "body = \"column\"\nface = \"upper_x\"\n";
    check(&[
        (
            BASE,
            "▶select.half_space = { point = [0, -1], normal = [0, -1] }",
            "'base' selects no particle: lowest Y is 0",
            "Y = 0",
        ),
        (BASE, "▶select.half_space = { point = [9, 9], normal = [1, 1] }", "the nearest one is", "move `point`"),
        (BASE, "select.half_space = { point = [0, 0], normal = ▶[0, 0] }", "normal is zero", "direction"),
        (WHERE, "▶select.where = \"Y > 2.6\"", "X from 0 to 2.5, Y from 0 to 2.5", "widen"),
        (WHERE, "select.where = ▶\"Y > t\"", "cannot depend on the time", "X, Y, Z alone"),
        (WHERE, "▶select.where = \"sqrt(-1)\"", "not a number at (X = 0, Y = 0)", "roots"),
        ("upper = [5.2, 9.0]", "upper = ▶[4.0, 9.0]", "ends before it begins along x", "at least as large"),
        (LID, "select = \"all\"\ndisplacement = { y = ▶1 }", "contradicts boundary 'base'", "narrow"),
        (MOVED, "fix = [\"y\"]\ndisplacement = { y = ▶1 }", "both fixed and moved", "remove it"),
        (MOVED, "displacement = { y = ▶\"ln(t)\" }", "the displacement is -inf at t = 0", "0/0"),
        (MOVED, "displacement = { y = ▶\"sqrt(t)\" }", "its rate is inf at t = 0", "0/0"),
        (SIDE, NOTHING, "boundary 'side' constrains nothing", "add `fix"),
        ("body = \"block\"\nselect.box", "body = ▶\"blok\"\nselect.box", "no body 'blok'", "did you mean 'block'?"),
        ("name = \"lid\"", "name = ▶\"\"", "not a name for a boundary", "printable"),
        ("name = \"lid\"", "name = ▶\"base\"", "another boundary is already named 'base'", "own name"),
        (
            PULL,
            "body = \"column\"\nface = ▶\"upper_x\"\nselect.where = \"X < 1\"\n",
            "acts on no particle",
            "widen `select`",
        ),
        (
            "hydrostatic = { level = 2.5 }",
            "hydrostatic = ▶{ level = -1 }",
            "all particles lie above the level -1",
            "height",
        ),
        (
            "displacement = [0, \"0.001*Y\"]",
            "displacement = [0, ▶\"0/0\"]",
            "the initial displacement is NaN at (X = 0",
            "0/0",
        ),
        (
            "velocity = [\"0\", \"-1\"]",
            "velocity = [▶\"1/X\", 0]",
            "the initial velocity is inf at (X = 0, Y = 0)",
            "0/0",
        ),
        ("velocity = [\"0\", \"-1\"]", "velocity = [▶nan, 0]", "NaN is not a finite number", "finite"),
        (
            "hydrostatic = { level = 2.5 }",
            "pressure = ▶\"1e9\"",
            "impossible: in body 'block' it must be below",
            "stiffer",
        ),
        ("hydrostatic = { level = 2.5 }", "pressure = ▶-1e9", "in body 'column' it must be above", "stiffer"),
        (
            "at = [2.5, 2.5]",
            "at = ▶[3.0, 2.5]",
            "probe 'tip' at (X = 3, Y = 2.5) lies outside",
            "body 'column' has X from 0 to 2.5",
        ),
        (
            "hydrostatic = { level = 2.5 }",
            "pressure = 1\nhydrostatic = ▶{ level = 2.5 }",
            "both set the initial",
            "remove one",
        ),
        ("at = [5.5, 0.5]", "at = ▶[1.0, 0.5]", "lies outside", "'block' has X from 5 to 6"),
        ("name = \"foot\"", "name = ▶\"tip\"", "another probe is already named 'tip'", "own name"),
        ("pressure = \"1000*t\"", "pressure = ▶\"1/(t-1)\"", "the exact pressure is inf at t = 1", "0/0"),
    ]);
}

#[test]
fn numerics() {
    const SCHEME: &str = "scheme = \"crank_nicolson\"";
    check(&[
        ("end = 1.0", "end = ▶-1.0", "`end` is -1", "positive"),
        ("end = 1.0", "end = ▶inf", "`end` is inf", "positive"),
        ("step = 0.05\n", "step = ▶0\n", "`step` is 0", "positive"),
        ("step = 0.05\n", "step = ▶-0.05\n", "`step` is -0.05", "positive"),
        ("step = 0.05\n", "step = 0.05\ncfl = ▶0.3\n", "both set the step", "remove one"),
        ("step = 0.05\nscheme = \"crank", "scheme = ▶\"crank", "an implicit scheme needs a step", "add `step = 0.05`"),
        ("step = 0.05\nscheme = \"crank_nicolson\"", "cfl = ▶3\nscheme = \"static\"", "no CFL number", "give `step`"),
        (SCHEME, "scheme = \"crank_nicolson\"\ntheta = ▶0.6", "`theta` belongs to", "scheme = \"theta\""),
        (SCHEME, "scheme = \"theta\"\ntheta = ▶0.4", "`theta` is 0.4", "between 0.5"),
        (SCHEME, "scheme = \"rk4\"\nspectral_radius = ▶0.6", "belongs to the scheme `generalised_alpha`", "remove it"),
        (SCHEME, "scheme = \"generalised_alpha\"\nspectral_radius = ▶2", "`spectral_radius` is 2", "between 0 and 1"),
        (SCHEME, "scheme = \"rk4\"\nrkc_stages = ▶\"courant\"", "belongs to the scheme `rkc`", "scheme = \"rkc\""),
        (SCHEME, "scheme = \"rkc\"\nrkc_stages = ▶\"couran\"", "`couran`", "did you mean `courant`?"),
        (SCHEME, "scheme = \"static\"\nadaptive = ▶{ tolerance = 1e-4 }", "`static` has none", "use `effort`"),
        (SCHEME, "scheme = \"rk4\"\neffort = ▶{}", "no Newton iterations", "use `adaptive`"),
        (SCHEME, "adaptive = { tolerance = 1e-4 }\neffort = ▶{}", "both control the step", "remove one"),
        (SCHEME, "effort = { few = ▶0 }", "`few` is 0", "at least 1"),
        (SCHEME, "effort = { few = 5, many = ▶5 }", "a step of 5 iterations is easy", "larger number than `few`"),
        (SCHEME, "effort = { growth = ▶1.0 }", "`growth` is 1", "more than 1"),
        (SCHEME, "effort = { cut = ▶1.0 }", "`cut` is 1", "between 0 and 1"),
        (SCHEME, "effort = { ▶fwe = 5 }", "unknown key `fwe`", "did you mean `few`?"),
        (SCHEME, "maximum_step = ▶1.0", "nothing makes grow", "add `adaptive` or `effort`"),
        (SCHEME, "effort = {}\nmaximum_step = ▶0.01", "less than the step 0.05", "larger maximum"),
        (
            "tau_p = 0.1\n[time]\nend = 1.0\nstep = 0.05\nscheme = \"crank_nicolson\"",
            "tau_p = ▶0.1\n[time]\nend = 1.0\nstep = 0.05\nscheme = \"energy_momentum\"",
            "`tau_p` couples the volume ratios",
            "set `tau_p = 0`",
        ),
        (
            "tau_p = 0.1\n[time]\nend = 1.0\nstep = 0.05\nscheme = \"crank_nicolson\"\n[newton]\nmax_iterations = 25\nline_search = \"backtracking\"\nunknowns = \"auto\"",
            "[time]\nend = 1.0\nstep = 0.05\nscheme = \"energy_momentum\"\n[newton]\nunknowns = ▶\"full\"",
            "velocities alone",
            "`unknowns = \"auto\"`",
        ),
        (SCHEME, "scheme = \"rkc\"\nadaptive = { tolerance = ▶0 }", "`tolerance` is 0", "between 0 and 1"),
        (SCHEME, "minimum_step = ▶1.0", "`minimum_step` is 1, more than the step", "smaller minimum"),
        ("max_iterations = 25", "max_iterations = ▶0", "`max_iterations` is 0", "at least 1"),
        ("line_search = \"backtracking\"", "line_search = ▶\"armijo\"", "`armijo`", "backtracking"),
        ("unknowns = \"auto\"", "unknowns = ▶\"velocity\"", "`tau_p` couples", "velocity_jacobian"),
        (
            "line_search = \"backtracking\"",
            "tangent = \"broyden\"\nline_search = ▶\"trust_region\"",
            "a trust region needs a tangent",
            "choose a line search",
        ),
        (
            "line_search = \"backtracking\"",
            "relative_tolerance = ▶1.5",
            "`relative_tolerance` is 1.5",
            "between 0 and 1",
        ),
        ("tolerance = 1e-10", "tolerance = ▶-1e-10", "`tolerance` is", "between 0 and 1"),
        ("restart = 50", "restart = ▶0", "`restart` is 0", "at least 1"),
        ("tau_v = 0.5", "tau_v = ▶-0.5", "`tau_v` is -0.5", "zero or positive"),
        ("tau_p = 0.1", "wave_speed = ▶\"fast\"", "`fast`", "constant, deformed"),
        ("interval = 0.05", "interval = ▶0", "`interval` is 0", "positive"),
        ("\"velocity\"]\n[[probe]]", "▶\"pressure\"]\n[[probe]]", "listed twice", "remove one"),
        ("\"velocity\"]\n[[probe]]", "▶\"presure\"]\n[[probe]]", "`presure`", "did you mean `pressure`?"),
    ]);
    let without = GOOD.replace("[time]\nend = 1.0\nstep = 0.05\nscheme = \"crank_nicolson\"\n", "");
    let found = errors(&without);
    assert_eq!((found.len(), found[0].line, found[0].column), (1, Some(1), Some(1)));
    assert!(found[0].message.contains("`[time]` is missing") && found[0].remedy.contains("end = 1.0"));
}
