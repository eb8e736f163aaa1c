//! Writes the page: `straightline-playground-writer COMPILER.wasm COMPILER.wasm.lzma PAGE.html`, from the module that is built for wasm32. It knows no robotics, so that the page is
//! written without building the compiler a second time.
//!
//! One file that asks for nothing: the module packed by LZMA, which the page unpacks, script, style, and the robots of the repository as examples. What the
//! page may do is told to the browser by hashes: it runs its own scripts, and workers and modules that it made itself, and has no network.

use base64::{engine::general_purpose::STANDARD, Engine};
use sha2::{Digest, Sha256};
use std::error::Error;
use std::path::{Path, PathBuf};
use std::{env, fs};

/// Most bytes of the packed module.
const MOST: usize = 2_000_000;

fn file(path: &str) -> Result<String, Box<dyn Error>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
    fs::read_to_string(&path).map_err(|why| format!("{}: {why}", path.display()).into())
}

/// A text of the view's page in which this is replaced, which it has to have.
fn replaced(text: &str, what: &str, by: &str) -> Result<String, Box<dyn Error>> {
    match text.contains(what) {
        true => Ok(text.replace(what, by)),
        false => Err(format!("the view's page has no `{what}` any more").into()),
    }
}

/// Style and body of the view's page as a part of another one.
fn view_parts() -> Result<(String, String), Box<dyn Error>> {
    let mut style = file("../view/src/page/page.css")?;
    for (what, by) in [
        ("\nheader {", "\n.viewed-head {"),
        ("\nmain {", "\n.viewed-main {"),
        ("  main {", "  .viewed-main {"),
        ("  header {", "  .viewed-head {"),
    ] {
        style = replaced(&style, what, by)?;
    }
    style = replaced(&style, "\nh1 {", "\n.viewed-head h3 {")?;
    let mut body = file("../view/src/page/page.html")?;
    for (what, by) in [
        ("<header>", "<div class=\"viewed-head\">"),
        ("</header>", "</div>"),
        ("<main>", "<div class=\"viewed-main\">"),
        ("</main>", "</div>"),
        ("<h1 ", "<h3 "),
        ("</h1>", "</h3>"),
    ] {
        body = replaced(&body, what, by)?;
    }
    let (body, _) = body.split_once("<noscript>").ok_or("the view's page has no <noscript> any more")?;
    Ok((style, format!("{body}<script type=\"application/json\" id=\"data\"></script>\n")))
}

/// The view's script as a function that can be called again.
fn view_script() -> Result<String, Box<dyn Error>> {
    let parts = ["algebra.js", "scene.js", "charts.js", "page.js"];
    let script: Result<String, _> = parts.iter().map(|name| file(&format!("../view/src/page/{name}"))).collect();
    Ok(format!("function robotView() {{\n{}{}}}\n", script?, file("page/view_end.js")?))
}

/// The robots of the repository, as JSON that ends no element.
fn examples() -> Result<String, Box<dyn Error>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../robots/descriptions");
    let mut paths: Vec<PathBuf> =
        fs::read_dir(folder)?.map(|entry| entry.map(|e| e.path())).collect::<Result<_, _>>()?;
    paths.sort();
    let mut robots = serde_json::Map::new();
    for path in paths {
        let name = path.file_name().unwrap_or_default().to_string_lossy().to_string();
        robots.insert(name, fs::read_to_string(&path)?.into());
    }
    Ok(serde_json::Value::Object(robots)
        .to_string()
        .replace('<', "\\u003c")
        .replace('>', "\\u003e")
        .replace('&', "\\u0026"))
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [module, packed, page] = &arguments[..] else {
        return Err("straightline-playground-writer COMPILER.wasm COMPILER.wasm.lzma PAGE.html".into());
    };
    let (module, packed) = (fs::read(module)?, fs::read(packed)?);
    let (view_style, view_body) = view_parts()?;
    let style = format!("{view_style}{}", file("page/playground.css")?);
    let parts = ["assistant.js", "shown.js", "bench.js", "playground.js"];
    let parts: Result<String, _> = parts.iter().map(|name| file(&format!("page/{name}"))).collect();
    let script = format!("{}{}", parts?, view_script()?);
    let worker = format!("{}{}", file("page/lzma.js")?, file("page/worker.js")?);
    let hash = |text: &str| format!("'sha256-{}'", STANDARD.encode(Sha256::digest(text.as_bytes())));
    let policy = format!(
        "default-src 'none'; script-src {} 'wasm-unsafe-eval'; worker-src blob:; style-src {}; base-uri 'none'; form-action 'none'",
        hash(&script),
        hash(&style)
    );
    // only what is called so ends such elements
    assert!(!worker.contains("</script") && !script.contains("</script"), "a script would end early");
    let html = format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<meta name=\"color-scheme\" content=\"light dark\">\n\
         <title>Straightline playground</title>\n<style>{style}</style>\n</head>\n<body>\n{}<template id=\"view-template\">{view_body}</template>\n\
         <script type=\"application/json\" id=\"examples\">{}</script>\n<script type=\"text/plain\" id=\"worker\">{worker}</script>\n\
         <script type=\"text/plain\" id=\"compiler\" data-size=\"{}\">{}</script>\n<script>{script}</script>\n</body>\n</html>\n",
        file("page/playground.html")?,
        examples()?,
        module.len(),
        STANDARD.encode(&packed)
    );
    fs::write(page, &html)?;
    println!("compiler {} bytes, packed {}; page {}", module.len(), packed.len(), html.len());
    match packed.len() <= MOST {
        true => Ok(()),
        false => Err(format!("the packed compiler has more than {MOST} bytes").into()),
    }
}
