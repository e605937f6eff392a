//! Commands on collision filters: self-collision, groups and masks of links, and pairs of links.

use std::collections::BTreeMap;
use std::sync::Arc;

use crate::collision::{LinkPair, RobotLinkPair};
use crate::dynamics::link_damping::LinkDamping;
use crate::simulation::command::{CollisionFilterChange, CollisionPair, MAX_COLLISION_PAIRS};
use crate::simulation::contacts::Contacts;
use crate::simulation::entity::Entity;
use crate::simulation::error::Error;
use crate::simulation::{Reply, Simulation, check};

/// Indices of two robots, the smaller first, and of a link of each.
type PairKey = ([usize; 2], [usize; 2]);

/// Pairs by their key, and whether they are enabled.
type Pairs<K> = BTreeMap<K, bool>;

impl Simulation {
    pub(in crate::simulation) fn set_collision_filter(
        &mut self,
        change: &CollisionFilterChange,
    ) -> Result<Reply, Error> {
        let CollisionFilterChange { robot, self_collision, pairs } = change;
        let robot_index = self.robot_index(robot)?;
        let (own, others): (Vec<_>, Vec<_>) = pairs
            .iter()
            .enumerate()
            .partition(|(_, pair)| pair.other_robot.is_empty() || pair.other_robot == *robot);
        let own = self.entities[robot_index].switched(own.into_iter(), "pairs")?;
        let mut changed = Vec::new();
        let others = self.switched(robot_index, others.into_iter(), &mut changed)?;
        let entity = &mut self.entities[robot_index];
        let before = entity.state.contact_settings.self_collision;
        let touches_itself = self_collision.unwrap_or(before);
        entity.check_self_collision(touches_itself)?;
        // Nothing is refused from here on.
        if let Some(own) = own {
            if touches_itself && own != *entity.state.collision_pairs {
                changed.push(robot_index);
            }
            entity.state.collision_pairs = Arc::new(own);
        }
        if let Some(others) = others {
            self.contacts.collision_pairs = Arc::new(others);
        }
        entity.state.contact_settings.self_collision = touches_itself;
        if touches_itself != before {
            changed.push(robot_index);
        }
        changed.sort_unstable();
        changed.dedup();
        self.filter_changed(&changed);
        self.settings_changed(robot_index);
        Ok(Reply::Done)
    }

    /// Returns all pairs of links of different robots after a command; `None` if it has none. Adds robots of
    /// changed pairs to `changed`.
    fn switched<'a>(
        &self,
        robot_index: usize,
        asked: impl Iterator<Item = (usize, &'a CollisionPair)>,
        changed: &mut Vec<usize>,
    ) -> Result<Option<Vec<RobotLinkPair>>, Error> {
        let mut asked = asked.peekable();
        if asked.peek().is_none() {
            return Ok(None);
        }
        let known = self.contacts.collision_pairs.iter();
        let mut pairs: Pairs<PairKey> =
            known.map(|of| ((of.robots, of.pair.links), of.pair.enabled)).collect();
        let mut switched: Vec<PairKey> = Vec::new();
        for (index, CollisionPair { link, other_robot, other_link, enabled }) in asked {
            let other_index = self.robot_index(other_robot)?;
            let link = self.entities[robot_index].link(link)?;
            let other = self.entities[other_index].link(other_link)?;
            let mut sides = [(robot_index, link), (other_index, other)];
            sides.sort_unstable();
            let key = (sides.map(|side| side.0), sides.map(|side| side.1));
            switch(&mut pairs, key, *enabled, index)?;
            switched.push(key);
        }
        let before = |key: &PairKey| {
            let known = &self.contacts.collision_pairs;
            let index = known.binary_search_by_key(key, |of| (of.robots, of.pair.links)).ok()?;
            Some(known[index].pair.enabled)
        };
        let switched = switched.into_iter().filter(|key| before(key) != pairs.get(key).copied());
        changed.extend(switched.flat_map(|(robots, _links)| robots));
        let pair = |((robots, links), enabled)| RobotLinkPair { robots, pair: LinkPair { links, enabled } };
        Ok(Some(pairs.into_iter().map(pair).collect()))
    }

    /// Updates the world when the collision filter of these robots has changed. Robots that rest on or beside
    /// them wake, and contacts that are no longer allowed are dropped. New overlaps count as initial
    /// overlaps, as after a teleport, even if one of these robots is already pressed into another.
    pub(in crate::simulation) fn filter_changed(&mut self, robots: &[usize]) {
        if robots.is_empty() {
            return;
        }
        for &robot_index in robots {
            self.wake_around(robot_index);
            let entity = &mut self.entities[robot_index];
            entity.filter_colliders();
            entity.state.teleported = true;
            if !entity.moves() {
                // Immovable robots do not query sleeping ones.
                self.entities.iter_mut().for_each(Entity::wake);
            }
        }
        self.contacts.filter_changed(&self.entities);
    }
}

