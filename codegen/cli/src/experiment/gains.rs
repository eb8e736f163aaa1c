//! The table `[gains]` of an experiment: what is wanted of feedback gains. And gains over time in a file, which a controller follows with.

use super::messages as say;
use super::samples::Columns;
use super::toml::ExperimentReader;
use straightline_codegen::description::reader::Range64;
use straightline_codegen::description::table::TomlTable;
use straightline_codegen::diagnostic::{Diagnostics, Place};
use straightline_core::model::Model;
use straightline_simulation::command::Samples;
use straightline_simulation::gains::GainDemand;

/// Keys of the table.
const KEYS: [&str; 9] = [
    "period",
    "delay",
    "bandwidth",
    "damping",
    "position_error",
    "velocity_error",
    "torque",
    "mass_error",
    "start_error",
];
/// Periods of delay, at most.
const MOST_DELAY: f64 = 20.0;

impl ExperimentReader<'_> {
    /// What is wanted; `period` is that of the controller, if there is one.
    pub(super) fn gains(&mut self, table: &TomlTable, period: Option<f64>) -> GainDemand {
        self.reader.check_keys(table, &KEYS);
        let mut demand = GainDemand::of(self.model.nv());
        demand.period = self.number(table, "period", period.unwrap_or(demand.period), (1e-5, 1.0));
        demand.mass_error = self.number(table, "mass_error", demand.mass_error, (-0.9, 10.0));
        demand.delay = self.delay(table);
        for (key, of) in [
            ("bandwidth", &mut demand.bandwidth),
            ("damping", &mut demand.damping),
            ("position_error", &mut demand.position_error),
        ] {
            if let Some(given) = self.positive(table, key) {
                *of = given;
            }
        }
        demand.velocity_error = self.positive(table, "velocity_error");
        demand.torque = self.positive(table, "torque");
        demand.start_error = match self.numbers(table, "start_error", self.model.nv()).filter(|all| !all.is_empty()) {
            Some(given) => given,
            None => demand.position_error.clone(),
        };
        demand
    }

    /// Periods of delay, none where there is no such key.
    pub(super) fn delay(&mut self, table: &TomlTable) -> usize {
        let Some(delay) = self.reader.real_at(table, "delay", Range64::Finite) else { return 0 };
        if (0.0..=MOST_DELAY).contains(&delay.value) && delay.value.fract() == 0.0 {
            return delay.value as usize;
        }
        let range = format!("a whole number of periods from 0 to {MOST_DELAY}");
        let complaint = say::not_in_range(&table.what("delay"), delay.value, &range);
        self.reader.diagnostics.push(complaint.at(&delay.place));
        0
    }

    /// Numbers above zero, one per joint; of passive joints, which nobody weighs, one where there is none.
    fn positive(&mut self, table: &TomlTable, key: &str) -> Option<Vec<f64>> {
        let mut numbers = self.numbers(table, key, self.model.nv()).filter(|all| !all.is_empty())?;
        for body in self.model.independently_jointed().filter(|b| b.is_passive()) {
            let own = &mut numbers[body.joint.iv];
            *own = if *own == 0.0 { 1.0 } else { *own };
        }
        match numbers.iter().find(|x| !(1e-12..=1e12).contains(*x)) {
            None => Some(numbers),
            Some(bad) => {
                let complaint = say::not_in_range(&table.what(key), *bad, "between 1e-12 and 1e12");
                self.reader.complain(&table.get(key).map_or(table.span.clone(), |(_, span)| span), complaint);
                None
            }
        }
    }
}

/// Gains over time from samples: columns `K.JOINT.q.OTHER` and `K.JOINT.qd.OTHER`; those that are left out are zero.
pub(super) fn schedule(
    columns: &Columns,
    model: &Model<f64>,
    place: &Place,
    diagnostics: &mut Diagnostics,
) -> Option<Samples> {
    let times = columns.get("t")?.to_vec();
    let n = model.nv();
    let mut rows = vec![vec![0.0; 2 * n * n]; times.len()];
    let joints = model.joints();
    let entry = |joint: &str, kind: &str, other: &str| {
        let index = |name: &str| joints.iter().find(|j| j.name == name).map(|j| j.iv);
        let first = if kind == "q" { 0 } else { n };
        Some(index(joint)? * 2 * n + first + index(other)?)
    };
    let known: Vec<&str> = joints.iter().map(|j| j.name.as_str()).collect();
    for (name, column) in columns.columns.iter().filter(|(name, _)| name != "t") {
        // names of joints may have points in them
        let splits = name.strip_prefix("K.").into_iter().flat_map(|rest| {
            ["q", "qd"].into_iter().flat_map(move |kind| {
                let middle = format!(".{kind}.");
                let at: Vec<usize> = rest.match_indices(&middle).map(|(at, _)| at).collect();
                at.into_iter().map(move |at| (&rest[..at], kind, &rest[at + kind.len() + 2..]))
            })
        });
        match splits.into_iter().find_map(|(joint, kind, other)| entry(joint, kind, other)) {
            Some(k) => rows.iter_mut().zip(column).for_each(|(row, x)| row[k] = *x),
            None => diagnostics.push(say::column_of_no_gain(name, &known).at(place)),
        }
    }
    Some(Samples { times, rows })
}
