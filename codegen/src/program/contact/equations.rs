//! The equations of a contact mode, over any scalar.

use super::{ridge, ClosedContact, Mode};
use crate::equations::bind::BoundRobot;
use crate::equations::Robot;
use crate::function::{ContactFunction, ForwardDynamicsMethod, Function, PerContact, SelectedRows};
use crate::options::Options;
use crate::scene::contact::{tool_axes, SurfaceItem};
use std::collections::BTreeMap;
use straightline_core::algorithms::{
    ConstrainedMotion, ContactRows, DrivenMotion, Environment, FunctionalCoordinates, Ltdl, RelativeMotion, Struck,
    Support,
};
use straightline_core::contact::{Contact, Coordinate, Object, ObjectMotion, Surface};
use straightline_core::spatial::{Mat3, MotionVector, Transform, Vec3};
use straightline_core::{algorithms as alg, Dd, Dual, Real};

/// Inputs beside the robot's own, by name.
pub(super) type Added<T> = BTreeMap<String, Vec<T>>;

/// Which of their forms equations take.
#[derive(Clone, Copy)]
pub(super) struct EquationForm<T> {
    /// By the reduced robot, where it serves.
    pub reduced: bool,
    /// There frames of contacts move by the recursion of bias forces.
    pub is_carried: bool,
    /// The surfaces of objects over this scalar.
    pub surface: fn(&SurfaceItem) -> Surface<T>,
    /// What is added to accelerations of contact points and taken away again, as the reduced robot does with gravity.
    pub falls: Option<T>,
}

/// The forms of equations, and of their derivatives over dual numbers.
#[derive(Clone, Copy)]
pub(super) struct FormsOfContacts<T> {
    pub own: EquationForm<T>,
    pub moving: EquationForm<Dual<T, 1>>,
}

/// A contact, how its frame moves, and what it constrains.
pub(super) struct TracedContact<'a, T> {
    pub contact: Contact<T>,
    pub motion: RelativeMotion<T>,
    pub footing: Footing<'a, T>,
}

/// What a contact constrains, and what it stands on; of a loop nothing is `closed`.
#[derive(Clone)]
pub(super) struct Footing<'a, T> {
    pub closed: Option<&'a ClosedContact<'a>>,
    pub constrained: FunctionalCoordinates<T>,
    pub environment: Option<Environment<T>>,
}

/// All that is constrained.
pub(super) fn together<T: Real>(footings: &[&Footing<T>]) -> FunctionalCoordinates<T> {
    footings.iter().fold(FunctionalCoordinates::default(), |all, f| all.and(f.constrained.clone()))
}

/// What is left of the equations at a given q̈ and F, with H, J, the rows in which reactions act, and the masses of yielding rows; one list
/// per output of [`residual::OUTPUTS`](straightline_graph::certify::residual::OUTPUTS).
pub(super) fn system<T: Real>(
    robot: &Robot,
    options: &Options,
    mode: &Mode,
    bound: &BoundRobot<T>,
    form: EquationForm<T>,
    added: &Added<T>,
    (qdd, force): (&[T], &[T]),
) -> Vec<Vec<T>> {
    let (q, qd, tau) = (&bound.arguments[0], &bound.arguments[1], &bound.arguments[2]);
    let traced = contacts(robot, mode, bound, added, form);
    let footings: Vec<&Footing<T>> = traced.iter().map(|t| &t.footing).collect();
    let constrained = together(&footings);
    let applied: Vec<Vec<T>> =
        traced.iter().flat_map(|t| alg::applied_rows(&t.contact, &t.motion, &t.footing.constrained)).collect();
    let (supports, _) = supports(&footings, &constrained, options, added);
    let inverse = of_robot(bound, form.reduced, Function::InverseDynamics, &[q.clone(), qd.clone(), qdd.to_vec()]);
    let mass_matrix = of_robot(bound, form.reduced, Function::MassMatrix, std::slice::from_ref(q));
    let residual = (0..inverse.len()).map(|i| {
        let driven = applied.iter().zip(force).fold(tau[i], |sum, (row, f)| sum + row[i] * *f);
        driven - inverse[i]
    });
    let rows = constrained.jacobian.iter().zip(&constrained.bias).zip(&supports).zip(force);
    let missing = rows.map(|(((row, bias), support), force)| {
        let sdd = row.iter().zip(qdd).fold(*bias, |sum, (j, x)| sum + *j * *x);
        match *support {
            Support::Rigid(wanted) => wanted - sdd,
            Support::Yielding { mass, load } => -(load + mass * sdd + *force),
        }
    });
    let masses = supports.iter().map(|support| match *support {
        Support::Rigid(_) => T::zero(),
        Support::Yielding { mass, .. } => mass,
    });
    let (residual, missing, masses) = (residual.collect(), missing.collect(), masses.collect());
    vec![residual, missing, mass_matrix, constrained.jacobian.concat(), applied.concat(), masses]
}

