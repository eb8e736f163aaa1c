//! Bounds at the state at hand against true errors, and accelerations checked by their residual, on many robots in both formats.

use straightline_codegen::certify::companion::{state_bound, Bits};
use straightline_codegen::certify::{certify, search, Effort, Interval};
use straightline_codegen::choices::WrittenEntries;
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::{evaluate, Graph};
use straightline_codegen::model::{self, ModelOptions};
use straightline_codegen::options::{Optimisations, Options};
use straightline_codegen::program::companion::companion;
use straightline_codegen::program::input_box::input_box;
use straightline_codegen::program::optimised;
use straightline_codegen::scene::{Gravity, InputRange as Range, JointRanges, Scene};
use straightline_codegen::{compile, Function, Scalar, Source};
use straightline_core::Dd;

const BOTH: [Scalar; 2] = [Scalar::F32, Scalar::F64];

struct Case {
    graph: Graph,
    bound: Graph,
    ranges: Vec<Interval>,
    mass_matrix: Graph,
}

/// A function with its companion, |q̇| ≤ `speed`, |q̈| ≤ 2.
fn case(file: &str, floating_base: bool, function: Function, scalar: Scalar, speed: f64) -> Case {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions").join(file);
    let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let model = ModelOptions { floating_base, ..ModelOptions::default() };
    let (loaded, complaints) = model::load(&Source::new(file, text), &model);
    let robot = Robot::new(loaded.unwrap_or_else(|| panic!("{}", complaints.render())));
    let mut scene = Scene::default();
    scene.ranges.qd = JointRanges::All(Range::within(speed));
    scene.ranges.qdd = JointRanges::All(Range::within(2.0));
    scene.ranges.tau = JointRanges::All(Range::within(50.0));
    let certify = Some(Effort { companions: true, ..Effort::default() });
    let options = Options { scalar, scene: scene.clone(), model, certify, ..Options::default() };
    // without the search for the cheapest form, which takes long
    let plain = Optimisations { chosen: false, ..options.optimisations() };
    let graph = optimised(&robot, &[], function, &options, plain);
    let mass_matrix = optimised(&robot, &[], Function::MassMatrix, &options, plain);
    let bound = companion(&robot, function, &graph, &options).expect("the function has a companion");
    let ranges = input_box(&graph.inputs, &scene, &robot.model).expect("every input has a range");
    Case { graph, bound, ranges, mass_matrix }
}

/// The bound as the format computes it.
fn at(bound: &Graph, scalar: Scalar, inputs: &[f64]) -> Vec<f64> {
    search::computed_at(bound, scalar, inputs)
}

#[test]
fn the_bound_at_a_state_holds_there_and_is_tighter_than_that_of_the_box() {
    for scalar in BOTH {
        for (file, floating) in
            [("panda.urdf", false), ("ur5.urdf", false), ("chapter_oblique.toml", false), ("solo12.urdf", true)]
        {
            for function in [Function::InverseDynamics, Function::MassMatrix] {
                let case = case(file, floating, function, scalar, 0.3);
                let of_box = certify(&case.graph, scalar, &case.ranges, Effort::default()).expect("no division").errors;
                let evaluations = 300 * case.graph.results.len().min(20);
                for (k, found) in
                    search::worst_found(&case.graph, scalar, &case.ranges, evaluations, 5).iter().enumerate()
                {
                    let errors = search::errors_at(&case.graph, scalar, &found.inputs);
                    let bounds = at(&case.bound, scalar, &found.inputs);
                    let what = format!("{} of {file}, {scalar:?}, at {:?}", function.name(), found.inputs);
                    let worst = errors.iter().zip(&bounds).position(|(e, b)| b.is_nan() || e > b);
                    assert_eq!(worst, None, "{what}: {errors:?} > {bounds:?}");
                    // what running bounds lose on these robots: 12 at most, but 31 of chapter_oblique's H, a long sum of products
                    let most = if function == Function::MassMatrix { 40.0 } else { 25.0 };
                    assert!(
                        found.error == 0.0 || bounds[k] < most * found.error,
                        "{what}: {k}, {:e}",
                        bounds[k] / found.error
                    );
                    if file == "panda.urdf" && function == Function::InverseDynamics {
                        assert!(bounds[k] < 0.7 * of_box[k], "{what}: {k}, {:e} of {:e}", bounds[k], of_box[k]);
                    }
                }
            }
        }
    }
}

/// Numbers that are the same every time, in the middle nine tenths of ranges.
fn states(ranges: &[Interval], scalar: Scalar, count: usize) -> Vec<Vec<f64>> {
    let mut seed = 7u64;
    let mut unit = || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 11) as f64 / (1u64 << 53) as f64
    };
    let round = |x: f64| if scalar == Scalar::F32 { f64::from(x as f32) } else { x };
    (0..count).map(|_| ranges.iter().map(|r| round(r.lo + (0.05 + 0.9 * unit()) * (r.hi - r.lo))).collect()).collect()
}

