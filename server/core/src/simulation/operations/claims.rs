//! Claims: reservation of robots, joints and the world, and the rights of other clients.
//!
//! A claim covers every change of its objects, not only targets. Actions on the whole world (running,
//! physics, resets, restoring a state) concern all holders of claims. While another client holds one, they
//! require a claim on the world.

use std::sync::Arc;

use crate::simulation::claim::{Claim, ClaimId};
use crate::simulation::command::{ClaimRequest, Command, JointSelection, ReleaseCause, RobotReset};
use crate::simulation::entity::Entity;
use crate::simulation::error::Error;
use crate::simulation::event::Claimed;
use crate::simulation::{EventKind, Reply, Simulation};

/// Claimed objects of one robot.
struct Wanted {
    robot: usize,
    whole: bool,
    joints: Vec<usize>,
}

impl Simulation {
    /// Checks whether the holder of `claim`, or a client without one, may do what a command does.
    pub(in crate::simulation) fn allow(
        &self,
        command: &Command,
        claim: Option<ClaimId>,
    ) -> Result<(), Error> {
        if let Some(claim) = claim
            && !self.claims.contains_key(&claim)
        {
            return Err(Error::ClaimNotFound);
        }
        // Without claims, all is allowed: frequent commands have nothing to look up.
        if self.claims.is_empty() {
            return Ok(());
        }
        match command {
            // Joint by joint, where they are resolved.
            Command::SetTargets(_) | Command::FollowTrajectory(_) | Command::CancelTrajectory { .. } => {
                Ok(())
            }
            Command::ResetJoints { robots } => {
                robots.iter().try_for_each(|reset| self.allow_reset(reset, claim))
            }
            Command::SetJointProperties { robot, joints } => {
                let names = joints.iter().map(|properties| properties.joint.as_str());
                self.allow_joints(robot, names, claim)
            }
            Command::Reload(reload) => self.allow_bound(&reload.robot, claim),
            Command::Delete { robot } => self.allow_bound(robot, claim),
            Command::ApplyWrench(wrench) => self.allow_robot(&wrench.robot, claim),
            Command::PullLink(pull) => self.allow_robot(&pull.robot, claim),
            Command::SetCollisionFilter(change) => {
                let others =
                    change.pairs.iter().map(|pair| &pair.other_robot).filter(|other| !other.is_empty());
                std::iter::once(&change.robot)
                    .chain(others)
                    .try_for_each(|robot| self.allow_robot(robot, claim))
            }
            Command::CreateConstraint(create) => [&create.parent, &create.child]
                .into_iter()
                .filter(|end| !end.robot.is_empty())
                .try_for_each(|end| self.allow_robot(&end.robot, claim)),
            Command::ChangeConstraint(change) => self.allow_constraint(&change.name, claim),
            Command::DeleteConstraint { name } => self.allow_constraint(name, claim),
            Command::CreateSensor(create) => self.allow_robot(&create.robot, claim),
            Command::DeleteSensor { robot, .. }
            | Command::SetLinkProperties { robot, .. }
            | Command::SetEntityState { robot, .. } => self.allow_robot(robot, claim),
            Command::SetPhysics(_) | Command::Reset(_) | Command::RestoreState { .. } => {
                self.allow_world(claim)
            }
            Command::Spawn(_)
            | Command::SpawnAll(_)
            | Command::Claim(_)
            | Command::Release { .. }
            | Command::SaveState { .. }
            | Command::DeleteSavedState { .. }
            | Command::ImportSavedState { .. } => Ok(()),
        }
    }

    /// Checks whether the world may be paused, played, reset and the like.
    ///
    /// # Errors
    /// Returns an error if another client has claimed the world, or anything in it while `claim` is not on
    /// the world.
    pub fn allow_world(&self, claim: Option<ClaimId>) -> Result<(), Error> {
        self.allow_step(claim)?;
        if self.world_claim.is_some() {
            return Ok(());
        }
        match self.entities.iter().find_map(|entity| entity.claims.of_another(claim)) {
            Some(other) => Err(Error::WorldShared { holder: other.holder.to_string() }),
            None => Ok(()),
        }
    }

