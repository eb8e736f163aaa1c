//! What makes run-time parameters in C, checked: the ten inertial parameters of a body, numbers of a drive.

use super::interface::Interface;
use super::routine::{c_number, C99, STATIC};
use crate::description::drives::DriveNumber;
use crate::emit::lower::Names;
use crate::emit::module::{ParameterOf, ParameterType};
use crate::emit::target::Target;
use std::fmt::Write;

impl Interface<'_> {
    /// What makes a parameter, and its program before it.
    pub(super) fn constructor_source(&self, parameter: &ParameterType) -> String {
        let target = C99 { prefix: self.prefix, module: String::new(), table: STATIC };
        let program = target.routine(&parameter.constructor);
        let made = match &parameter.of {
            ParameterOf::Body(_) => self.body_source(parameter),
            ParameterOf::Drive(_, numbers) => self.drive_source(parameter, &numbers.numbers),
        };
        format!("{program}\n{made}")
    }

    fn body_source(&self, parameter: &ParameterType) -> String {
        let ParameterType { input, scalars, constructor, .. } = parameter;
        let (prefix, t) = (self.prefix, self.scalar().c_name());
        let (of_scalar, program) = (self.scalar().name(), &constructor.name);
        // the parameter has a name that people chose
        let names = Names::with_taken([input.as_str(), "mass", "com", "inertia"]);
        let (why, masses) = (names.free("why"), names.free("masses"));
        format!(
            "int {prefix}_{input}_new({t} mass, const {t} com[3], const {t} inertia[6], {t} {input}[{scalars}])\n\
             {{\n    const int {why} = {prefix}_check_inertia_{of_scalar}(mass, com, inertia);\n    \
             if ({why} == 0) {{\n        const {t} {masses}[1] = {{mass}};\n        \
             {prefix}_{program}({masses}, com, inertia, {input});\n    }}\n    return {why};\n}}\n"
        )
    }

    fn drive_source(&self, parameter: &ParameterType, numbers: &[DriveNumber]) -> String {
        let ParameterType { input, scalars, constructor, .. } = parameter;
        let (prefix, t, scalar, n) = (self.prefix, self.scalar().c_name(), self.scalar(), numbers.len());
        let is_finite = format!("{prefix}_is_finite_{}", scalar.name());
        let arguments: String = numbers.iter().map(|n| format!("{t} {}, ", n.name)).collect();
        let given: Vec<&str> = numbers.iter().map(|n| n.name.as_str()).collect();
        let mut out = format!(
            "int {prefix}_{input}_new({arguments}{t} made[{scalars}])\n{{\n    const {t} numbers[{n}] = {{{}}};\n    \
             {t} parameters[{scalars}];\n    int why = 0;\n    ",
            given.join(", ")
        );
        for (k, number) in numbers.iter().enumerate() {
            let name = &number.name;
            let holds = number.quantity.at_run_time.comparisons().iter().map(|(how, with)| {
                let with = c_number(*with, scalar);
                match *how {
                    "!=" => format!("(({name} < {with}) || ({name} > {with}))"),
                    how => format!("({name} {how} {with})"),
                }
            });
            let holds: Vec<String> = [format!("{is_finite}({name})")].into_iter().chain(holds).collect();
            let _ = write!(out, "if (!({})) {{\n        why = {};\n    }} else ", holds.join(" && "), k + 1);
        }
        let _ = writeln!(out, "{{\n        {prefix}_{}(numbers, parameters);", constructor.name);
        let finite: Vec<String> = (0..*scalars).map(|k| format!("{is_finite}(parameters[{k}])")).collect();
        let _ = writeln!(out, "        if ({}) {{", finite.join("\n            && "));
        for k in 0..*scalars {
            let _ = writeln!(out, "            made[{k}] = parameters[{k}];");
        }
        let _ =
            write!(out, "        }} else {{\n            why = {};\n        }}\n    }}\n    return why;\n}}\n", n + 1);
        out
    }
}
