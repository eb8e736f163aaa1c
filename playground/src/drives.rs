//! Motors on the joints: what the shown motion asks of them, by the equations of the library's drives ((20.62) to (20.66) of the chapter), with the joint
//! torques that the robot's own functions gave.

use crate::base64;
use crate::bench::{read_robot, BenchRequest};
use crate::motion::SwingRows;
use serde::{Deserialize, Serialize};
use straightline_core::algorithms::{drive_demands, inverse_dynamics, inverse_orders, reads_states};
use straightline_core::drive::{Actuator, Drive};
use straightline_core::model::{Joint, Model};
use straightline_core::Taylor;

/// A geared motor on a joint, as the page's sliders have it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JointMotor {
    /// The joint.
    pub joint: String,
    /// Speed of the motor per speed of the joint \[1 or rad/m\].
    pub ratio: f64,
    /// C_M \[N·m/A\].
    pub torque_constant: f64,
    /// R \[Ω\].
    pub resistance: f64,
    /// J \[kg·m²\].
    pub rotor_inertia: f64,
    /// Greatest voltage \[V\].
    pub voltage: f64,
    /// Greatest current \[A\].
    pub current: f64,
    /// Thermal resistance from the winding to the air \[K/W\].
    pub thermal_resistance: f64,
}

/// The air \[°C\], and what a winding bears.
const AIR: f64 = 25.0;
const HOTTEST: f64 = 155.0;

/// Of a made-up motor: how many times what the motion asks of it it bears, or what its joint bears where that is less; and at least so much \[N·m or N\].
const MARGIN: f64 = 2.5;
const LEAST_EFFORT: f64 = 1.0;

impl JointMotor {
    /// A made-up motor for a joint that is asked for this at most.
    pub fn assumed(joint: &Joint, asked: f64) -> JointMotor {
        let limit = Some(joint.limits.effort).filter(|effort| *effort > 0.0).unwrap_or(f64::INFINITY);
        let effort = (MARGIN * asked).min(limit).max(LEAST_EFFORT);
        let ratio = if joint.kind.slides() { 400.0 } else { 100.0 };
        let current = 15.0;
        let torque_constant = two_digits(effort / (ratio * current));
        // motors that are alike: resistance and inertia of rotors grow with the torque constant
        let size = torque_constant / 0.05;
        JointMotor {
            joint: joint.name.clone(),
            ratio,
            torque_constant,
            resistance: two_digits(0.5 * size.clamp(0.1, 40.0)),
            rotor_inertia: two_digits(3e-5 * size),
            voltage: 48.0,
            current,
            thermal_resistance: 3.0,
        }
    }

    /// Its table in a scene.
    fn table(&self) -> String {
        let JointMotor {
            joint,
            ratio,
            torque_constant,
            resistance,
            rotor_inertia,
            voltage,
            current,
            thermal_resistance,
        } = self;
        let half = 0.5 * thermal_resistance;
        format!(
            "\n[[drive]]\njoint = {}\nratio = {ratio:?}\nlimits = {{ input = {voltage:?}, current = {current:?} }}\n[drive.motor]\n\
             torque_constant = {torque_constant:?}\nresistance = {resistance:?}\nrotor_inertia = {rotor_inertia:?}\n\
             thermal = {{ winding_housing = {half:?}, housing_ambient = {half:?}, winding_time = 20.0, housing_time = 600.0, ambient = {AIR:?}, limit = {HOTTEST:?} }}\n",
            quoted(joint)
        )
    }
}

fn two_digits(x: f64) -> f64 {
    format!("{x:.1e}").parse().unwrap_or(x)
}

/// A string of TOML.
pub fn quoted(text: &str) -> String {
    serde_json::Value::from(text).to_string().replace('\u{7f}', "\\u007f")
}

/// The tables of all motors.
pub fn tables(motors: &[JointMotor]) -> String {
    motors.iter().map(JointMotor::table).collect()
}

/// Motors for all joints with one coordinate, of a robot that has none, as its motion asks for.
pub fn assumed(model: &Model<f64>, rows: &SwingRows) -> Vec<JointMotor> {
    if !(model.drives.is_empty() && model.closure.is_empty()) {
        return Vec::new();
    }
    let mut asked = vec![0.0f64; model.nv()];
    for [q, qd, qdd] in &rows.states {
        let tau = inverse_dynamics(model, q, qd, qdd);
        asked.iter_mut().zip(tau).for_each(|(most, x)| *most = most.max(x.abs()));
    }
    let joints = model.independent_joints().filter(|joint| joint.kind.is_single());
    joints.map(|joint| JointMotor::assumed(joint, asked[joint.iv])).collect()
}