/// A function of the robot over these arguments, by its reduced form where it has one.
fn of_robot<T: Real>(bound: &BoundRobot<T>, reduced: bool, function: Function, arguments: &[Vec<T>]) -> Vec<T> {
    let method = ForwardDynamicsMethod::Factorisation;
    function.evaluate_on(&bound.forms(reduced, &[], SelectedRows::ALL, method), arguments)
}

/// What the equations of all functions have in common.
pub(super) struct CommonEquations<'a, T> {
    pub robot: &'a Robot,
    pub mode: &'a Mode<'a>,
    pub options: &'a Options,
    pub bound: &'a BoundRobot<T>,
    pub form: FormsOfContacts<T>,
    pub added: &'a Added<T>,
    pub traced: Vec<TracedContact<'a, T>>,
    pub constrained: FunctionalCoordinates<T>,
    pub epsilon: T,
}

/// A motion in contact under the inputs of the drives, and what it is made of.
pub(super) struct DrivenContacts<T> {
    pub bias: Vec<T>,
    pub mass_matrix: Vec<T>,
    /// The rows in which reactions act, if those are others.
    pub applied: Option<Vec<Vec<T>>>,
    pub motion: ConstrainedMotion<T>,
    pub drives: DrivenMotion<T>,
    /// The rates of the objects' own coordinates.
    pub own_rates: Vec<Vec<T>>,
}

/// The results of a function, one list per output.
pub(super) fn equations<T: Real>(
    robot: &Robot,
    options: &Options,
    mode: &Mode,
    function: ContactFunction,
    form: FormsOfContacts<T>,
    bound: &BoundRobot<T>,
    added: &Added<T>,
) -> Vec<Vec<T>> {
    let traced = contacts(robot, mode, bound, added, form.own);
    let constrained = together(&traced.iter().map(|t| &t.footing).collect::<Vec<_>>());
    let epsilon = T::constant(Dd::from(ridge(options.scalar)));
    let given = CommonEquations { robot, mode, options, bound, form, added, traced, constrained, epsilon };
    let list = |c: FunctionalCoordinates<T>| vec![c.value, c.rate, c.jacobian.concat(), c.bias];
    match function {
        ContactFunction::ConstrainedCoordinates => list(given.constrained),
        ContactFunction::FreeCoordinates => list(given.free()),
        ContactFunction::ForwardDynamics => given.forward_dynamics(),
        ContactFunction::DrivenForwardDynamics => given.driven_forward_dynamics(),
        ContactFunction::InverseDynamics => given.inverse_dynamics(),
        ContactFunction::Impact => given.impact(),
        ContactFunction::Projection => given.projection(),
        ContactFunction::ForwardDynamicsDerivatives => given.forward_dynamics_derivatives(),
        ContactFunction::DrivenForwardDynamicsDerivatives => given.driven_forward_dynamics_derivatives(),
        ContactFunction::ImpactDerivatives => given.impact_derivatives(),
    }
}

