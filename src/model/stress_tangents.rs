//! `V ∂P/∂F` of all particles, in as few numbers as the laws allow: the largest table of the matrix-free path.
//!
//! | form | laws | numbers per particle in 2D, 3D |
//! |---|---|---|
//! | volumetric | pressure from J alone, velocities the only unknowns | 14, 29 |
//! | symmetric | other stored energies | 10, 45 |
//! | full | any | 16, 81 |

use rayon::prelude::*;

use super::evaluation::GRAIN;
use super::law::Point;
use super::{Model, Unknowns};
use crate::material::Material;
use crate::setup::CofactorChoice;
use crate::tensor::{Tensor, Tensor4, add4, apply4, cofactor_variation, contract, tensor4_of};

/// See the head of the module.
#[derive(Debug)]
pub enum StressTangents<const D: usize> {
    /// Upper triangles by rows, over the components of F by columns.
    Symmetric(Vec<f64>),
    /// `A = −p V ∂H/∂F + V ∂P/∂J ⊗ ∂J/∂F`.
    Volumetric(Vec<VolumetricTangent<D>>),
    /// Every component.
    Full(Vec<Tensor4<D>>),
}

impl<const D: usize> Default for StressTangents<D> {
    fn default() -> Self {
        Self::Full(Vec::new())
    }
}

/// The tangent of a stress `−p(J) H`.
#[derive(Debug, Clone, Copy)]
pub struct VolumetricTangent<const D: usize> {
    evolved: bool,
    /// F for the geometric cofactor, H for the evolved one.
    base: Tensor<D>,
    /// `−p V`, or `p V/J` for the evolved cofactor.
    factor: f64,
    chain: Tensor<D>,
    by_volume: Tensor<D>,
}

impl<const D: usize> VolumetricTangent<D> {
    #[inline]
    fn apply(&self, direction: &Tensor<D>) -> Tensor<D> {
        let turning = if self.evolved {
            self.base * direction.transpose() * self.base
        } else {
            cofactor_variation(&self.base, direction)
        };
        turning * self.factor + self.by_volume * contract(&self.chain, direction)
    }
}

/// Numbers in the upper triangle of a map of tensors.
const fn triangle(dimension: usize) -> usize {
    let n = dimension * dimension;
    n * (n + 1) / 2
}

/// Product of a symmetric map, stored as its upper triangle, with a tensor.
#[inline]
fn apply_symmetric<const D: usize>(upper: &[f64], direction: &Tensor<D>) -> Tensor<D> {
    let mut out = Tensor::<D>::zeros();
    let (x, y) = (direction.as_slice(), out.as_mut_slice());
    let mut rest = upper;
    for i in 0..D * D {
        let (row, tail) = rest.split_at(D * D - i);
        rest = tail;
        let mut sum = row[0] * x[i];
        for ((a, x), y) in row[1..].iter().zip(&x[i + 1..]).zip(&mut y[i + 1..]) {
            sum += a * x;
            *y += a * direction.as_slice()[i];
        }
        y[i] += sum;
    }
    out
}

impl<const D: usize> StressTangents<D> {
    /// `A : δF` at a particle.
    #[inline]
    pub fn apply(&self, a: usize, direction: &Tensor<D>) -> Tensor<D> {
        match self {
            Self::Symmetric(values) => apply_symmetric(&values[a * triangle(D)..(a + 1) * triangle(D)], direction),
            Self::Volumetric(tangents) => tangents[a].apply(direction),
            Self::Full(tangents) => apply4(&tangents[a], direction),
        }
    }

    /// A with all components.
    pub fn at(&self, a: usize) -> Tensor4<D> {
        match self {
            Self::Full(tangents) => tangents[a],
            Self::Volumetric(_) => tensor4_of(|direction| self.apply(a, direction)),
            Self::Symmetric(values) => {
                let mut out: Tensor4<D> = [[Tensor::zeros(); D]; D];
                let mut rest = &values[a * triangle(D)..(a + 1) * triangle(D)];
                for i in 0..D * D {
                    let (row, tail) = rest.split_at(D * D - i);
                    rest = tail;
                    for (j, &value) in (i..).zip(row) {
                        out[i % D][i / D].as_mut_slice()[j] = value;
                        out[j % D][j / D].as_mut_slice()[i] = value;
                    }
                }
                out
            }
        }
    }
}

impl<const D: usize> Model<D> {
    /// Whether every stress is the derivative of an energy of F.
    pub(super) fn has_stored_energies(&self) -> bool {
        let laws = self.materials.iter().zip(&self.evolved);
        let stored = |law: &Material, evolved: bool| law.viscosity.is_none() && !(evolved && law.evolves_volume());
        self.stage.start.is_empty() && laws.into_iter().all(|((law, _), &evolved)| stored(law, evolved))
    }

