//! Share of one client in the parameters: each counts while it exists.

use super::super::{CallError, SimHandle};
use super::{Parameter, ParameterList};

impl Parameter {
    /// Returns the bytes of the parameter's name, and of its joint's.
    fn name_bytes(&self) -> usize {
        let bound = self.binding.as_ref().map_or(0, |binding| binding.robot.len() + binding.joint.len());
        self.name.len() + bound
    }
}

impl SimHandle {
    /// Inserts a parameter into the list, in place of the one at an index, or at the end.
    ///
    /// # Errors
    /// Returns an error if its owner would have more than its share, not counting the replaced one.
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
