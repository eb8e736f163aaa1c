//! Derivatives of contact modes. Truth is the full system of all unknowns by the second author, in dual numbers over double-double: robots on surfaces of
//! every form, on every environment, sliding, sticking, with objects that move, on four feet and on two. Where the second author has no formulation (loops), it is
//! differences of the motion itself in double-double.

use crate::data::{inputs, numbers, reference_file};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use std::collections::BTreeMap;
use straightline_codegen::compile::compile;
use straightline_codegen::description;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::equations::Robot;
use straightline_codegen::expr::{evaluate, Graph, Port};
use straightline_codegen::function::ContactFunction;
use straightline_codegen::model::{self, ModelOptions};
use straightline_codegen::options::{scene_file, Options};
use straightline_codegen::program::contact::{graph, ClosedContact, Mode};
use straightline_codegen::scene::{
    self,
    contact::{tool_axes, EnvironmentKind, SurfaceItem},
};
use straightline_codegen::verify::reference_input::centre_of_mass_tree;
use straightline_core::contact::Coordinate;
use straightline_core::random::Random;
use straightline_core::reference::drives::solve_general;
use straightline_core::reference::{
    bias_force, functional_coordinate, mass_matrix, CentreOfMassTree, Component, ContactFrames, Derivatives,
    ReferenceReal,
};
use straightline_core::spatial::Vec3;
use straightline_core::{Dd, Dual, Real};

pub type Moving = Dual<Dd, 1>;
pub type State<T> = BTreeMap<String, Vec<T>>;

/// Errors of the greatest entry of a block, in double-double and in f64, where p is the least pivot: reactions keep (ε/p)² of their ridge ε, and lose the
/// digits that p costs.
pub fn allowed(pivot: f64) -> [f64; 2] {
    [1e-22 + 1e4 * (1e-12 / pivot) * (1e-12 / pivot), 1e-13 / pivot]
}

fn source(file: &str) -> Source {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../robots/descriptions").join(file);
    Source::new(file, std::fs::read_to_string(path).expect("a robot file"))
}

/// A robot in a scene.
pub struct Case {
    pub robot: Robot,
    tree: CentreOfMassTree<Dd>,
    pub options: Options,
}

impl Case {
    pub fn new(file: &str, floating_base: bool, scene: &str) -> Case {
        let source = source(file);
        let mut diagnostics = Diagnostics::new();
        let read = scene_file::read(&Source::new("scene.toml", scene), &mut diagnostics);
        // angles as they are written, for both authors
        let model = ModelOptions { floating_base, angle_tolerance: 0.0, ..ModelOptions::default() };
        let options = read
            .unwrap_or_else(|| panic!("{}", diagnostics.render()))
            .into_options(Options { model, ..Options::default() });
        let model = model::load(&source, &options.model).0.expect("a robot");
        let robot = Robot::new(scene::apply(model, &options.scene, &mut diagnostics).expect("a scene of this robot"));
        let description = description::read(&source, &mut diagnostics).expect("a robot");
        let tree = centre_of_mass_tree(&description, &options.model).expect("a tree");
        Case { robot, tree, options }
    }

    pub fn nv(&self) -> usize {
        self.robot.model.nv()
    }

    pub fn modes(&self) -> Vec<Mode<'_>> {
        Mode::all(&self.options.scene)
    }

    /// q + k-th increment of its tangent, to first order.
    pub fn increment(&self, q: &[Dd], k: usize) -> Vec<Dd> {
        let unit: Vec<Dd> = (0..self.nv()).map(|i| if i == k { Dd::ONE } else { Dd::ZERO }).collect();
        self.robot.model.configuration_rate(q, &unit)
    }

    /// Inputs of a mode's functions.
    pub fn state(&self, mode: &Mode, random: &mut Random) -> State<Dd> {
        let mut state = State::new();
        let mut add = |name: &str, x: Vec<f64>| state.insert(name.to_string(), x.into_iter().map(Dd::from).collect());
        let (nv, nq) = (self.nv(), self.robot.model.nq());
        add("q", list(random, nq, 1.2));
        add("qd", list(random, nv, 1.0));
        add("tau", list(random, nv, 20.0));
        add("restitution", vec![0.4]);
        for closed in &mode.contacts {
            let name = closed.item.identifier();
            let mut own = |what: &str, x: Vec<f64>| add(&format!("{name}_{what}"), x);
            own("own", list(random, 2, 0.125));
            own("struck", list(random, 1, 1.0));
            own("velocity", list(random, 6, 0.5));
            own("acceleration", list(random, 6, 1.0));
            let axes = [0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0];
            own("pose", [list(random, 3, 0.5), axes.to_vec()].concat());
        }
        let q = state.get_mut("q").expect("it is there");
        if self.robot.model.floats() {
            let length = q[3..7].iter().fold(Dd::ZERO, |sum, x| sum + *x * *x).sqrt();
            q[3..7].iter_mut().for_each(|x| *x /= length);
        }
        state
    }
}

pub fn list(random: &mut Random, n: usize, bound: f64) -> Vec<f64> {
    (0..n).map(|_| random.symmetric(bound)).collect()
}

