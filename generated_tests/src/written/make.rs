//! From a style to a robot.

use super::numbers::{decimals, significant, Random};
use super::{Inertial, Link, Motion, Written};

/// How the numbers of a robot came to be written.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Style {
    /// So many digits behind the point, in lengths, angles and masses alike.
    Digits(usize),
    /// By an exporter of a drawing program: right angles cut anywhere, dust of 1e-10 to 1e-18 in place of zeros.
    Exported,
    /// By hand: masses of 1 and 0.5, lengths of 0.1 and 0.25, rods and balls.
    Round,
    /// A robot of micrograms, or one with some links of 1e-6 kg.
    Tiny,
    /// Neighbours with masses as 1 to 1e±20.
    Ratios,
    /// Millimetres, degrees and kg·mm² where metres, radians and kg·m² belong.
    Units,
}

impl Style {
    /// Every style, each number of digits for itself.
    pub fn all() -> Vec<Style> {
        use Style::*;
        (1..=16).map(Digits).chain([Exported, Round, Tiny, Ratios, Units]).collect()
    }

    /// Its name, without spaces.
    pub fn name(self) -> String {
        match self {
            Style::Digits(n) => format!("digits{n}"),
            style => format!("{style:?}").to_lowercase(),
        }
    }
}

/// What a robot is like beside its numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shape {
    /// Number of joints that move.
    pub joints: usize,
    /// One in so many links is welded to its parent beside them: fingers, tool frames. 0: none.
    pub fixed: usize,
    /// A tree, not a chain.
    pub branched: bool,
    /// The root moves freely.
    pub floating: bool,
    /// One in so many joints slides. 0: none.
    pub sliding: usize,
}

impl Shape {
    /// An arm whose joints turn.
    pub fn arm(joints: usize) -> Shape {
        Shape { joints, fixed: 0, branched: false, floating: false, sliding: 0 }
    }

    /// Any shape of one to so many joints, mostly few.
    pub fn any(random: &mut Random, most: usize) -> Shape {
        Shape {
            joints: 1 + random.below(most).min(random.below(most)),
            fixed: random.one_of(&[0, 2, 3]),
            branched: random.one_in(3),
            floating: random.one_in(8),
            sliding: random.one_of(&[0, 4, 2]),
        }
    }
}

impl Written {
    /// The robot of that style, shape and seed.
    pub fn new(style: Style, shape: Shape, seed: u64) -> Written {
        let mut random = Random(seed.wrapping_mul(0xd134_2543_de82_ef95));
        let mut maker = Maker { random: &mut random, style, unit: 1.0, weight: 1.0 };
        maker.robot(shape)
    }
}

struct Maker<'a> {
    random: &'a mut Random,
    style: Style,
    /// Lengths are written in this part of a metre.
    unit: f64,
    /// Masses are about so great \[kg\].
    weight: f64,
}

