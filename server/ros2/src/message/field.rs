//! Fields: their types, their bytes, and the primitive types.

use super::Description;
use crate::cdr::{Malformed, Reader, Writer};

/// The type of a field.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FieldType {
    /// Type of one element.
    pub base: Base,
    /// Number of elements.
    pub count: Count,
}

/// The type of an element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Base {
    /// A primitive type, with its number in RIHS01.
    Primitive(&'static str, u8),
    /// Another message.
    Message(Box<Description>),
}

/// Number of elements of a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// A single element.
    One,
    /// A fixed number.
    Array(usize),
    /// Any number.
    Sequence,
    /// At most this number.
    UpTo(usize),
}

/// A value within a message.
pub trait Field: Sized {
    /// Minimum number of bytes.
    const SMALLEST: usize;

    /// Returns its type.
    fn field_type() -> FieldType;

    /// Appends it to a payload.
    fn write(&self, writer: &mut Writer<'_>);

    /// Reads the next value of a payload.
    ///
    /// # Errors
    ///
    /// Returns an error if it is missing or malformed.
    fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed>;
}

macro_rules! numbers {
    ($($type:ty, $name:literal, $id:literal;)*) => {$(
        impl Field for $type {
            const SMALLEST: usize = size_of::<$type>();

            fn field_type() -> FieldType {
                FieldType { base: Base::Primitive($name, $id), count: Count::One }
            }

            fn write(&self, writer: &mut Writer<'_>) {
                writer.number(self.to_le_bytes());
            }

            fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
                reader.number().map(<$type>::from_le_bytes)
            }
        }
    )*};
}

// The numbers come from type_description_interfaces/msg/FieldType.
numbers! {
    i8, "int8", 2;
    u8, "uint8", 3;
    i16, "int16", 4;
    u16, "uint16", 5;
    i32, "int32", 6;
    u32, "uint32", 7;
    i64, "int64", 8;
    u64, "uint64", 9;
    f32, "float32", 10;
    f64, "float64", 11;
}

/// A byte that definitions call `char`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Char(pub u8);

impl Field for Char {
    const SMALLEST: usize = 1;

    fn field_type() -> FieldType {
        FieldType { base: Base::Primitive("char", 13), count: Count::One }
    }

    fn write(&self, writer: &mut Writer<'_>) {
        self.0.write(writer);
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        u8::read(reader).map(Self)
    }
}

impl Field for bool {
    const SMALLEST: usize = 1;

    fn field_type() -> FieldType {
        FieldType { base: Base::Primitive("bool", 15), count: Count::One }
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.number([u8::from(*self)]);
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        reader.truth()
    }
}

impl Field for String {
    const SMALLEST: usize = 4;

    fn field_type() -> FieldType {
        FieldType { base: Base::Primitive("string", 17), count: Count::One }
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.text(self);
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        reader.text().map(str::to_owned)
    }
}

impl<T: Field> Field for Vec<T> {
    const SMALLEST: usize = 4;

    fn field_type() -> FieldType {
        FieldType { base: T::field_type().base, count: Count::Sequence }
    }

    fn write(&self, writer: &mut Writer<'_>) {
        writer.length(self.len());
        for element in self {
            element.write(writer);
        }
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        let length = reader.length(T::SMALLEST)?;
        let mut elements = Self::with_capacity(length);
        for index in 0..length {
            elements.push(T::read(reader).map_err(|fault| fault.within(&format!("[{index}]")))?);
        }
        Ok(elements)
    }
}

impl<T: Field + Copy + Default, const N: usize> Field for [T; N] {
    const SMALLEST: usize = N * T::SMALLEST;

    fn field_type() -> FieldType {
        FieldType { base: T::field_type().base, count: Count::Array(N) }
    }

    fn write(&self, writer: &mut Writer<'_>) {
        for element in self {
            element.write(writer);
        }
    }

    fn read(reader: &mut Reader<'_>) -> Result<Self, Malformed> {
        let mut elements = [T::default(); N];
        for (index, element) in elements.iter_mut().enumerate() {
            *element = T::read(reader).map_err(|fault| fault.within(&format!("[{index}]")))?;
        }
        Ok(elements)
    }
}
