//! Spoilt files: a few changes to a real one, of the kinds that people, exporters and scripts make, and worse.

/// Marsaglia's xorshift.
pub struct Random(u64);

impl Random {
    /// Of a seed and the number of a case: cases are independent of each other.
    pub fn new(seed: u64, case: u64) -> Self {
        let mixed = (seed ^ case.wrapping_mul(0x9E37_79B9_7F4A_7C15)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mut random = Random((mixed ^ mixed >> 31) | 1);
        for _ in 0..8 {
            random.below(2);
        }
        random
    }

    /// A number below n, which is not zero.
    pub fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n.max(1) as u64) as usize
    }

    /// True in so many of a hundred cases.
    pub fn percent(&mut self, n: usize) -> bool {
        self.below(100) < n
    }

    /// One of a list.
    pub fn one<'a, T: ?Sized>(&mut self, list: &[&'a T]) -> &'a T {
        list[self.below(list.len())]
    }
}

const NUMBERS: &[&str] = &[
    "0",
    "0.0",
    "-0.0",
    "-1",
    "1",
    "2",
    "1e300",
    "-1e300",
    "1e-300",
    "5e-324",
    "1e40",
    "1e-40",
    "1e-45",
    "3.5e38",
    "nan",
    "inf",
    "-inf",
    "+nan",
    "9223372036854775807",
    "-9223372036854775808",
    "99999999999999999999999999",
    "1e400",
    "0x10",
    "0b1",
    "1_000",
    "1e6",
    "1e9",
    "1e12",
    "1e20",
    "1e-12",
    "1e-17",
    "1e-20",
    "1e-30",
    "1.5707963267949",
    "1.5707963",
    "3.14159265359",
    "180",
    "0.1",
    "1e-6",
    "1e-9",
    "10000",
    "65536",
    "4294967296",
    "\"text\"",
    "true",
    "[]",
    "{}",
    "1979-05-27",
];

const WORDS: &[&str] = &[
    "",
    "box",
    "type",
    "fn",
    "match",
    "self",
    "Self",
    "super",
    "crate",
    "loop",
    "static",
    "move",
    "in",
    "g",
    "h",
    "q",
    "qd",
    "tau",
    "result",
    "ok",
    "cost",
    "true",
    "nan",
    "inf",
    "_",
    "__",
    "7dof",
    "(2R)",
    "a b",
    "a-b",
    "a.b",
    "a/b",
    "..",
    "é",
    "Δ",
    "名前",
    "\u{202e}abc",
    "\u{200b}",
    "a\\nb",
    "\u{0}",
    "\u{feff}x",
    "\u{1f916}",
    "world",
    "base",
    "root_joint",
    "gravity",
    "fixed",
    "revolute",
    "continuous",
    "prismatic",
    "floating",
    "planar",
    "spherical",
    "mimic",
    "stiff",
    "rigid",
    "main",
    "f64",
];

const JUNK: &[&str] = &[
    "\u{0}",
    "\u{202e}",
    "\u{2066}",
    "\u{feff}",
    "\r",
    "\"",
    "'",
    "\"\"\"",
    "<",
    ">",
    "<!--",
    "]]>",
    "&amp;",
    "&#0;",
    "&x;",
    "[",
    "]",
    "[[",
    "{",
    "}",
    "=",
    ",",
    ".",
    "#",
    "\\",
    "\\u0000",
    "\t",
    "\u{1}",
    "é",
    "\u{1f916}",
    "\n\n",
    "<![CDATA[",
    "<?xml?>",
    "/*",
    "*/",
    "//",
    "${x}",
    "`",
    "\u{2028}",
];

/// A file with one to four changes.
pub fn spoilt(text: &str, random: &mut Random) -> String {
    let mut text = text.to_string();
    let changes = [1, 1, 1, 1, 2, 2, 3, 4][random.below(8)];
    for _ in 0..changes {
        text = changed(&text, random);
    }
    text
}

fn changed(text: &str, random: &mut Random) -> String {
    let is_xml = text.trim_start().starts_with('<');
    match random.below(100) {
        0..=39 => number(text, random),
        40..=54 => word(text, random),
        55..=64 => lines(text, random),
        65..=79 if is_xml => element(text, random),
        65..=79 => table(text, random),
        80..=86 => tokens(text, random),
        87..=93 => junk(text, random),
        94..=95 => cut(text, random),
        96..=97 => nested(text, is_xml, random),
        _ => long(text, random),
    }
}

