//! Links that bend, and bases that give way: `flexible` of a link, `[[flexible]]` and `[support]` of a scene; the schema is in
//! `SCHEMA.md` and `SCENES.md`.

use super::reader::{FileReader, Range64};
use super::table::TomlTable;
use super::{messages, Noted};
use toml::de::DeValue;

const FLEXIBLE: &[&str] = &["from", "to", "segments", "bending", "torsion", "damping"];
const EXAMPLE: &str = "flexible = { to = [0.0, 0.0, 0.8], bending = 120.0 }";
/// Segments of a link that does not say how many: its deflection is 1 % less than that of the beam.
const SEGMENTS: usize = 5;

/// A link that bends, as written: a beam along a straight axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Flexible {
    /// The link.
    pub link: Noted<String>,
    /// Where its axis begins, at the joint that carries the link, in the link frame \[m\].
    pub from: [f64; 3],
    /// Where its axis ends \[m\].
    pub to: Noted<[f64; 3]>,
    /// Elastic segments that it is cut into.
    pub segments: Noted<usize>,
    /// Bending stiffness.
    pub bending: Bending,
    /// Torsional stiffness G J \[N·m²\]; `None`: it does not twist.
    pub torsion: Option<Noted<f64>>,
    /// Damping over stiffness of the material (Kelvin and Voigt) \[s\].
    pub damping: Noted<f64>,
}

/// The bending stiffness E I of a beam \[N·m²\].
#[derive(Clone, Debug, PartialEq)]
pub enum Bending {
    /// It does not bend.
    None,
    /// The same about all axes across.
    Round(Noted<f64>),
    /// About the axes x, y and z of the link frame, of which two may be across; about the others it does not bend.
    About([Option<Noted<f64>>; 3]),
}

/// What a base stands on, as written: springs and dampers between the world and the root link.
#[derive(Clone, Debug, PartialEq)]
pub struct BaseSupport {
    /// The point about which the base turns, in the world \[m\].
    pub at: [f64; 3],
    /// Along x, y, z \[N/m\] and about x, y, z \[N·m/rad\], parallel with the world's axes; `None`: the base does not move so.
    pub directions: [Option<WrittenSpring>; 6],
    /// Where it stands.
    pub place: Noted<()>,
}

/// A spring and a damper.
#[derive(Clone, Debug, PartialEq)]
pub struct WrittenSpring {
    /// \[N/m or N·m/rad\]
    pub stiffness: Noted<f64>,
    /// \[N·s/m or N·m·s/rad\]
    pub damping: Noted<f64>,
    /// Where the spring is slack \[m or rad\].
    pub rest: f64,
}

impl BaseSupport {
    /// The names of the directions, which follow `support_` in the names of the joints.
    pub const DIRECTIONS: [&'static str; 6] = ["x", "y", "z", "rx", "ry", "rz"];
}

impl FileReader<'_> {
    /// The key `flexible` of the table of a link.
    pub fn flexible_at(&mut self, table: &TomlTable, link: Option<&Noted<String>>) -> Option<Flexible> {
        let (_, span) = table.get("flexible")?;
        let flexible = self.table_at(table, "flexible", &format!("flexible of {}", table.owner))?;
        self.check_keys(&flexible, FLEXIBLE);
        let link = self.value(link?.value.clone(), &span);
        self.flexible(&flexible, link)
    }

    /// The tables `[[flexible]]` of a scene.
    pub fn flexible_links_at(&mut self, top: &TomlTable) -> Vec<Flexible> {
        let tables = self.tables_at(top, "flexible");
        let read = |mut table: TomlTable| {
            self.require(&table, "link", "link = \"...\"");
            let link = self.name_at(&table, "link", "link")?;
            table.owner = format!("flexible link `{}`", link.value);
            self.check_keys(&table, &[&["link"], FLEXIBLE].concat());
            self.flexible(&table, link)
        };
        tables.into_iter().filter_map(read).collect()
    }

