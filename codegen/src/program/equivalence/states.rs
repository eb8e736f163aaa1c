//! The states at which programs and plain equations are compared.

use super::{plainly_constructed, PortState};
use crate::equations::Robot;
use crate::function::Quantity;
use crate::model::states::{assembled, body, of_port, settle};
use crate::options::Options;
use crate::scene::free_drive::FreeDrive;
use std::f64::consts::PI;
use straightline_core::random::Random;
use straightline_core::Dd;
use straightline_graph::expr::Port;

/// Near the zero configuration, where robots are tried first, coordinates and rates are within this.
const NEAR: f64 = 1e-3;
/// Where random numbers begin: another place than where states for choices come from.
const SEED: u64 = 0x6a09_e667_f3bc_c908;

/// From what short numbers leave open, to nothing in double-double.
const CLOSING_STEPS: usize = 4;

/// Random states that the inputs allow, the same everywhere: every other one is fast.
pub(super) struct States<'a> {
    robot: &'a Robot,
    options: &'a Options,
    pub random: Random,
    count: usize,
}

/// Where a robot stands.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum StatePlace {
    /// Within the limits of its joints.
    Anywhere,
    /// Whatever the limits.
    Beyond,
    NearZero,
    /// At rest, too.
    Zero,
}

impl StatePlace {
    /// Coordinates or rates from anywhere, brought there.
    fn of(self, quantity: Quantity, values: Vec<f64>, random: &mut Random) -> Vec<f64> {
        let times = |factor: f64| values.iter().map(|x| factor * x).collect();
        match self {
            StatePlace::Beyond if quantity.is_configuration() => values.iter().map(|_| random.symmetric(PI)).collect(),
            StatePlace::Anywhere | StatePlace::Beyond => values,
            StatePlace::NearZero => times(NEAR),
            StatePlace::Zero => times(0.0),
        }
    }
}

impl<'a> States<'a> {
    pub fn new(robot: &'a Robot, options: &'a Options) -> Self {
        States { robot, options, random: Random(SEED), count: 0 }
    }

    pub fn next(&mut self, ports: &[Port]) -> PortState {
        self.placed(ports, StatePlace::Anywhere)
    }

    pub fn placed(&mut self, ports: &[Port], place: StatePlace) -> PortState {
        let model = &self.robot.model;
        self.count += 1;
        let fast = self.count.is_multiple_of(2);
        let mut state = PortState::new();
        let (mut plain, mut values) = (Vec::new(), Vec::new());
        for port in ports {
            if port.wrapper.is_some() {
                state.insert(port.name.clone(), self.parameter(port));
                continue;
            }
            values.push(self.of_port(port, fast, place));
            plain.push(port.clone());
        }
        settle(model, &plain, &mut values, &mut self.random);
        // numbers that all scalars hold
        let short = |x: f64| Dd::from(f64::from(x as f32));
        let names = plain.into_iter().map(|port| port.name);
        state.extend(names.zip(values).map(|(name, x)| (name, x.into_iter().map(short).collect())));
        // of length one in double-double, too
        for joint in model.free_joints().filter(|j| !j.kind.is_single()) {
            for name in Quantity::of_positions().map(Quantity::name) {
                let Some(q) = state.get_mut(&name) else { continue };
                let own = &mut q[joint.iq..joint.iq + joint.kind.nq()];
                if place == StatePlace::Zero {
                    own.iter_mut().zip(joint.kind.row().neutral).for_each(|(q, neutral)| *q = Dd::from(*neutral));
                }
                joint.kind.normalise(own);
            }
        }
        // loops close in double-double
        for name in Quantity::of_positions().map(Quantity::name).filter(|_| !model.closure.is_empty()) {
            let Some(q) = state.get_mut(&name) else { continue };
            *q = model.close_loops(q, CLOSING_STEPS).0;
        }
        state
    }

    /// What functions take of a run-time parameter.
    fn parameter(&mut self, port: &Port) -> Vec<Dd> {
        let parameter = self.options.scene.parameters.iter().find(|p| p.input_name() == port.name);
        let parameter = parameter.expect("a parameter per input with a type of its own");
        let given = self.given(parameter);
        match parameter.is_of(&self.robot.model) {
            true => plainly_constructed(self.robot, parameter, &given).into_iter().map(|x| x.wide.value).collect(),
            false => vec![Dd::ZERO; port.len()],
        }
    }

    fn of_port(&mut self, port: &Port, fast: bool, place: StatePlace) -> Vec<f64> {
        let ends = |ends: &[&str]| ends.iter().any(|end| port.name.ends_with(end));
        if ends(&["_environment", "_struck", "restitution"]) {
            return (0..port.len()).map(|_| 0.5 + self.random.unit()).collect();
        }
        if ends(&["_axes", "_pose", "_velocity", "_acceleration", "_own"]) {
            return (0..port.len()).map(|_| self.random.symmetric(1.0)).collect();
        }
        let values = of_port(&self.robot.model, port, fast, &mut self.random);
        match Quantity::of(port) {
            Some(quantity) if quantity.is_configuration() => {
                assembled(&self.robot.model, place.of(quantity, values, &mut self.random))
            }
            Some(Quantity::Velocity) => place.of(Quantity::Velocity, values, &mut self.random),
            _ => values,
        }
    }

    /// What the constructor of a parameter may be given.
    pub fn given(&mut self, parameter: &crate::scene::Parameter) -> Vec<Vec<Dd>> {
        match FreeDrive::new(parameter, &self.robot.model) {
            Some(drive) => vec![drive.random(|| self.random.unit()).into_iter().map(Dd::from).collect()],
            None => body(&mut self.random).map(|x| x.into_iter().map(Dd::from).collect()).into(),
        }
    }
}
