//! Plain CDR of XTypes 1.0, little-endian: the encoding that all `rmw` implementations use by default.
//!
//! A payload is four bytes that name the encoding, then the fields one after the other. A number is aligned to its own size,
//! counted from the byte after those four; a string is its length with the zero at its end, then its bytes; a sequence
//! its length, then its elements; an array its elements.

/// Names plain CDR, little-endian.
pub const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// How many bytes more than its message a payload may have: some writers pad it to a multiple of four.
const MAX_PADDING: usize = 3;

/// Why bytes are not the message that they should be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{path}: {what}")]
pub struct Malformed {
    /// Of the field, from the type on: `sensor_msgs/msg/JointState.position`.
    pub path: String,
    /// What is wrong there.
    pub what: String,
}

impl Malformed {
    fn new(what: impl Into<String>) -> Self {
        Self { path: String::new(), what: what.into() }
    }

    /// The same fault, seen from what contains it.
    #[must_use]
    pub fn within(mut self, name: &str) -> Self {
        let dot = if self.path.is_empty() || self.path.starts_with('[') { "" } else { "." };
        self.path.insert_str(0, dot);
        self.path.insert_str(0, name);
        self
    }
}

/// Takes values, and has their bytes.
#[derive(Debug)]
pub struct Writer<'a> {
    bytes: &'a mut Vec<u8>,
    /// Where alignment is counted from.
    origin: usize,
}

impl<'a> Writer<'a> {
    /// Appends a payload to what is there.
    pub fn new(bytes: &'a mut Vec<u8>) -> Self {
        bytes.extend_from_slice(&ENCAPSULATION);
        let origin = bytes.len();
        Self { bytes, origin }
    }

    /// A number of as many bytes as its alignment.
    pub fn number<const N: usize>(&mut self, bytes: [u8; N]) {
        let past = self.bytes.len() - self.origin;
        self.bytes.resize(self.origin + past.next_multiple_of(N), 0);
        self.bytes.extend_from_slice(&bytes);
    }

    /// The length of a sequence, or of a string with its zero. What would not fit in 32 bits does not fit in a message.
    pub fn length(&mut self, length: usize) {
        self.number(u32::try_from(length).unwrap_or(u32::MAX).to_le_bytes());
    }

    /// Text, and the zero after it.
    pub fn text(&mut self, text: &str) {
        self.length(text.len() + 1);
        self.bytes.extend_from_slice(text.as_bytes());
        self.bytes.push(0);
    }
}

/// Has untrusted bytes, and gives values.
#[derive(Debug)]
pub struct Reader<'a> {
    body: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    /// Of a payload.
    ///
    /// # Errors
    ///
    /// If it is of another encoding.
    pub fn new(payload: &'a [u8]) -> Result<Self, Malformed> {
        match payload.split_first_chunk::<4>() {
            // The last two bytes are options, which plain CDR has none of.
            Some((&[0, 1, _, _], body)) => Ok(Self { body, at: 0 }),
            Some(([first, second, ..], _)) => Err(Malformed::new(format!(
                "the encoding is {first:#04x} {second:#04x}, and only little-endian plain CDR, 0x00 0x01, is read"
            ))),
            None => Err(Malformed::new(format!("{} bytes are no payload", payload.len()))),
        }
    }

    fn left(&self) -> usize {
        self.body.len().saturating_sub(self.at)
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], Malformed> {
        let rest = self.body.get(self.at..).unwrap_or_default();
        let Some((taken, _)) = rest.split_at_checked(count) else {
            return Err(Malformed::new(format!("{count} bytes are needed and {} are left", rest.len())));
        };
        self.at += count;
        Ok(taken)
    }

    /// A number of as many bytes as its alignment. Padding is skipped, not looked at.
    ///
    /// # Errors
    ///
    /// If there are no more bytes.
    pub fn number<const N: usize>(&mut self) -> Result<[u8; N], Malformed> {
        self.at = self.at.next_multiple_of(N);
        let taken = self.take(N)?;
        <[u8; N]>::try_from(taken).map_err(|_| Malformed::new("bytes are missing"))
    }

    /// The length of a sequence whose elements take at least `smallest` bytes each: no more than there can be, so that
    /// memory may be taken for it.
    ///
    /// # Errors
    ///
    /// If there are not that many.
    pub fn length(&mut self, smallest: usize) -> Result<usize, Malformed> {
        let length = u32::from_le_bytes(self.number()?) as usize;
        if length.saturating_mul(smallest) > self.left() {
            return Err(Malformed::new(format!(
                "{length} elements do not fit in the {} bytes left",
                self.left()
            )));
        }
        Ok(length)
    }

    /// Text, up to the zero after it.
    ///
    /// # Errors
    ///
    /// If it is longer than the bytes left, has no zero at its end or one before it, or is not UTF-8.
    pub fn text(&mut self) -> Result<&'a str, Malformed> {
        let length = u32::from_le_bytes(self.number()?) as usize;
        // Some writers leave out the zero of an empty string.
        if length == 0 {
            return Ok("");
        }
        let bytes = match self.take(length)? {
            [bytes @ .., 0] if !bytes.contains(&0) => bytes,
            _ => return Err(Malformed::new("the text does not end with its one zero")),
        };
        std::str::from_utf8(bytes).map_err(|_| Malformed::new("the text is not UTF-8"))
    }

    /// A truth value.
    ///
    /// # Errors
    ///
    /// If it is neither 0 nor 1.
    pub fn truth(&mut self) -> Result<bool, Malformed> {
        match self.number::<1>()? {
            [0] => Ok(false),
            [1] => Ok(true),
            [other] => Err(Malformed::new(format!("{other} is no truth value"))),
        }
    }

    /// That nothing follows but padding.
    ///
    /// # Errors
    ///
    /// If more does.
    pub fn end(&self) -> Result<(), Malformed> {
        if self.left() > MAX_PADDING {
            return Err(Malformed::new(format!("{} bytes follow the message", self.left())));
        }
        Ok(())
    }
}
