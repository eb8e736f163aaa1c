//! Whatever bytes are given: a model or at least one error, no panic, in reasonable time.
//!
//! Real files are cut, overwritten and shuffled, and junk of several kinds is made. The generator is seeded; the seed of a
//! failure is printed.

use std::time::{Duration, Instant};
use straightline_codegen::diagnostic::Source;
use straightline_codegen::model::{load, ModelOptions};
use straightline_core::model::Model;
use straightline_core::Dd;

/// A small file is read in milliseconds, one of 10 MB in seconds (parsers without optimisation): what grows with the
/// square of the size takes hours. The margin is for machines under load.
const SMALL: Duration = Duration::from_secs(10);
const LARGE: Duration = Duration::from_secs(200);

/// Files to spoil.
const FILES: &[(&str, &str)] = &[
    ("arm.urdf", include_str!("../files/awkward.urdf")),
    ("arm.toml", include_str!("../files/arm.toml")),
    ("chain.toml", include_str!("../files/chain.toml")),
    ("arm.sdf", include_str!("../files/arm.sdf")),
    ("dh.toml", include_str!("../files/dh.toml")),
];

/// Marsaglia's xorshift.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n.max(1) as u64) as usize
    }
}

fn check(path: &str, bytes: Vec<u8>, limit: Duration, what: &str) {
    let start = Instant::now();
    let source = Source::from_bytes(path, bytes);
    let bases: &[bool] = if limit == SMALL { &[false, true] } else { &[false] };
    for &floating_base in bases {
        let options = ModelOptions { floating_base, ..ModelOptions::default() };
        let (model, diagnostics) = load(&source, &options);
        assert_eq!(model.is_none(), diagnostics.has_errors(), "{what}: {diagnostics}");
        let _ = (diagnostics.render(), diagnostics.lines());
    }
    assert!(start.elapsed() < limit, "{what}: {:?}", start.elapsed());
}

/// A text with one to four of its tokens moved, doubled, left out, or in their place odd ones.
pub(crate) fn spoilt(text: &str, odd: &[&str], seed: u64) -> String {
    let mut random = Random(seed);
    let mut tokens: Vec<&str> = text.split_inclusive(|c: char| !c.is_alphanumeric()).collect();
    for _ in 0..=random.below(3) {
        let (a, b) = (random.below(tokens.len()), random.below(tokens.len()));
        match random.below(4) {
            0 => tokens.swap(a, b),
            1 => tokens[a] = odd[random.below(odd.len())],
            2 => tokens.insert(a, tokens[b]),
            _ => drop(tokens.remove(a)),
        }
    }
    tokens.concat()
}

/// So many spoilt texts, the first of them of the seed after `first`: none panics, and none takes long.
pub(crate) fn read_spoilt(path: &str, text: &str, odd: &[&str], first: u64, count: u64) {
    for seed in first + 1..=first + count {
        let (start, source) = (Instant::now(), Source::new(path, spoilt(text, odd, seed)));
        let (model, diagnostics) = load(&source, &ModelOptions::default());
        assert_eq!(model.is_none(), diagnostics.has_errors(), "seed {seed}: {diagnostics}");
        let _ = diagnostics.render();
        assert!(start.elapsed() < SMALL, "seed {seed}: {:?}", start.elapsed());
    }
}

/// Whatever one number of a text becomes, a robot of it is another one, or something is said. Numbers stand behind one of `opening`; those behind one
/// of `meaningless` may be anything. How many there are.
pub(crate) fn no_number_is_read_without_meaning(
    path: &str,
    text: &str,
    opening: &[char],
    meaningless: &[&str],
) -> usize {
    let printed = |text: &str| {
        let (model, diagnostics) = load(&Source::new(path, text), &ModelOptions::default());
        let robot = |m: Model<Dd>| format!("{:?} {:?} {:?} {:?}", m.bodies, m.frames, m.gravity, m.couplings);
        (model.map(robot), diagnostics.is_empty())
    };
    let (plain, _) = printed(text);
    let (mut at, mut changed) = (0, 0);
    while let Some(found) = text[at..].find(|c: char| c.is_ascii_digit()) {
        let start = at + found;
        let end = start + text[start..].find(|c: char| !c.is_ascii_digit()).expect("the text ends otherwise");
        at = end;
        // what stands in a name of an element or attribute is no number, and an exponent none by itself
        let before = &text[..start];
        let is_number = before.ends_with(opening) && !before.ends_with("e-");
        let is_meant = meaningless.iter().all(|word| !before.ends_with(word));
        if !is_number || !is_meant || text[end..].starts_with('e') {
            continue;
        }
        let (other, is_silent) = printed(&format!("{before}7{}", &text[end..]));
        assert!(other != plain || !is_silent, "nothing follows from 7 in {}", &text[start.saturating_sub(60)..end]);
        changed += 1;
    }
    changed
}