/// Torques that the robot's functions gave.
#[derive(Clone, Debug, Deserialize)]
pub struct DrivesRequest {
    /// The robot, as it was asked for.
    #[serde(flatten)]
    pub bench: BenchRequest,
    /// τ, row by row, as base64 of f64.
    pub tau: String,
}

/// What the drives do, row by row.
#[derive(Clone, Debug, Default, Serialize)]
pub struct DrivesAnswer {
    /// Of each drive what it bears.
    pub drives: Vec<DriveLimits>,
    /// Currents \[A\], voltages \[V\], speeds of motors \[rad/s\] and Joule heat \[W\], each drive by drive, row by row, as base64 of f64.
    pub current: String,
    /// See there.
    pub input: String,
    /// See there.
    pub speed: String,
    /// See there.
    pub joule: String,
    /// Why there is nothing, if so.
    pub why_not: Option<String>,
}

/// What a drive bears.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct DriveLimits {
    /// Its name.
    pub name: String,
    /// Greatest |u| \[V\].
    pub input: Option<f64>,
    /// Greatest |i| \[A\].
    pub current: Option<f64>,
    /// Greatest speed \[rad/s\].
    pub speed: Option<f64>,
    /// Greatest root of the mean square of the current \[A\].
    pub continuous_current: Option<f64>,
    /// Kelvin of the winding above the air per watt of heat that lasts, the air, and the hottest winding \[°C\].
    pub thermal: Option<(f64, f64, Option<f64>)>,
}

fn limits(drive: &Drive<f64>) -> DriveLimits {
    let thermal = drive.rating.thermal.as_ref();
    DriveLimits {
        name: drive.name.clone(),
        input: drive.input_limit,
        current: drive.current_limit,
        speed: drive.rating.speed,
        continuous_current: drive.rating.continuous_current,
        thermal: thermal.map(|t| (t.winding_housing + t.housing_ambient, t.ambient, t.limit)),
    }
}

/// What a motion asks of the drives of a robot.
pub fn answer(request: DrivesRequest) -> DrivesAnswer {
    let refused = |why: &str| DrivesAnswer { why_not: Some(why.to_string()), ..DrivesAnswer::default() };
    let Ok(robot) = read_robot(&request.bench) else { return refused("the robot cannot be read") };
    let model = &robot.model;
    let Some(tau) = base64::numbers(&request.tau) else { return refused("the torques are no numbers") };
    let rows = &robot.rows.states;
    if model.drives.is_empty() {
        return refused("the robot has no motors");
    }
    if tau.len() != rows.len() * model.nv() {
        return refused("there is not one torque per joint and instant");
    }
    let follows_at_once = inverse_orders(&model.drives).is_some_and(|orders| orders.of_torque == 0);
    if !follows_at_once || reads_states(&model.drives) {
        return refused("these drives have inductances or elastic transmissions, which need further derivatives: `straightline analyze` has them");
    }
    // of each quantity drive by drive, row by row
    let mut found = [const { Vec::new() }; 4].map(|none| vec![none; model.drives.len()]);
    for (row, [q, qd, qdd]) in rows.iter().enumerate() {
        let own = &tau[row * model.nv()..(row + 1) * model.nv()];
        let demands = drive_demands::<f64, 1>(1, model, q, &[qd, qdd], &[], |_, _, _, _| {
            own.iter().map(|force| Taylor::fixed(*force)).collect()
        });
        for (k, (drive, demand)) in model.drives.iter().zip(&demands).enumerate() {
            let current = demand.current.unwrap_or(0.0);
            let heat = match &drive.actuator {
                Actuator::Motor(motor) => motor.resistance * current * current,
                Actuator::Linear(_) => 0.0,
            };
            let all = [current, demand.input, demand.shafts[0][1], heat];
            found.iter_mut().zip(all).for_each(|(columns, x)| columns[k].push(x));
        }
    }
    let [current, input, speed, joule] = found.map(|columns| base64::of_numbers(columns.iter().flatten()));
    DrivesAnswer { drives: model.drives.iter().map(limits).collect(), current, input, speed, joule, why_not: None }
}
