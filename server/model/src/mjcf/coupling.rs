//! Linear couplings of joints: which joint leads another one, and lengths that are sums of joint positions.
//!
//! A joint's effort, a fixed tendon's length and an actuator's control are all linear in positions. If all joints of
//! a sum follow one joint, the sum is `factor * position + offset` of that leader.

use std::collections::BTreeMap;

/// Maximum number of joints between a joint and its leader.
const MAX_BETWEEN: usize = 64;

/// A length that is linear in the position of one joint.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Linear {
    pub(super) joint: String,
    pub(super) factor: f64,
    pub(super) offset: f64,
}

/// Joints that follow others, by name: each follower is linear in its leader.
#[derive(Clone, Debug, Default)]
pub(super) struct Couplings(BTreeMap<String, Linear>);

/// A sum over the leaders of joints, and a constant.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct LeaderSum {
    /// Factors by leader, none 0.
    pub(super) factors: BTreeMap<String, f64>,
    pub(super) offset: f64,
}

impl Couplings {
    /// Adds a follower, unless it follows a joint already or would follow itself.
    pub(super) fn add(&mut self, follower: &str, of: Linear) {
        if self.leader(&of.joint).joint != follower && !self.0.contains_key(follower) {
            self.0.insert(follower.to_owned(), of);
        }
    }

    /// Returns a joint's position by its leader: the joint itself if it follows none.
    pub(super) fn leader(&self, joint: &str) -> Linear {
        let mut at = Linear { joint: joint.to_owned(), factor: 1.0, offset: 0.0 };
        for _ in 0..MAX_BETWEEN {
            let Some(next) = self.0.get(&at.joint) else { break };
            at = Linear {
                joint: next.joint.clone(),
                factor: at.factor * next.factor,
                offset: at.offset + at.factor * next.offset,
            };
        }
        at
    }

    /// Returns a sum of joint positions with factors as a sum over their leaders.
    pub(super) fn sum<'t>(&self, terms: impl IntoIterator<Item = &'t (String, f64)>) -> LeaderSum {
        let mut sum = LeaderSum::default();
        for (joint, factor) in terms {
            let leader = self.leader(joint);
            sum.offset += factor * leader.offset;
            *sum.factors.entry(leader.joint).or_default() += factor * leader.factor;
        }
        sum.factors.retain(|_, factor| *factor != 0.0);
        sum
    }
}

impl LeaderSum {
    /// Returns the sum as a length of its only leader.
    pub(super) fn of_one(&self) -> Option<Linear> {
        let mut leaders = self.factors.iter();
        let (Some((joint, factor)), None) = (leaders.next(), leaders.next()) else { return None };
        Some(Linear { joint: joint.clone(), factor: *factor, offset: self.offset })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(joint: &str, factor: f64, offset: f64) -> Linear {
        Linear { joint: joint.to_owned(), factor, offset }
    }

    fn sum(couplings: &Couplings, terms: &[(&str, f64)]) -> Option<Linear> {
        let terms: Vec<(String, f64)> = terms.iter().map(|(name, by)| ((*name).to_owned(), *by)).collect();
        couplings.sum(&terms).of_one()
    }

    #[test]
    fn a_sum_of_followers_is_a_length_of_their_leader() {
        let mut couplings = Couplings::default();
        couplings.add("b", of("a", 2.0, 0.5));
        couplings.add("c", of("b", -1.0, 1.0));
        // a + 3 c = a + 3 (1 - (2 a + 0.5)).
        assert_eq!(sum(&couplings, &[("a", 1.0), ("c", 3.0)]), Some(of("a", -5.0, 1.5)));
        assert_eq!(sum(&couplings, &[("a", 1.0), ("d", 1.0)]), None);
        assert_eq!(sum(&couplings, &[("b", 1.0), ("a", -2.0)]), None, "its length is constant");
    }

    #[test]
    fn no_joint_follows_itself_or_two_others() {
        let mut couplings = Couplings::default();
        couplings.add("b", of("a", 2.0, 0.0));
        couplings.add("a", of("b", 1.0, 0.0));
        couplings.add("b", of("c", 3.0, 0.0));
        assert_eq!((couplings.leader("a"), couplings.leader("b")), (of("a", 1.0, 0.0), of("a", 2.0, 0.0)));
    }
}