impl<T: Real> CommonEquations<'_, T> {
    pub fn q(&self) -> &Vec<T> {
        &self.bound.arguments[0]
    }

    pub fn qd(&self) -> &Vec<T> {
        &self.bound.arguments[1]
    }

    pub fn of_robot(&self, function: Function, arguments: &[Vec<T>]) -> Vec<T> {
        of_robot(self.bound, self.form.own.reduced, function, arguments)
    }

    pub fn footings(&self) -> Vec<&Footing<'_, T>> {
        self.traced.iter().map(|t| &t.footing).collect()
    }

    pub fn bias_force(&self) -> Vec<T> {
        self.of_robot(Function::BiasForce, &[self.q().clone(), self.qd().clone()])
    }

    pub fn mass_matrix(&self) -> Vec<T> {
        self.of_robot(Function::MassMatrix, std::slice::from_ref(self.q()))
    }

    pub fn factor(&self) -> Ltdl<T> {
        Ltdl::factor(&self.bound.model, &self.mass_matrix())
    }

    /// With the rotors of rigid drives, which are struck, too.
    pub fn whole_factor(&self) -> Ltdl<T> {
        match self.bound.model.drives.is_empty() {
            true => self.factor(),
            false => alg::driven_factor(&self.bound.model, self.q(), &self.mass_matrix()),
        }
    }

    fn free(&self) -> FunctionalCoordinates<T> {
        let of =
            |t: &TracedContact<T>| Some(alg::functional_coordinates(&t.contact, &t.motion, &t.footing.closed?.free));
        self.traced.iter().filter_map(of).fold(FunctionalCoordinates::default(), FunctionalCoordinates::and)
    }

    /// The rows in which reactions act, if those are others.
    pub fn applied(&self) -> Option<Vec<Vec<T>>> {
        let slides = self.traced.iter().any(|t| t.footing.closed.is_some_and(|c| c.slides));
        let of = |t: &TracedContact<T>| alg::applied_rows(&t.contact, &t.motion, &t.footing.constrained);
        slides.then(|| self.traced.iter().flat_map(of).collect())
    }

    fn forward_dynamics(&self) -> Vec<Vec<T>> {
        let CommonEquations { bound, constrained, epsilon, .. } = self;
        let bias = self.bias_force();
        let (supports, own_rates) = supports(&self.footings(), constrained, self.options, self.added);
        let applied = self.applied();
        let drive: Vec<T> = bound.arguments[2].iter().zip(bias).map(|(tau, h)| *tau - h).collect();
        let factor = self.factor();
        let motion =
            alg::constrained_forward_dynamics(&factor, &drive, constrained, applied.as_deref(), &supports, *epsilon);
        [vec![motion.qdd.clone()], of_rows(&motion), own_rates].concat()
    }

    fn driven_forward_dynamics(&self) -> Vec<Vec<T>> {
        let DrivenContacts { motion, drives, own_rates, .. } = self.driven_motion();
        [vec![motion.qdd.clone(), drives.xd], of_rows(&motion), own_rates].concat()
    }

    /// The motion under the inputs of the drives, with what it is made of.
    pub fn driven_motion(&self) -> DrivenContacts<T> {
        let CommonEquations { bound, constrained, epsilon, .. } = self;
        let bias = self.bias_force();
        let (supports, own_rates) = supports(&self.footings(), constrained, self.options, self.added);
        let applied = self.applied();
        let at = (&self.q()[..], &self.qd()[..], &bound.arguments[2][..], &bound.arguments[3][..]);
        let rows =
            ContactRows { coordinates: constrained, applied: applied.as_deref(), supports: &supports, ridge: *epsilon };
        let mass_matrix = self.mass_matrix();
        let (motion, drives) = alg::driven_contact_motion(&bound.model, at, &bias, &mass_matrix, rows);
        DrivenContacts { bias, mass_matrix, applied, motion, drives, own_rates }
    }

    fn inverse_dynamics(&self) -> Vec<Vec<T>> {
        let CommonEquations { bound, constrained, epsilon, added, .. } = self;
        let qdd = &bound.arguments[2];
        let inverse = self.of_robot(Function::InverseDynamics, &[self.q().clone(), self.qd().clone(), qdd.clone()]);
        let sdd_free = added.get("sdd_free").cloned().unwrap_or_default();
        let wanted = [vec![T::zero(); constrained.len()], sdd_free].concat();
        let (factor, rows) = (self.factor(), (constrained, &self.free()));
        let (tau, pivot) =
            alg::hybrid_inverse_dynamics(&factor, &inverse, qdd, rows, &wanted, &added["force"], *epsilon);
        vec![tau, vec![pivot]]
    }

    fn impact(&self) -> Vec<Vec<T>> {
        let CommonEquations { constrained, epsilon, added, .. } = self;
        let (struck, places) = self.struck();
        let applied = self.applied();
        let (factor, restitution) = (self.whole_factor(), added["restitution"][0]);
        let blow = alg::impact(&factor, self.qd(), constrained, applied.as_deref(), &struck, restitution, *epsilon);
        let after = places.iter().map(|k| vec![blow.struck_velocity[*k]]).collect();
        let results = vec![blow.dqd, blow.impulse, blow.dsd, vec![blow.energy_loss], vec![blow.pivot]];
        [results, after].concat()
    }

    /// What the rows hit, and those of masses whose velocities are given.
    pub fn struck(&self) -> (Vec<Struck<T>>, Vec<usize>) {
        let mut struck = vec![Struck::Rigid; self.constrained.len()];
        let mut places = Vec::new();
        let mut first = 0;
        for t in self.footings() {
            if let (Some(environment), Some(closed)) = (&t.environment, t.closed) {
                let k = first + distance_row(&closed.constrained);
                let velocity = match closed.has(PerContact::WithMass) {
                    true => {
                        places.push(k);
                        self.added[&format!("{}_struck", closed.item.identifier())][0]
                    }
                    false => T::zero(),
                };
                struck[k] = Struck::Mass { mass: environment.struck_mass(), velocity };
            }
            first += t.constrained.len();
        }
        (struck, places)
    }

    fn projection(self) -> Vec<Vec<T>> {
        let CommonEquations { constrained, .. } = &self;
        let footings = self.footings();
        let deviations = deviations(&footings, constrained);
        let is_rigid = rigid_rows(&footings);
        let kept = |list: &[T]| list.iter().zip(&is_rigid).filter(|k| *k.1).map(|k| *k.0).collect::<Vec<T>>();
        let rows = constrained.jacobian.iter().zip(&is_rigid).filter(|k| *k.1).map(|k| k.0.clone());
        let rigid = FunctionalCoordinates {
            value: kept(&constrained.value),
            rate: kept(&constrained.rate),
            jacobian: rows.collect(),
            bias: kept(&constrained.bias),
        };
        let correction = match rigid.is_empty() {
            true => vec![T::zero(); self.bound.model.nv()],
            false => alg::projection(&self.whole_factor(), &rigid, &kept(&deviations), self.epsilon),
        };
        vec![correction, self.constrained.value]
    }
}

