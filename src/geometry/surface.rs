//! Triangulated surfaces: whether they close, what they enclose, and on which side of them a point lies.
//!
//! Inside is where the *generalised winding number* (Jacobson, Kavan and Sorkine-Hornung 2013) is at least one half: the
//! solid angle of all triangles over 4π. It needs no closed surface: small holes and gaps change it little. Clusters of
//! triangles that are far away count as one dipole with its first moments (Barill, Dickson, Schmidt, Levin and Jacobson
//! 2018): with areas a_i at d_i from the middle of a cluster, which is at r from the point, their solid angle is
//!
//! ```text
//! Σ a_i·(r + d_i)/|r + d_i|³ ≈ a·r/r³ + tr M/r³ − 3 r·M r/r⁵,     a = Σ a_i,  M = Σ a_i ⊗ d_i.
//! ```
//!
//! Always the same order of summation: the same bits on every machine.

use std::collections::HashMap;
use std::f64::consts::PI;

use crate::tensor::{Tensor, Vector};

/// Corners of a triangle, counterclockwise seen from outside, m.
pub type Triangle = [Vector<3>; 3];

/// Triangles of a leaf of the tree.
const LEAF: usize = 8;
/// Distance over radius from which a cluster counts as one (β in the paper).
const FAR: f64 = 2.5;

/// A surface of triangles.
#[derive(Debug, Clone)]
pub struct Surface {
    triangles: Vec<Triangle>,
    nodes: Vec<Node>,
    open_edges: usize,
    reversed: bool,
    volume: f64,
    moment: Vector<3>,
}

#[derive(Debug, Clone)]
struct Node {
    lower: Vector<3>,
    upper: Vector<3>,
    /// Middle of the areas, the sum of the area vectors, and that of their products with the way from the middle.
    centre: Vector<3>,
    dipole: Vector<3>,
    moment: Tensor<3>,
    /// Of a ball around `centre` that holds all triangles.
    radius: f64,
    /// Triangles.
    range: std::ops::Range<usize>,
    /// The second child; the first one follows its parent. 0 in leaves.
    second: usize,
}

impl Surface {
    /// Welds corners that agree to the last bit, looks for open edges, and turns a closed surface with its inside out.
    pub fn new(mut triangles: Vec<Triangle>) -> Self {
        let origin = triangles.first().map_or(Vector::zeros(), |triangle| triangle[0]);
        let (mut volume, mut moment) = enclosed(&triangles, &origin);
        let open_edges = open_edges(&triangles);
        let reversed = open_edges == 0 && volume < 0.0;
        if reversed {
            triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
            (volume, moment) = (-volume, -moment);
        }
        moment += origin * volume;
        let mut surface = Self { nodes: Vec::new(), triangles, open_edges, reversed, volume, moment };
        if !surface.triangles.is_empty() {
            surface.grow(0..surface.triangles.len());
        }
        surface
    }

    /// The triangles, in the order of the tree.
    pub fn triangles(&self) -> &[Triangle] {
        &self.triangles
    }

    /// Edges that are not met by as many triangles from one side as from the other.
    pub fn open_edges(&self) -> usize {
        self.open_edges
    }

    /// Whether every edge has its counterpart.
    pub fn is_closed(&self) -> bool {
        self.open_edges == 0
    }

    /// Whether its normals pointed inwards, and were turned.
    pub fn was_reversed(&self) -> bool {
        self.reversed
    }

    /// Volume by the divergence theorem, m³; of an open surface as if closed by a cone to its first corner.
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// `∫ X dV`, m⁴.
    pub fn moment(&self) -> Vector<3> {
        self.moment
    }

    /// Corners of the box around it, m.
    pub fn bounds(&self) -> (Vector<3>, Vector<3>) {
        self.nodes.first().map_or((Vector::zeros(), Vector::zeros()), |node| (node.lower, node.upper))
    }

    /// Builds the subtree of a range and returns its index.
    fn grow(&mut self, range: std::ops::Range<usize>) -> usize {
        let triangles = &mut self.triangles[range.clone()];
        let mut lower = Vector::<3>::repeat(f64::INFINITY);
        let mut upper = Vector::<3>::repeat(f64::NEG_INFINITY);
        let (mut centre, mut dipole, mut total) = (Vector::zeros(), Vector::zeros(), 0.0);
        for triangle in triangles.iter() {
            triangle.iter().for_each(|corner| (lower, upper) = (lower.inf(corner), upper.sup(corner)));
            let area = area(triangle);
            let size = area.norm();
            centre += middle(triangle) * size;
            dipole += area;
            total += size;
        }
        centre = if total > 0.0 { centre / total } else { (lower + upper) / 2.0 };
        let moment = triangles.iter().map(|triangle| area(triangle) * (middle(triangle) - centre).transpose()).sum();
        let radius = triangles.iter().flatten().map(|corner| (corner - centre).norm()).fold(0.0, f64::max);
        let index = self.nodes.len();
        self.nodes.push(Node { lower, upper, centre, dipole, moment, radius, range: range.clone(), second: 0 });
        if range.len() > LEAF {
            let axis = (upper - lower).imax();
            // Stable, so that equal places keep the order of the file.
            triangles.sort_by(|a, b| middle(a)[axis].total_cmp(&middle(b)[axis]));
            let half = range.start + range.len() / 2;
            self.grow(range.start..half);
            let second = self.grow(half..range.end);
            self.nodes[index].second = second;
        }
        index
    }

