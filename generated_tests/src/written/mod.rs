//! Robot files as people and exporters write them: numbers of few digits, right angles cut anywhere, dust, zeros, mixed units.
//!
//! Sixteen random digits hide what such numbers show: a length of 1e-17 that is none, an angle that is a right one to five digits.
//! A robot is made from a [`Style`] and a seed, written as URDF or TOML, and shrunk to its least where something fails. Nothing here
//! knows the compiler, so that tests of every package can take these files.

mod make;
mod numbers;
mod shrink;

pub use make::{Shape, Style};
pub use numbers::{cut, decimals, significant, Random};

use std::fmt::{self, Write};

/// How a link hangs on its parent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Turns within limits.
    Revolute,
    /// Turns.
    Continuous,
    /// Slides.
    Prismatic,
    /// Does not move.
    Fixed,
}

impl Motion {
    fn name(self) -> &'static str {
        match self {
            Motion::Revolute => "revolute",
            Motion::Continuous => "continuous",
            Motion::Prismatic => "prismatic",
            Motion::Fixed => "fixed",
        }
    }
}

/// What a link weighs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inertial {
    /// \[kg\].
    pub mass: f64,
    /// Centre of mass in the link's frame \[m\].
    pub com: [f64; 3],
    /// Axes of the inertia against the link's: roll, pitch, yaw \[rad\].
    pub rpy: [f64; 3],
    /// xx, yy, zz, xy, xz, yz about the centre of mass \[kg·m²\].
    pub inertia: [f64; 6],
}

/// A link with the joint that carries it.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// Index of the link that carries it; of the root its own.
    pub parent: usize,
    /// Of the joint; of the root without meaning.
    pub motion: Motion,
    /// The joint frame in the parent's \[m\].
    pub xyz: [f64; 3],
    /// Roll, pitch, yaw \[rad\].
    pub rpy: [f64; 3],
    /// In the joint frame.
    pub axis: [f64; 3],
    /// None where the file says nothing of mass.
    pub inertial: Option<Inertial>,
    /// Lower, upper, velocity, effort.
    pub limits: Option<[f64; 4]>,
    /// Viscous and dry friction.
    pub friction: [f64; 2],
}

/// A robot as it stands in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Written {
    /// The root link, 0, moves freely.
    pub floating: bool,
    /// Written as TOML, otherwise as URDF.
    pub toml: bool,
    /// Every link stands behind its parent.
    pub links: Vec<Link>,
}

/// Numbers with a separator between them, each in the fewest digits that are it.
fn row(numbers: &[f64], separator: &str) -> String {
    numbers.iter().map(|x| format!("{x:?}")).collect::<Vec<_>>().join(separator)
}

fn list(numbers: &[f64]) -> String {
    format!("[{}]", row(numbers, ", "))
}

