//! Mass, centre of mass and inertia of a body: as written, or made of its geoms.

use super::bodies::Contents;
use super::classes::Defaulted;
use super::files::Element;
use super::geoms::Solid;
use super::settings::CompilerSettings;
use super::{vocabulary, Mjcf};
use crate::description::angle::{self, transform};
use crate::description::geometry::{compose, point, snap_tensor, vector};
use crate::description::merge::{merge, Part};
use crate::description::{messages, Noted, Rotation, WrittenInertial};
use crate::diagnostic::Place;
use straightline_core::spatial::{Sym3, Transform, Vec3};
use straightline_core::Dd;

/// Where a geom stands between two points.
struct Segment {
    pose: Transform<Dd>,
    half_length: Dd,
}

impl<'s> Mjcf<'s> {
    /// The inertia of a body; none if nothing says it.
    pub fn read_inertia(&mut self, body: &'s Element, contents: &Contents<'s>, owner: &str) -> Option<WrittenInertial> {
        let written = contents.of("inertial");
        if let Some(second) = written.get(1) {
            self.complain_at(second.element, messages::repeated_element(owner, "inertial"));
        }
        if let Some(displaced) = written.first().filter(|inertial| contents.is_displaced(inertial)) {
            self.refuse(displaced.element, owner, "it would stand in a frame", "write it outside of `<frame>`");
        }
        let by_geoms = self.settings[body.scope].inertia_from_geoms.unwrap_or(written.is_empty());
        let mut parts = Vec::new();
        for geom in contents.of("geom") {
            let given = self.given(geom.element, "geom", geom.class);
            match by_geoms && self.is_in_group(&given) {
                true => parts.extend(self.read_geom(&given, &contents.pose_around(geom))),
                false => self.ignore(geom.element),
            }
        }
        let inertial = if parts.is_empty() {
            written.first().and_then(|inertial| self.read_inertial(inertial.element, owner))
        } else {
            Some(of_parts(&parts, self.tag(body)))
        };
        // bounds are those of every body, also of one without mass
        let is_bounded = self.settings[body.scope].bounds.iter().any(|bound| *bound > 0.0);
        let inertial = inertial.or_else(|| is_bounded.then(|| of_parts(&[], self.tag(body))));
        inertial.map(|inertial| self.settings[body.scope].corrected(inertial))
    }

    /// An inertia as it is written.
    fn read_inertial(&mut self, element: &'s Element, owner: &str) -> Option<WrittenInertial> {
        let owner = format!("the inertial of {owner}");
        self.check_attributes(element, &owner, vocabulary::INERTIAL);
        let given = Defaulted::alone(element);
        for (name, example) in [("pos", "pos=\"0 0 0\""), ("mass", "mass=\"1\"")] {
            if given.attribute(name).is_none() {
                self.complain_at(element, messages::missing_attribute(&owner, name, example));
            }
        }
        let pose = self.pose(&given, &owner);
        let mass = self.number(&given, "mass", &owner);
        let full = self.some_numbers::<6>(&given, "fullinertia", &owner);
        let diagonal = self.some_numbers::<3>(&given, "diaginertia", &owner);
        let has = |name| given.attribute(name).is_some();
        let place = given.attribute("fullinertia").or(given.attribute("diaginertia"));
        let place = place.map_or_else(|| self.tag(element), |attribute| self.place(attribute));
        let second =
            ["diaginertia", "quat", "axisangle", "xyaxes", "zaxis", "euler"].into_iter().find(|name| has(name));
        if let (true, Some(second)) = (has("fullinertia"), second) {
            self.complain_at(element, messages::written_twice(&owner, "fullinertia", second));
        }
        let tensor = match (full, diagonal) {
            (Some([xx, yy, zz, xy, xz, yz]), _) => Sym3 { xx, xy, xz, yy, yz, zz },
            (_, Some([xx, yy, zz])) => Sym3 { xx, xy: 0.0, xz: 0.0, yy, yz: 0.0, zz },
            // a point mass, or complained of
            _ => Sym3 { xx: 0.0, xy: 0.0, xz: 0.0, yy: 0.0, yz: 0.0, zz: 0.0 },
        };
        let rotation = pose.rotation;
        Some(WrittenInertial { mass: mass?, com: pose.xyz, rotation, inertia: Noted::new(tensor, place) })
    }

    /// Whether a geom is of a group that inertias are made of.
    fn is_in_group(&mut self, given: &Defaulted<'s>) -> bool {
        let group = self.number(given, "group", "a geom").map_or(0.0, |group| group.value);
        let [first, last] = self.settings[given.element.scope].groups;
        (first..=last).contains(&group)
    }

