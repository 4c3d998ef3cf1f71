//! The files that a scene names.

use super::document::{Document, ShapeText, Spanned};

/// Files of all bodies, as they are named, each once.
pub(super) fn files(document: &Document) -> Vec<String> {
    let mut found = Vec::new();
    for body in document.body.iter().map(Spanned::get_ref) {
        if let Some(shape) = &body.shape {
            of_shape(shape.get_ref(), &mut found);
        }
        found.extend(body.mesh.iter().map(|mesh| mesh.get_ref().file.get_ref().clone()));
        for points in body.points.iter().map(Spanned::get_ref) {
            found.push(points.file.get_ref().clone());
            found.extend(points.faces.iter().map(|faces| faces.get_ref().clone()));
        }
    }
    found.sort();
    found.dedup();
    found
}

fn of_shape(shape: &ShapeText, found: &mut Vec<String>) {
    match shape {
        ShapeText::Stl(stl) => found.push(stl.file.get_ref().clone()),
        ShapeText::Union(parts) | ShapeText::Intersection(parts) | ShapeText::Difference(parts) => {
            parts.iter().for_each(|part| of_shape(part.get_ref(), found));
        }
        _ => {}
    }
}