impl Written {
    /// The name of the file.
    pub fn file_name(&self) -> &'static str {
        if self.toml {
            "written.toml"
        } else {
            "written.urdf"
        }
    }

    /// The text of the file.
    pub fn text(&self) -> String {
        let mut text = String::new();
        let done = if self.toml { self.write_toml(&mut text) } else { self.write_urdf(&mut text) };
        done.expect("a string takes what is written");
        text
    }

    /// Links that carry none: what tools hang on.
    pub fn tips(&self) -> Vec<String> {
        let carries = |i: usize| self.links.iter().skip(1).any(|link| link.parent == i);
        (1..self.links.len()).filter(|i| !carries(*i)).map(|i| format!("l{i}")).collect()
    }

    /// Number of joints that move.
    pub fn joints(&self) -> usize {
        self.links.iter().skip(1).filter(|link| link.motion != Motion::Fixed).count()
    }

    fn write_urdf(&self, text: &mut String) -> fmt::Result {
        writeln!(text, "<robot name=\"written\">")?;
        for (i, link) in self.links.iter().enumerate() {
            let Some(Inertial { mass, com, rpy, inertia: [xx, yy, zz, xy, xz, yz] }) = link.inertial else {
                writeln!(text, "  <link name=\"l{i}\"/>")?;
                continue;
            };
            writeln!(
                text,
                "  <link name=\"l{i}\"><inertial><origin xyz=\"{}\" rpy=\"{}\"/><mass value=\"{mass:?}\"/>\n    <inertia ixx=\"{xx:?}\" \
                 ixy=\"{xy:?}\" ixz=\"{xz:?}\" iyy=\"{yy:?}\" iyz=\"{yz:?}\" izz=\"{zz:?}\"/></inertial></link>",
                row(&com, " "),
                row(&rpy, " "),
            )?;
        }
        for (i, link) in self.links.iter().enumerate().skip(1) {
            let Link { parent, motion, xyz, rpy, axis, limits, friction: [damping, friction], .. } = link;
            writeln!(
                text,
                "  <joint name=\"j{i}\" type=\"{}\"><parent link=\"l{parent}\"/><child link=\"l{i}\"/><origin xyz=\"{}\" rpy=\"{}\"/>",
                motion.name(),
                row(xyz, " "),
                row(rpy, " ")
            )?;
            if *motion != Motion::Fixed {
                writeln!(text, "    <axis xyz=\"{}\"/>", row(axis, " "))?;
                if *damping != 0.0 || *friction != 0.0 {
                    writeln!(text, "    <dynamics damping=\"{damping:?}\" friction=\"{friction:?}\"/>")?;
                }
                match (limits, motion) {
                    (None, Motion::Continuous) => {}
                    (None, _) => {
                        writeln!(text, "    <limit lower=\"-3\" upper=\"3\" velocity=\"4\" effort=\"50\"/>")?;
                    }
                    (Some([_, _, velocity, effort]), Motion::Continuous) => {
                        writeln!(text, "    <limit velocity=\"{velocity:?}\" effort=\"{effort:?}\"/>")?;
                    }
                    (Some([lower, upper, velocity, effort]), _) => writeln!(
                        text,
                        "    <limit lower=\"{lower:?}\" upper=\"{upper:?}\" velocity=\"{velocity:?}\" effort=\"{effort:?}\"/>"
                    )?,
                }
            }
            writeln!(text, "  </joint>")?;
        }
        writeln!(text, "</robot>")
    }

    fn write_toml(&self, text: &mut String) -> fmt::Result {
        writeln!(text, "[robot]\nname = \"written\"")?;
        for (i, link) in self.links.iter().enumerate() {
            writeln!(text, "\n[[link]]\nname = \"l{i}\"")?;
            let Some(Inertial { mass, com, rpy, inertia: [xx, yy, zz, xy, xz, yz] }) = link.inertial else { continue };
            writeln!(text, "mass = {mass:?}\ncom = {}\ninertia_rpy = {}", list(&com), list(&rpy))?;
            writeln!(
                text,
                "inertia = {{ xx = {xx:?}, yy = {yy:?}, zz = {zz:?}, xy = {xy:?}, xz = {xz:?}, yz = {yz:?} }}"
            )?;
        }
        for (i, link) in self.links.iter().enumerate().skip(1) {
            let Link { parent, motion, xyz, rpy, axis, limits, friction: [damping, friction], .. } = link;
            writeln!(text, "\n[[joint]]\nname = \"j{i}\"\nkind = \"{}\"", motion.name())?;
            writeln!(text, "parent = \"l{parent}\"\nchild = \"l{i}\"")?;
            writeln!(text, "origin = {{ xyz = {}, rpy = {} }}", list(xyz), list(rpy))?;
            if *motion == Motion::Fixed {
                continue;
            }
            writeln!(text, "axis = {}", list(axis))?;
            if *damping != 0.0 || *friction != 0.0 {
                writeln!(text, "damping = {damping:?}\nfriction = {friction:?}")?;
            }
            match (limits, motion) {
                (None, _) => {}
                (Some([_, _, velocity, effort]), Motion::Continuous) => {
                    writeln!(text, "limits = {{ velocity = {velocity:?}, effort = {effort:?} }}")?;
                }
                (Some([lower, upper, velocity, effort]), _) => writeln!(
                    text,
                    "limits = {{ lower = {lower:?}, upper = {upper:?}, velocity = {velocity:?}, effort = {effort:?} }}"
                )?,
            }
        }
        Ok(())
    }
}
