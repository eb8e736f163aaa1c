//! Drives as TOML.

use super::number;
use super::toml::{array, string};
use crate::description::drives::{TransmissionStage, WrittenActuator, WrittenDrive, WrittenRating};
use std::fmt::Write;

/// A table `[[drive]]`.
pub fn of_drive(drive: &WrittenDrive) -> String {
    let mut out = format!("\n[[drive]]\nname = {}\n", string(&drive.name.value));
    match &drive.joints[..] {
        [(joint, ratio)] => _ = writeln!(out, "joint = {}\nratio = {}", string(&joint.value), number(*ratio)),
        joints => {
            let each: Vec<String> =
                joints.iter().map(|(joint, ratio)| format!("{} = {}", string(&joint.value), number(*ratio))).collect();
            _ = writeln!(out, "joints = {}", table(&each));
        }
    }
    out += &of_actuator(&drive.actuator, &drive.rating);
    if !drive.stages.is_empty() {
        let stages: Vec<String> = drive.stages.iter().map(|stage| format!("    {},\n", of_stage(stage))).collect();
        _ = writeln!(out, "stages = [\n{}]", stages.concat());
    }
    if let Some(both) = &drive.efficiency {
        _ = writeln!(out, "efficiency = {}", of_efficiency(both));
    }
    let limits = [
        entry("input", drive.input_limit),
        entry("current", drive.current_limit),
        entry("continuous_current", drive.rating.continuous_current),
        entry("speed", drive.rating.speed),
    ];
    let limits: Vec<String> = limits.into_iter().flatten().collect();
    if !limits.is_empty() {
        _ = writeln!(out, "limits = {}", table(&limits));
    }
    if let Some((link, axis, inertia)) = &drive.rotor {
        let link = string(&link.value);
        _ = writeln!(out, "rotor = {{ link = {link}, axis = {}, inertia = {} }}", array(axis), number(*inertia));
    }
    out
}

fn table(entries: &[String]) -> String {
    format!("{{ {} }}", entries.join(", "))
}

fn entry(key: &str, value: Option<f64>) -> Option<String> {
    value.map(|value| format!("{key} = {}", number(value)))
}

fn of_efficiency([forward, backward]: &[f64; 2]) -> String {
    format!("{{ forward = {}, backward = {} }}", number(*forward), number(*backward))
}

fn of_actuator(actuator: &WrittenActuator, rating: &WrittenRating) -> String {
    match actuator {
        WrittenActuator::Motor { torque_constant, emf_constant, resistance, inductance, rotor_inertia, friction } => {
            let mut entries: Vec<String> = [
                ("torque_constant", Some(*torque_constant)),
                ("emf_constant", Some(*emf_constant)),
                ("resistance", Some(*resistance)),
                ("inductance", *inductance),
                ("rotor_inertia", Some(*rotor_inertia)),
                ("friction", Some(*friction)),
            ]
            .into_iter()
            .filter_map(|(key, value)| entry(key, value))
            .collect();
            if let Some(thermal) = &rating.thermal {
                let thermal = [
                    ("winding_housing", Some(thermal.winding_housing)),
                    ("housing_ambient", Some(thermal.housing_ambient)),
                    ("winding_time", Some(thermal.winding_time)),
                    ("housing_time", Some(thermal.housing_time)),
                    ("ambient", Some(thermal.ambient)),
                    ("limit", thermal.limit),
                ];
                let thermal: Vec<String> = thermal.into_iter().filter_map(|(key, value)| entry(key, value)).collect();
                entries.push(format!("thermal = {}", table(&thermal)));
            }
            format!("motor = {}\n", table(&entries))
        }
        WrittenActuator::Linear { c, f, d, t, position } => {
            let rows: Vec<String> = c.value.chunks(f.len().max(1)).map(array).collect();
            let mut entries = vec![format!("C = [{}]", rows.join(", "))];
            entries.extend([("f", f), ("d", d), ("T", t)].map(|(key, row)| format!("{key} = {}", array(row))));
            entries.extend(position.as_ref().map(|row| format!("position = {}", array(row))));
            format!("actuator = {}\n", table(&entries))
        }
    }
}

fn of_stage(stage: &TransmissionStage) -> String {
    let TransmissionStage { ratio, stiffness, damping, input_inertia, output_inertia, efficiency } = stage;
    let numbers = [
        ("ratio", Some(ratio.value)),
        ("stiffness", *stiffness),
        ("damping", *damping),
        ("input_inertia", Some(*input_inertia)),
        ("output_inertia", Some(*output_inertia)),
    ];
    let mut entries: Vec<String> = numbers.into_iter().filter_map(|(key, value)| entry(key, value)).collect();
    entries.extend(efficiency.as_ref().map(|both| format!("efficiency = {}", of_efficiency(both))));
    table(&entries)
}
