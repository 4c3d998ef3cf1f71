//! Small checks that many keys share. Each notes a mistake and gives `None`.

use nalgebra::SVector;

use super::document::{Field, FieldList, Scalar, Spanned};
use super::findings::{Findings, Span};
use super::units::{Dimension, Kind};
use crate::expression::{Expression, ExpressionError};

/// Names of the coordinates.
pub(super) const COORDINATES: [&str; 3] = ["X", "Y", "Z"];

impl Findings<'_> {
    /// A positive number.
    pub(super) fn positive(&mut self, number: &Spanned<impl Scalar>, name: &str) -> Option<f64> {
        self.within(number, name, "positive", |value| value > 0.0)
    }

    /// A number that is not negative.
    pub(super) fn not_negative(&mut self, number: &Spanned<impl Scalar>, name: &str) -> Option<f64> {
        self.within(number, name, "zero or positive", |value| value >= 0.0)
    }

    /// A finite number with a property that has a name.
    pub(super) fn within(
        &mut self,
        number: &Spanned<impl Scalar>,
        name: &str,
        wanted: &str,
        holds: impl Fn(f64) -> bool,
    ) -> Option<f64> {
        let value = number.get_ref().value();
        if value.is_finite() && holds(value) {
            return Some(value);
        }
        self.error(
            number.span(),
            format!("`{name}` is {value}{}, but must be {wanted}", number.get_ref().unit()),
            format!("give a number that is {wanted}"),
        );
        None
    }

    /// A whole number of at least 1.
    pub(super) fn at_least_one(&mut self, number: &Spanned<u64>, name: &str) -> Option<usize> {
        match usize::try_from(*number.get_ref()) {
            Ok(value) if value > 0 => Some(value),
            _ => {
                self.error(
                    number.span(),
                    format!("`{name}` is {}", number.get_ref()),
                    "give a whole number of at least 1",
                );
                None
            }
        }
    }

    /// As many finite numbers as there are dimensions.
    pub(super) fn vector<const D: usize>(
        &mut self,
        vector: &Spanned<Vec<Spanned<impl Scalar>>>,
        name: &str,
    ) -> Option<SVector<f64, D>> {
        self.length::<D>(vector.get_ref().len(), vector.span(), name)?;
        let before = self.count();
        for number in vector.get_ref() {
            self.within(number, name, "finite", |_| true);
        }
        (self.count() == before).then(|| SVector::from_fn(|axis, _| vector.get_ref()[axis].get_ref().value()))
    }

    /// As many fields as there are dimensions.
    pub(super) fn fields<const D: usize>(
        &mut self,
        list: &FieldList<impl Kind>,
        name: &str,
    ) -> Option<[Expression; D]> {
        self.length::<D>(list.get_ref().len(), list.span(), name)?;
        let fields: Vec<Expression> = list.get_ref().iter().filter_map(|field| self.field::<D>(field)).collect();
        fields.try_into().ok()
    }

    fn length<const D: usize>(&mut self, found: usize, span: Span, name: &str) -> Option<()> {
        if found == D {
            return Some(());
        }
        self.error(
            span,
            format!("`{name}` has {found} component(s) in a {D}-dimensional scene"),
            format!("give {D} component(s), one per direction"),
        );
        None
    }

    /// A number or an expression without coordinates that do not exist.
    pub(super) fn field<const D: usize>(&mut self, field: &Spanned<Field<impl Kind>>) -> Option<Expression> {
        match field.get_ref() {
            Field::Number(number) => {
                let value = number.value();
                if value.is_finite() {
                    return Some(Expression::constant(value));
                }
                self.error(field.span(), format!("{value} is not a finite number"), "give a finite number");
                None
            }
            Field::Text(text) => self.expression::<D>(text, field.get_ref().dimension(), field.span()),
        }
    }

    /// An expression without coordinates that do not exist, in the units of the scene; `dimension` is what it
    /// measures.
    pub(super) fn expression<const D: usize>(
        &mut self,
        text: &str,
        dimension: Dimension,
        span: Span,
    ) -> Option<Expression> {
        let expression = match Expression::parse(text) {
            Ok(expression) => expression,
            Err(error) => {
                let inside = self.inside(&span, text, &error);
                self.error(inside, error.message, error.remedy);
                return None;
            }
        };
        if let Some(axis) = (D..3).find(|axis| expression.depends_on_coordinate(*axis)) {
            let message = format!("`{}` does not exist in a {D}-dimensional scene", COORDINATES[axis]);
            self.error(span, message, format!("use {}", COORDINATES[..D].join(", ")));
            return None;
        }
        let units = self.units;
        Some(expression.in_units(units.length(), units.time(), units.in_si(1.0, dimension)))
    }

    /// Place of a mistake inside the text of an expression, if that text stands in the scene as it is.
    fn inside(&self, span: &Span, text: &str, error: &ExpressionError) -> Span {
        let quoted = self.source.slice(span).unwrap_or_default();
        let quotes = ["\"", "'", ""].into_iter().find(|quote| quoted == format!("{quote}{text}{quote}"));
        match quotes {
            Some(quote) => {
                let start = span.start + quote.len() + error.span.start;
                start..start + error.span.len()
            }
            None => span.clone(),
        }
    }
}

/// A position as expressions want it.
pub(super) fn padded<const D: usize>(position: &SVector<f64, D>) -> [f64; 3] {
    std::array::from_fn(|axis| if axis < D { position[axis] } else { 0.0 })
}

/// `(X = 1, Y = 2)`.
pub(super) fn place<const D: usize>(position: &SVector<f64, D>) -> String {
    let parts: Vec<String> = (0..D).map(|axis| format!("{} = {}", COORDINATES[axis], position[axis])).collect();
    format!("({})", parts.join(", "))
}