    /// Mass and inertia of a geom in its body; none if it has no mass, or after a complaint.
    fn read_geom(&mut self, given: &Defaulted<'s>, around: &Transform<Dd>) -> Option<Part> {
        let element = given.element;
        let owner = match element.attribute("name") {
            Some(name) => format!("geom `{}`", name.value),
            None => "a geom".to_string(),
        };
        self.check_attributes(element, &owner, vocabulary::GEOM);
        const TYPES: &[&str] = &["plane", "hfield", "sphere", "capsule", "ellipsoid", "cylinder", "box", "mesh", "sdf"];
        let word = match given.attribute("type") {
            None => "sphere",
            Some(_) => self.word(given, "type", TYPES)?,
        };
        let mass = self.number(given, "mass", &owner);
        let density = self.number(given, "density", &owner).map_or(1000.0, |density| density.value);
        let is_massless = mass.as_ref().map_or(density, |mass| mass.value) == 0.0;
        if is_massless || ["plane", "hfield"].contains(&word) {
            return None;
        }
        if self.flag(given, "shellinertia") == Some(true) {
            if let Some(attribute) = given.attribute("shellinertia") {
                let help = "write `<inertial>` in the body, or remove it: the geom is then solid";
                let why = "the mass of the geom would be on its surface";
                self.complain(attribute, messages::not_supported_yet(&owner, "shellinertia", why, help));
            }
            return None;
        }
        let (solid, pose) = match (Solid::of_word(word), given.attribute("mesh")) {
            (Some(_), Some(mesh)) => {
                let help = "write `type=\"mesh\"`, or the size of the geom in place of the mesh";
                let complaint = messages::not_supported_yet(&owner, "mesh", "the geom would be fitted to it", help);
                self.complain(mesh, complaint);
                return None;
            }
            (Some(solid), None) => {
                let (size, pose) = self.size_and_pose(given, solid, &owner)?;
                let (volume, [xx, yy, zz]) = solid.of_size(size);
                let o = Dd::ZERO;
                let inertia_com = Sym3 { xx, xy: o, xz: o, yy, yz: o, zz }.map(|x| x * volume);
                (Part { mass: volume, com: Vec3::zero(), inertia_com }, pose)
            }
            (None, _) => {
                let solid = self.read_mesh(given, &owner)?;
                (solid, transform(&self.pose(given, &owner), angle::ROUNDING))
            }
        };
        // volumes so far
        let density = mass.map_or_else(|| Dd::from(density), |mass| Dd::from(mass.value) / solid.mass);
        let Part { mass, com, inertia_com } = solid;
        let pose = compose(around, &pose);
        Some(Part::placed(mass * density, com, inertia_com.map(|x| x * density), &pose))
    }

    /// Size and pose of a geom, by `size` and `pos` or by `fromto`.
    fn size_and_pose(&mut self, given: &Defaulted<'s>, solid: Solid, owner: &str) -> Option<([Dd; 3], Transform<Dd>)> {
        let mut size = [0.0; 3];
        let mut count = 0;
        for attribute in given.layers_of("size").into_iter().rev() {
            let numbers = self.numbers(&format!("size of {owner}"), attribute, 1, 3)?;
            count = count.max(numbers.len());
            size[..numbers.len()].copy_from_slice(&numbers);
        }
        let mut size = size.map(Dd::from);
        let segment = match given.attribute("fromto") {
            Some(attribute) if solid == Solid::Sphere => {
                self.complain(attribute, messages::geom_size(owner, "`fromto` is no place of a sphere"));
                return None;
            }
            Some(attribute) => {
                let numbers = self.numbers(&format!("fromto of {owner}"), attribute, 6, 6)?;
                let segment = segment([0, 1, 2].map(|i| numbers[i]), [3, 4, 5].map(|i| numbers[i]));
                if segment.is_none() {
                    self.complain(attribute, messages::geom_size(owner, "`fromto` has no length"));
                    return None;
                }
                segment
            }
            None => None,
        };
        let pose = match segment {
            None => transform(&self.pose(given, owner), angle::ROUNDING),
            Some(Segment { pose, half_length }) => {
                let along = match solid {
                    Solid::Box | Solid::Ellipsoid => {
                        size[1] = size[0];
                        2
                    }
                    _ => 1,
                };
                size[along] = half_length;
                count = 3;
                pose
            }
        };
        if count < solid.sizes() || size[..solid.sizes()].iter().any(|x| x.to_f64() <= 0.0) {
            let why = match solid.sizes() {
                1 => "it needs one positive number",
                2 => "it needs two positive numbers, radius and half length, or `fromto`",
                _ => "it needs three positive numbers, half the lengths",
            };
            match given.attribute("size") {
                Some(attribute) => self.complain(attribute, messages::geom_size(owner, why)),
                None => self.complain_at(given.element, messages::geom_size(owner, why)),
            }
            return None;
        }
        Some((size, pose))
    }

