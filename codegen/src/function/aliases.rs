//! What functions are called elsewhere: for searches in documentation and on the command line.

use super::Function;

impl Function {
    /// What it is called elsewhere.
    pub fn aliases(self) -> &'static [&'static str] {
        self.spec().aliases
    }

    /// The attribute by which documentation of generated code is found under those names; empty without.
    pub(crate) fn alias_attribute(self) -> String {
        let quoted: Vec<String> = self.aliases().iter().map(|alias| format!("{alias:?}")).collect();
        match quoted.is_empty() {
            true => String::new(),
            false => format!("#[doc(alias({}))]\n", quoted.join(", ")),
        }
    }

    /// Whether its name, its summary or what it is called elsewhere has the word in it, in upper or lower case.
    pub fn is_about(self, word: &str) -> bool {
        let word = word.to_lowercase();
        let texts = [self.name(), self.summary()].into_iter().chain(self.aliases().iter().copied());
        texts.map(str::to_lowercase).any(|text| text.contains(&word) || text.replace('_', " ").contains(&word))
    }

    /// Whether this is what it is called elsewhere, in upper or lower case.
    pub fn is_called(self, alias: &str) -> bool {
        self.aliases().iter().any(|a| a.eq_ignore_ascii_case(alias))
    }

    /// The first of that other name, in upper or lower case.
    pub fn called(alias: &str) -> Option<Function> {
        Function::known().find(|f| f.is_called(alias))
    }
}

#[cfg(feature = "internals")]
#[doc(hidden)]
pub mod tests {
    use super::*;

    pub fn functions_are_found_by_what_they_are_called_elsewhere() {
        for (alias, name) in [
            ("RNEA", "inverse_dynamics"),
            ("crba", "mass_matrix"),
            ("ABA", "forward_dynamics"),
            ("com", "centre_of_mass"),
            ("Coriolis", "bias_force"),
        ] {
            assert_eq!(Function::called(alias).map(Function::name), Some(name));
        }
        let about: Vec<&str> = Function::known().filter(|f| f.is_about("coriolis")).map(Function::name).collect();
        assert_eq!(about, ["bias_force", "velocity_force", "coriolis_matrix", "coriolis_transpose_force"]);
    }
}
