//! Packages for GPUs: PTX by a machine of the tests and NVIDIA's assembler, OpenCL C by an implementation on the CPU. Truth is the interpreter.

use crate::c99::{differences, numbers, robot, True};
use crate::c99_readback::{changed, is_none, kinds, words};
use crate::ptx_machine::Entry;
use crate::standalone::Folder;
use std::path::{Path, PathBuf};
use std::process::Command;
use straightline_codegen::compile::checked_package;
use straightline_codegen::emit::c99::opencl::OPENCL;
use straightline_codegen::emit::fused;
use straightline_codegen::emit::gpu::ptx::PTX;
use straightline_codegen::emit::package::PackageKind;
use straightline_codegen::emit::Generated;
use straightline_codegen::expr::{Graph, Port};
use straightline_codegen::options::Options;
use straightline_codegen::readback::packages;
use straightline_codegen::schedule::{schedule, ScheduleLimits};
use straightline_codegen::{compile, Function, Scalar};
use straightline_core::random::Random;
use straightline_core::trig;

fn file(kind: &PackageKind, generated: &Generated) -> String {
    assert_eq!((kind.refusal)(generated), None);
    let files = checked_package(kind, generated, "robot").unwrap_or_else(|errors| panic!("{errors}"));
    files.into_iter().next().expect("it is the first").1
}

/// What a package has: names behind the prefix, programs.
fn programs(generated: &Generated) -> Vec<(String, &Graph, Scalar)> {
    let of_robot = generated.programs.functions.iter().map(|p| (p.name.clone(), &p.graph, p.scalar));
    let of_modes = generated.programs.modes.iter().flat_map(|mode| {
        mode.functions.iter().map(|p| (format!("contact_{}_{}", mode.identifier, p.name), &p.graph, p.scalar))
    });
    of_robot.chain(of_modes).collect()
}

/// Arrays of a function, component by component: those of inputs with the numbers of states, which are read one after the other.
fn arrays(graph: &Graph, scalar: Scalar, states: usize, given: &mut &[u8]) -> Vec<Vec<u64>> {
    let shared = |port: &Port| if port.wrapper.is_some() { 1 } else { states };
    let mut arrays: Vec<Vec<u64>> =
        graph.inputs.iter().chain(&graph.outputs).map(|port| vec![u64::MAX; port.len() * shared(port)]).collect();
    for state in 0..states {
        for (port, array) in graph.inputs.iter().zip(&mut arrays) {
            for component in 0..port.len() {
                let (number, rest) = given.split_at(scalar.bytes());
                *given = rest;
                let mut bits = [0; 8];
                bits[..number.len()].copy_from_slice(number);
                let place = if port.wrapper.is_some() { component } else { component * states + state };
                array[place] = u64::from_le_bytes(bits);
            }
        }
    }
    arrays
}

/// The numbers of the results, state after state.
fn results(graph: &Graph, scalar: Scalar, states: usize, arrays: &[Vec<u64>]) -> Vec<u8> {
    let mut bytes = Vec::new();
    for state in 0..states {
        for (port, array) in graph.outputs.iter().zip(&arrays[graph.inputs.len()..]) {
            for component in 0..port.len() {
                bytes.extend(&array[component * states + state].to_le_bytes()[..scalar.bytes()]);
            }
        }
    }
    bytes
}

/// So many states as every run-time parameter has one value for.
fn states_of(graph: &Graph, states: usize) -> usize {
    if graph.inputs.iter().any(|port| port.wrapper.is_some()) {
        1
    } else {
        states
    }
}

/// What the machine of the tests makes of a package's programs, other than it should.
fn wrong_by_machine(generated: &Generated, states: usize) -> Vec<String> {
    let text = file(&PTX, generated);
    let mut wrong = Vec::new();
    for (name, graph, scalar) in programs(generated) {
        let states = states_of(graph, states);
        let (given, mut truth) = numbers(&[(name.clone(), graph, scalar)], states);
        if generated.style.fused {
            fuse(graph, scalar, &given, &mut truth);
        }
        let mut arrays = arrays(graph, scalar, states, &mut &given[..]);
        let entry = Entry::of(&text, &format!("robot_{name}_batch_soa"));
        assert_eq!(entry.parameters.len(), 1 + arrays.len(), "{name}");
        // two threads more than states: they touch nothing
        entry.launch(states as u32, states as u32 + 2, scalar.bytes(), &mut arrays);
        wrong.extend(differences(&results(graph, scalar, states, &arrays), &truth));
    }
    wrong
}