/// The results of a program by name; inputs by name.
pub fn run<T: Real>(graph: &Graph, state: &State<T>) -> State<T> {
    let given: Vec<T> = graph.inputs.iter().flat_map(|port| state[&port.name].clone()).collect();
    let mut results = evaluate::<T>(graph, &given).into_iter();
    graph.outputs.iter().map(|port: &Port| (port.name.clone(), results.by_ref().take(port.len()).collect())).collect()
}

/// A row of the full system: G q̈ + c F = right, and the directions in which its reaction acts.
struct Row<T: ReferenceReal> {
    s: Derivatives<T>,
    applied: DVector<T>,
    /// Mass that moves with it and its load; `None`: rigid.
    yields: Option<(T, T)>,
    /// What is struck, with its velocity.
    struck: Option<(T, T)>,
    own_rate: Option<[T; 2]>,
}

fn vector<T: ReferenceReal>(x: &[T]) -> Vector3<T> {
    Vector3::new(x[0], x[1], x[2])
}

fn number<T: Real>(x: f64) -> T {
    T::constant(Dd::from(x))
}

fn frames_of<T: ReferenceReal>(
    tree: &CentreOfMassTree<T>,
    closed: &ClosedContact,
    state: &State<T>,
) -> ContactFrames<T> {
    let name = closed.item.identifier();
    let (axis, second): (Vec3<T>, Vec3<T>) = tool_axes(closed.item.axis.expect("axes are given"));
    let input = |what: &str| state[&format!("{name}_{what}")].clone();
    let (origin, axes, motion) = match closed.item.object {
        Some(pose) => {
            let pose = pose.over::<T>();
            let column = |k: usize| vector(&pose.rotation.column(k).to_array());
            let still = [(); 4].map(|()| Vector3::from_element(number(0.0)));
            (vector(&pose.translation.to_array()), [0, 1, 2].map(column), still)
        }
        None => {
            let (pose, v, a) = (input("pose"), input("velocity"), input("acceleration"));
            let axes = [1, 2, 3].map(|k| vector(&pose[3 * k..]));
            (vector(&pose), axes, [vector(&v), vector(&v[3..]), vector(&a), vector(&a[3..])])
        }
    };
    let radius = match closed.item.surface {
        SurfaceItem::Sphere { radius, .. } | SurfaceItem::Cylinder { radius, .. } => radius,
        _ => 0.0,
    };
    ContactFrames {
        frame: tree.frame(&closed.item.frame).expect("a frame").clone(),
        axes: [axis, second].map(|a| vector(&a.to_array())),
        origin,
        object: Matrix3::from_columns(&axes),
        motion,
        radius: number(radius),
    }
}

/// Mass and load at s, ṡ, and ė, ë of the object's own coordinate, as Figure 20.15 has them.
fn law<T: ReferenceReal>(kind: EnvironmentKind, v: &[T], (s, sd): (T, T), own: &[T]) -> ((T, T), Option<[T; 2]>) {
    let o = number(0.0);
    match kind {
        EnvironmentKind::Elastic => ((o, v[0] * s + v[1] * sd), None),
        EnvironmentKind::Mass => ((v[0], v[1] * s + v[2] * sd), None),
        EnvironmentKind::Cushioned | EnvironmentKind::TwoMasses => {
            let (e, ed) = (own[0], own[1]);
            let front = v[3] * (s - e) + v[4] * (sd - ed);
            let mass = if kind == EnvironmentKind::TwoMasses { v[5] } else { o };
            ((mass, front), Some([ed, (front - v[1] * e - v[2] * ed) / v[0]]))
        }
        EnvironmentKind::BothSides => {
            // the same force through tool and surface
            let e = own[0];
            let rate = (v[2] * (s - e) + v[3] * sd - v[0] * e) / (v[1] + v[3]);
            ((o, v[2] * (s - e) + v[3] * (sd - rate)), Some([rate, o]))
        }
    }
}

