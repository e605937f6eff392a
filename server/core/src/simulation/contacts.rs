//! Contacts of a world: found again in each part of a step, with the impulses of the previous part.

mod check;
mod faces;
mod inherit;

use std::sync::Arc;

pub(super) use check::{check_ignored_overlaps, check_pairs, complete};
use inherit::PreviousContacts;

use super::constraints::ExcludedLinks;
use super::entity::Entity;
use super::sleep::Busy;
use super::world_state::Pair;
use crate::collision::{
    BroadPhase, ContactPoint, Filter, FixedPair, NarrowPhase, RobotColliders, RobotLinkPair,
    SurfaceCombination,
};
use crate::dynamics::bullet;
use crate::dynamics::constraint::contact::Contact;
use crate::pool::{Interrupt, PIECES, Pool};

/// Number of colliders below which dividing the pairs takes longer than searching them.
const WORTH_THREADS: usize = 256;

/// Number of pairs that are prefetched at once. The first robot of a pair mostly is the previous pair's.
const PREFETCHED: usize = 8;

/// Contacts of a world, in the order of their robots and colliders.
#[derive(Debug, Default)]
pub(super) struct Contacts {
    pub(super) list: Vec<Contact>,
    /// Enabled and disabled pairs of links of different robots, in order.
    pub(super) collision_pairs: Arc<Vec<RobotLinkPair>>,
    before: Vec<Contact>,
    /// Robots near each other that motion may be unable to separate, in order. Their initial overlaps are
    /// ignored until the colliders have separated.
    fixed: Vec<FixedPair>,
    fixed_before: Vec<FixedPair>,
    broad: BroadPhase,
    /// Searches, one for each piece of the pairs.
    searches: Vec<Search>,
}

/// Results for some consecutive pairs of robots.
#[derive(Debug, Default)]
struct Search {
    narrow: NarrowPhase,
    found: Vec<Contact>,
    fixed: Vec<FixedPair>,
}

/// Options of the search.
#[derive(Clone, Copy)]
pub(super) struct SearchOptions {
    /// Minimum distance from moving robots within which contacts are looked for, metres.
    pub(super) slack: f64,
    /// Combination of touching surfaces.
    pub(super) combination: SurfaceCombination,
    /// Whether a step begins, and with it the sums of impulses.
    pub(super) begins: bool,
    /// Whether points are contacts only within [Bullet's distance](bullet::within).
    pub(super) is_bullets: bool,
}

/// Input of the search.
#[derive(Clone, Copy)]
struct Among<'a> {
    robots: &'a [Entity],
    excluded: &'a [ExcludedLinks],
    collision_pairs: &'a [RobotLinkPair],
    before: &'a [Contact],
    options: SearchOptions,
    interrupt: &'a Interrupt<'a>,
}

/// Returns whether a constraint disables collisions between links.
fn is_excluded(excluded: &[ExcludedLinks], robots: [usize; 2], links: [usize; 2]) -> bool {
    let is_swapped = robots[0] == robots[1] && links[0] > links[1];
    let links = if is_swapped { [links[1], links[0]] } else { links };
    excluded.binary_search(&(robots, links)).is_ok()
}

/// Returns the sort key of a contact.
fn key(contact: &Contact) -> Pair {
    (contact.robots, contact.point.colliders)
}

impl Contacts {
    /// Keeps forces constant if steps and their parts become longer by these factors.
    pub(super) fn stretch(&mut self, step: f64, part: f64) {
        for contact in &mut self.list {
            contact.total *= step;
            contact.impulse *= part;
            contact.turning_impulse *= part;
        }
    }

