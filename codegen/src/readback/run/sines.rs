//! Sines and cosines, many at a time, and their kernels.

use super::{Execution, Ran};
use crate::readback::tokens::{self as t, TokenKind};
use crate::readback::values::{TextFormat, TextValue};
use straightline_graph::expr::Sines;

impl<'t> Execution<'_, 't> {
    /// `(s, c) = trig::sin_cos_f64(q[2]);` and its like for several angles, behind `let`.
    pub(super) fn sines(&mut self, format: TextFormat) -> Ran<()> {
        self.mark(b'(')?;
        let several = self.kind() == TokenKind::Mark(b'[');
        let mut halves = [Vec::new(), Vec::new()];
        for (k, half) in halves.iter_mut().enumerate() {
            if several {
                self.mark(b'[')?;
                self.pattern()?;
                half.clone_from(&self.names);
            } else {
                half.push(self.word()?);
            }
            self.mark(if k == 0 { b',' } else { b')' })?;
        }
        self.mark(b'=')?;
        let start = self.at;
        let sines = match self.kind() {
            TokenKind::Word(t::SHORT_SINES) => Sines::Short,
            _ => Sines::Precise,
        };
        let function = self.kernel(format)?;
        let (lanes, sums) = match function {
            "sin_cos" => (false, false),
            "sin_cos_of_sum" | "sin_cos_of_pair" => (false, true),
            "sin_cos_lanes" => (true, false),
            "sin_cos_lanes_of_sums" | "sin_cos_lanes_of_pairs" => (true, true),
            _ => return self.items.stop(start, "sine and cosine are expected here"),
        };
        if lanes != several {
            return self.items.stop(start, "sine and cosine of another number of angles");
        }
        self.mark(b'(')?;
        let angles = match lanes {
            true => {
                self.mark(b'[')?;
                self.listed(b']', |run| run.angle(sums, format))?
            }
            false => vec![self.angle(sums, format)?],
        };
        self.these(") ;")?;
        let (sines, cosines): (Vec<TextValue>, Vec<TextValue>) =
            angles.iter().map(|a| self.values.sin_cos(*a, sines)).unzip();
        if halves[0].iter().any(|name| *name != t::UNDERSCORE && halves[1].contains(name)) {
            return self.items.stop(start, "a second local of that name");
        }
        for (names, values) in halves.iter().zip([sines, cosines]) {
            self.bind_all(names, &values)?;
        }
        Ok(())
    }

    /// The first number of [`Execution::given`].
    pub(super) fn first_given(&self) -> Option<TextValue> {
        self.cells.get(self.arrays[self.given? as usize].first as usize).copied()
    }

    pub(super) fn zero(&mut self, format: TextFormat) -> TextValue {
        match format {
            TextFormat::Any => self.values.long(0.0, 0.0),
            format => self.values.constant(0.0, format),
        }
    }

    /// An angle, alone or as a sum with what its rounding lost.
    pub(super) fn angle(&mut self, sums: bool, format: TextFormat) -> Ran<TextValue> {
        if !sums {
            let value = self.number(format, format)?;
            return Ok(self.values.angle([value]));
        }
        let start = self.at;
        if self.kind() == TokenKind::Mark(b'[') {
            let pair = self.list(format, format)?;
            let zero = self.zero(format);
            return match pair.as_slice() {
                [angle, tail] if *tail == zero => Ok(self.values.angle([*angle])),
                _ => self.items.stop(start, "an angle and nothing that it lost are expected here"),
            };
        }
        if self.kernel(format)? != "sum_of_angles" {
            return self.items.stop(start, "a sum of angles is expected here");
        }
        self.mark(b'(')?;
        if format == TextFormat::Any {
            self.mark(b'&')?;
        }
        let terms = self.list(format, format)?;
        self.mark(b')')?;
        if terms.is_empty() {
            return self.items.stop(start, "a sum of nothing");
        }
        Ok(self.values.angle(terms))
    }

    /// Takes the path of a function of the kernel in this format: its name without the format.
    pub(super) fn kernel(&mut self, format: TextFormat) -> Ran<&'t str> {
        let start = self.at;
        let module = self.word()?;
        self.these(": :")?;
        let at = self.at;
        self.word()?;
        let name = self.items.text_of(at);
        let suffix = match format {
            TextFormat::F64 => "_f64",
            TextFormat::F32 => "_f32",
            TextFormat::Any => "",
        };
        let known = match module {
            _ if self.local(module).is_some() => false,
            t::TRIG => self.known.trig && format != TextFormat::Any,
            t::SHORT_SINES => self.known.short_sines && format != TextFormat::Any,
            t::FUSED_MODULE => self.known.fused[0] && format != TextFormat::Any,
            t::T => self.known.generic && format == TextFormat::Any,
            _ => false,
        };
        let Some(function) = name.strip_suffix(suffix).filter(|_| known) else {
            return self.items.stop(start, "a function that is not known");
        };
        if module != t::FUSED_MODULE {
            return Ok(function);
        }
        match function {
            // `sin_cos_if_f64::<FUSED>` is told whether to fuse
            "sin_cos_if" => self.told_whether_to_fuse().map(|()| "sin_cos"),
            "sin_cos_of_sum_if" => self.told_whether_to_fuse().map(|()| "sin_cos_of_sum"),
            "sin_cos" | "sin_cos_of_sum" | "sin_cos_lanes" | "sin_cos_lanes_of_sums" => Ok(function),
            _ => self.items.stop(start, "a function that is not known"),
        }
    }

    /// `::<FUSED>`
    pub(super) fn told_whether_to_fuse(&mut self) -> Ran<()> {
        self.these(": : < FUSED >")
    }
}
