//! Numbers of a glTF in its buffers (glTF 2.0, chapters 3.6.1 and 3.6.2).

use std::borrow::Cow;
use std::cell::Cell;

use super::document::{Accessor, Document, data};
use crate::{MAX_ELEMENTS, MAX_VERTICES, shown};

/// Contents of the buffers.
#[derive(Debug)]
pub struct Buffers<'d> {
    document: &'d Document,
    all: Vec<Option<Cow<'d, [u8]>>>,
    /// Number of values that were read: a short file can refer to its longest part a million times.
    walked: Cell<usize>,
}

/// Types of numbers.
const BYTE: u32 = 5120;
const UNSIGNED_BYTE: u32 = 5121;
const SHORT: u32 = 5122;
const UNSIGNED_SHORT: u32 = 5123;
const UNSIGNED_INT: u32 = 5125;
const FLOAT: u32 = 5126;

impl<'d> Buffers<'d> {
    /// Takes the buffers from the file itself, from its JSON, or from files `beside` it, by their names.
    ///
    /// # Errors
    /// Returns an error if a buffer in the JSON is not in base 64.
    pub fn new(
        document: &'d Document,
        binary: Option<&'d [u8]>,
        beside: impl Fn(&str) -> Option<&'d [u8]>,
    ) -> Result<Self, String> {
        let all = document.buffers.iter().enumerate().map(|(index, buffer)| match &buffer.uri {
            // The binary part belongs to the first buffer.
            None => Ok(binary.filter(|_| index == 0).map(Cow::Borrowed)),
            Some(uri) if uri.starts_with("data:") => match data(uri) {
                Some(data) => Ok(Some(Cow::Owned(data))),
                None => Err(format!("buffer {index} is not in base 64")),
            },
            Some(uri) => Ok(beside(uri).map(Cow::Borrowed)),
        });
        Ok(Self { document, all: all.collect::<Result<_, String>>()?, walked: Cell::new(0) })
    }

    /// Returns the bytes of a view.
    ///
    /// # Errors
    /// Returns an error if its buffer does not have them.
    pub fn view(&self, view: usize) -> Result<&[u8], String> {
        let Some(found) = self.document.buffer_views.get(view) else {
            return Err(format!("it names buffer view {view}, which does not exist"));
        };
        let Some(Some(buffer)) = self.all.get(found.buffer) else {
            let named = self.document.buffers.get(found.buffer).and_then(|buffer| buffer.uri.as_deref());
            let named = named.map_or_else(String::new, |uri| format!(" {}", shown(uri)));
            return Err(format!("its buffer{named} does not exist"));
        };
        let rest = buffer.get(found.byte_offset..);
        let own = rest.and_then(|rest| rest.get(..found.byte_length));
        own.ok_or_else(|| format!("buffer view {view} ends behind its buffer, of {} bytes", buffer.len()))
    }

    /// Reads positions or normals.
    ///
    /// # Errors
    /// Returns an error if they are not at the declared place, or of another type.
    pub fn vectors(&self, accessor: usize) -> Result<Vec<[f32; 3]>, String> {
        let found = self.get(accessor, &["VEC3"])?;
        self.read::<3>(accessor, found)
    }

    /// Reads texture coordinates.
    ///
    /// # Errors
    /// Returns an error if they are not at the declared place, or of another type.
    pub fn pairs(&self, accessor: usize) -> Result<Vec<[f32; 2]>, String> {
        let found = self.get(accessor, &["VEC2"])?;
        self.read::<2>(accessor, found)
    }

    /// Reads the vertex indices of triangles.
    ///
    /// # Errors
    /// Returns an error if they are not at the declared place, or no whole numbers.
    pub fn indices(&self, accessor: usize) -> Result<Vec<u32>, String> {
        let found = self.get(accessor, &["SCALAR"])?;
        let (bytes, size, stride) = self.bytes(accessor, found, 1)?;
        let index = |at: usize| -> Option<u32> {
            let bytes = bytes.get(at * stride..)?.get(..size)?;
            match *bytes {
                [one] => Some(u32::from(one)),
                [low, high] => Some(u32::from(u16::from_le_bytes([low, high]))),
                _ => Some(u32::from_le_bytes(bytes.try_into().ok()?)),
            }
        };
        if !matches!(found.component_type, UNSIGNED_BYTE | UNSIGNED_SHORT | UNSIGNED_INT) {
            return Err(format!("accessor {accessor} is of indices that are not whole numbers"));
        }
        Ok((0..found.count).map_while(index).collect())
    }