#[test]
fn the_files_themselves_load() {
    for (path, text) in FILES {
        let (model, diagnostics) = load(&Source::new(path, *text), &ModelOptions::default());
        assert!(model.is_some(), "{diagnostics}");
    }
}

#[test]
fn truncated_files() {
    for (path, text) in FILES {
        for end in (0..text.len()).step_by(7) {
            check(path, text.as_bytes()[..end].to_vec(), SMALL, &format!("{path} cut at {end}"));
        }
    }
}

#[test]
fn overwritten_bytes() {
    for (path, text) in FILES {
        for seed in 1..400 {
            let mut random = Random(seed * 0x9E37_79B9);
            let mut bytes = text.as_bytes().to_vec();
            for _ in 0..=random.below(4) {
                let at = random.below(bytes.len());
                bytes[at] = match random.below(3) {
                    0 => random.below(256) as u8,
                    1 => b"<>=\"'[]{}.,-+0123456789eE#&;\n "[random.below(30)],
                    _ => bytes[random.below(text.len())],
                };
            }
            check(path, bytes, SMALL, &format!("{path} overwritten, seed {seed}"));
        }
    }
}

#[test]
fn swapped_lost_and_doubled_tokens() {
    for (path, text) in FILES {
        let mut tokens: Vec<&str> = Vec::new();
        let mut rest = *text;
        while let Some(first) = rest.chars().next() {
            let is_word = |c: char| c.is_alphanumeric() || "_.+-".contains(c);
            let end = rest.find(|c| is_word(c) != is_word(first)).unwrap_or(rest.len());
            tokens.push(&rest[..end]);
            rest = &rest[end..];
        }
        let odd =
            ["nan", "-1", "0", "1e308", "1e-308", "inf", "\"", "base", "fixed", "revolute", "", "${x}", "0x7f", "é"];
        for seed in 1..400 {
            let mut random = Random(seed * 0x9E37_79B9);
            let mut tokens = tokens.clone();
            for _ in 0..=random.below(3) {
                let (a, b) = (random.below(tokens.len()), random.below(tokens.len()));
                match random.below(4) {
                    0 => tokens.swap(a, b),
                    1 => tokens[a] = odd[random.below(odd.len())],
                    2 => tokens.insert(a, tokens[b]),
                    _ => tokens[a] = tokens[b],
                }
            }
            check(path, tokens.concat().into_bytes(), SMALL, &format!("{path} with tokens moved, seed {seed}"));
        }
    }
}

#[test]
fn lines_lost_doubled_and_swapped() {
    for (path, text) in FILES {
        let lines: Vec<&str> = text.split_inclusive('\n').collect();
        for seed in 1..300 {
            let mut random = Random(seed * 0x9E37_79B9);
            let mut lines = lines.clone();
            for _ in 0..=random.below(3) {
                let (a, b) = (random.below(lines.len()), random.below(lines.len()));
                match random.below(3) {
                    0 => lines.swap(a, b),
                    1 => drop(lines.remove(a)),
                    _ => lines.insert(a, lines[b]),
                }
            }
            check(path, lines.concat().into_bytes(), SMALL, &format!("{path} with lines moved, seed {seed}"));
        }
    }
}

#[test]
fn deep_nesting() {
    let depth = 200_000;
    let wrap = |open: &str, close: &str| format!("{}{}", open.repeat(depth), close.repeat(depth));
    let bad: Vec<(&str, String)> = vec![
        ("a.urdf", format!("<robot name=\"r\">{}</robot>", wrap("<a>", "</a>"))),
        ("b.urdf", wrap("<link>", "")),
        ("c.urdf", wrap("<robot name=\"r\">", "</robot>")),
        ("d.toml", format!("x = {}", wrap("[", "]"))),
        ("e.toml", format!("x = {}", wrap("{a = ", "}"))),
        ("f.toml", format!("{}a = 1", wrap("a.", ""))),
        ("g.toml", format!("[{}a]", wrap("a.", ""))),
        ("h.toml", format!("x = [{{ {}a = 1 }}]", wrap("a.", ""))),
        ("i.toml", wrap("[a]\n[[a.b]]\n", "")),
        ("j.toml", format!("{}\"a\" = 1", wrap("\"a\" . ", ""))),
        ("k.toml", format!("{}'a' = 1", wrap("'#'.\"'\" . ", ""))),
        ("m.sdf", format!("<sdf version=\"1.9\">{}</sdf>", wrap("<model name=\"m\">", "</model>"))),
        ("l.urdf", format!("<robot name=\"r\">{}", wrap("<a xmlns:x=\"y\">", ""))),
    ];
    for (path, text) in bad {
        check(path, text.into_bytes(), LARGE, path);
    }
}

