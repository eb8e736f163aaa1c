//! Derivatives of the motion in a contact mode and of its impact, over any scalar: what is left of the equations at what was found, where one coordinate
//! moves, solved for with their own factor ([`ContactFactors`](alg::ContactFactors)).
//!
//! What is left comes from the structured derivatives of inverse dynamics and, of the contacts, from a [`ContactSweep`](alg::ContactSweep). The plain form of the same takes dual numbers
//! through the plain equations of robot and contacts, one direction after the other.

use super::equations::{contacts, environment, supports, together, Added, CommonEquations, Footing};
use crate::equations::bind::BoundRobot;
use crate::function::{along, by_rows, ForwardDynamicsMethod, Function, SelectedRows};
use straightline_core::algorithms::{
    ContactFactors, ContactSweep, FunctionalCoordinates, HeldWrenches, MovedContact, Moving, Struck, Support,
};
use straightline_core::contact::{Contact, Object, Surface};
use straightline_core::{algorithms as alg, Dual, Real};

/// What a motion is asked about: x, which is q̈ or Δq̇, and F, which may be impulses.
pub(super) struct FoundMotion<'a, T> {
    pub x: &'a [T],
    pub force: &'a [T],
    /// Whether x is q̈: then s̈ = J x + A counts, of an impact J x alone.
    pub is_motion: bool,
}

/// How the contacts of a mode change.
pub(super) struct MovedContacts<'a, T> {
    pub footings: Vec<Footing<'a, Dual<T, 1>>>,
    /// Of s̈, or of J Δq̇.
    pub along: Vec<T>,
    /// Of Ĵᵀ F.
    pub pushed: Vec<T>,
}

impl<T: Real> MovedContacts<'_, T> {
    pub fn constrained(&self) -> FunctionalCoordinates<Dual<T, 1>> {
        together(&self.footings.iter().collect::<Vec<_>>())
    }
}

/// The contacts of a mode as they are swept.
struct SweptContacts<T> {
    sweeps: Vec<ContactSweep<T>>,
    contacts: Vec<Contact<Dual<T, 1>>>,
    forces: Vec<Vec<T>>,
    at_rest: Vec<MovedContact<T>>,
    /// Of an impact: with objects at rest, at the velocities Δq̇.
    jumps: Vec<ContactSweep<T>>,
    /// ∂(Ĵᵀ F)/∂q of wrenches that are held.
    slopes: Vec<T>,
}

fn slope<T: Real>(x: &Dual<T, 1>) -> T {
    x.derivatives[0]
}

pub(super) fn slopes<T: Real>(list: &[Dual<T, 1>]) -> Vec<T> {
    list.iter().map(slope).collect()
}

pub(super) fn fixed<T: Real>(list: &[T]) -> Vec<Dual<T, 1>> {
    list.iter().map(|x| Dual::fixed(*x)).collect()
}

fn dot<T: Real>(a: &[T], b: &[T]) -> T {
    a.iter().zip(b).fold(T::zero(), |sum, (x, y)| sum + *x * *y)
}

