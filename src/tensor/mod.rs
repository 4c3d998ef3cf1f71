//! Small dense algebra for `D = 1, 2, 3` without trait bounds on the dimension.
//!
//! nalgebra's determinant and inverse need bounds that generic code would have to repeat everywhere;
//! the three cases are written out here once.

mod secant;

pub use secant::CofactorSecant;

use nalgebra::{SMatrix, SVector};

/// A vector of `D` components.
pub type Vector<const D: usize> = SVector<f64, D>;
/// A tensor of `D × D` components.
pub type Tensor<const D: usize> = SMatrix<f64, D, D>;
/// A fourth-order tensor: entry `[i][j]` holds `∂P_ij/∂F_kl` over `(k, l)`.
pub type Tensor4<const D: usize> = [[Tensor<D>; D]; D];

/// Outer product `a ⊗ b`, component `(i, j) = a_i b_j`.
#[inline]
pub fn outer<const D: usize>(a: &Vector<D>, b: &Vector<D>) -> Tensor<D> {
    Tensor::from_fn(|i, j| a[i] * b[j])
}

/// Double contraction `A : B = Σ A_ij B_ij`.
#[inline]
pub fn contract<const D: usize>(a: &Tensor<D>, b: &Tensor<D>) -> f64 {
    a.as_slice().iter().zip(b.as_slice()).map(|(a, b)| a * b).sum()
}

/// Determinant.
#[inline]
pub fn determinant<const D: usize>(f: &Tensor<D>) -> f64 {
    match D {
        1 => f[(0, 0)],
        2 => f[(0, 0)] * f[(1, 1)] - f[(0, 1)] * f[(1, 0)],
        _ => {
            let minor = |j: usize, k: usize| f[(1, j)] * f[(2, k)] - f[(1, k)] * f[(2, j)];
            f[(0, 0)] * minor(1, 2) - f[(0, 1)] * minor(0, 2) + f[(0, 2)] * minor(0, 1)
        }
    }
}

/// Cofactor `cof F = det(F) F⁻ᵀ`, defined for singular F too. In 1D it is 1, in 2D linear in F.
#[inline]
pub fn cofactor<const D: usize>(f: &Tensor<D>) -> Tensor<D> {
    match D {
        1 => Tensor::from_element(1.0),
        2 => Tensor::from_fn(|i, j| if i == j { f[(1 - i, 1 - j)] } else { -f[(1 - i, 1 - j)] }),
        _ => Tensor::from_fn(|i, j| {
            let (i1, i2, j1, j2) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
            f[(i1, j1)] * f[(i2, j2)] - f[(i1, j2)] * f[(i2, j1)]
        }),
    }
}

/// Derivative of the cofactor in direction `a`: `∂cof(F)/∂F : A`.
///
/// The operator is the second derivative of the determinant, hence self-adjoint:
/// `B : (∂cof : A) = A : (∂cof : B)`.
#[inline]
pub fn cofactor_variation<const D: usize>(f: &Tensor<D>, a: &Tensor<D>) -> Tensor<D> {
    match D {
        1 => Tensor::zeros(),
        2 => cofactor(a),
        _ => Tensor::from_fn(|i, j| {
            let (i1, i2, j1, j2) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
            a[(i1, j1)] * f[(i2, j2)] + f[(i1, j1)] * a[(i2, j2)]
                - a[(i1, j2)] * f[(i2, j1)]
                - f[(i1, j2)] * a[(i2, j1)]
        }),
    }
}

/// `det(I + G) − 1`, which keeps its digits for small G.
pub fn dilation<const D: usize>(g: &Tensor<D>) -> f64 {
    match D {
        1 => g[(0, 0)],
        2 => g[(0, 0)] + g[(1, 1)] + determinant(g),
        _ => {
            let minor = |i: usize, j: usize| g[(i, i)] * g[(j, j)] - g[(i, j)] * g[(j, i)];
            g[(0, 0)] + g[(1, 1)] + g[(2, 2)] + minor(0, 1) + minor(1, 2) + minor(0, 2) + determinant(g)
        }
    }
}

/// Inverse; `None` if the determinant vanishes or is not finite.
pub fn inverse<const D: usize>(f: &Tensor<D>) -> Option<Tensor<D>> {
    let det = determinant(f);
    (det != 0.0 && det.is_finite()).then(|| cofactor(f).transpose() / det)
}

/// Smallest eigenvalue of `C = FᵀF` and a unit eigenvector for it.
///
/// At a repeated eigenvalue any unit eigenvector of its space is returned.
pub fn smallest_stretch<const D: usize>(f: &Tensor<D>) -> (f64, Vector<D>) {
    let c = f.transpose() * f;
    match D {
        1 => (c[(0, 0)], Vector::from_element(1.0)),
        2 => {
            let (a, b, d) = (c[(0, 0)], c[(0, 1)], c[(1, 1)]);
            let half = 0.5 * (a - d);
            let root = half.hypot(b);
            // det C / λ_max keeps its digits where ½(a + d) − root would cancel.
            let largest = 0.5 * (a + d) + root;
            let det = determinant(f);
            let smallest = if largest > 0.0 { det * det / largest } else { 0.0 };
            // The eigenvector for the smallest eigenvalue is orthogonal to that of the largest.
            let (x, y) = if half >= 0.0 { (-b, half + root) } else { (half - root, b) };
            let length = x.hypot(y);
            let (x, y) = if length > 0.0 { (x / length, y / length) } else { (1.0, 0.0) };
            (smallest, Vector::from_fn(|i, _| if i == 0 { x } else { y }))
        }
        _ => {
            let c3 = SMatrix::<f64, 3, 3>::from_fn(|i, j| c[(i, j)]);
            let eigen = c3.symmetric_eigen();
            let k = eigen.eigenvalues.imin();
            (eigen.eigenvalues[k], Vector::from_fn(|i, _| eigen.eigenvectors[(i, k)]))
        }
    }
}