fn rows<T: ReferenceReal>(tree: &CentreOfMassTree<T>, mode: &Mode, state: &State<T>) -> Vec<Row<T>> {
    let mut rows = Vec::new();
    for closed in &mode.contacts {
        let (item, frames) = (closed.item, frames_of(tree, closed, state));
        let of = |component: Component| functional_coordinate(tree, &frames, &state["q"], &state["qd"], component);
        for coordinate in &closed.constrained {
            let s = of(match (coordinate, &item.surface) {
                (Coordinate::Px, _) => Component::Position(0),
                (Coordinate::Py, _) => Component::Position(1),
                (Coordinate::Pz, SurfaceItem::Sphere { .. }) => Component::Sphere,
                (Coordinate::Pz, SurfaceItem::Cylinder { .. }) => Component::Cylinder,
                (Coordinate::Pz, _) => Component::Position(2),
                (Coordinate::Ax, _) => Component::Axis(0),
                (Coordinate::Ay, _) => Component::Axis(1),
                (Coordinate::Az, _) => Component::SecondAxis(1),
            });
            let mut row = Row { applied: s.jacobian.clone(), s, yields: None, struck: None, own_rate: None };
            if *coordinate == Coordinate::Pz {
                if let Some((friction, speed)) = item.friction.filter(|_| closed.slides) {
                    // Ĵ = J − μ v/√(v² + w²) · J along the plane
                    let [x, y] = [0, 1].map(|k| of(Component::Position(k)));
                    let length = (x.sd * x.sd + y.sd * y.sd + number::<T>(speed) * number(speed)).sqrt();
                    let share = number::<T>(friction) / length;
                    row.applied -= x.jacobian * (share * x.sd) + y.jacobian * (share * y.sd);
                }
                if let Some(environment) = &item.environment {
                    let values = environment.values.as_ref().expect("they are given");
                    let values: Vec<T> = values.iter().map(|x| number(*x)).collect();
                    let name = item.identifier();
                    let (yields, own_rate) =
                        law(environment.kind, &values, (row.s.s, row.s.sd), &state[&format!("{name}_own")]);
                    let mass = match environment.kind {
                        EnvironmentKind::Mass => Some(values[0]),
                        EnvironmentKind::TwoMasses => Some(values[5]),
                        _ => None,
                    };
                    let velocity = state[&format!("{name}_struck")][0];
                    row.struck = Some(mass.map_or((number(0.0), number(0.0)), |mass| (mass, velocity)));
                    (row.yields, row.own_rate) = (Some(yields), own_rate);
                }
            }
            rows.push(row);
        }
    }
    rows
}

/// A x = b of all unknowns, and what goes beside.
struct System<T: ReferenceReal> {
    a: DMatrix<T>,
    b: DVector<T>,
    rows: Vec<Row<T>>,
}

/// (H −Ĵᵀ; m J or J, 1 or 0) of q̈ and F, or of Δq̇ and I.
fn system<T: ReferenceReal>(
    tree: &CentreOfMassTree<T>,
    case: &Case,
    mode: &Mode,
    state: &State<T>,
    is_impact: bool,
) -> System<T> {
    let (q, qd) = (&state["q"], &state["qd"]);
    let h = mass_matrix(tree, q);
    let rows = rows(tree, mode, state);
    let (n, m) = (tree.nv(), rows.len());
    let mut a = DMatrix::from_element(n + m, n + m, number::<T>(0.0));
    let mut b = DVector::from_element(n + m, number::<T>(0.0));
    a.view_mut((0, 0), (n, n)).copy_from(&h);
    if !is_impact {
        b.rows_mut(0, n).copy_from(&(DVector::from_column_slice(&state["tau"]) - bias_force(tree, q, qd)));
    }
    let one = number::<T>(1.0);
    for (i, row) in rows.iter().enumerate() {
        let yields = if is_impact { row.struck } else { row.yields };
        let weight = yields.map_or(one, |(mass, _)| mass);
        for j in 0..n {
            a[(j, n + i)] = -row.applied[j];
            a[(n + i, j)] = weight * row.s.jacobian[j];
        }
        if yields.is_some() {
            a[(n + i, n + i)] = one;
        }
        b[n + i] = match (is_impact, yields) {
            (true, _) => {
                -((one + state["restitution"][0]) * weight * (row.s.sd - yields.map_or(number(0.0), |(_, v)| v)))
            }
            (false, Some((mass, load))) => -(load + mass * row.s.adjoint),
            (false, None) => {
                let wanted = case.options.scene.contacts.stabilisation.map(|(frequency, damping)| {
                    let (w, d) = (number::<T>(frequency), number::<T>(damping));
                    -(number::<T>(2.0) * d * w * row.s.sd + w * w * row.s.s)
                });
                wanted.unwrap_or_else(|| number(0.0)) - row.s.adjoint
            }
        };
    }
    System { a, b, rows }
}

/// A state of which something moves at a rate.
fn moving(state: &State<Dd>, name: &str, rates: &[Dd]) -> State<Moving> {
    let of = |(key, x): (&String, &Vec<Dd>)| {
        let x = x.iter().enumerate();
        let rate = |i: usize| if key == name { rates[i] } else { Dd::ZERO };
        (key.clone(), x.map(|(i, x)| Dual { value: *x, derivatives: [rate(i)] }).collect())
    };
    state.iter().map(of).collect()
}

/// What the second author says of a mode: what is found, and a column per direction: of what is found, and of what goes beside.
struct Truth<'a> {
    case: &'a Case,
    mode: &'a Mode<'a>,
    state: &'a State<Dd>,
    is_impact: bool,
    found: Vec<Dd>,
}

impl<'a> Truth<'a> {
    fn new(case: &'a Case, mode: &'a Mode<'a>, state: &'a State<Dd>, is_impact: bool) -> Self {
        let at = system(&case.tree, case, mode, state, is_impact);
        let found = solve_general(at.a, at.b).as_slice().to_vec();
        Truth { case, mode, state, is_impact, found }
    }