/// F, s̈, what s̈ should be less that, and the least pivot.
fn of_rows<T: Real>(motion: &ConstrainedMotion<T>) -> Vec<Vec<T>> {
    vec![motion.force.clone(), motion.sdd.clone(), motion.violation.clone(), vec![motion.pivot]]
}

/// What the rows stand on, and the rates of the objects' own coordinates.
pub(super) fn supports<T: Real>(
    footings: &[&Footing<T>],
    constrained: &FunctionalCoordinates<T>,
    options: &Options,
    added: &Added<T>,
) -> (Vec<Support<T>>, Vec<Vec<T>>) {
    let stabilised = match options.scene.contacts.stabilisation {
        Some((frequency, damping)) => {
            let [frequency, damping] = [frequency, damping].map(|x| T::constant(Dd::from(x)));
            let pulled = FunctionalCoordinates { value: deviations(footings, constrained), ..constrained.clone() };
            alg::baumgarte(&pulled, frequency, damping)
        }
        None => vec![T::zero(); constrained.len()],
    };
    let mut supports: Vec<Support<T>> = stabilised.into_iter().map(Support::Rigid).collect();
    let mut own_rates = Vec::new();
    let mut first = 0;
    for t in footings {
        if let (Some(environment), Some(closed)) = (&t.environment, t.closed) {
            let k = distance_row(&closed.constrained);
            let s = (t.constrained.value[k], t.constrained.rate[k]);
            let own = match environment.has_own_coordinate() {
                true => {
                    let own = &added[&format!("{}_own", closed.item.identifier())];
                    let rates = environment.motion(s, (own[0], own[1]));
                    own_rates.push(vec![rates.velocity, rates.acceleration]);
                    (own[0], own[1])
                }
                false => (T::zero(), T::zero()),
            };
            supports[first + k] = environment.support(s, own);
        }
        first += t.constrained.len();
    }
    (supports, own_rates)
}

/// How far the rows are from where they are held: what sticks is held where that has happened, which is not known here, so that
/// its rate alone counts.
fn deviations<T: Real>(footings: &[&Footing<T>], constrained: &FunctionalCoordinates<T>) -> Vec<T> {
    let by_friction = footings.iter().flat_map(|t| match t.closed {
        Some(closed) => closed.constrained.iter().map(|c| !closed.item.constrained.contains(c)).collect(),
        None => vec![false; t.constrained.len()],
    });
    constrained.value.iter().zip(by_friction).map(|(s, sticks)| if sticks { T::zero() } else { *s }).collect()
}