/// Fourth-order tensor of a linear map of tensors, from its action.
pub fn tensor4_of<const D: usize>(action: impl Fn(&Tensor<D>) -> Tensor<D>) -> Tensor4<D> {
    let mut out = [[Tensor::zeros(); D]; D];
    for k in 0..D {
        for l in 0..D {
            let mut unit = Tensor::zeros();
            unit[(k, l)] = 1.0;
            let column = action(&unit);
            for (i, row) in out.iter_mut().enumerate() {
                for (j, entry) in row.iter_mut().enumerate() {
                    entry[(k, l)] = column[(i, j)];
                }
            }
        }
    }
    out
}

/// Von Mises norm `√(3/2 s:s)` of the deviator s of a stress.
pub fn von_mises(stress: &Tensor<3>) -> f64 {
    let deviator = stress - Tensor::<3>::identity() * (stress.trace() / 3.0);
    (1.5 * deviator.norm_squared()).sqrt()
}

/// `T += factor · U`.
pub fn add4<const D: usize>(t: &mut Tensor4<D>, u: &Tensor4<D>, factor: f64) {
    for (row, other) in t.iter_mut().flatten().zip(u.iter().flatten()) {
        *row += other * factor;
    }
}

/// `(T : A)_ij = T_ijkl A_kl`.
#[inline]
pub fn apply4<const D: usize>(t: &Tensor4<D>, a: &Tensor<D>) -> Tensor<D> {
    Tensor::from_fn(|i, j| contract(&t[i][j], a))
}

/// The three coordinates of a point, missing ones zero (for expressions and files).
pub fn coordinates<const D: usize>(x: &Vector<D>) -> [f64; 3] {
    std::array::from_fn(|i| if i < D { x[i] } else { 0.0 })
}

/// Slices of a flat particle-major array as vectors.
#[inline]
pub fn vector_at<const D: usize>(flat: &[f64], particle: usize) -> Vector<D> {
    Vector::from_column_slice(&flat[particle * D..particle * D + D])
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn sample<const D: usize>(seed: f64) -> Tensor<D> {
        Tensor::from_fn(|i, j| if i == j { 1.1 } else { 0.0 } + 0.3 * (seed + 3.0 * i as f64 + 1.7 * j as f64).sin())
    }

    fn identities<const D: usize>() {
        let (f, a, b) = (sample::<D>(0.2), sample::<D>(1.0), sample::<D>(2.0));
        assert_relative_eq!(cofactor(&f), inverse(&f).expect("regular").transpose() * determinant(&f), epsilon = 1e-13);
        // The cofactor is the derivative of the determinant.
        let h = 1e-6;
        let slope = (determinant(&(f + a * h)) - determinant(&(f - a * h))) / (2.0 * h);
        assert_relative_eq!(slope, contract(&cofactor(&f), &a), epsilon = 1e-8);
        let numeric = (cofactor(&(f + a * h)) - cofactor(&(f - a * h))) / (2.0 * h);
        assert_relative_eq!(numeric, cofactor_variation(&f, &a), epsilon = 1e-8);
        assert_relative_eq!(
            contract(&b, &cofactor_variation(&f, &a)),
            contract(&a, &cofactor_variation(&f, &b)),
            epsilon = 1e-13
        );
        let (lambda, u) = smallest_stretch(&f);
        assert_relative_eq!(f.transpose() * f * u, u * lambda, epsilon = 1e-12);
        assert_relative_eq!(u.norm(), 1.0, epsilon = 1e-12);
        assert_relative_eq!(dilation(&(f - Tensor::identity())), determinant(&f) - 1.0, epsilon = 1e-13);
        let t = tensor4_of(|x| cofactor_variation(&f, x));
        assert_relative_eq!(apply4(&t, &a), cofactor_variation(&f, &a), epsilon = 1e-13);
    }

    fn secant_is_exact_and_symmetric<const D: usize>() {
        let (start, mean, direction) = (sample::<D>(0.2), sample::<D>(0.4), sample::<D>(2.0));
        let secant = CofactorSecant::new(start, mean).expect("positive volume");
        let change = determinant(&secant.end) - determinant(&start);
        assert_relative_eq!(contract(&secant.value, &(secant.end - start)), change, epsilon = 1e-13);
        let turning = secant.value * mean.transpose();
        assert_relative_eq!(turning, turning.transpose(), epsilon = 1e-13);
        let at = |h: f64| CofactorSecant::new(start, mean + direction * h).expect("positive volume").value;
        let h = 1e-6;
        assert_relative_eq!((at(h) - at(-h)) / (2.0 * h), secant.variation(&direction), epsilon = 1e-8);
    }

    #[test]
    fn the_discrete_cofactor_gives_the_change_of_the_determinant() {
        secant_is_exact_and_symmetric::<1>();
        secant_is_exact_and_symmetric::<2>();
        secant_is_exact_and_symmetric::<3>();
    }

    #[test]
    fn tensor_identities_hold_in_every_dimension() {
        identities::<1>();
        identities::<2>();
        identities::<3>();
    }

    #[test]
    fn smallest_stretch_of_the_identity_is_one_with_a_unit_vector() {
        let (lambda, u) = smallest_stretch(&Tensor::<2>::identity());
        assert_eq!(lambda, 1.0);
        assert_relative_eq!(u.norm(), 1.0);
        let (lambda, u) = smallest_stretch(&Tensor::<3>::identity());
        assert_relative_eq!(lambda, 1.0, epsilon = 1e-14);
        assert_relative_eq!(u.norm(), 1.0, epsilon = 1e-14);
    }
}
