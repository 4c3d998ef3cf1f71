//! A case as its scene file.

use std::fmt::Write as _;
use std::path::Path;

use nicolson::scene::Scene;

use super::case::{Case, Law, Random, Shape};

impl Case {
    fn material(&self) -> String {
        let Law { name, density, stiffness, poissons, gamma, quadratic, plane_stress, viscosity } = &self.law;
        let mut keys = format!("density = {density:e}");
        let shear = stiffness / (2.0 * (1.0 + poissons));
        let _ = match *name {
            "linear_volumetric" => write!(keys, ", bulk_modulus = {stiffness:e}"),
            "hyperelastic_volumetric" => write!(keys, ", bulk_modulus = {:e}, gamma = {gamma:e}", stiffness / gamma),
            "mooney_rivlin" => {
                let bulk = stiffness / (3.0 * (1.0 - 2.0 * poissons));
                let (first, second) = (0.35 * shear, 0.15 * shear);
                write!(keys, ", c1 = {first:e}, c2 = {second:e}, bulk_modulus = {bulk:e}")
            }
            _ => write!(keys, ", youngs_modulus = {stiffness:e}, poissons_ratio = {poissons:e}"),
        };
        let solid = self.is_solid();
        if ["neo_hookean", "mooney_rivlin"].contains(name) && *quadratic {
            keys.push_str(", volumetric_energy = \"quadratic\"");
        }
        if *name == "nearly_incompressible" && *gamma > 2.0 {
            let _ = write!(keys, ", gamma = {gamma:e}");
        }
        if solid && *name != "nearly_incompressible" && *plane_stress {
            keys.push_str(", transverse = \"stress\"");
        }
        if solid && *viscosity > 0.0 {
            let viscosity = viscosity * shear * self.size() / self.speed();
            let _ = write!(keys, ", shear_viscosity = {viscosity:e}, bulk_viscosity = {:e}", 0.5 * viscosity);
        }
        format!("material.{name} = {{ {keys} }}")
    }

    fn body(&self) -> String {
        let (d, h) = (self.dimension, self.spacing);
        let list = |of: &dyn Fn(usize) -> f64| -> String {
            (0..d).map(|axis| format!("{:e}", of(axis))).collect::<Vec<_>>().join(", ")
        };
        let (radius, height) =
            (self.counts[0] as f64 * 0.5 * h, if d == 3 { self.extent(2).min(2.0 * h) } else { 0.0 });
        let lower = |_: usize| 2.0 * h;
        let upper = |axis: usize| 2.0 * h + self.extent(axis);
        let mut text = match self.shape {
            Shape::Box => format!("shape.box = {{ lower = [{}], upper = [{}] }}\n", list(&lower), list(&upper)),
            Shape::Bent => {
                // A strip that becomes an arc, with a wave across.
                let angle = format!("(Y - {:e})/{:e}", lower(1), 6.0 * self.extent(1));
                let radius = format!("(X + {:e})", 3.0 * self.extent(0));
                let map = [format!("{radius}*cos({angle})"), format!("{radius}*sin({angle})"), "Z + 0.1*X".to_owned()];
                let (lower, upper) = (list(&lower), list(&upper));
                format!("shape.mapped_box = {{ lower = [{lower}], upper = [{upper}], map = {:?} }}\n", &map[..d])
            }
            Shape::Ring => {
                let height = if d == 3 { format!(", height = [0.0, {height:e}]") } else { String::new() };
                format!(
                    "shape.ring = {{ centre = [{h:e}, 0.0], inner = {radius:e}, outer = {:e}{height} }}\n",
                    2.0 * radius
                )
            }
            Shape::Round if d == 2 => format!("shape.disc = {{ centre = [{h:e}, {h:e}], radius = {radius:e} }}\n"),
            Shape::Round => format!("shape.sphere = {{ centre = [{h:e}, 0.0, 0.0], radius = {radius:e} }}\n"),
        };
        if matches!(self.shape, Shape::Box | Shape::Bent) {
            let counts = self.counts[..d].iter().map(|n| n - usize::from(self.cell)).collect::<Vec<_>>();
            let _ = writeln!(text, "counts = {counts:?}\nlayout = \"{}\"", if self.cell { "cell" } else { "vertex" });
            if self.perturb > 0.0 {
                let _ = writeln!(text, "perturb = {{ amount = {:e}, seed = {} }}", self.perturb, self.state % 1000);
            }
        } else {
            let _ = writeln!(text, "spacing = {h:e}");
        }
        text
    }

