//! Cells as multilinear images of the unit cube: segments, quadrilaterals, hexahedra.
//!
//! Corners are numbered by bits: bit `i` says which end of direction `i`.

use crate::tensor::{Tensor, Vector, cofactor};

/// Places and weight of Gauss's rule with two points on [0, 1]: exact for cubic polynomials, and the
/// integrands here are of third degree in each direction at most.
const GAUSS: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];
const GAUSS_WEIGHT: f64 = 0.5;
/// `Q_ab = ∫ φ_a ∇φ_b dV` over a cell, for all pairs of corners (`a` first), with its shape functions `φ`; exact.
///
/// Summed over the cells of a body these are gradient weights times volumes: `Q 1 = 0`, `Q X_J = V δ_J`,
/// and by Gauss's theorem `Qᵀ 1 = ∫ φ N dA`, `Qᵀ X_J = ∫ φ X_J N dA − V δ_J`.
pub(crate) fn gradient_products<const D: usize>(corners: &[Vector<D>]) -> Vec<Vector<D>> {
    let count = corners.len();
    let mut products = vec![Vector::zeros(); count * count];
    for (place, weight) in gauss::<D>() {
        let cofactor = cofactor(&slope(corners, &place)) * weight;
        for b in 0..count {
            let gradient = cofactor * shape_slope(b, &place);
            for a in 0..count {
                products[a * count + b] += gradient * shape(a, &place);
            }
        }
    }
    products
}

/// Shape function of a corner.
fn shape<const D: usize>(code: usize, place: &Vector<D>) -> f64 {
    (0..D).map(|axis| if code >> axis & 1 == 1 { place[axis] } else { 1.0 - place[axis] }).product()
}

/// Derivative of [`shape`] in the unit cube.
fn shape_slope<const D: usize>(code: usize, place: &Vector<D>) -> Vector<D> {
    Vector::from_fn(|axis, _| {
        let sign = if code >> axis & 1 == 1 { 1.0 } else { -1.0 };
        let others = (0..D).filter(|other| *other != axis);
        sign * others.map(|i| if code >> i & 1 == 1 { place[i] } else { 1.0 - place[i] }).product::<f64>()
    })
}

/// Image of a place in the unit cube under the multilinear map of a cell.
pub(super) fn image<const D: usize>(corners: &[Vector<D>], place: &Vector<D>) -> Vector<D> {
    // From one corner, so that the place in space costs no digits.
    let origin = corners[0];
    corners.iter().enumerate().fold(origin, |sum, (code, corner)| sum + (corner - origin) * shape(code, place))
}

/// Derivative of [`image`]: columns are the directions of the unit cube.
pub(super) fn slope<const D: usize>(corners: &[Vector<D>], place: &Vector<D>) -> Tensor<D> {
    let mut slope = Tensor::<D>::zeros();
    for axis in 0..D {
        let column = (0..corners.len()).filter(|code| code >> axis & 1 == 0).fold(Vector::<D>::zeros(), |sum, code| {
            let weight: f64 = (0..D)
                .filter(|other| *other != axis)
                .map(|other| if code >> other & 1 == 1 { place[other] } else { 1.0 - place[other] })
                .product();
            sum + (corners[code | 1 << axis] - corners[code]) * weight
        });
        slope.set_column(axis, &column);
    }
    slope
}

/// Points and weights of the quadrature on the unit cube.
pub(super) fn gauss<const D: usize>() -> Vec<(Vector<D>, f64)> {
    let point = |code: usize| Vector::from_fn(|axis, _| GAUSS[code >> axis & 1]);
    (0..1 << D).map(|code| (point(code), GAUSS_WEIGHT.powi(D as i32))).collect()
}
