//! Wording that every table of messages shares: near misses, lists, short forms.

/// `did you mean …?`, if there are candidates close to `word`.
pub fn did_you_mean<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<String> {
    let nearest: Vec<String> = nearest(word, candidates).iter().map(|c| format!("`{}`", cut(c))).collect();
    (!nearest.is_empty()).then(|| format!("did you mean {}?", one_of(&nearest)))
}

/// As in "a, b or c".
pub fn one_of(words: &[impl AsRef<str>]) -> String {
    let words: Vec<&str> = words.iter().map(AsRef::as_ref).collect();
    match words.split_last() {
        Some((last, others)) if !others.is_empty() => format!("{} or {last}", others.join(", ")),
        _ => words.concat(),
    }
}

/// The candidate next to `word`, if it is close.
pub fn closest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    nearest(word, candidates).first().copied()
}

/// The candidates that the fewest slips of the pen make of `word`, three at most: a slip for every three letters
/// is close.
pub fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Vec<&'a str> {
    let length = |word: &str| word.chars().count();
    if length(word) > 64 {
        return Vec::new();
    }
    let word = word.to_lowercase();
    let slips = |c: &str| strsim::damerau_levenshtein(&word, &c.to_lowercase());
    let candidates = candidates.into_iter().filter(|c| length(c) <= 64).take(1000);
    let close: Vec<(usize, &str)> =
        candidates.map(|c| (slips(c), c)).filter(|(d, c)| *d <= (length(c) / 3).max(1)).collect();
    let Some(least) = close.iter().map(|(d, _)| *d).min() else { return Vec::new() };
    let mut nearest: Vec<&str> = Vec::new();
    for (_, c) in close.iter().filter(|(d, _)| *d == least) {
        if nearest.len() < 3 && !nearest.contains(c) {
            nearest.push(c);
        }
    }
    nearest
}

/// A text of the file, cut where it is long.
pub fn cut(text: &str) -> String {
    if text.chars().count() <= 60 {
        text.to_string()
    } else {
        text.chars().take(57).chain("...".chars()).collect()
    }
}

/// A number with at most six digits.
pub fn six_digits(x: f64) -> String {
    format!("{:?}", super::six_digits(x))
}

/// `a, b and c`, each in backquotes.
pub fn list(words: &[&str]) -> String {
    let quoted: Vec<String> = words.iter().take(12).map(|w| format!("`{}`", cut(w))).collect();
    let more = words.len().saturating_sub(12);
    match (quoted.split_last(), more) {
        (None, _) => String::new(),
        (Some(_), 1..) => format!("{} and {more} more", quoted.join(", ")),
        (Some((last, [])), 0) => last.clone(),
        (Some((last, rest)), 0) => format!("{} and {last}", rest.join(", ")),
    }
}
