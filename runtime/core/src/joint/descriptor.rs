//! What is known of a kind of joint besides its mechanics: the columns of the table of joints.

use super::JointKind;
use crate::real::Real;
use crate::spatial::Transform;

/// A row of the table of joints.
#[derive(Clone, Copy, Debug)]
pub struct Descriptor {
    /// Name of the kind, as generated files write it.
    pub name: &'static str,
    /// The words of robot files that mean it, in the order in which messages list them.
    pub words: &'static [Word],
    /// Key of a robot file for the number that a joint of the kind has of its own, such as a pitch.
    pub number: Option<&'static str>,
    /// Whether robot files give it an axis, which is z of its frame; the frame of other joints is the one of the file.
    pub has_axis: bool,
    /// What the joint does: "turns".
    pub verb: &'static str,
    /// What each velocity coordinate measures; as many as the joint has velocity coordinates.
    pub measures: &'static [Measure],
    /// Coordinates q at which the joint does nothing; as many as the joint has configuration coordinates.
    pub neutral: &'static [f64],
    /// First of the four configuration coordinates that are a unit quaternion (x, y, z, w). Those before it measure as the velocity
    /// coordinates of the same index.
    pub quaternion: Option<usize>,
    /// Names of the entries of q, of q̇ and of τ; none where the joint has one coordinate, which has the joint's name.
    pub entries: [&'static [&'static str]; 3],
    /// The coordinates in words, where there are several; a line each of q and of the rates.
    pub coordinates: &'static str,
    /// Whether it is no joint between bodies: a floating base, of which q says all.
    pub is_base: bool,
    /// The joint is a turn about z or a slide along z and nothing else: which of them.
    pub elementary: Option<Measure>,
}

/// What a coordinate measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measure {
    /// An angle, whose force is a moment.
    Angle,
    /// A length.
    Length,
}

impl Measure {
    /// Units of the coordinate, its rate, its acceleration and its force.
    pub const fn units(self) -> [&'static str; 4] {
        match self {
            Measure::Angle => ["rad", "rad/s", "rad/s²", "N·m"],
            Measure::Length => ["m", "m/s", "m/s²", "N"],
        }
    }

    /// The kind of joint that has this one coordinate about or along z, and nothing else.
    pub fn joint(self) -> JointKind {
        let kinds = JointKind::ALL.iter().copied();
        kinds.into_iter().find(|kind| kind.elementary() == Some(self)).expect("there is a joint that does just this")
    }
}

/// A word of a robot file that means a kind of joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Word {
    /// As it is written.
    pub text: &'static str,
    /// Whether the joint has a range of its coordinate, which the file then gives.
    pub has_range: bool,
    /// The kinds of file that have the word.
    pub dialects: &'static [Dialect],
}

impl Word {
    /// A word for joints with a range.
    pub const fn ranged(text: &'static str, dialects: &'static [Dialect]) -> Self {
        Word { text, has_range: true, dialects }
    }
}

/// The kinds of robot files, by the words that they have.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dialect {
    /// URDF.
    Urdf,
    /// TOML with joint frames.
    JointFrames,
    /// TOML with centres of mass, the chapter's.
    CentresOfMass,
    /// MJCF.
    Mjcf,
    /// SDF.
    Sdf,
}

impl Dialect {
    /// Files that describe joints by frames.
    pub const FRAMES: &'static [Dialect] = &[Dialect::Urdf, Dialect::JointFrames];
    /// Files that call joints by the words of mechanics: all but MJCF, which has words of its own.
    pub const NAMED: &'static [Dialect] = &[Dialect::Urdf, Dialect::JointFrames, Dialect::CentresOfMass, Dialect::Sdf];
    /// Files that have joints which do not move.
    pub const WITH_FIXED: &'static [Dialect] = &[Dialect::Urdf, Dialect::JointFrames, Dialect::Sdf];
}

impl JointKind {
    /// Number of configuration coordinates.
    pub const fn nq(self) -> usize {
        self.row().neutral.len()
    }

    /// Number of velocity coordinates.
    pub const fn nv(self) -> usize {
        self.row().measures.len()
    }

    /// Whether it has one coordinate, which then may have a range, friction, a spring and a drive.
    pub const fn is_single(self) -> bool {
        self.nq() == 1
    }

    /// Whether it is a floating base.
    pub const fn is_base(self) -> bool {
        self.row().is_base
    }

    /// [`Descriptor::elementary`].
    pub const fn elementary(self) -> Option<Measure> {
        self.row().elementary
    }

