//! Run-time parameters: their types, and the constructors that make them.

use super::{Around, BlockReading};
use crate::description::drives::{DriveNumber, Must};
use crate::program::written::DriveNumbers;
use crate::readback::items::Sort;
use straightline_core::Dd;
use straightline_graph::expr::Port;

impl Around<'_, '_, '_> {
    /// Types of run-time parameters.
    pub(super) fn parameters(&mut self) -> BlockReading<()> {
        let (root, s) = (self.root, self.scalar().name());
        for parameter in &self.generated.programs.parameters {
            let (name, function) = (&parameter.type_name, &parameter.program.name);
            let n: usize = parameter.program.graph.outputs.iter().map(Port::len).sum();
            self.is(root, Sort::Struct, name, &format!("pub struct {name}([{s}; {n}]);"))?;
            if let Some(numbers) = &parameter.numbers {
                self.drive(name, function, numbers)?;
                continue;
            }
            let text = format!(
                "impl {name} {{
                    pub const NONE: {name} = {name}([0.0; {n}]);
                    pub fn new(mass: {s}, com: [{s}; 3], inertia: [{s}; 6]) -> Result<{name}, Unphysical> {{
                        check_inertia(mass, &com, &inertia)?;
                        let mut parameters = [mass; {n}];
                        {function}(&[mass], &com, &inertia, &mut parameters);
                        Ok({name}(parameters))
                    }}
                }}"
            );
            self.is(root, Sort::Impl, name, &text)?;
        }
        Ok(())
    }

    /// The types around the free numbers of a drive.
    pub(super) fn drive(&mut self, name: &str, function: &str, numbers: &DriveNumbers) -> BlockReading<()> {
        let (root, s, n) = (self.root, self.scalar().name(), numbers.nominal.len());
        let (all, of_numbers) = (&numbers.numbers, format!("{name}Numbers"));
        let first = &all[0].name;
        let written = |x: Dd| self.scalar().literal(self.scalar().nearest(x));
        let each = |text: &dyn Fn(&DriveNumber) -> String| all.iter().map(text).collect::<Vec<_>>();
        let fields: String = each(&|x| format!("pub {}: {s},", x.name)).concat();
        let values = each(&|x| format!("{}: {}", x.name, written(Dd::from(x.value)))).join(", ");
        let given = each(&|x| format!("numbers.{}", x.name)).join(", ");
        let nominal = numbers.nominal.iter().map(|x| written(*x)).collect::<Vec<_>>().join(", ");
        let checks: String = each(&|x| {
            let (name, must) = (&x.name, x.quantity.at_run_time);
            let of = format!("numbers.{name}");
            let (condition, be) = match must {
                Must::BePositive => (format!("{of} > 0.0"), "positive"),
                Must::NotBeNegative => (format!("{of} >= 0.0"), "zero or positive"),
                Must::NotBeZero => (format!("{of} != 0.0"), "not zero"),
                Must::BeAnEfficiency => (format!("{of} > 0.0 && {of} <= 1.0"), "above 0 and at most 1"),
            };
            format!("check_number(\"{name}\", {of}, {condition}, \"{be}\")?;")
        })
        .concat();
        let default =
            |name: &str| format!("impl Default for {name} {{ fn default() -> {name} {{ {name}::NOMINAL }} }}");
        let types = [
            (Sort::Struct, &of_numbers[..], format!("pub struct {of_numbers} {{ {fields} }}")),
            (
                Sort::Impl,
                &of_numbers,
                format!("impl {of_numbers} {{ pub const NOMINAL: {of_numbers} = {of_numbers} {{ {values} }}; }}"),
            ),
            (Sort::ImplOf, &of_numbers, default(&of_numbers)),
            (
                Sort::Impl,
                name,
                format!(
                    "impl {name} {{
                        pub const NOMINAL: {name} = {name}([{nominal}]);
                        pub fn new(numbers: {of_numbers}) -> Result<{name}, OutOfRange> {{
                            {checks}
                            let mut parameters = [numbers.{first}; {n}];
                            {function}(&[{given}], &mut parameters);
                            check_number(\"numbers\", 0.0, parameters.iter().all(|x| x.is_finite()),
                                \"of such sizes that what follows from them is finite\")?;
                            Ok({name}(parameters))
                        }}
                    }}"
                ),
            ),
            (Sort::ImplOf, name, default(name)),
        ];
        for (sort, name, text) in types {
            self.is(root, sort, name, &text)?;
        }
        Ok(())
    }
}