impl Contacts {
    /// Updates the pairs of a reloaded robot to the new indices of its links; pairs of missing links are
    /// dropped.
    pub(in crate::simulation) fn reload_pairs(&mut self, robot: usize, link: &[Option<usize>]) {
        if !self.collision_pairs.iter().any(|pair| pair.robots.contains(&robot)) {
            return;
        }
        let pairs = Arc::make_mut(&mut self.collision_pairs);
        pairs.retain_mut(|of| {
            let Some(side) = of.robots.iter().position(|&index| index == robot) else { return true };
            let now = link.get(of.pair.links[side]).copied().flatten();
            of.pair.links[side] = now.unwrap_or_default();
            now.is_some()
        });
        pairs.sort_unstable();
    }
}

impl Entity {
    /// Enables or disables pairs of this robot's links, from the field `list`.
    pub(in crate::simulation) fn switch_pairs(
        &mut self,
        asked: &[CollisionPair],
        list: &str,
    ) -> Result<(), Error> {
        if let Some(pairs) = self.switched(asked.iter().enumerate(), list)? {
            self.state.collision_pairs = Arc::new(pairs);
        }
        Ok(())
    }

    /// Returns its own pairs after a command; `None` if it has none.
    fn switched<'a>(
        &self,
        asked: impl Iterator<Item = (usize, &'a CollisionPair)>,
        list: &str,
    ) -> Result<Option<Vec<LinkPair>>, Error> {
        let mut asked = asked.peekable();
        if asked.peek().is_none() {
            return Ok(None);
        }
        let known = self.state.collision_pairs.iter();
        let mut pairs: Pairs<[usize; 2]> = known.map(|pair| (pair.links, pair.enabled)).collect();
        for (index, CollisionPair { link, other_link, enabled, .. }) in asked {
            let mut links = [self.link(link)?, self.link(other_link)?];
            links.sort_unstable();
            if links[0] == links[1] {
                let refused =
                    check::refuse("other_link", format!("{other_link:?}"), "it must be another link");
                return Err(refused.within(|| format!("{list}[{index}]")));
            }
            switch(&mut pairs, links, *enabled, index)?;
        }
        Ok(Some(pairs.into_iter().map(|(links, enabled)| LinkPair { links, enabled }).collect()))
    }

    /// Takes over filter and damping from before a reload, for links of the same name. Returns the new index of each
    /// old link.
    pub(in crate::simulation) fn take_filter(&mut self, old: &Self) -> Vec<Option<usize>> {
        let names = self.model.links.iter().enumerate().map(|(index, link)| (link.name.as_str(), index));
        let names: BTreeMap<&str, usize> = names.collect();
        let now: Vec<Option<usize>> =
            old.model.links.iter().map(|link| names.get(link.name.as_str()).copied()).collect();
        drop(names);
        for (groups, link) in old.state.groups.iter().zip(&now) {
            if let Some(slot) = link.and_then(|link| self.state.groups.get_mut(link)) {
                *slot = *groups;
            }
        }
        if !old.state.link_damping.is_empty() {
            self.state.link_damping.resize(self.model.links.len(), LinkDamping::default());
        }
        for (damping, link) in old.state.link_damping.iter().zip(&now) {
            if let Some(slot) = link.and_then(|link| self.state.link_damping.get_mut(link)) {
                *slot = *damping;
            }
        }
        let pair = |pair: &LinkPair| {
            let [a, b] = pair.links.map(|link| now.get(link).copied().flatten());
            a.zip(b).map(|(a, b)| LinkPair { links: [a.min(b), a.max(b)], ..*pair })
        };
        let mut pairs: Vec<LinkPair> = old.state.collision_pairs.iter().filter_map(pair).collect();
        pairs.sort_unstable();
        self.state.collision_pairs = Arc::new(pairs);
        self.filter_colliders();
        now
    }
}

/// Enables or disables a pair, or leaves it to groups, by the entry at `index` of the list.
fn switch<K: Ord>(pairs: &mut Pairs<K>, key: K, enabled: Option<bool>, index: usize) -> Result<(), Error> {
    match enabled {
        Some(enabled) => pairs.insert(key, enabled),
        None => pairs.remove(&key),
    };
    if pairs.len() <= MAX_COLLISION_PAIRS {
        return Ok(());
    }
    Err(Error::LimitExceeded {
        what: format!("the number of collision pairs, from pairs[{index}] on,"),
        value: pairs.len() as u64,
        limit: MAX_COLLISION_PAIRS as u64,
    })
}