    /// Finds the contacts of robots whose colliders are placed. Returns false if interrupted. Contacts
    /// between `excluded` links are left out, and contacts of robots whose pose a part of a step has made not
    /// finite.
    ///
    /// Some overlaps are ignored until the links have separated: those between links of one robot, or of two
    /// robots that are fixed to the world. The overlap must exist right after a teleport of one of them. A
    /// user may load two arms at the origin, or an arm whose first link reaches into the table. No joint
    /// motion ends such an overlap, and contact forces would only make the robots shake.
    pub(super) fn find(
        &mut self,
        robots: &[Entity],
        busy: &Busy,
        excluded: &[ExcludedLinks],
        options: SearchOptions,
        pool: Option<&dyn Pool>,
        interrupt: &Interrupt<'_>,
    ) -> bool {
        std::mem::swap(&mut self.list, &mut self.before);
        std::mem::swap(&mut self.fixed, &mut self.fixed_before);
        let Self { list, collision_pairs, before, fixed, fixed_before, broad, searches } = self;
        fixed.clear();
        if busy.shaped().is_empty() && busy.leaves_some() {
            // Robots with shapes cannot move, and are unchanged.
            list.clear();
            fixed_before.clear();
            searches.iter_mut().for_each(|search| search.begin(options.combination));
            return true;
        }
        let mut is_any_asleep = false;
        let finite = busy.shaped().iter().filter(|robot| robots[**robot].colliders.are_finite());
        let present = finite.map(|&index| {
            let robot = &robots[index];
            is_any_asleep |= robot.state.asleep;
            (index, &robot.colliders, robot.is_awake())
        });
        let pairs = broad.pairs(present, busy.leaves_some());
        let mut colliders = 0;
        let pool = pool.filter(|_| {
            pairs.iter().any(|pair| {
                colliders += pair.map(|robot| robots[robot].colliders.len()).iter().sum::<usize>();
                colliders >= WORTH_THREADS
            })
        });
        let count = if pool.is_some() { PIECES } else { 1 };
        if searches.len() < count {
            searches.resize_with(count, Search::default);
        }
        searches.iter_mut().for_each(|search| search.begin(options.combination));
        let among = Among { robots, excluded, collision_pairs, before, options, interrupt };
        let searches = &mut searches[..count];
        if !among.search(pool, searches, pairs, fixed_before) {
            return false;
        }
        fixed_before.clear();
        searches.iter_mut().for_each(|search| fixed.append(&mut search.fixed));
        // Results are in order, since pairs are. They are large, so they are moved at most once.
        match searches {
            [search] if !is_any_asleep => {
                std::mem::swap(list, &mut search.found);
                // So that each of the two lists can take as many contacts the next time.
                search.found.clear();
                search.found.reserve_exact(list.capacity());
            }
            _ if !is_any_asleep => {
                let count = searches.iter().map(|search| search.found.len()).sum();
                match searches.iter().find_map(|search| search.found.first()) {
                    Some(any) => list.resize(count, *any),
                    None => list.clear(),
                }
                put_in_order(pool, searches, list);
            }
            _ => {
                list.clear();
                // Sleeping robots have not moved: their contacts are unchanged.
                let asleep = |contact: &&Contact| {
                    let [a, b] = contact.robots.map(|robot| &robots[robot]);
                    a.is_active() && b.is_active() && !a.is_awake() && !b.is_awake()
                };
                let found = searches.iter().flat_map(|search| &search.found);
                merge(found, before.iter().filter(asleep), list);
            }
        }
        true
    }

    /// Returns the number of pairs of colliders whose bounds were compared in the last search.
    pub(super) fn compared(&self) -> u64 {
        self.searches.iter().map(|search| search.narrow.compared).sum()
    }

    /// Returns the ignored initial overlaps, in order.
    pub(super) fn ignored_overlaps(&self) -> impl Iterator<Item = Pair> + '_ {
        self.fixed.iter().flat_map(|fixed| fixed.ignored.iter().map(|&colliders| (fixed.robots, colliders)))
    }

    /// Drops contacts that are no longer allowed; call it when the collision filter has changed.
    pub(super) fn filter_changed(&mut self, robots: &[Entity]) {
        let pairs = &self.collision_pairs;
        self.list.retain(|contact| {
            let ([a, b], [i, j]) = key(contact);
            let [first, second] = [&robots[a].colliders, &robots[b].colliders];
            if a == b {
                first.may_self_collide([i, j])
            } else {
                first.may_touch(i, second, j, Filter::between([a, b], pairs))
            }
        });
        self.fixed.iter_mut().for_each(FixedPair::forget_distances);
    }

    /// Removes contacts between excluded links.
    pub(super) fn forget_excluded(&mut self, excluded: &[ExcludedLinks]) {
        self.list.retain(|contact| !is_excluded(excluded, contact.robots, contact.point.links));
    }

    /// Replaces the contacts and the ignored overlaps by another state's.
    pub(super) fn replace(&mut self, list: Vec<Contact>, ignored_overlaps: &[Pair]) {
        self.list = list;
        let of = |pairs: &[Pair]| FixedPair::new(pairs[0].0, pairs.iter().map(|pair| pair.1).collect());
        self.fixed = ignored_overlaps.chunk_by(|a, b| a.0 == b.0).map(of).collect();
    }

    /// Removes the contacts of a robot.
    pub(super) fn forget(&mut self, robot: usize) {
        self.list.retain(|contact| !contact.robots.contains(&robot));
        self.fixed.retain(|fixed| !fixed.robots.contains(&robot));
    }

    /// Removes the robot at this index; later ones move up.
    pub(super) fn remove(&mut self, robot: usize) {
        self.forget(robot);
        let touching = self.list.iter_mut().flat_map(|contact| &mut contact.robots);
        for index in touching.chain(self.fixed.iter_mut().flat_map(|fixed| &mut fixed.robots)) {
            *index -= usize::from(*index > robot);
        }
        self.keep_pairs(|index| (index != robot).then_some(index - usize::from(index > robot)));
    }

    /// Changes the indices of robots of collision pairs; pairs of robots without a new index are dropped. The
    /// order stays.
    pub(super) fn keep_pairs(&mut self, index: impl Fn(usize) -> Option<usize>) {
        if self.collision_pairs.is_empty() {
            return;
        }
        Arc::make_mut(&mut self.collision_pairs).retain_mut(|pair| {
            let [a, b] = pair.robots.map(&index);
            a.zip(b).is_some_and(|(a, b)| {
                pair.robots = [a, b];
                true
            })
        });
    }
}

