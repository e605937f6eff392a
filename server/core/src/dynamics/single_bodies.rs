//! Sweeps over the contacts of single bodies, several contacts at once.
//!
//! Contacts that share no body can be solved at the same time. Each comes after the earlier contacts that
//! share a body with it. It therefore finds the velocities of the serial order, and has the bits of
//! [`ContactRows::solve`] for all finite numbers. The same holds for [`Momentum`] between sweeps.

mod batches;
mod correction;
#[cfg(test)]
mod tests;

use glamx::{DMat3, DVec3};
use pulp::{Simd, WithSimd};

use self::batches::{Batches, Layout};
use crate::dynamics::constraint::contact::ContactRows;
use crate::dynamics::constraint::contact_law::Resistance;
use crate::dynamics::constraint::momentum::Momentum;
use crate::dynamics::lane::number::Lanes;
use crate::dynamics::lane::vectorized;
use crate::dynamics::real::{MaskOf as _, Real as _};
use crate::dynamics::tree::SingleBody;

/// Number of velocities of a body.
const SIX: usize = 6;

/// Number of lanes of the widest vectors.
const MAX_LANES: usize = 8;

/// Minimum number of contacts; fewer would hardly fill the batches.
const LEAST: usize = 32;

/// Memory of the sweeps.
#[derive(Debug, Default)]
pub struct SingleBodies {
    /// Bodies in the order of their velocities.
    bodies: Vec<SingleBody>,
    batches: Batches,
    /// Numbers of each batch: each number in all lanes.
    numbers: Vec<f64>,
    /// Contents of the numbers.
    loaded: Loaded,
    /// Velocity and impulse of position correction, for each lane of each batch.
    split: Vec<f64>,
}

/// Contents of the batches' numbers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum Loaded {
    /// No present contacts.
    #[default]
    Nothing,
    /// Contacts of bodies with equal resistance to turning about any axis.
    Alike,
    /// Contacts of other bodies.
    Any,
}

impl SingleBodies {
    /// Discards the contacts: there are others.
    pub fn begin(&mut self) {
        self.loaded = Loaded::Nothing;
    }

    /// Returns whether all robots are single bodies whose frames are at their centres of mass; stores their
    /// inertias.
    pub fn take(&mut self, bodies: impl Iterator<Item = Option<SingleBody>>) -> bool {
        self.begin();
        self.bodies.clear();
        for body in bodies {
            match body {
                Some(body) if body.center == DVec3::ZERO => self.bodies.push(body),
                _ => return false,
            }
        }
        true
    }

    /// Sweeps over contacts of the taken bodies, with momentum that has begun. It ends after `most` sweeps,
    /// or when no impulse changes its own velocity by more than `settled`, m/s.
    ///
    /// Returns `None`, and does nothing, if solving several contacts at once does not pay off. The same holds
    /// if J or M^-1 J' depends on more than the bodies. Returns false if interrupted.
    pub fn sweep(
        &mut self,
        (rows, blocks): (&mut [ContactRows], &[f64]),
        (velocities, momentum): (&mut Vec<f64>, &mut Momentum),
        (most, settled): (usize, f64),
        interrupt: &dyn Fn() -> bool,
    ) -> Option<bool> {
        if rows.len() < LEAST {
            return None;
        }
        let sweeps = Sweeps { memory: self, rows, blocks, velocities, momentum, most, settled, interrupt };
        vectorized(usize::MAX, sweeps).ok().flatten()
    }
}

/// [`SingleBodies::sweep`], compiled for the vectors of the processor.
struct Sweeps<'a> {
    memory: &'a mut SingleBodies,
    rows: &'a mut [ContactRows],
    blocks: &'a [f64],
    velocities: &'a mut Vec<f64>,
    momentum: &'a mut Momentum,
    most: usize,
    settled: f64,
    interrupt: &'a dyn Fn() -> bool,
}

impl WithSimd for Sweeps<'_> {
    type Output = Option<bool>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Option<bool> {
        let (width, given) = (S::F64_LANES, (&*self.rows, self.blocks));
        let SingleBodies { bodies, batches, numbers, loaded, .. } = &mut *self.memory;
        if !(2..=MAX_LANES).contains(&width) || !batches.fill(self.rows, bodies.len(), width) {
            return None;
        }
        if bodies.iter().all(is_alike) && batches.load::<true>(given, bodies, width, numbers) {
            *loaded = Loaded::Alike;
            Some(self.sweep::<S, true>(simd))
        } else if batches.load::<false>(given, bodies, width, numbers) {
            *loaded = Loaded::Any;
            Some(self.sweep::<S, false>(simd))
        } else {
            None
        }
    }
}

