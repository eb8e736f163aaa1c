//! The macros of Straightline: they read their arguments and leave the rest to `straightline-codegen`. Documentation for
//! users is in the package `straightline`.
#![forbid(unsafe_code)]

mod arguments;
mod scene;

use arguments::{Arguments, Module, SceneArgument};
use proc_macro::TokenStream;
use proc_macro2::TokenStream as Tokens;
use quote::quote;
use std::path::{Path, PathBuf};
use straightline_codegen::expansion::{associated_items, expand, needs_a_module, Refusal, SceneOf};
use straightline_codegen::Generated;
use syn::{parse_macro_input, DeriveInput, Error};

/// Gives a type the dynamics of a robot as associated constants and functions; see the package `straightline`.
#[proc_macro_derive(Dynamics, attributes(robot))]
pub fn derive_dynamics(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    let robots: Vec<_> = input.attrs.iter().filter(|a| a.path().is_ident("robot")).collect();
    let [robot] = robots[..] else {
        let text = "`#[derive(Dynamics)]` takes one `#[robot(\"path/to/file.urdf\")]`";
        return Error::new_spanned(&input.ident, text).into_compile_error().into();
    };
    let arguments = match robot.parse_args::<Arguments>() {
        Ok(arguments) => arguments,
        Err(error) => return error.into_compile_error().into(),
    };
    let (ident, generics) = (&input.ident, &input.generics);
    let (impl_generics, type_generics, where_clause) = generics.split_for_impl();
    let visibility = &input.vis;
    compiled(&arguments, |generated| {
        let (items, associated) = (source(&generated.text), source(&associated_items(generated)));
        let associated = quote! {
            #[allow(dead_code)]
            impl #impl_generics #ident #type_generics #where_clause { #associated }
        };
        match &arguments.module {
            Some(name) => {
                let doc = format!("What `{ident}` is made of: its functions, and types of parameters and stages.");
                quote! {
                    #[doc = #doc]
                    #[allow(dead_code)]
                    #visibility mod #name { #items }
                    const _: () = { use #name as dynamics; #associated };
                }
            }
            None if needs_a_module(generated) => Error::new_spanned(robot, NEEDS_A_MODULE).into_compile_error(),
            None => quote! { const _: () = { #[allow(dead_code)] mod dynamics { #items } #associated }; },
        }
    })
    .unwrap_or_else(Error::into_compile_error)
    .into()
}

const NEEDS_A_MODULE: &str = "the scene has types or scalars of its own, which need a module to be reached in\n\
                              help: name one, as in `module = \"arm_dynamics\"`";

/// Makes a module of the dynamics of a robot; see the package `straightline`.
#[proc_macro]
pub fn dynamics(input: TokenStream) -> TokenStream {
    let Module { attributes, visibility, name, arguments } = parse_macro_input!(input as Module);
    if let Some(module) = &arguments.module {
        return Error::new(module.span(), "`module` is for the derive: this is a module").into_compile_error().into();
    }
    compiled(&arguments, |generated| source(&generated.text))
        .map_or_else(Error::into_compile_error, |items| quote! { #(#attributes)* #visibility mod #name { #items } })
        .into()
}

/// The items made of the dynamics, or the complaints at the place of the file's name; both depend on the files.
fn compiled(arguments: &Arguments, items: impl FnOnce(&Generated) -> Tokens) -> Result<Tokens, Error> {
    let manifest = PathBuf::from(std::env::var_os("CARGO_MANIFEST_DIR").unwrap_or_default());
    let source_file = proc_macro::Span::call_site().local_file();
    let beside = source_file.as_deref().and_then(Path::parent);
    let directories: Vec<&Path> = [manifest.as_path()].into_iter().chain(beside).collect();
    let scene = arguments.scene.as_ref().map(|scene| match scene {
        SceneArgument::File(name) => SceneOf::File(name.value()),
        SceneArgument::Inline(scene) => SceneOf::Macro(scene.source()),
    });
    let expansion = expand(&arguments.robot.value(), scene.as_ref(), &directories, &arguments.options);
    eprint!("{}", expansion.warnings); // a macro has no warnings of its own
    let trackers = expansion.files.iter().map(|file| {
        let path = file.to_string_lossy();
        quote! { const _: &[u8] = include_bytes!(#path); }
    });
    let items = match expansion.result {
        Ok(generated) => items(&generated),
        Err(refusal) => refused(arguments, &refusal),
    };
    Ok(quote! { #items #(#trackers)* })
}

/// The complaints as errors of the compiler: those of a scene in the macro at its tokens, the others at the file's name.
fn refused(arguments: &Arguments, refusal: &Refusal) -> Tokens {
    let at_the_file = (!refusal.message.is_empty()).then(|| Error::new(arguments.robot.span(), &refusal.message));
    let at_the_scene = refusal.of_scene.iter().filter_map(|complaint| match &arguments.scene {
        Some(SceneArgument::Inline(scene)) => Some(scene.error(complaint)),
        _ => None,
    });
    at_the_file.into_iter().chain(at_the_scene).map(Error::into_compile_error).collect()
}

/// Generated source as tokens.
fn source(text: &str) -> Tokens {
    text.parse().expect("generated source is Rust")
}
