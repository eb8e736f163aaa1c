//! Joint states over time, as they were logged: nothing is sorted, left out or repaired.

use crate::failure::LogError;
use std::collections::HashMap;

/// What is logged of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LogQuantity {
    /// q \[rad or m\].
    Position = 0,
    /// q̇ \[rad/s or m/s\].
    Velocity = 1,
    /// τ \[N·m or N\].
    Effort = 2,
    /// q̈ \[rad/s² or m/s²\]; no message has it, tables may.
    Acceleration = 3,
}

impl LogQuantity {
    /// All of them, in the order of the columns.
    pub const ALL: [LogQuantity; 4] =
        [LogQuantity::Position, LogQuantity::Velocity, LogQuantity::Effort, LogQuantity::Acceleration];

    /// How it is called in complaints.
    pub fn name(self) -> &'static str {
        ["position", "velocity", "effort", "acceleration"][self as usize]
    }
}

/// A topic of a log, and how much of it there is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LogTopic {
    /// Its name.
    pub name: String,
    /// The type of its messages.
    pub kind: String,
    /// How many messages it has.
    pub messages: usize,
}

/// A log of joints.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct JointLog {
    /// Names of the joints, in the order in which they were first met.
    pub joints: Vec<String>,
    /// The first time stamp \[ns since the epoch, or since whatever the clock counts from\].
    pub start: i64,
    /// Time stamps since the first \[s\], in the order of the log.
    pub times: Vec<f64>,
    /// Per quantity and joint the numbers, one per time stamp, NaN where there is none; empty where there never is one.
    pub columns: [Vec<Vec<f64>>; 4],
    /// Messages whose joints stand in another order than those of the message before, or are others.
    pub reordered: usize,
    /// Messages without a time stamp of their own, which have the time at which they were logged.
    pub unstamped: usize,
    /// What else is in the log: topics that were not read, or columns.
    pub others: Vec<LogTopic>,
}

impl JointLog {
    /// The numbers of a joint; empty where there are none.
    pub fn column(&self, quantity: LogQuantity, joint: usize) -> &[f64] {
        self.columns[quantity as usize].get(joint).map_or(&[], |column| &column[..])
    }
}

/// Makes a log from what comes message by message.
#[derive(Debug, Default)]
pub struct LogRecorder {
    log: JointLog,
    places: HashMap<String, usize>,
    /// The names of the message before, and their joints.
    last: (Vec<String>, Vec<usize>),
    stored: usize,
}

/// Numbers that are filled in where messages have none, per number that they have, at most.
const MOST_FILLED: usize = 64;

impl LogRecorder {
    /// Takes a message: its stamp \[ns\], the names of joints, and per quantity as many numbers, or none.
    ///
    /// # Errors
    /// A quantity has another number of entries than there are names, a joint stands twice, or hardly any two messages have a joint in common.
    pub fn push(&mut self, stamp: i64, names: &[&str], values: [&[f64]; 4]) -> Result<(), String> {
        for (quantity, values) in LogQuantity::ALL.iter().zip(values) {
            if !values.is_empty() && values.len() != names.len() {
                let (name, n) = (quantity.name(), values.len());
                return Err(format!("{} names, and {n} numbers of {name}", names.len()));
            }
        }
        if self.log.times.is_empty() {
            self.log.start = stamp;
        }
        self.find(names)?;
        let row = self.log.times.len();
        // the difference first: seconds since an epoch have no digits left for nanoseconds
        self.log.times.push(stamp.saturating_sub(self.log.start) as f64 * 1e-9);
        for (columns, values) in self.log.columns.iter_mut().zip(values).filter(|(_, values)| !values.is_empty()) {
            columns.resize(self.log.joints.len().max(columns.len()), Vec::new());
            for (joint, x) in self.last.1.iter().zip(values) {
                let column = &mut columns[*joint];
                column.resize(row, f64::NAN);
                column.push(*x);
            }
            self.stored += values.len();
        }
        Ok(())
    }

