//! `<replicate>`: repeats its content, each copy moved from the last one. As in MuJoCo, names end with the
//! separator and the number of the copy, with as many digits as the count has.

use glamx::{DPose3, DQuat, DVec3};

use super::body::Inside;
use super::{Reader, value};
use crate::translation::element::Element;
use crate::translation::notes::Stop;

/// Maximum number of elements in all copies: a few lines can ask for any number.
const MAX_ELEMENTS: usize = 500_000;

impl<'a> Reader<'a> {
    /// Reads the content as many times as requested.
    pub(super) fn replicate(
        &mut self,
        element: Element<'a>,
        body: usize,
        inside: Inside<'_>,
    ) -> Result<(), Stop> {
        let count = element.word("count").and_then(|word| word.parse::<usize>().ok());
        let count = count.filter(|count| *count > 0);
        let count = count.ok_or_else(|| Stop::at(element, "its count is not a whole number above 0"))?;
        let offset =
            value::numbers(element, "offset", &mut self.notes)?.map_or(DVec3::ZERO, DVec3::from_array);
        let angles: [f64; 3] = value::numbers(element, "euler", &mut self.notes)?.unwrap_or_default();
        let separator = element.word("sep").unwrap_or_default();
        let class =
            element.word("childclass").and_then(|name| self.scope.classes.find(name)).or(inside.class);
        let digits = count.to_string().len();
        let mut position = DVec3::ZERO;
        for copy in 0..count {
            self.count_element(element)?;
            // From the angles of each copy, as in MuJoCo, so that errors do not add up.
            let turn: DQuat = value::euler(angles.map(|angle| angle * copy as f64), &self.scope.compiler);
            let suffix = format!("{separator}{copy:0digits$}{}", inside.suffix);
            let frame = inside.frame * DPose3::from_parts(position, turn);
            let inner = Inside { class, frame, suffix: &suffix, depth: inside.depth + 1, ..inside };
            self.content(element, body, inner)?;
            position += turn * offset;
        }
        Ok(())
    }

    /// Counts an element that is in a copy or attached.
    pub(super) fn count_replicated(&mut self, element: Element<'a>, inside: Inside<'_>) -> Result<(), Stop> {
        if inside.suffix.is_empty() && inside.prefix.is_empty() {
            Ok(())
        } else {
            self.count_element(element)
        }
    }

    pub(super) fn count_element(&mut self, element: Element<'a>) -> Result<(), Stop> {
        self.replicated += 1;
        if self.replicated > MAX_ELEMENTS {
            return Err(Stop::at(element, format!("its copies have more than {MAX_ELEMENTS} elements")));
        }
        Ok(())
    }
}
