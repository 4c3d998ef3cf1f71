//! Random small scenes: clouds, laws with their parameters, smooth states, in units of any size. A case is its scene file,
//! so that what fails can be run by hand; it shrinks towards the plainest scene that still fails.

/// Numbers that look random but follow from a seed.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        let mut random = Self(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x2545_F491_4F6C_DD1D);
        random.unit();
        random
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    pub fn between(&mut self, lower: f64, upper: f64) -> f64 {
        lower + (upper - lower) * self.unit()
    }

    pub fn below(&mut self, bound: usize) -> usize {
        ((self.unit() * bound as f64) as usize).min(bound - 1)
    }

    pub fn chance(&mut self, share: f64) -> bool {
        self.unit() < share
    }

    pub fn choose<T: Copy>(&mut self, list: &[T]) -> T {
        list[self.below(list.len())]
    }
}

/// What a cloud fills.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    Box,
    Bent,
    Ring,
    /// A disc or a sphere, cut out of a lattice.
    Round,
}

/// What a body is made of. The parameters are those of every law; which of them stand in the scene depends on it.
#[derive(Debug, Clone, PartialEq)]
pub struct Law {
    pub name: &'static str,
    pub density: f64,
    /// Pa.
    pub stiffness: f64,
    pub poissons: f64,
    pub gamma: f64,
    pub quadratic: bool,
    pub plane_stress: bool,
    /// Viscous over elastic stress at the rate of the state.
    pub viscosity: f64,
}

pub const LAWS: [&str; 7] = [
    "linear_volumetric",
    "hyperelastic_volumetric",
    "linear_elastic",
    "st_venant_kirchhoff",
    "neo_hookean",
    "mooney_rivlin",
    "nearly_incompressible",
];

/// A random scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Case {
    pub dimension: usize,
    pub shape: Shape,
    pub counts: [usize; 3],
    pub spacing: f64,
    pub cell: bool,
    pub perturb: f64,
    pub kernel: &'static str,
    pub smoothing: f64,
    pub weights: &'static str,
    pub law: Law,
    pub hourglass: Option<f64>,
    pub evolved: bool,
    pub tau: [f64; 2],
    pub interface: &'static str,
    pub deformed_speed: bool,
    /// Clamps the lowest particles along x.
    pub clamped: bool,
    /// Over `c²/L`.
    pub gravity: f64,
    /// Strain of the initial displacement, and the same for the velocity over `c/L`.
    pub strain: f64,
    pub rate: f64,
    pub state: u64,
    /// Tables `[time]`, `[newton]` and `[linear]`.
    pub time: String,
}

impl Case {
    /// A free body of any kind, without dissipation.
    pub fn random(seed: u64) -> Self {
        let random = &mut Random::new(seed);
        let dimension = 1 + random.below(3);
        let shape = match dimension {
            1 => Shape::Box,
            _ => random.choose(&[Shape::Box, Shape::Box, Shape::Bent, Shape::Ring, Shape::Round]),
        };
        let most = [14, 6, 4][dimension - 1];
        let fluid = random.chance(0.3);
        let law = if fluid { random.choose(&LAWS[..2]) } else { random.choose(&LAWS[2..]) };
        Self {
            dimension,
            shape,
            counts: [0; 3].map(|_| 3 + random.below(most - 2)),
            spacing: 10_f64.powf(random.between(-4.0, 3.0)),
            cell: random.chance(0.3),
            perturb: if random.chance(0.6) { random.between(0.0, 0.25) } else { 0.0 },
            kernel: random.choose(&["cubic_spline", "wendland_c2", "quintic_spline"]),
            smoothing: random.between(1.0, 1.5),
            weights: random.choose(&["auto", "balanced", "cells", "separate", "single"]),
            law: Law {
                name: law,
                density: 10_f64.powf(random.between(-2.0, 4.5)),
                stiffness: 10_f64.powf(random.between(-3.0, 12.0)),
                poissons: if random.chance(0.2) { 0.4999 } else { random.between(-0.3, 0.49) },
                gamma: if random.chance(0.2) { 1.0 } else { random.between(1.0, 8.0) },
                quadratic: random.chance(0.5),
                plane_stress: dimension < 3 && random.chance(0.3),
                viscosity: 0.0,
            },
            hourglass: if random.chance(0.5) { Some(random.between(0.0, 4.0)) } else { None },
            evolved: false,
            tau: [0.0; 2],
            interface: "limited",
            deformed_speed: random.chance(0.5),
            clamped: false,
            gravity: 0.0,
            strain: random.between(0.0, 0.15),
            rate: random.between(0.0, 0.15),
            state: seed,
            time: "[time]\nend = 1.0\nstep = 1.0\nscheme = \"midpoint\"\n".into(),
        }
    }