    /// Whether it turns about z and does nothing else.
    pub fn turns(self) -> bool {
        self.elementary() == Some(Measure::Angle)
    }

    /// Whether it slides along z and does nothing else.
    pub fn slides(self) -> bool {
        self.elementary() == Some(Measure::Length)
    }

    /// Whether it turns about all axes and does nothing else: its coordinates are a quaternion alone.
    pub fn turns_freely(self) -> bool {
        self.row().quaternion == Some(0)
    }

    /// What its configuration coordinates measure, those of a quaternion left out.
    pub fn measures(self) -> impl Iterator<Item = Measure> {
        let row = self.row();
        row.measures.iter().copied().take(row.quaternion.unwrap_or(row.neutral.len()))
    }

    /// Units of the coordinate, its rate, its acceleration and its force; of several coordinates those of the first.
    pub const fn units(self) -> [&'static str; 4] {
        self.row().measures[0].units()
    }
}

impl JointKind {
    /// Pose of the body in the joint's frame at these coordinates of the joint.
    pub fn motion<T: Real>(self, q: &[T]) -> Transform<T> {
        self.mechanics().motion(q)
    }

    /// dq/dt of the joint's own coordinates.
    pub fn configuration_rate<T: Real>(self, q: &[T], qd: &[T], rate: &mut [T]) {
        self.mechanics().configuration_rate(q, qd, rate);
    }

    /// Brings the quaternion among the joint's own coordinates to length one.
    pub fn normalise<T: Real>(self, q: &mut [T]) {
        let Some(first) = self.row().quaternion else { return };
        let quaternion = &mut q[first..first + 4];
        let length = quaternion.iter().fold(T::zero(), |sum, x| sum + *x * *x).sqrt();
        quaternion.iter_mut().for_each(|x| *x = *x / length);
    }
}

/// All kinds of joints.
pub const KINDS: &[JointKind] = JointKind::ALL;

/// The kind of a floating base.
pub const FLOATING_BASE: JointKind = {
    let mut k = 0;
    while !JointKind::ALL[k].is_base() {
        k += 1;
    }
    JointKind::ALL[k]
};

/// Most configuration coordinates that a joint can have: a pose with a quaternion.
pub const MOST_COORDINATES: usize = 7;

/// The words that a kind of robot file has for joints, each with the kind it means.
pub fn words(dialect: Dialect) -> impl Iterator<Item = (JointKind, &'static Word)> {
    let of_kind = |kind: &'static JointKind| kind.row().words.iter().map(|word| (*kind, word));
    JointKind::ALL.iter().flat_map(of_kind).filter(move |(_, word)| word.dialects.contains(&dialect))
}

/// The kinds, and what goes by kind: the one place that tells them apart. A row is a file and the type in it; a kind with numbers of its own, such
/// as a pitch, has them in that type: `screw::Screw(screw: Screw = Screw::of(0.0))`.
macro_rules! joints {
    (% $Own:ident $Name:ident $number:ident) => { JointKind::$Name($Own::of($number)) };
    (% $Name:ident $number:ident) => {{
        let _ = $number;
        JointKind::$Name
    }};
    (@$own:ident $module:ident::$Name:ident) => { $own };
    (@$module:ident::$Name:ident) => { &$module::$Name };
    ($($(#[$about:meta])* $module:ident::$Name:ident $(($own:ident: $Own:ident = $zero:expr))?,)+) => {
        $($(pub use $module::$Own;)?)+
        $(mod $module;)+

        /// How a body moves against its parent.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum JointKind {
            $($(#[$about])* $Name $(($Own))?,)+
        }

        impl JointKind {
            /// All kinds.
            pub const ALL: &'static [JointKind] = &[$(JointKind::$Name $(($zero))?),+];

            /// Its row of the table.
            pub const fn row(self) -> &'static Descriptor {
                match self {
                    $(JointKind::$Name { .. } => &$module::ROW,)+
                }
            }

            /// The same kind with another number of its own, where it has one.
            pub fn with_number(self, number: f64) -> JointKind {
                match self {
                    $(JointKind::$Name { .. } => joints!(% $($Own)? $Name number),)+
                }
            }

            /// Its mechanics.
            pub(crate) fn mechanics<T: crate::Real>(&self) -> &dyn Mechanics<T> {
                match self {
                    $(JointKind::$Name $(($own))? => joints!(@$($own)? $module::$Name),)+
                }
            }
        }
    };
}
