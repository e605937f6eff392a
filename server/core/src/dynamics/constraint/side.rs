//! One side of a contact: the velocities that move it, with J and M^-1 J'.

use std::ops::Range;

/// Maximum number of runs of velocities for which a side stores J.
const MAX_SPANS: usize = 3;

/// Run of consecutive velocities.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Span {
    /// First velocity, by its index in the robot.
    pub first: u32,
    /// Number of velocities.
    pub len: u32,
}

/// One side of a contact.
///
/// A body is moved by its own joint and by the joints between it and the root: J has columns for these only.
#[derive(Clone, Copy, Debug, Default)]
pub struct Side {
    /// Index of the robot in the island.
    pub member: usize,
    /// First velocity of the robot in the island.
    pub first: usize,
    /// Number of velocities of the robot.
    pub len: usize,
    /// Offset of its numbers: see [`Side::size`].
    pub at: usize,
    /// Velocities for which J has columns, from the root on; other columns are zero. Unused spans have length
    /// 0, and come first.
    pub spans: [Span; MAX_SPANS],
    /// Whether it is two bodies of one robot.
    pub is_pair: bool,
}

impl Span {
    fn end(self) -> u32 {
        self.first + self.len
    }

    /// Returns the range of a robot's velocities.
    #[inline(always)]
    pub fn range(self) -> Range<usize> {
        self.first as usize..self.end() as usize
    }
}

impl Side {
    /// Gives J columns for velocities of its robot; those of bodies nearer to the root are added later. If
    /// all spans are used, the span nearest to the root is extended, and J contains zeros.
    pub fn add_span(&mut self, velocities: Range<usize>) {
        let (Ok(first), Ok(end)) = (u32::try_from(velocities.start), u32::try_from(velocities.end)) else {
            return;
        };
        let free = self.spans.iter().filter(|span| span.len == 0).count();
        let span = Span { first, len: end - first };
        match self.spans.get_mut(free) {
            Some(next) if next.first == end || free == 0 => {
                *next = Span { first, len: next.end() - first };
            }
            _ => self.spans[free.saturating_sub(1)] = span,
        }
    }

    /// Returns the side with a column for each velocity of its robot.
    #[inline(always)]
    pub fn with_all(self) -> Self {
        let all = Span { first: 0, len: u32::try_from(self.len).unwrap_or(u32::MAX) };
        Self { spans: [Span::default(), Span::default(), all], ..self }
    }

    /// Returns the number of columns of J.
    #[inline(always)]
    pub fn columns(&self) -> usize {
        self.spans.iter().map(|span| span.len as usize).sum()
    }

    /// Returns the location in J of a velocity of its robot: normal and two tangents.
    pub fn columns_of(&self, velocity: usize) -> Option<[usize; 3]> {
        self.columns_from(velocity).get(0)
    }

    /// Returns the location in J of the velocities from this one on within its span.
    #[inline(always)]
    pub fn columns_from(&self, velocity: usize) -> Columns {
        let mut at = 0;
        for span in &self.spans {
            let len = span.len as usize;
            if span.range().contains(&velocity) {
                return Columns { at, len, first: velocity - span.first as usize };
            }
            at += 3 * len;
        }
        Columns { at, len: 0, first: 0 }
    }

    /// Returns the count of its numbers: J, and then three rows of M^-1 J', which are as long as the robot's
    /// velocities.
    ///
    /// J is stored span by span. Two consecutive columns are interleaved as n n t t u u, and the last one of
    /// an odd span is n t u.
    pub fn size(&self) -> usize {
        3 * (self.columns() + self.len)
    }

