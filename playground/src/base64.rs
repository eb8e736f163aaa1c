//! Numbers and bytes as text, by the alphabet that browsers read (RFC 4648, section 4).

const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";

/// Bytes as text.
pub fn encoded(bytes: &[u8]) -> String {
    let mut out = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let word = (0..3).fold(0u32, |word, k| word << 8 | u32::from(*chunk.get(k).unwrap_or(&0)));
        for k in 0..4 {
            let is_filled = k <= chunk.len();
            out.push(if is_filled { ALPHABET[(word >> (18 - 6 * k) & 63) as usize] as char } else { '=' });
        }
    }
    out
}

/// Bytes of a text; none of a text that is not of this form.
pub fn decoded(text: &str) -> Option<Vec<u8>> {
    let text = text.trim_end_matches('=').as_bytes();
    let mut out = Vec::with_capacity(text.len() * 3 / 4);
    for chunk in text.chunks(4) {
        let mut word = 0u32;
        for k in 0..4 {
            let digit = match chunk.get(k) {
                Some(c) => ALPHABET.iter().position(|a| a == c)? as u32,
                None => 0,
            };
            word = word << 6 | digit;
        }
        out.extend(&word.to_be_bytes()[1..chunk.len()]);
    }
    Some(out)
}

/// Numbers as little-endian f64.
pub fn of_numbers<'a>(numbers: impl IntoIterator<Item = &'a f64>) -> String {
    encoded(&numbers.into_iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>())
}

/// The numbers of such a text.
pub fn numbers(text: &str) -> Option<Vec<f64>> {
    let bytes = decoded(text)?;
    let of = |chunk: &[u8]| chunk.try_into().ok().map(f64::from_le_bytes);
    bytes.chunks(8).map(of).collect()
}