fn is_of_word(c: char) -> bool {
    c.is_alphanumeric() || "_.+-".contains(c)
}

/// The text in words and what is between them.
fn split(text: &str) -> Vec<&str> {
    let mut tokens = Vec::new();
    let mut rest = text;
    while let Some(first) = rest.chars().next() {
        let end = rest.find(|c| is_of_word(c) != is_of_word(first)).unwrap_or(rest.len());
        tokens.push(&rest[..end]);
        rest = &rest[end..];
    }
    tokens
}

/// Where a token is that `wanted` takes.
fn place(tokens: &[&str], random: &mut Random, wanted: impl Fn(&str) -> bool) -> Option<usize> {
    let places: Vec<usize> = (0..tokens.len()).filter(|i| wanted(tokens[*i])).collect();
    (!places.is_empty()).then(|| places[random.below(places.len())])
}

fn number(text: &str, random: &mut Random) -> String {
    let mut tokens = split(text);
    let is_number = |t: &str| t.parse::<f64>().is_ok() && t.bytes().any(|b| b.is_ascii_digit());
    let Some(at) = place(&tokens, random, is_number) else { return junk(text, random) };
    let old: f64 = tokens[at].parse().expect("it is a number");
    let new = match random.below(10) {
        0 => format!("{}", -old),
        1 => format!("{:?}", old * [1e3, 1e-3, 1e6, 1e-6, 1e20, 1e-20, 57.295_779_513_1][random.below(7)]),
        2 => format!("{:.*}", random.below(5), old),
        3 => format!("{:?}", old + [1e-9, 1e-12, 1e-15, 1e-18][random.below(4)]),
        _ => random.one(NUMBERS).to_string(),
    };
    tokens[at] = &new;
    tokens.concat()
}

fn word(text: &str, random: &mut Random) -> String {
    let mut tokens = split(text);
    let is_word = |t: &str| t.starts_with(|c: char| c.is_alphabetic() || c == '_');
    let (Some(at), Some(other)) = (place(&tokens, random, is_word), place(&tokens, random, is_word)) else {
        return junk(text, random);
    };
    let longer = format!("{}_", tokens[at]);
    let (old, new) = (
        tokens[at],
        match random.below(6) {
            0 | 1 => tokens[other],
            2 => longer.as_str(),
            _ => random.one(WORDS),
        },
    );
    // everywhere, so that names go on fitting each other, or here alone
    match random.percent(40) {
        true => tokens.iter_mut().filter(|t| **t == old).for_each(|t| *t = new),
        false => tokens[at] = new,
    }
    tokens.concat()
}

fn lines(text: &str, random: &mut Random) -> String {
    let mut lines: Vec<&str> = text.split_inclusive('\n').collect();
    if lines.is_empty() {
        return junk(text, random);
    }
    let (a, b) = (random.below(lines.len()), random.below(lines.len()));
    match random.below(4) {
        0 => lines.swap(a, b),
        1 => drop(lines.remove(a)),
        2 => lines.insert(a, lines[b]),
        _ => {
            let line = lines.remove(a);
            lines.insert(b.min(lines.len()), line);
        }
    }
    lines.concat()
}

fn tokens(text: &str, random: &mut Random) -> String {
    let mut tokens = split(text);
    if tokens.is_empty() {
        return junk(text, random);
    }
    let (a, b) = (random.below(tokens.len()), random.below(tokens.len()));
    match random.below(4) {
        0 => tokens.swap(a, b),
        1 => drop(tokens.remove(a)),
        2 => tokens.insert(a, tokens[b]),
        _ => tokens[a] = tokens[b],
    }
    tokens.concat()
}

/// An element of XML lost, doubled, or moved to another place, into another element or itself.
fn element(text: &str, random: &mut Random) -> String {
    let starts: Vec<usize> = text
        .match_indices('<')
        .map(|m| m.0)
        .filter(|i| text[i + 1..].starts_with(|c: char| c.is_alphabetic()))
        .collect();
    if starts.is_empty() {
        return junk(text, random);
    }
    let start = starts[random.below(starts.len())];
    let name: String = text[start + 1..].chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
    let Some(tag) = text[start..].find('>').map(|i| start + i + 1) else { return junk(text, random) };
    let closing = format!("</{name}>");
    let end = match text[..tag].ends_with("/>") {
        true => tag,
        false => text[tag..].find(&closing).map_or(tag, |i| tag + i + closing.len()),
    };
    let whole = &text[start..end];
    let (before, after) = (&text[..start], &text[end..]);
    let to = starts[random.below(starts.len())];
    match random.below(4) {
        0 => format!("{before}{after}"),
        1 => format!("{before}{whole}{whole}{after}"),
        2 => format!("{}{whole}{}", &text[..to], &text[to..]),
        _ => {
            let without = format!("{before}{after}");
            let to = without.match_indices('>').map(|m| m.0 + 1).nth(random.below(20)).unwrap_or(0);
            format!("{}{whole}{}", &without[..to], &without[to..])
        }
    }
}