    /// A dx = b' − A' x; of what goes beside ė and ë, or the velocities of what is struck.
    fn column(&self, name: &str, rates: &[Dd]) -> (Vec<Dd>, Vec<Dd>) {
        let Truth { case, mode, is_impact, .. } = *self;
        let state = moving(self.state, name, rates);
        let at = system(&case.tree.map(Moving::fixed), case, mode, &state, is_impact);
        let x = DVector::from_column_slice(&self.found);
        let right = at.b.map(|b| b.derivatives[0]) - at.a.map(|a| a.derivatives[0]) * &x;
        let change = solve_general(at.a.map(|a| a.value), right).as_slice().to_vec();
        let n = case.nv();
        let mut beside = Vec::new();
        for row in &at.rows {
            if !is_impact {
                beside.extend(row.own_rate.iter().flatten().map(|x| x.derivatives[0]));
            } else if let Some((_, velocity)) = row.struck.filter(|(mass, _)| mass.value != Dd::ZERO) {
                // ṡ + J Δq̇ + e (ṡ − ṡ_e)
                let dqd = (0..n).map(|j| Dual { value: self.found[j], derivatives: [change[j]] });
                let jump = row.s.jacobian.iter().zip(dqd).fold(row.s.sd, |sum, (j, x)| sum + *j * x);
                let after = jump + state["restitution"][0] * (row.s.sd - velocity);
                beside.push(after.derivatives[0]);
            }
        }
        (change, beside)
    }

    /// All columns by q, q̇ or τ.
    fn columns(&self, name: &str) -> Vec<(Vec<Dd>, Vec<Dd>)> {
        let n = self.case.nv();
        let unit = |k: usize| (0..n).map(|i| if i == k { Dd::ONE } else { Dd::ZERO }).collect::<Vec<Dd>>();
        let rates = |k: usize| if name == "q" { self.case.increment(&self.state["q"], k) } else { unit(k) };
        (0..n).map(|k| self.column(name, &rates(k))).collect()
    }
}

/// Rows `from..to` of columns, row-major.
fn block(columns: &[Vec<Dd>], rows: std::ops::Range<usize>) -> Vec<Dd> {
    rows.flat_map(|i| columns.iter().map(move |column| column[i])).collect()
}

/// The expected blocks of a function.
fn expected(truth: &Truth) -> State<Dd> {
    let (n, m) = (truth.case.nv(), truth.mode.constrained_names().len());
    let mut all = State::new();
    let names = match truth.is_impact {
        false => ["qdd", "force", "dqdd_d", "dforce_d", "own", "own_rate"],
        true => ["", "impulse", "dqd_after_d", "dimpulse_d", "struck", "struck_after"],
    };
    let [found, force, by, force_by, own, beside] = names;
    if truth.is_impact {
        let after = truth.state["qd"].iter().zip(&truth.found).map(|(a, b)| *a + *b);
        all.insert("qd_after".into(), after.collect());
    } else {
        all.insert(found.into(), truth.found[..n].to_vec());
    }
    all.insert(force.into(), truth.found[n..].to_vec());
    let owners: Vec<String> = truth
        .mode
        .contacts
        .iter()
        .filter(|c| {
            let kind = c.item.environment.as_ref().map(|e| e.kind);
            use EnvironmentKind::{BothSides, Cushioned, Mass, TwoMasses};
            match truth.is_impact {
                true => matches!(kind, Some(Mass | TwoMasses)),
                false => matches!(kind, Some(Cushioned | TwoMasses | BothSides)),
            }
        })
        .map(|c| c.item.identifier())
        .collect();
    let each = if truth.is_impact { 1 } else { 2 };
    for name in if truth.is_impact { vec!["q", "qd"] } else { vec!["q", "qd", "tau"] } {
        let (mut columns, others): (Vec<_>, Vec<_>) = truth.columns(name).into_iter().unzip();
        if truth.is_impact && name == "qd" {
            columns.iter_mut().enumerate().for_each(|(k, column)| column[k] += Dd::ONE);
        }
        all.insert(format!("{by}{name}"), block(&columns, 0..n));
        all.insert(format!("{force_by}{name}"), block(&columns, n..n + m));
        for (c, owner) in owners.iter().enumerate().filter(|_| name != "tau") {
            all.insert(format!("d{owner}_{beside}_d{name}"), block(&others, each * c..each * (c + 1)));
        }
    }
    let mut by_masses = vec![Vec::new(); owners.len()];
    for (c, owner) in owners.iter().enumerate() {
        let port = format!("{owner}_{own}");
        let unit = |k: usize| (0..each).map(|i| if i == k { Dd::ONE } else { Dd::ZERO }).collect::<Vec<Dd>>();
        let (columns, others): (Vec<_>, Vec<_>) = (0..each).map(|k| truth.column(&port, &unit(k))).unzip();
        all.insert(format!("{by}{port}"), block(&columns, 0..n));
        all.insert(format!("{force_by}{port}"), block(&columns, n..n + m));
        match truth.is_impact {
            false => {
                all.insert(format!("d{owner}_{beside}_d{own}"), block(&others, each * c..each * (c + 1)));
            }
            true => by_masses.iter_mut().zip(&others[0]).for_each(|(list, x)| list.push(*x)),
        }
    }
    if truth.is_impact {
        for (owner, list) in owners.iter().zip(by_masses) {
            all.insert(format!("d{owner}_{beside}_d{own}"), list);
        }
    }
    all
}

