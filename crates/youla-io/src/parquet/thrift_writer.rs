//! Writes the compact protocol of [`super::thrift`].

/// A struct as it is written.
pub(super) struct Writer {
    bytes: Vec<u8>,
    last: i16,
}

impl Writer {
    pub(super) fn new() -> Self {
        Writer { bytes: Vec::new(), last: 0 }
    }

    /// The whole struct.
    pub(super) fn end(mut self) -> Vec<u8> {
        self.bytes.push(0);
        self.bytes
    }

    /// The byte before a field, whose number is above that of the one before by 15 at most.
    fn field(&mut self, number: i16, kind: u8) {
        self.bytes.push(((number - self.last) as u8) << 4 | kind);
        self.last = number;
    }

    fn natural(&mut self, mut value: u64) {
        while value > 0x7f {
            self.bytes.push(value as u8 | 0x80);
            value >>= 7;
        }
        self.bytes.push(value as u8);
    }

    fn signed(&mut self, value: i64) {
        self.natural((value << 1 ^ value >> 63) as u64);
    }

    pub(super) fn integer32(&mut self, number: i16, value: i64) {
        self.field(number, 5);
        self.signed(value);
    }

    pub(super) fn integer64(&mut self, number: i16, value: i64) {
        self.field(number, 6);
        self.signed(value);
    }

    pub(super) fn bytes(&mut self, number: i16, value: &[u8]) {
        self.field(number, 8);
        self.text(value);
    }

    fn text(&mut self, value: &[u8]) {
        self.natural(value.len() as u64);
        self.bytes.extend_from_slice(value);
    }

    pub(super) fn structure(&mut self, number: i16, fill: impl FnOnce(&mut Writer)) {
        self.field(number, 12);
        self.item(fill);
    }

    fn item(&mut self, fill: impl FnOnce(&mut Writer)) {
        let mut inner = Writer::new();
        fill(&mut inner);
        self.bytes.extend(inner.end());
    }

    fn head(&mut self, number: i16, count: usize, kind: u8) {
        self.field(number, 9);
        match count {
            0..15 => self.bytes.push((count as u8) << 4 | kind),
            _ => {
                self.bytes.push(0xf0 | kind);
                self.natural(count as u64);
            }
        }
    }

    /// A list of structs.
    pub(super) fn list(&mut self, number: i16, count: usize, mut fill: impl FnMut(usize, &mut Writer)) {
        self.head(number, count, 12);
        (0..count).for_each(|k| self.item(|inner| fill(k, inner)));
    }

    /// A list of whole numbers of 32 bits.
    pub(super) fn integers(&mut self, number: i16, values: &[i64]) {
        self.head(number, values.len(), 5);
        values.iter().for_each(|value| self.signed(*value));
    }

    /// A list of texts.
    pub(super) fn names(&mut self, number: i16, values: &[&[u8]]) {
        self.head(number, values.len(), 8);
        values.iter().for_each(|value| self.text(value));
    }
}