    /// Puts the joints of these names into `last.1`.
    fn find(&mut self, names: &[&str]) -> Result<(), String> {
        if self.last.0.len() == names.len() && self.last.0.iter().zip(names).all(|(a, b)| a == b) {
            return Ok(());
        }
        if !self.log.times.is_empty() {
            self.log.reordered += 1;
        }
        let mut found = Vec::with_capacity(names.len());
        for name in names {
            let place = match self.places.get(*name) {
                Some(place) => *place,
                None => {
                    self.places.insert((*name).to_string(), self.log.joints.len());
                    self.log.joints.push((*name).to_string());
                    self.log.joints.len() - 1
                }
            };
            found.push(place);
        }
        let mut sorted = found.clone();
        sorted.sort_unstable();
        if let Some(pair) = sorted.windows(2).find(|pair| pair[0] == pair[1]) {
            return Err(format!("joint `{}` stands twice in a message", self.log.joints[pair[0]]));
        }
        if self.log.joints.len().saturating_mul(self.log.times.len()) > MOST_FILLED * self.stored + 1_000_000 {
            return Err(format!("{} joints, of which each message has hardly any", self.log.joints.len()));
        }
        self.last = (names.iter().map(ToString::to_string).collect(), found);
        Ok(())
    }

    /// Says of the message before that its stamp is the time at which it was logged.
    pub fn is_unstamped(&mut self) {
        self.log.unstamped += 1;
    }

    /// The log.
    pub fn finish(mut self, others: Vec<LogTopic>) -> JointLog {
        let (rows, joints) = (self.log.times.len(), self.log.joints.len());
        for columns in &mut self.log.columns {
            columns.resize(joints, Vec::new());
            columns.iter_mut().filter(|c| !c.is_empty()).for_each(|c| c.resize(rows, f64::NAN));
        }
        self.log.others = others;
        self.log.clear_blank_columns();
        self.log
    }
}

impl JointLog {
    /// Columns without a number become empty: messages write NaN where a joint has none of a quantity.
    fn clear_blank_columns(&mut self) {
        let columns = self.columns.iter_mut().flatten();
        columns.filter(|column| column.iter().all(|x| x.is_nan())).for_each(Vec::clear);
    }
}

/// How columns of tables begin, and what they are.
const PREFIXES: [(&str, LogQuantity); 5] = [
    ("q.", LogQuantity::Position),
    ("qd.", LogQuantity::Velocity),
    ("tau.", LogQuantity::Effort),
    ("effort.", LogQuantity::Effort),
    ("qdd.", LogQuantity::Acceleration),
];

/// A log of a table with the columns `t` \[s\], `q.JOINT`, `qd.JOINT`, `tau.JOINT` or `effort.JOINT`, and `qdd.JOINT`, each with its numbers;
/// other columns are named in [`JointLog::others`].
///
/// # Errors
/// There is no column `t`, none of a joint, or two of one quantity.
pub fn from_columns(columns: Vec<(String, Vec<f64>)>) -> Result<JointLog, LogError> {
    let names: Vec<String> = columns.iter().map(|(name, _)| name.clone()).collect();
    let wrong = |what: String, help: &str| Err(LogError::new("", what, help));
    let mut log = JointLog::default();
    let mut times = None;
    for (name, numbers) in columns {
        if name == "t" {
            times = Some(numbers);
            continue;
        }
        let Some((prefix, quantity)) = PREFIXES.iter().find(|(prefix, _)| name.starts_with(prefix)) else {
            log.others.push(LogTopic { name, kind: "column".to_string(), messages: numbers.len() });
            continue;
        };
        let joint = &name[prefix.len()..];
        let place = log.joints.iter().position(|known| known == joint).unwrap_or(log.joints.len());
        if place == log.joints.len() {
            log.joints.push(joint.to_string());
        }
        let columns = &mut log.columns[*quantity as usize];
        columns.resize(columns.len().max(place + 1), Vec::new());
        if !columns[place].is_empty() {
            let what = format!("two columns of the {} of joint `{joint}`", quantity.name());
            return wrong(what, "`tau.` and `effort.` are the same: leave one out");
        }
        columns[place] = numbers;
    }
    if names.iter().all(|name| name.is_empty()) {
        return wrong("the file is empty".to_string(), "log a motion");
    }
    let form = "columns are t [s], q.JOINT, qd.JOINT, tau.JOINT or effort.JOINT, and qdd.JOINT where it is known";
    let Some(times) = times else {
        return wrong(format!("no column `t`; there are {}", names.join(", ")), form);
    };
    if log.joints.is_empty() {
        return wrong(format!("no column of a joint; there are {}", names.join(", ")), form);
    }
    if times.is_empty() {
        return wrong("the log has no rows".to_string(), "log a motion");
    }
    let joints = log.joints.len();
    log.columns.iter_mut().for_each(|columns| columns.resize(joints, Vec::new()));
    log.times = times;
    log.clear_blank_columns();
    Ok(log)
}