/// The truth of fused programs.
fn fuse(graph: &Graph, scalar: Scalar, given: &[u8], truth: &mut [True]) {
    let schedule = schedule(graph, ScheduleLimits::default(), None);
    let count: usize = graph.inputs.iter().map(Port::len).sum();
    let results: usize = graph.outputs.iter().map(Port::len).sum();
    let states = given.chunks(count * scalar.bytes()).zip(truth.chunks_mut(results));
    for (given, truth) in states {
        let values: Vec<f64> = match scalar {
            Scalar::F64 => {
                let x: Vec<f64> = given.as_chunks().0.iter().map(|b| f64::from_le_bytes(*b)).collect();
                let sin_cos = |x| trig::sin_cos_of_sum_fused_f64(x, f64::mul_add);
                fused::evaluate((graph, &schedule), &x, f64::mul_add, sin_cos)
            }
            Scalar::F32 => {
                let x: Vec<f32> = given.as_chunks().0.iter().map(|b| f32::from_le_bytes(*b)).collect();
                let sin_cos = |x| trig::sin_cos_of_sum_fused_f32(x, f32::mul_add);
                let found = fused::evaluate((graph, &schedule), &x, f32::mul_add, sin_cos);
                found.into_iter().map(f64::from).collect()
            }
        };
        truth.iter_mut().zip(values).for_each(|(truth, value)| truth.value = value);
    }
}

#[test]
fn ptx_has_the_bits_of_its_programs() {
    for (name, generated) in kinds().iter().filter(|(_, generated)| (PTX.refusal)(generated).is_none()) {
        let wrong = wrong_by_machine(generated, 40);
        assert!(wrong.is_empty(), "{name}: {} numbers differ: {}", wrong.len(), wrong[0]);
    }
    for scalar in [Scalar::F64, Scalar::F32] {
        let functions = vec![Function::InverseDynamics, Function::ForwardDynamics];
        let options = Options { functions, scalar, fma: true, ..Options::default() };
        let generated = compile(&robot("ur5.urdf"), &options).unwrap_or_else(|errors| panic!("{errors}"));
        let wrong = wrong_by_machine(&generated, 300);
        assert!(wrong.is_empty(), "fused {}: {} numbers differ: {}", scalar.name(), wrong.len(), wrong[0]);
        assert!(file(&PTX, &generated).contains("fma.rn."));
    }
}

/// A text with a word changed is refused, in either language.
#[test]
fn packages_for_gpus_with_a_word_changed_are_refused() {
    let (mut count, mut missed) = (0, Vec::new());
    for (k, (name, generated)) in kinds().iter().enumerate() {
        for kind in [&OPENCL, &PTX].into_iter().filter(|kind| (kind.refusal)(generated).is_none()) {
            let mut random = Random(k as u64);
            let files = (kind.files)(generated, "robot");
            let check = |files: &[(String, String)]| packages::check(kind.name, generated, "robot", files);
            check(&files).unwrap_or_else(|mismatch| panic!("{name}: {mismatch}"));
            let own = words(&files[0].1);
            for _ in 0..60 {
                let Some((new, what)) = changed(&files[0].1, &own, &mut random) else { continue };
                let mut others = files.clone();
                others[0].1.clone_from(&new);
                count += 1;
                if check(&others).is_ok() && !is_none(&files[0].1, &new) && !is_swapped(&files[0].1, &new) {
                    missed.push(format!("{name}, {}: {what}", kind.name));
                }
            }
        }
    }
    assert!(missed.is_empty(), "{} of {count} were let through:\n{}", missed.len(), missed.join("\n"));
    assert!(count > 500, "{count} changes are too few");
}

/// Whether two operands of a sum or product of PTX have changed places.
fn is_swapped(before: &str, after: &str) -> bool {
    let differing: Vec<(&str, &str)> = before.lines().zip(after.lines()).filter(|(a, b)| a != b).collect();
    let [(a, b)] = differing.as_slice() else { return false };
    let commutes = ["add.rn", "mul.rn", "fma.rn"].iter().any(|name| a.trim().starts_with(name));
    let sorted = |line: &str| {
        let mut operands: Vec<String> = line.trim_end_matches(';').split(", ").skip(1).map(str::to_string).collect();
        operands.sort();
        operands
    };
    commutes && sorted(a) == sorted(b)
}