    /// Returns each span with its part of J.
    #[inline(always)]
    pub fn parts<'a>(&self, blocks: &'a [f64]) -> impl Iterator<Item = (Range<usize>, &'a [f64])> + use<'a> {
        let mut rest = &blocks[self.at..];
        self.spans.into_iter().filter(|span| span.len > 0).map(move |span| {
            let (part, after) = rest.split_at(3 * span.len as usize);
            rest = after;
            (span.range(), part)
        })
    }

    #[inline(always)]
    fn responses<'a>(&self, blocks: &'a [f64]) -> [&'a [f64]; 3] {
        let (n, rest) = blocks[self.at + 3 * self.columns()..][..3 * self.len].split_at(self.len);
        let (t, u) = rest.split_at(self.len);
        [n, t, u]
    }

    /// Returns J and M^-1 J' of a side that moves all of six velocities, as a single free body does.
    #[inline(always)]
    pub fn single<'a>(&self, blocks: &'a [f64]) -> Option<(&'a [f64; 18], &'a [[f64; 6]; 3])> {
        if !self.moves_six() {
            return None;
        }
        let (jacobian, rest) = blocks[self.at..].split_first_chunk::<18>()?;
        Some((jacobian, rest.first_chunk::<18>()?.as_chunks::<6>().0.first_chunk::<3>()?))
    }

    /// Sets rows of J and of M^-1 J' to zero in which no number of J exceeds this.
    pub fn drop_small_rows(&self, least: f64, blocks: &mut [f64]) {
        let (jacobian, responses) = blocks[self.at..self.at + self.size()].split_at_mut(3 * self.columns());
        let mut largest = [0.0f64; 3];
        let columns = |side: &Self| {
            side.spans.map(Span::range).into_iter().flatten().filter_map(|velocity| self.columns_of(velocity))
        };
        for column in columns(self) {
            (0..3).for_each(|k| largest[k] = largest[k].max(jacobian[column[k]].abs()));
        }
        for k in (0..3).filter(|&k| largest[k] <= least) {
            for column in columns(self) {
                jacobian[column[k]] = 0.0;
            }
            responses[k * self.len..(k + 1) * self.len].fill(0.0);
        }
    }

    /// Replaces rows of J and of M^-1 J' by combinations of all three.
    pub fn combine_rows(&self, sums: impl Fn([f64; 3]) -> [f64; 3], blocks: &mut [f64]) {
        let (jacobian, responses) = blocks[self.at..self.at + self.size()].split_at_mut(3 * self.columns());
        for column in
            self.spans.map(Span::range).into_iter().flatten().filter_map(|velocity| self.columns_of(velocity))
        {
            let new = sums(column.map(|column| jacobian[column]));
            (0..3).for_each(|k| jacobian[column[k]] = new[k]);
        }
        for i in 0..self.len {
            let new = sums([0, 1, 2].map(|k| responses[k * self.len + i]));
            (0..3).for_each(|k| responses[k * self.len + i] = new[k]);
        }
    }

    /// Returns whether its robot has six velocities, and J columns for all of them.
    #[inline(always)]
    pub fn moves_six(&self) -> bool {
        self.len == 6 && self.spans[MAX_SPANS - 1].len == 6
    }

    /// Adds J qd to the sums of each row, separately for even and odd columns.
    ///
    /// Always inlined, as is [`apply_impulse`](Self::apply_impulse): sweeps consist of these two.
    #[inline(always)]
    pub(super) fn add_velocities(&self, blocks: &[f64], velocities: &[f64], sums: &mut [[f64; 2]; 3]) {
        let own = &velocities[self.first..self.first + self.len];
        // Single free bodies are frequent: with a known length this is three times as fast.
        if let (Some((jacobian, _)), Some(own)) = (self.single(blocks), own.first_chunk::<6>()) {
            add_products(jacobian, own, sums);
            return;
        }
        for (span, part) in self.parts(blocks) {
            add_products(part, &own[span], sums);
        }
    }

    /// Computes qd += M^-1 J' impulse.
    #[inline(always)]
    pub(super) fn apply_impulse(&self, blocks: &[f64], impulse: [f64; 3], velocities: &mut [f64]) {
        let own = &mut velocities[self.first..self.first + self.len];
        if let (Some((_, [n, t, u])), Some(own)) = (self.single(blocks), own.first_chunk_mut::<6>()) {
            for i in 0..6 {
                own[i] += n[i] * impulse[0] + t[i] * impulse[1] + u[i] * impulse[2];
            }
            return;
        }
        let [n, t, u] = self.responses(blocks);
        for (((velocity, n), t), u) in own.iter_mut().zip(n).zip(t).zip(u) {
            *velocity += n * impulse[0] + t * impulse[1] + u * impulse[2];
        }
    }

    /// Returns J M^-1 J' of this side: J times each of its three responses.
    #[inline(always)]
    pub(super) fn effects(&self, blocks: &[f64]) -> [[f64; 3]; 3] {
        let responses = match self.single(blocks) {
            Some((_, [n, t, u])) => [&n[..], t, u],
            None => self.responses(blocks),
        };
        let own = Self { first: 0, ..*self };
        let mut effects = [[0.0; 3]; 3];
        // No closure: code that is not inlined is compiled for any processor.
        for (effects, response) in effects.iter_mut().zip(responses) {
            let mut sums = [[0.0; 2]; 3];
            own.add_velocities(blocks, response, &mut sums);
            for (effect, [even, odd]) in effects.iter_mut().zip(sums) {
                *effect = even + odd;
            }
        }
        effects
    }
}

