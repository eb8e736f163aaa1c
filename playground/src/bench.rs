//! The robot on the bench: its own functions as a module, a motion for them, and the page's data of the moving robot.

use crate::base64;
use crate::complaints::{complaints, Complaint};
use crate::drives::{assumed, quoted, tables, JointMotor};
use crate::edits::{editables, with_factors, Editables, Factors};
use crate::module::of_programs;
use crate::motion::{rows, SwingRows};
use crate::request::Files;
use serde::{Deserialize, Serialize};
use straightline_codegen::choices::OptimisationTier;
use straightline_codegen::compile::compile_programs;
use straightline_codegen::diagnostic::{Diagnostics, Source};
use straightline_codegen::options::Options;
use straightline_codegen::program::TracedProgram;
use straightline_codegen::{description, model, scene, Function};
use straightline_core::model::Model;
use straightline_core::random::Random;
use straightline_core::Dd;
use straightline_graph::expr::evaluate;
use straightline_view::{page, urdf_look, ViewedRun};

/// A period of the motion where nobody says \[s\].
const USUAL_PERIOD: f64 = 4.0;
/// States at which the module is compared with the programs.
const COMPARED: usize = 8;

/// A robot with what its sliders say.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default)]
pub struct BenchRequest {
    /// The robot file and its scene.
    #[serde(flatten)]
    pub files: Files,
    /// What is written over numbers of the file.
    pub factors: Factors,
    /// Mass at the last tip \[kg\].
    pub payload: f64,
    /// Motors on joints, where the files have none; none: those that are assumed.
    pub motors: Vec<JointMotor>,
    /// A period of the motion \[s\].
    pub period: f64,
}

/// What can be shown of it.
#[derive(Clone, Debug, Default, Serialize)]
pub struct BenchAnswer {
    /// What is wrong or doubtful.
    pub complaints: Vec<Complaint>,
    /// The robot file as it was compiled, and the scene.
    pub text: String,
    /// See there.
    pub scene: String,
    /// What can be changed in the file.
    pub editables: Editables,
    /// The frame that carries the payload.
    pub tip: Option<String>,
    /// The motors.
    pub motors: Vec<JointMotor>,
    /// Coordinates and velocities.
    pub nq: usize,
    /// See there.
    pub nv: usize,
    /// The joints that have one coordinate.
    pub joints: Vec<BenchJoint>,
    /// Times, q, q̇ and q̈ of the motion, row by row, as base64 of f64.
    pub times: String,
    /// See there.
    pub q: String,
    /// See there.
    pub qd: String,
    /// See there.
    pub qdd: String,
    /// The page's data of the moving robot, JSON.
    pub view: String,
    /// The robot's functions as a module of WebAssembly, in base64.
    pub module: Option<String>,
    /// Where its results stand, counted in numbers.
    pub results_at: usize,
    /// Its functions.
    pub functions: Vec<BenchFunction>,
    /// Where the canonical frame of each body stands in the frame of which `forward_kinematics` has the pose: position, then rotation by rows. None: poses are
    /// those of the page's data.
    pub frames: Vec<[f64; 12]>,
    /// Why there are no functions, if so.
    pub why_not: Option<String>,
}

/// A joint and its limits; what is not limited is missing.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BenchJoint {
    /// Its name.
    pub name: String,
    /// Its first coordinate and velocity.
    pub iq: usize,
    /// See there.
    pub iv: usize,
    /// Whether it slides.
    pub slides: bool,
    /// Least and greatest coordinate, greatest speed, greatest force.
    pub lower: Option<f64>,
    /// See there.
    pub upper: Option<f64>,
    /// See there.
    pub velocity: Option<f64>,
    /// See there.
    pub effort: Option<f64>,
}

/// A function of the module, with states at which it was run by the interpreter.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BenchFunction {
    /// Its name.
    pub name: &'static str,
    /// Names and numbers of its inputs.
    pub inputs: Vec<(String, usize)>,
    /// Names and numbers of its results.
    pub outputs: Vec<(String, usize)>,
    /// Multiplications, additions, divisions and roots, and sine-cosine pairs.
    pub operations: (usize, usize),
    /// Inputs of some states, and its results there, as base64 of f64.
    pub states: String,
    /// See there.
    pub results: String,
}

/// A robot that was read for the bench.
pub struct BenchRobot {
    source: Source,
    options: Options,
    scene: String,
    tip: Option<String>,
    motors: Vec<JointMotor>,
    /// In f64, in its scene.
    pub model: Model<f64>,
    /// Its motion.
    pub rows: SwingRows,
}

