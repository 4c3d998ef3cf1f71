//! Order of elimination: nested dissection from positions.
//!
//! A set of particles is cut at the median of its longest extent; those of one half that have neighbours in
//! the other half separate the two and are eliminated last. George (1973), "Nested dissection of a regular
//! finite element mesh".

use super::constraints::Constraints;

/// Sets this small are not cut.
const LEAF: usize = 32;

/// The particles of a band in the order of elimination.
pub(super) fn nested_dissection<const D: usize>(constraints: &Constraints<'_, D>, band: &[usize]) -> Vec<usize> {
    let mut order = Vec::with_capacity(band.len());
    let mut part = vec![0_u32; constraints.count()];
    let mut label = 0;
    // Sets still to be ordered, in reverse: what is written last is eliminated first.
    let mut sets = vec![band.to_vec()];
    while let Some(mut set) = sets.pop() {
        if set.len() <= LEAF {
            order.extend(set.into_iter().rev());
            continue;
        }
        let axis = longest_axis(constraints, &set);
        let place = |a: &usize| constraints.position(*a)[axis];
        // Ties are broken by number, so that the order is that of the particles alone.
        set.sort_unstable_by(|a, b| place(a).total_cmp(&place(b)).then(a.cmp(b)));
        let right = set.split_off(set.len() / 2);
        label += 1;
        right.iter().for_each(|&a| part[a] = label);
        let (separator, left): (Vec<usize>, Vec<usize>) =
            set.into_iter().partition(|&a| constraints.row(a).any(|entry| part[constraints.neighbour(entry)] == label));
        order.extend(separator.into_iter().rev());
        sets.push(left);
        sets.push(right);
    }
    order.reverse();
    order
}

fn longest_axis<const D: usize>(constraints: &Constraints<'_, D>, set: &[usize]) -> usize {
    let mut lower = constraints.position(set[0]);
    let mut upper = lower;
    for &a in set {
        lower = lower.inf(&constraints.position(a));
        upper = upper.sup(&constraints.position(a));
    }
    (upper - lower).imax()
}
