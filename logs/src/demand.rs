//! What is asked of a log: which columns are coordinates, which are rates and forces, and which it may lack.

/// A coordinate.
#[derive(Clone, Debug, PartialEq)]
pub struct PositionDemand {
    /// How it is called in logs: by the name of its joint, or `base.x`.
    pub name: String,
    /// Where it is if the log does not say; `None` where the log has to.
    pub else_at: Option<f64>,
}

/// A velocity, its acceleration and its force.
#[derive(Clone, Debug, PartialEq)]
pub struct RateDemand {
    /// How velocity and acceleration are called in logs.
    pub velocity: String,
    /// How the force is called.
    pub effort: String,
    /// Whether the log has to have the force.
    pub needs_effort: bool,
    /// The coordinate whose derivative it is, if it is that of one.
    pub position: Option<usize>,
}

/// What is asked of a log.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LogDemand {
    /// Coordinates, in their order.
    pub positions: Vec<PositionDemand>,
    /// Rates, in their order.
    pub rates: Vec<RateDemand>,
    /// Joints that others determine.
    pub determined: Vec<String>,
}

impl LogDemand {
    /// Joints of one coordinate each.
    pub fn of_joints(names: &[&str]) -> LogDemand {
        let mut demand = LogDemand::default();
        names.iter().for_each(|name| demand.push_joint(name));
        demand
    }

    /// A joint of one coordinate more.
    pub fn push_joint(&mut self, name: &str) {
        let position = Some(self.positions.len());
        self.positions.push(PositionDemand { name: name.to_string(), else_at: None });
        let (velocity, effort) = (name.to_string(), name.to_string());
        self.rates.push(RateDemand { velocity, effort, needs_effort: true, position });
    }

    /// Whether a name of the log is asked for.
    pub fn has(&self, name: &str) -> bool {
        self.positions.iter().any(|of_q| of_q.name == name)
            || self.rates.iter().any(|rate| rate.velocity == name || rate.effort == name)
    }
}
