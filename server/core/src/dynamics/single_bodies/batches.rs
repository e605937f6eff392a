//! Batches of contacts that are solved at the same time, and the layout of their numbers.

use super::SIX;
use crate::dynamics::constraint::contact::ContactRows;
use crate::dynamics::tree::SingleBody;

/// Contacts that are solved at the same time. All of their bodies are different.
#[derive(Debug, Default)]
pub(super) struct Batches {
    /// First velocities of both sides, for each lane of each batch.
    pub(super) sides: Vec<[usize; 2]>,
    /// Rows of the contact in each lane; `None` if the batch is not full.
    rows: Vec<Option<usize>>,
    /// Number of contacts of each batch.
    counts: Vec<usize>,
    /// For each batch: itself if it has room, else a batch on the way to the next one with room.
    room: Vec<usize>,
    /// First batch after those of each body.
    next: Vec<usize>,
}

/// Layout of a contact's numbers. A thousand contacts do not fit into the cache nearest to the processor, so
/// sweeps take as long as reading their numbers. Numbers that follow from others are therefore left out.
///
/// First come the axes, against the first side and along the second. For each side follow the angular part of
/// J, the angular part of M^-1 J', and the inverse mass, negative on the first side. All bodies may have
/// equal resistance to turning about any axis, as balls and cubes do. The angular part of M^-1 J' is then J's
/// times one number.
pub(super) struct Layout<const ALIKE: bool>;

impl<const ALIKE: bool> Layout<ALIKE> {
    pub(super) const TURNS: usize = 9;
    pub(super) const MASS: usize = Self::TURNS + if ALIKE { 1 } else { 9 };
    const SIDE: usize = Self::MASS + 1;
    /// Target, both drifts, compliance, friction, and the step against a slip.
    pub(super) const AIM: usize = 9 + 2 * Self::SIDE;
    /// nn, nt, nu, tt and uu.
    pub(super) const EFFECT: usize = Self::AIM + 6;
    pub(super) const INVERSE: usize = Self::EFFECT + 5;
    pub(super) const IMPULSE: usize = Self::INVERSE + 3;
    /// Impulses before the last sweep.
    pub(super) const BEFORE: usize = Self::IMPULSE + 3;
    pub(super) const COUNT: usize = Self::BEFORE + 3;

    pub(super) const fn side(side: usize) -> usize {
        9 + side * Self::SIDE
    }
}

impl Batches {
    /// Puts each acting contact into the first batch with room after those of earlier contacts of its bodies.
    /// Returns false if batches are not more than half full.
    pub(super) fn fill(&mut self, all: &[ContactRows], bodies: usize, width: usize) -> bool {
        let Self { sides, rows, counts, room, next } = self;
        sides.clear();
        rows.clear();
        counts.clear();
        room.clear();
        // The one after the last has room.
        room.push(0);
        next.clear();
        next.resize(bodies, 0);
        // So that a step does not allocate if contacts fill their batches less well than before.
        let most = 2 * all.len() + width;
        sides.reserve(most);
        rows.reserve(most);
        let mut acting = 0;
        for (index, contact) in all.iter().enumerate().filter(|(_, rows)| rows.acts()) {
            let moving = || contact.sides.iter().filter(|side| side.len > 0);
            let earliest = moving().map(|side| next[side.first / SIX]).max().unwrap_or(0);
            let batch = with_room(room, earliest);
            if batch == counts.len() {
                if rows.len() + width > most {
                    return false;
                }
                counts.push(0);
                room.push(batch + 1);
                sides.resize(sides.len() + width, [bodies * SIX; 2]);
                rows.resize(rows.len() + width, None);
            }
            let lane = batch * width + counts[batch];
            rows[lane] = Some(index);
            for (place, side) in sides[lane].iter_mut().zip(&contact.sides).filter(|(_, side)| side.len > 0) {
                *place = side.first;
            }
            moving().for_each(|side| next[side.first / SIX] = batch + 1);
            counts[batch] += 1;
            if counts[batch] == width {
                room[batch] = batch + 1;
            }
            acting += 1;
        }
        2 * acting > rows.len()
    }

