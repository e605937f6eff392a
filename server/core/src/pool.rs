//! Threads that the owner of a world lends it. The core starts none; it says which work may run in parallel.

use std::fmt::Debug;

/// Threads that are lent to a world. The results of a step do not depend on them, to the bit.
pub trait Pool: Debug + Send + Sync {
    /// Runs both closures, the second on another thread if one is free, and returns when both are done.
    /// Propagates a panic of either.
    fn join(&self, first: &mut (dyn FnMut() + Send), second: &mut (dyn FnMut() + Send));

    /// Runs `work` on this thread. It calls [`Pool::join`] several times in short succession. Other threads
    /// stay awake between these calls, since waking one takes about as long as the work that it could do.
    fn keep_awake(&self, work: &mut (dyn FnMut() + Send));

    /// Returns the number of the calling thread, from 0. Pieces of work that run on one thread in turn share
    /// memory, which is in that thread's cache.
    fn thread(&self) -> usize;
}

/// Returns whether to give up the step. All threads of the step call it.
pub type Interrupt<'a> = dyn Fn() -> bool + Sync + 'a;

/// Number of pieces that work is divided into on a pool: enough that threads end at nearly the same time.
pub(crate) const PIECES: usize = 16;

/// Threads for some work, and the number of pieces that it is divided into.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Division<'p> {
    /// Without it, the work is done on this thread.
    pub(crate) pool: Option<&'p dyn Pool>,
    /// Number of pieces.
    pub(crate) pieces: usize,
}

impl Division<'_> {
    /// Returns the division of half of the work.
    pub(crate) fn half(self) -> Self {
        Self { pieces: self.pieces / 2, ..self }
    }
}

/// Calls `work` for each item that `which` names, in order. `first` is the number of the first item.
pub(crate) fn for_each<T: Send>(
    division: Division<'_>,
    (items, first): (&mut [T], usize),
    which: &[usize],
    work: &(dyn Fn(&mut T) + Sync),
) {
    let (left, right) = which.split_at(which.len() / 2);
    match (division.pool, right.first()) {
        (Some(pool), Some(&middle)) if division.pieces > 1 && !left.is_empty() => {
            let (before, after) = items.split_at_mut(middle - first);
            let half = division.half();
            pool.join(&mut || for_each(half, (before, first), left, work), &mut || {
                for_each(half, (after, middle), right, work)
            });
        }
        _ => which.iter().for_each(|&number| work(&mut items[number - first])),
    }
}