fn model_of(source: &Source, options: &Options) -> Option<Model<Dd>> {
    let mut said = Diagnostics::new();
    let description = description::read(source, &mut said)?;
    let whole = model::build(&description, &options.scene.model_options(&options.model), &mut said)?;
    let model = scene::apply(whole, &options.scene, &mut said)?;
    (!said.has_errors()).then_some(model)
}

/// The last frame on the last body that carries no other.
fn tip(model: &Model<f64>) -> Option<String> {
    let carries = |i: usize| model.bodies.iter().any(|b| b.parent == Some(i));
    let body = (0..model.bodies.len()).rev().find(|i| !carries(*i))?;
    model.frames.iter().rev().find(|f| f.body == Some(body)).map(|f| f.name.clone())
}

/// What a page shows beside poses: six columns of each joint or drive.
fn columns(model: &Model<f64>) -> usize {
    6 * model.nv()
}

/// What the page adds to the scene for a payload.
fn payload_table(request: &BenchRequest, tip: Option<&str>) -> String {
    let Some(tip) = tip.filter(|_| request.payload > 0.0) else { return String::new() };
    // the scene may have one that was taken over from here
    let mut name = "payload of the page".to_string();
    while request.files.scene.contains(&name) {
        name.push('\'');
    }
    format!("\n[[payload]]\nname = {}\nframe = {}\nmass = {:?}\n", quoted(&name), quoted(tip), request.payload)
}

/// Reads the robot of a request.
///
/// # Errors
/// What is wrong with it, as the compiler says it.
pub fn read_robot(request: &BenchRequest) -> Result<BenchRobot, Vec<Complaint>> {
    let source = with_factors(&request.files.source(), &request.factors);
    let quick = Options { optimise: OptimisationTier::Quick, ..Options::default() };
    let read = |options: &Options| {
        let model = model_of(&source, options).map(|model| model.map(Dd::to_f64));
        model.ok_or_else(|| complaints(&straightline_codegen::compile::examine(&source, options)))
    };
    let bare = read(&request.files.options("", quick.clone()))?;
    let tip = tip(&bare);
    let period = if request.period > 0.0 { request.period } else { USUAL_PERIOD };
    let motors = match request.motors.is_empty() || !bare.drives.is_empty() {
        true => assumed(&bare, &rows(&bare, USUAL_PERIOD, columns(&bare))),
        false => request.motors.clone(),
    };
    let added = payload_table(request, tip.as_deref()) + &tables(&motors);
    let options = request.files.options(&added, quick);
    let model = read(&options)?;
    let rows = rows(&model, period, columns(&model));
    Ok(BenchRobot { source, options, scene: format!("{}{added}", request.files.scene), tip, motors, model, rows })
}

/// The functions that run in the page.
const FUNCTIONS: [&str; 5] =
    ["inverse_dynamics", "forward_dynamics", "mass_matrix", "gravity_force", "forward_kinematics"];

/// Puts a robot on the bench.
pub fn bench(request: BenchRequest) -> BenchAnswer {
    let source = request.files.source();
    let robot = match read_robot(&request) {
        Ok(robot) => robot,
        Err(complaints) => return BenchAnswer { complaints, ..BenchAnswer::default() },
    };
    let BenchRobot { model, rows, .. } = &robot;
    let of = |k: usize| base64::of_numbers(rows.states.iter().flat_map(|state| &state[k]));
    let limit = |x: f64| x.is_finite().then_some(x);
    let joints = model.independent_joints().filter(|joint| joint.kind.is_single()).map(|joint| BenchJoint {
        name: joint.name.clone(),
        iq: joint.iq,
        iv: joint.iv,
        slides: joint.kind.slides(),
        lower: limit(joint.limits.lower),
        upper: limit(joint.limits.upper),
        velocity: limit(joint.limits.velocity),
        effort: limit(joint.limits.effort),
    });
    let mut answer = BenchAnswer {
        text: robot.source.text().to_string(),
        scene: robot.scene.clone(),
        editables: editables(&source),
        tip: robot.tip.clone(),
        motors: robot.motors.clone(),
        nq: model.nq(),
        nv: model.nv(),
        joints: joints.collect(),
        times: base64::of_numbers(&rows.times),
        q: of(0),
        qd: of(1),
        qdd: of(2),
        ..BenchAnswer::default()
    };
    match view(&robot) {
        Ok(view) => answer.view = view,
        Err(why) => answer.why_not = Some(why),
    }
    functions(&robot, &mut answer);
    answer
}

