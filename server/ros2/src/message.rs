//! What a message, a service and a field are. All that is said about a type, its bytes, its text and its hash, comes from the
//! one list of fields that the macro `messages!` is given.

use crate::cdr::{Malformed, Reader, Writer};
use crate::{definition, type_hash};

/// A type of ROS 2 that has a name.
pub trait Message: Field + Default {
    /// `sensor_msgs/msg/JointState`.
    const NAME: &'static str;

    /// Its fields, and those of the types that it has.
    fn description() -> Description;

    /// RIHS01: `RIHS01_` and 64 hexadecimal digits.
    fn type_hash() -> &'static str;

    /// The text that MCAP has as a schema of the encoding `ros2msg`: its own fields, then those of each type in it.
    fn definition() -> String {
        definition::text(&Self::description())
    }

    /// Its payload.
    fn to_cdr(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.append_cdr(&mut bytes);
        bytes
    }

    /// Its payload after what is there already.
    fn append_cdr(&self, bytes: &mut Vec<u8>) {
        self.write(&mut Writer::new(bytes));
    }

    /// What a payload says. Takes memory of a small multiple of its length at most.
    ///
    /// # Errors
    ///
    /// If it is no message of this type.
    fn from_cdr(payload: &[u8]) -> Result<Self, Malformed> {
        let read = || {
            let mut reader = Reader::new(payload)?;
            let message = Self::read(&mut reader)?;
            reader.end()?;
            Ok(message)
        };
        read().map_err(|fault: Malformed| fault.within(Self::NAME))
    }
}

/// A pair of messages, asked and answered.
pub trait Service {
    /// `simulation_interfaces/srv/GetEntities`.
    const NAME: &'static str;
    /// What is asked.
    type Request: Message;
    /// What is answered.
    type Response: Message;

    /// RIHS01 of the service, which its keys have.
    fn type_hash() -> &'static str;

    /// The service as RIHS01 sees it: a type of request, response and event.
    fn description() -> Description {
        let bounded = |message| FieldType { base: Base::Message(Box::new(message)), count: Count::UpTo(1) };
        let one = |message| FieldType { base: Base::Message(Box::new(message)), count: Count::One };
        let event = Description {
            name: format!("{}_Event", Self::NAME),
            constants: Vec::new(),
            fields: vec![
                ("info", crate::messages::service_msgs::ServiceEventInfo::field_type()),
                ("request", bounded(Self::Request::description())),
                ("response", bounded(Self::Response::description())),
            ],
        };
        Description {
            name: Self::NAME.to_owned(),
            constants: Vec::new(),
            fields: vec![
                ("request_message", one(Self::Request::description())),
                ("response_message", one(Self::Response::description())),
                ("event_message", one(event)),
            ],
        }
    }
}

/// Of what a message consists.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Description {
    /// `sensor_msgs/msg/JointState`.
    pub name: String,
    /// Type, name and value of each constant.
    pub constants: Vec<(&'static str, &'static str, String)>,
    /// In their order.
    pub fields: Vec<(&'static str, FieldType)>,
}

impl Description {
    /// Its fields as they are on the wire: a type without any has one that means nothing.
    pub(crate) fn wire_fields(&self) -> Vec<(&'static str, FieldType)> {
        if self.fields.is_empty() {
            return vec![("structure_needs_at_least_one_member", u8::field_type())];
        }
        self.fields.clone()
    }
}

/// The type of a field.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FieldType {
    /// Of one element.
    pub base: Base,
    /// How many there are.
    pub count: Count,
}

/// The type of an element.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Base {
    /// One that the language has, with the number that RIHS01 has for it.
    Primitive(&'static str, u8),
    /// Another message.
    Message(Box<Description>),
}

/// How many elements a field has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Count {
    /// It is the element.
    One,
    /// Always that many.
    Array(usize),
    /// Any number.
    Sequence,
    /// That many at most.
    UpTo(usize),
}

/// A value within a message.
pub trait Field: Sized {
    /// The fewest bytes that one takes.
    const SMALLEST: usize;

    /// Its type.
    fn field_type() -> FieldType;

