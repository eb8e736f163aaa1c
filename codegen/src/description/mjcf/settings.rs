//! What `compiler` and `option` say.

use super::classes::Defaulted;
use super::files::Element;
use super::{vocabulary, Mjcf};
use crate::description::{messages, AngleUnit, Noted};

/// What a file says for all of it.
pub(super) struct CompilerSettings<'s> {
    /// The unit of angles.
    pub angle: AngleUnit,
    /// Axes of Euler angles: `x` of the turning axes, `X` of those that stand.
    pub euler: [char; 3],
    /// A joint with a range is limited without saying so.
    pub autolimits: bool,
    /// Inertias are made of geoms; `None`: where a body has none.
    pub inertia_from_geoms: Option<bool>,
    /// The groups of geoms that inertias are made of.
    pub groups: [f64; 2],
    /// The least mass \[kg\] and the least principal moment \[kg·m²\].
    pub bounds: [f64; 2],
    /// Principal moments that no body has are replaced by their mean.
    pub balance: bool,
    /// The mass of all bodies \[kg\], where it is given.
    pub total_mass: Option<Noted<f64>>,
    /// Folder of meshes, relative to the file.
    pub mesh_folder: Option<&'s str>,
    /// File names count without their folders.
    pub strips_paths: bool,
}

impl Default for CompilerSettings<'_> {
    fn default() -> Self {
        CompilerSettings {
            angle: AngleUnit::Degree,
            euler: ['x', 'y', 'z'],
            autolimits: true,
            inertia_from_geoms: None,
            groups: [0.0, 5.0],
            bounds: [0.0; 2],
            balance: false,
            total_mass: None,
            mesh_folder: None,
            strips_paths: false,
        }
    }
}

impl<'s> Mjcf<'s> {
    /// Reads these sections.
    pub fn read_settings(&mut self, compilers: &[&'s Element], options: &[&'s Element]) {
        for element in compilers {
            self.read_compiler(element);
        }
        for element in options {
            self.read_option(element);
        }
    }

    fn read_compiler(&mut self, element: &'s Element) {
        self.check_attributes(element, "the compiler", vocabulary::COMPILER);
        let given = Defaulted::alone(element);
        if let Some(word) = self.word(&given, "angle", &["degree", "radian"]) {
            self.settings.angle = if word == "degree" { AngleUnit::Degree } else { AngleUnit::Radian };
        }
        if let Some("global") = self.word(&given, "coordinate", &["local", "global"]) {
            let help = "save the model with local coordinates first";
            self.refuse_attribute(element, "coordinate", "the compiler", "poses would be those in the world", help);
        }
        if let Some(attribute) = element.attribute("eulerseq") {
            let axes: Vec<char> = attribute.value.trim().chars().collect();
            match axes[..] {
                [a, b, c] if axes.iter().all(|axis| "xyzXYZ".contains(*axis)) => self.settings.euler = [a, b, c],
                _ => self
                    .complain(attribute, messages::unknown_word("eulerseq", &attribute.value, &["xyz", "XYZ", "zyx"])),
            }
        }
        if let Some(autolimits) = self.flag(&given, "autolimits") {
            self.settings.autolimits = autolimits;
        }
        if let Some(word) = self.word(&given, "inertiafromgeom", &["false", "true", "auto"]) {
            self.settings.inertia_from_geoms = if word == "auto" { None } else { Some(word == "true") };
        }
        if let Some([a, b]) = self.some_numbers(&given, "inertiagrouprange", "the compiler") {
            self.settings.groups = [a, b];
        }
        for (i, name) in ["boundmass", "boundinertia"].into_iter().enumerate() {
            if let Some([bound]) = self.some_numbers(&given, name, "the compiler") {
                self.settings.bounds[i] = bound;
            }
        }
        if let Some(balance) = self.flag(&given, "balanceinertia") {
            self.settings.balance = balance;
        }
        if let (Some([mass]), Some(attribute)) =
            (self.some_numbers(&given, "settotalmass", "the compiler"), element.attribute("settotalmass"))
        {
            self.settings.total_mass = (mass > 0.0).then(|| Noted::new(mass, self.place(attribute)));
        }
        if self.flag(&given, "alignfree") == Some(true) {
            let help = "remove it: coordinates are then those of the body frame as it is written";
            self.refuse_attribute(
                element,
                "alignfree",
                "the compiler",
                "the frame of a free body would be another one",
                help,
            );
        }
        if let Some(strips) = self.flag(&given, "strippath") {
            self.settings.strips_paths = strips;
        }
        let folder = element.attribute("meshdir").or(element.attribute("assetdir"));
        self.settings.mesh_folder = folder.map(|folder| folder.value.as_str()).or(self.settings.mesh_folder);
    }

    fn read_option(&mut self, element: &'s Element) {
        let given = Defaulted::alone(element);
        if let (Some(gravity), Some(attribute)) =
            (self.some_numbers(&given, "gravity", "the option"), element.attribute("gravity"))
        {
            self.robot.gravity = Some(Noted::new(gravity, self.place(attribute)));
        }
        for name in ["density", "viscosity"] {
            let help = "remove it, with `viscosity` and `density`: bodies move in a vacuum";
            self.refuse_number(&given, name, "the option", "drag and lift of a medium would act on bodies", help);
        }
        for flags in self.files.children(element).into_iter().filter(|e| e.name == "flag") {
            let flag = Defaulted::alone(flags);
            if let Some("disable") = self.word(&flag, "gravity", &["enable", "disable"]) {
                let place = self.tag(flags);
                self.robot.gravity = Some(Noted::new([0.0; 3], place));
            }
            for (name, what) in [
                ("equality", "couplings would not act"),
                ("frictionloss", "friction would not act"),
                ("constraint", "couplings and friction would not act"),
            ] {
                if let Some("disable") = self.word(&flag, name, &["enable", "disable"]) {
                    let help = "remove the flag, and what it switches off where that is not meant";
                    self.refuse_attribute(flags, name, "the option", what, help);
                }
            }
            for name in ["passive", "spring", "damper"] {
                if let Some("disable") = self.word(&flag, name, &["enable", "disable"]) {
                    let help = "remove the flag, and stiffness and damping where they are not meant";
                    self.refuse_attribute(flags, name, "the option", "springs and dampers would not act", help);
                }
            }
        }
    }
}
