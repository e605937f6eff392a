//! Plain CDR of XTypes 1.0, little-endian: the default encoding of all `rmw` implementations.
//!
//! A payload is four bytes that name the encoding, then the fields in order.
//!
//! * A number is aligned to its own size, counted from the byte after those four.
//! * A string is its length with the zero at its end, then its bytes.
//! * A sequence is its length, then its elements.
//! * An array is its elements.

/// Header of plain CDR, little-endian.
pub const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// Maximum padding after a message: some writers pad payloads to a multiple of four.
const MAX_PADDING: usize = 3;

/// Reason why bytes are not a message of the expected type.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{path}: {what}")]
pub struct Malformed {
    /// Path of the field, from the type on: `sensor_msgs/msg/JointState.position`.
    pub path: String,
    /// Fault of the field.
    pub what: String,
}

impl Malformed {
    fn new(what: impl Into<String>) -> Self {
        Self { path: String::new(), what: what.into() }
    }

    /// Adds the name of the containing field or type.
    #[must_use]
    pub fn within(mut self, name: &str) -> Self {
        let dot = if self.path.is_empty() || self.path.starts_with('[') { "" } else { "." };
        self.path.insert_str(0, dot);
        self.path.insert_str(0, name);
        self
    }
}

/// Writes values as bytes.
#[derive(Debug)]
pub struct Writer<'a> {
    bytes: &'a mut Vec<u8>,
    /// Position from which alignment is counted.
    origin: usize,
}

impl<'a> Writer<'a> {
    /// Appends a payload to `bytes`.
    pub fn new(bytes: &'a mut Vec<u8>) -> Self {
        bytes.extend_from_slice(&ENCAPSULATION);
        let origin = bytes.len();
        Self { bytes, origin }
    }

    /// Writes a number, aligned to its size.
    pub fn number<const N: usize>(&mut self, bytes: [u8; N]) {
        let past = self.bytes.len() - self.origin;
        self.bytes.resize(self.origin + past.next_multiple_of(N), 0);
        self.bytes.extend_from_slice(&bytes);
    }

    /// Writes the length of a sequence, or of a string with its zero. A length above 32 bits does not fit in
    /// a message.
    pub fn length(&mut self, length: usize) {
        self.number(u32::try_from(length).unwrap_or(u32::MAX).to_le_bytes());
    }

    /// Writes a text, and the zero after it.
    pub fn text(&mut self, text: &str) {
        self.length(text.len() + 1);
        self.bytes.extend_from_slice(text.as_bytes());
        self.bytes.push(0);
    }
}

/// Reads values from untrusted bytes.
#[derive(Debug)]
pub struct Reader<'a> {
    body: &'a [u8],
    at: usize,
}

impl<'a> Reader<'a> {
    /// Reads a payload.
    ///
    /// # Errors
    ///
    /// Returns an error if it has another encoding.
    pub fn new(payload: &'a [u8]) -> Result<Self, Malformed> {
        match payload.split_first_chunk::<4>() {
            // The last two bytes are options, which plain CDR does not have.
            Some((&[0, 1, _, _], body)) => Ok(Self { body, at: 0 }),
            Some(([first, second, ..], _)) => Err(Malformed::new(format!(
                "the encoding is {first:#04x} {second:#04x}, and only little-endian plain CDR, 0x00 0x01, is read"
            ))),
            None => Err(Malformed::new(format!("{} bytes are not a payload", payload.len()))),
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

    /// Reads a number, aligned to its size. Skips padding without a check.
    ///
    /// # Errors
    ///
    /// Returns an error if no bytes are left.
    pub fn number<const N: usize>(&mut self) -> Result<[u8; N], Malformed> {
        self.at = self.at.next_multiple_of(N);
        let taken = self.take(N)?;
        <[u8; N]>::try_from(taken).map_err(|_| Malformed::new("bytes are missing"))
    }

    /// Reads the length of a sequence whose elements take at least `smallest` bytes each. The rest of the
    /// payload bounds the length, so that memory may be allocated for it.
    ///
    /// # Errors
    ///
    /// Returns an error if the rest is too short.
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

    /// Reads a text, up to the zero after it.
    ///
    /// # Errors
    ///
    /// Returns an error if it is longer than the rest, has no zero at its end or one before it, or is not
    /// UTF-8.
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

    /// Reads a boolean.
    ///
    /// # Errors
    ///
    /// Returns an error if it is neither 0 nor 1.
    pub fn truth(&mut self) -> Result<bool, Malformed> {
        match self.number::<1>()? {
            [0] => Ok(false),
            [1] => Ok(true),
            [other] => Err(Malformed::new(format!("{other} is not a boolean"))),
        }
    }

    /// Checks that only padding follows.
    ///
    /// # Errors
    ///
    /// Returns an error if more follows.
    pub fn end(&self) -> Result<(), Malformed> {
        if self.left() > MAX_PADDING {
            return Err(Malformed::new(format!("{} bytes follow the message", self.left())));
        }
        Ok(())
    }
}