pub fn greatest<'a>(list: impl IntoIterator<Item = &'a Dd>) -> f64 {
    list.into_iter().fold(0.0, |most: f64, x| most.max(x.abs().hi()))
}

/// Every block of a function against the second author, in double-double and in f64.
fn hold(case: &Case, function: ContactFunction, states: usize) {
    let (mut random, mut failures) = (Random(8), Vec::new());
    for mode in &case.modes() {
        let (mut worst, mut least) = ([0.0f64; 2], 1.0f64);
        let program = graph(&case.robot, &case.options, mode, function);
        for _ in 0..states {
            let state = case.state(mode, &mut random);
            let truth = Truth::new(case, mode, &state, function == ContactFunction::ImpactDerivatives);
            let expected = expected(&truth);
            let narrow: State<f64> =
                state.iter().map(|(k, x)| (k.clone(), x.iter().map(|x| x.to_f64()).collect())).collect();
            let (wide, narrow) = (run::<Dd>(&program, &state), run::<f64>(&program, &narrow));
            let (mut seen, pivot) = (0, wide["pivot"][0].hi());
            least = least.min(pivot);
            for (name, found) in &wide {
                if name == "pivot" || name.ends_with("_own_rate") || name.ends_with("_struck_after") {
                    continue;
                }
                let truth = &expected[name];
                seen += 1;
                assert_eq!(found.len(), truth.len(), "{name}");
                // what vanishes by its equations is judged by the block of reactions that it belongs to
                let family = ["dforce", "dimpulse"].into_iter().find(|f| name.starts_with(f));
                let others = expected.iter().filter(|(k, _)| family.is_some_and(|f| k.starts_with(f)));
                let size = others.map(|(_, x)| greatest(x)).fold(greatest(truth).max(1.0), f64::max);
                for (i, truth) in truth.iter().enumerate() {
                    let off = [found[i], Dd::from(narrow[name][i])].map(|x| (x - *truth).abs().hi() / size);
                    for (k, bound) in allowed(pivot).into_iter().enumerate() {
                        if off[k].is_nan() || off[k] > bound {
                            failures.push(format!(
                                "{} {} {name}[{i}]: {} for {}, {:.1e} of {size:.1e}, pivot {pivot:.1e}",
                                mode.name,
                                function.name(),
                                found[i].hi(),
                                truth.hi(),
                                off[k]
                            ));
                        }
                        worst[k] = worst[k].max(off[k]);
                    }
                }
            }
            assert_eq!(seen, expected.len(), "every block of the truth is there");
        }
        println!(
            "{:<30} {:<16} {:6} operations, {:.1e} and in f64 {:.1e} of the greatest entries, least pivot {least:.1e}",
            function.name(),
            mode.name,
            program.counts().flops(),
            worst[0],
            worst[1]
        );
    }
    assert!(failures.is_empty(), "{} are off:\n{}", failures.len(), failures[..failures.len().min(40)].join("\n"));
}

pub const OBJECT: &str = "object = { origin = [0.5, 0.1, 0.2], z = [0.1, 0.2, 1.0] }";

pub fn contact(name: &str, frame: &str, more: &str) -> String {
    format!("[[contact]]\nname = \"{name}\"\nframe = \"{frame}\"\n{more}\n")
}

const BOTH: [ContactFunction; 2] = [ContactFunction::ForwardDynamicsDerivatives, ContactFunction::ImpactDerivatives];

/// The second author on every form of a contact of an arm.
#[test]
fn derivatives_of_a_contact_of_an_arm_are_those_of_the_full_system() {
    let mut scene = String::from("[outputs]\nfunctions = []\n");
    let held = |kind: &str, more: &str| {
        format!("{OBJECT}\nconstrained = [\"pz\"]\nenvironment = {{ kind = \"{kind}\", stiffness = 500, damping = 12, {more} }}")
    };
    let front = "mass = 1.5, front_stiffness = 800, front_damping = 7";
    for (name, more) in [
        ("plane", format!("{OBJECT}\nconstrained = [\"pz\"]")),
        ("moved", "object = \"input\"\nconstrained = [\"px\", \"pz\"]".to_string()),
        ("peg", format!("{OBJECT}\naxis = [0.3, -0.2, 0.9]\nconstrained = [\"px\", \"py\", \"ax\", \"ay\"]")),
        ("weld", format!("{OBJECT}\nconstrained = [\"px\", \"py\", \"pz\", \"ax\", \"ay\", \"az\"]")),
        ("ball", format!("{OBJECT}\nconstrained = [\"pz\"]\nsurface = {{ kind = \"sphere\", radius = 0.25 }}")),
        ("rod", format!("{OBJECT}\nconstrained = [\"pz\"]\nsurface = {{ kind = \"cylinder\", radius = 0.25 }}")),
        ("rough", format!("{OBJECT}\nconstrained = [\"pz\"]\nfriction = {{ coefficient = 0.375, speed = 0.25 }}")),
        ("elastic", format!("{OBJECT}\nconstrained = [\"pz\"]\nenvironment = {{ kind = \"elastic\", stiffness = 500, damping = 12 }}")),
        ("mass", held("mass", "mass = 1.5")),
        ("cushioned", held("cushioned", front)),
        ("two_masses", held("two_masses", &format!("{front}, front_mass = 0.25"))),
        ("both_sides", held("both_sides", "tool_stiffness = 800, tool_damping = 7")),
    ] {
        scene += &contact(name, "tool0", &more);
    }
    scene += "[[mode]]\nname = \"sticking\"\ncontacts = [\"rough\"]\nsticking = [\"rough\"]\n";
    scene += "[[mode]]\nname = \"two on masses\"\ncontacts = [\"elbow\", \"mass\"]\n";
    scene += &contact("elbow", "forearm_link", &held("two_masses", &format!("{front}, front_mass = 0.25")));
    for name in [
        "plane",
        "moved",
        "peg",
        "weld",
        "ball",
        "rod",
        "rough",
        "elastic",
        "mass",
        "cushioned",
        "two_masses",
        "both_sides",
    ] {
        scene += &format!("[[mode]]\nname = \"{name}\"\ncontacts = [\"{name}\"]\n");
    }
    let case = Case::new("ur5.urdf", false, &scene);
    for function in BOTH {
        hold(&case, function, 1);
    }
}

