//! The macros of Straightline: they read their arguments and leave the rest to `straightline-codegen`. Documentation for
//! users is in the package `straightline`.
#![forbid(unsafe_code)]

mod arguments;
mod scene;

use arguments::{Arguments, ModuleList, SceneArgument};
use proc_macro::TokenStream;
use proc_macro2::TokenStream as Tokens;
use quote::{quote, quote_spanned};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use straightline_codegen::emit::rust::stubs;
use straightline_codegen::fronts::expansion::{examine, expand, Expansion, Refusal, SceneOf};
use straightline_codegen::{Function, Generated, Options};
use syn::{parse_macro_input, DeriveInput, Error};

/// Gives a type the dynamics of a robot as associated constants and functions; see the package `straightline`.
#[proc_macro_derive(Dynamics, attributes(robot))]
pub fn derive_dynamics(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    let robots: Vec<_> = input.attrs.iter().filter(|a| a.path().is_ident("robot")).collect();
    let arguments = match robots[..] {
        [robot] => robot.parse_args::<Arguments>().unwrap_or_else(Arguments::unreadable),
        _ => {
            let text = "`#[derive(Dynamics)]` takes one `#[robot(\"path/to/file.urdf\")]`";
            Arguments::unreadable(Error::new_spanned(&input.ident, text))
        }
    };
    let (ident, generics) = (&input.ident, &input.generics);
    let (impl_generics, type_generics, where_clause) = generics.split_for_impl();
    let visibility = &input.vis;
    let impl_of = |associated: Tokens| {
        quote! {
            #[allow(dead_code)]
            impl #impl_generics #ident #type_generics #where_clause { #associated }
        }
    };
    let doc = format!("What `{ident}` is made of: its functions, and types of parameters and stages.");
    let with_module = |items: Tokens, associated: Tokens| match &arguments.module {
        Some(name) => quote! {
            #[doc = #doc]
            #[allow(dead_code)]
            #visibility mod #name { #items }
            const _: () = { use #name as dynamics; #associated };
        },
        None => quote! { const _: () = { #[allow(dead_code)] mod dynamics { #items } #associated }; },
    };
    let Compiled { result, scene, robot, trackers } = compiled(&arguments);
    let result = result.and_then(|made| match arguments.module.is_none() && made.0.needs_a_module() {
        true => Err(vec![Error::new(arguments.place(), NEEDS_A_MODULE)]),
        false => Ok(made),
    });
    let items = match result {
        Ok((generated, associated)) => with_module(source(&generated.text), impl_of(source(&associated))),
        Err(errors) => {
            let associated = source(&stubs::associated_items(&stubbed(&arguments), scene.as_deref(), &robot));
            let unknown = arguments.unknown.iter();
            let unknown = quote! { #(pub const #unknown: dynamics::__Missing = <dynamics::__Missing>::value;)* };
            let associated = impl_of(quote! { #![allow(warnings, clippy::all)] #associated #unknown });
            with_module(broken(&arguments, scene.as_deref(), errors), associated)
        }
    };
    quote! { #items #trackers }.into()
}

const NEEDS_A_MODULE: &str = "the scene has types or scalars of its own, which need a module to be reached in\n\
                              help: name one, as in `module = \"arm_dynamics\"`";

/// Makes a module of the dynamics of a robot; see the package `straightline`.
#[proc_macro]
pub fn dynamics(input: TokenStream) -> TokenStream {
    let ModuleList { attributes, visibility, name, mut arguments } = parse_macro_input!(input as ModuleList);
    if let Some(module) = &arguments.module {
        arguments.errors.push(Error::new(module.span(), "`module` is for the derive: this is a module"));
    }
    let Compiled { result, scene, trackers, .. } = compiled(&arguments);
    let items = match result {
        Ok((generated, _)) => source(&generated.text),
        Err(errors) => broken(&arguments, scene.as_deref(), errors),
    };
    quote! { #(#attributes)* #visibility mod #name { #items } #trackers }.into()
}

/// What came out of the files that a macro names.
struct Compiled {
    /// The dynamics and what a type has of it, or all that is wrong.
    result: Result<(Generated, String), Vec<Error>>,
    /// The text of the scene, if there is one.
    scene: Option<String>,
    /// The text of the robot file, where that is wrong but there.
    robot: String,
    /// Items by which the compiler knows the files that the expansion depends on.
    trackers: Tokens,
}

fn compiled(arguments: &Arguments) -> Compiled {
    let manifest = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let source_file = proc_macro::Span::call_site().local_file();
    let beside = source_file.as_deref().and_then(Path::parent);
    let directories: Vec<&Path> = [manifest.as_path()].into_iter().chain(beside).collect();
    let scene_of = arguments.scene.as_ref().map(|scene| match scene {
        SceneArgument::File(name) => SceneOf::File(name.value()),
        SceneArgument::Inline(scene) => SceneOf::Macro(scene.source()),
    });
    let (files, result, scene) = match &arguments.robot {
        None => (Vec::new(), Err(arguments.errors.clone()), scene_of.map(|_| String::new())),
        Some(robot) if arguments.errors.is_empty() => {
            let expansion = expand(&robot.value(), scene_of.as_ref(), &directories, &arguments.settings);
            let Expansion { files, result, warnings, scene } = expansion;
            say(&warnings);
            (files, result.map_err(|refusal| refused(arguments, &refusal)), scene)
        }
        Some(robot) => {
            let (files, refusal, scene) = examine(&robot.value(), scene_of.as_ref(), &directories, &arguments.settings);
            let further = refusal.map(|refusal| refused(arguments, &refusal)).unwrap_or_default();
            (files, Err(arguments.errors.iter().cloned().chain(further).collect()), scene)
        }
    };
    let trackers = files.iter().map(|file| {
        let path = file.to_string_lossy();
        quote! { const _: &[u8] = include_bytes!(#path); }
    });
    let read = || files.first().and_then(|file| std::fs::read(file).ok());
    let robot = if result.is_err() { read().unwrap_or_default() } else { Vec::new() };
    let robot = String::from_utf8_lossy(&robot).into_owned();
    Compiled { result, scene, robot, trackers: trackers.collect() }
}

/// Warnings, each once however many types have the same robot: a macro has no warnings of its own.
fn say(warnings: &str) {
    static SAID: Mutex<BTreeSet<String>> = Mutex::new(BTreeSet::new());
    let mut said = SAID.lock().unwrap_or_else(PoisonError::into_inner);
    if said.insert(warnings.to_string()) {
        eprint!("{warnings}");
    }
}

/// The complaints as errors of the compiler: those of a scene in the macro at its tokens, the others at the file's name.
fn refused(arguments: &Arguments, refusal: &Refusal) -> Vec<Error> {
    let at_the_file = (!refusal.message.is_empty()).then(|| Error::new(arguments.place(), &refusal.message));
    let at_the_scene = refusal.of_scene.iter().filter_map(|complaint| match &arguments.scene {
        Some(SceneArgument::Inline(scene)) => Some(scene.error(complaint)),
        _ => None,
    });
    at_the_file.into_iter().chain(at_the_scene).collect()
}

/// The options of which stubs are made: all functions where an option is wrong, as it may be their list.
fn stubbed(arguments: &Arguments) -> Options {
    let mut options = Options::default();
    arguments.settings.apply(&mut options);
    if !arguments.errors.is_empty() {
        options.functions = Function::all().collect();
    }
    options
}

/// A module that says what is wrong, and has items of all names that it would have, so that this stays the only error.
fn broken(arguments: &Arguments, scene: Option<&str>, errors: Vec<Error>) -> Tokens {
    let mut errors = errors.into_iter();
    let first = errors.next().unwrap_or_else(|| Error::new(arguments.place(), "the robot cannot be compiled"));
    let message = first.to_string();
    let said = quote_spanned! { first.span() => ::core::compile_error!(#message) };
    let others = errors.map(Error::into_compile_error);
    let definition = source(stubs::DEFINITION);
    let items = source(&stubs::module_items(&stubbed(arguments), scene));
    let unknown = arguments.unknown.iter();
    quote! {
        #![allow(warnings, clippy::all)]
        #definition
        #[doc(hidden)]
        pub type __Missing = <__Why<{ #said }> as __Stub>::Item;
        #items
        #(pub const #unknown: __Missing = <__Missing>::value;)*
        #(#others)*
    }
}

/// Generated source as tokens.
fn source(text: &str) -> Tokens {
    text.parse().expect("generated source is Rust")
}
