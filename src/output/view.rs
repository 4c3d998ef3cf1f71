//! From where particles in space are seen.

use super::OutputError;
use super::canvas::Point;
use super::quantity::remedy;

/// Names of directions with their azimuth and elevation in degrees.
const NAMED: [(&str, f64, f64); 7] = [
    ("iso", -60.0, 30.0),
    ("front", -90.0, 0.0),
    ("back", 90.0, 0.0),
    ("right", 0.0, 0.0),
    ("left", 180.0, 0.0),
    ("top", -90.0, 90.0),
    ("bottom", -90.0, -90.0),
];

/// Distance of the eye from the middle over the radius of what is seen.
const DISTANCE: f64 = 3.5;

/// A direction of view with z upwards.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// Angle of the viewer from x towards y, radians.
    pub azimuth: f64,
    /// Angle of the viewer above the x–y plane, radians.
    pub elevation: f64,
    /// Whether what is farther is smaller.
    pub perspective: bool,
}

impl Default for View {
    fn default() -> Self {
        Self { azimuth: -60f64.to_radians(), elevation: 30f64.to_radians(), perspective: false }
    }
}

impl View {
    /// A view by name (`iso`, `front`, …) or by `AZIMUTH,ELEVATION` in degrees.
    ///
    /// # Errors
    /// [`OutputError::Request`] for anything else.
    pub fn parse(text: &str) -> Result<Self, OutputError> {
        let named = NAMED.iter().find(|(name, ..)| *name == text).map(|&(_, azimuth, elevation)| (azimuth, elevation));
        let given = || {
            let (azimuth, elevation) = text.split_once(',')?;
            let (azimuth, elevation): (f64, f64) = (azimuth.trim().parse().ok()?, elevation.trim().parse().ok()?);
            (azimuth.abs() <= 3600.0 && elevation.abs() <= 90.0).then_some((azimuth, elevation))
        };
        let (azimuth, elevation) = named.or_else(given).ok_or_else(|| {
            let names: Vec<&str> = NAMED.iter().map(|(name, ..)| *name).collect();
            let otherwise = format!("{}; or give AZIMUTH,ELEVATION in degrees, as in -60,30", remedy(text, &names));
            OutputError::request(format!("there is no view `{text}`"), otherwise)
        })?;
        Ok(Self { azimuth: azimuth.to_radians(), elevation: elevation.to_radians(), ..Self::default() })
    }

    /// Unit vectors to the right, upwards, towards the viewer.
    pub(super) fn directions(&self) -> [[f64; 3]; 3] {
        let ((sa, ca), (se, ce)) = (self.azimuth.sin_cos(), self.elevation.sin_cos());
        [[-sa, ca, 0.0], [-se * ca, -se * sa, ce], [ce * ca, ce * sa, se]]
    }
}

/// Low and high end of each direction.
pub(super) type Bounds = [(f64, f64); 3];

/// Nothing yet.
pub(super) const NO_BOUNDS: Bounds = [(f64::INFINITY, f64::NEG_INFINITY); 3];

/// Bounds with further points of `dim` components; those without a finite place do not count.
pub(super) fn widened(mut bounds: Bounds, positions: &[f64], dim: usize) -> Bounds {
    for point in positions.chunks_exact(dim.max(1)).filter(|point| has_place(point)) {
        for (range, &value) in bounds.iter_mut().zip(point) {
            *range = (range.0.min(value), range.1.max(value));
        }
    }
    bounds
}

/// Whether a point can be drawn at all.
pub(super) fn has_place(point: &[f64]) -> bool {
    point.iter().all(|component| component.abs() < 1e150)
}

/// A view of certain bounds, ready to project.
#[derive(Debug, Clone, Copy)]
pub(super) struct Camera {
    directions: [[f64; 3]; 3],
    centre: [f64; 3],
    /// Distance of the eye from the centre; infinite without perspective.
    distance: f64,
}

/// A point as seen.
#[derive(Debug, Clone, Copy)]
pub(super) struct Seen {
    /// Right and up, in m (at the depth of the middle).
    pub(super) place: Point,
    /// Towards the viewer, in m.
    pub(super) depth: f64,
    /// Apparent over true size.
    pub(super) size: f64,
}

impl Camera {
    pub(super) fn new(view: &View, bounds: &Bounds) -> Self {
        let usable =
            |&(low, high): &(f64, f64)| if low <= high { (0.5 * (low + high), 0.5 * (high - low)) } else { (0.0, 0.0) };
        let [x, y, z] = [usable(&bounds[0]), usable(&bounds[1]), usable(&bounds[2])];
        let radius = x.1.hypot(y.1).hypot(z.1);
        let distance = if view.perspective && radius > 0.0 { DISTANCE * radius } else { f64::INFINITY };
        Self { directions: view.directions(), centre: [x.0, y.0, z.0], distance }
    }

    /// Where a point of 2 or 3 components appears; `None` behind the eye.
    pub(super) fn see(&self, position: &[f64]) -> Option<Seen> {
        let &[x, y, z] = position else {
            return Some(Seen { place: (position[0], position[1]), depth: 0.0, size: 1.0 });
        };
        let along = |axis: [f64; 3], at: [f64; 3]| axis[0] * at[0] + axis[1] * at[1] + axis[2] * at[2];
        let [right, up, towards] = self.directions;
        if self.distance.is_infinite() {
            let at = [x, y, z];
            return Some(Seen { place: (along(right, at), along(up, at)), depth: along(towards, at), size: 1.0 });
        }
        let at = [x - self.centre[0], y - self.centre[1], z - self.centre[2]];
        let depth = along(towards, at);
        let size = self.distance / (self.distance - depth);
        (depth < 0.9 * self.distance).then(|| Seen {
            place: (size * along(right, at), size * along(up, at)),
            depth,
            size,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn views_by_name_and_angle() {
        let top = View::parse("top").unwrap();
        let [right, up, towards] = top.directions();
        let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-15);
        assert!(near(right, [1., 0., 0.]) && near(up, [0., 1., 0.]) && near(towards, [0., 0., 1.]));
        assert_eq!(View::parse("iso").unwrap(), View::default());
        assert_eq!(View::parse("-60, 30").unwrap(), View::default());
        for wrong in ["", "tpo", "1", "1,2,3", "nan,0", "0,100", "1e99,0"] {
            assert!(matches!(View::parse(wrong), Err(OutputError::Request { .. })), "{wrong}");
        }
        assert!(View::parse("frnt").unwrap_err().to_string().contains("did you mean `front`"));
    }

    #[test]
    fn perspective_shows_the_nearer_larger() {
        let view = View { perspective: true, ..View::parse("front").unwrap() };
        let camera = Camera::new(&view, &widened(NO_BOUNDS, &[-1., -1., -1., 1., 1., 1.], 3));
        let (near, far) = (camera.see(&[1.0, -1.0, 0.5]).unwrap(), camera.see(&[1.0, 1.0, 0.5]).unwrap());
        assert!(near.size > 1.0 && far.size < 1.0 && near.depth > far.depth);
        assert!(near.place.0 > far.place.0 && (near.place.0 / near.size - 1.0).abs() < 1e-15);
        assert!(camera.see(&[0.0, -1e3, 0.0]).is_none());
        let flat = Camera::new(&View::default(), &NO_BOUNDS);
        assert_eq!(flat.see(&[2.0, 3.0]).unwrap().place, (2.0, 3.0));
    }
}
