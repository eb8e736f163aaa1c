//! Programs that are kept in a folder: the same bits, faster, and never what somebody else has put there.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use straightline_codegen::choices::OptimisationTier;
use straightline_codegen::diagnostic::Source;
use straightline_codegen::options::Options;
use straightline_codegen::program::stored::ProgramStore;
use straightline_codegen::Function;
use straightline_core::Dd;
use straightline_graph::expr::{Constant, Graph, NodeId, Op};
use straightline_jit::{ExecutionMode, ProgramFolder, Robot};

const UR5: &str = include_str!("../../../robots/descriptions/ur5.urdf");
const FUNCTIONS: [Function; 3] = [Function::InverseDynamics, Function::ForwardDynamics, Function::ForwardKinematics];

/// What is done to something.
type Change<T> = fn(&mut T);

fn source() -> Source {
    Source::new("ur5.urdf", UR5)
}

fn options() -> Options {
    Options { functions: FUNCTIONS.to_vec(), ..Options::default() }
}

fn loaded(store: &dyn ProgramStore, options: &Options) -> Robot<f64> {
    Robot::load_by(&source(), options, ExecutionMode::best(), store).unwrap_or_else(|e| panic!("{e}"))
}

/// All results at a state.
fn bits(robot: &Robot<f64>) -> Vec<u64> {
    let mut all = Vec::new();
    for function in robot.functions() {
        let numbers =
            |k: usize, length: usize| (0..length).map(|i| ((3 * k + i) as f64 * 0.7).sin()).collect::<Vec<f64>>();
        let inputs: Vec<Vec<f64>> = function.inputs().iter().enumerate().map(|(k, p)| numbers(k, p.len())).collect();
        let inputs: Vec<&[f64]> = inputs.iter().map(Vec::as_slice).collect();
        let mut results: Vec<Vec<f64>> = function.outputs().iter().map(|p| vec![0.0; p.len()]).collect();
        let mut places: Vec<&mut [f64]> = results.iter_mut().map(Vec::as_mut_slice).collect();
        function.call(&inputs, &mut places).unwrap_or_else(|e| panic!("{e}"));
        all.extend(results.into_iter().flatten().map(f64::to_bits));
    }
    all
}

/// What is in the folder, sorted.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut all: Vec<PathBuf> =
        fs::read_dir(folder).into_iter().flatten().map(|entry| entry.expect("it is there").path()).collect();
    all.sort();
    all
}

/// Counts what is found, and what is kept.
struct Watched {
    folder: ProgramFolder,
    found: Mutex<Vec<u64>>,
    kept: Mutex<Vec<u64>>,
}

impl Watched {
    fn new(folder: &Path) -> Watched {
        Watched { folder: ProgramFolder::new(folder), found: Mutex::default(), kept: Mutex::default() }
    }

    /// How many programs were found and kept since.
    fn counts(&self) -> [usize; 2] {
        [&self.found, &self.kept].map(|list| std::mem::take(&mut *list.lock().expect("no thread panics")).len())
    }
}

impl ProgramStore for Watched {
    fn find(&self, key: u64) -> Option<Graph> {
        let found = self.folder.find(key)?;
        self.found.lock().expect("no thread panics").push(key);
        Some(found)
    }

    fn keep(&self, key: u64, graph: &Graph) {
        self.folder.keep(key, graph);
        self.kept.lock().expect("no thread panics").push(key);
    }
}

#[test]
fn a_second_start_finds_every_program_and_has_the_same_bits() {
    let folder = tempfile::tempdir().expect("a folder");
    // made when it is needed
    let store = Watched::new(&folder.path().join("programs"));
    let first = bits(&loaded(&store, &options()));
    assert_eq!(store.counts(), [0, 3]);
    assert_eq!(files(store.folder.path()).len(), 3, "and nothing half-written");
    assert_eq!(bits(&loaded(&store, &options())), first);
    assert_eq!(store.counts(), [3, 0]);
    // functions by themselves are the same programs
    let alone = Options { functions: vec![Function::ForwardKinematics], ..options() };
    loaded(&store, &alone);
    assert_eq!(store.counts(), [1, 0]);
    // other robots and other options are others
    let other = Options {
        model: straightline_codegen::model::ModelOptions { gravity: Some([0.0; 3]), ..Default::default() },
        ..alone.clone()
    };
    loaded(&store, &other);
    assert_eq!(store.counts(), [0, 1]);
    let heavier = UR5.replacen("<mass value=\"", "<mass value=\"1", 1);
    assert_ne!(heavier, UR5);
    Robot::<f64>::load_by(&Source::new("ur5.urdf", &heavier), &alone, ExecutionMode::best(), &store)
        .expect("it is a robot");
    assert_eq!(store.counts(), [0, 1]);
    Robot::<f32>::load_by(&source(), &alone, ExecutionMode::best(), &store).expect("it is a robot");
    assert_eq!(store.counts(), [0, 1]);
}

#[test]
fn the_quick_tier_is_neither_kept_nor_found() {
    let folder = tempfile::tempdir().expect("a folder");
    let store = Watched::new(folder.path());
    let full = bits(&loaded(&store, &options()));
    store.counts();
    let quick = Options { optimise: OptimisationTier::Quick, ..options() };
    let quickly = loaded(&store, &quick);
    assert_eq!(store.counts(), [0, 0]);
    assert_ne!(bits(&quickly), full, "another tier has other bits");
    let [fewer, more] = [loaded(&store, &options()), quickly].map(|robot| robot.functions()[0].counts().flops());
    assert!(fewer < more, "{fewer} {more}");
}