/// The Python that `python/environment` makes, where it has a module.
fn python_with(module: &str) -> Option<PathBuf> {
    let test = std::env::current_exe().expect("a test knows where it is");
    let made = test.ancestors().skip(1).map(|folder| folder.join("python/bin/python"));
    let has = |python: &PathBuf| {
        let found = Command::new(python).args(["-c", &format!("import {module}")]).output();
        found.is_ok_and(|output| output.status.success())
    };
    let python = std::env::var_os("PYTHON").map(PathBuf::from).into_iter().chain(made).find(has);
    if python.is_none() {
        println!("skipped: no Python with {module} (`python/environment` makes one)");
    }
    python
}

/// NVIDIA's assembler, as it is packaged for Python.
fn assembler() -> Option<PathBuf> {
    let python = python_with("nvidia.cu13")?;
    let output =
        Command::new(python).args(["-c", "import nvidia.cu13 as m; print(list(m.__path__)[0])"]).output().ok()?;
    let folder = PathBuf::from(String::from_utf8_lossy(&output.stdout).trim());
    Some(folder.join("bin/ptxas")).filter(|ptxas| ptxas.exists())
}

/// What the assembler says of a text: registers, and bytes of spills, of the entry that takes most.
fn assembled(ptxas: &Path, text: &str, machine: &str) -> [u32; 2] {
    let folder = Folder::new(&format!("ptxas-{machine}"));
    let (source, object) = (folder.file("robot.ptx"), folder.file("robot.cubin"));
    std::fs::write(&source, text).expect("it can be written");
    let output =
        Command::new(ptxas).args(["-v", &format!("-arch={machine}")]).arg(&source).arg("-o").arg(&object).output();
    let output = output.expect("ptxas runs");
    let said = String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}");
    let number_before = |line: &str, what: &str| -> Option<u32> {
        line[..line.find(what)?].split([' ', ',']).rfind(|word| !word.is_empty())?.parse().ok()
    };
    let most = |what: &str| said.lines().filter_map(|line| number_before(line, what)).max().expect("it says so");
    [most(" registers"), most(" bytes spill stores")]
}

#[test]
fn the_assembler_takes_ptx_and_needs_no_memory_for_an_arm() {
    let Some(ptxas) = assembler() else { return };
    for (name, generated) in kinds().iter().filter(|(_, generated)| (PTX.refusal)(generated).is_none()) {
        let [registers, _] = assembled(&ptxas, &file(&PTX, generated), "sm_75");
        assert!(registers > 0, "{name}");
    }
    let options = Options { functions: vec![Function::InverseDynamics], scalar: Scalar::F32, ..Options::default() };
    let generated = compile(&robot("panda.urdf"), &options).unwrap_or_else(|errors| panic!("{errors}"));
    for machine in ["sm_75", "sm_80", "sm_90"] {
        let [registers, spilled] = assembled(&ptxas, &file(&PTX, &generated), machine);
        println!("inverse dynamics of the Panda in f32 on {machine}: {registers} registers, {spilled} bytes spilled");
        assert!(registers <= 80 && spilled == 0, "{machine}: {registers} registers, {spilled} bytes");
    }
}

/// Reads states, runs the kernels of a text, and writes their results: arrays of bytes, component by component.
const BY_OPENCL: &str = r#"
import sys
import numpy as np
import pyopencl as cl

folder = sys.argv[1]
context = cl.Context(cl.get_platforms()[0].get_devices())
queue = cl.CommandQueue(context)
program = cl.Program(context, open(folder + "/robot.cl").read())
program.build(options=["-cl-fp32-correctly-rounded-divide-sqrt"])
log = program.get_build_info(context.devices[0], cl.program_build_info.LOG)
assert "warning" not in log, log
for k, line in enumerate(open(folder + "/calls")):
    name, states, inputs, *lengths = line.split()
    given = np.fromfile(f"{folder}/given{k}", np.uint8)
    flags, arrays, at = cl.mem_flags, [], 0
    for i, length in enumerate(map(int, lengths)):
        # of no numbers at all there is one that nobody reads
        numbers = np.zeros(max(length, 8), np.uint8)
        if i < int(inputs):
            numbers[:length] = given[at : at + length]
            at += length
        arrays.append(cl.Buffer(context, flags.READ_WRITE | flags.COPY_HOST_PTR, hostbuf=numbers))
    cl.Kernel(program, name)(queue, (int(states) + 2,), None, np.uint32(int(states)), *arrays)
    with open(f"{folder}/computed{k}", "wb") as out:
        for array, length in list(zip(arrays, map(int, lengths)))[int(inputs) :]:
            numbers = np.empty(max(length, 8), np.uint8)
            cl.enqueue_copy(queue, numbers, array)
            out.write(numbers[:length].tobytes())