/// A table of TOML, with its lines, lost, doubled, moved, renamed or made an array.
fn table(text: &str, random: &mut Random) -> String {
    let mut blocks: Vec<String> = vec![String::new()];
    for line in text.split_inclusive('\n') {
        if line.starts_with('[') {
            blocks.push(String::new());
        }
        blocks.last_mut().expect("there is a block").push_str(line);
    }
    let (a, b) = (random.below(blocks.len()), random.below(blocks.len()));
    match random.below(6) {
        0 => drop(blocks.remove(a)),
        1 => blocks.insert(b, blocks[a].clone()),
        2 => blocks.swap(a, b),
        3 => blocks[a] = blocks[a].replacen("[[", "[", 1).replacen("]]", "]", 1),
        4 => blocks[a] = blocks[a].replacen('[', "[[", 1).replacen(']', "]]", 1),
        // keys of one table in another
        _ => {
            let body = blocks[b].lines().filter(|l| !l.starts_with('[')).collect::<Vec<_>>().join("\n");
            blocks[a].push_str(&body);
            blocks[a].push('\n');
        }
    }
    blocks.concat()
}

fn junk(text: &str, random: &mut Random) -> String {
    let places: Vec<usize> = text.char_indices().map(|c| c.0).chain([text.len()]).collect();
    let at = places[random.below(places.len())];
    let (before, after) = text.split_at(at);
    let mut rest = after.chars();
    if random.percent(30) {
        rest.next();
    }
    format!("{before}{}{}", random.one(JUNK), rest.as_str())
}

fn cut(text: &str, random: &mut Random) -> String {
    let places: Vec<usize> = text.char_indices().map(|c| c.0).collect();
    match places.is_empty() {
        true => String::new(),
        false => text[..places[random.below(places.len())]].to_string(),
    }
}

fn nested(text: &str, is_xml: bool, random: &mut Random) -> String {
    let depth = [3, 30, 300, 3000, 30_000][random.below(5)];
    let wrap = |open: &str, close: &str| format!("{}{}", open.repeat(depth), close.repeat(depth));
    match (is_xml, random.below(3)) {
        (true, 0) => text.replacen("</robot>", &format!("{}</robot>", wrap("<link>", "</link>")), 1),
        (true, _) => format!("{}{text}", "<robot>".repeat(depth)),
        (false, 0) => format!("{text}\nx = {}\n", wrap("[", "]")),
        (false, 1) => format!("x = {}\n{text}", wrap("{a = ", "}")),
        (false, _) => format!("{text}\n[{}a]\n", wrap("a.", "")),
    }
}

/// A number or a word of very many characters, or a list of very many numbers.
fn long(text: &str, random: &mut Random) -> String {
    let mut tokens = split(text);
    if tokens.is_empty() {
        return junk(text, random);
    }
    let n = [100, 1000, 20_000][random.below(3)];
    let new = match random.below(4) {
        0 => "9".repeat(n),
        1 => format!("0.{}", "3".repeat(n)),
        2 => "a".repeat(n),
        _ => "1, ".repeat(n),
    };
    let at = random.below(tokens.len());
    tokens[at] = &new;
    tokens.concat()
}

/// A robot of very many links in a row, or all on one.
pub fn many_links(random: &mut Random) -> String {
    let n = [200, 1000, 10_000][random.below(3)];
    let in_a_row = random.percent(50);
    let mut text = String::from("<robot name=\"many\"><link name=\"l0\"/>\n");
    for i in 1..=n {
        let parent = if in_a_row { i - 1 } else { 0 };
        let kind = ["revolute", "fixed", "prismatic", "continuous"][random.below(4)];
        text += &format!(
            "<link name=\"l{i}\"><inertial><mass value=\"1\"/><inertia ixx=\"1\" iyy=\"1\" izz=\"1\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\
             <joint name=\"j{i}\" type=\"{kind}\"><parent link=\"l{parent}\"/><child link=\"l{i}\"/><limit effort=\"1\" velocity=\"1\"/></joint>\n"
        );
    }
    text + "</robot>"
}
