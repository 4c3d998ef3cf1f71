//! "Did you mean": the nearest of a list of names.

/// The candidate nearest to a mistyped word, if one is near enough to be meant.
///
/// Nearness is the optimal string alignment distance (insertions, deletions, replacements, swaps of
/// neighbours), not counting the case of letters; up to a third of the word may be wrong.
pub(crate) fn closest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // Words of this length are not typing mistakes of a name; the distance is quadratic in the length.
    const LONGEST: usize = 64;
    if word.len() > LONGEST {
        return None;
    }
    let lower = word.to_lowercase();
    let word: Vec<char> = lower.chars().collect();
    let candidates: Vec<&str> = candidates.into_iter().collect();
    let near = candidates
        .iter()
        .map(|candidate| (distance(&word, &candidate.to_lowercase().chars().collect::<Vec<_>>()), *candidate))
        .filter(|(distance, candidate)| {
            let length = word.len().max(candidate.chars().count());
            // Something must be right: of one-letter names none suggests another.
            *distance <= length.div_ceil(3) && *distance < length
        })
        .min_by_key(|(distance, _)| *distance)
        .map(|(_, candidate)| candidate);
    // Or the beginning of a name: `cubic` for `cubic_spline`.
    near.or_else(|| candidates.into_iter().find(|candidate| word.len() > 2 && candidate.starts_with(&lower)))
}

fn distance(a: &[char], b: &[char]) -> usize {
    let mut before_last: Vec<usize> = Vec::new();
    let mut last: Vec<usize> = (0..=b.len()).collect();
    for i in 0..a.len() {
        let mut row = Vec::with_capacity(b.len() + 1);
        row.push(i + 1);
        for j in 0..b.len() {
            let mut best = (last[j] + usize::from(a[i] != b[j])).min(last[j + 1] + 1).min(row[j] + 1);
            if i > 0 && j > 0 && a[i] == b[j - 1] && a[i - 1] == b[j] {
                best = best.min(before_last[j - 1] + 1);
            }
            row.push(best);
        }
        before_last = std::mem::replace(&mut last, row);
    }
    last[b.len()]
}

#[cfg(test)]
mod tests {
    use super::closest;

    #[test]
    fn a_typing_mistake_finds_its_word_and_a_stranger_does_not() {
        let names = ["spacing", "smoothing", "weights"];
        assert_eq!(closest("spcing", names), Some("spacing"));
        assert_eq!(closest("smoohting", names), Some("smoothing"));
        assert_eq!(closest("WEIGHTS", names), Some("weights"));
        assert_eq!(closest("velocity", names), None);
        assert_eq!(closest("c", ["a", "b"]), None);
        assert_eq!(closest("cubic", ["wendland_c2", "cubic_spline"]), Some("cubic_spline"));
        assert_eq!(closest(&"s".repeat(10_000), names), None);
    }
}