    /// Checks whether the world may be stepped.
    ///
    /// # Errors
    /// Returns an error if another client has claimed the world.
    pub fn allow_step(&self, claim: Option<ClaimId>) -> Result<(), Error> {
        match self.world_claim.as_ref().filter(|held| held.is_of_another(claim)) {
            Some(other) => Err(Error::WorldClaimed { holder: other.holder.to_string() }),
            None => Ok(()),
        }
    }

    fn allow_robot(&self, robot: &str, claim: Option<ClaimId>) -> Result<(), Error> {
        // The command itself refuses unknown robots.
        let Ok(robot) = self.robot_index(robot) else { return Ok(()) };
        self.entities[robot].allow(claim)
    }

    /// Whether the holder of `claim` may change a robot and the robots that constraints hold to it: constraints end with a robot.
    fn allow_bound(&self, robot: &str, claim: Option<ClaimId>) -> Result<(), Error> {
        let Ok(robot) = self.robot_index(robot) else { return Ok(()) };
        self.entities[robot].allow(claim)?;
        let of_robot =
            |index: &usize| self.constraints.list[*index].definition.robots().any(|end| end == robot);
        let bound = (0..self.constraints.list.len()).filter(of_robot);
        let mut others = bound.flat_map(|index| self.constraints.list[index].definition.robots());
        others.try_for_each(|other| self.entities[other].allow(claim))
    }

    /// A constraint that does not exist is refused by what the command does.
    fn allow_constraint(&self, name: &str, claim: Option<ClaimId>) -> Result<(), Error> {
        let Ok(constraint) = self.constraint_index(name) else { return Ok(()) };
        let mut robots = self.constraints.list[constraint].definition.robots();
        robots.try_for_each(|robot| self.entities[robot].allow(claim))
    }

    fn allow_reset(&self, reset: &RobotReset, claim: Option<ClaimId>) -> Result<(), Error> {
        match reset.joints.is_empty() {
            true => self.allow_robot(&reset.robot, claim),
            false => {
                self.allow_joints(&reset.robot, reset.joints.iter().map(|joint| joint.joint.as_str()), claim)
            }
        }
    }