/// Rows that are not on an object that gives way.
fn rigid_rows<T: Real>(footings: &[&Footing<T>]) -> Vec<bool> {
    let of = |t: &&Footing<T>| {
        let yields = t.environment.as_ref().and(t.closed).map(|closed| distance_row(&closed.constrained));
        (0..t.constrained.len()).map(|k| yields != Some(k)).collect::<Vec<bool>>()
    };
    footings.iter().flat_map(of).collect()
}

/// The row of the distance among the constrained coordinates of a contact.
fn distance_row(constrained: &[Coordinate]) -> usize {
    constrained.iter().position(|c| *c == Coordinate::Pz).expect("an object gives way along pz, as was checked")
}

/// Contacts and loops of a mode, traced.
pub(super) fn contacts<'a, T: Real>(
    robot: &Robot,
    mode: &'a Mode,
    bound: &BoundRobot<T>,
    added: &Added<T>,
    form: EquationForm<T>,
) -> Vec<TracedContact<'a, T>> {
    let (q, qd) = (&bound.arguments[0], &bound.arguments[1]);
    let frame = |name: &str| bound.model.frame(name).expect("the frames of contacts were checked").clone();
    let mut all = Vec::new();
    for closed in &mode.contacts {
        let (item, name) = (closed.item, closed.item.identifier());
        let input = |suffix: &str| &added[&format!("{name}_{suffix}")];
        let triple = |x: &[T], k: usize| Vec3::new(x[3 * k], x[3 * k + 1], x[3 * k + 2]);
        let (axis, second_axis) = match item.axis {
            Some(axis) => tool_axes(axis),
            None => (triple(input("axes"), 0), triple(input("axes"), 1)),
        };
        let object = match item.object {
            Some(object) => Object::Fixed(object.over()),
            None => {
                let (pose, velocity, acceleration) = (input("pose"), input("velocity"), input("acceleration"));
                let motion = |x: &[T]| MotionVector { linear: triple(x, 0), angular: triple(x, 1) };
                Object::Moving(ObjectMotion {
                    pose: Transform {
                        rotation: Mat3::from_columns(triple(pose, 1), triple(pose, 2), triple(pose, 3)),
                        translation: triple(pose, 0),
                    },
                    velocity: motion(velocity),
                    acceleration: motion(acceleration),
                })
            }
        };
        let contact = Contact {
            name: item.name.clone(),
            frame: frame(&item.frame),
            axis,
            second_axis,
            object,
            surface: (form.surface)(&item.surface),
            constrained: closed.constrained.clone(),
            free: closed.free.clone(),
            friction: item.friction_over().filter(|_| closed.slides),
        };
        let placed = robot.model.frame(&item.frame).and_then(|f| {
            let body = f.body?;
            Some((body, robot.reduced_frames[body].inverse().compose(&f.placement).map(T::constant)))
        });
        let by_reduced = placed
            .filter(|_| form.reduced && form.is_carried && bound.reduced.serves(&bound.model) && bound.model.is_tree())
            .and_then(|placed| alg::reduced_relative_motion(&bound.reduced, &contact, placed, q, qd));
        let mut motion = by_reduced.unwrap_or_else(|| alg::relative_motion(&bound.model, &contact, q, qd));
        if let Some(g) = form.falls {
            motion.acceleration = motion.acceleration.map(|x| (x + g) - g);
        }
        let constrained = alg::functional_coordinates(&contact, &motion, &contact.constrained);
        let footing = Footing { closed: Some(closed), constrained, environment: environment(closed, added) };
        all.push(TracedContact { contact, motion, footing });
    }
    for a_loop in mode.loops {
        let contact = a_loop.over(frame(&a_loop.frame), frame(&a_loop.with));
        let motion = alg::relative_motion(&bound.model, &contact, q, qd);
        let constrained = alg::functional_coordinates(&contact, &motion, &contact.constrained);
        all.push(TracedContact { contact, motion, footing: Footing { closed: None, constrained, environment: None } });
    }
    all
}

/// The object of a contact, if it gives way.
pub(super) fn environment<T: Real>(closed: &ClosedContact, added: &Added<T>) -> Option<Environment<T>> {
    let item = closed.item.environment.as_ref()?;
    let values = match &item.values {
        Some(values) => values.iter().map(|x| T::constant(Dd::from(*x))).collect(),
        None => added[&format!("{}_environment", closed.item.identifier())].clone(),
    };
    Some(item.over(&values))
}