    /// With whatever dissipates but keeps the momenta.
    pub fn dissipative(seed: u64) -> Self {
        let mut case = Self::random(seed);
        let random = &mut Random::new(seed ^ 0xABCD);
        case.evolved = random.chance(0.3);
        if case.is_solid() && random.chance(0.5) {
            case.law.viscosity = random.between(0.0, 1.0);
        }
        if random.chance(0.5) {
            case.tau[0] = random.between(0.0, 1.0);
        }
        if case.evolves_volume() && random.chance(0.5) {
            case.tau[1] = random.between(0.0, 1.0);
        }
        case.interface = random.choose(&["limited", "reconstructed", "constant"]);
        case
    }

    pub fn is_solid(&self) -> bool {
        LAWS[2..].contains(&self.law.name)
    }

    /// Whether the pressure follows from a volume ratio.
    pub fn evolves_volume(&self) -> bool {
        ["linear_volumetric", "hyperelastic_volumetric", "nearly_incompressible"].contains(&self.law.name)
    }

    /// Wave speed, about, m/s.
    pub fn speed(&self) -> f64 {
        (self.law.stiffness / self.law.density).sqrt()
    }

    /// Extent along a direction, m.
    pub fn extent(&self, axis: usize) -> f64 {
        self.spacing * (self.counts[axis] - 1) as f64
    }

    /// Length of the body, about, m.
    pub fn size(&self) -> f64 {
        (0..self.dimension).map(|axis| self.extent(axis)).fold(0.0, f64::max)
    }

    /// Plainer cases, one change each.
    pub fn simpler(&self) -> Vec<Self> {
        let mut list = Vec::new();
        let mut with = |change: &dyn Fn(&mut Self)| {
            let mut other = self.clone();
            change(&mut other);
            if other != *self {
                list.push(other);
            }
        };
        with(&|case| case.shape = Shape::Box);
        with(&|case| (case.dimension, case.law.plane_stress) = (case.dimension.max(2) - 1, false));
        for axis in 0..3 {
            with(&|case| case.counts[axis] = 3);
            with(&|case| case.counts[axis] = 3.max(case.counts[axis] - 1));
        }
        with(&|case| case.tau = [0.0; 2]);
        with(&|case| case.tau[1] = 0.0);
        with(&|case| case.interface = "constant");
        with(&|case| case.deformed_speed = false);
        with(&|case| case.law.viscosity = 0.0);
        with(&|case| case.hourglass = Some(0.0));
        with(&|case| case.perturb = 0.0);
        with(&|case| case.cell = false);
        with(&|case| case.kernel = "cubic_spline");
        with(&|case| case.smoothing = 1.2);
        with(&|case| case.weights = "separate");
        with(&|case| case.evolved = false);
        with(&|case| case.law.plane_stress = false);
        with(&|case| case.law.quadratic = false);
        with(&|case| case.law.poissons = 0.25);
        with(&|case| case.law.gamma = 1.0);
        with(&|case| case.law.name = "linear_elastic");
        with(&|case| (case.spacing, case.law.density, case.law.stiffness) = (1.0, 1.0, 1.0));
        with(&|case| case.clamped = false);
        with(&|case| case.gravity = 0.0);
        with(&|case| case.rate = 0.0);
        with(&|case| case.strain = 0.0);
        list
    }
}
