//! Actuators: the greatest force of each joint. Their commands and gains are no part of the equations.

use super::classes::Defaulted;
use super::files::{Attribute, Element};
use super::Mjcf;
use crate::description::Noted;
use std::collections::BTreeMap;

/// What the actuators of a joint can do together; `None`: there is no bound.
type Efforts<'s> = BTreeMap<usize, (Option<f64>, &'s Attribute)>;

impl<'s> Mjcf<'s> {
    /// Reads the sections of actuators.
    pub fn read_actuators(&mut self) {
        let mut efforts: Efforts<'s> = BTreeMap::new();
        for element in self.within("actuator") {
            self.read_actuator(element, &mut efforts);
        }
        for (joint, (effort, attribute)) in efforts {
            let Some(effort) = effort else { continue };
            let place = self.place(attribute);
            let own = &mut self.robot.joints[joint].limits.effort;
            if own.as_ref().is_none_or(|own| effort < own.value) {
                *own = Some(Noted::new(effort, place));
            }
        }
    }

    fn read_actuator(&mut self, element: &'s Element, efforts: &mut Efforts<'s>) {
        let given = self.given_outermost(element, "actuator");
        let owner = match element.attribute("name") {
            Some(name) => format!("actuator `{}`", name.value),
            None => "an actuator".to_string(),
        };
        for name in ["armature", "damping"] {
            let help = "write it of the joint, times the square of the gear";
            self.refuse_number(&given, name, &owner, "it would act on what the actuator moves", help);
        }
        let joint = element.attribute("joint").or(element.attribute("jointinparent"));
        let index = joint.and_then(|joint| self.robot.joints.iter().position(|own| own.name.value == joint.value));
        let (Some(joint), Some(index)) = (joint, index) else {
            self.ignore_as(&format!("actuator {}", element.name), element);
            return;
        };
        self.robot.actuated.push(joint.value.clone());
        let force = self.greatest_force(&given, &owner);
        if force.is_none() {
            self.ignore_as(&format!("actuator {}", element.name), element);
        }
        let gear = self.first_of(&given, "gear", &owner).unwrap_or(1.0).abs();
        let force = force.map(|force| force * gear);
        let entry = efforts.entry(index).or_insert((Some(0.0), joint));
        entry.0 = entry.0.zip(force).map(|(sum, force)| sum + force);
    }

    /// The greatest force before the gear: that of its range, or that of the greatest command.
    fn greatest_force(&mut self, given: &Defaulted<'s>, owner: &str) -> Option<f64> {
        let mut greatest = |word: &str, range: &str| {
            let is_limited = self.is_limited(given, word, range);
            let [lower, upper] = self.some_numbers::<2>(given, range, owner).filter(|_| is_limited)?;
            Some(lower.abs().max(upper.abs()))
        };
        let force = greatest("forcelimited", "forcerange");
        let command = greatest("ctrllimited", "ctrlrange");
        let is = |name: &str, word: &str| given.attribute(name).is_none_or(|value| value.value.trim() == word);
        let gain = match given.element.name.as_str() {
            "motor" => Some(1.0),
            "general" if is("gaintype", "fixed") && is("biastype", "none") => {
                Some(self.first_of(given, "gainprm", owner).unwrap_or(1.0).abs())
            }
            _ => None,
        };
        let by_command = command.zip(gain).map(|(command, gain)| command * gain);
        match (force, by_command) {
            (Some(a), Some(b)) => Some(a.min(b)),
            (a, b) => a.or(b),
        }
    }

    fn first_of(&mut self, given: &Defaulted<'s>, name: &str, owner: &str) -> Option<f64> {
        let attribute = given.attribute(name)?;
        let numbers = self.numbers(&format!("{name} of {owner}"), attribute, 1, usize::MAX)?;
        numbers.first().copied()
    }
}