    fn allow_joints<'n>(
        &self,
        robot: &str,
        mut names: impl Iterator<Item = &'n str>,
        claim: Option<ClaimId>,
    ) -> Result<(), Error> {
        let Ok(robot) = self.robot_index(robot) else { return Ok(()) };
        let entity = &self.entities[robot];
        names.try_for_each(|name| match entity.joint(name) {
            Ok(joint) => entity.allow_joint(joint, claim),
            // The command itself refuses it.
            Err(_) => Ok(()),
        })
    }

    pub(in crate::simulation) fn claim(&mut self, request: &ClaimRequest) -> Result<Reply, Error> {
        let wanted: Vec<Wanted> =
            request.joints.iter().map(|selection| self.wanted(selection)).collect::<Result<_, _>>()?;
        let in_the_way = self.in_the_way(request, &wanted)?;
        for &claim in &in_the_way {
            self.end_claim(claim, ReleaseCause::TakenOver { by: request.holder.clone() });
        }
        for Wanted { robot, whole, joints } in &wanted {
            self.end_motions(*robot, (!whole).then_some(joints));
        }
        let claimed = self.begin_claim(request, wanted);
        self.happened(EventKind::JointsClaimed { holder: request.holder.clone(), claimed });
        Ok(Reply::Claimed { ended: in_the_way })
    }

    /// Begins one of the [`claims`](Self::claims) of a saved world again. Motions continue: the holder may have begun
    /// them.
    ///
    /// # Errors
    /// Returns an error if a robot or joint does not exist.
    pub fn restore_claim(&mut self, request: &ClaimRequest) -> Result<(), Error> {
        let wanted =
            request.joints.iter().map(|selection| self.wanted(selection)).collect::<Result<_, _>>()?;
        self.begin_claim(request, wanted);
        Ok(())
    }

    fn begin_claim(&mut self, request: &ClaimRequest, wanted: Vec<Wanted>) -> Claimed {
        let record = Arc::new(Claim {
            id: request.claim,
            holder: request.holder.as_str().into(),
            priority: request.priority,
        });
        self.claims.insert(request.claim, Arc::clone(&record));
        let mut claimed = Claimed { world: request.world, ..Claimed::default() };
        if request.world {
            self.world_claim = Some(Arc::clone(&record));
        }
        for Wanted { robot, whole, joints } in wanted {
            let entity = &mut self.entities[robot];
            let name = &entity.state.name;
            if whole {
                entity.claims.whole = Some(Arc::clone(&record));
                claimed.robots.push(name.clone());
            }
            for joint in joints {
                entity.claims.joints[joint] = Some(Arc::clone(&record));
                claimed.joints.push(format!("{name}/{}", entity.model.joints[joint].name));
            }
            self.settings_changed(robot);
        }
        claimed
    }

    /// Ends motions that clients without the claim began: trajectories of its joints, also delayed ones, and wrenches and
    /// pulls on the robot. Targets stay; the holder may change them.
    fn end_motions(&mut self, robot: usize, joints: Option<&Vec<usize>>) {
        self.cancel_trajectories(robot, joints.map(Vec::as_slice), "a claim");
        self.entities[robot].clear_external_forces();
    }

    /// The claims that hold, each as a request that would make it in a world with the same robots: what a save leaves out.
    pub fn claims(&self) -> Vec<ClaimRequest> {
        let of = |claim: &Claim| {
            let is_it = |held: &Option<Arc<Claim>>| held.as_ref().is_some_and(|held| held.id == claim.id);
            let selection = |entity: &Entity| {
                let robot = entity.state.name.clone();
                if is_it(&entity.claims.whole) {
                    return Some(JointSelection { robot, joints: Vec::new() });
                }
                let joints = entity.model.joints.iter().zip(&entity.claims.joints);
                let joints = joints.filter(|(_, held)| is_it(held)).map(|(joint, _)| joint.name.clone());
                let joints: Vec<String> = joints.collect();
                (!joints.is_empty()).then_some(JointSelection { robot, joints })
            };
            ClaimRequest {
                claim: claim.id,
                holder: claim.holder.to_string(),
                joints: self.entities.iter().filter_map(selection).collect(),
                world: is_it(&self.world_claim),
                priority: claim.priority,
                take_over: false,
            }
        };
        self.claims.values().map(|claim| of(claim)).collect()
    }

    /// Resolves a selection.
    fn wanted(&self, selection: &JointSelection) -> Result<Wanted, Error> {
        let robot = self.robot_index(&selection.robot)?;
        let entity = &self.entities[robot];
        let whole = selection.joints.is_empty();
        let joints = if whole {
            let mut all: Vec<usize> = entity.actuated().map(|(joint, _)| joint).collect();
            all.dedup();
            all
        } else {
            let joints = selection.joints.iter().map(|joint| {
                let index = entity.joint(joint)?;
                entity.actuated_body(index, 0).map(|_| index)
            });
            joints.collect::<Result<_, _>>()?
        };
        Ok(Wanted { robot, whole, joints })
    }

    /// Returns the claims of others that this one takes over.
    fn in_the_way(&self, request: &ClaimRequest, wanted: &[Wanted]) -> Result<Vec<ClaimId>, Error> {
        let yields = |other: &Claim| request.take_over || other.priority < request.priority;
        let mut ended = Vec::new();
        if let Some(other) = self.world_claim.as_ref().filter(|_| request.world) {
            if !yields(other) {
                return Err(Error::WorldClaimed { holder: other.holder.to_string() });
            }
            ended.push(other.id);
        }
        for Wanted { robot, whole, joints } in wanted {
            let entity = &self.entities[*robot];
            if *whole {
                if let Some(other) = entity.claims.iter().find(|other| !yields(other)) {
                    return Err(entity.claimed_by(other));
                }
                ended.extend(entity.claims.iter().map(|other| other.id));
            }
            for &joint in joints {
                let Some(other) = entity.claims.of_joint(joint) else { continue };
                if !yields(other) {
                    return Err(entity.joint_claimed_by(joint, other));
                }
                ended.push(other.id);
            }
        }
        ended.sort_unstable();
        ended.dedup();
        Ok(ended)
    }

    pub(in crate::simulation) fn release(
        &mut self,
        claim: ClaimId,
        cause: ReleaseCause,
    ) -> Result<Reply, Error> {
        if !self.claims.contains_key(&claim) {
            return Err(Error::ClaimNotFound);
        }
        self.end_claim(claim, cause);
        Ok(Reply::Done)
    }

    /// Ends a claim. Joints that are no longer driven hold their position.
    fn end_claim(&mut self, claim: ClaimId, cause: ReleaseCause) {
        let Some(record) = self.claims.remove(&claim) else { return };
        let world = self.world_claim.take_if(|held| held.id == claim).is_some();
        let mut released = Claimed { world, ..Claimed::default() };
        for robot in 0..self.entities.len() {
            let entity = &mut self.entities[robot];
            let was_whole = entity.claims.whole.as_ref().is_some_and(|held| held.id == claim);
            let (joints, any) = entity.claims.end(claim);
            if !joints.is_empty() {
                self.cancel_trajectories(robot, Some(&joints), "the end of a claim");
            }
            let entity = &mut self.entities[robot];
            if was_whole {
                released.robots.push(entity.state.name.clone());
            }
            for joint in joints {
                released.joints.push(format!("{}/{}", entity.state.name, entity.model.joints[joint].name));
                for body in entity.body.tree().joints[joint].clone() {
                    entity.body.hold(body);
                }
            }
            if any {
                self.settings_changed(robot);
            }
        }
        let holder = record.holder.to_string();
        self.happened(EventKind::JointsReleased { holder, released, cause });
    }
}

