//! What a page shows: configurations over time, and columns of numbers beside them.

use straightline_core::model::{Joint, Model};

/// Columns that a complaint names, at most.
const MOST_NAMED: usize = 12;

/// A motion, and what else is known along it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViewedRun {
    /// Time of each row \[s\]; none is before the one above it. Where something jumps there are two rows of one time.
    pub times: Vec<f64>,
    /// q of each row, `model.nq()` numbers.
    pub configurations: Vec<Vec<f64>>,
    /// What is plotted, each with as many numbers as there are rows: names as `simulate` and `analyze` write them, such as `q.elbow`, `tau.elbow` and
    /// `force.elbow.x`.
    pub columns: Vec<(String, Vec<f64>)>,
    /// What a reader of the page has to know of the run.
    pub notes: Vec<String>,
}

/// Why a run cannot be shown.
#[derive(Clone, Debug, PartialEq)]
pub struct ViewFailure {
    /// What is wrong, with names and values.
    pub what: String,
    /// What to do.
    pub help: String,
}

impl std::fmt::Display for ViewFailure {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{}; {}", self.what, self.help)
    }
}

impl std::error::Error for ViewFailure {}

/// Names of the columns of a joint's coordinates: `q.elbow`, or `q.base.x`, ….
pub(crate) fn coordinate_columns(joint: &Joint) -> Vec<String> {
    joint.entry_names(0).iter().map(|name| format!("q.{name}")).collect()
}

impl ViewedRun {
    /// A run from the columns of a file: `t`, and per joint `q.JOINT`, or `JOINT` alone; of joints with several coordinates one column per entry. A
    /// base of which there is nothing stands where it is by default, joints that loops determine are solved for. All columns are plotted.
    ///
    /// # Errors
    /// All columns that are missing, numbers that are not finite, times that go back.
    pub fn of_columns(model: &Model<f64>, columns: &[(String, Vec<f64>)]) -> Result<ViewedRun, Vec<ViewFailure>> {
        let find = |name: &str| columns.iter().find(|(n, _)| n == name).map(|(_, column)| column);
        let Some(times) = find("t").cloned() else { return Err(vec![missing(&["t".to_string()], columns)]) };
        let mut run = ViewedRun { configurations: vec![model.neutral(); times.len()], times, ..Default::default() };
        let (mut solved, mut all_lacking) = (false, Vec::new());
        for joint in model.joints() {
            let names = coordinate_columns(joint);
            let given: Vec<_> = names.iter().map(|name| find(name)).collect();
            let alone = find(&joint.name).filter(|_| joint.kind.is_single() && given[0].is_none());
            let given: Vec<_> = given.into_iter().map(|column| column.or(alone)).collect();
            if given.iter().all(Option::is_none) && joint.kind.is_base() {
                run.notes.push(format!("The run says nothing of the base {}: it is drawn standing still.", joint.name));
                continue;
            }
            if given.iter().all(Option::is_none) && joint.iv >= model.nv() {
                solved = true;
                continue;
            }
            let lacking: Vec<String> =
                names.iter().zip(&given).filter(|(_, column)| column.is_none()).map(|(name, _)| name.clone()).collect();
            if !lacking.is_empty() {
                all_lacking.extend(lacking);
                continue;
            }
            for (k, column) in given.into_iter().flatten().enumerate() {
                run.configurations.iter_mut().zip(column).for_each(|(q, x)| q[joint.iq + k] = *x);
            }
        }
        if !all_lacking.is_empty() {
            return Err(vec![missing(&all_lacking, columns)]);
        }
        run.columns = columns.iter().filter(|(name, _)| name != "t").cloned().collect();
        let failures = run.check(model);
        if !failures.is_empty() {
            return Err(failures);
        }
        run.normalise(model)?;
        if solved {
            run.close(model)?;
        }
        Ok(run)
    }

    /// Brings quaternions to length one.
    fn normalise(&mut self, model: &Model<f64>) -> Result<(), Vec<ViewFailure>> {
        for (t, q) in self.times.iter().zip(&mut self.configurations) {
            for joint in model.free_joints() {
                let own = &mut q[joint.iq..joint.iq + joint.kind.nq()];
                joint.kind.normalise(own);
                if own.iter().any(|x| !x.is_finite()) {
                    let what = format!("at t = {t:?} s the quaternion of {} has no length", joint.name);
                    return Err(vec![ViewFailure { what, help: "write unit quaternions x, y, z, w".to_string() }]);
                }
            }
        }
        Ok(())
    }

    /// Solves for what loops determine, each row from the one before it.
    fn close(&mut self, model: &Model<f64>) -> Result<(), Vec<ViewFailure>> {
        let mut before = model.neutral();
        for (t, q) in self.times.iter().zip(&mut self.configurations) {
            let Some(closed) = model.closed_from(std::mem::take(q), &before) else {
                let what = format!("at t = {t:?} s the loops of {} cannot be closed", model.name);
                let help = "let the run have a column for every joint of the loops".to_string();
                return Err(vec![ViewFailure { what, help }]);
            };
            before.clone_from(&closed);
            *q = closed;
        }
        self.notes.push("What loops determine is not in the run: it was solved for.".to_string());
        Ok(())
    }

    /// What is wrong with it.
    pub(crate) fn check(&self, model: &Model<f64>) -> Vec<ViewFailure> {
        let mut failures = Vec::new();
        let mut wrong = |what: String, help: &str| failures.push(ViewFailure { what, help: help.to_string() });
        let rows = self.times.len();
        if rows == 0 {
            wrong("the run has no row".to_string(), "give it one at least");
        }
        if let Some(pair) = self.times.windows(2).find(|pair| pair[1] < pair[0]) {
            wrong(format!("time goes from {:?} s to {:?} s", pair[0], pair[1]), "sort the rows by `t`");
        }
        if let Some(t) = self.times.iter().find(|t| !t.is_finite()) {
            wrong(format!("a time is {t}, not a finite number"), "leave its row out");
        }
        if self.configurations.len() != rows || self.configurations.iter().any(|q| q.len() != model.nq()) {
            let what = format!("{} times do not have {} coordinates each", rows, model.nq());
            wrong(what, "give every row all coordinates of q");
        }
        for (name, column) in &self.columns {
            if column.len() != rows {
                wrong(format!("column `{name}` has {} numbers, `t` has {rows}", column.len()), "make them as many");
            }
            if let Some(k) = column.iter().position(|x| !x.is_finite()) {
                let time = self.times.get(k).copied().unwrap_or(f64::NAN);
                wrong(
                    format!("at t = {time:?} s `{name}` is {}, not a finite number", column[k]),
                    "leave the row or the column out",
                );
            }
        }
        if self.configurations.iter().flatten().any(|x| !x.is_finite()) {
            wrong("a coordinate is not a finite number".to_string(), "leave its row out");
        }
        failures
    }
}

fn missing(names: &[String], columns: &[(String, Vec<f64>)]) -> ViewFailure {
    let list = |names: &mut dyn ExactSizeIterator<Item = &String>| {
        let count = names.len();
        let named = names.take(MOST_NAMED).map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", ");
        match count.saturating_sub(MOST_NAMED) {
            0 => named,
            others => format!("{named} and {others} others"),
        }
    };
    let what = format!("there is no column {}", list(&mut names.iter()));
    let help = format!("the columns are {}", list(&mut columns.iter().map(|(name, _)| name)));
    ViewFailure { what, help }
}
