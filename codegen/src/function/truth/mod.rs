//! What every function should give: the second author's word, over numbers that know their natural scale.
//!
//! A truth is asked of a [`Chapter`]: the robot as the handbook chapter describes it, at a state. It is computed once, over [`Magnitude`], which gives
//! the value in double-double and, beside it, how large the terms were that it is made of. So no natural scale is written down by hand.

use super::{Extent, Quantity, RobotFunction, SelectedRows};
use nalgebra::{Const, DMatrix, DVector, Dyn, OMatrix, Vector3};
use std::collections::BTreeMap;
use straightline_core::magnitude::Magnitude;
use straightline_core::model::Model;
use straightline_core::reference::{self, CentreOfMassFrame, CentreOfMassTree, ExtendedPosition};
use straightline_core::{Dd, Dual, Real};

mod bias_derivatives;
mod closed;
mod derivatives;
mod drives;
mod dynamics;
mod effect;
mod forward_derivatives;
mod frame_forces;
mod kinematics;
mod loops;
mod motion_derivatives;
mod regressors;
mod steps;
mod tangent;
mod tasks;
mod whole;

pub use closed::{ClosedLoops, ClosedMeeting, ClosedMotion, Turning};
use closed::{ClosingReal, TreeMotion};
pub use effect::Effect;

/// What a function should give.
pub trait Truth: RobotFunction {
    /// Its results, one block after the other; `None` where the reference has no formulation of it, or none for these drives: tests of their own
    /// hold such functions to laws of physics.
    fn truth(at: &Chapter<'_>) -> Option<Vec<Magnitude>>;

    /// The same of a robot with closed loops; of functions whose truth knows loops by itself, as derivatives along the independent coordinates do, the same.
    fn truth_on_loops(at: &ClosedMotion<'_>) -> Option<Vec<Magnitude>> {
        Self::truth(&at.robot)
    }

    /// The same of any robot.
    fn truth_of(at: &Chapter<'_>) -> Option<Vec<Magnitude>> {
        match at.loops {
            Some(loops) => Self::truth_on_loops(&ClosedMotion::new(at, loops)),
            None => Self::truth(at),
        }
    }
}

/// A robot in the second author's terms, at a state.
#[derive(Clone, Debug)]
pub struct Chapter<'a> {
    /// The robot.
    pub tree: CentreOfMassTree<Magnitude>,
    frames: Vec<CentreOfMassFrame<Magnitude>>,
    /// The rows of tasks that are asked for.
    rows: SelectedRows,
    effects: &'a [Effect],
    /// The velocity coordinates that move, where others are held.
    moving: Option<&'a [usize]>,
    /// Whose drives are meant, with the numbers of their shafts.
    drives: Option<&'a Model<Dd>>,
    /// The robot whose base parameters are meant.
    robot: Option<&'a Model<Dd>>,
    /// Where loops are closed.
    loops: Option<&'a ClosedLoops>,
    state: BTreeMap<Quantity, Vec<Magnitude>>,
}