    /// `linear + sines` in every direction, with gradients of about `strain`, times `unit`.
    fn field(&self, strain: f64, unit: f64, seed: u64) -> String {
        let (random, length) = (&mut Random::new(self.state ^ seed), self.size());
        let mut text = Vec::new();
        for _ in 0..self.dimension {
            let mut terms = vec![format!("{:e}", unit * strain * length * random.between(-1.0, 1.0))];
            for name in &["X", "Y", "Z"][..self.dimension] {
                let (slope, wave) = (random.between(-0.4, 0.4), random.between(-3.0, 3.0));
                terms.push(format!("({:e})*{name}", unit * strain * slope));
                terms.push(format!(
                    "({:e})*sin(({:e})*{name} + {:e})",
                    unit * strain * 0.3 * length / 3.0,
                    wave / length,
                    random.between(0.0, 6.0)
                ));
            }
            text.push(format!("\"{}\"", terms.join(" + ")));
        }
        format!("[{}]", text.join(", "))
    }

    /// The scene.
    pub fn text(&self) -> String {
        let mut text = format!("title = \"property\"\ndimension = {}\n", self.dimension);
        if self.gravity != 0.0 {
            let size = self.gravity * self.speed().powi(2) / self.size();
            let gravity: Vec<String> =
                (0..self.dimension).map(|axis| format!("{:e}", -size / (axis + 1) as f64)).collect();
            let _ = writeln!(text, "gravity = [{}]", gravity.join(", "));
        }
        let _ = write!(text, "\n[[body]]\n{}", self.body());
        let _ = writeln!(text, "kernel = \"{}\"\nsmoothing = {:e}", self.kernel, self.smoothing);
        let _ = writeln!(text, "weights = \"{}\"", self.weights);
        if let Some(coefficient) = self.hourglass {
            let _ = writeln!(text, "hourglass = {coefficient:e}");
        }
        if self.evolved && self.evolves_volume() {
            text.push_str("cofactor = \"evolved\"\n");
        }
        let _ = writeln!(text, "{}", self.material());
        let _ = writeln!(text, "\n[initial]\ndisplacement = {}", self.field(self.strain, 1.0, 1));
        let _ = writeln!(text, "velocity = {}", self.field(self.rate, self.speed() / self.size(), 2));
        if self.clamped {
            let (h, radius) = (self.spacing, self.counts[0] as f64 * 0.5 * self.spacing);
            let edge = match self.shape {
                Shape::Box => 2.6 * h,
                Shape::Bent => 1.02 * (2.0 * h + 3.0 * self.extent(0)),
                Shape::Ring => h - 1.7 * radius,
                Shape::Round => h - 0.5 * radius,
            };
            let zeros = ", 0.0".repeat(self.dimension - 1);
            let _ = writeln!(
                text,
                "\n[[boundary]]\nselect.half_space = {{ point = [{edge:e}{zeros}], normal = [-1.0{zeros}] }}"
            );
            let _ = writeln!(text, "fix = {:?}", &["x", "y", "z"][..self.dimension]);
        }
        if self.tau != [0.0; 2] {
            let _ = writeln!(text, "\n[stabilisation]\ntau_v = {:e}\ntau_p = {:e}", self.tau[0], self.tau[1]);
            let speed = if self.deformed_speed { "deformed" } else { "constant" };
            let _ = writeln!(text, "interface = \"{}\"\nwave_speed = \"{speed}\"", self.interface);
        }
        let _ = write!(text, "\n{}", self.time);
        text
    }

    /// The scene, read.
    pub fn scene(&self) -> Result<Scene, String> {
        Scene::parse(&self.text(), "property.toml", Path::new(""), &[]).map_err(|errors| errors.to_string())
    }
}
