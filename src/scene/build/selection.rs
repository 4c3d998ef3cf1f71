//! Selectors: which particles a condition is about.

use nalgebra::SVector;

use super::{Context, suggest};
use crate::expression::Expression;
use crate::geometry::Group;
use crate::scene::checks::{COORDINATES, padded, place};
use crate::scene::document::{SelectText, Spanned, Text};
use crate::scene::findings::Findings;
use crate::setup::Side;

/// Part of the size of a body by which a particle may miss a selector: rounding of positions.
const TOLERANCE: f64 = 1e-9;

/// A selector that has been checked.
pub(super) enum Selector<const D: usize> {
    All,
    Face(Side),
    HalfSpace { point: SVector<f64, D>, normal: SVector<f64, D> },
    Box { lower: SVector<f64, D>, upper: SVector<f64, D> },
    Where(Expression),
    Group(String),
}

impl<const D: usize> Selector<D> {
    /// Checks a selector; `None` if a mistake was noted.
    pub fn read(text: &Spanned<SelectText>, findings: &mut Findings<'_>) -> Option<Self> {
        match text.get_ref() {
            SelectText::All => Some(Self::All),
            SelectText::Face(name) => {
                let side = name.get_ref().side();
                if side.axis < D {
                    return Some(Self::Face(side));
                }
                let names = ["lower_x, upper_x", "lower_y, upper_y", "lower_z, upper_z"][..D].join(", ");
                let message = format!("a {D}-dimensional body has no such face");
                findings.error(name.span(), message, format!("the faces are {names}"));
                None
            }
            SelectText::HalfSpace(half) => {
                let point = findings.vector(&half.point, "point");
                let normal: SVector<f64, D> = findings.vector(&half.normal, "normal")?;
                // Scaled first: the norm of a tiny or huge vector would under- or overflow.
                let largest = normal.amax();
                if largest == 0.0 {
                    findings.error(half.normal.span(), "the normal is zero", "give a direction, such as [0, -1]");
                    return None;
                }
                Some(Self::HalfSpace { point: point?, normal: (normal / largest).normalize() })
            }
            SelectText::Box(text) => {
                let lower: Option<SVector<f64, D>> = findings.vector(&text.lower, "lower");
                let (lower, upper): (_, SVector<f64, D>) = (lower?, findings.vector(&text.upper, "upper")?);
                if let Some(axis) = (0..D).find(|axis| upper[*axis] < lower[*axis]) {
                    let message = format!(
                        "the box ends before it begins along {}: {} to {}",
                        ["x", "y", "z"][axis],
                        lower[axis],
                        upper[axis]
                    );
                    findings.error(text.upper.span(), message, "make `upper` at least as large as `lower`");
                    return None;
                }
                Some(Self::Box { lower, upper })
            }
            SelectText::Where(text) => {
                let condition = findings.expression::<D>(text.get_ref(), [0; 4], text.span())?;
                if condition.depends_on_time() {
                    let remedy = "use X, Y, Z alone: particles are selected once, at the start";
                    findings.error(text.span(), "a selection cannot depend on the time", remedy);
                    return None;
                }
                Some(Self::Where(condition))
            }
            SelectText::Group(name) => Some(Self::Group(name.get_ref().trim().to_owned())),
        }
    }

    /// Whether a particle of a body of that size is meant; `carries` are those of the face or group, ascending.
    fn holds(&self, particle: usize, position: &SVector<f64, D>, size: f64, carries: &[usize]) -> bool {
        let slack = TOLERANCE * size;
        match self {
            Self::All => true,
            Self::Face(_) | Self::Group(_) => carries.binary_search(&particle).is_ok(),
            Self::HalfSpace { point, normal } => (position - point).dot(normal) >= -slack,
            Self::Box { lower, upper } => {
                (0..D).all(|axis| position[axis] >= lower[axis] - slack && position[axis] <= upper[axis] + slack)
            }
            Self::Where(condition) => condition.value(padded(position), 0.0) != 0.0,
        }
    }
}

impl<const D: usize> Context<'_, '_, D> {
    /// Indices of the bodies that a condition names; all if it names none; `None` if there is no such body.
    pub fn bodies_named(&mut self, text: Option<&Text>) -> Option<Vec<usize>> {
        let Some(text) = text else { return Some((0..self.bodies.names.len()).collect()) };
        if let Some(index) = self.bodies.names.iter().position(|name| name == text.get_ref().trim()) {
            return Some(vec![index]);
        }
        let remedy = suggest(text.get_ref(), &self.bodies.names);
        self.findings.error(text.span(), format!("there is no body '{}'", text.get_ref()), remedy);
        None
    }

