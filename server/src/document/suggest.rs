//! The nearest known word to one that was mistyped.

/// The known word that is at most two edits (a third of its length for short words) away; the first of the nearest.
pub(super) fn nearest<'k>(word: &str, known: &[&'k str]) -> Option<&'k str> {
    let word = word.to_lowercase().replace('-', "_");
    let distances = known
        .iter()
        .map(|candidate| (edits(&word, candidate), *candidate));
    let (distance, best) = distances.min_by_key(|(distance, _)| *distance)?;
    let longest_allowed = (best.chars().count() / 3).clamp(1, 3);
    (distance <= longest_allowed).then_some(best)
}

/// Edit distance (Levenshtein 1966): insertions, deletions, replacements.
fn edits(a: &str, b: &str) -> usize {
    let b: Vec<char> = b.chars().collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, letter) in a.chars().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for j in 0..b.len() {
            let replaced = diagonal + usize::from(letter != b[j]);
            diagonal = row[j + 1];
            row[j + 1] = replaced.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::nearest;

    #[test]
    fn suggests_only_what_is_near() {
        let known = [
            "name",
            "rate_hz",
            "gravity",
            "grasp_angle_deg",
            "floor_height",
        ];
        for (word, answer) in [
            ("rate-hz", Some("rate_hz")),
            ("Rate_hz", Some("rate_hz")),
            ("grasp_angel_deg", Some("grasp_angle_deg")),
            ("nane", Some("name")),
            ("colour", None),
            ("", None),
        ] {
            assert_eq!(nearest(word, &known), answer, "{word}");
        }
    }
}
