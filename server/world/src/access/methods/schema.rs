//! Finds methods of the schema that a table lacks, while the daemon is compiled.

use super::Row;

/// Returns whether each method of a compiled schema has a row in a table. It reads the fields of a `FileDescriptorSet`
/// that name methods. Their numbers are 1 for files, 6 for a file's services, 2 for a service's methods, and
/// 1 for names.
pub(super) const fn has_row_for_each_method(schema: &[u8], rows: &[Row]) -> bool {
    let mut set = Fields::of(schema);
    while let Some((number, file)) = set.next() {
        if number != 1 {
            continue;
        }
        let mut file = Fields::of(file);
        while let Some((number, service)) = file.next() {
            if number == 6 && !has_row_for_each_method_of(service, rows) {
                return false;
            }
        }
    }
    true
}

const fn has_row_for_each_method_of(service: &[u8], rows: &[Row]) -> bool {
    let (mut fields, name) = (Fields::of(service), name_of(service));
    while let Some((number, method)) = fields.next() {
        if number == 2 && !has_row(rows, name, name_of(method)) {
            return false;
        }
    }
    true
}

const fn name_of(message: &[u8]) -> &[u8] {
    let mut fields = Fields::of(message);
    while let Some((number, name)) = fields.next() {
        if number == 1 {
            return name;
        }
    }
    &[]
}

const fn has_row(rows: &[Row], service: &[u8], method: &[u8]) -> bool {
    let mut row = 0;
    while row < rows.len() {
        let Row(of, .., methods) = &rows[row];
        let mut index = 0;
        while index < methods.len() {
            if is_equal(of.as_bytes(), service) && is_equal(methods[index].as_bytes(), method) {
                return true;
            }
            index += 1;
        }
        row += 1;
    }
    false
}

const fn is_equal(mut a: &[u8], mut b: &[u8]) -> bool {
    while let ([first, rest @ ..], [other, others @ ..]) = (a, b) {
        if *first != *other {
            return false;
        }
        (a, b) = (rest, others);
    }
    a.is_empty() && b.is_empty()
}

/// Fields of a message that are texts or messages.
struct Fields<'m>(&'m [u8]);

impl<'m> Fields<'m> {
    const fn of(message: &'m [u8]) -> Self {
        Self(message)
    }

    /// Returns the number of the next field, and its bytes; `None` for a numeric field.
    const fn next(&mut self) -> Option<(u64, &'m [u8])> {
        if self.0.is_empty() {
            return None;
        }
        let key = self.varint();
        let length = match key & 7 {
            0 => {
                self.varint();
                0
            }
            1 => 8,
            5 => 4,
            _ => self.varint() as usize,
        };
        let (bytes, rest) = self.0.split_at(length);
        self.0 = rest;
        Some((key >> 3, if key & 7 == 2 { bytes } else { &[] }))
    }

    const fn varint(&mut self) -> u64 {
        let (mut value, mut shift) = (0, 0);
        while let [byte, rest @ ..] = self.0 {
            self.0 = rest;
            value |= ((*byte & 0x7f) as u64) << shift;
            if *byte < 0x80 {
                break;
            }
            shift += 7;
        }
        value
    }
}

#[cfg(test)]
mod tests {
    use simd_proto::access::Role;

    use super::super::{Claims, Concern};
    use super::*;

    #[test]
    fn a_method_without_a_row_is_found() {
        // A file with the service "S", which has a method "M".
        let method = [0x12, 3, 0x0a, 1, b'M'];
        let service = [&[0x0a, 1, b'S'][..], &method].concat();
        let file = [&[0x32, service.len() as u8][..], &service].concat();
        let schema = [&[0x0a, file.len() as u8][..], &file].concat();
        let row = |method| Row("S", Role::Viewer, Concern::Nothing, Claims::None, method);
        assert!(!has_row_for_each_method(&schema, &[row(&["N"])]));
        assert!(has_row_for_each_method(&schema, &[row(&["N"]), row(&["L", "M"])]));
        assert!(has_row_for_each_method(&[], &[]));
    }
}