#[test]
fn ten_megabytes_of_junk() {
    let size = 10 << 20;
    let mut random = Random(2026);
    let bytes: Vec<u8> = (0..size).map(|_| random.below(256) as u8).collect();
    let ascii: Vec<u8> = (0..size).map(|_| 32 + random.below(95) as u8).collect();
    let of = |alphabet: &[u8], random: &mut Random| -> Vec<u8> {
        (0..size).map(|_| alphabet[random.below(alphabet.len())]).collect()
    };
    let xml = of(b"<>/=\"' ab", &mut random);
    let toml = of(b"[]{}=.\"',\n a1", &mut random);
    for (name, junk) in [("bytes", bytes), ("ascii", ascii), ("xml", xml), ("toml", toml)] {
        for path in ["junk.urdf", "junk.toml"] {
            check(path, junk.clone(), LARGE, &format!("{name} as {path}"));
        }
        let mut in_robot = b"<robot name=\"r\">".to_vec();
        in_robot.extend(&junk);
        check("junk.urdf", in_robot, LARGE, &format!("{name} in a robot"));
    }
}

#[test]
#[ignore = "slow proof: reads files of megabytes"]
fn slow_proof_of_megabytes_of_one_thing() {
    let fill = |part: &str| part.repeat((2 << 20) / part.len());
    for (path, text) in [
        ("zeros.urdf", fill("\0")),
        ("open.urdf", fill("<")),
        ("tags.urdf", fill("<a ")),
        ("quotes.urdf", fill("<a b=\"")),
        ("comments.urdf", fill("<!--")),
        ("attributes.urdf", format!("<robot {}/>", (0..150_000).map(|i| format!("a{i}=\"\" ")).collect::<String>())),
        ("xmlns.urdf", (0..60_000).map(|i| format!("<a xmlns:n{i}=\"u{i}\">")).collect()),
        ("entities.urdf", format!("<robot name=\"{}\"/>", fill("&amp;"))),
        ("line.urdf", format!("<robot name=\"r\">{}</robot>", fill("<link name=\"l\"/>"))),
        ("names.urdf", format!("<robot name=\"r\">{}</robot>", fill("<link name=\"\"/>"))),
        ("joints.urdf", format!("<robot name=\"r\"><link name=\"l\"/>{}</robot>", fill("<joint name=\"j\"/>"))),
        (
            "prefixes.urdf",
            format!("<robot name=\"r\">{}</robot>", (0..80_000).map(|i| format!("<p{i}:a/>")).collect::<String>()),
        ),
        (
            "number.urdf",
            format!(
                "<robot name=\"r\"><link name=\"l\"><inertial><mass value=\"{}\"/></inertial></link></robot>",
                fill("9")
            ),
        ),
        (
            "triple.urdf",
            format!(
                "<robot name=\"r\"><link name=\"l\"><inertial><origin xyz=\"{}\"/></inertial></link></robot>",
                fill("1 ")
            ),
        ),
        ("links.toml", format!("[robot]\nname = \"r\"\n{}", fill("[[link]]\n"))),
        ("keys.toml", (0..150_000).map(|i| format!("key{i} = 1\n")).collect()),
        ("equals.toml", fill("a = 1\n")),
        ("brackets.toml", fill("[")),
        ("array.toml", format!("link = [{}]", fill("1, "))),
        ("strings.toml", fill("\"")),
        ("dots.toml", fill(".")),
        ("utf8.toml", fill("é")),
    ] {
        check(path, text.into_bytes(), LARGE, path);
    }
}

#[test]
fn long_chains_and_wide_trees() {
    let links = |n: usize| (0..n).map(|i| format!("<link name=\"l{i}\"/>")).collect::<String>();
    let joint = |i: usize, parent: usize| {
        format!("<joint name=\"j{i}\" type=\"fixed\"><parent link=\"l{parent}\"/><child link=\"l{i}\"/></joint>")
    };
    let robot = |n: usize, parent: &dyn Fn(usize) -> usize| {
        let joints: String = (1..n).map(|i| joint(i, parent(i))).collect();
        format!("<robot name=\"r\">{}{joints}</robot>", links(n))
    };
    check("chain.urdf", robot(9_999, &|i| i - 1).into_bytes(), LARGE, "chain");
    check("star.urdf", robot(9_999, &|_| 0).into_bytes(), LARGE, "star");
    check("ring.urdf", robot(9_999, &|i| (i + 1) % 9_999).into_bytes(), LARGE, "ring");
    check("many.urdf", robot(60_000, &|i| i - 1).into_bytes(), LARGE, "too many");
}
