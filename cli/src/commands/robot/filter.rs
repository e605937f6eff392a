//! `simctl robot filter`: collision filter of a robot.

use anyhow::Context as _;
use clap::Args;
use serde::Serialize;
use simd_client::{
    Client,
    proto::{CollisionPair, LinkProperties, PairCollision, SetCollisionFilterRequest},
};

use crate::{
    complete,
    output::{
        Output, View,
        json::name,
        table::{Column, Page, Table},
    },
    quantity::bits,
};

#[derive(Args, Debug)]
pub(crate) struct Filter {
    /// Name of the robot
    #[arg(add = complete::robots())]
    robot: String,
    /// Whether its links collide with each other
    #[arg(long, value_name = "BOOL", action = clap::ArgAction::Set)]
    self_collision: Option<bool>,
    /// Pair of links that does not collide; the second may belong to another robot. May be repeated
    #[arg(long = "disable", value_name = "LINK,[ROBOT/]LINK", value_parser = pair)]
    disabled: Vec<(String, String, String)>,
    /// Pair that collides, whatever groups and joints say; may be repeated
    #[arg(long = "enable", value_name = "LINK,[ROBOT/]LINK", value_parser = pair)]
    enabled: Vec<(String, String, String)>,
    /// Pair that collides as groups and joints say; may be repeated
    #[arg(long = "default", value_name = "LINK,[ROBOT/]LINK", value_parser = pair)]
    defaults: Vec<(String, String, String)>,
    /// Link that groups and masks apply to; all if left out
    #[arg(long)]
    link: Option<String>,
    /// Groups of the links, a bit each, for instance 5 or 0x5
    #[arg(long, value_name = "BITS", value_parser = bits)]
    group: Option<u32>,
    /// Groups that the links collide with, a bit each
    #[arg(long, value_name = "BITS", value_parser = bits)]
    mask: Option<u32>,
}

pub(super) async fn run(arguments: Filter, client: &Client, output: Output) -> anyhow::Result<()> {
    let Filter { robot, self_collision, disabled, enabled, defaults, link, group, mask } = arguments;
    let pair = |(link, other_robot, other_link), collision: PairCollision| CollisionPair {
        link,
        other_robot,
        other_link,
        collision: collision.into(),
    };
    let mut pairs: Vec<CollisionPair> =
        defaults.into_iter().map(|of| pair(of, PairCollision::Default)).collect();
    pairs.extend(disabled.into_iter().map(|of| pair(of, PairCollision::Disabled)));
    pairs.extend(enabled.into_iter().map(|of| pair(of, PairCollision::Enabled)));
    if link.is_some() && group.is_none() && mask.is_none() {
        anyhow::bail!("give --group, --mask or both with --link");
    }
    let has_pairs = self_collision.is_some() || !pairs.is_empty();
    if has_pairs {
        let request =
            SetCollisionFilterRequest { robot: robot.clone(), self_collision, pairs, ..Default::default() };
        client.set_collision_filter(request).await?;
    }
    if group.is_some() || mask.is_some() {
        let properties = LinkProperties {
            link: link.unwrap_or_default(),
            collision_group: group,
            collision_mask: mask,
            ..LinkProperties::default()
        };
        let set = client.set_link_properties(&robot, [properties]).await;
        if has_pairs {
            set.context("pairs and self-collision are set, groups and masks are not")?;
        } else {
            set?;
        }
    }
    output.one(&FilterView::of(client, &robot).await?)
}

/// Collision filter of a robot.
#[derive(Serialize)]
pub(super) struct FilterView {
    self_collision: bool,
    pairs: Vec<PairView>,
    /// Links with other groups than the rest.
    groups: Vec<GroupView>,
}

#[derive(Serialize)]
struct PairView {
    link: String,
    /// Null for the same robot.
    other_robot: Option<String>,
    other_link: String,
    /// `disabled` or `enabled`.
    collision: String,
}

#[derive(Serialize)]
struct GroupView {
    link: String,
    group: u32,
    mask: u32,
}

impl FilterView {
    pub(super) async fn of(client: &Client, robot: &str) -> anyhow::Result<Self> {
        let filter = client.collision_filter(robot).await?;
        let view = |pair: CollisionPair| PairView {
            collision: name("PAIR_COLLISION_", pair.collision().as_str_name()),
            link: pair.link,
            other_robot: Some(pair.other_robot).filter(|robot| !robot.is_empty()),
            other_link: pair.other_link,
        };
        let groups = client.link_properties(robot).await?.into_iter().filter_map(|of| {
            let (group, mask) = of.collision_group.zip(of.collision_mask)?;
            (group != 1 || mask != u32::MAX).then_some(GroupView { link: of.link, group, mask })
        });
        Ok(Self {
            self_collision: filter.self_collision,
            pairs: filter.pairs.into_iter().map(view).collect(),
            groups: groups.collect(),
        })
    }

    /// Returns a summary such as "others; 3 pairs switched off".
    pub(super) fn in_short(&self) -> String {
        let count = |which: &str| self.pairs.iter().filter(|pair| pair.collision == which).count();
        let mut text = if self.self_collision { "others and itself" } else { "others" }.to_owned();
        for (which, how) in [("disabled", "off"), ("enabled", "on")] {
            match count(which) {
                0 => {}
                1 => text += &format!("; 1 pair of links switched {how}"),
                many => text += &format!("; {many} pairs of links switched {how}"),
            }
        }
        match self.groups.len() {
            0 => {}
            1 => text += "; 1 link with groups that differ",
            many => text += &format!("; {many} links with groups that differ"),
        }
        text
    }
}

impl View for FilterView {
    fn page(&self) -> Page {
        let mut page = Page::new().pairs([("touches", self.in_short())]);
        if !self.pairs.is_empty() {
            let columns = vec![Column::left("LINK"), Column::left("WITH"), Column::left("COLLISION")];
            let row = |pair: &PairView| {
                let other = match &pair.other_robot {
                    Some(robot) => format!("{robot}/{}", pair.other_link),
                    None => pair.other_link.clone(),
                };
                vec![pair.link.clone(), other, pair.collision.clone()]
            };
            page = page.table(Table::new(columns, self.pairs.iter().map(row).collect()));
        }
        if !self.groups.is_empty() {
            let columns = vec![Column::left("LINK"), Column::right("GROUP"), Column::right("MASK")];
            let row =
                |of: &GroupView| vec![of.link.clone(), format!("{:#x}", of.group), format!("{:#x}", of.mask)];
            page = page.table(Table::new(columns, self.groups.iter().map(row).collect()));
        }
        page
    }
}

/// Parses `LINK,LINK` or `LINK,ROBOT/LINK`: the link, the other robot, the other link. Names of robots have
/// neither comma nor slash.
fn pair(text: &str) -> Result<(String, String, String), String> {
    let (link, other) = text.split_once(',').ok_or("must be LINK,LINK or LINK,ROBOT/LINK")?;
    let (robot, other) = other.split_once('/').unwrap_or(("", other));
    if link.is_empty() || other.is_empty() {
        return Err("must be LINK,LINK or LINK,ROBOT/LINK".to_owned());
    }
    Ok((link.to_owned(), robot.to_owned(), other.to_owned()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_read_as_people_write_them() {
        let names = |a: &str, b: &str, c: &str| Ok((a.to_owned(), b.to_owned(), c.to_owned()));
        assert_eq!(pair("hand,wrist 2"), names("hand", "", "wrist 2"));
        assert_eq!(pair("hand,table/top"), names("hand", "table", "top"));
        assert!(pair("hand").is_err() && pair("hand,").is_err() && pair(",a").is_err());
    }
}
