//! "Did you mean": the known name that is most similar to an unknown one.

/// The known name that is most similar to one that does not exist; `None` where no name is similar.
///
/// Similarity is 1 less the edit distance over the length of the longer name (optimal string alignment), without regard to capitals.
///
/// ```
/// assert_eq!(youla::error::nearest_name("hroizon", ["past", "horizon"]), Some("horizon"));
/// ```
pub fn nearest_name<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    // At least half of the letters agree, in their order: chosen, not measured.
    const LEAST: f64 = 0.5;
    let ranked = known.into_iter().map(|candidate| (similarity(candidate, name), candidate));
    ranked.filter(|(s, _)| *s >= LEAST).max_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, nearest)| nearest)
}

/// The word that a parser did not know and the known one that is most similar to it, from the message of serde: "unknown field `x`,
/// expected one of `y`, `z`".
pub fn misspelt(message: &str) -> Option<(&str, Option<&str>)> {
    let words = message.strip_prefix("unknown field ").or_else(|| message.strip_prefix("unknown variant "))?;
    let mut words = words.split('`').skip(1).step_by(2);
    let unknown = words.next()?;
    Some((unknown, nearest_name(unknown, words)))
}

/// 1 less the edit distance over the length of the longer name, without regard to capitals; insertions, deletions,
/// substitutions and exchanges of neighbours cost one each (optimal string alignment).
fn similarity(one: &str, other: &str) -> f64 {
    // Names that differ this much in length are not compared, which would take time and memory by their product.
    if one.len() > 2 * other.len() || other.len() > 2 * one.len() {
        return 0.0;
    }
    let [one, other] = [one, other].map(|name| name.to_lowercase().chars().collect::<Vec<_>>());
    let mut before = vec![0; other.len() + 1];
    let mut last: Vec<usize> = (0..=other.len()).collect();
    for i in 1..=one.len() {
        let mut row = vec![i; other.len() + 1];
        for j in 1..=other.len() {
            let substituted = last[j - 1] + usize::from(one[i - 1] != other[j - 1]);
            row[j] = substituted.min(last[j] + 1).min(row[j - 1] + 1);
            if i > 1 && j > 1 && one[i - 1] == other[j - 2] && one[i - 2] == other[j - 1] {
                row[j] = row[j].min(before[j - 2] + 1);
            }
        }
        (before, last) = (last, row);
    }
    1.0 - last[other.len()] as f64 / one.len().max(other.len()).max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_nearest_name_is_found() {
        for (one, other, edits, length) in
            [("alpha", "Alpha", 0, 5), ("apha", "alpha", 1, 5), ("ahlpa", "alpha", 2, 5), ("hroizon", "horizon", 1, 7)]
        {
            assert_eq!(similarity(one, other), 1.0 - f64::from(edits) / f64::from(length), "{one} {other}");
        }
        let message = "unknown field `intial`, expected one of `initial`, `unit`, `min`";
        assert_eq!(misspelt(message), Some(("intial", Some("initial"))));
        assert_eq!(misspelt("unknown variant `zzz`, expected `a` or `b`"), Some(("zzz", None)));
        assert_eq!(misspelt("missing field `a`"), None);
    }
}