    fn flexible(&mut self, table: &TomlTable, link: Noted<String>) -> Option<Flexible> {
        self.require(table, "to", EXAMPLE);
        let from = match table.has("from") {
            true => self.vector_at(table, "from").map(|from| from.value),
            false => Some([0.0; 3]),
        };
        let to = self.vector_at(table, "to");
        let segments = match table.has("segments") {
            true => self.count_at(table, "segments"),
            false => Some(Noted::assumed(SEGMENTS)),
        };
        let bending = self.bending(table);
        let torsion = match table.has("torsion") {
            true => self.real_at(table, "torsion", Range64::Finite).map(Some),
            false => Some(None),
        };
        let damping = self.real_at(table, "damping", Range64::Finite).unwrap_or_else(|| Noted::assumed(0.0));
        Some(Flexible {
            link,
            from: from?,
            to: to?,
            segments: segments?,
            bending: bending?,
            torsion: torsion?,
            damping,
        })
    }

    /// One number, or numbers about axes; `None` after a complaint.
    fn bending(&mut self, table: &TomlTable) -> Option<Bending> {
        let Some((value, span)) = table.get("bending") else { return Some(Bending::None) };
        match value {
            DeValue::Integer(_) | DeValue::Float(_) => {
                self.real_at(table, "bending", Range64::Finite).map(Bending::Round)
            }
            DeValue::Table(inner) => {
                let axes = TomlTable { owner: table.what("bending"), table: inner, span };
                self.check_keys(&axes, &["x", "y", "z"]);
                Some(Bending::About(["x", "y", "z"].map(|axis| self.real_at(&axes, axis, Range64::Finite))))
            }
            _ => {
                self.wrong_type(&table.what("bending"), "a number, or `{ x = 120.0, y = 80.0 }`", value, &span);
                None
            }
        }
    }

    /// The table `[support]` of a scene.
    pub fn support_at(&mut self, top: &TomlTable) -> Option<BaseSupport> {
        let table = self.table_at(top, "support", "[support]")?;
        self.check_keys(&table, &[&["at"], &BaseSupport::DIRECTIONS[..]].concat());
        let at = self.vector_at(&table, "at").map_or([0.0; 3], |at| at.value);
        let directions = BaseSupport::DIRECTIONS.map(|direction| {
            let spring = self.table_at(&table, direction, &format!("`{direction}` of [support]"))?;
            self.check_keys(&spring, &["stiffness", "damping", "rest"]);
            self.require(&spring, "stiffness", "{ stiffness = 1e5, damping = 200.0 }");
            let stiffness = self.real_at(&spring, "stiffness", Range64::Finite)?;
            let damping = self.real_at(&spring, "damping", Range64::Finite).unwrap_or_else(|| Noted::assumed(0.0));
            let rest = self.real_at(&spring, "rest", Range64::Finite).map_or(0.0, |rest| rest.value);
            Some(WrittenSpring { stiffness, damping, rest })
        });
        // a spring that could not be read was complained of, and the base is not rigid for that
        let is_read =
            directions.iter().zip(BaseSupport::DIRECTIONS).all(|(spring, key)| spring.is_some() || !table.has(key));
        let place = Noted { value: (), place: self.place(&table.span) };
        is_read.then_some(BaseSupport { at, directions, place })
    }
}

/// What must hold of the numbers of a flexible link or a support, whoever gave them. Complaints go to `complain`, each with its
/// place.
pub(crate) fn judge_number(
    what: String,
    x: &Noted<f64>,
    may_be_zero: bool,
    complain: &mut dyn FnMut(crate::diagnostic::Diagnostic),
) -> bool {
    let holds = x.value.is_finite() && (x.value > 0.0 || may_be_zero && x.value == 0.0);
    if !holds {
        let (be, help) = match may_be_zero {
            true => ("zero or positive", "write its modulus"),
            false => ("positive", "leave the key out where nothing gives way"),
        };
        complain(messages::elastic_number(&what, &format!("{:?}", x.value), be, help).at(&x.place));
    }
    holds
}