/// An eigenvalue of a symmetric matrix near its smallest one, from above: inverse iteration, and Rayleigh's quotient.
fn small_eigenvalue(h: &[f64], n: usize) -> f64 {
    let mut x = vec![1.0; n];
    for _ in 0..50 {
        let mut a = h.to_vec();
        let mut b = x.clone();
        for k in 0..n {
            for i in k + 1..n {
                let f = a[i * n + k] / a[k * n + k];
                (k..n).for_each(|j| a[i * n + j] -= f * a[k * n + j]);
                b[i] -= f * b[k];
            }
        }
        for i in (0..n).rev() {
            let known: f64 = (i + 1..n).map(|j| a[i * n + j] * b[j]).sum();
            b[i] = (b[i] - known) / a[i * n + i];
        }
        let norm = b.iter().map(|v| v * v).sum::<f64>().sqrt();
        x = b.iter().map(|v| v / norm).collect();
    }
    (0..n * n).map(|k| x[k / n] * h[k] * x[k % n]).sum()
}

#[test]
fn accelerations_lie_within_what_their_residual_proves() {
    for scalar in BOTH {
        for file in ["panda.urdf", "ur5.urdf", "planar2r.urdf", "chapter_stanford.toml", "chapter_6r.toml"] {
            let case = case(file, false, Function::ForwardDynamics, scalar, 1.0);
            let (mut proven, mut all) = (0, 0);
            for state in states(&case.ranges, scalar, 40) {
                let truth: Vec<f64> = {
                    let inputs: Vec<Dd> = state.iter().map(|x| Dd::from(*x)).collect();
                    evaluate::<Dd>(&case.graph, &inputs).into_iter().map(Dd::to_f64).collect()
                };
                let computed = search::computed_at(&case.graph, scalar, &state);
                let n = computed.len();
                let mut small = 0.0;
                // as computed, and wrong by a little
                for wrong in [0.0, 1e-3, 0.1] {
                    let candidate: Vec<f64> = computed
                        .iter()
                        .enumerate()
                        .map(|(i, x)| x + wrong * [1.0, -0.5, 0.7][i % 3])
                        .map(|x| if scalar == Scalar::F32 { f64::from(x as f32) } else { x })
                        .collect();
                    let inputs = [state.clone(), candidate.clone()].concat();
                    let bounds = at(&case.bound, scalar, &inputs);
                    all += 1;
                    if bounds.iter().any(|b| b.is_nan()) {
                        continue;
                    }
                    proven += 1;
                    let errors: Vec<f64> = candidate.iter().zip(&truth).map(|(c, t)| (c - t).abs()).collect();
                    let what = format!("{file}, {scalar:?}, at {inputs:?}");
                    for k in 0..n {
                        assert!(errors[k] <= bounds[k], "{what}: {k}, {:e} > {:e}", errors[k], bounds[k]);
                    }
                    // an error a hundred times as large has a residual and a bound a hundred times as large
                    if wrong == 0.1 && scalar == Scalar::F64 {
                        let grown = bounds[0] / small;
                        assert!((99.0..101.0).contains(&grown), "{what}: {grown}");
                    }
                    small = bounds[0];
                    let nq = case.mass_matrix.inputs.iter().map(|p| p.len()).sum::<usize>();
                    let h = evaluate::<f64>(&case.mass_matrix, &state[..nq]);
                    let smallest = small_eigenvalue(&h, n);
                    assert!(
                        bounds[n] > 0.0 && bounds[n] <= smallest * (1.0 + 1e-9),
                        "{what}: {} > {smallest}",
                        bounds[n]
                    );
                    // Σ |H⁻¹_ij| ≤ n √n ‖H⁻¹‖₂
                    assert!(
                        scalar == Scalar::F32 || bounds[n] * (n as f64).powf(1.5) >= 0.9 * smallest,
                        "{what}: {}",
                        bounds[n]
                    );
                }
            }
            println!("{file}, {scalar:?}: {proven} of {all} proven");
            match scalar {
                Scalar::F64 => assert_eq!(proven, all, "{file}"),
                Scalar::F32 => assert!(2 * proven >= all, "{file}: {proven} of {all}"),
            }
        }
    }
}

/// The greatest of each output.
fn greatest(graph: &Graph, of_results: &[f64]) -> Vec<f64> {
    let mut first = 0;
    let of = graph.outputs.iter().map(|port| {
        let own = &of_results[first..first + port.len()];
        first += port.len();
        // NaN stays
        own.iter().fold(0.0f64, |most, x| if *x > most || x.is_nan() { *x } else { most })
    });
    of.collect()
}