impl Maker<'_> {
    fn robot(&mut self, shape: Shape) -> Written {
        match self.style {
            Style::Units => self.unit = self.random.one_of(&[1000.0, 1000.0, 1.0, 0.001]),
            Style::Tiny => {
                self.weight = self.random.one_of(&[1.0, 1e-3, 1e-6]);
                self.unit = self.random.one_of(&[1.0, 0.1, 0.001]);
            }
            _ => {}
        }
        let root = shape.floating || self.random.one_in(2);
        let mut links = vec![Link {
            parent: 0,
            motion: Motion::Fixed,
            xyz: [0.0; 3],
            rpy: [0.0; 3],
            axis: [1.0, 0.0, 0.0],
            inertial: root.then(|| self.inertial(false)),
            limits: None,
            friction: [0.0; 2],
        }];
        let mut moving = 0;
        while moving < shape.joints {
            let welded = shape.fixed > 0 && self.random.one_in(shape.fixed + 1);
            links.push(self.link(&links, shape, welded));
            moving += usize::from(!welded);
        }
        // fingers and a tool frame on what moves last
        let last = links.len() - 1;
        for _ in 0..(if shape.fixed > 0 { self.random.below(3) } else { 0 }) {
            let link = self.link(&links, shape, true);
            links.push(Link { parent: last, ..link });
        }
        Written { floating: shape.floating, toml: self.random.one_in(3), links }
    }

    fn link(&mut self, links: &[Link], shape: Shape, welded: bool) -> Link {
        let last = links.len() - 1;
        let parent = if shape.branched { self.random.below(last + 1).max(self.random.below(last + 1)) } else { last };
        let motion = match welded {
            true => Motion::Fixed,
            false if shape.sliding > 0 && self.random.one_in(shape.sliding) => Motion::Prismatic,
            false => self.random.one_of(&[Motion::Revolute, Motion::Revolute, Motion::Continuous]),
        };
        let weightless = welded && self.random.one_in(2);
        let (limited, rubbed) = (self.random.one_in(2), self.random.one_in(6));
        Link {
            parent,
            motion,
            xyz: self.lengths(0.5),
            rpy: self.angles(),
            axis: self.axis(),
            inertial: (!weightless).then(|| self.inertial(welded)),
            limits: limited.then(|| self.limits()),
            friction: if rubbed { [0, 1].map(|_| decimals(self.random.between(0.0, 1.0), 2)) } else { [0.0; 2] },
        }
    }

    fn limits(&mut self) -> [f64; 4] {
        let (lower, upper) = (self.random.between(-3.1, -0.5), self.random.between(0.5, 3.1));
        let (velocity, effort) = (self.random.between(1.0, 6.0), self.random.between(5.0, 300.0));
        let digits = 1 + self.random.below(4);
        [lower, upper, velocity, effort].map(|x| decimals(x, digits))
    }

    /// Three lengths within ± `size`, some of them zero.
    fn lengths(&mut self, size: f64) -> [f64; 3] {
        [0; 3].map(|_| self.length(size))
    }

    fn length(&mut self, size: f64) -> f64 {
        let (unit, random) = (self.unit, &mut *self.random);
        let x = random.between(-size, size);
        if random.one_in(3) {
            return match self.style {
                Style::Exported if random.one_in(2) => random.dust(),
                _ => 0.0,
            };
        }
        match self.style {
            Style::Digits(n) => decimals(x, n),
            Style::Exported if random.one_in(4) => decimals(x, 3) + random.dust(),
            Style::Exported => decimals(x, 1 + random.below(16)),
            Style::Round => random.sign() * random.one_of(&[0.1, 0.2, 0.25, 0.3, 0.4, 0.5, 1.0]) * (size / 0.5),
            // one number in millimetres beside others in metres
            Style::Units if random.one_in(6) => decimals(x, 3),
            Style::Units => decimals(x * unit, if unit > 1.0 { random.below(3) } else { 4 }),
            Style::Tiny | Style::Ratios => significant(x * unit, 1 + random.below(5)),
        }
    }

    /// Roll, pitch and yaw, most of them zero or right.
    fn angles(&mut self) -> [f64; 3] {
        let any = self.random.one_in(4);
        [0; 3].map(|_| self.angle(any))
    }

    fn angle(&mut self, any: bool) -> f64 {
        let random = &mut *self.random;
        if !any && random.one_in(2) {
            return match self.style {
                Style::Exported if random.one_in(3) => random.dust(),
                _ => 0.0,
            };
        }
        let x = if any { random.between(-3.1, 3.1) } else { random.right_angle() };
        match self.style {
            Style::Digits(n) => decimals(x, n),
            Style::Exported if any && random.one_in(3) => random.right_angle() + random.dust(),
            Style::Exported if any => decimals(x, 1 + random.below(16)),
            Style::Units if random.one_in(3) => decimals(x.to_degrees(), random.below(3)),
            Style::Round if any => decimals(x, 1),
            _ => x,
        }
    }

    fn axis(&mut self) -> [f64; 3] {
        let random = &mut *self.random;
        let mut axis = [0.0; 3];
        axis[random.below(3)] = random.sign();
        if random.one_in(4) {
            // oblique
            let digits = match self.style {
                Style::Digits(n) => n,
                _ => 1 + random.below(8),
            };
            let oblique = [0; 3].map(|_| decimals(random.between(-1.0, 1.0), digits));
            let long = oblique.iter().map(|x| x * x).sum::<f64>() > 0.1;
            return match self.style {
                Style::Exported | Style::Round => {
                    let half = decimals(std::f64::consts::FRAC_1_SQRT_2, 1 + random.below(12));
                    let zero = if self.style == Style::Exported { random.dust() } else { 0.0 };
                    let mut axis = [random.sign() * half, random.sign() * half, zero];
                    axis.rotate_left(random.below(3));
                    axis
                }
                _ if long => oblique,
                _ => axis,
            };
        }
        if self.style == Style::Exported && random.one_in(2) {
            for x in axis.iter_mut().filter(|x| **x == 0.0) {
                if random.one_in(2) {
                    *x = random.dust();
                }
            }
        }
        axis
    }

    /// What belongs to a rigid body: second moments along three axes are positive, and turned.
    fn inertial(&mut self, welded: bool) -> Inertial {
        let com = self.lengths(0.2);
        let mass = self.mass(welded);
        let (unit, random) = (self.unit, &mut *self.random);
        if mass == 0.0 {
            return Inertial { mass, com, rpy: [0.0; 3], inertia: [0.0; 6] };
        }
        // in kg·mm² where the file is in millimetres, or in kg·m² beside them
        let mixed = self.style == Style::Units && random.one_in(3);
        let unit = if mixed { 1.0 } else { unit };
        let size = mass * unit * unit * random.between(0.0005, 0.02);
        let d = [0; 3].map(|_| size * random.between(0.5, 1.0));
        let mut inertia = [d[1] + d[2], d[0] + d[2], d[0] + d[1], 0.0, 0.0, 0.0];
        let products = !random.one_in(3);
        let digits = match self.style {
            Style::Digits(n) => n,
            Style::Round => 1 + random.below(2),
            _ => 1 + random.below(16),
        };
        for x in &mut inertia[3..] {
            *x = match self.style {
                Style::Exported if random.one_in(2) => random.dust() * mass.min(1.0),
                _ if products && !random.one_in(3) => random.between(-0.2, 0.2) * size,
                _ => 0.0,
            };
        }
        if self.style == Style::Round {
            inertia[3..].fill(0.0);
            match random.below(3) {
                // a ball
                0 => inertia = [inertia[0], inertia[0], inertia[0], 0.0, 0.0, 0.0],
                // a rod
                1 => {
                    inertia[2] = inertia[0] / 4.0;
                    inertia[1] = inertia[0];
                }
                _ => {}
            }
        }
        let inertia = inertia.map(|x| significant(x, digits));
        let turned = self.random.one_in(4);
        let rpy = if turned { self.angles() } else { [0.0; 3] };
        Inertial { mass, com, rpy, inertia }
    }

    fn mass(&mut self, welded: bool) -> f64 {
        let (weight, random) = (self.weight, &mut *self.random);
        if welded && random.one_in(4) {
            return 0.0;
        }
        let x = random.between(0.2, 8.0);
        match self.style {
            Style::Digits(n) => decimals(x, n),
            Style::Exported => decimals(x, 1 + random.below(16)),
            Style::Round => random.one_of(&[1.0, 1.0, 0.5, 2.0, 5.0, 10.0]),
            Style::Tiny => significant(x * weight * random.one_of(&[1.0, 1.0, 1e-6, 1e-3]), 1 + random.below(4)),
            Style::Ratios => {
                let ratio = 10f64.powi(random.one_of(&[0, 0, 0, 20, -20, 10, -10]));
                significant(x, 1 + random.below(4)) * ratio
            }
            Style::Units => decimals(x, random.below(4)).max(0.1),
        }
    }
}
