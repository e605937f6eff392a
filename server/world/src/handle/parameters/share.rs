//! How much of the parameters one client may have: each counts as long as it is there.

use super::super::{CallError, SimHandle};
use super::{Parameter, ParameterList};

impl Parameter {
    /// Of its own name, and of what it is bound to.
    fn name_bytes(&self) -> usize {
        let bound = self.binding.as_ref().map_or(0, |binding| binding.robot.len() + binding.joint.len());
        self.name.len() + bound
    }
}

impl SimHandle {
    /// Puts a parameter into the list, instead of the one at an index or behind all others.
    ///
    /// # Errors
    /// Returns an error if its owner would have more than its share, with what is replaced out of the way.
    pub(super) fn insert_parameter(
        &self,
        list: &mut ParameterList,
        instead: Option<usize>,
        added: Parameter,
    ) -> Result<(Parameter, bool), CallError> {
        let (mut count, mut bytes) = (1, added.name_bytes());
        for (index, other) in list.parameters.iter().enumerate() {
            if instead != Some(index) && other.owner.account() == added.owner.account() {
                count += 1;
                bytes += other.name_bytes();
            }
        }
        let limits = &self.info().limits;
        self.check_share("the number of parameters", count, limits.parameters_of_client)?;
        self.check_share("the bytes of the names of parameters", bytes, limits.parameter_bytes_of_client)?;
        match instead.and_then(|index| list.parameters.get_mut(index)) {
            Some(replaced) => *replaced = added.clone(),
            None => list.parameters.push(added.clone()),
        }
        Ok((added, true))
    }
}
