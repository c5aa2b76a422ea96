//! Decisions out of octets.

/// Takes decisions from the front of the octets; when they are used up there is nothing more to do.
pub(crate) struct Input<'a> {
    rest: &'a [u8],
}

impl<'a> Input<'a> {
    pub(crate) const fn new(octets: &'a [u8]) -> Self {
        Self { rest: octets }
    }

    pub(crate) const fn is_empty(&self) -> bool {
        self.rest.is_empty()
    }

    /// The next octet, 0 at the end.
    pub(crate) fn octet(&mut self) -> u8 {
        match self.rest.split_first() {
            Some((&octet, rest)) => {
                self.rest = rest;
                octet
            }
            None => 0,
        }
    }

    /// A choice among so many.
    pub(crate) fn below(&mut self, choices: u8) -> u8 {
        self.octet() % choices
    }

    /// So many octets, or what is left.
    pub(crate) fn take(&mut self, count: usize) -> &'a [u8] {
        let (taken, rest) = self.rest.split_at(count.min(self.rest.len()));
        self.rest = rest;
        taken
    }

    /// Octets with their number in front, at most 255.
    pub(crate) fn octets(&mut self) -> &'a [u8] {
        let count = usize::from(self.octet());
        self.take(count)
    }
}
