//! What C sees of generated code, whoever computes it: functions with their parameters, run-time parameters, names.

use crate::description::drives::DriveNumber;
use crate::emit::module::Routine;
use crate::emit::{Generated, Item};
use crate::identifier::comment;
use straightline_graph::expr::Port;
use straightline_graph::Scalar;

/// The layouts of batches, with where component `c` of state `s` is.
pub const LAYOUTS: [(&str, &str); 2] = [("soa", "[c * n + s]"), ("aos", "[s * w + c], w numbers to a state")];

/// What C sees of a robot.
pub struct Interface<'a> {
    /// The robot.
    pub generated: &'a Generated,
    /// All C names begin with it.
    pub prefix: &'a str,
    /// What the library is called.
    pub library: String,
}

/// A function that C can call.
pub struct Exported {
    /// Its name behind the prefix.
    pub c_name: String,
    /// Its own name.
    pub name: String,
    /// Its contact mode, if it is of one.
    pub mode: Option<String>,
    /// What it computes, in a sentence.
    pub summary: &'static str,
    /// What stands above it, line by line.
    pub doc: String,
    /// Its scalar type.
    pub scalar: Scalar,
    /// What it takes, in order.
    pub parameters: Vec<CParameter>,
}

/// A parameter of a C function.
pub struct CParameter {
    /// Its name.
    pub name: String,
    /// How many numbers.
    pub length: usize,
    /// The port that it is.
    pub port: Port,
    /// Whether it is written.
    pub is_output: bool,
    /// Whether one value serves all states of a batch.
    pub is_shared: bool,
}

impl CParameter {
    /// The parameter of a C declaration: an array, of no numbers at all a pointer.
    pub fn in_c(&self, c_type: &str) -> String {
        let (constant, name) = (if self.is_output { "" } else { "const " }, &self.name);
        match self.length {
            0 => format!("{constant}{c_type} *{name}"),
            n => format!("{constant}{c_type} {name}[{n}]"),
        }
    }

    /// The same for many states.
    pub fn of_states_in_c(&self, c_type: &str) -> String {
        match self.is_shared {
            true => self.in_c(c_type),
            false => format!("{}{c_type} *{}", if self.is_output { "" } else { "const " }, self.name),
        }
    }
}

impl Exported {
    /// A list of something of each parameter.
    pub fn list(&self, of: &dyn Fn(&CParameter) -> String) -> String {
        self.parameters.iter().map(of).collect::<Vec<_>>().join(", ")
    }
}

impl<'a> Interface<'a> {
    /// Of a robot, with this prefix.
    pub fn new(generated: &'a Generated, prefix: &'a str) -> Interface<'a> {
        Interface { generated, prefix, library: format!("{}_dynamics", prefix.to_lowercase()) }
    }

    /// The scalar type.
    pub fn scalar(&self) -> Scalar {
        self.generated.scalar
    }

    /// Who made it of what.
    pub fn provenance(&self) -> String {
        format!("straightline {} from {}; do not edit.", crate::VERSION, comment(&self.generated.provenance.source))
    }

    /// The functions that C can call: the robot's, then those of its contact modes.
    pub fn exported(&self) -> Vec<Exported> {
        let of_robot = self.generated.items.iter().map(|item| self.export(item, None, item.function.summary()));
        let of_modes = self.generated.contact.iter().flat_map(|mode| {
            mode.items.iter().map(|item| self.export(item, Some(&mode.identifier), item.function.summary()))
        });
        of_robot.chain(of_modes).collect()
    }

    /// A function of the robot, or of a contact mode.
    fn export<F>(&self, item: &Item<F>, mode: Option<&str>, summary: &'static str) -> Exported {
        Exported::new(&item.routine, mode, summary, self.scalar())
    }

    /// The run-time parameters that functions take: name, type and number of scalars.
    pub fn bodies(&self) -> Vec<Port> {
        let mut bodies: Vec<Port> = Vec::new();
        let of_modes = self.generated.contact.iter().flat_map(|mode| &mode.items).flat_map(Item::inputs);
        for port in self.generated.items.iter().flat_map(Item::inputs).chain(of_modes) {
            if port.wrapper.is_some() && !bodies.contains(port) {
                bodies.push(port.clone());
            }
        }
        bodies
    }

    /// The free numbers of a run-time parameter that is of a drive.
    pub fn drive_numbers(&self, of: &Port) -> Option<&[DriveNumber]> {
        let parameters = &self.generated.programs.parameters;
        let found = parameters.iter().find(|p| Some(&p.type_name) == of.wrapper.as_ref())?;
        found.numbers.as_ref().map(|numbers| &numbers.numbers[..])
    }
}

impl Exported {
    /// A function as C calls it.
    pub fn new(routine: &Routine, mode: Option<&str>, summary: &'static str, scalar: Scalar) -> Exported {
        let name = routine.name.clone();
        let c_name = mode.map_or(name.clone(), |mode| format!("contact_{mode}_{name}"));
        let inputs = routine.ports.inputs.iter().map(|p| (p, false));
        let ports = inputs.chain(routine.ports.outputs.iter().map(|p| (p, true)));
        let parameter = |(port, is_output): (&Port, bool)| CParameter {
            name: port.name.clone(),
            length: port.len(),
            port: port.clone(),
            is_output,
            is_shared: port.wrapper.is_some(),
        };
        let parameters = ports.map(parameter).collect();
        Exported { c_name, name, mode: mode.map(str::to_string), summary, doc: routine.doc.clone(), scalar, parameters }
    }
}
