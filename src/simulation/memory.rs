//! How much memory a run takes: as a forecast where the model is there, and before anything is made to refuse a scene that
//! the computer cannot hold.

use std::cell::Cell;

use super::prepare::Counts;
use crate::scene::settings::SolverChoice;
use crate::scene::{BodySize, Refusal, Scene, SceneErrors};
use crate::setup::Setup;

impl Counts {
    /// Bytes of tables, state, work space and tangent, without its factor.
    fn held<const D: usize>(&self) -> f64 {
        let tensor = (D * D * 8) as f64;
        let mut memory = self.pairs * 8.0 + self.weights * 8.0 * D as f64 + self.particles * (5.0 * tensor + 200.0);
        if self.upwind {
            memory += self.pairs * 8.0 * (1 + D) as f64;
        }
        memory += self.hourglass_entries * 8.0;
        if self.implicit && !self.assembled {
            // Tangents of the stress, work space of the action, vectors of the iteration.
            memory += self.particles * (tensor * tensor / 16.0 + 3.0 * tensor + 20.0 * D as f64 * 8.0);
        }
        if self.assembled {
            // Values and columns, held twice (assembled and factored copy), and slots.
            memory += self.entries * 32.0 + self.pairs * self.pairs / self.particles.max(1.0) * 4.0;
        }
        memory
    }

    /// Bytes of a factor, whose fill grows as n log n in 2D and n^(4/3) in 3D.
    fn factor<const D: usize>(&self) -> f64 {
        if !self.assembled {
            return 0.0;
        }
        let fill = match D {
            1 => 3.0 * self.entries,
            2 => self.entries * (1.0 + 0.6 * self.unknowns.max(2.0).log2()),
            _ => self.entries * self.unknowns.max(1.0).powf(1.0 / 3.0),
        };
        fill * 12.0
    }

    /// Bytes of everything.
    pub fn memory<const D: usize>(&self) -> f64 {
        self.held::<D>() + self.factor::<D>()
    }
}

/// Particles within a distance, in spacings, of one of them.
fn within<const D: usize>(reach: f64) -> f64 {
    let volume = match D {
        1 => 2.0 * reach,
        2 => std::f64::consts::PI * reach * reach,
        _ => 4.0 / 3.0 * std::f64::consts::PI * reach.powi(3),
    };
    volume.max(1.0)
}

/// What a scene will count before it is built.
fn expected<const D: usize>(scene: &Scene, bodies: &[BodySize]) -> Counts {
    let implicit = !scene.time.scheme.is_explicit();
    let assembled = implicit && !scene.linear.is_matrix_free();
    let sum = |term: &dyn Fn(&BodySize) -> f64| bodies.iter().map(term).sum::<f64>();
    let particles = sum(&|body| body.particles);
    let components = D as f64;
    let pairs = sum(&|body| body.particles * within::<D>(body.reach).min(body.particles));
    Counts {
        particles,
        pairs,
        // All of them are held until rows of a lattice share theirs.
        weights: pairs,
        unknowns: if implicit { particles * components } else { 0.0 },
        // Two rings of neighbours.
        entries: if assembled {
            components * components * sum(&|body| body.particles * within::<D>(2.0 * body.reach).min(body.particles))
        } else {
            0.0
        },
        hourglass_entries: 0.0,
        upwind: false,
        implicit,
        assembled,
    }
}

/// A set-up that the memory can hold.
#[derive(Debug)]
pub struct FittingSetup<const D: usize> {
    /// The set-up.
    pub setup: Setup<D>,
    /// What is possible but perhaps not meant.
    pub warnings: Vec<String>,
    /// Memory that a run will take, bytes: tables, state and tangent, and its factor where that was asked for.
    pub memory: f64,
}

/// [`Scene::setup`] of a scene that needs no more memory than its [limit](Scene::limit_memory); a larger one is refused
/// before anything of it is made.
///
/// # Errors
/// As for [`Scene::setup`], and the refusal.
pub fn fitting_setup<const D: usize>(scene: &Scene) -> Result<FittingSetup<D>, SceneErrors> {
    let memory = Cell::new(0.0);
    let (setup, warnings) = scene.setup_if::<D>(&|bodies| {
        let (needed, counts) = needed::<D>(scene, bodies);
        memory.set(needed);
        bearable(scene, needed, &counts)
    })?;
    Ok(FittingSetup { setup, warnings, memory: memory.get() })
}

/// Bytes that a scene is expected to take. A factor counts only where it was asked for: `auto` does without where it would
/// be large.
fn needed<const D: usize>(scene: &Scene, bodies: &[BodySize]) -> (f64, Counts) {
    let counts = expected::<D>(scene, bodies);
    let direct = matches!(scene.linear.solver, SolverChoice::Lu | SolverChoice::Ldlt | SolverChoice::Cholesky);
    (if direct { counts.memory::<D>() } else { counts.held::<D>() }, counts)
}

/// Refuses a scene that needs more memory than its limit.
fn bearable(scene: &Scene, needed: f64, counts: &Counts) -> Result<(), Refusal> {
    let Some(limit) = scene.memory_limit().filter(|limit| needed > *limit as f64) else { return Ok(()) };
    let lighter = if counts.assembled { "`linear.operator = \"matrix_free\"`, an explicit scheme, " } else { "" };
    Err(Refusal {
        message: format!(
            "{:.2e} particles need about {:.1} GB of memory, and {:.1} GB are available",
            counts.particles,
            needed / 1e9,
            limit as f64 / 1e9
        ),
        remedy: format!(
            "give a larger spacing or smaller counts, {lighter}or a machine with more memory; `--ignore-memory` (in \
             Python: `ignore_memory=True`) tries all the same"
        ),
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::simulation::prepare;

    /// What is expected before anything is built is close to what is there then, without rows that share weights.
    fn compared<const D: usize>(counts: &str, corner: &str, more: &str) -> f64 {
        let text = format!(
            "dimension = {D}\n[[body]]\ncounts = {counts}\nperturb.amount = 0.05\nshape.box = {{ lower = {}, upper = {corner} }}\n\
             material.hyperelastic_volumetric = {{ density = 1000, gamma = 7, wave_speed = 10 }}\n[time]\nend = 1\n{more}",
            corner.replace('1', "0")
        );
        let scene = Scene::parse(&text, "memory.toml", Path::new(""), &[]).unwrap_or_else(|error| panic!("{error}"));
        let built = prepare::<D>(&scene).unwrap_or_else(|error| panic!("{error}"));
        let particles = built.model.particles() as f64;
        let expected = expected::<D>(&scene, &[BodySize { particles, reach: 2.4 }]);
        expected.memory::<D>() / built.forecast(&scene).memory
    }

    #[test]
    fn expectations_are_near_what_is_built() {
        for (ratio, what) in [
            (compared::<1>("[500]", "[1]", "scheme = \"tvd_rk2\""), "a line, explicit"),
            (compared::<2>("[40, 40]", "[1, 1]", "scheme = \"tvd_rk2\""), "a plane, explicit"),
            (compared::<2>("[40, 40]", "[1, 1]", "step = 0.1"), "a plane, implicit"),
            (compared::<3>("[12, 12, 12]", "[1, 1, 1]", "scheme = \"tvd_rk2\""), "space, explicit"),
        ] {
            assert!((0.6..2.0).contains(&ratio), "{what}: {ratio}");
        }
    }
}
