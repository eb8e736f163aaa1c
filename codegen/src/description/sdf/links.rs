//! Links with their inertias.

use super::frames::FrameKind;
use super::Sdf;
use crate::description::xml::{children, tag};
use crate::description::{messages, Noted, WrittenInertial, WrittenLink};
use roxmltree::Node;
use straightline_core::spatial::Sym3;

/// What the format says of links that do not say it \[kg, kg·m²\].
const DEFAULT_MASS: f64 = 1.0;
const DEFAULT_INERTIA: Sym3<f64> = Sym3 { xx: 1.0, xy: 0.0, xz: 0.0, yy: 1.0, yz: 0.0, zz: 1.0 };

impl<'d, 'i> Sdf<'_, 'd, 'i> {
    /// The frames of a kind that move with the robot or stand beside it in its file, in the order of the file.
    pub fn frames_of(&self, kind: FrameKind) -> Vec<usize> {
        let is_it = |frame: &usize| self.frames[*frame].kind == kind;
        let mut frames: Vec<usize> = (0..self.frames.len()).filter(is_it).collect();
        frames.sort_by_key(|frame| self.frames[*frame].element.range().start);
        frames
    }

    /// Reads the links that can move.
    pub fn read_links(&mut self) {
        for frame in self.frames_of(FrameKind::Link) {
            let (element, name) = (self.frames[frame].element, self.frames[frame].name.clone());
            if self.frames[frame].is_static {
                continue;
            }
            let owner = self.owner_of(frame);
            let [_, inertial, gravity, kinematic, must_be_base, decay] = self.pick(
                &owner,
                element,
                ["pose", "inertial", "gravity", "kinematic", "must_be_base_link", "velocity_decay"],
            );
            if let Some(gravity) = gravity.filter(|gravity| !self.is_set(*gravity, &owner)) {
                self.refuse(gravity, &owner, "gravity would act on the other links alone", "remove it");
            }
            if let Some(kinematic) = kinematic.filter(|kinematic| self.is_set(*kinematic, &owner)) {
                let help = "remove it; what does not move is fixed by a joint whose parent is `world`";
                self.refuse(kinematic, &owner, "forces would not move the link", help);
            }
            if let Some(base) = must_be_base.filter(|base| self.is_set(*base, &owner)) {
                let help = "remove it: the link that no joint moves is the base, which moves freely";
                self.refuse(base, &owner, "joints would be others than those that are written", help);
            }
            for damping in decay.into_iter().flat_map(children) {
                let value = self.number_in(Some(damping), &format!("velocity_decay of {owner}"));
                if value.is_some_and(|value| value.value != 0.0) {
                    let help = "remove it; dampers act on joints";
                    self.refuse(damping, &owner, "a force would act on the link as it moves", help);
                }
            }
            let inertial = match inertial {
                Some(inertial) => self.read_inertial(inertial, &owner),
                None => {
                    self.complain(&tag(element), messages::default_inertial(&owner, "inertial"));
                    let pose = self.pose_in(element, &owner).1;
                    let place = pose.xyz.place;
                    let rotation = crate::description::Rotation::identity(place.clone());
                    Some(WrittenInertial {
                        mass: Noted::new(DEFAULT_MASS, place.clone()),
                        com: Noted::new([0.0; 3], place.clone()),
                        rotation,
                        inertia: Noted::new(DEFAULT_INERTIA, place),
                    })
                }
            };
            self.robot.has_holes |= inertial.is_none();
            self.robot.links.push(WrittenLink { name, inertial, is_carrier: false });
        }
    }

    fn read_inertial(&mut self, element: Node<'d, 'i>, owner: &str) -> Option<WrittenInertial> {
        let [mass, inertia, _, added] =
            self.pick(&format!("inertial of {owner}"), element, ["mass", "inertia", "pose", "fluid_added_mass"]);
        if let Some((word, span)) = self.attribute(element, "auto") {
            if self.flag(&format!("auto of the inertial of {owner}"), word, &span) {
                let why = "the inertia would be made of the shapes for collisions";
                let help = "write `<mass>`, `<pose>` and `<inertia>`, and remove `auto`";
                self.complain(&span, messages::not_supported_yet(owner, "auto", why, help));
            }
        }
        for entry in added.into_iter().flat_map(children) {
            let value = self.number_in(Some(entry), &format!("fluid_added_mass of {owner}"));
            if value.is_some_and(|value| value.value != 0.0) {
                let why = "a medium would move with the link";
                self.refuse(entry, owner, why, "remove it: links move in empty space");
            }
        }
        let of = format!("the inertial of {owner}");
        let (pose_element, pose) = self.pose_in(element, &of);
        let named =
            pose_element.and_then(|pose| self.attribute(pose, "relative_to").or_else(|| self.attribute(pose, "frame")));
        if let Some((_, span)) = named {
            let help = "give the pose in the link's own frame, and remove the attribute";
            let why = "the pose of an inertial counts in the frame of its link";
            self.complain(&span, messages::not_supported_yet(&of, "relative_to", why, help));
        }
        let mass = match mass {
            Some(mass) => self.number_in(Some(mass), owner),
            None => {
                self.complain(&tag(element), messages::default_inertial(owner, "mass"));
                Some(self.reader.value(DEFAULT_MASS, &tag(element)))
            }
        };
        let inertia = match inertia {
            Some(inertia) => self.read_inertia(inertia, owner),
            None => {
                self.complain(&tag(element), messages::default_inertial(owner, "inertia"));
                Some(self.reader.value(DEFAULT_INERTIA, &tag(element)))
            }
        };
        Some(WrittenInertial { mass: mass?, com: pose.xyz, rotation: pose.rotation, inertia: inertia? })
    }

    fn read_inertia(&mut self, element: Node<'d, 'i>, owner: &str) -> Option<Noted<Sym3<f64>>> {
        const ENTRIES: [&str; 6] = ["ixx", "ixy", "ixz", "iyy", "iyz", "izz"];
        let found = self.pick(&format!("inertia of {owner}"), element, ENTRIES);
        let mut numbers = [Some(0.0); 6];
        for (k, entry) in found.into_iter().enumerate() {
            let is_diagonal = [0, 3, 5].contains(&k);
            numbers[k] = match entry {
                Some(entry) => self.number_in(Some(entry), owner).map(|number| number.value),
                None if is_diagonal => {
                    let example = format!("<{0}>0.1</{0}>", ENTRIES[k]);
                    let complaint = messages::missing_element(&format!("the inertia of {owner}"), ENTRIES[k], &example);
                    self.complain(&tag(element), complaint);
                    None
                }
                None => Some(0.0),
            };
        }
        let [xx, xy, xz, yy, yz, zz] = numbers;
        Some(self.reader.value(Sym3 { xx: xx?, xy: xy?, xz: xz?, yy: yy?, yz: yz?, zz: zz? }, &tag(element)))
    }
}
