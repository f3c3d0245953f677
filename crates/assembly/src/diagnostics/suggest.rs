//! Suggestions for misspelt names, and the shortening of names in messages.

/// Returns a name that is short enough for a message: at most 40 characters, the last of which is
/// an ellipsis if the name is longer.
pub fn shorten(text: &str) -> String {
    if text.chars().count() <= 40 {
        text.to_owned()
    } else {
        text.chars().take(39).chain(['…']).collect()
    }
}

/// The largest number of candidates that are compared with a word, as damaged files may have many.
const MAX_CANDIDATES: usize = 1000;

/// Returns the candidate that differs from `word` by the fewest edits (insertions, deletions,
/// replacements and swaps of neighbours). There may be as many edits as a third of the word's
/// length, or one if that is more; `None` if all candidates need more edits. The case of letters
/// does not matter.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let lower =
        |word: &str| -> String { word.chars().take(64).flat_map(char::to_lowercase).collect() };
    let word = lower(word);
    let allowed = (word.chars().count() / 3).max(1);
    let candidates = candidates.into_iter().take(MAX_CANDIDATES);
    let distances = candidates.map(|c| (strsim::osa_distance(&word, &lower(c)), c));
    let near = distances.filter(|(d, _)| *d <= allowed);
    near.min_by_key(|(d, _)| *d).map(|(_, c)| c)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finds_slips_and_leaves_strangers_alone() {
        let names = [
            "Shape",
            "Scale",
            "Sampler",
            "AttributeBegin",
            "AttributeEnd",
        ];
        assert_eq!(nearest("Shpae", names), Some("Shape"));
        assert_eq!(nearest("shape", names), Some("Shape"));
        assert_eq!(nearest("AtributeBegin", names), Some("AttributeBegin"));
        assert_eq!(nearest("Bananas", names), None);
        assert_eq!(nearest("", names), None);
    }
}