    /// The particles that a condition is about, in their order. `what` names the condition, as in
    /// "boundary 'base'". An empty selection is a mistake, unless a body could not be made.
    pub fn select(&mut self, what: &str, bodies: &[usize], text: &Spanned<SelectText>) -> Option<Vec<usize>> {
        let selector = Selector::<D>::read(text, self.findings)?;
        let mut carries = Vec::new();
        if let Selector::Face(side) = &selector {
            let faces = self.particles.faces.iter().filter(|face| face.side == Some(*side));
            carries.extend(faces.map(|face| face.particle));
            carries.sort_unstable();
        }
        if let (Selector::Group(name), SelectText::Group(text)) = (&selector, text.get_ref()) {
            for group in self.groups_named(name, bodies, text)? {
                carries.extend(&group.particles);
            }
            carries.sort_unstable();
        }
        let mut selected = Vec::new();
        for made in bodies.iter().filter_map(|index| self.bodies.made[*index].as_ref()) {
            let size = made.size();
            for particle in made.body.particles.clone() {
                let position = &self.particles.positions[particle];
                if let Selector::Where(condition) = &selector
                    && condition.value(padded(position), 0.0).is_nan()
                {
                    let message = format!("the condition is not a number at {}", place(position));
                    self.findings.error(text.span(), message, "check for 0/0 and roots of negative numbers");
                    return None;
                }
                if selector.holds(particle, position, size, &carries) {
                    selected.push(particle);
                }
            }
        }
        if selected.is_empty() && bodies.iter().all(|index| self.bodies.made[*index].is_some()) {
            let (reason, remedy) = self.why_empty(&selector, bodies);
            self.findings.error(text.span(), format!("{what} selects no particle: {reason}"), remedy);
            return None;
        }
        Some(selected)
    }

    /// The groups of that name; `None` if there is none.
    pub fn groups_named(&mut self, name: &str, bodies: &[usize], text: &Text) -> Option<Vec<Group>> {
        let made = || bodies.iter().filter_map(|index| self.bodies.made[*index].as_ref());
        let found: Vec<Group> = made().filter_map(|made| made.groups.get(name).cloned()).collect();
        if found.is_empty() && bodies.iter().all(|index| self.bodies.made[*index].is_some()) {
            let known: Vec<String> = made().flat_map(|made| made.groups.keys().cloned()).collect();
            let remedy = if known.is_empty() {
                "groups are those of a Gmsh file, `mesh = { file = … }`".to_owned()
            } else {
                suggest(name, &known)
            };
            self.findings.error(text.span(), format!("there is no group '{name}'"), remedy);
            return None;
        }
        Some(found)
    }

    /// Where the particles are, seen from a selector that holds none.
    fn why_empty(&self, selector: &Selector<D>, bodies: &[usize]) -> (String, String) {
        if let Selector::Face(_) = selector {
            let reason = "no piece of its boundary lies in that side of its bounding box".to_owned();
            return (reason, "use `select.box`, `select.half_space` or `select.where`".to_owned());
        }
        if let Selector::Group(_) = selector {
            let reason = "the group has none: particles in the cells carry groups of cells and of sides".to_owned();
            return (reason, "give `mesh.particles = \"nodes\"`, or select by place".to_owned());
        }
        let positions = || {
            let made = bodies.iter().filter_map(|index| self.bodies.made[*index].as_ref());
            made.flat_map(|made| self.particles.positions[made.body.particles.clone()].iter())
        };
        let extreme = |axis: usize, sign: f64| {
            positions().map(|position| sign * position[axis]).fold(f64::NEG_INFINITY, f64::max) * sign
        };
        if let Selector::HalfSpace { point, normal } = selector {
            if let Some(axis) = (0..D).find(|axis| normal[*axis].abs() == 1.0) {
                let which = if normal[axis] < 0.0 { "lowest" } else { "highest" };
                let (name, found) = (COORDINATES[axis], extreme(axis, normal[axis]));
                return (
                    format!("{which} {name} is {found}"),
                    format!("move `point` from {name} = {} to {name} = {found}, or use a finer layout", point[axis]),
                );
            }
            let short = positions().map(|position| (position - point).dot(normal)).fold(f64::NEG_INFINITY, f64::max);
            return (format!("the nearest one is {} m outside", -short), "move `point`, or turn `normal`".to_owned());
        }
        let ranges: Vec<String> = (0..D)
            .map(|axis| format!("{} from {} to {}", COORDINATES[axis], extreme(axis, -1.0), extreme(axis, 1.0)))
            .collect();
        (format!("the particles have {}", ranges.join(", ")), "widen the selection to where particles are".to_owned())
    }
}
