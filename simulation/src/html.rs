//! Pages for the browser: complete in one file, no script, no network.

use std::fmt::Write;

/// Text as it may stand anywhere in a page.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A number with four significant digits.
///
/// ```
/// use straightline_simulation::html::four_digits;
/// assert_eq!([0.0, 12.0, -0.012344, 123456.0, 1e-7].map(four_digits), ["0", "12.00", "-0.01234", "123500", "1.000e-7"]);
/// ```
pub fn four_digits(x: f64) -> String {
    if x == 0.0 {
        return "0".to_string();
    }
    if !x.is_finite() {
        return "–".to_string();
    }
    let rounded = format!("{x:.3e}");
    let exponent: i32 = rounded.split('e').nth(1).and_then(|e| e.parse().ok()).unwrap_or(0);
    match exponent {
        -4..=5 => {
            let value: f64 = rounded.parse().unwrap_or(x);
            format!("{value:.*}", (3 - exponent).max(0) as usize)
        }
        _ => rounded,
    }
}

/// A page that grows from top to bottom.
#[derive(Clone, Debug)]
pub struct Page(String);

impl Page {
    /// With this title, a line below it, and facts with their names; `style` is its CSS.
    pub fn new(title: &str, line: &str, facts: &[(&str, String)], style: &str) -> Page {
        let (title, line) = (escape(title), escape(line));
        let fact = |(name, value): &(&str, String)| {
            format!("<div><dt>{}</dt><dd>{}</dd></div>\n", escape(name), escape(value))
        };
        let facts: String = facts.iter().map(fact).collect();
        Page(format!(
            "<!DOCTYPE html>\n<html xmlns=\"http://www.w3.org/1999/xhtml\" lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n\
             <meta name=\"color-scheme\" content=\"light dark\"/>\n<title>{title}</title>\n<style>\n{style}</style>\n\
             </head>\n<body>\n<main>\n<h1>{title}</h1>\n<p class=\"muted\">{line}</p>\n<dl class=\"facts\">\n{facts}</dl>\n"
        ))
    }

    /// A heading, and what is shown below it.
    pub fn heading(&mut self, text: &str, lead: &str) {
        let _ = writeln!(self.0, "<h2>{}</h2>", escape(text));
        if !lead.is_empty() {
            let _ = writeln!(self.0, "<p class=\"lead\">{}</p>", escape(lead));
        }
    }

    /// Remarks, marked as bad news or not.
    pub fn remarks(&mut self, lines: &[String], are_bad: bool) {
        if lines.is_empty() {
            return;
        }
        let class = if are_bad { " class=\"warning\"" } else { "" };
        let lines: String = lines.iter().map(|line| format!("<li{class}>{}</li>\n", escape(line))).collect();
        let _ = writeln!(self.0, "<ul class=\"remarks\">\n{lines}</ul>");
    }

    /// A table; its first column holds names.
    pub fn table(&mut self, head: &[&str], rows: &[Vec<String>]) {
        let cells = |tag: &str, row: &mut dyn Iterator<Item = &str>| {
            let cell = |(k, cell): (usize, &str)| {
                let class = if k == 0 { " class=\"l\"" } else { "" };
                format!("<{tag}{class}>{}</{tag}>", escape(cell))
            };
            format!("<tr>{}</tr>\n", row.enumerate().map(cell).collect::<String>())
        };
        self.0 += &format!("<div class=\"figure\">\n<table>\n{}", cells("th", &mut head.iter().copied()));
        for row in rows {
            self.0 += &cells("td", &mut row.iter().map(String::as_str));
        }
        self.0 += "</table>\n</div>\n";
    }

    /// Cards, each with a title and its drawings in a row.
    pub fn cards(&mut self, cards: &[(String, Vec<String>)]) {
        self.0 += "<div class=\"rows\">\n";
        for (title, drawings) in cards {
            let drawings = drawings.concat();
            let _ = writeln!(
                self.0,
                "<section class=\"card\">\n<h3>{}</h3>\n<div class=\"panels\">\n{drawings}</div>\n</section>",
                escape(title)
            );
        }
        self.0 += "</div>\n";
    }

    /// All of it, with a line at the bottom.
    pub fn finish(self, footer: &str) -> String {
        format!("{}<footer>{}</footer>\n</main>\n</body>\n</html>\n", self.0, escape(footer))
    }
}