    /// To the end of a payload.
    fn write(&self, writer: &mut Writer<'_>);

    /// The next of a payload.
    ///
    /// # Errors
    ///
    /// If it is not there, or is something else.
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

// The numbers are those of type_description_interfaces/msg/FieldType.
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

/// The name of a field as ROS has it, where it is a word of Rust.
pub(crate) const fn plain_name(name: &'static str) -> &'static str {
    match name.as_bytes() {
        [b'r', b'#', ..] => name.split_at(2).1,
        _ => name,
    }
}

/// A hash, once it was asked for: each endpoint asks.
pub(crate) type HashCache = std::sync::OnceLock<String>;

pub(crate) fn hash_of(cache: &'static HashCache, of: fn() -> Description) -> &'static str {
    cache.get_or_init(|| type_hash::rihs01(&of()))
}

/// Declares messages: the name of the Rust type, that of ROS, constants, fields.
macro_rules! messages {
    ($(
        $(#[$meta:meta])*
        $type:ident = $name:literal $(consts {
            $($constant:ident: $constant_type:ty = $value:literal;)*
        })? {
            $($field:ident: $field_type:ty,)*
        }
    )*) => {$(
        $(#[$meta])*
        #[derive(Clone, Debug, Default, PartialEq)]
        #[allow(missing_docs, reason = "the fields are those of the definition that ROS documents")]
        pub struct $type {
            $(pub $field: $field_type,)*
        }

        #[allow(missing_docs, reason = "the constants are those of the definition that ROS documents")]
        impl $type {
            $($(pub const $constant: $constant_type = $value;)*)?
        }

        impl $crate::message::Field for $type {
            // A type without fields has one byte.
            const SMALLEST: usize = {
                let sum = 0 $(+ <$field_type as $crate::message::Field>::SMALLEST)*;
                if sum == 0 { 1 } else { sum }
            };

            fn field_type() -> $crate::message::FieldType {
                $crate::message::FieldType {
                    base: $crate::message::Base::Message(Box::new(<Self as $crate::message::Message>::description())),
                    count: $crate::message::Count::One,
                }
            }

            fn write(&self, writer: &mut $crate::cdr::Writer<'_>) {
                const FIELDS: &[&str] = &[$(stringify!($field)),*];
                if FIELDS.is_empty() {
                    writer.number([0]);
                }
                $($crate::message::Field::write(&self.$field, writer);)*
            }

            fn read(reader: &mut $crate::cdr::Reader<'_>) -> std::result::Result<Self, $crate::cdr::Malformed> {
                const FIELDS: &[&str] = &[$(stringify!($field)),*];
                if FIELDS.is_empty() {
                    reader.number::<1>()?;
                }
                Ok(Self {
                    $($field: <$field_type as $crate::message::Field>::read(reader)
                        .map_err(|fault| fault.within($crate::message::plain_name(stringify!($field))))?,)*
                })
            }
        }

        impl $crate::message::Message for $type {
            const NAME: &'static str = $name;

            fn description() -> $crate::message::Description {
                $crate::message::Description {
                    name: $name.to_owned(),
                    constants: vec![$($((
                        $crate::message::primitive_name::<$constant_type>(),
                        stringify!($constant),
                        Self::$constant.to_string(),
                    )),*)?],
                    fields: vec![$((
                        $crate::message::plain_name(stringify!($field)),
                        <$field_type as $crate::message::Field>::field_type(),
                    )),*],
                }
            }

            fn type_hash() -> &'static str {
                static HASH: $crate::message::HashCache = $crate::message::HashCache::new();
                $crate::message::hash_of(&HASH, Self::description)
            }
        }
    )*};
}

/// Declares services: the name of the Rust type, that of ROS, request and response.
macro_rules! services {
    ($($(#[$meta:meta])* $type:ident = $name:literal ($request:ty, $response:ty);)*) => {$(
        $(#[$meta])*
        #[derive(Clone, Copy, Debug)]
        pub struct $type;

        impl $crate::message::Service for $type {
            const NAME: &'static str = $name;
            type Request = $request;
            type Response = $response;

            fn type_hash() -> &'static str {
                static HASH: $crate::message::HashCache = $crate::message::HashCache::new();
                $crate::message::hash_of(&HASH, <Self as $crate::message::Service>::description)
            }
        }
    )*};
}

/// As ROS writes the type of a constant.
pub(crate) fn primitive_name<T: Field>() -> &'static str {
    match T::field_type().base {
        Base::Primitive(name, _) => name,
        Base::Message(_) => "",
    }
}

pub(crate) use {messages, services};
