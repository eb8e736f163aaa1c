//! CDR, the encoding of ROS 2 messages: numbers at multiples of their size, strings and sequences behind their length, in either order of bytes.
//!
//! Four bytes of encapsulation stand in front, from which alignment counts. Plain CDR (0, 1) and plain CDR of version 2 (6, 7), which aligns numbers
//! of eight bytes at four, are known.

/// Reads one message from the front; every length is held against what is left before anything is stored.
#[derive(Clone, Debug)]
pub struct CdrReader<'a> {
    body: &'a [u8],
    at: usize,
    is_big: bool,
    widest: usize,
}

impl<'a> CdrReader<'a> {
    /// Of a message with its encapsulation.
    ///
    /// # Errors
    /// There is none, or one that is not known.
    pub fn new(bytes: &'a [u8]) -> Result<CdrReader<'a>, String> {
        let Some((head, body)) = bytes.split_at_checked(4) else {
            return Err(format!("{} bytes, less than the encapsulation of CDR", bytes.len()));
        };
        let (is_big, widest) = match [head[0], head[1]] {
            [0, 0] => (true, 8),
            [0, 1] => (false, 8),
            [0, 6] => (true, 4),
            [0, 7] => (false, 4),
            [a, b] => return Err(format!("encapsulation {a:#04x} {b:#04x} is no plain CDR")),
        };
        Ok(CdrReader { body, at: 0, is_big, widest })
    }

    /// How many bytes were read, the encapsulation with them.
    pub fn offset(&self) -> usize {
        self.at + 4
    }

    fn take(&mut self, align: usize, count: usize) -> Result<&'a [u8], String> {
        let start = self.at.next_multiple_of(align.min(self.widest));
        let end = start.checked_add(count).filter(|end| *end <= self.body.len());
        let Some(end) = end else {
            let left = self.body.len().saturating_sub(start);
            return Err(format!("{count} bytes are wanted at byte {} of the message, {left} are left", start + 4));
        };
        self.at = end;
        Ok(&self.body[start..end])
    }

    /// An integer of 32 bits without sign.
    ///
    /// # Errors
    /// The message ends.
    pub fn u32(&mut self) -> Result<u32, String> {
        let bytes: [u8; 4] = self.take(4, 4)?.try_into().expect("as many as asked for");
        Ok(if self.is_big { u32::from_be_bytes(bytes) } else { u32::from_le_bytes(bytes) })
    }

    /// An integer of 32 bits.
    ///
    /// # Errors
    /// The message ends.
    pub fn i32(&mut self) -> Result<i32, String> {
        self.u32().map(u32::cast_signed)
    }

    /// A string.
    ///
    /// # Errors
    /// The message ends, the string has no zero at its end, or is no UTF-8.
    pub fn string(&mut self) -> Result<&'a str, String> {
        let length = self.u32()? as usize;
        // some writers give an empty string the length 0, without its zero
        let Some(count) = length.checked_sub(1) else { return Ok("") };
        let bytes = self.take(1, length)?;
        if bytes[count] != 0 {
            return Err(format!("the string before byte {} of the message does not end with 0", self.offset()));
        }
        std::str::from_utf8(&bytes[..count]).map_err(|error| format!("a string is no UTF-8: {error}"))
    }

    /// A sequence of strings into `to`.
    ///
    /// # Errors
    /// As [`string`](Self::string); or the sequence is longer than what is left.
    pub fn strings(&mut self, to: &mut Vec<&'a str>) -> Result<(), String> {
        to.clear();
        let count = self.u32()? as usize;
        let left = self.body.len() - self.at;
        if count > left / 4 {
            return Err(format!("a sequence of {count} strings, and {left} bytes are left"));
        }
        for _ in 0..count {
            to.push(self.string()?);
        }
        Ok(())
    }

    /// A double.
    ///
    /// # Errors
    /// The message ends.
    pub fn double(&mut self) -> Result<f64, String> {
        let bytes: [u8; 8] = self.take(8, 8)?.try_into().expect("as many as asked for");
        Ok(if self.is_big { f64::from_be_bytes(bytes) } else { f64::from_le_bytes(bytes) })
    }

    /// A sequence of doubles into `to`.
    ///
    /// # Errors
    /// The sequence is longer than what is left.
    pub fn doubles(&mut self, to: &mut Vec<f64>) -> Result<(), String> {
        to.clear();
        let count = self.u32()? as usize;
        if count == 0 {
            return Ok(());
        }
        let bytes = self.take(8, count.checked_mul(8).ok_or("a sequence longer than memory")?)?;
        let is_big = self.is_big;
        to.extend(bytes.chunks_exact(8).map(|b| {
            let b: [u8; 8] = b.try_into().expect("eight");
            if is_big {
                f64::from_be_bytes(b)
            } else {
                f64::from_le_bytes(b)
            }
        }));
        Ok(())
    }
}

/// Writes one message, little end first.
#[derive(Clone, Debug)]
pub struct CdrWriter {
    bytes: Vec<u8>,
}

impl Default for CdrWriter {
    fn default() -> Self {
        CdrWriter { bytes: vec![0, 1, 0, 0] }
    }
}

impl CdrWriter {
    fn align(&mut self, to: usize) {
        let length = (self.bytes.len() - 4).next_multiple_of(to) + 4;
        self.bytes.resize(length, 0);
    }

    /// An integer of 32 bits without sign.
    pub fn u32(&mut self, x: u32) {
        self.align(4);
        self.bytes.extend(x.to_le_bytes());
    }

    /// An integer of 32 bits.
    pub fn i32(&mut self, x: i32) {
        self.u32(x.cast_unsigned());
    }

    /// A string, with a zero at its end.
    pub fn string(&mut self, text: &str) {
        self.u32(text.len() as u32 + 1);
        self.bytes.extend(text.as_bytes());
        self.bytes.push(0);
    }

    /// A double.
    pub fn double(&mut self, x: f64) {
        self.align(8);
        self.bytes.extend(x.to_le_bytes());
    }

    /// A sequence of doubles.
    pub fn doubles(&mut self, numbers: impl ExactSizeIterator<Item = f64>) {
        self.u32(numbers.len() as u32);
        if numbers.len() > 0 {
            self.align(8);
        }
        numbers.for_each(|x| self.bytes.extend(x.to_le_bytes()));
    }

    /// The message with its encapsulation.
    pub fn finish(self) -> Vec<u8> {
        self.bytes
    }
}
