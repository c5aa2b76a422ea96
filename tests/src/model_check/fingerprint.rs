//! What makes two states the same: everything their machines print, but for counters and the absolute time.

use std::fmt::{Debug, Write};
use std::hash::{DefaultHasher, Hasher};

/// What of a machine does not count when states are compared.
#[derive(Debug, Clone, Copy)]
pub struct Canon {
    /// Fields that only count or measure, by type and name; nothing the machine does later depends on them.
    pub ignored: &'static [(&'static str, &'static str)],
    /// Moments that are only ever compared with now: those that have come are alike.
    pub deadlines: &'static [(&'static str, &'static str)],
    /// The moment all others are counted from, nanoseconds.
    pub now_ns: u64,
    /// What lies further back than this is "long ago": no rule of the machine looks back that far. Nanoseconds.
    pub horizon_ns: u64,
}

/// The fingerprint of a machine: 128 bits of its derived `Debug` text.
///
/// A derived text has every field, private ones too, so that two machines with the same text behave alike; what [`Canon`] takes out
/// must not matter. `Instant(n)` becomes the distance from now. Two different texts share a fingerprint with a probability of
/// n²/2¹²⁸ for n states.
pub fn fingerprint(machine: &impl Debug, canon: Canon, text: &mut String) -> u128 {
    text.clear();
    // Writing to a string does not fail.
    let _ = write!(text, "{machine:?}");
    let mut hash = Twice::new();
    Scan {
        text: text.as_bytes(),
        at: 0,
        types: Vec::new(),
        deadline: false,
        canon,
    }
    .run(&mut |octets| hash.write(octets));
    hash.finish()
}

/// Two hashes with different beginnings: 64 bits would be few for millions of states.
struct Twice(DefaultHasher, DefaultHasher);

impl Twice {
    fn new() -> Self {
        let mut second = DefaultHasher::new();
        second.write_u8(1);
        Self(DefaultHasher::new(), second)
    }

    fn write(&mut self, octets: &[u8]) {
        self.0.write(octets);
        self.1.write(octets);
    }

    fn finish(&self) -> u128 {
        u128::from(self.0.finish()) << 64 | u128::from(self.1.finish())
    }
}

struct Scan<'a> {
    text: &'a [u8],
    at: usize,
    /// The types whose fields are being read, the innermost last.
    types: Vec<&'a [u8]>,
    /// The next moment is a deadline.
    deadline: bool,
    canon: Canon,
}

impl Scan<'_> {
    fn run(&mut self, sink: &mut impl FnMut(&[u8])) {
        let (mut kept, mut named): (usize, &[u8]) = (0, &[]);
        while self.at < self.text.len() {
            let octet = self.text[self.at];
            if !is_word(octet) {
                match octet {
                    // A set prints as a type without a name.
                    b'{' => self.types.push(std::mem::take(&mut named)),
                    b'}' => drop(self.types.pop()),
                    _ => {}
                }
                self.at += 1;
                continue;
            }
            let begin = self.at;
            while self.at < self.text.len() && is_word(self.text[self.at]) {
                self.at += 1;
            }
            let word = &self.text[begin..self.at];
            let rest = &self.text[self.at..];
            if rest.starts_with(b" {") {
                named = word;
            } else if rest.starts_with(b": ") && self.is_among(self.canon.deadlines, word) {
                self.deadline = true;
            } else if rest.starts_with(b": ") && self.is_among(self.canon.ignored, word) {
                sink(&self.text[kept..begin]);
                self.skip_value();
                kept = self.at;
            } else if word == b"Instant" && rest.starts_with(b"(") {
                sink(&self.text[kept..begin]);
                self.at += 1;
                let mut number = self.number();
                if std::mem::take(&mut self.deadline) {
                    number = number.max(self.canon.now_ns);
                }
                sink(self.relative(number).to_string().as_bytes());
                kept = self.at;
            }
        }
        sink(&self.text[kept..]);
    }

    fn is_among(&self, fields: &[(&str, &str)], field: &[u8]) -> bool {
        self.types.last().is_some_and(|of| {
            let mut fields = fields.iter();
            fields.any(|(name, listed)| name.as_bytes() == *of && listed.as_bytes() == field)
        })
    }

    /// Over a value, up to the comma or bracket behind it.
    fn skip_value(&mut self) {
        let mut depth = 0_i32;
        while self.at < self.text.len() {
            match self.text[self.at] {
                b'(' | b'[' | b'{' => depth += 1,
                b')' | b']' | b'}' if depth == 0 => return,
                b')' | b']' | b'}' => depth -= 1,
                b',' if depth == 0 => return,
                _ => {}
            }
            self.at += 1;
        }
    }

    fn number(&mut self) -> u64 {
        let mut number = 0_u64;
        while let Some(digit) = self.text.get(self.at).filter(|octet| octet.is_ascii_digit()) {
            number = number.wrapping_mul(10).wrapping_add(u64::from(digit - b'0'));
            self.at += 1;
        }
        number
    }

    /// Nanoseconds from now; the ends stand for "never" and "long ago".
    fn relative(&self, moment: u64) -> i64 {
        if moment == u64::MAX {
            return i64::MAX;
        }
        match self.canon.now_ns.checked_sub(moment) {
            Some(past) if past > self.canon.horizon_ns => i64::MIN,
            Some(past) => -(past as i64),
            None => (moment - self.canon.now_ns) as i64,
        }
    }
}

fn is_word(octet: u8) -> bool {
    octet.is_ascii_alphanumeric() || octet == b'_'
}

#[cfg(test)]
mod tests {
    use super::*;
    use dp_master::time::Instant;

    #[derive(Debug)]
    struct Machine {
        #[expect(dead_code, reason = "read by Debug")]
        sent: [u32; 2],
        #[expect(dead_code, reason = "read by Debug")]
        due: Option<Instant>,
        #[expect(dead_code, reason = "read by Debug")]
        level: u8,
    }

    fn of(sent: [u32; 2], due_ns: u64, level: u8, now_ns: u64) -> u128 {
        let machine = Machine {
            sent,
            due: Some(Instant::from_nanos(due_ns)),
            level,
        };
        let canon = Canon {
            ignored: &[("Machine", "sent"), ("Other", "level")],
            deadlines: &[],
            now_ns,
            horizon_ns: 100,
        };
        fingerprint(&machine, canon, &mut String::new())
    }

    #[test]
    fn counters_and_the_absolute_time_do_not_count_and_all_else_does() {
        let state = of([1, 2], 1_050, 3, 1_000);
        assert_eq!(state, of([7, 8], 1_050, 3, 1_000), "an ignored field");
        assert_eq!(state, of([1, 2], 9_050, 3, 9_000), "the same distance");
        assert_ne!(state, of([1, 2], 1_051, 3, 1_000), "another distance");
        assert_ne!(state, of([1, 2], 1_050, 4, 1_000), "another field");
        assert_eq!(of([1, 2], 10, 3, 1_000), of([1, 2], 800, 3, 1_000), "both long ago");
        assert_ne!(of([1, 2], 950, 3, 1_000), of([1, 2], 960, 3, 1_000), "not so long ago");
        assert_eq!(of([1, 2], u64::MAX, 3, 1_000), of([1, 2], u64::MAX, 3, 5), "never");
    }
}