impl Entity {
    /// Checks whether the holder of `claim`, or a client without one, may change all of the robot.
    fn allow(&self, claim: Option<ClaimId>) -> Result<(), Error> {
        self.claims.of_another(claim).map_or(Ok(()), |other| Err(self.claimed_by(other)))
    }

    /// Checks whether the holder of `claim`, or a client without one, may change a joint.
    pub(in crate::simulation) fn allow_joint(
        &self,
        joint: usize,
        claim: Option<ClaimId>,
    ) -> Result<(), Error> {
        let other = self.claims.of_joint(joint).filter(|held| held.is_of_another(claim));
        other.map_or(Ok(()), |other| Err(self.joint_claimed_by(joint, other)))
    }

    /// Returns the error that names the robot if all of it is claimed, or the first claimed joint.
    fn claimed_by(&self, other: &Claim) -> Error {
        let is_it = |held: &Option<Arc<Claim>>| held.as_ref().is_some_and(|held| held.id == other.id);
        match self.claims.joints.iter().position(is_it) {
            Some(joint) if !is_it(&self.claims.whole) => self.joint_claimed_by(joint, other),
            _ => Error::RobotClaimed { robot: self.state.name.clone(), holder: other.holder.to_string() },
        }
    }

    fn joint_claimed_by(&self, joint: usize, other: &Claim) -> Error {
        Error::JointClaimed {
            robot: self.state.name.clone(),
            joint: self.model.joints[joint].name.clone(),
            holder: other.holder.to_string(),
        }
    }
}