/// Columns of J for velocities of one span.
#[derive(Clone, Copy, Debug)]
pub struct Columns {
    /// Offset of the span's numbers.
    at: usize,
    /// Length of the span; 0 if J has no columns for it.
    len: usize,
    /// Column of the first of these velocities.
    first: usize,
}

impl Columns {
    /// Returns the location of the velocity at this offset: normal and two tangents.
    #[inline(always)]
    fn get(&self, offset: usize) -> Option<[usize; 3]> {
        let Self { at, len, first } = *self;
        let column = first + offset;
        let pair = at + 6 * (column / 2);
        let is_last_alone = len % 2 == 1 && column + 1 == len;
        let numbers = if is_last_alone {
            [pair, pair + 1, pair + 2]
        } else {
            let number = pair + column % 2;
            [number, number + 2, number + 4]
        };
        (column < len).then_some(numbers)
    }

    /// Adds the first three of four numbers to the columns of the velocity at this offset.
    #[inline(always)]
    pub fn add(&self, offset: usize, numbers: &[f64; 4], jacobian: &mut [f64]) {
        if let Some([n, t, u]) = self.get(offset) {
            jacobian[n] += numbers[0];
            jacobian[t] += numbers[1];
            jacobian[u] += numbers[2];
        }
    }
}

/// Adds a part of J times its velocities; fast if the length is known.
#[inline(always)]
fn add_products(part: &[f64], velocities: &[f64], sums: &mut [[f64; 2]; 3]) {
    let ((pairs, last), (twos, last_velocity)) = (part.as_chunks::<6>(), velocities.as_chunks::<2>());
    for (j, velocity) in pairs.iter().zip(twos) {
        for k in 0..3 {
            sums[k][0] += j[2 * k] * velocity[0];
            sums[k][1] += j[2 * k + 1] * velocity[1];
        }
    }
    if let ([n, t, u], [velocity]) = (last, last_velocity) {
        sums[0][0] += n * velocity;
        sums[1][0] += t * velocity;
        sums[2][0] += u * velocity;
    }
}

/// Adds the transpose of a part of J times three factors; fast if the length is known.
#[inline(always)]
pub fn add_transposed(sums: &mut [f64], part: &[f64], factors: [f64; 3]) {
    let ((pairs, last), (twos, last_sum)) = (part.as_chunks::<6>(), sums.as_chunks_mut::<2>());
    for (sum, j) in twos.iter_mut().zip(pairs) {
        for l in 0..2 {
            sum[l] += j[l] * factors[0] + j[2 + l] * factors[1] + j[4 + l] * factors[2];
        }
    }
    if let ([n, t, u], [sum]) = (last, last_sum) {
        *sum += n * factors[0] + t * factors[1] + u * factors[2];
    }
}