impl Sweeps<'_> {
    /// Sweeps, once numbers are loaded.
    #[inline(always)]
    fn sweep<S: Simd, const ALIKE: bool>(self, simd: S) -> bool {
        let Self { memory, rows, velocities, momentum, most, settled, interrupt, .. } = self;
        let SingleBodies { batches, numbers, .. } = memory;
        // Velocities of immovable bodies.
        let moving = velocities.len();
        velocities.resize(moving + SIX, 0.0);
        let mut is_whole = true;
        for sweep in 0..most {
            if interrupt() {
                is_whole = false;
                break;
            }
            let part = momentum.carry(&mut velocities[..moving], sweep + 1 == most);
            let of_batches = numbers.chunks_exact_mut(Layout::<ALIKE>::COUNT * S::F64_LANES);
            let mut largest = Lanes::broadcast(simd, 0.0);
            for (numbers, sides) in of_batches.zip(batches.sides.chunks_exact(S::F64_LANES)) {
                largest = largest.max(solve::<S, ALIKE>(simd, numbers, sides, velocities, part));
            }
            let mut change = 0.0f64;
            for of_lane in largest.all() {
                change = change.max(*of_lane);
            }
            if change <= settled {
                break;
            }
            momentum.note(change);
        }
        velocities.truncate(moving);
        batches.give_back::<ALIKE>(numbers, S::F64_LANES, rows);
        is_whole
    }
}

/// Returns whether its resistance to turning is equal about any axis.
fn is_alike(body: &SingleBody) -> bool {
    let moment = body.inverse_moment;
    moment == DMat3::from_diagonal(DVec3::splat(moment.x_axis.x))
}

