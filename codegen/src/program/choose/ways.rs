//! What of a reduced form is free, change by change.

use crate::equations::reduce::{lengths, longest_lever, reduce, FreeTerms};
use crate::equations::Robot;
use crate::function::{Form, Function};
use crate::options::{FormChoices, Options};
use straightline_core::reduced::Meeting;
use straightline_core::Dd;

/// Units of length that are tried, the most frequent ones.
const UNITS: usize = 24;

/// A change of one body's form; made again, it is taken back.
pub(super) type FormMove = Box<dyn Fn(&mut FreeTerms, usize)>;

/// All changes, and how many of them, the first ones, may save much.
pub(super) fn moves(options: &Options, forms: FormChoices, function: Function) -> (Vec<FormMove>, usize) {
    type Flags = fn(&mut FreeTerms) -> &mut Vec<bool>;
    // the frames in which parameters are given would have to be known where they are made
    let is_regressor = function.spec().form == Form::Regressor;
    let frames = !options.scene.has_loads() && !is_regressor;
    // a regressor is of all distributions of the same mass
    let parameters = forms.parameters && !is_regressor;
    // ways to form moments, of which H has none
    let rotations = forms.rotations && function != Function::MassMatrix;
    let all: [(bool, Flags); 13] = [
        (forms.stays, |c| &mut c.stays),
        (forms.origins && frames, |c| &mut c.origin_at_parent),
        (forms.tips && frames, |c| &mut c.turned_tips[0]),
        (forms.tips && frames, |c| &mut c.turned_tips[1]),
        (forms.tips && frames, |c| &mut c.turned_tips[2]),
        (forms.tips && frames, |c| &mut c.shifted_tips[0]),
        (forms.tips && frames, |c| &mut c.shifted_tips[1]),
        (parameters, |c| &mut c.regrouped),
        (rotations, |c| &mut c.by_axis_acceleration),
        (rotations, |c| &mut c.by_accelerations[0]),
        (rotations, |c| &mut c.by_accelerations[1]),
        (rotations, |c| &mut c.doubled[0]),
        (rotations, |c| &mut c.doubled[1]),
    ];
    let minor: [(bool, Flags); 4] = [
        (parameters, |c| &mut c.axial_balances[0]),
        (parameters, |c| &mut c.axial_balances[1]),
        (rotations, |c| &mut c.turns_sums),
        (rotations, |c| &mut c.other_acceleration),
    ];
    let flip = |(_, flag): (bool, Flags)| Box::new(move |c: &mut FreeTerms, i: usize| flag(c)[i] ^= true) as FormMove;
    let mut moves: Vec<FormMove> = all.into_iter().filter(|(free, _)| *free).map(flip).collect();
    for (kind, component) in (0..9).map(|k| (k / 3, k % 3)).filter(|_| parameters) {
        moves.push(Box::new(move |c: &mut FreeTerms, i: usize| {
            let vanishes = &mut c.vanish_at_parent[kind][i];
            *vanishes = if *vanishes == Some(component) { None } else { Some(component) };
        }));
    }
    let major = moves.len();
    moves.extend(minor.into_iter().filter(|(free, _)| *free).map(flip));
    (moves, major)
}

/// What may change.
pub(super) struct Ways {
    pub moves: Vec<FormMove>,
    /// So many of them, the first ones, may save much.
    pub major: usize,
    /// Which of them moves origins.
    pub origins: Option<usize>,
    /// How many joints stand before each body.
    pub depth: Vec<usize>,
    pub fixed_unit: bool,
    /// Whether angles of parallel joints may be added.
    pub angle_sums: bool,
    /// Whether derivatives are searched for.
    pub meets: bool,
}

impl Ways {
    pub fn deepest(&self) -> usize {
        self.depth.iter().copied().max().unwrap_or(0)
    }

    /// Other places where fields and wrenches may meet.
    pub fn meetings(&self, now: Meeting) -> Vec<Meeting> {
        if !self.meets {
            return Vec::new();
        }
        let depths = 0..=self.deepest();
        let of = |set: fn(&mut Meeting, usize)| {
            depths.clone().map(move |depth| {
                let mut other = now;
                set(&mut other, depth);
                other
            })
        };
        let all = of(|m, d| m.mass_matrix = d).chain(of(|m, d| m.lower = d)).chain(of(|m, d| m.upper = d));
        all.filter(|other| *other != now).collect()
    }

    pub fn moved(&self, choice: &FreeTerms, change: &FormMove, depth: usize) -> FreeTerms {
        let mut changed = choice.clone();
        (0..self.depth.len()).filter(|i| self.depth[*i] == depth).for_each(|i| change(&mut changed, i));
        changed
    }

    pub fn units(&self, robot: &Robot, choice: &FreeTerms) -> Vec<Dd> {
        if self.fixed_unit {
            return Vec::new();
        }
        let metres = reduce(&robot.model, &FreeTerms { unit: Dd::ONE, ..choice.clone() }).0;
        let mut units = lengths(&metres, longest_lever(&robot.model));
        units.truncate(UNITS);
        units
    }
}
