//! Position correction of contacts, several at once, with the bits of [`ContactRows::correct_position`] for
//! all finite numbers.

use pulp::{Simd, WithSimd};

use super::batches::Layout;
use super::{Loaded, Numbers, SIX, SingleBodies, gather, scatter, write};
use crate::dynamics::constraint::contact::ContactRows;
use crate::dynamics::lane::number::Lanes;
use crate::dynamics::lane::vectorized;
use crate::dynamics::real::{MaskOf as _, Real as _};

impl SingleBodies {
    /// Does `sweeps` sweeps over the contacts that were [swept](SingleBodies::sweep) last, and adds their
    /// split impulses to velocities that begin at 0. Returns false, and does nothing, if they were not swept
    /// at once.
    pub fn correct(&mut self, rows: &[ContactRows], split_velocities: &mut Vec<f64>, sweeps: usize) -> bool {
        self.loaded != Loaded::Nothing
            && vectorized(usize::MAX, Corrects { memory: self, rows, split_velocities, sweeps }).is_ok()
    }
}

/// [`SingleBodies::correct`], compiled for the vectors of the processor.
struct Corrects<'a> {
    memory: &'a mut SingleBodies,
    rows: &'a [ContactRows],
    split_velocities: &'a mut Vec<f64>,
    sweeps: usize,
}

impl WithSimd for Corrects<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        if self.memory.loaded == Loaded::Alike {
            self.correct::<S, true>(simd);
        } else {
            self.correct::<S, false>(simd);
        }
    }
}

impl Corrects<'_> {
    #[inline(always)]
    fn correct<S: Simd, const ALIKE: bool>(self, simd: S) {
        let Self { memory: SingleBodies { batches, numbers, split, .. }, rows, split_velocities, sweeps } =
            self;
        let width = S::F64_LANES;
        batches.load_split(rows, width, split);
        let moving = split_velocities.len();
        // Velocities of immovable bodies.
        split_velocities.resize(moving + SIX, 0.0);
        for _ in 0..sweeps {
            let of_batches = numbers.chunks_exact(Layout::<ALIKE>::COUNT * width);
            let with_split = of_batches.zip(split.chunks_exact_mut(2 * width));
            for ((numbers, split), sides) in with_split.zip(batches.sides.chunks_exact(width)) {
                correct::<S, ALIKE>(Numbers { simd, numbers }, split, sides, split_velocities);
            }
        }
        split_velocities.truncate(moving);
    }
}

/// [`ContactRows::correct_position`] for a contact in each lane.
#[inline(always)]
fn correct<S: Simd, const ALIKE: bool>(
    number: Numbers<'_, S>,
    split: &mut [f64],
    sides: &[[usize; 2]],
    velocities: &mut [f64],
) {
    let simd = number.simd;
    let zero = Lanes::broadcast(simd, 0.0);
    let mut own = [[zero; SIX]; 2];
    // Sums of even and of odd velocities.
    let mut sums = [zero; 2];
    for (side, own) in own.iter_mut().enumerate() {
        gather(own, sides, side, velocities);
        for i in 0..SIX {
            let sum = &mut sums[i % 2];
            if i >= 3 {
                *sum += number.get(Layout::<ALIKE>::side(side) + i - 3) * own[i];
            } else if side == 0 {
                *sum -= number.get(i) * own[i];
            } else {
                *sum += number.get(i) * own[i];
            }
        }
    }
    let kept = Numbers { simd, numbers: split };
    let (aim, before) = (kept.get(0), kept.get(1));
    let left = (aim - (sums[0] + sums[1])) / number.get(Layout::<ALIKE>::EFFECT);
    let impulse = (before + left).max(zero);
    let change = impulse - before;
    let moves = !change.equals(zero);
    if !moves.any() {
        return;
    }
    write(moves.select(impulse, before), &mut split[S::F64_LANES..]);
    for (side, own) in own.iter_mut().enumerate() {
        let first = Layout::<ALIKE>::side(side);
        let mass = number.get(first + Layout::<ALIKE>::MASS);
        for i in 0..3 {
            let turned = if ALIKE {
                number.get(first + i) * number.get(first + Layout::<ALIKE>::TURNS) + zero
            } else {
                number.get(first + Layout::<ALIKE>::TURNS + i)
            };
            own[i] = moves.select(own[i] + number.get(i) * mass * change, own[i]);
            own[3 + i] = moves.select(own[3 + i] + turned * change, own[3 + i]);
        }
        scatter(own, sides, side, velocities);
    }
}