    /// Brings the mass of all bodies to what the compiler says.
    pub fn scale_masses(&mut self) {
        let Some(total) = &self.settings[0].total_mass else { return };
        let inertials = || self.robot.links.iter().filter_map(|link| link.inertial.as_ref());
        let mass = inertials().fold(Dd::ZERO, |sum, inertial| sum + Dd::from(inertial.mass.value));
        if mass.to_f64() <= 0.0 {
            return;
        }
        let factor = Dd::from(total.value) / mass;
        let scaled = |x: f64| (Dd::from(x) * factor).to_f64();
        for inertial in self.robot.links.iter_mut().filter_map(|link| link.inertial.as_mut()) {
            inertial.mass.value = scaled(inertial.mass.value);
            inertial.inertia.value = inertial.inertia.value.map(scaled);
        }
    }
}

impl CompilerSettings<'_> {
    /// The inertia after what the compiler says of all of them.
    fn corrected(&self, mut inertial: WrittenInertial) -> WrittenInertial {
        let [least_mass, least_moment] = self.bounds;
        // without a bound what is negative stays, and is complained of
        if least_mass > 0.0 {
            inertial.mass.value = inertial.mass.value.max(least_mass);
        }
        if least_moment <= 0.0 && !self.balance {
            return inertial;
        }
        let (mut moments, axes) = principal_axes(inertial.inertia.value);
        let is_bounded = moments.iter().any(|moment| *moment < least_moment);
        moments = moments.map(|moment| moment.max(least_moment));
        let [a, b, c] = moments;
        let is_balanced = self.balance && (a + b < c || b + c < a || c + a < b);
        if is_balanced {
            moments = [(a + b + c) / 3.0; 3];
        }
        if is_bounded || is_balanced {
            let mut tensor = [[0.0; 3]; 3];
            for (i, row) in tensor.iter_mut().enumerate() {
                for (j, entry) in row.iter_mut().enumerate() {
                    *entry = (0..3).map(|k| axes[i][k] * moments[k] * axes[j][k]).sum();
                }
            }
            let [[xx, xy, xz], [_, yy, yz], [_, _, zz]] = tensor;
            inertial.inertia.value = Sym3 { xx, xy, xz, yy, yz, zz };
        }
        inertial
    }
}

/// Parts as one, in the axes of the body, rounded once.
fn of_parts(parts: &[Part], place: Place) -> WrittenInertial {
    let whole = merge(parts);
    WrittenInertial {
        mass: Noted::new(whole.mass.to_f64(), place.clone()),
        com: Noted::new(whole.com.map(|x| x.to_f64()).to_array(), place.clone()),
        rotation: Rotation::identity(place.clone()),
        inertia: Noted::new(snap_tensor(whole.inertia_com).map(|x| x.to_f64()), place),
    }
}

/// Where a solid stands whose axis goes from one point to another; `None` if they coincide.
fn segment(from: [f64; 3], to: [f64; 3]) -> Option<Segment> {
    let (from, to) = (vector(from), vector(to));
    let along = from - to;
    let length = along.dot(along).sqrt();
    if length.to_f64() < 1e-100 {
        return None;
    }
    let half = |x: Dd| x * Dd::HALF;
    let translation = point(&Transform::identity(), (from + to).map(half));
    let rotation = angle::z_to(along.map(|x| x / length));
    Some(Segment { pose: Transform { rotation, translation }, half_length: half(length) })
}

/// Principal moments and axes (columns) of a tensor: cyclic Jacobi rotations.
fn principal_axes(tensor: Sym3<f64>) -> ([f64; 3], [[f64; 3]; 3]) {
    let Sym3 { xx, xy, xz, yy, yz, zz } = tensor;
    let mut a = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
    let mut axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    for _ in 0..30 {
        for (p, q) in [(0, 1), (0, 2), (1, 2)] {
            if a[p][q] == 0.0 {
                continue;
            }
            let theta = (a[q][q] - a[p][p]) / (2.0 * a[p][q]);
            let t = theta.signum() / (theta.abs() + (theta * theta + 1.0).sqrt());
            let c = 1.0 / (t * t + 1.0).sqrt();
            let s = t * c;
            for matrix in [&mut a, &mut axes] {
                for row in matrix.iter_mut() {
                    (row[p], row[q]) = (c * row[p] - s * row[q], s * row[p] + c * row[q]);
                }
            }
            let (of_p, of_q) = (a[p], a[q]);
            a[p] = [0, 1, 2].map(|k| c * of_p[k] - s * of_q[k]);
            a[q] = [0, 1, 2].map(|k| s * of_p[k] + c * of_q[k]);
        }
    }
    ([a[0][0], a[1][1], a[2][2]], axes)
}
