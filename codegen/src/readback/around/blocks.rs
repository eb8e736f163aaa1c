//! What stands around functions: batches over lanes, stages, contact modes.

use super::{first_of, shaped, taken, Around, BlockReading};
use crate::choices::Lanes;
use crate::identifier::string_literals;
use crate::program::written::{WrittenFunction, WrittenMode};
use crate::readback::items::Sort;
use crate::readback::ReadingStop;
use straightline_graph::expr::Port;

impl Around<'_, '_, '_> {
    /// What runs functions over lanes on slices.
    pub(super) fn batches(&mut self) -> BlockReading<()> {
        let programs = &self.generated.programs;
        let Some(drivers) = self.generated.lanes else { return Ok(()) };
        self.batches_of(self.root, &programs.functions, drivers)?;
        for mode in &programs.modes {
            let contact = self.module(self.root, "contact")?;
            let module = self.module(contact, &mode.identifier)?;
            self.batches_of(module, &mode.functions, drivers)?;
        }
        Ok(())
    }

    /// The same of the functions of a module.
    fn batches_of(&mut self, root: usize, programs: &[WrittenFunction], drivers: Lanes) -> BlockReading<()> {
        for program in programs.iter().filter(|p| p.lanes) {
            let made = self.program_of_batches(root, program)?;
            for (layout, suffix) in [("soa", ""), ("aos", ""), ("soa", "_parallel"), ("aos", "_parallel")] {
                if suffix.is_empty() || drivers != Lanes::Standalone {
                    self.batch(root, program, (layout, suffix), &made)?;
                }
            }
        }
        Ok(())
    }

    /// What the batches of a function run; how it is made.
    fn program_of_batches(&mut self, root: usize, program: &WrittenFunction) -> BlockReading<String> {
        let (s, name) = (self.scalar().name(), &program.name);
        let (inputs, outputs) = (&program.graph.inputs, &program.graph.outputs);
        let shared: Vec<(&str, &str)> =
            inputs.iter().filter_map(|p| Some((p.name.as_str(), p.wrapper.as_deref()?))).collect();
        let capital = |word: &str| {
            word.chars().take(1).map(|c| c.to_ascii_uppercase()).chain(word.chars().skip(1)).collect::<String>()
        };
        let type_name = name.split('_').map(capital).collect::<String>() + "Program";
        let fields: String = shared.iter().map(|(name, of)| format!("{name}: &'a {of},")).collect();
        let names = shared.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
        let (declared, any, made) = match shared.is_empty() {
            true => (format!("struct {type_name};"), "", type_name.clone()),
            false => (format!("struct {type_name}<'a> {{ {fields} }}"), "<'_>", format!("{type_name} {{ {names} }}")),
        };
        self.is(root, Sort::Struct, &type_name, &declared)?;
        let arguments: String = inputs
            .iter()
            .map(|p| if p.wrapper.is_some() { format!("self.{},", p.name) } else { taken(p, "", "x") + "," })
            .chain(outputs.iter().map(|p| taken(p, "_mut", "y") + ","))
            .collect();
        let n: usize = inputs.iter().filter(|p| p.wrapper.is_none()).map(Port::len).sum();
        let m: usize = outputs.iter().map(Port::len).sum();
        let body = match self.generated.style.fused {
            true => format!("{name}_in_lanes::<N, FUSED>"),
            false => format!("{name}_lanes"),
        };
        let text = format!(
            "impl batch::Program<{s}, {n}, {m}> for {type_name}{any} {{
                #[inline(always)]
                fn run<const N: usize, const FUSED: bool>(&self, x: &[[{s}; N]; {n}], y: &mut [[{s}; N]; {m}]) {{
                    let (mut x, mut y) = (x.as_slice(), y.as_mut_slice());
                    {body}({arguments});
                }}
            }}"
        );
        self.is(root, Sort::ImplOf, &type_name, &text)?;
        Ok(made)
    }

    /// A function over slices, which runs `made`.
    fn batch(
        &mut self,
        root: usize,
        program: &WrittenFunction,
        (layout, suffix): (&str, &str),
        made: &str,
    ) -> BlockReading<()> {
        let s = self.scalar().name();
        let (inputs, outputs) = (&program.graph.inputs, &program.graph.outputs);
        let of_states: Vec<&Port> = inputs.iter().filter(|p| p.wrapper.is_none()).collect();
        let parameters: String = inputs
            .iter()
            .map(|p| format!(", {}: &{}", p.name, p.wrapper.clone().unwrap_or(format!("[{s}]"))))
            .chain(outputs.iter().map(|p| format!(", {}: &mut [{s}]", p.name)))
            .collect();
        let check = |p: &Port| format!("batch::check(\"{0}\", {0}, n, {1})?;", p.name, p.len());
        let checks: String = of_states.iter().copied().chain(outputs).map(check).collect();
        let slices = |ports: &[&Port]| {
            let of = |p: &&Port| match layout {
                "soa" => p.name.clone(),
                _ => format!("({}, {})", p.name, p.len()),
            };
            ports.iter().map(of).collect::<Vec<_>>().join(", ")
        };
        let (x, y) = (slices(&of_states), slices(&outputs.iter().collect::<Vec<_>>()));
        let function = format!("{}_batch_{layout}{suffix}", program.name);
        let text = format!(
            "pub fn {function}(n: usize{parameters}) -> Result<(), batch::WrongLength> {{
                {checks}
                batch::run{suffix}_{s}(batch::{layout}(&{made}, n, [{x}], [{y}]));
                Ok(())
            }}"
        );
        self.is(root, Sort::Function, &function, &text)?;
        let item = self.item(root, Sort::Function, &function)?;
        match item.threads == suffix.is_empty() {
            true => Err(ReadingStop::at(self.items.text.len(), format!("`{function}` stands where it should not"))),
            false => Ok(()),
        }
    }

    /// Types of stages around their values, and the methods that they serve.
    pub(super) fn stages(&mut self) -> BlockReading<()> {
        let Some(staged) = &self.generated.programs.staged else { return Ok(()) };
        let (root, s) = (self.root, self.scalar().name());
        let module = self.module(root, "staged")?;
        let stages = &staged.stages;
        let is_stored = |p: &Port| stages.iter().any(|e| e.values == p.name);
        let array = |p: &Port| p.wrapper.clone().unwrap_or_else(|| shaped(p, s));
        let listed = |ports: &mut dyn Iterator<Item = &Port>, reference: &str| -> Vec<String> {
            ports.map(|p| format!("{}: {reference}{}", p.name, array(p))).collect()
        };
        for (k, stage) in stages.iter().enumerate() {
            let (name, graph) = (&stage.type_name, &stage.program.graph);
            let n: usize = graph.outputs.iter().map(Port::len).sum();
            // from a value of stage `last`, what an earlier stage stored
            let stored = |receiver: &str, last: usize, p: &Port| match stages.iter().position(|e| e.values == p.name) {
                Some(of) if of <= last => {
                    let path: String = (of..last).rev().map(|e| format!(".{}", stages[e].values)).collect();
                    format!("&{receiver}{path}.values")
                }
                _ => p.name.clone(),
            };
            let life = |k: usize| if k > 0 { "<'a>" } else { "" };
            let earlier = k.checked_sub(1).map(|e| (&stages[e], life(e)));
            let field = earlier.map_or(String::new(), |(e, life)| format!("{}: &'a {}{life},", e.values, e.type_name));
            let text = format!("pub struct {name}{0} {{ {field} values: [{s}; {n}], }}", life(k));
            self.is(module, Sort::Struct, name, &text)?;
            let own = listed(&mut graph.inputs.iter().filter(|p| !is_stored(p)), "&");
            let filler = first_of(graph.inputs.iter().filter(|p| !is_stored(p)));
            let before = earlier.map(|(e, life)| format!("{}: &'a {}{life}", e.values, e.type_name));
            let parameters: Vec<String> = before.into_iter().chain(own).collect();
            let receiver = earlier.map_or("", |(e, _)| &e.values);
            let arguments: String =
                graph.inputs.iter().map(|p| stored(receiver, k.saturating_sub(1), p) + ", ").collect();
            let mut text = format!(
                "impl{0} {name}{0} {{
                    #[must_use]
                    pub fn new({1}) -> {name}{0} {{
                        let mut values = [{filler}; {n}];
                        {2}({arguments}&mut values);
                        {name} {{ {3} values }}
                    }}",
                life(k),
                parameters.join(", "),
                stage.program.name,
                earlier.map_or(String::new(), |(e, _)| format!("{},", e.values)),
            );
            for (_, program) in staged.functions.iter().filter(|(of, _)| *of == k) {
                let graph = &program.graph;
                let own = listed(&mut graph.inputs.iter().filter(|p| !is_stored(p)), "&");
                let results = listed(&mut graph.outputs.iter(), "&mut ");
                let parameters: String = own.into_iter().chain(results).map(|p| format!(", {p}")).collect();
                let arguments: Vec<String> = graph
                    .inputs
                    .iter()
                    .map(|p| stored("self", k, p))
                    .chain(graph.outputs.iter().map(|p| p.name.clone()))
                    .collect();
                text.push_str(&format!(
                    "pub fn {0}(&self{parameters}) {{ {0}({1}); }}",
                    program.name,
                    arguments.join(", ")
                ));
            }
            self.is(module, Sort::Impl, name, &(text + "}"))?;
        }
        Ok(())
    }

    /// The modes of contact, and what calls one of them.
    pub(super) fn modes(&mut self) -> BlockReading<()> {
        let modes = &self.generated.programs.modes;
        if modes.is_empty() {
            return Ok(());
        }
        let contact = self.module(self.root, "contact")?;
        for mode in modes {
            let module = self.module(contact, &mode.identifier)?;
            for (name, names) in ["CONSTRAINED", "FREE"].iter().zip(&mode.coordinates) {
                let quoted = string_literals(names.iter().map(String::as_str));
                let text = format!("pub const {name}: [&str; {}] = [{quoted}];", names.len());
                self.is(module, Sort::Constant, name, &text)?;
            }
        }
        // variants stand in the order of the modes
        let variants: Vec<String> = {
            let item = self.item(contact, Sort::Enum, "Mode")?;
            (item.start + 4..item.end - 1).step_by(2).map(|at| self.items.text_of(at).to_string()).collect()
        };
        self.is(contact, Sort::Enum, "Mode", &format!("pub enum Mode {{ {}, }}", variants.join(", ")))?;
        let distinct = variants.iter().enumerate().all(|(k, v)| !variants[..k].contains(v));
        if variants.len() != modes.len() || !distinct {
            return Err(ReadingStop::at(self.items.text.len(), "as many modes as the scene has are expected"));
        }
        let word = self.words.number("forward_dynamics");
        match self.items.find(contact, Sort::Function, word) {
            Some(_) => self.forward_dynamics_of(contact, modes, &variants),
            None => Ok(()),
        }
    }

    /// Forward dynamics in one of the modes, which have these variants.
    fn forward_dynamics_of(&mut self, contact: usize, modes: &[WrittenMode], variants: &[String]) -> BlockReading<()> {
        let (s, zero, generics) = match modes.iter().flat_map(|mode| &mode.functions).any(|p| p.generic) {
            true => ("T", "T::zero()", "<T: super::Real>"),
            false => (self.scalar().name(), "0.0", ""),
        };
        let forward = |k: usize| modes[k].functions.iter().find(|p| p.name == "forward_dynamics");
        let programs: Option<Vec<_>> = (0..modes.len()).map(forward).collect();
        let Some(programs) = programs else {
            return Err(ReadingStop::at(self.items.text.len(), "forward dynamics of a mode is missing"));
        };
        let most = modes.iter().map(|m| m.coordinates[0].len()).max().unwrap_or(0);
        self.is(contact, Sort::Constant, "MOST_CONSTRAINED", &format!("pub const MOST_CONSTRAINED: usize = {most};"))?;
        let inputs = &programs[0].graph.inputs;
        let parameters: String = inputs
            .iter()
            .map(|p| match &p.wrapper {
                Some(wrapper) => format!("{}: &super::{wrapper}, ", p.name),
                None => format!("{}: &{}, ", p.name, shaped(p, s)),
            })
            .collect();
        let filler = first_of(inputs.iter().filter(|p| p.wrapper.is_none()));
        let arms: String = variants
            .iter()
            .zip(modes)
            .zip(&programs)
            .map(|((variant, mode), program)| {
                let m = mode.coordinates[0].len();
                let forces = (0..most).map(|i| if i < m { format!("f[{i}]") } else { zero.to_string() });
                let arguments: Vec<&str> = program
                    .graph
                    .inputs
                    .iter()
                    .map(|p| p.name.as_str())
                    .chain(program.graph.outputs.iter().map(|p| match p.name.as_str() {
                        "force" => "&mut f",
                        "sdd" => "&mut sdd",
                        "violation" => "&mut violation",
                        "pivot" => "&mut pivot",
                        own => own,
                    }))
                    .collect();
                format!(
                    "Mode::{variant} => {{
                        let (mut f, mut sdd, mut violation) = ([{filler}; {m}], [{filler}; {m}], [{filler}; {m}]);
                        {}::forward_dynamics({});
                        *force = [{}];
                    }}",
                    mode.identifier,
                    arguments.join(", "),
                    forces.collect::<Vec<_>>().join(", ")
                )
            })
            .collect();
        let nv = self.generated.model.nv();
        let text = format!(
            "pub fn forward_dynamics{generics}(mode: Mode, {parameters}qdd: &mut [{s}; {nv}], force: &mut [{s}; {most}]) -> {s} {{
                let mut pivot = [{zero}];
                match mode {{ {arms} }}
                pivot[0]
            }}"
        );
        self.is(contact, Sort::Function, "forward_dynamics", &text)
    }
}