#[test]
fn what_is_damaged_is_thrown_away_and_made_again() {
    let folder = tempfile::tempdir().expect("a folder");
    let store = Watched::new(folder.path());
    let alone = Options { functions: vec![Function::InverseDynamics], ..options() };
    let wanted = bits(&loaded(&store, &alone));
    let file = files(folder.path()).remove(0);
    let whole = fs::read(&file).expect("it is there");
    let damages: [Change<Vec<u8>>; 5] = [
        Vec::clear,
        |bytes| bytes.truncate(bytes.len() / 2),
        |bytes| bytes[40] ^= 1,
        |bytes| *bytes.last_mut().expect("it has bytes") ^= 0x80,
        |bytes| bytes.fill(0xFF),
    ];
    for damage in damages {
        let mut bytes = whole.clone();
        damage(&mut bytes);
        fs::write(&file, &bytes).expect("it can be written");
        store.counts();
        assert_eq!(bits(&loaded(&store, &alone)), wanted);
        assert_eq!(store.counts(), [0, 1]);
        assert!(fs::read(&file).expect("it is there") == whole, "what is made again is the same");
    }
    // of another robot, under this name
    let other = ProgramFolder::new(folder.path());
    let elsewhere = file.with_file_name("0000000000000001.straightline");
    fs::write(&elsewhere, &whole).expect("it can be written");
    assert!(other.find(1).is_none());
    assert!(!elsewhere.exists(), "it is thrown away");
}

/// A store that gives something else than what was made.
struct Tampered {
    graph: Mutex<Option<Graph>>,
    with: Change<Graph>,
}

impl ProgramStore for Tampered {
    fn find(&self, _: u64) -> Option<Graph> {
        let mut graph = self.graph.lock().expect("no thread panics").clone()?;
        (self.with)(&mut graph);
        Some(graph)
    }

    fn keep(&self, _: u64, graph: &Graph) {
        *self.graph.lock().expect("no thread panics") = Some(graph.clone());
    }
}

/// Whoever can write into the folder can write checksums, too: what is found is checked against the equations of the robot.
#[test]
fn what_was_tampered_with_is_not_taken() {
    let alone = Options { functions: vec![Function::InverseDynamics], ..options() };
    let tampered: [(&str, Change<Graph>); 8] = [
        ("a constant", |graph| {
            let a_constant = |op: &&mut Op| matches!(op, Op::Constant(c) if c.value().hi().abs() > 1e-3);
            let op = graph.ops.iter_mut().find(a_constant).expect("there are constants");
            let Op::Constant(c) = *op else { unreachable!("it is one") };
            *op = Op::Constant(Constant::new(c.value() * Dd::from(1.0 + 1e-12)));
        }),
        ("an operation", |graph| {
            let last = graph.results[3].index();
            graph.ops[last] = graph.ops[last].map(|_| NodeId(0));
        }),
        ("results", |graph| graph.results.swap(1, 2)),
        ("a result less", |graph| {
            graph.results.pop();
        }),
        ("an operand behind its user", |graph| {
            let last = NodeId(graph.ops.len() as u32 - 1);
            let first = graph.ops.iter_mut().find(|op| !op.is_leaf()).expect("there are operations");
            *first = first.map(|_| last);
        }),
        ("an input that there is not", |graph| graph.ops[0] = Op::Input(1000)),
        ("other inputs", |graph| graph.inputs.swap(0, 2)),
        ("a result of another name", |graph| graph.outputs[0].name = "h".to_string()),
    ];
    let honest = Tampered { graph: Mutex::default(), with: |_| () };
    let wanted = bits(&loaded(&honest, &alone));
    for (what, with) in tampered {
        let graph = honest.graph.lock().expect("no thread panics").clone();
        let store = Tampered { graph: Mutex::new(graph.clone()), with };
        assert_ne!(store.find(0), graph, "{what} is not what was kept");
        assert_eq!(bits(&loaded(&store, &alone)), wanted, "{what}");
    }
}

/// As on a full disk, or where nothing may be written.
#[test]
fn without_a_folder_programs_are_made_each_time() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    fs::write(&file, "not a folder").expect("it can be written");
    let store = Watched::new(&file.join("programs"));
    let wanted = bits(&loaded(&store, &options()));
    assert_eq!(bits(&loaded(&store, &options())), wanted);
    assert_eq!(store.counts(), [0, 6]);
    assert_eq!(fs::read_to_string(&file).expect("it is left as it is"), "not a folder");
}

/// Threads stand for processes: what is in the folder is whole at any time.
#[test]
fn several_may_share_a_folder() {
    let folder = tempfile::tempdir().expect("a folder");
    let alone = Options { functions: vec![Function::ForwardKinematics], ..options() };
    let all: Vec<Vec<u64>> = std::thread::scope(|scope| {
        let load = || (0..8).map(|_| bits(&loaded(&ProgramFolder::new(folder.path()), &alone))).collect::<Vec<_>>();
        let threads: Vec<_> = (0..4).map(|_| scope.spawn(load)).collect();
        threads.into_iter().flat_map(|thread| thread.join().expect("no thread panics")).collect()
    });
    assert!(all.iter().all(|bits| *bits == all[0]));
    assert_eq!(files(folder.path()).len(), 1);
}
