//! Threads that the owner of a world lends it. The core makes none: it says what may be done at the same time.

use std::fmt::Debug;

/// Threads that are lent to a world. What a step finds does not depend on them, to the bit.
pub trait Pool: Debug + Send + Sync {
    /// Does both, the second on another thread if one is free, and returns when both are done. A panic of either is passed on.
    fn join(&self, first: &mut (dyn FnMut() + Send), second: &mut (dyn FnMut() + Send));

    /// Does `work` on this thread, in which there are several turns of [`Pool::join`] that soon follow each other: other threads
    /// do not fall asleep between them, since waking one takes about as long as what it could do meanwhile.
    fn keep_awake(&self, work: &mut (dyn FnMut() + Send));

    /// The number of the thread that asks, from 0. Pieces of work that a thread does one after the other have the same memory, which
    /// is in that thread's cache.
    fn thread(&self) -> usize;
}

/// Says when a step is to be given up. It is asked on all threads that work for the step.
pub type Interrupt<'a> = dyn Fn() -> bool + Sync + 'a;

/// So many pieces is work divided into where there is a pool: enough that threads end at nearly the same time.
pub(crate) const PIECES: usize = 16;

/// Does `work` for each of the items that `which` names, in order: `first` is the number of the first item. On a pool in so many
/// pieces.
pub(crate) fn for_each<T: Send>(
    (pool, pieces): (Option<&dyn Pool>, usize),
    (items, first): (&mut [T], usize),
    which: &[usize],
    work: &(dyn Fn(&mut T) + Sync),
) {
    let (left, right) = which.split_at(which.len() / 2);
    match (pool, right.first()) {
        (Some(pool), Some(&middle)) if pieces > 1 && !left.is_empty() => {
            let (before, after) = items.split_at_mut(middle - first);
            let half = (Some(pool), pieces / 2);
            pool.join(&mut || for_each(half, (before, first), left, work), &mut || {
                for_each(half, (after, middle), right, work)
            });
        }
        _ => which.iter().for_each(|&number| work(&mut items[number - first])),
    }
}
