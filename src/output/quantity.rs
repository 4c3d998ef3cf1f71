//! Which number of a frame is shown: a field, and for vectors and tensors one of their components.

use super::OutputError;
use super::stored_frame::StoredFrame;
use crate::expression::closest;

/// What is shown where nothing was chosen: the first of these that a frame has.
const PREFERRED: [&str; 4] = ["von_mises", "pressure", "jacobian", "displacement"];
const VECTOR: [&str; 4] = ["magnitude", "x", "y", "z"];
const TENSOR: [&str; 12] = ["magnitude", "von_mises", "trace", "xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"];

/// A number per particle.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Quantity {
    field: String,
    /// `None` for scalars.
    component: Option<&'static str>,
}

impl Quantity {
    /// The quantity of that name in frames like this one. Without a field: the von Mises stress, the pressure, or
    /// whatever there is. Without a component: the magnitude of a vector, the von Mises value of a stress, the
    /// Frobenius norm of other tensors.
    ///
    /// # Errors
    /// [`OutputError::Request`] for a field or component that there is not.
    pub fn choose(frame: &StoredFrame, field: Option<&str>, component: Option<&str>) -> Result<Self, OutputError> {
        let names: Vec<&str> = frame.fields().map(|(name, _)| name).collect();
        let chosen = match field {
            Some(field) => field,
            None => {
                PREFERRED.into_iter().find(|name| names.contains(name)).or(names.first().copied()).ok_or_else(|| {
                    let what = format!("{} has no fields", frame.path().display());
                    OutputError::request(what, "name some in `output.fields` and run the scene again")
                })?
            }
        };
        let Some((_, components)) = frame.fields().find(|(name, _)| *name == chosen) else {
            let what = format!("there is no field `{chosen}` in {}", frame.path().display());
            return Err(OutputError::request(what, remedy(chosen, &names)));
        };
        let known: &[&'static str] = match components {
            1 => &[],
            3 => &VECTOR,
            9 => &TENSOR,
            _ => &VECTOR[..1],
        };
        let component = match component {
            Some(component) => match known.iter().find(|name| **name == component) {
                Some(name) => Some(*name),
                None if known.is_empty() => {
                    let what = format!("the field `{chosen}` is a scalar and has no component `{component}`");
                    return Err(OutputError::request(what, "leave the component out"));
                }
                None => {
                    let what = format!("the field `{chosen}` has no component `{component}`");
                    return Err(OutputError::request(what, remedy(component, known)));
                }
            },
            None if chosen == "stress" => Some("von_mises"),
            None => known.first().copied(),
        };
        Ok(Self { field: chosen.to_owned(), component })
    }

    /// The values of a frame.
    ///
    /// # Errors
    /// [`OutputError::Malformed`] if the frame does not have the field, or it is damaged.
    pub fn values(&self, frame: &StoredFrame) -> Result<Vec<f64>, OutputError> {
        let field = frame.field(&self.field)?.ok_or_else(|| OutputError::Malformed {
            path: frame.path().to_path_buf(),
            reason: format!("it has no field `{}`, as other frames of the run have", self.field),
        })?;
        let Some(component) = self.component else { return Ok(field.values) };
        let odd = |entries: &[f64]| entries.len() < 9;
        let index = |letter: char| "xyz".find(letter).unwrap_or(0);
        // A frame may have another number of components than the one from which was chosen.
        let one = |entries: &[f64]| match component {
            "magnitude" => entries.iter().map(|entry| entry * entry).sum::<f64>().sqrt(),
            "trace" | "von_mises" if odd(entries) => f64::NAN,
            "trace" => entries[0] + entries[4] + entries[8],
            "von_mises" => von_mises(entries),
            name => entries.get(name.chars().fold(0, |at, letter| 3 * at + index(letter))).copied().unwrap_or(f64::NAN),
        };
        Ok(field.values.chunks_exact(field.components).map(one).collect())
    }

    /// A name for files: `stress-von_mises`.
    pub fn name(&self) -> String {
        match self.component {
            None | Some("magnitude") => self.field.clone(),
            Some(component) => format!("{}-{component}", self.field),
        }
    }

    /// What it is, with its unit if that is known: `von Mises stress [Pa]`.
    pub fn label(&self) -> String {
        let unit = match self.field.as_str() {
            "pressure" | "von_mises" | "stress" => " [Pa]",
            "velocity" => " [m/s]",
            "displacement" => " [m]",
            _ => "",
        };
        let field = self.field.replace('_', " ");
        match (self.field.as_str(), self.component) {
            ("von_mises", _) | ("stress", Some("von_mises")) => "von Mises stress [Pa]".to_owned(),
            (_, Some("magnitude")) => format!("{field}, magnitude{unit}"),
            (_, Some(component)) => format!("{field} {}{unit}", component.replace('_', " ")),
            _ => format!("{field}{unit}"),
        }
    }
}

/// √(3/2 s:s) of the deviator s.
fn von_mises(entries: &[f64]) -> f64 {
    let mean = (entries[0] + entries[4] + entries[8]) / 3.0;
    let deviator = |at: usize| if at.is_multiple_of(4) { entries[at] - mean } else { entries[at] };
    (1.5 * (0..9).map(|at| deviator(at).powi(2)).sum::<f64>()).sqrt()
}

/// "Did you mean", or all there are.
pub(super) fn remedy(word: &str, known: &[&str]) -> String {
    let list = known.join(", ");
    match closest(word, known.iter().copied()) {
        Some(near) => format!("did you mean `{near}`? (there are: {list})"),
        None if list.is_empty() => "there are none".to_owned(),
        None => format!("choose one of: {list}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn von_mises_of_tension_and_shear() {
        assert_eq!(von_mises(&[2.0, 0., 0., 0., 0., 0., 0., 0., 0.]), 2.0);
        assert!((von_mises(&[0., 1., 0., 1., 0., 0., 0., 0., 0.]) - 3f64.sqrt()).abs() < 1e-15);
        assert_eq!(von_mises(&[5.0, 0., 0., 0., 5.0, 0., 0., 0., 5.0]), 0.0);
    }
}