/// Derivatives of accelerations are judged column by column, as they are found, and wrong by a little. On the Panda that says ten times more than
/// what its program may lose on its way.
#[test]
fn derivatives_of_accelerations_lie_within_what_their_columns_leave() {
    for (function, file) in [
        (Function::ForwardDynamicsDerivatives, "panda.urdf"),
        (Function::ForwardDynamicsDerivatives, "chapter_stanford.toml"),
        (Function::ForwardDynamicsDerivativesAtMotion, "ur5.urdf"),
    ] {
        for scalar in BOTH {
            let case = case(file, false, function, scalar, 1.0);
            let running = state_bound(&case.graph, scalar, Bits::Plain).expect("the program is short");
            let mut tighter: Vec<f64> = Vec::new();
            for state in states(&case.ranges, scalar, 8) {
                let exact: Vec<Dd> = state.iter().map(|x| Dd::from(*x)).collect();
                let exact = evaluate::<Dd>(&case.graph, &exact);
                let found = search::computed_at(&case.graph, scalar, &state);
                for wrong in [0.0, 1e-3, 0.1] {
                    let by = |k: usize| wrong * [1.0, -0.5, 0.7][k % 3];
                    let candidate = found.iter().enumerate().map(|(k, x)| scalar.nearest(Dd::from(x + by(k))));
                    let candidate: Vec<f64> = candidate.collect();
                    let bounds = at(&case.bound, scalar, &[state.clone(), candidate.clone()].concat());
                    for (k, (x, exact)) in candidate.iter().zip(&exact).enumerate() {
                        let error = (Dd::from(*x) - *exact).to_f64().abs();
                        assert!(error <= bounds[k], "{file}, {scalar:?}, {k}: {error:e} > {:e}", bounds[k]);
                    }
                    if wrong == 0.0 {
                        let [ours, others] = [&bounds, &at(&running, scalar, &state)].map(|b| greatest(&case.graph, b));
                        tighter.push(others[others.len() - 3] / ours[others.len() - 3]);
                    }
                }
            }
            tighter.sort_unstable_by(f64::total_cmp);
            println!("{file}, {}, {}: {tighter:.1?} times", function.name(), scalar.name());
            let least = if file == "panda.urdf" { 8.0 } else { 0.5 };
            assert!(tighter[tighter.len() / 2] >= least, "{file}: {tighter:?}");
        }
    }
}

/// A scene that wants parts of columns, or no accelerations, has bounds of what the program loses on its way, as has a robot whose equations are long.
#[test]
fn derivatives_in_parts_have_bounds_of_another_kind() {
    let is_by_columns = |case: &Case| case.bound.outputs.iter().any(|port| port.name == "smallest_eigenvalue");
    let function = Function::ForwardDynamicsDerivatives;
    assert!(is_by_columns(&case("planar2r.urdf", false, function, Scalar::F64, 1.0)));
    assert!(!is_by_columns(&case("solo12.urdf", true, function, Scalar::F64, 1.0)));
    assert!(!is_by_columns(&case("planar2r.urdf", false, Function::ForwardDynamicsJvp, Scalar::F64, 1.0)));
}

/// Of one joint ∂q̈/∂q̇ is zero, and without gravity ∂q̈/∂q, too: a bound has nothing to be small against.
#[test]
fn columns_that_are_zero_have_bounds() {
    let robot = "<robot name=\"one\"><link name=\"base\"/><link name=\"arm\"><inertial><origin xyz=\"0.1 0 0\"/><mass value=\"1.5\"/>\
                 <inertia ixx=\"0.01\" iyy=\"0.01\" izz=\"0.02\" ixy=\"0\" ixz=\"0\" iyz=\"0\"/></inertial></link>\
                 <joint name=\"turn\" type=\"continuous\"><parent link=\"base\"/><child link=\"arm\"/><axis xyz=\"0 1 0\"/></joint></robot>";
    let of = |scalar| [true, false].map(|gravity| (scalar, gravity, WrittenEntries::All));
    // packed, without the zeros
    let packed = [(Scalar::F64, true, WrittenEntries::Nonzeros)];
    for (scalar, gravity, entries) in BOTH.into_iter().flat_map(of).chain(packed) {
        let functions = vec![Function::ForwardDynamicsDerivatives];
        let certify = Some(Effort { companions: true, ..Effort::default() });
        let mut options = Options { scalar, functions, certify, entries, ..Options::default() };
        if !gravity {
            options.scene.gravity = Gravity::Constant([0.0; 3]);
        }
        let source = Source::new("one.urdf", robot);
        let generated = compile(&source, &options).unwrap_or_else(|errors| panic!("{errors}"));
        assert!(generated.text.contains("fn forward_dynamics_derivatives_error_bound("));
    }
}
