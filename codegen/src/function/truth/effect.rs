//! What joints add to the rigid bodies, in the second author's terms.

use straightline_core::{Dd, Real};

/// What a joint of one coordinate adds to the rigid bodies, τ = … + I q̈ + d q̇ + f sgn(q̇) + k (q − q₀), and how far it and its drive may go.
#[derive(Clone, Copy, Debug)]
pub struct Effect {
    /// Index into q.
    pub iq: usize,
    /// Index into q̇.
    pub iv: usize,
    /// I \[kg·m² or kg\].
    pub inertia: Dd,
    /// d \[N·m·s/rad or N·s/m\].
    pub damping: Dd,
    /// f \[N·m or N\].
    pub friction: Dd,
    /// The speed w of f q̇ / √(q̇² + w²) in place of f sgn(q̇).
    pub smooth: Option<Dd>,
    /// k \[N·m/rad or N/m\].
    pub stiffness: Dd,
    /// q₀ \[rad or m\].
    pub rest: Dd,
    /// Its least and greatest coordinate \[rad or m\], where they are limited.
    pub range: [Option<Dd>; 2],
    /// The greatest force \[N·m or N\] of its drive, where that is limited.
    pub effort: Option<Dd>,
    /// How fast the joint moves per unit of its coordinate: 1 but of one that follows another.
    pub ratio: Dd,
}

impl Effect {
    /// The same of a joint at a q + b, on the coordinate q of the joint that it follows: forces do there what they do at the joint.
    #[must_use]
    pub fn on_source(self, [a, b]: [Dd; 2]) -> Effect {
        let square = a * a;
        Effect {
            inertia: square * self.inertia,
            damping: square * self.damping,
            friction: a.abs() * self.friction,
            stiffness: square * self.stiffness,
            rest: (self.rest - b) / a,
            range: [None; 2],
            effort: None,
            ratio: a.abs(),
            ..self
        }
    }

    /// What friction and spring take.
    pub(super) fn passive<T: Real>(&self, q: T, qd: T) -> T {
        let [damping, friction, stiffness, rest] =
            [self.damping, self.friction, self.stiffness, self.rest].map(T::constant);
        let dry = match self.smooth.map(T::constant) {
            Some(speed) => friction * (qd / (qd * qd + speed * speed).sqrt()),
            None => friction * qd.sign(),
        };
        damping * qd + dry + stiffness * (q - rest)
    }
}