"#;

#[test]
fn opencl_on_the_cpu_has_the_bits_of_its_programs() {
    let Some(python) = python_with("pyopencl") else { return };
    const STATES: usize = 40;
    for (kind, generated) in kinds().iter().filter(|(_, generated)| (OPENCL.refusal)(generated).is_none()) {
        let folder = Folder::new(&format!("opencl-{}", kind.replace([' ', ','], "-")));
        let put = |name: &str, bytes: &[u8]| std::fs::write(folder.file(name), bytes).expect("it can be written");
        put("robot.cl", file(&OPENCL, generated).as_bytes());
        put("call.py", BY_OPENCL.as_bytes());
        let (mut calls, mut all) = (String::new(), Vec::new());
        for (k, (name, graph, scalar)) in programs(generated).into_iter().enumerate() {
            let states = states_of(graph, STATES);
            let (given, truth) = numbers(&[(name.clone(), graph, scalar)], states);
            let arrays = arrays(graph, scalar, states, &mut &given[..]);
            let bytes = |array: &Vec<u64>| {
                array.iter().flat_map(|x| x.to_le_bytes()[..scalar.bytes()].to_vec()).collect::<Vec<u8>>()
            };
            put(&format!("given{k}"), &arrays[..graph.inputs.len()].iter().flat_map(bytes).collect::<Vec<u8>>());
            let lengths: Vec<String> = arrays.iter().map(|array| (array.len() * scalar.bytes()).to_string()).collect();
            calls += &format!("robot_{name}_batch_soa {states} {} {}\n", graph.inputs.len(), lengths.join(" "));
            all.push((graph, scalar, states, arrays, truth));
        }
        put("calls", calls.as_bytes());
        let output =
            Command::new(&python).arg(folder.file("call.py")).arg(folder.file("")).output().expect("Python runs");
        let said = String::from_utf8_lossy(&output.stderr);
        if said.contains("PLATFORM_NOT_FOUND") {
            println!("skipped: no implementation of OpenCL (`python/environment` brings one)");
            return;
        }
        assert!(output.status.success(), "{kind}: {said}");
        for (k, (graph, scalar, states, mut arrays, truth)) in all.into_iter().enumerate() {
            let computed = std::fs::read(folder.file(&format!("computed{k}"))).expect("it was written");
            let mut numbers = computed.chunks(scalar.bytes()).map(|number| {
                let mut bits = [0; 8];
                bits[..number.len()].copy_from_slice(number);
                u64::from_le_bytes(bits)
            });
            arrays[graph.inputs.len()..].iter_mut().flatten().for_each(|x| *x = numbers.next().expect("all are there"));
            let wrong = differences(&results(graph, scalar, states, &arrays), &truth);
            assert!(wrong.is_empty(), "{kind}: {} numbers differ: {}", wrong.len(), wrong[0]);
        }
    }
}

#[test]
fn what_no_gpu_has_is_refused() {
    let of = |options: Options| {
        let options = Options { functions: vec![Function::GravityForce], ..options };
        compile(&robot("planar2r.urdf"), &options).unwrap_or_else(|errors| panic!("{errors}"))
    };
    let plain = of(Options::default());
    assert_eq!([(OPENCL.refusal)(&plain), (PTX.refusal)(&plain)], [None, None]);
    let fused = of(Options { fma: true, ..Options::default() });
    assert!((OPENCL.refusal)(&fused).is_some_and(|[_, help]| help.contains("ptx")));
    assert_eq!((PTX.refusal)(&fused), None);
    let generic = of(Options { generic: true, ..Options::default() });
    for kind in [OPENCL, PTX] {
        assert!((kind.refusal)(&generic).is_some_and(|[wrong, _]| wrong.contains("generic")));
    }
}