    /// The generalised winding number at a point: 1 inside, 0 outside of a closed surface.
    pub fn winding(&self, x: &Vector<3>) -> f64 {
        if self.nodes.is_empty() { 0.0 } else { self.solid_angle(0, x) / (4.0 * PI) }
    }

    fn solid_angle(&self, index: usize, x: &Vector<3>) -> f64 {
        let node = &self.nodes[index];
        let from = node.centre - x;
        let distance = from.norm();
        if distance > FAR * node.radius {
            let (square, cube) = (distance * distance, distance.powi(3));
            let bend = node.moment.trace() - 3.0 * from.dot(&(node.moment * from)) / square;
            return (from.dot(&node.dipole) + bend) / cube;
        }
        if node.second == 0 {
            return self.triangles[node.range.clone()].iter().map(|triangle| solid_angle(triangle, x)).sum();
        }
        self.solid_angle(index + 1, x) + self.solid_angle(node.second, x)
    }

    /// Distance to the nearest triangle, m, negative where the winding number is at least one half.
    pub fn signed_distance(&self, x: &Vector<3>) -> f64 {
        let mut nearest = f64::INFINITY;
        if !self.nodes.is_empty() {
            self.nearest(0, x, &mut nearest);
        }
        let distance = nearest.sqrt();
        if self.winding(x) >= 0.5 { -distance } else { distance }
    }

    fn nearest(&self, index: usize, x: &Vector<3>, nearest: &mut f64) {
        let node = &self.nodes[index];
        if node.second == 0 {
            for triangle in &self.triangles[node.range.clone()] {
                *nearest = nearest.min((closest(triangle, x) - x).norm_squared());
            }
            return;
        }
        let gap = |node: &Node| (node.lower - x).sup(&(x - node.upper)).map(|gap| gap.max(0.0)).norm_squared();
        let (mut near, mut far) = (index + 1, node.second);
        let mut gaps = (gap(&self.nodes[near]), gap(&self.nodes[far]));
        if gaps.1 < gaps.0 {
            (near, far) = (far, near);
            gaps = (gaps.1, gaps.0);
        }
        if gaps.0 < *nearest {
            self.nearest(near, x, nearest);
        }
        if gaps.1 < *nearest {
            self.nearest(far, x, nearest);
        }
    }
}

/// Volume and first moments about `origin` that triangles enclose together with it.
fn enclosed(triangles: &[Triangle], origin: &Vector<3>) -> (f64, Vector<3>) {
    triangles.iter().fold((0.0, Vector::zeros()), |(volume, moment), triangle| {
        let [a, b, c] = triangle.map(|corner| corner - origin);
        let part = a.dot(&b.cross(&c)) / 6.0;
        (volume + part, moment + (a + b + c) * (part / 4.0))
    })
}

/// Area vector.
pub(super) fn area([a, b, c]: &Triangle) -> Vector<3> {
    (b - a).cross(&(c - a)) / 2.0
}

fn middle([a, b, c]: &Triangle) -> Vector<3> {
    (a + b + c) / 3.0
}

/// Edges that are run through more often one way than the other.
fn open_edges(triangles: &[Triangle]) -> usize {
    // Minus zero is zero.
    let key = |corner: &Vector<3>| [0, 1, 2].map(|axis| (corner[axis] + 0.0).to_bits());
    let mut numbers: HashMap<[u64; 3], u32> = HashMap::with_capacity(triangles.len() / 2);
    let mut edges: HashMap<(u32, u32), i32> = HashMap::with_capacity(triangles.len() * 3 / 2);
    for triangle in triangles {
        let corners = [0, 1, 2].map(|corner| {
            let next = numbers.len() as u32;
            *numbers.entry(key(&triangle[corner])).or_insert(next)
        });
        for (from, to) in [(0, 1), (1, 2), (2, 0)].map(|(i, j)| (corners[i], corners[j])) {
            if from != to {
                let sign = if from < to { 1 } else { -1 };
                *edges.entry((from.min(to), from.max(to))).or_default() += sign;
            }
        }
    }
    edges.values().map(|surplus| surplus.unsigned_abs() as usize).sum()
}

