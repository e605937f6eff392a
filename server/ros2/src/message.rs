//! Traits of messages, services and fields. A type's bytes, text and hash all come from one list of its
//! fields in the macro `messages!`.

mod field;

pub use self::field::{Base, Char, Count, Field, FieldType};
use crate::cdr::{Malformed, Reader, Writer};
use crate::{definition, type_hash};

/// A named type of ROS 2.
pub trait Message: Field + Default {
    /// `sensor_msgs/msg/JointState`.
    const NAME: &'static str;

    /// Returns its fields, and the fields of its types.
    fn description() -> Description;

    /// Returns its RIHS01: `RIHS01_` and 64 hexadecimal digits.
    fn type_hash() -> &'static str;

    /// Returns its definition as an MCAP schema of the encoding `ros2msg`: its own fields, then the fields of
    /// each type in it.
    fn definition() -> String {
        definition::text(&Self::description())
    }

    /// Returns its payload.
    fn to_cdr(&self) -> Vec<u8> {
        let mut bytes = Vec::new();
        self.append_cdr(&mut bytes);
        bytes
    }

    /// Appends its payload to `bytes`.
    fn append_cdr(&self, bytes: &mut Vec<u8>) {
        self.write(&mut Writer::new(bytes));
    }

    /// Decodes a payload. The memory is at most a small multiple of its length.
    ///
    /// # Errors
    ///
    /// Returns an error if it is not a message of this type.
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

/// A pair of messages: request and response.
pub trait Service {
    /// `simulation_interfaces/srv/GetEntities`.
    const NAME: &'static str;
    /// Type of the request.
    type Request: Message;
    /// Type of the response.
    type Response: Message;

    /// Returns the RIHS01 of the service, which its keys contain.
    fn type_hash() -> &'static str;

    /// Returns the service as RIHS01 sees it: a type of request, response and event.
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

/// Structure of a message.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Description {
    /// `sensor_msgs/msg/JointState`.
    pub name: String,
    /// Type, name and value of each constant.
    pub constants: Vec<(&'static str, &'static str, String)>,
    /// Fields in their order.
    pub fields: Vec<(&'static str, FieldType)>,
}

impl Description {
    /// Returns its fields on the wire: a type without fields has one dummy field.
    pub(crate) fn wire_fields(&self) -> Vec<(&'static str, FieldType)> {
        if self.fields.is_empty() {
            return vec![("structure_needs_at_least_one_member", u8::field_type())];
        }
        self.fields.clone()
    }
}

/// Returns the ROS name of a field whose name is a keyword of Rust.
pub(crate) const fn plain_name(name: &'static str) -> &'static str {
    match name.as_bytes() {
        [b'r', b'#', ..] => name.split_at(2).1,
        _ => name,
    }
}

/// A hash, computed once: each endpoint needs it.
pub(crate) type HashCache = std::sync::OnceLock<String>;

pub(crate) fn hash_of(cache: &'static HashCache, of: fn() -> Description) -> &'static str {
    cache.get_or_init(|| type_hash::rihs01(&of()))
}

/// Declares messages: Rust type, ROS name, constants, fields.
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

/// Declares services: Rust type, ROS name, request and response.
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

/// Returns the ROS name of a constant's type.
pub(crate) fn primitive_name<T: Field>() -> &'static str {
    match T::field_type().base {
        Base::Primitive(name, _) => name,
        Base::Message(_) => "",
    }
}

pub(crate) use {messages, services};