/// [`ContactRows::solve`] for a contact in each lane, after its impulse is extrapolated by a part. Returns
/// the largest change of a velocity, m/s.
#[inline(always)]
#[allow(clippy::needless_range_loop, reason = "reads as the rows do")]
fn solve<S: Simd, const ALIKE: bool>(
    simd: S,
    numbers: &mut [f64],
    sides: &[[usize; 2]],
    velocities: &mut [f64],
    part: f64,
) -> Lanes<S> {
    let zero = Lanes::broadcast(simd, 0.0);
    let width = S::F64_LANES;
    let (given, impulses) = numbers.split_at_mut(Layout::<ALIKE>::IMPULSE * width);
    let number = Numbers { simd, numbers: given };
    let mut own = [[zero; SIX]; 2];
    let mut sums = [[zero; 2]; 3];
    for (side, own) in own.iter_mut().enumerate() {
        gather(own, sides, side, velocities);
        for i in 0..SIX {
            for k in 0..3 {
                let sum = &mut sums[k][i % 2];
                if i >= 3 {
                    *sum += number.get(Layout::<ALIKE>::side(side) + 3 * k + i - 3) * own[i];
                } else if side == 0 {
                    *sum -= number.get(3 * k + i) * own[i];
                } else {
                    *sum += number.get(3 * k + i) * own[i];
                }
            }
        }
    }
    let [n, t, u] = sums;
    let aim = Layout::<ALIKE>::AIM;
    let (target, drift_t, drift_u) = (number.get(aim), number.get(aim + 1), number.get(aim + 2));
    let (compliance, friction, gradient_step) =
        (number.get(aim + 3), number.get(aim + 4), number.get(aim + 5));
    let velocity = [n[0] + n[1], t[0] + t[1] - drift_t, u[0] + u[1] - drift_u];
    let effect = Layout::<ALIKE>::EFFECT;
    let (nn, nt, nu) = (number.get(effect), number.get(effect + 1), number.get(effect + 2));
    let (tt, uu) = (number.get(effect + 3), number.get(effect + 4));
    let inverse = Layout::<ALIKE>::INVERSE;
    let (a, b, c) = (number.get(inverse), number.get(inverse + 1), number.get(inverse + 2));
    let part = Lanes::broadcast(simd, part);
    let mut carried = [zero; 3];
    for k in 0..3 {
        let kept = Numbers { simd, numbers: impulses };
        let (now, before) = (kept.get(k), kept.get(3 + k));
        carried[k] = now + part * (now - before);
        write(now, &mut impulses[(3 + k) * width..][..width]);
    }
    let [n0, t0, u0] = carried;

    let resistance =
        Resistance { normal: nn + compliance, coupling: [nt, nu], inverse: [a, b, c], gradient_step };
    let left = target - velocity[0] - compliance * n0;
    let [normal, t, u] = resistance.next(carried, friction, [left, velocity[1], velocity[2]]);
    let (dn, dt, du) = (normal - n0, t - t0, u - u0);
    write(normal, &mut impulses[..width]);
    write(t, &mut impulses[width..2 * width]);
    write(u, &mut impulses[2 * width..3 * width]);

    let moves = !(dn.equals(zero) & dt.equals(zero) & du.equals(zero));
    if !moves.any() {
        return zero;
    }
    for (side, own) in own.iter_mut().enumerate() {
        let first = Layout::<ALIKE>::side(side);
        let mass = number.get(first + Layout::<ALIKE>::MASS);
        for i in 0..3 {
            let (n, t, u) = (number.get(i) * mass, number.get(3 + i) * mass, number.get(6 + i) * mass);
            own[i] = moves.select(own[i] + (n * dn + t * dt + u * du), own[i]);
        }
        for i in 0..3 {
            let at = if ALIKE { first + i } else { first + Layout::<ALIKE>::TURNS + i };
            let (mut n, mut t, mut u) = (number.get(at), number.get(at + 3), number.get(at + 6));
            if ALIKE {
                let turn = number.get(first + Layout::<ALIKE>::TURNS);
                // The product with a matrix has sums, which turn -0 into 0.
                (n, t, u) = (n * turn + zero, t * turn + zero, u * turn + zero);
            }
            own[3 + i] = moves.select(own[3 + i] + (n * dn + t * dt + u * du), own[3 + i]);
        }
        scatter(own, sides, side, velocities);
    }
    // No `abs`: it is not inlined here.
    let (n, t, u) = (dn * nn, dt * tt, du * uu);
    let largest = n.max(zero - n).max(t.max(zero - t)).max(u.max(zero - u));
    moves.select(largest, zero)
}

/// Reads the velocities of a side's bodies.
#[inline(always)]
#[allow(clippy::needless_range_loop, reason = "lane by lane")]
fn gather<S: Simd>(own: &mut [Lanes<S>; SIX], sides: &[[usize; 2]], side: usize, velocities: &[f64]) {
    let mut sixes = [&[0.0; SIX]; MAX_LANES];
    for lane in 0..S::F64_LANES {
        if let Some(six) = velocities[sides[lane][side]..].first_chunk() {
            sixes[lane] = six;
        }
    }
    for i in 0..SIX {
        for lane in 0..S::F64_LANES {
            own[i].set(lane, sixes[lane][i]);
        }
    }
}

/// Writes the velocities of a side's bodies.
#[inline(always)]
#[allow(clippy::needless_range_loop, reason = "lane by lane")]
fn scatter<S: Simd>(own: &[Lanes<S>; SIX], sides: &[[usize; 2]], side: usize, velocities: &mut [f64]) {
    for lane in 0..S::F64_LANES {
        if let Some(six) = velocities[sides[lane][side]..].first_chunk_mut::<SIX>() {
            for i in 0..SIX {
                six[i] = own[i].get(lane);
            }
        }
    }
}

/// Numbers of a batch.
struct Numbers<'a, S> {
    simd: S,
    numbers: &'a [f64],
}

impl<S: Simd> Numbers<'_, S> {
    #[inline(always)]
    fn get(&self, index: usize) -> Lanes<S> {
        let mut lanes = Lanes::broadcast(self.simd, 0.0);
        lanes.all_mut().copy_from_slice(&self.numbers[index * S::F64_LANES..][..S::F64_LANES]);
        lanes
    }
}

#[inline(always)]
fn write<S: Simd>(lanes: Lanes<S>, to: &mut [f64]) {
    to.copy_from_slice(lanes.all());
}