impl<'a> Chapter<'a> {
    /// A robot without frames and drives at this state; what is not given of rates, forces and directions is zero.
    pub fn new(tree: &CentreOfMassTree<Dd>, effects: &'a [Effect], state: BTreeMap<Quantity, Vec<Dd>>) -> Chapter<'a> {
        let mut sized: BTreeMap<Quantity, Vec<Magnitude>> =
            state.into_iter().map(|(quantity, x)| (quantity, x.into_iter().map(Magnitude::new).collect())).collect();
        for rate in Quantity::of_velocities() {
            sized.entry(rate).or_insert_with(|| vec![Magnitude::zero(); tree.nv()]);
        }
        let here = sized[&Quantity::Configuration].clone();
        sized.entry(Quantity::SecondConfiguration).or_insert(here);
        sized.entry(Quantity::TimeStep).or_insert_with(|| vec![Magnitude::zero()]);
        let tree = with_sizes(tree);
        for task in [Quantity::Wrench, Quantity::PoseError] {
            sized.entry(task).and_modify(|x| x.chunks_mut(3).for_each(of_length));
        }
        // the coordinates of a free link and of a ball joint are parts of vectors, the attitude one of a rotation
        for (link, first) in tree.links.iter().filter_map(|link| Some((link, link.joint.quaternion()?))) {
            for (quantity, x) in &mut sized {
                match quantity {
                    quantity if quantity.is_configuration() => {
                        let (position, attitude) = x[link.iq..link.iq + first + 4].split_at_mut(first);
                        position.chunks_mut(3).for_each(of_length);
                        attitude.iter_mut().for_each(|x| *x = x.of_size(1.0));
                    }
                    quantity if quantity.axes() == [Extent::Velocities] => {
                        let own = x.get_mut(link.iv..link.iv + link.joint.nv());
                        own.into_iter().flat_map(|own| own.chunks_mut(3)).for_each(of_length);
                    }
                    _ => {}
                }
            }
        }
        let rows = SelectedRows::ALL;
        Chapter {
            tree,
            frames: Vec::new(),
            rows,
            effects,
            moving: None,
            drives: None,
            robot: None,
            loops: None,
            state: sized,
        }
    }

    /// The same with these frames asked for.
    ///
    /// # Errors
    /// The reference has no frame of that name.
    pub fn with_frames(mut self, names: &[String]) -> Result<Self, String> {
        let frame = |name: &String| {
            self.tree.frame(name).cloned().ok_or_else(|| format!("the reference has no frame `{name}`"))
        };
        self.frames = names.iter().map(frame).collect::<Result<_, _>>()?;
        for task in Quantity::of_tasks() {
            let numbers = match task.axes() {
                [Extent::Frames, Extent::Of(n)] => n * names.len(),
                _ => 1,
            };
            self.state.entry(task).or_insert_with(|| vec![Magnitude::zero(); numbers]);
        }
        Ok(self)
    }

    /// The same with these rows of tasks asked for.
    #[must_use]
    pub fn with_rows(self, rows: SelectedRows) -> Self {
        Chapter { rows, ..self }
    }

    /// The same where these velocity coordinates alone move.
    #[must_use]
    pub fn with_moving(self, moving: &'a [usize]) -> Self {
        Chapter { moving: Some(moving), ..self }
    }

    /// The same with the drives of a model, whose joints are those of the tree.
    #[must_use]
    pub fn with_drives(self, model: &'a Model<Dd>) -> Self {
        Chapter { drives: Some(model), ..self }
    }

    /// The same with these loops closed.
    #[must_use]
    pub fn with_loops(mut self, loops: Option<&'a ClosedLoops>) -> Self {
        for rate in Quantity::of_velocities() {
            let given = self.state.get_mut(&rate);
            given.into_iter().for_each(|x| x.truncate(loops.map_or(usize::MAX, |loops| loops.independent)));
        }
        Chapter { loops, ..self }
    }

    /// The same with the base parameters of a model, whose bodies are links of the tree, by their names.
    #[must_use]
    pub fn with_base_parameters(self, model: &'a Model<Dd>) -> Self {
        Chapter { robot: Some(model), ..self }
    }

    /// What the state has of a quantity.
    pub fn get(&self, quantity: Quantity) -> &[Magnitude] {
        &self.state[&quantity]
    }

    fn q(&self) -> &[Magnitude] {
        self.get(Quantity::Configuration)
    }

    fn qd(&self) -> &[Magnitude] {
        self.get(Quantity::Velocity)
    }

    fn qdd(&self) -> &[Magnitude] {
        self.get(Quantity::Acceleration)
    }

    /// The same robot in dual numbers, where q moves with q̇ and q̇ with q̈.
    fn along_motion(&self) -> (CentreOfMassTree<Dual<Magnitude, 1>>, [Vec<Dual<Magnitude, 1>>; 2]) {
        let held = vec![Magnitude::zero(); self.qdd().len()];
        let direction = [self.qd().to_vec(), self.qdd().to_vec(), held];
        let [q, qd, _] = derivatives::moving(self, &self.tree, [self.q(), self.qd(), self.qdd()], &direction);
        (self.tree.map(Dual::fixed), [q, qd])
    }

    /// Generalized forces of a motion, with what joints add to the rigid bodies; where loops are closed along the independent coordinates.
    fn forces_on<T: ClosingReal>(&self, tree: &CentreOfMassTree<T>, motion: [&[T]; 3]) -> Vec<T> {
        let [q, qd, qdd] = self.on_tree(tree, motion);
        let mut forces = reference::inverse_dynamics(tree, &q, &qd, &qdd);
        for effect in self.effects {
            forces[effect.iv] += effect.passive(q[effect.iq], qd[effect.iv]);
            forces[effect.iv] += T::constant(effect.inertia) * qdd[effect.iv];
        }
        list(&self.along_independent(tree, &q, forces))
    }

    /// A motion of the independent coordinates as one of the tree.
    fn on_tree<T: ClosingReal>(&self, tree: &CentreOfMassTree<T>, motion: [&[T]; 3]) -> [Vec<T>; 3] {
        let of_tree = self.loops.map(|loops| TreeMotion::new(tree, loops, motion));
        of_tree.map_or_else(
            || motion.map(<[T]>::to_vec),
            |of_tree| [motion[0].to_vec(), of_tree.rates, of_tree.accelerations],
        )
    }

    /// Velocities of the tree.
    fn rates_on_tree<T: ClosingReal>(&self, tree: &CentreOfMassTree<T>, q: &[T], qd: &[T]) -> Vec<T> {
        self.loops.map_or_else(|| qd.to_vec(), |loops| list(&(loops.map_at(tree, q) * DVector::from_column_slice(qd))))
    }

    /// What forces of the tree do along the independent coordinates.
    fn along_independent<T: ClosingReal>(&self, tree: &CentreOfMassTree<T>, q: &[T], forces: DVector<T>) -> DVector<T> {
        match self.loops {
            None => forces,
            Some(loops) => loops.map_at(tree, q).transpose() * forces,
        }
    }

    /// The Jacobian of a frame of the tree, by the independent velocities.
    fn jacobian_on<T: ClosingReal>(
        &self,
        tree: &CentreOfMassTree<T>,
        frame: &CentreOfMassFrame<T>,
        q: &[T],
    ) -> OMatrix<T, Const<6>, Dyn> {
        let of_tree = reference::frame_jacobian(tree, frame, q);
        match self.loops {
            None => of_tree,
            Some(loops) => of_tree * loops.map_at(tree, q),
        }
    }

    /// A symmetric matrix over the velocities of the tree, over the independent ones.
    fn over_independent<T: ClosingReal>(&self, tree: &CentreOfMassTree<T>, q: &[T], square: DMatrix<T>) -> DMatrix<T> {
        match self.loops {
            None => square,
            Some(loops) => {
                let map = loops.map_at(tree, q);
                map.transpose() * square * map
            }
        }
    }

    /// H at another configuration, rotors included.
    fn inertia_at(&self, q: &[Magnitude]) -> DMatrix<Magnitude> {
        self.over_independent(&self.tree, q, self.with_rotors(reference::mass_matrix(&self.tree, q)))
    }

    /// What `f` gives for each of the frames.
    fn per_frame(&self, f: impl Fn(&CentreOfMassFrame<Magnitude>) -> Vec<Magnitude>) -> Option<Vec<Magnitude>> {
        Some(self.frames.iter().flat_map(f).collect())
    }

    /// Forces of the bodies with what friction and springs of the joints take.
    fn with_passive(&self, mut forces: DVector<Magnitude>) -> DVector<Magnitude> {
        for effect in self.effects {
            forces[effect.iv] += effect.passive(self.q()[effect.iq], self.qd()[effect.iv]);
        }
        forces
    }

    /// What friction and springs of the joints take, along the independent coordinates.
    fn passive(&self, qd: &[Magnitude]) -> DVector<Magnitude> {
        let rates = self.rates_on_tree(&self.tree, self.q(), qd);
        let mut forces = DVector::from_element(rates.len(), Magnitude::zero());
        for effect in self.effects {
            forces[effect.iv] += effect.passive(self.q()[effect.iq], rates[effect.iv]);
        }
        self.along_independent(&self.tree, self.q(), forces)
    }

    /// The same matrix with the inertia of the joints' rotors on its diagonal.
    fn with_rotors(&self, mut h: DMatrix<Magnitude>) -> DMatrix<Magnitude> {
        self.effects.iter().for_each(|effect| h[(effect.iv, effect.iv)] += Magnitude::new(effect.inertia));
        h
    }
}

/// An inertia that is so small a part of what it is made of, is rounding noise.
const NOISE: f64 = 1e-3;

impl super::Function {
    /// What errors of the results of a truth are compared with.
    pub fn scales(self, truth: &[Magnitude]) -> Vec<f64> {
        self.spec().judged.scales(truth, NOISE)
    }
}

/// Every number with the size of the vector, rotation or tensor that it is a part of: turned into other axes, it takes part in all components.
fn with_sizes(tree: &CentreOfMassTree<Dd>) -> CentreOfMassTree<Magnitude> {
    let of_vector = |v: &mut Vector3<Magnitude>| of_length(v.as_mut_slice());
    let of_unit = |v: &mut [Magnitude]| v.iter_mut().for_each(|x| *x = x.of_size(1.0));
    let mut tree = tree.map(Magnitude::new);
    of_vector(&mut tree.gravity);
    for link in &mut tree.links {
        of_length(link.inertia.as_mut_slice());
        [&mut link.e, &mut link.e_parent].into_iter().for_each(|e| of_unit(e.as_mut_slice()));
        [&mut link.r, &mut link.r_parent].into_iter().for_each(of_vector);
        match &mut link.extended {
            ExtendedPosition::Matrix(extended) => of_unit(extended.as_mut_slice()),
            ExtendedPosition::ByVectors { r_star, r_parent_star, .. } => {
                [r_star, r_parent_star].into_iter().flatten().for_each(of_vector);
            }
        }
    }
    for frame in &mut tree.frames {
        of_vector(&mut frame.position);
        of_unit(frame.rotation.as_mut_slice());
    }
    tree
}

/// Components with the length of their vector as size.
fn of_length(v: &mut [Magnitude]) {
    let length = v.iter().map(|x| x.size).fold(0.0, f64::hypot);
    v.iter_mut().for_each(|x| *x = x.of_size(length));
}

/// x of A x = b. It moves by A⁻¹ (δb − δA x) where A and b move: taken as a whole, as every division of an elimination would count the worst of its
/// pivot again.
fn solved(
    a: &DMatrix<Magnitude>,
    b: &DVector<Magnitude>,
    solve: impl Fn(&DMatrix<Dd>, &DVector<Dd>) -> DVector<Dd>,
) -> DVector<Magnitude> {
    let n = b.len();
    let value = a.map(|x| x.value);
    let x = solve(&value, &b.map(|x| x.value));
    let moved = |i: usize| (0..n).map(|j| a[(i, j)].size * x[j].to_f64()).chain([b[i].size]).fold(0.0, f64::hypot);
    let mut sizes = vec![0.0; n];
    for j in 0..n {
        let unit = DVector::from_fn(n, |i, _| if i == j { Dd::ONE } else { Dd::ZERO });
        let (column, moved) = (solve(&value, &unit), moved(j));
        sizes.iter_mut().zip(column.iter()).for_each(|(size, c)| *size = f64::hypot(*size, c.to_f64() * moved));
    }
    DVector::from_fn(n, |i, _| Magnitude::new(x[i]).of_size(sizes[i]))
}

/// A matrix column by column, or a vector.
fn list<T: nalgebra::Scalar + Copy, R: nalgebra::Dim, C: nalgebra::Dim, S: nalgebra::RawStorage<T, R, C>>(
    matrix: &nalgebra::Matrix<T, R, C, S>,
) -> Vec<T> {
    matrix.iter().copied().collect()
}
