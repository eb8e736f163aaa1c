//! States and inputs of drives: verification gives them numbers of their own, currents within their limits, inputs also beyond.

use super::last_shaft;
use straightline_core::drive::Actuator;
use straightline_core::model::Model;
use straightline_core::random::Random;
use straightline_core::Dd;

/// Motors are tried up to this current or their limit, whichever is less \[A\].
const CURRENT: f64 = 3.0;
/// A drive without a limit of its input is tried up to so much \[V\].
const VOLTAGE: f64 = 20.0;

/// States and inputs of the drives: shafts are near where slack springs have them.
pub(crate) fn of_drives(model: &Model<Dd>, q: &[f64], qd: &[f64], random: &mut Random) -> [Vec<f64>; 2] {
    let (mut x, mut u) = (Vec::new(), Vec::new());
    for drive in &model.drives {
        let mut shafts = vec![last_shaft(model, drive, q, qd)];
        for stage in drive.stages.iter().rev() {
            let behind = shafts[shafts.len() - 1];
            let slack = [random.symmetric(0.01), random.symmetric(0.1)];
            shafts.push([0, 1].map(|i| (behind[i] + slack[i]) * stage.ratio.to_f64()));
        }
        shafts.reverse();
        match &drive.actuator {
            Actuator::Motor(motor) => {
                let greatest = drive.current_limit.map_or(CURRENT, |limit| limit.to_f64().min(CURRENT));
                x.extend(shafts[0]);
                x.extend(motor.inductance.map(|_| random.symmetric(0.9 * greatest)));
            }
            Actuator::Linear(a) => x.extend(a.f.iter().map(|_| random.symmetric(1.0))),
        }
        x.extend(shafts.iter().take(drive.stages.len()).skip(1).flatten());
        u.push(random.symmetric(drive.input_limit.map_or(VOLTAGE, |limit| 1.2 * limit.to_f64())));
    }
    [x, u]
}
