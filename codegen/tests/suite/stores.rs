//! Results are stored as soon as they are known: one that waits for its store takes a register until then.

use std::path::Path;
use straightline_codegen::choices::TargetMachine;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::options::Options;
use straightline_codegen::{compile, Function, Scalar};
use syn::visit::{self, Visit};

/// Stores of locals, in the order of the text.
#[derive(Default)]
struct Stores {
    /// The locals of the last statement that computed something.
    known: Vec<String>,
    at_once: usize,
    late: Vec<String>,
}

/// The local that is stored as it is: a change of sign is an operation of its own.
fn stored(value: &syn::Expr) -> Option<String> {
    match value {
        syn::Expr::Path(path) => path.path.get_ident().map(ToString::to_string),
        syn::Expr::Paren(inner) => stored(&inner.expr),
        _ => None,
    }
}

fn bound(pattern: &syn::Pat) -> Vec<String> {
    match pattern {
        syn::Pat::Ident(name) => vec![name.ident.to_string()],
        syn::Pat::Tuple(tuple) => tuple.elems.iter().flat_map(bound).collect(),
        syn::Pat::Type(typed) => bound(&typed.pat),
        _ => Vec::new(),
    }
}

impl<'a> Visit<'a> for Stores {
    fn visit_item_mod(&mut self, _: &'a syn::ItemMod) {
        // kernels have no results
    }

    fn visit_local(&mut self, local: &'a syn::Local) {
        if local.init.is_some() {
            self.known = bound(&local.pat);
        }
    }

    fn visit_expr_assign(&mut self, assignment: &'a syn::ExprAssign) {
        let value = &assignment.right;
        match (&*assignment.left, stored(value)) {
            (syn::Expr::Index(_), Some(name)) if self.known.contains(&name) => self.at_once += 1,
            (syn::Expr::Index(_), Some(name)) => self.late.push(name),
            (syn::Expr::Index(_), None) => (),
            (place, _) => self.known = stored(place).into_iter().collect(),
        }
        visit::visit_expr_assign(self, assignment);
    }
}

fn stores(text: &str) -> Stores {
    let mut stores = Stores::default();
    stores.visit_file(&syn::parse_file(text).expect("it is Rust"));
    stores
}

#[test]
fn results_are_stored_as_soon_as_they_are_known() {
    let functions = [
        Function::InverseDynamics,
        Function::MassMatrix,
        Function::ForwardDynamics,
        Function::InverseDynamicsDerivatives,
    ];
    let mut at_once = 0;
    for robot in ["ur5.urdf", "panda.urdf", "solo12.urdf"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions").join(robot);
        let source = Source::new(robot, std::fs::read_to_string(path).expect("the robot is there"));
        for target in [None, Some(TargetMachine::CORTEX_M4F)] {
            let mut options =
                Options { functions: functions.to_vec(), scalar: Scalar::F32, target, ..Options::default() };
            options.model.floating_base = robot == "solo12.urdf";
            let text = compile(&source, &options).unwrap_or_else(|errors| panic!("{errors}")).text;
            let found = stores(&text);
            assert_eq!(found.late, [""; 0], "{robot} for {target:?}");
            at_once += found.at_once;
        }
    }
    assert!(at_once > 200, "{at_once} stores of locals are too few");
    // one that is late is seen
    let late =
        stores("fn f(x: &[f64; 2], y: &mut [f64; 2]) { let a = x[0] + x[1]; let b = a * a; y[0] = a; y[1] = b; }");
    assert_eq!((late.at_once, late.late.len()), (1, 1));
}