/// A drift that is pulled back, of rows that are held and of rows that stick.
#[test]
fn derivatives_know_the_stabilisation() {
    let held = format!("{OBJECT}\nconstrained = [\"px\", \"pz\", \"ax\"]");
    let scene =
        format!("[outputs]\nfunctions = []\n{}[stabilisation]\nfrequency = 40.0\n", contact("pen", "tool0", &held));
    let case = Case::new("ur5.urdf", false, &scene);
    hold(&case, ContactFunction::ForwardDynamicsDerivatives, 2);
}

/// Solo12 on all feet that stick, on two, and on two of which one slides; a slope, and a hand on an elastic wall.
const STANDING: [&str; 4] = ["FL", "FR", "HL", "HR"];

fn standing() -> String {
    let mut scene = String::from("[outputs]\nfunctions = []\n");
    for name in STANDING {
        let ground = "object = { origin = [0.0, 0.0, 0.0], z = [0.05, 0.0, 1.0] }\nconstrained = [\"pz\"]\nfriction = { coefficient = 0.6, speed = 0.25 }";
        scene += &contact(name, &format!("{name}_FOOT"), ground);
    }
    let list = |names: &[&str]| names.iter().map(|n| format!("\"{n}\"")).collect::<Vec<_>>().join(", ");
    for (name, closed, sticking) in [
        ("all", &STANDING[..], &STANDING[..]),
        ("two", &STANDING[1..3], &STANDING[1..3]),
        ("sliding", &STANDING[..2], &STANDING[..1]),
    ] {
        scene +=
            &format!("[[mode]]\nname = \"{name}\"\ncontacts = [{}]\nsticking = [{}]\n", list(closed), list(sticking));
    }
    scene
}

#[test]
#[ignore = "slow proof: programs of some ten thousand operations are searched"]
fn slow_proof_that_derivatives_of_a_robot_on_its_feet_are_those_of_the_full_system() {
    let case = Case::new("solo12.urdf", true, &standing());
    for function in BOTH {
        hold(&case, function, 1);
    }
}

/// By q̈ = dq̈/dτ τ + …: J ∂q̈/∂τ = 0, H ∂q̈/∂τ − Jᵀ ∂F/∂τ = 1, and ∂q̈/∂τ is symmetric; sliding it is not.
#[test]
fn derivatives_by_forces_keep_the_constraints() {
    let case = Case::new("solo12.urdf", true, &standing());
    let (n, mut random) = (case.nv(), Random(5));
    for mode in &case.modes() {
        let state = case.state(mode, &mut random);
        let found =
            run::<Dd>(&graph(&case.robot, &case.options, mode, ContactFunction::ForwardDynamicsDerivatives), &state);
        let rows = rows(&case.tree, mode, &state);
        let h = mass_matrix(&case.tree, &state["q"]);
        let (by, force_by, pivot) = (&found["dqdd_dtau"], &found["dforce_dtau"], found["pivot"][0].hi());
        let most = greatest(by);
        let mut asymmetry = 0.0f64;
        for k in 0..n {
            for row in &rows {
                let moved = (0..n).fold(Dd::ZERO, |sum, i| sum + row.s.jacobian[i] * by[i * n + k]);
                assert!(moved.abs().hi() <= allowed(pivot)[0] * most, "{}: {moved:?}", mode.name);
            }
            for i in 0..n {
                let left = (0..n).fold(Dd::ZERO, |sum, j| sum + h[(i, j)] * by[j * n + k]);
                let pushed =
                    rows.iter().enumerate().fold(left, |sum, (r, row)| sum - row.applied[i] * force_by[r * n + k]);
                let one = if i == k { Dd::ONE } else { Dd::ZERO };
                assert!((pushed - one).abs().hi() <= 1e-22 * most, "{}: {i} {k} {pushed:?}", mode.name);
                asymmetry = asymmetry.max((by[i * n + k] - by[k * n + i]).abs().hi() / most);
            }
        }
        assert_eq!(mode.name == "sliding", asymmetry > 1e-6, "{}: {asymmetry:e}", mode.name);
        assert!(mode.name == "sliding" || asymmetry < 1e-28, "{asymmetry:e}");
    }
}

