//! Whether generated text is Rust: its syntax, and what every name in it means. Not a compiler: types are not looked at, and
//! modules that are pasted as they are (sines, drivers of batches) are taken as sound. What it finds, rustc would refuse.

use std::collections::{BTreeMap, BTreeSet};
use syn::visit::{self, Visit};
use syn::{Expr, FnArg, Item, Pat};

/// Modules whose text is the same for all robots.
const PASTED: [&str; 3] = ["trig", "batch", "fused"];
/// Types, traits and crates that are there without being named.
const TYPES: [&str; 29] = [
    "f32",
    "f64",
    "u8",
    "u32",
    "u64",
    "usize",
    "i32",
    "bool",
    "str",
    "char",
    "Self",
    "Result",
    "Option",
    "Copy",
    "Clone",
    "Debug",
    "PartialEq",
    "Eq",
    "Default",
    "Iterator",
    "Fn",
    "Sized",
    "core",
    "crate",
    "self",
    "super",
    "straightline",
    "Ok",
    "Err",
];
const VALUES: [&str; 5] = ["Ok", "Err", "Some", "None", "self"];
const MACROS: [&str; 2] = ["cfg", "with_threads"];

/// What is wrong with a file that stands as a module.
pub fn complaints(text: &str) -> Vec<String> {
    let file = match syn::parse_file(text) {
        Ok(file) => file,
        Err(error) => {
            let line = text.lines().nth(error.span().start().line.saturating_sub(1)).unwrap_or_default();
            return vec![format!("no Rust: {error}: {line}")];
        }
    };
    let mut complaints = writing(text);
    module(&file.items, &[], &mut complaints);
    complaints
}

/// Marks that turn the direction of writing, which rustc refuses wherever they stand.
fn writing(text: &str) -> Vec<String> {
    let turns = |c: &char| matches!(c, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}' | '\r');
    text.chars().filter(turns).take(1).map(|c| format!("the text holds {}", c.escape_default())).collect()
}

/// What a module has, by name.
#[derive(Clone, Default)]
struct Names {
    types: BTreeSet<String>,
    values: BTreeSet<String>,
    /// Values that a pattern of that name would mean.
    patterns: BTreeSet<String>,
    modules: BTreeMap<String, Names>,
}

impl Names {
    fn of(items: &[Item], complaints: &mut Vec<String>) -> Names {
        let mut names = Names::default();
        let mut add = |set: &mut BTreeSet<String>, name: String| {
            if !set.insert(name.clone()) {
                complaints.push(format!("`{name}` is defined twice"));
            }
        };
        for item in items {
            match item {
                Item::Fn(f) => add(&mut names.values, f.sig.ident.to_string()),
                Item::Const(c) if c.ident != "_" => {
                    names.patterns.insert(c.ident.to_string());
                    add(&mut names.values, c.ident.to_string());
                }
                Item::Static(s) => add(&mut names.values, s.ident.to_string()),
                Item::Enum(e) => add(&mut names.types, e.ident.to_string()),
                Item::Struct(s) => {
                    add(&mut names.types, s.ident.to_string());
                    if !matches!(s.fields, syn::Fields::Named(_)) {
                        names.patterns.insert(s.ident.to_string());
                        add(&mut names.values, s.ident.to_string());
                    }
                }
                Item::Mod(m) => add(&mut names.types, m.ident.to_string()),
                Item::Use(u) => imported(&u.tree, &mut names),
                _ => {}
            }
        }
        names
    }
}

fn imported(tree: &syn::UseTree, names: &mut Names) {
    match tree {
        syn::UseTree::Path(p) => {
            // `fused::{self, fma}`
            if let syn::UseTree::Group(g) = &*p.tree {
                if g.items.iter().any(|t| matches!(t, syn::UseTree::Name(n) if n.ident == "self")) {
                    names.types.insert(p.ident.to_string());
                }
            }
            imported(&p.tree, names);
        }
        syn::UseTree::Name(n) if n.ident == "self" => {}
        syn::UseTree::Name(n) => {
            names.types.insert(n.ident.to_string());
            names.values.insert(n.ident.to_string());
        }
        syn::UseTree::Rename(r) => {
            names.types.insert(r.rename.to_string());
            names.values.insert(r.rename.to_string());
        }
        syn::UseTree::Group(g) => g.items.iter().for_each(|tree| imported(tree, names)),
        _ => {}
    }
}

