//! The least robot that still fails.

use super::numbers::significant;
use super::{Inertial, Motion, Written};

/// So many robots are tried at most.
const TRIES: usize = 600;

impl Written {
    /// The robot with fewer joints and simpler numbers that still fails: greedy, one change after the other.
    pub fn shrunk(&self, mut fails: impl FnMut(&Written) -> bool) -> Written {
        let (mut least, mut tries) = (self.clone(), 0);
        'simpler: loop {
            for simpler in least.simpler() {
                if simpler == least {
                    continue;
                }
                if tries == TRIES {
                    return least;
                }
                tries += 1;
                if fails(&simpler) {
                    least = simpler;
                    continue 'simpler;
                }
            }
            return least;
        }
    }

    /// Robots that are simpler by one change, the greatest changes first.
    fn simpler(&self) -> Vec<Written> {
        let mut found = Vec::new();
        for i in (1..self.links.len()).rev() {
            found.push(self.without(i));
        }
        let mut changed = |change: &dyn Fn(&mut Written)| {
            let mut robot = self.clone();
            change(&mut robot);
            if robot != *self {
                found.push(robot);
            }
        };
        changed(&|r| r.floating = false);
        changed(&|r| r.toml = false);
        for i in 0..self.links.len() {
            changed(&|r| r.links[i].inertial = None);
            changed(&|r| r.links[i].limits = None);
            changed(&|r| r.links[i].friction = [0.0; 2]);
            changed(&|r| r.links[i].xyz = [0.0; 3]);
            changed(&|r| r.links[i].rpy = [0.0; 3]);
            changed(&|r| r.links[i].axis = [0.0, 0.0, 1.0]);
            for motion in [Motion::Fixed, Motion::Revolute] {
                let simpler = motion == Motion::Fixed || self.links[i].motion != Motion::Fixed;
                if simpler {
                    changed(&|r| r.links[i].motion = motion);
                }
            }
            if self.links[i].inertial.is_some() {
                let all =
                    |change: fn(&mut Inertial)| move |r: &mut Written| r.links[i].inertial.as_mut().map_or((), change);
                changed(&all(|b| b.rpy = [0.0; 3]));
                changed(&all(|b| b.com = [0.0; 3]));
                changed(&all(|b| b.mass = 1.0));
                changed(&all(|b| b.inertia = [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]));
                changed(&all(|b| b.inertia[3..].fill(0.0)));
            }
        }
        let numbers = self.clone().numbers().len();
        for k in 0..numbers {
            changed(&|r| *r.numbers()[k] = 0.0);
            changed(&|r| *r.numbers()[k] = 1.0);
            for digits in 1..=3 {
                changed(&|r| {
                    let x = &mut *r.numbers()[k];
                    // a number of so few digits stays what it is, as otherwise this would not end
                    *x = significant(*x, digits);
                });
            }
        }
        found
    }

    /// Without a link; what it carries hangs on its parent.
    fn without(&self, i: usize) -> Written {
        let mut robot = self.clone();
        let parent = robot.links[i].parent;
        robot.links.remove(i);
        for link in &mut robot.links {
            if link.parent == i {
                link.parent = parent;
            }
            if link.parent > i {
                link.parent -= 1;
            }
        }
        robot
    }

    /// All numbers that may be simpler; those that are 0 or 1 are.
    fn numbers(&mut self) -> Vec<&mut f64> {
        let mut numbers: Vec<&mut f64> = Vec::new();
        for link in &mut self.links {
            numbers.extend(link.xyz.iter_mut().chain(&mut link.rpy).chain(&mut link.axis));
            if let Some(Inertial { mass, com, rpy, inertia }) = &mut link.inertial {
                numbers.push(mass);
                numbers.extend(com.iter_mut().chain(rpy).chain(inertia));
            }
        }
        numbers.retain(|x| **x != 0.0 && **x != 1.0);
        numbers
    }
}