/// Where the second author has no formulation: differences of the motion in double-double, of an arm whose hand is held to its own elbow while it slides,
/// and of one whose drives have rotors that turn in space with its links.
#[test]
fn derivatives_are_differences_of_the_motion() {
    let sliding = contact(
        "pen",
        "forearm_link",
        &format!("{OBJECT}\nconstrained = [\"pz\"]\nfriction = {{ coefficient = 0.3, speed = 0.125 }}"),
    );
    let held = "[[loop]]\nname = \"rod\"\nframe = \"tool0\"\nwith = \"upper_arm_link\"\nconstrained = [\"px\", \"pz\", \"ay\"]\n\
                [stabilisation]\nfrequency = 15.0\n";
    let drives: String = [("elbow_joint", "upper_arm_link"), ("wrist_1_joint", "forearm_link")]
        .map(|(joint, link)| {
            format!(
                "[[drive]]\njoint = \"{joint}\"\nratio = 50.0\nmotor = {{ torque_constant = 0.05, resistance = 1.2, rotor_inertia = 1e-4 }}\n\
                 rotor = {{ link = \"{link}\", axis = [0.3, 0.1, 0.9], inertia = 2e-3 }}\n"
            )
        })
        .concat();
    for (more, functions) in [(held.to_string(), &DIFFERENCES[..]), (drives, &DIFFERENCES[1..])] {
        let scene = format!("[outputs]\nfunctions = []\n{sliding}{more}");
        hold_differences(&Case::new("ur5.urdf", false, &scene), functions);
    }
}

/// Derivatives, what they are of, and by what.
type Difference = (ContactFunction, ContactFunction, &'static [&'static str]);

const DIFFERENCES: [Difference; 2] = [
    (ContactFunction::ForwardDynamicsDerivatives, ContactFunction::ForwardDynamics, &["q", "qd", "tau"]),
    (ContactFunction::ImpactDerivatives, ContactFunction::Impact, &["q", "qd"]),
];

fn hold_differences(case: &Case, functions: &[Difference]) {
    let (modes, mut random) = (case.modes(), Random(3));
    let mode = &modes[0];
    let state = case.state(mode, &mut random);
    for &(of_derivatives, of_motion, names) in functions {
        let [derivatives, motion] = [of_derivatives, of_motion].map(|f| graph(&case.robot, &case.options, mode, f));
        let found = run::<Dd>(&derivatives, &state);
        let is_impact = of_motion == ContactFunction::Impact;
        let ports = if is_impact {
            [("dqd", "dqd_after_d"), ("impulse", "dimpulse_d")]
        } else {
            [("qdd", "dqdd_d"), ("force", "dforce_d")]
        };
        let step = Dd::from(1e-9);
        for &name in names {
            for k in 0..case.nv() {
                let [ahead, behind] = [step, -step].map(|by| {
                    let mut state = state.clone();
                    state.get_mut(name).expect("an input")[k] += by;
                    run::<Dd>(&motion, &state)
                });
                for (port, block) in ports {
                    let list = &found[&format!("{block}{name}")];
                    let n = case.nv();
                    let most = greatest(list);
                    for (i, (a, b)) in ahead[port].iter().zip(&behind[port]).enumerate() {
                        let own = if port == "dqd" && name == "qd" && i == k { Dd::ONE } else { Dd::ZERO };
                        let difference = (*a - *b) / (step + step) + own;
                        let off = (list[i * n + k] - difference).abs().hi() / most;
                        assert!(off < 1e-12, "{block}{name} {i} {k}: {} for {}", list[i * n + k].hi(), difference.hi());
                    }
                }
            }
        }
    }
}

/// Of the greatest entry of a block with 25 digits.
const DATA: f64 = 1e-22;
/// What f64 may lose of a block: where a plane is known to 16 digits, and H is solved for.
const DATA_F64: f64 = 5e-14;

