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
    /// Inertias of meshes are exact where they do not say themselves: what files said before meshes did.
    pub exact_meshes: bool,
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
            exact_meshes: false,
            mesh_folder: None,
            strips_paths: false,
        }
    }
}

impl<'s> Mjcf<'s> {
    /// Reads these sections.
    pub fn read_settings(&mut self) {
        let files = self.files;
        for scope in 0..files.scopes.len() {
            self.settings.push(CompilerSettings::default());
            files.sections(scope, "compiler").into_iter().for_each(|element| self.read_compiler(element));
        }
        files.sections(0, "option").into_iter().for_each(|element| self.read_option(element));
        for scope in 1..files.scopes.len() {
            files.sections(scope, "option").into_iter().for_each(|element| self.read_option_of_attached(element));
        }
    }

    /// What bodies move in is what the file says that attaches them.
    fn read_option_of_attached(&mut self, element: &'s Element) {
        let gravity = self.robot.gravity.as_ref().map_or([0.0, 0.0, -9.81], |gravity| gravity.value);
        let own = self.some_numbers::<3>(&Defaulted::alone(element), "gravity", "the option");
        if own.is_some_and(|own| own != gravity) {
            let (why, help) =
                ("the gravity of the file that attaches the model acts", "write the same gravity in both");
            self.refuse_attribute(element, "gravity", "the option of an attached model", why, help);
        }
        self.ignore_as("option of an attached model", element);
    }

    fn read_compiler(&mut self, element: &'s Element) {
        self.check_attributes(element, "the compiler", vocabulary::COMPILER);
        let given = Defaulted::alone(element);
        if let Some(word) = self.word(&given, "angle", &["degree", "radian"]) {
            self.settings[element.scope].angle = if word == "degree" { AngleUnit::Degree } else { AngleUnit::Radian };
        }
        if let Some("global") = self.word(&given, "coordinate", &["local", "global"]) {
            let help = "save the model with local coordinates first";
            self.refuse_attribute(element, "coordinate", "the compiler", "poses would be those in the world", help);
        }
        if let Some(attribute) = element.attribute("eulerseq") {
            let axes: Vec<char> = attribute.value.trim().chars().collect();
            match axes[..] {
                [a, b, c] if axes.iter().all(|axis| "xyzXYZ".contains(*axis)) => {
                    self.settings[element.scope].euler = [a, b, c]
                }
                _ => self
                    .complain(attribute, messages::unknown_word("eulerseq", &attribute.value, &["xyz", "XYZ", "zyx"])),
            }
        }
        if let Some(autolimits) = self.flag(&given, "autolimits") {
            self.settings[element.scope].autolimits = autolimits;
        }
        if let Some(word) = self.word(&given, "inertiafromgeom", &["false", "true", "auto"]) {
            self.settings[element.scope].inertia_from_geoms = if word == "auto" { None } else { Some(word == "true") };
        }
        if let Some([a, b]) = self.some_numbers(&given, "inertiagrouprange", "the compiler") {
            self.settings[element.scope].groups = [a, b];
        }
        for (i, name) in ["boundmass", "boundinertia"].into_iter().enumerate() {
            if let Some([bound]) = self.some_numbers(&given, name, "the compiler") {
                self.settings[element.scope].bounds[i] = bound;
            }
        }
        if let Some(exact) = self.flag(&given, "exactmeshinertia") {
            self.settings[element.scope].exact_meshes = exact;
        }
        if let Some(balance) = self.flag(&given, "balanceinertia") {
            self.settings[element.scope].balance = balance;
        }
        if let (Some([mass]), Some(attribute)) =
            (self.some_numbers(&given, "settotalmass", "the compiler"), element.attribute("settotalmass"))
        {
            self.settings[element.scope].total_mass = (mass > 0.0).then(|| Noted::new(mass, self.place(attribute)));
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
            self.settings[element.scope].strips_paths = strips;
        }
        let folder = element.attribute("meshdir").or(element.attribute("assetdir"));
        self.settings[element.scope].mesh_folder =
            folder.map(|folder| folder.value.as_str()).or(self.settings[element.scope].mesh_folder);
    }

    fn read_option(&mut self, element: &'s Element) {
        self.check_attributes(element, "the option", vocabulary::OPTION);
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
            let couplings =
                self.files.elements.iter().any(|e| e.name == "equality" && !self.files.children(e).is_empty());
            let (friction, stiffness, damping) =
                (self.is_said("frictionloss"), self.is_said("stiffness"), self.is_said("damping"));
            for (name, what, would) in [
                ("equality", "couplings would not act", couplings),
                ("frictionloss", "friction would not act", friction),
                ("constraint", "couplings and friction would not act", couplings || friction),
                ("passive", "springs and dampers would not act", stiffness || damping),
                ("spring", "springs would not act", stiffness),
                ("damper", "dampers would not act", damping),
            ] {
                if self.word(&flag, name, &["enable", "disable"]) == Some("disable") && would {
                    let help = "remove the flag, and what it switches off where that is not meant";
                    self.refuse_attribute(flags, name, "the option", what, help);
                }
            }
        }
    }

    /// Whether an element has something else than zeros of a name.
    fn is_said(&self, name: &str) -> bool {
        let numbers = |value: &str| value.split_whitespace().any(|x| x.parse() != Ok(0.0));
        let mut elements = self.files.elements.iter().filter(|e| e.name != "flag");
        elements.any(|e| e.attribute(name).is_some_and(|attribute| numbers(&attribute.value)))
    }
}