fn module(items: &[Item], above: &[Names], complaints: &mut Vec<String>) {
    let mut names = Names::of(items, complaints);
    for hidden in names.types.iter().filter(|t| TYPES.contains(&t.as_str()) && !PASTED.contains(&t.as_str())) {
        if !matches!(hidden.as_str(), "self" | "super" | "crate") {
            complaints.push(format!("the type or module `{hidden}` hides Rust's own"));
        }
    }
    for hidden in names.values.iter().filter(|v| VALUES.contains(&v.as_str()) && *v != "self") {
        complaints.push(format!("`{hidden}` hides Rust's own"));
    }
    for item in items {
        if let Item::Mod(m) = item {
            let inner = m.content.as_ref().map_or(Names::default(), |(_, items)| Names::of(items, &mut Vec::new()));
            names.modules.insert(m.ident.to_string(), inner);
        }
    }
    let scopes: Vec<Names> = above.iter().cloned().chain([names]).collect();
    for item in items {
        match item {
            Item::Mod(m) if PASTED.contains(&m.ident.to_string().as_str()) => {}
            Item::Mod(m) => module(m.content.as_ref().map_or(&[][..], |(_, items)| items), &scopes, complaints),
            Item::Impl(i) => {
                let mut reader = Reader::new(&scopes, complaints);
                i.generics.params.iter().for_each(|p| reader.generic(p));
                reader.visit_type(&i.self_ty);
                for item in &i.items {
                    if let syn::ImplItem::Fn(f) = item {
                        Reader::new(&scopes, complaints).function(&f.sig, Some(&f.block));
                    }
                }
            }
            Item::Fn(f) => Reader::new(&scopes, complaints).function(&f.sig, Some(&f.block)),
            other => Reader::new(&scopes, complaints).visit_item(other),
        }
    }
}

/// One function: its locals and what it mentions.
struct Reader<'a> {
    scopes: &'a [Names],
    complaints: &'a mut Vec<String>,
    locals: BTreeSet<String>,
    types: BTreeSet<String>,
}

impl<'a> Reader<'a> {
    fn new(scopes: &'a [Names], complaints: &'a mut Vec<String>) -> Self {
        Reader { scopes, complaints, locals: BTreeSet::new(), types: BTreeSet::new() }
    }

    fn here(&self) -> &'a Names {
        self.scopes.last().expect("the module's own")
    }

    fn generic(&mut self, parameter: &syn::GenericParam) {
        match parameter {
            syn::GenericParam::Type(t) => _ = self.types.insert(t.ident.to_string()),
            syn::GenericParam::Const(c) => {
                self.locals.insert(c.ident.to_string());
                // as an argument it is written like a type
                self.types.insert(c.ident.to_string());
                if self.here().patterns.contains(&c.ident.to_string()) {
                    self.complaints.push(format!("the parameter `{}` hides a type", c.ident));
                }
            }
            syn::GenericParam::Lifetime(_) => {}
        }
    }

    fn function(&mut self, sig: &syn::Signature, block: Option<&syn::Block>) {
        for parameter in &sig.generics.params {
            if let syn::GenericParam::Type(t) = parameter {
                if self.here().types.contains(&t.ident.to_string()) {
                    self.complaints.push(format!("the parameter `{}` hides a type", t.ident));
                }
            }
            self.generic(parameter);
        }
        for input in &sig.inputs {
            if let FnArg::Typed(typed) = input {
                if let Pat::Ident(p) = &*typed.pat {
                    if !self.locals.insert(p.ident.to_string()) {
                        self.complaints.push(format!("`{}` has two parameters `{}`", sig.ident, p.ident));
                    }
                }
                self.visit_pat(&typed.pat);
                self.visit_type(&typed.ty);
            }
        }
        self.visit_return_type(&sig.output);
        if let Some(block) = block {
            // all bindings first: generated code binds before it uses, which is rustc's to see
            let mut bindings = Bindings::default();
            bindings.visit_block(block);
            self.locals.extend(bindings.0);
            self.visit_block(block);
        }
    }

    fn path(&mut self, path: &syn::Path, is_value: bool) {
        let segments: Vec<String> = path.segments.iter().map(|s| s.ident.to_string()).collect();
        if path.leading_colon.is_some() {
            return;
        }
        let (first, here) = (segments[0].as_str(), self.here());
        let known_type = TYPES.contains(&first) || self.types.contains(first) || here.types.contains(first);
        match segments.as_slice() {
            [name] if is_value => {
                let known = self.locals.contains(name) || here.values.contains(name) || VALUES.contains(&name.as_str());
                if !known && !here.types.contains(name) {
                    self.complaints.push(format!("nothing is named `{name}`"));
                }
            }
            [name] if !known_type => self.complaints.push(format!("no type is named `{name}`")),
            [_] => {}
            [up, rest @ ..] if up == "super" && self.scopes.len() > 1 => {
                let mut scope = self.scopes.len() - 2;
                let mut rest = rest;
                while let [up, deeper @ ..] = rest {
                    if up != "super" || scope == 0 {
                        break;
                    }
                    (scope, rest) = (scope - 1, deeper);
                }
                let there = &self.scopes[scope];
                if rest.first().is_some_and(|n| !there.types.contains(n) && !there.values.contains(n)) {
                    self.complaints.push(format!("`{}` leads nowhere", segments.join("::")));
                }
            }
            [name, item, ..] => {
                if !known_type {
                    self.complaints.push(format!("no module or type is named `{name}`"));
                }
                let inner = here.modules.get(name).filter(|_| !PASTED.contains(&name.as_str()));
                if inner.is_some_and(|m| !m.types.contains(item) && !m.values.contains(item)) {
                    self.complaints.push(format!("`{}` leads nowhere", segments.join("::")));
                }
            }
            [] => {}
        }
    }
}

