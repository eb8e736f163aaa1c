//! Pages for the browser: complete in one file, no script, no network.

use std::fmt::Write;

/// Text as it may stand anywhere in a page.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A page that grows from top to bottom.
#[derive(Clone, Debug)]
pub struct Page(String);

impl Page {
    /// With this title and this line below it.
    pub fn new(title: &str, line: &str) -> Page {
        let (title, line) = (escape(title), escape(line));
        Page(format!(
            "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title>\n\
             <meta name=\"viewport\" content=\"width=device-width\"><style>\n\
             :root {{ color-scheme: light dark }}\n\
             body {{ font: 15px/1.5 sans-serif; max-width: 68em; margin: 2em auto; padding: 0 1em }}\n\
             table {{ border-collapse: collapse; margin: 1em 0 }}\n\
             th, td {{ padding: .2em .8em; text-align: right; border-bottom: 1px solid #8884 }}\n\
             th:first-child, td:first-child {{ text-align: left }}\n\
             figure {{ margin: 1em 0; background: white; overflow-x: auto }}\n\
             .bad {{ color: #d33 }}\n</style></head><body>\n<h1>{title}</h1>\n<p>{line}</p>\n"
        ))
    }

    /// A heading.
    pub fn heading(&mut self, text: &str) {
        let _ = writeln!(self.0, "<h2>{}</h2>", escape(text));
    }

    /// A paragraph, marked as bad news or not.
    pub fn paragraph(&mut self, text: &str, is_bad: bool) {
        let class = if is_bad { " class=\"bad\"" } else { "" };
        let _ = writeln!(self.0, "<p{class}>{}</p>", escape(text));
    }

    /// A table.
    pub fn table(&mut self, head: &[&str], rows: &[Vec<String>]) {
        let cells = |tag: &str, row: &mut dyn Iterator<Item = &str>| {
            let cells: String = row.map(|cell| format!("<{tag}>{}</{tag}>", escape(cell))).collect();
            format!("<tr>{cells}</tr>\n")
        };
        self.0 += &format!("<table>\n{}", cells("th", &mut head.iter().copied()));
        for row in rows {
            self.0 += &cells("td", &mut row.iter().map(String::as_str));
        }
        self.0 += "</table>\n";
    }

    /// A drawing.
    pub fn figure(&mut self, svg: &str) {
        let _ = writeln!(self.0, "<figure>{svg}</figure>");
    }

    /// All of it.
    pub fn finish(self) -> String {
        self.0 + "</body></html>\n"
    }
}