impl<T: Real> CommonEquations<'_, T> {
    pub fn nv(&self) -> usize {
        self.bound.model.nv()
    }

    pub fn held_inputs(&self) -> Added<Dual<T, 1>> {
        self.added.iter().map(|(name, x)| (name.clone(), fixed(x))).collect()
    }

    /// Everything about the contacts that a motion needs.
    fn swept(&self, found: &FoundMotion<T>) -> SweptContacts<T> {
        let model = &self.bound.model;
        let rest = vec![T::zero(); self.nv()];
        let motion = [&self.q()[..], &self.qd()[..], if found.is_motion { found.x } else { &rest }];
        let mut first = 0;
        let mut swept = SweptContacts {
            sweeps: Vec::new(),
            contacts: Vec::new(),
            forces: Vec::new(),
            at_rest: Vec::new(),
            jumps: Vec::new(),
            slopes: Vec::new(),
        };
        let mut held = HeldWrenches::none(model);
        for t in &self.traced {
            let m = t.footing.constrained.len();
            let force = found.force[first..first + m].to_vec();
            first += m;
            let mut contact = Contact { surface: Surface::Plane, ..t.contact.clone() }.map(Dual::fixed);
            if let Some(closed) = t.footing.closed {
                contact.surface = (self.form.moving.surface)(&closed.item.surface);
            }
            let sweep = ContactSweep::new(model, &t.contact, motion);
            let at_rest = sweep.moved(&contact, &force, None);
            held.add(&sweep, &at_rest);
            if !found.is_motion {
                let object = match &t.contact.object {
                    Object::Moving(law) => Object::Fixed(law.pose),
                    other => other.clone(),
                };
                let still = Contact { object, ..t.contact.clone() };
                swept.jumps.push(ContactSweep::new(model, &still, [self.q(), found.x, &rest]));
            }
            swept.sweeps.push(sweep);
            swept.contacts.push(contact);
            swept.forces.push(force);
            swept.at_rest.push(at_rest);
        }
        swept.slopes = held.slopes(model, &model.tree_positions(self.q()));
        swept
    }

    /// How contacts change where something moves, by what was swept; nothing moves them where nothing moves.
    fn moved(&self, swept: &SweptContacts<T>, moving: Option<Moving>) -> MovedContacts<'_, T> {
        let nv = self.nv();
        let mut all = MovedContacts { footings: Vec::new(), along: Vec::new(), pushed: vec![T::zero(); nv] };
        if let Some(Moving::Position(k)) = moving {
            all.pushed = (0..nv).map(|i| swept.slopes[i * nv + k]).collect();
        }
        let inputs = self.held_inputs();
        for (c, t) in self.traced.iter().enumerate() {
            let (sweep, contact, force) = (&swept.sweeps[c], &swept.contacts[c], &swept.forces[c]);
            let felt = moving.filter(|m| match m {
                Moving::Position(k) | Moving::Velocity(k) => sweep.feels(*k),
            });
            let moved = match felt {
                Some(_) => sweep.moved(contact, force, felt),
                None => swept.at_rest[c].clone(),
            };
            if felt.is_some() {
                sweep.add_changes(&moved, &mut all.pushed);
            }
            all.along.extend(match swept.jumps.get(c) {
                None => slopes(&moved.coordinates.bias),
                Some(jump) => match felt {
                    // J does not know q̇
                    Some(Moving::Position(_)) => slopes(&jump.moved(contact, force, felt).coordinates.rate),
                    _ => vec![T::zero(); moved.coordinates.len()],
                },
            });
            all.footings.push(Footing {
                closed: t.footing.closed,
                constrained: moved.coordinates,
                environment: t.footing.closed.and_then(|closed| environment(closed, &inputs)),
            });
        }
        all
    }

    /// The same by dual numbers through the plain equations of the contacts.
    fn moved_plainly(&self, found: &FoundMotion<T>, moving: Option<Moving>) -> MovedContacts<'_, T> {
        let (bound, f) = (self.bound, Dual::<T, 1>::fixed);
        let mut arguments: Vec<Vec<Dual<T, 1>>> = bound.arguments.iter().map(|x| fixed(x)).collect();
        match moving {
            Some(Moving::Position(k)) => arguments[0] = along(&bound.model, self.q(), k),
            Some(Moving::Velocity(k)) => arguments[1][k] = Dual::variable(self.qd()[k], 0),
            None => {}
        }
        let (reduced, composite) = (bound.reduced.map(f), bound.composite.map(f));
        let moving = BoundRobot { model: bound.model.map(f), reduced, composite, arguments };
        let traced = contacts(self.robot, self.mode, &moving, &self.held_inputs(), self.form.moving);
        let mut all = MovedContacts { footings: Vec::new(), along: Vec::new(), pushed: vec![T::zero(); self.nv()] };
        let mut first = 0;
        for t in traced {
            let constrained = &t.footing.constrained;
            for (row, bias) in constrained.jacobian.iter().zip(&constrained.bias) {
                let start = if found.is_motion { slope(bias) } else { T::zero() };
                all.along.push(row.iter().zip(found.x).fold(start, |sum, (j, x)| sum + slope(j) * *x));
            }
            let force = &found.force[first..first + constrained.len()];
            first += constrained.len();
            for (row, force) in alg::applied_rows(&t.contact, &t.motion, constrained).iter().zip(force) {
                all.pushed.iter_mut().zip(row).for_each(|(sum, j)| *sum = *sum + slope(j) * *force);
            }
            all.footings.push(t.footing);
        }
        all
    }

    /// Contacts where each coordinate moves, where each rate does, and where nothing does.
    pub fn all_moved(&self, found: &FoundMotion<T>) -> ([Vec<MovedContacts<'_, T>>; 2], MovedContacts<'_, T>) {
        let swept = self.form.own.reduced.then(|| self.swept(found));
        let of = |moving: Option<Moving>| match &swept {
            Some(swept) => self.moved(swept, moving),
            None => self.moved_plainly(found, moving),
        };
        let by_position = (0..self.nv()).map(|k| of(Some(Moving::Position(k)))).collect();
        let by_velocity = (0..self.nv()).map(|k| of(Some(Moving::Velocity(k)))).collect();
        ([by_position, by_velocity], of(None))
    }

    /// q̈, F, and their derivatives by q, q̇, τ and the objects' own coordinates.
    pub fn forward_dynamics_derivatives(&self) -> Vec<Vec<T>> {
        let (nv, constrained) = (self.nv(), &self.constrained);
        let drive: Vec<T> = self.bound.arguments[2].iter().zip(self.bias_force()).map(|(tau, h)| *tau - h).collect();
        let (factor, applied) = (self.factor(), self.applied());
        let (stands, own_rates) = supports(&self.footings(), constrained, self.options, self.added);
        let factors =
            ContactFactors::of_supports(&factor, &constrained.jacobian, applied.as_deref(), &stands, self.epsilon);
        let motion = factors.motion(&drive, constrained, &stands);
        let at = [self.q().clone(), self.qd().clone(), motion.qdd.clone()];
        let of_torques = self.of_robot(Function::InverseDynamicsDerivatives, &at);
        let found = FoundMotion { x: &motion.qdd, force: &motion.force, is_motion: true };
        let (moved, at_rest) = self.all_moved(&found);
        let inputs = self.held_inputs();
        let mut blocks = SolvedBlocks::default();
        for (block, moved) in moved.iter().enumerate() {
            let b = |k: usize| (0..nv).map(|i| moved[k].pushed[i] - of_torques[(block * nv + i) * nv + k]).collect();
            blocks.add((0..nv).map(|k| self.change(&factors, &moved[k], &inputs, b(k))));
        }
        blocks.add(factors.changes_by_force(nv).into_iter().map(|change| (change, vec![])));
        let mut results = vec![motion.qdd.clone(), motion.force.clone()];
        results.extend(blocks.solved.iter().map(|[of_motion, _]| of_motion.clone()));
        results.extend(blocks.solved.iter().map(|[_, of_force]| of_force.clone()));
        results.push(vec![motion.pivot]);
        results.extend(own_rates);
        let [by_own, force_by_own, rates_by_own] = self.by_own_coordinates(&factors, &at_rest);
        results.extend(by_own.into_iter().chain(force_by_own));
        results.extend(blocks.beside[..2].iter().flatten().cloned());
        results.extend(rates_by_own);
        results
    }

    /// What changes where contacts do, with forces b that are left: of q̈, of F, and of the rates of the objects' own coordinates.
    fn change(
        &self,
        factors: &ContactFactors<'_, T>,
        moved: &MovedContacts<'_, T>,
        inputs: &Added<Dual<T, 1>>,
        b: Vec<T>,
    ) -> (alg::MotionChange<T>, Vec<Vec<T>>) {
        let footings: Vec<&Footing<Dual<T, 1>>> = moved.footings.iter().collect();
        let (stands, rates) = supports(&footings, &moved.constrained(), self.options, inputs);
        let g = stands.iter().zip(&moved.along).map(|(support, along)| match support {
            Support::Rigid(wanted) => slope(wanted) - *along,
            Support::Yielding { mass, load } => -(slope(load) + mass.value * *along),
        });
        let change = factors.change(&b, &g.collect::<Vec<T>>());
        (change, rates.iter().map(|x| slopes(x)).collect())
    }

    /// The inputs where each object's own coordinate moves, and where its rate does.
    pub fn inputs_of_own_coordinates(&self, inputs: &Added<Dual<T, 1>>) -> Vec<[Added<Dual<T, 1>>; 2]> {
        let named = self.mode.contacts.iter().map(|c| format!("{}_own", c.item.identifier()));
        let moving = |name: String| {
            [0, 1].map(|k| {
                let mut moving = inputs.clone();
                let own = moving.get_mut(&name).expect("it is an input");
                own[k] = Dual::variable(own[k].value, 0);
                moving
            })
        };
        named.filter(|name| inputs.contains_key(name)).map(moving).collect()
    }

    /// By each object's own coordinate and its rate: q̈, F, and their own rates, a block of two columns per contact that has them.
    fn by_own_coordinates(&self, factors: &ContactFactors<'_, T>, at_rest: &MovedContacts<'_, T>) -> [Vec<Vec<T>>; 3] {
        let inputs = self.held_inputs();
        let mut blocks: [Vec<Vec<T>>; 3] = Default::default();
        for (c, moving) in self.inputs_of_own_coordinates(&inputs).iter().enumerate() {
            let columns =
                moving.each_ref().map(|moving| self.change(factors, at_rest, moving, vec![T::zero(); self.nv()]));
            blocks[0].push(by_rows(&columns.each_ref().map(|(change, _)| change[0].clone())));
            blocks[1].push(by_rows(&columns.each_ref().map(|(change, _)| change[1].clone())));
            blocks[2].push(by_rows(&columns.each_ref().map(|(_, rates)| rates[c].clone())));
        }
        blocks
    }

    /// ∂(H x)/∂q, with the inertia of the drives, by rows.
    fn inertial_slopes(&self, x: &[T]) -> Vec<T> {
        let (nv, model) = (self.nv(), &self.bound.model);
        let forms =
            self.bound.forms(self.form.own.reduced, &[], SelectedRows::ALL, ForwardDynamicsMethod::Factorisation);
        let mut all = forms.inertial_slopes(self.q(), x);
        if !model.drives.is_empty() {
            let wide = model.map(Dual::<T, 1>::fixed);
            for k in 0..nv {
                let added = slopes(&alg::drive_inertia(&wide, &along(model, self.q(), k)));
                for (i, row) in added.chunks(nv).enumerate() {
                    all[i * nv + k] = all[i * nv + k] + dot(row, x);
                }
            }
        }
        all
    }

    /// q̇ after an impact, impulses, and their derivatives by q, by q̇ before and by the velocities of struck masses.
    pub fn impact_derivatives(&self) -> Vec<Vec<T>> {
        let (nv, constrained) = (self.nv(), &self.constrained);
        let (struck, places) = self.struck();
        let (factor, applied, restitution) = (self.whole_factor(), self.applied(), self.added["restitution"][0]);
        let applied = applied.as_deref();
        let factors = ContactFactors::of_struck(&factor, &constrained.jacobian, applied, &struck, self.epsilon);
        let blow = factors.impact(self.qd(), constrained, applied, &struck, restitution);
        let after: Vec<T> = self.qd().iter().zip(&blow.dqd).map(|(qd, d)| *qd + *d).collect();
        let found = FoundMotion { x: &blow.dqd, force: &blow.impulse, is_motion: false };
        let ([by_position, by_velocity], _) = self.all_moved(&found);
        let inertial = self.inertial_slopes(&blow.dqd);
        let turned_round = T::one() + restitution;
        // what (1 + e) ṡ and J Δq̇ leave of each row, and what masses do then
        let solve = |b: &[T], rate: &[T], along: &[T]| {
            let left = rate.iter().zip(along).map(|(rate, along)| -(turned_round * *rate + *along));
            let g = left.zip(&struck).map(|(left, s)| match *s {
                Struck::Rigid => left,
                Struck::Mass { mass, .. } => mass * left,
            });
            let change = factors.change(b, &g.collect::<Vec<T>>());
            let of_mass = |&k: &usize| {
                let jump = along[k] + dot(&constrained.jacobian[k], &change[0]);
                turned_round * rate[k] + jump
            };
            let masses: Vec<Vec<T>> = places.iter().map(|k| vec![of_mass(k)]).collect();
            (change, masses)
        };
        let mut blocks = SolvedBlocks::default();
        blocks.add(by_position.iter().enumerate().map(|(k, moved)| {
            let b: Vec<T> = (0..nv).map(|i| moved.pushed[i] - inertial[i * nv + k]).collect();
            solve(&b, &slopes(&moved.constrained().rate), &moved.along)
        }));
        blocks.add(by_velocity.iter().enumerate().map(|(k, moved)| {
            let (mut change, masses) = solve(&moved.pushed, &slopes(&moved.constrained().rate), &moved.along);
            change[0][k] = change[0][k] + T::one();
            (change, masses)
        }));
        // ṡ_e alone: it counts as −ṡ, but the mass itself moves at it
        let (rest, none) = (vec![T::zero(); nv], vec![T::zero(); constrained.len()]);
        let by_mass: Vec<_> = places
            .iter()
            .map(|k| {
                let mut rate = none.clone();
                rate[*k] = -T::one();
                let (change, mut masses) = solve(&rest, &rate, &none);
                let own = places.iter().position(|place| place == k).expect("it is one of them");
                masses[own][0] = masses[own][0] + T::one();
                (change, masses)
            })
            .collect();
        let mut results = vec![after, blow.impulse];
        results.extend([0, 1].into_iter().flat_map(|part| [0, 1].map(|b| blocks.solved[b][part].clone())));
        results.push(vec![blow.pivot]);
        results.extend(places.iter().map(|k| vec![blow.struck_velocity[*k]]));
        results.extend(by_mass.iter().map(|(change, _)| change[0].clone()));
        results.extend(by_mass.iter().map(|(change, _)| change[1].clone()));
        results.extend(blocks.beside.iter().flatten().cloned());
        results.extend((0..places.len()).map(|of| by_mass.iter().map(|(_, masses)| masses[of][0]).collect()));
        results
    }
}

/// SolvedBlocks of derivatives by rows, in the order in which they are added: of the two that are solved for, and of what goes beside, one list each.
struct SolvedBlocks<T> {
    solved: Vec<[Vec<T>; 2]>,
    beside: Vec<Vec<Vec<T>>>,
}

impl<T> Default for SolvedBlocks<T> {
    fn default() -> Self {
        SolvedBlocks { solved: Vec::new(), beside: Vec::new() }
    }
}

impl<T: Copy> SolvedBlocks<T> {
    fn add(&mut self, columns: impl Iterator<Item = (alg::MotionChange<T>, Vec<Vec<T>>)>) {
        let columns: Vec<_> = columns.collect();
        let part = |part: usize| by_rows(&columns.iter().map(|(change, _)| change[part].clone()).collect::<Vec<_>>());
        self.solved.push([part(0), part(1)]);
        let others = columns.first().map_or(0, |(_, beside)| beside.len());
        let of = |c: usize| by_rows(&columns.iter().map(|(_, beside)| beside[c].clone()).collect::<Vec<_>>());
        self.beside.push((0..others).map(of).collect());
    }
}