    /// Takes the tangents at the point of the workspace, in the smallest form that holds them.
    pub(super) fn freeze_stress(&self, out: &mut StressTangents<D>, shift: f64) {
        let points = &self.workspace.points;
        let volumetric = |law: &Material| law.solid.is_none() && law.viscosity.is_none();
        let plain = self.terms.stress && self.stage.start.is_empty() && self.unknowns.kind() == Unknowns::Velocity;
        if plain && self.materials.iter().all(|(law, _)| volumetric(law)) {
            if !matches!(out, StressTangents::Volumetric(_)) {
                *out = StressTangents::Volumetric(Vec::new());
            }
            let StressTangents::Volumetric(tangents) = out else { return };
            let tangent = |a: usize| self.volumetric_tangent(a, &points[a], shift);
            (0..points.len()).into_par_iter().with_min_len(GRAIN).map(tangent).collect_into_vec(tangents);
        } else if self.has_stored_energies() {
            if !matches!(out, StressTangents::Symmetric(_)) {
                *out = StressTangents::Symmetric(vec![0.0; points.len() * triangle(D)]);
            }
            let StressTangents::Symmetric(values) = out else { return };
            values.par_chunks_mut(triangle(D)).with_min_len(GRAIN).enumerate().for_each(|(a, upper)| {
                let tangent = self.stress_tangent(a, &points[a], shift);
                let mut next = upper.iter_mut();
                for i in 0..D * D {
                    let row = tangent[i % D][i / D].as_slice();
                    next.by_ref().zip(&row[i..]).take(D * D - i).for_each(|(out, value)| *out = *value);
                }
            });
        } else {
            if !matches!(out, StressTangents::Full(_)) {
                *out = StressTangents::Full(Vec::new());
            }
            let StressTangents::Full(tangents) = out else { return };
            let tangent = |a: usize| self.stress_tangent(a, &points[a], shift);
            (0..points.len()).into_par_iter().with_min_len(GRAIN).map(tangent).collect_into_vec(tangents);
        }
    }

    fn volumetric_tangent(&self, a: usize, point: &Point<D>, shift: f64) -> VolumetricTangent<D> {
        let printed = self.cofactor_choice(a) == CofactorChoice::Evolved;
        let evolved = printed && self.evolves_volume(a);
        let mut pressure = point.pressure * self.setup.particles.volumes[a];
        if printed && !evolved {
            // H = k cof F.
            pressure *= self.initial_volume_constant(a);
        }
        VolumetricTangent {
            evolved,
            base: if evolved { point.cofactor } else { point.deformation },
            factor: if evolved { pressure / point.volume_ratio } else { -pressure },
            chain: self.volume_chain(a, point, shift),
            by_volume: self.stress_by_volume(a, point),
        }
    }

    /// `V ∂P/∂F` at a particle, with J eliminated if it is not an unknown.
    fn stress_tangent(&self, a: usize, point: &Point<D>, shift: f64) -> Tensor4<D> {
        let mut out = [[Tensor::zeros(); D]; D];
        if !self.terms.stress {
            return out;
        }
        let material = self.material(a);
        let volume = self.setup.particles.volumes[a];
        // A point without a tangent has no stress either, and was refused when it was evaluated.
        let start = self.stage.start.get(a).and_then(|start| Some((start, start.secant(&point.deformation)?)));
        if material.evolves_volume() {
            out = match &start {
                Some((start, step)) => self.conserving_tangent(a, start, step, point.volume_ratio),
                None => tensor4_of(|direction| self.cofactor_along(a, point, direction) * -point.pressure),
            };
            for entry in out.iter_mut().flatten() {
                *entry *= volume;
            }
            if self.unknowns.kind() == Unknowns::Velocity && start.is_none() {
                // P depends on F through J, too: ∂P/∂J ⊗ ∂J/∂F.
                let (chain, by_volume) = (self.volume_chain(a, point, shift), self.stress_by_volume(a, point));
                for (i, row) in out.iter_mut().enumerate() {
                    for (j, entry) in row.iter_mut().enumerate() {
                        *entry += chain * by_volume[(i, j)];
                    }
                }
            }
        }
        if let Some(solid) = &material.solid {
            let tangent = match &start {
                Some((_, step)) => Some(solid.conserving_tangent(step)),
                None => solid.tangent(&point.deformation),
            };
            tangent.iter().for_each(|tangent| add4(&mut out, tangent, volume));
        }
        if let Some(viscosity) = &material.viscosity {
            let (by_deformation, _) = viscosity.tangents(&point.deformation, &point.velocity_gradient);
            add4(&mut out, &by_deformation, volume);
        }
        out
    }
}