/// The data's planes, at all of their states.
#[test]
fn derivatives_on_a_plane_are_those_of_the_data() {
    for name in ["panda", "ur5"] {
        let path = reference_file(&format!("derivatives/{name}.json"));
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let data: serde_json::Value = serde_json::from_str(&text).expect("the data are JSON");
        let states = data["states"].as_array().expect("a list");
        let frame = states[0]["contact"]["frame"].as_str().expect("a name");
        let plane = contact("plane", frame, "object = \"input\"\nconstrained = [\"pz\"]");
        let scene = format!("[outputs]\nfunctions = []\n[hold]\ngravity = \"input\"\n{plane}");
        let case = Case::new(&format!("{name}.urdf"), false, &scene);
        let modes = case.modes();
        let program = graph(&case.robot, &case.options, &modes[0], ContactFunction::ForwardDynamicsDerivatives);
        let (mut worst, mut failures) = ([0.0f64; 2], Vec::new());
        for state in states {
            let of = &state["contact"];
            let normal = Vector3::from_column_slice(&inputs(&of["normal"]));
            let z = normal / normal.dot(&normal).sqrt();
            let across = Vector3::new(-z[1], z[0], Dd::ZERO);
            let x = across / across.dot(&across).sqrt();
            let y = z.cross(&x);
            let pose: Vec<Dd> =
                [inputs(&of["origin"]), x.as_slice().to_vec(), y.as_slice().to_vec(), z.as_slice().to_vec()].concat();
            let mut given: State<Dd> =
                ["q", "qd", "tau", "gravity"].map(|key| (key.to_string(), inputs(&state[key]))).into();
            given.insert("plane_pose".into(), pose);
            given.insert("plane_velocity".into(), vec![Dd::ZERO; 6]);
            given.insert("plane_acceleration".into(), vec![Dd::ZERO; 6]);
            let narrow: State<f64> =
                given.iter().map(|(k, x)| (k.clone(), x.iter().map(|x| x.to_f64()).collect())).collect();
            let (wide, narrow) = (run::<Dd>(&program, &given), run::<f64>(&program, &narrow));
            for (block, ours) in [
                ("qdd", "qdd"),
                ("F", "force"),
                ("dqdd_dq", "dqdd_dq"),
                ("dqdd_dqd", "dqdd_dqd"),
                ("dqdd_dtau", "dqdd_dtau"),
                ("dF_dq", "dforce_dq"),
                ("dF_dqd", "dforce_dqd"),
                ("dF_dtau", "dforce_dtau"),
            ] {
                let expected = numbers(&of[block]);
                assert_eq!(expected.len(), wide[ours].len(), "{block}");
                let size = greatest(&expected);
                for (i, expected) in expected.iter().enumerate() {
                    let off = [wide[ours][i], Dd::from(narrow[ours][i])].map(|x| (x - *expected).abs().hi() / size);
                    let place = format!("{name} {} {block}[{i}]", state["id"]);
                    if off[0].is_nan() || off[1].is_nan() || off[0] > DATA || off[1] > DATA_F64 {
                        failures.push(format!(
                            "{place}: {} for {}, {:.1e}, {:.1e}",
                            wide[ours][i].hi(),
                            expected.hi(),
                            off[0],
                            off[1]
                        ));
                    }
                    worst = [worst[0].max(off[0]), worst[1].max(off[1])];
                }
            }
        }
        let operations = program.counts().flops();
        println!(
            "{name}: {operations} operations, {:.1e} and in f64 {:.1e} of the greatest entries",
            worst[0], worst[1]
        );
        assert!(failures.is_empty(), "{} are off:\n{}", failures.len(), failures[..failures.len().min(40)].join("\n"));
    }
}

/// Operations of motion and of impact, by mode.
fn operations(file: &str, floating_base: bool, contacts: &str) -> Vec<usize> {
    let scene = format!(
        "[outputs]\nfunctions = []\ncontact = [\"forward_dynamics_derivatives\", \"impact_derivatives\"]\n{contacts}"
    );
    let mut diagnostics = Diagnostics::new();
    let read = scene_file::read(&Source::new("scene.toml", scene), &mut diagnostics).expect("a scene");
    let model = ModelOptions { floating_base, ..ModelOptions::default() };
    let options = read.into_options(Options { model, ..Options::default() });
    let generated = compile(&source(file), &options).unwrap_or_else(|d| panic!("{}", d.render()));
    let found: Vec<usize> = generated.report.contact.iter().map(|c| c.counts.flops()).collect();
    println!("{file:<12} {found:?}");
    found
}

/// Of a hand on a table.
#[test]
fn derivatives_on_a_table_take_what_is_on_record() {
    let table = |frame: &str| {
        contact("table", frame, "object = { origin = [0.5, 0.1, 0.2], z = [0.0, 0.0, 1.0] }\nconstrained = [\"pz\"]")
    };
    assert_eq!(operations("ur5.urdf", false, &table("tool0")), [2592, 1338]);
    assert_eq!(operations("panda.urdf", false, &table("panda_hand_tcp")), [5789, 2846]);
}

/// Of a quadruped on all feet, and on two.
#[test]
#[ignore = "slow proof: programs of some ten thousand operations are searched"]
fn slow_proof_that_derivatives_on_feet_take_what_is_on_record() {
    let ground = "object = { origin = [0.0, 0.0, 0.0], z = [0.0, 0.0, 1.0] }\nconstrained = [\"px\", \"py\", \"pz\"]";
    let standing = |names: [&str; 4], foot: &dyn Fn(&str) -> String| {
        let feet: String = names.iter().map(|name| contact(name, &foot(name), ground)).collect();
        let [first, .., last] = names;
        format!(
            "{feet}[[mode]]\nname = \"standing\"\ncontacts = {names:?}\n[[mode]]\nname = \"trot\"\ncontacts = [{first:?}, {last:?}]\n"
        )
    };
    let solo = standing(["FL", "FR", "HL", "HR"], &|name| format!("{name}_FOOT"));
    assert_eq!(operations("solo12.urdf", true, &solo), [73739, 45666, 37959, 20010]);
    let hyq = standing(["lf", "rf", "lh", "rh"], &|name| format!("{name}_foot"));
    assert_eq!(operations("hyq.urdf", true, &hyq), [76745, 47091, 40929, 21399]);
}
