//! The scenes, and the ways to integrate them.

/// A scene, shortened to what can be integrated many times.
#[derive(Debug, Clone, Copy)]
pub struct Problem {
    /// Name of the scene.
    pub name: &'static str,
    /// The scene, inside the program, so that it runs anywhere.
    pub text: &'static str,
    /// Space dimensions.
    pub dimension: usize,
    /// Time to reach, s.
    pub end: f64,
    /// Steps to the end of the implicit schemes; multiples of [`SAMPLES`](super::case::SAMPLES).
    pub steps: &'static [usize],
    /// Keys and values that change the number of particles; none to begin with.
    pub size: &'static [(&'static str, &'static str)],
    /// The same for runs of some seconds.
    pub coarse: &'static [(&'static str, &'static str)],
    /// Key and value of what the stiffness is in proportion to, and its power: 2 for a wave speed.
    pub stiffness: (&'static str, f64, i32),
}

impl Problem {
    /// With few particles.
    pub fn coarsened(self) -> Self {
        Self { size: self.coarse, ..self }
    }
}

/// All of them.
pub const PROBLEMS: [Problem; 7] = [
    Problem {
        name: "bar-smooth",
        text: include_str!("../bar-smooth.toml"),
        dimension: 1,
        end: 1.264_911_064_067_351_8, // one period, 4L/c
        steps: &[8, 16, 32, 64, 128, 256],
        size: &[],
        coarse: &[("body.0.spacing", "0.5")],
        stiffness: ("body.0.material.linear_volumetric.bulk_modulus", 1e6, 1),
    },
    Problem {
        name: "piston-elastic",
        text: include_str!("../piston-elastic.toml"),
        dimension: 2,
        end: 0.374_165_738_677_394_1, // one period
        steps: &[8, 16, 32, 64, 128, 256],
        size: &[],
        coarse: &[("body.0.spacing", "0.5")],
        stiffness: ("body.0.material.linear_volumetric.youngs_modulus", 1e6, 1),
    },
    Problem {
        name: "piston-hyperelastic",
        text: include_str!("../piston-hyperelastic.toml"),
        dimension: 2,
        end: 1.0,
        steps: &[8, 16, 32, 64, 128, 256],
        size: &[],
        coarse: &[("body.0.spacing", "0.5")],
        stiffness: ("body.0.material.hyperelastic_volumetric.wave_speed", 10.0, 2),
    },
    Problem {
        name: "impact-hyperelastic",
        text: include_str!("../impact-hyperelastic.toml"),
        dimension: 2,
        end: 1.0,
        steps: &[8, 16, 32, 64, 128, 256],
        size: &[],
        coarse: &[("body.0.spacing", "0.5")],
        stiffness: ("body.0.material.hyperelastic_volumetric.wave_speed", 10.0, 2),
    },
    Problem {
        name: "csm3",
        text: include_str!("../csm3.toml"),
        dimension: 2,
        end: 1.0,
        steps: &[16, 24, 48, 96, 192, 384],
        size: &[],
        coarse: &[("body.0.counts", "[18, 3]")],
        stiffness: ("body.0.material.st_venant_kirchhoff.youngs_modulus", 1.4e6, 1),
    },
    Problem {
        name: "oscillating-plate",
        text: include_str!("../oscillating-plate.toml"),
        dimension: 2,
        end: 0.3,
        steps: &[16, 32, 64, 128, 256, 512],
        size: &[],
        coarse: &[("body.0.counts", "[16, 3]")],
        stiffness: ("body.0.material.st_venant_kirchhoff.youngs_modulus", 2e6, 1),
    },
    Problem {
        name: "bending-column",
        text: include_str!("../bending-column.toml"),
        dimension: 3,
        end: 0.5,
        steps: &[8, 16, 32, 64, 128],
        size: &[],
        coarse: &[("body.0.counts", "[3, 3, 7]")],
        stiffness: ("body.0.material.neo_hookean.youngs_modulus", 17e6, 1),
    },
];

/// How a scene is integrated: a scheme with its step, or with its steps to the end.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Method {
    /// Name in tables and figures.
    pub name: &'static str,
    /// Keys of the scene and their values.
    pub keys: &'static [(&'static str, &'static str)],
    /// Longest steps of an explicit scheme, as factors `c Δt/d` (see `time.cfl`); empty for an implicit scheme.
    pub courant: &'static [f64],
}

impl Method {
    /// Whether it solves equations.
    pub fn is_implicit(&self) -> bool {
        self.courant.is_empty()
    }
}

/// All of them. The stability limit of velocity Verlet is a Courant number of 1; TVD-RK2 has none without dissipation, and
/// grows from rounding in the time that its first step leaves it.
pub const METHODS: [Method; 10] = [
    Method { name: "TVD-RK2", keys: &[("time.scheme", "tvd_rk2")], courant: &[0.5, 0.25, 0.125, 0.0625] },
    Method { name: "velocity Verlet", keys: &[("time.scheme", "velocity_verlet")], courant: &[0.9, 0.45, 0.225] },
    Method { name: "RK4", keys: &[("time.scheme", "rk4")], courant: &[1.2, 0.6] },
    Method { name: "Crank–Nicolson", keys: &[("time.scheme", "crank_nicolson")], courant: &[] },
    Method {
        name: "Crank–Nicolson, lagged",
        keys: &[("time.scheme", "crank_nicolson"), ("newton.tangent", "lagged"), ("newton.relative_tolerance", "1e-5")],
        courant: &[],
    },
    Method {
        name: "Crank–Nicolson, GMRES + ILU(0)",
        keys: &[
            ("time.scheme", "crank_nicolson"),
            ("newton.relative_tolerance", "1e-5"),
            ("newton.forcing", "eisenstat_walker_2"),
            ("linear.solver", "gmres"),
            ("linear.preconditioner", "ilu0"),
        ],
        courant: &[],
    },
    Method {
        name: "mid-point, lagged",
        keys: &[("time.scheme", "midpoint"), ("newton.tangent", "lagged"), ("newton.relative_tolerance", "1e-5")],
        courant: &[],
    },
    Method {
        name: "TR-BDF2, lagged",
        keys: &[("time.scheme", "tr_bdf2"), ("newton.tangent", "lagged"), ("newton.relative_tolerance", "1e-5")],
        courant: &[],
    },
    Method {
        name: "SDIRK3, lagged",
        keys: &[("time.scheme", "sdirk3"), ("newton.tangent", "lagged"), ("newton.relative_tolerance", "1e-5")],
        courant: &[],
    },
    Method { name: "energy–momentum", keys: &[("time.scheme", "energy_momentum")], courant: &[] },
];