impl Among<'_> {
    /// Searches pairs, which are in order. Uses the known data of pairs that are fixed to each other, in
    /// order too. Returns false if interrupted.
    fn search(
        self,
        pool: Option<&dyn Pool>,
        searches: &mut [Search],
        pairs: &[[usize; 2]],
        known: &mut [FixedPair],
    ) -> bool {
        let (first, second) = searches.split_at_mut(searches.len() / 2);
        let (before, after) = pairs.split_at(pairs.len() / 2);
        if let (Some(pool), Some(middle), false) = (pool, after.first(), first.is_empty()) {
            let (known_before, known_after) =
                known.split_at_mut(known.partition_point(|known| known.robots < *middle));
            let mut are_whole = [true; 2];
            let [a, b] = &mut are_whole;
            pool.join(&mut || *a = self.search(Some(pool), first, before, known_before), &mut || {
                *b = self.search(Some(pool), second, after, known_after)
            });
            return are_whole == [true; 2];
        }
        second.first_mut().is_none_or(|search| search.look(self, pairs, known))
    }
}

impl Search {
    fn begin(&mut self, combination: SurfaceCombination) {
        self.narrow.combination = combination;
        self.found.clear();
        self.fixed.clear();
        self.narrow.compared = 0;
    }

    /// Finds the contacts of these pairs, in their order, and copies their previous data. Returns false if
    /// interrupted.
    fn look(&mut self, among: Among<'_>, pairs: &[[usize; 2]], known: &mut [FixedPair]) -> bool {
        let Among { robots, excluded, collision_pairs, before, options, interrupt } = among;
        let SearchOptions { slack, begins, is_bullets, .. } = options;
        let Self { narrow, found: list, fixed } = self;
        let mut known = known.iter_mut().peekable();
        let mut previous = PreviousContacts::new(before, begins);
        for (index, &pair) in pairs.iter().enumerate() {
            if index % PREFETCHED == 0 {
                pairs[index..]
                    .iter()
                    .take(PREFETCHED)
                    .for_each(|&[_, second]| robots[second].colliders.prefetch());
            }
            if interrupt() {
                return false;
            }
            let [a, b] = pair.map(|robot| &robots[robot]);
            let colliders = [&a.colliders, &b.colliders];
            let filter = Filter::between(pair, collision_pairs);
            let first = list.len();
            let found = |point: ContactPoint| {
                if !excluded.is_empty() && is_excluded(excluded, pair, point.links) {
                    return;
                }
                if is_bullets && point.distance > bullet::within(sizes(colliders, point.colliders)) {
                    return;
                }
                list.push(Contact::new(pair, point));
            };
            if pair[0] != pair[1] && !(a.is_fixed() && b.is_fixed()) {
                if !narrow.between(colliders, filter, interrupt, found) {
                    return false;
                }
            } else {
                // Pairs that are no longer near each other have separated.
                while known.next_if(|known| known.robots < pair).is_some() {}
                let mut known = match known.next_if(|known| known.robots == pair) {
                    Some(known) => std::mem::replace(known, FixedPair::new(pair, Vec::new())),
                    None => FixedPair::new(pair, Vec::new()),
                };
                let teleported = a.state.teleported || b.state.teleported;
                if !narrow.between_fixed(colliders, filter, (teleported, slack), interrupt, &mut known, found)
                {
                    return false;
                }
                fixed.push(known);
            }
            // At once, while they are in the cache.
            if first < list.len() {
                previous.pass_on(&mut list[first..], [a.is_awake(), b.is_awake()]);
            }
        }
        true
    }
}

/// Returns the sizes of two shapes as Bullet measures them.
fn sizes(robots: [&RobotColliders; 2], colliders: [usize; 2]) -> [f64; 2] {
    [0, 1].map(|side| robots[side].half_diagonal(colliders[side]))
}

/// Copies results into the list, on the threads that have found them and have them in their caches.
fn put_in_order(pool: Option<&dyn Pool>, searches: &[Search], list: &mut [Contact]) {
    let (first, second) = searches.split_at(searches.len() / 2);
    match (pool, second) {
        (Some(pool), [_, ..]) if !first.is_empty() => {
            let count = first.iter().map(|search| search.found.len()).sum();
            let (before, after) = list.split_at_mut(count);
            pool.join(&mut || put_in_order(Some(pool), first, before), &mut || {
                put_in_order(Some(pool), second, after)
            });
        }
        _ => {
            let found = searches.iter().flat_map(|search| &search.found);
            list.iter_mut().zip(found).for_each(|(contact, found)| *contact = *found);
        }
    }
}

/// Merges contacts of two kinds, each in order, into an ordered list. No two colliders have contacts of both
/// kinds.
fn merge<'a>(
    found: impl Iterator<Item = &'a Contact>,
    kept: impl Iterator<Item = &'a Contact>,
    list: &mut Vec<Contact>,
) {
    let mut kept = kept.peekable();
    for contact in found {
        while let Some(kept) = kept.next_if(|kept| key(kept) < key(contact)) {
            list.push(*kept);
        }
        list.push(*contact);
    }
    list.extend(kept);
}