impl<'ast> Visit<'ast> for Reader<'_> {
    fn visit_expr(&mut self, expr: &'ast Expr) {
        match expr {
            Expr::Path(p) if p.qself.is_none() => {
                self.path(&p.path, true);
                p.path.segments.iter().for_each(|s| self.visit_path_arguments(&s.arguments));
            }
            Expr::Call(call) => {
                if let Expr::Path(p) = &*call.func {
                    if let Some(name) = p.path.get_ident() {
                        if self.locals.contains(&name.to_string()) {
                            self.complaints.push(format!("`{name}` is called, and is a local"));
                        }
                    }
                }
                visit::visit_expr(self, expr);
            }
            _ => visit::visit_expr(self, expr),
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.path(path, false);
        visit::visit_path(self, path);
    }

    fn visit_pat(&mut self, pat: &'ast Pat) {
        if let Pat::Ident(p) = pat {
            if self.scopes.iter().last().is_some_and(|names| names.patterns.contains(&p.ident.to_string())) {
                self.complaints.push(format!("the pattern `{}` means a constant", p.ident));
            }
        }
        visit::visit_pat(self, pat);
    }

    fn visit_type_array(&mut self, array: &'ast syn::TypeArray) {
        self.visit_type(&array.elem);
        self.visit_expr(&array.len);
    }

    // items within functions are bindings; attributes, macros and trait items are rustc's
    fn visit_attribute(&mut self, _: &'ast syn::Attribute) {}
    fn visit_visibility(&mut self, _: &'ast syn::Visibility) {}
    fn visit_item_use(&mut self, _: &'ast syn::ItemUse) {}
    fn visit_item_trait(&mut self, _: &'ast syn::ItemTrait) {}
    fn visit_macro(&mut self, mac: &'ast syn::Macro) {
        if mac.path.segments.last().is_none_or(|m| !MACROS.contains(&m.ident.to_string().as_str())) {
            self.complaints.push("a macro".to_string());
        }
    }
}

/// Everything that a function binds.
#[derive(Default)]
struct Bindings(BTreeSet<String>);

impl<'ast> Visit<'ast> for Bindings {
    fn visit_pat_ident(&mut self, p: &'ast syn::PatIdent) {
        self.0.insert(p.ident.to_string());
        visit::visit_pat_ident(self, p);
    }

    fn visit_item_static(&mut self, s: &'ast syn::ItemStatic) {
        self.0.insert(s.ident.to_string());
    }
}
