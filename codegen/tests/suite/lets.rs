//! How many locals stand in one scope of generated text: compilers take more than linear time for a scope of many.

use std::path::Path;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::options::Options;
use straightline_codegen::{compile, Function};
use syn::visit::{self, Visit};

const MOST: usize = 2500;

/// The most locals that one block declares.
#[derive(Default)]
struct Locals(usize);

impl<'a> Visit<'a> for Locals {
    fn visit_block(&mut self, block: &'a syn::Block) {
        let is_local = |statement: &&syn::Stmt| matches!(statement, syn::Stmt::Local(_));
        self.0 = self.0.max(block.stmts.iter().filter(is_local).count());
        visit::visit_block(self, block);
    }
}

fn most(name: &str, functions: &[Function]) -> usize {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions").join(name);
    let robot = Source::new(name, std::fs::read_to_string(path).expect("the robot is there"));
    let mut options = Options { functions: functions.to_vec(), ..Options::default() };
    options.model.floating_base = name != "panda.urdf";
    let text = compile(&robot, &options).unwrap_or_else(|errors| panic!("{errors}")).text;
    let mut locals = Locals::default();
    locals.visit_file(&syn::parse_file(&text).expect("it is Rust"));
    println!("{name}: {} locals in one scope", locals.0);
    locals.0
}

const DERIVATIVES: [Function; 2] = [Function::InverseDynamicsDerivatives, Function::ForwardDynamicsDerivatives];

#[test]
fn scopes_of_derivatives_have_few_locals() {
    let found = most("panda.urdf", &DERIVATIVES);
    assert!((1..=MOST).contains(&found), "{found}");
    // locals are seen
    let mut locals = Locals::default();
    let text = format!("fn f() {{ {} }}", "let x = 1.0; ".repeat(MOST + 1));
    locals.visit_file(&syn::parse_file(&text).expect("it is Rust"));
    assert_eq!(locals.0, MOST + 1);
}

#[test]
#[ignore = "slow proof: programs of some ten thousand operations are searched"]
fn slow_proof_scopes_of_humanoids_have_few_locals() {
    for robot in ["hyq.urdf", "simple_humanoid.urdf"] {
        assert!(most(robot, &DERIVATIVES) <= MOST, "{robot}");
    }
}