    fn get(&self, accessor: usize, kinds: &[&str]) -> Result<&'d Accessor, String> {
        let Some(found) = self.document.accessors.get(accessor) else {
            return Err(format!("it names accessor {accessor}, which does not exist"));
        };
        if !kinds.contains(&found.kind.as_str()) {
            let (kind, expected) = (shown(&found.kind), kinds.join(" or "));
            return Err(format!("accessor {accessor} is of {kind} instead of {expected}"));
        }
        if found.sparse.is_some() {
            return Err(format!("accessor {accessor} is sparse, which is not read"));
        }
        Ok(found)
    }

    /// Returns the bytes of an accessor, the size of one number, and the stride between elements. All
    /// elements exist.
    fn bytes(
        &self,
        index: usize,
        accessor: &Accessor,
        numbers: usize,
    ) -> Result<(&[u8], usize, usize), String> {
        let size = match accessor.component_type {
            BYTE | UNSIGNED_BYTE => 1,
            SHORT | UNSIGNED_SHORT => 2,
            UNSIGNED_INT | FLOAT => 4,
            other => return Err(format!("accessor {index} is of the unknown type {other}")),
        };
        let Some(view) = accessor.buffer_view else {
            return Err(format!("accessor {index} has no buffer view"));
        };
        let stride = self.document.buffer_views.get(view).and_then(|view| view.byte_stride);
        let stride = stride.filter(|stride| *stride > 0).unwrap_or(size * numbers);
        let bytes = self.view(view)?.get(accessor.byte_offset..).unwrap_or_default();
        let last = accessor.count.saturating_sub(1).saturating_mul(stride);
        let needed = if accessor.count == 0 { 0 } else { last.saturating_add(size * numbers) };
        if needed > bytes.len() {
            let (count, there) = (accessor.count, bytes.len());
            return Err(format!("accessor {index} declares {count} elements; its view has {there} bytes"));
        }
        let walked = self.walked.get().saturating_add(accessor.count);
        self.walked.set(walked);
        if walked > MAX_ELEMENTS {
            return Err(format!("its parts name more than {} elements of buffers", MAX_ELEMENTS));
        }
        Ok((bytes, size, stride))
    }

    fn read<const N: usize>(&self, index: usize, accessor: &Accessor) -> Result<Vec<[f32; N]>, String> {
        let (bytes, size, stride) = self.bytes(index, accessor, N)?;
        if accessor.count > MAX_VERTICES {
            return Err(format!("it has more than {} corners", MAX_VERTICES));
        }
        let kind = accessor.component_type;
        // Integers are values, or fractions of the largest one if normalized.
        let scaled =
            |value: f32, most: f32| if accessor.normalized { (value / most).max(-1.0) } else { value };
        let number = |bytes: &[u8]| -> f32 {
            match (kind, bytes) {
                (BYTE, &[byte]) => scaled(f32::from(i8::from_le_bytes([byte])), 127.0),
                (UNSIGNED_BYTE, &[byte]) => scaled(f32::from(byte), 255.0),
                (SHORT, &[low, high]) => scaled(f32::from(i16::from_le_bytes([low, high])), 32767.0),
                (UNSIGNED_SHORT, &[low, high]) => scaled(f32::from(u16::from_le_bytes([low, high])), 65535.0),
                (FLOAT, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]),
                // Positions of this type are invalid: the mesh is refused for them.
                _ => f32::NAN,
            }
        };
        let element = |at: usize| -> [f32; N] {
            let own = bytes.get(at * stride..).unwrap_or_default();
            let mut parts = own.chunks_exact(size).map(number);
            std::array::from_fn(|_| parts.next().unwrap_or(f32::NAN))
        };
        Ok((0..accessor.count).map(element).collect())
    }
}