/// The page's data: joints with their columns, which the page fills with what its functions give.
fn view(robot: &BenchRobot) -> Result<String, String> {
    let BenchRobot { model, rows, .. } = robot;
    let none = vec![0.0; rows.times.len()];
    let mut run = ViewedRun {
        times: rows.times.clone(),
        configurations: rows.states.iter().map(|[q, ..]| q.clone()).collect(),
        ..ViewedRun::default()
    };
    for joint in model.independent_joints().filter(|joint| joint.kind.is_single()) {
        let column = |k: usize, at: usize| rows.states.iter().map(|state| state[k][at]).collect();
        run.columns.push((format!("q.{}", joint.name), column(0, joint.iq)));
        run.columns.push((format!("qd.{}", joint.name), column(1, joint.iv)));
        run.columns.push((format!("tau.{}", joint.name), none.clone()));
    }
    for drive in &model.drives {
        run.columns.extend(["i", "u", "speed"].map(|prefix| (format!("{prefix}.{}", drive.name), none.clone())));
    }
    let look = urdf_look(robot.source.text(), model, &|_| Err("a page without network has no meshes".to_string()));
    let html =
        page(model, &look, &run, &[]).map_err(|all| all.iter().map(|f| format!("{}; ", f.what)).collect::<String>())?;
    let data = html.split_once("id=\"data\">").and_then(|(_, rest)| rest.split_once("</script>"));
    Ok(data.expect("a page has its data").0.to_string())
}

/// A frame for every body, with the pose of the body's canonical frame in it; none if a body has no frame.
fn frames(model: &Model<f64>) -> Option<(Vec<String>, Vec<[f64; 12]>)> {
    let of = |body: usize| {
        let frame = model.frames.iter().find(|frame| frame.body == Some(body))?;
        let pose = frame.placement.inverse();
        let mut numbers = [0.0; 12];
        numbers[..3].copy_from_slice(&pose.translation.to_array());
        numbers[3..].copy_from_slice(pose.rotation.rows.as_flattened());
        Some((frame.name.clone(), numbers))
    };
    (0..model.bodies.len()).map(of).collect::<Option<Vec<_>>>().map(|all| all.into_iter().unzip())
}

/// Adds the functions.
fn functions(robot: &BenchRobot, answer: &mut BenchAnswer) {
    let (names, poses) = frames(&robot.model).unwrap_or_default();
    let mut options = robot.options.clone();
    options.functions = Function::all().filter(|f| FUNCTIONS.contains(&f.name()) && f.is_of(&robot.model)).collect();
    if names.is_empty() {
        options.functions.retain(|f| f.name() != "forward_kinematics");
    }
    options.frames = names;
    let checked = match compile_programs(&robot.source, &options) {
        Ok(checked) => checked,
        Err(wrong) => {
            answer.complaints = complaints(&wrong);
            return;
        }
    };
    answer.complaints = complaints(&checked.warnings);
    match of_programs(&checked.programs) {
        Ok(module) => {
            answer.module = Some(base64::encoded(&module.bytes));
            answer.results_at = module.results_at;
            answer.functions = checked.programs.iter().map(bench_function).collect();
            answer.frames = poses;
        }
        Err(why) => answer.why_not = Some(why),
    }
}

/// A function with what the interpreter makes of some states.
fn bench_function(program: &TracedProgram) -> BenchFunction {
    let graph = &program.graph;
    let ports = |ports: &[straightline_graph::expr::Port]| ports.iter().map(|p| (p.name.clone(), p.len())).collect();
    let count = graph.inputs.iter().map(|port| port.len()).sum::<usize>();
    let mut random = Random(0x5eed);
    let (mut states, mut results) = (Vec::new(), Vec::new());
    for k in 0..COMPARED {
        // the last far from zero, so that angles are reduced by many turns
        let most = if k + 1 == COMPARED { 1e4 } else { 3.0 };
        let state: Vec<f64> = (0..count).map(|_| random.symmetric(most)).collect();
        results.extend(evaluate::<f64>(graph, &state));
        states.extend(state);
    }
    let counts = graph.counts();
    BenchFunction {
        name: program.function.name(),
        inputs: ports(&graph.inputs),
        outputs: ports(&graph.outputs),
        operations: (counts.flops(), counts.sin_cos),
        states: base64::of_numbers(&states),
        results: base64::of_numbers(&results),
    }
}