/// Solid angle of a triangle (van Oosterom and Strackee 1983).
fn solid_angle(triangle: &Triangle, x: &Vector<3>) -> f64 {
    let [a, b, c] = triangle.map(|corner| corner - x);
    let (la, lb, lc) = (a.norm(), b.norm(), c.norm());
    let above = a.dot(&b.cross(&c));
    let below = la * lb * lc + a.dot(&b) * lc + b.dot(&c) * la + c.dot(&a) * lb;
    // In the plane of a triangle, but not in it, `above` is zero; in it the sign is that of rounding.
    2.0 * above.atan2(below)
}

/// The point of a triangle that is nearest to `x` (Ericson, Real-Time Collision Detection, 5.1.5).
fn closest([a, b, c]: &Triangle, x: &Vector<3>) -> Vector<3> {
    let (ab, ac) = (b - a, c - a);
    let ax = x - a;
    let (d1, d2) = (ab.dot(&ax), ac.dot(&ax));
    if d1 <= 0.0 && d2 <= 0.0 {
        return *a;
    }
    let bx = x - b;
    let (d3, d4) = (ab.dot(&bx), ac.dot(&bx));
    if d3 >= 0.0 && d4 <= d3 {
        return *b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cx = x - c;
    let (d5, d6) = (ab.dot(&cx), ac.dot(&cx));
    if d6 >= 0.0 && d5 <= d6 {
        return *c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 - d3 >= 0.0 && d5 - d6 >= 0.0 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let sum = va + vb + vc;
    a + ab * (vb / sum) + ac * (vc / sum)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A torus around z with radii 1 and `tube`, of `n` by `m` quadrilaterals; a sphere if `tube` is none.
    pub fn round(n: usize, m: usize, tube: Option<f64>) -> Vec<Triangle> {
        let point = |i: usize, j: usize| -> Vector<3> {
            let around = 2.0 * PI * (i % n) as f64 / n as f64;
            let (radius, height) = match tube {
                Some(tube) => {
                    let angle = 2.0 * PI * (j % m) as f64 / m as f64;
                    (1.0 + tube * angle.cos(), tube * angle.sin())
                }
                // Exactly at the poles, or the sphere would be open there.
                None if j == 0 => (0.0, -1.0),
                None if j == m => (0.0, 1.0),
                None => {
                    let angle = PI * j as f64 / m as f64;
                    (angle.sin(), -angle.cos())
                }
            };
            [radius * around.cos(), radius * around.sin(), height].into()
        };
        let mut triangles = Vec::new();
        for (i, j) in (0..n).flat_map(|i| (0..m).map(move |j| (i, j))) {
            let [a, b, c, d] = [point(i, j), point(i + 1, j), point(i + 1, j + 1), point(i, j + 1)];
            triangles
                .extend([[a, b, c], [a, c, d]].into_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]));
        }
        triangles
    }

    #[test]
    fn closed_surfaces_are_known_and_turned_outwards() {
        let triangles = round(40, 20, None);
        let sphere = Surface::new(triangles.clone());
        assert!(sphere.is_closed() && !sphere.was_reversed());
        assert!(sphere.volume() > 4.1 && sphere.volume() < 4.0 / 3.0 * PI);
        let inward = Surface::new(triangles.iter().map(|[a, b, c]| [*a, *c, *b]).collect());
        assert!(inward.was_reversed() && (inward.volume() - sphere.volume()).abs() < 1e-13);
        let open = Surface::new(triangles[1..].to_vec());
        assert_eq!(open.open_edges(), 3);
    }

    #[test]
    fn winding_and_distance_tell_the_sides() {
        let torus = Surface::new(round(100, 50, Some(0.4)));
        assert_eq!(torus.triangles().len(), 10_000);
        let exact = |x: &Vector<3>| torus.triangles().iter().map(|t| solid_angle(t, x)).sum::<f64>() / (4.0 * PI);
        let mut seed = 0.3_f64;
        let mut next = || {
            seed = (seed * 17.0 + 0.123).fract();
            3.0 * seed - 1.5
        };
        for _ in 0..60 {
            let x = Vector::from([next(), next(), next() / 3.0]);
            // The dipole alone needs clusters to be 3.5 radii away for that, and twice as many of them.
            assert!((torus.winding(&x) - exact(&x)).abs() < 0.02);
            let truth = (x[0].hypot(x[1]) - 1.0).hypot(x[2]) - 0.4;
            if truth.abs() > 5e-3 {
                assert!((torus.signed_distance(&x) - truth).abs() < 5e-3, "{x} {truth}");
            }
        }
        // A hole of one triangle does not turn inside and outside round.
        let holed = Surface::new(torus.triangles()[1..].to_vec());
        assert!(holed.winding(&[1.0, 0.0, 0.0].into()) > 0.9 && holed.winding(&[0.0, 0.0, 0.0].into()) < 0.1);
    }
}