    /// Writes the numbers of all contacts. Returns false if J and M^-1 J' do not follow from the bodies
    /// alone.
    pub(super) fn load<const ALIKE: bool>(
        &self,
        (rows, blocks): (&[ContactRows], &[f64]),
        bodies: &[SingleBody],
        width: usize,
        numbers: &mut Vec<f64>,
    ) -> bool {
        let count = Layout::<ALIKE>::COUNT;
        numbers.truncate(self.rows.len() * count);
        numbers.reserve(((2 * rows.len() + width) * Layout::<false>::COUNT).saturating_sub(numbers.len()));
        numbers.resize(self.rows.len() * count, 0.0);
        for (batch, of_lanes) in self.rows.chunks_exact(width).enumerate() {
            let numbers = &mut numbers[batch * count * width..][..count * width];
            for (lane, index) in of_lanes.iter().enumerate() {
                let mut put = |at: usize, values: &[f64]| {
                    for (offset, value) in values.iter().enumerate() {
                        numbers[(at + offset) * width + lane] = *value;
                    }
                };
                let Some(rows) = index.map(|index| &rows[index]) else {
                    put(0, &[0.0; Layout::<false>::COUNT][..count]);
                    // It is a divisor.
                    put(Layout::<ALIKE>::EFFECT, &[1.0]);
                    continue;
                };
                if rows.sides.iter().any(|side| side.len == 0) {
                    put(0, &[0.0; Layout::<false>::COUNT][..Layout::<ALIKE>::AIM]);
                }
                let mut axes = None;
                for (number, side) in rows.sides.iter().enumerate().filter(|(_, side)| side.len > 0) {
                    let Some((jacobian, responses)) = side.single(blocks) else { return false };
                    let SingleBody { inverse_mass, inverse_moment, .. } = bodies[side.first / SIX];
                    let j = |k: usize, i: usize| jacobian[SIX * (i / 2) + 2 * k + i % 2];
                    let sign = if number == 0 { -1.0 } else { 1.0 };
                    let own: [[f64; 3]; 3] = [0, 1, 2].map(|k| [0, 1, 2].map(|i| sign * j(k, i)));
                    let moments: [[f64; 3]; 3] = [0, 1, 2].map(|k| [3, 4, 5].map(|i| j(k, i)));
                    let turns: [[f64; 3]; 3] = responses.map(|response| [3, 4, 5].map(|i| response[i]));
                    let mass = sign * inverse_mass;
                    let turn = inverse_moment.x_axis.x;
                    let is = |found: f64, expected: f64| found.to_bits() == expected.to_bits();
                    let is_so = (0..3).all(|k| {
                        (0..3).all(|i| {
                            is(responses[k][i], own[k][i] * mass)
                                && (!ALIKE || is(turns[k][i], moments[k][i] * turn + 0.0))
                        })
                    });
                    if !is_so || axes.is_some_and(|axes| axes != own) {
                        return false;
                    }
                    axes = Some(own);
                    let at = Layout::<ALIKE>::side(number);
                    put(0, own.as_flattened());
                    put(at, moments.as_flattened());
                    let turns = if ALIKE { &[turn][..] } else { turns.as_flattened() };
                    put(at + Layout::<ALIKE>::TURNS, turns);
                    put(at + Layout::<ALIKE>::MASS, &[mass]);
                }
                let ContactRows { target, drift, compliance, inverse, gradient_step, friction, .. } = *rows;
                let [nn, nt, nu, tt, _, uu] = rows.effect;
                let aim = [target, drift[0], drift[1], compliance, friction, gradient_step];
                put(Layout::<ALIKE>::AIM, &aim);
                put(Layout::<ALIKE>::EFFECT, &[nn, nt, nu, tt, uu]);
                put(Layout::<ALIKE>::INVERSE, &inverse);
                put(Layout::<ALIKE>::IMPULSE, &rows.impulse);
                put(Layout::<ALIKE>::BEFORE, &rows.impulse);
            }
        }
        true
    }

    /// Writes the velocities of position correction, and zero impulses.
    pub(super) fn load_split(&self, rows: &[ContactRows], width: usize, split: &mut Vec<f64>) {
        split.clear();
        split.reserve(2 * (2 * rows.len() + width));
        for of_lanes in self.rows.chunks_exact(width) {
            split.extend(
                of_lanes.iter().map(|index| index.map_or(0.0, |index| rows[index].correction_velocity)),
            );
            split.resize(split.len() + width, 0.0);
        }
    }

    /// Writes the contacts' impulses.
    pub(super) fn give_back<const ALIKE: bool>(
        &self,
        numbers: &[f64],
        width: usize,
        rows: &mut [ContactRows],
    ) {
        for (lane, index) in self.rows.iter().enumerate() {
            let Some(index) = *index else { continue };
            let first = lane / width * Layout::<ALIKE>::COUNT + Layout::<ALIKE>::IMPULSE;
            for (k, impulse) in rows[index].impulse.iter_mut().enumerate() {
                *impulse = numbers[(first + k) * width + lane % width];
            }
        }
    }
}

/// Returns this batch, or the next one with room. Halves the search path for the next time.
fn with_room(room: &mut [usize], mut batch: usize) -> usize {
    while room[batch] != batch {
        room[batch] = room[room[batch]];
        batch = room[batch];
    }
    batch
}
