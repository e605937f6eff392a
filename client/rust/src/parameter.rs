//! Sliders and buttons that programs add and people move.

use std::time::Duration;

use simd_proto::v1::{
    AddParameterRequest, Button, GetParametersRequest, JointBinding, NameTakenPolicy, NextParametersRequest,
    Parameter, ParameterChange, ParameterList, RemoveParametersRequest, SetParametersRequest, Slider,
    WatchParametersRequest, WatchParametersResponse, parameter::Kind, parameter_change::Change,
};
use tonic::Streaming;

use crate::{Client, Error, client::present, simulation::wall_seconds};

/// Moves the slider of that name to `value`.
pub fn slide(name: impl Into<String>, value: f64) -> ParameterChange {
    ParameterChange { name: name.into(), change: Some(Change::Value(value)) }
}

/// Presses the button of that name this many times.
pub fn press(name: impl Into<String>, times: u64) -> ParameterChange {
    ParameterChange { name: name.into(), change: Some(Change::Presses(times)) }
}

/// `ParameterService`.
impl Client {
    /// Adds a slider at `value`, or at the nearest end of its range. Returns the added slider.
    ///
    /// # Errors
    /// `PARAMETER_EXISTS` if the name is taken and the policy is to refuse, `OWNED_BY_ANOTHER` if the policy
    /// is to replace, `INVALID_VALUE`, `LIMIT_EXCEEDED`.
    pub async fn add_slider(
        &self,
        name: &str,
        (minimum, maximum): (f64, f64),
        value: f64,
        name_taken: NameTakenPolicy,
    ) -> Result<Parameter, Error> {
        self.add_parameter(name, Kind::Slider(Slider { minimum, maximum, value }), None, name_taken).await
    }

    /// Like [`add_slider`](Self::add_slider), for a slider that sets the target of a joint each time it is
    /// moved, without a program in between.
    ///
    /// # Errors
    /// As [`add_slider`](Self::add_slider); `ROBOT_NOT_FOUND`, `JOINT_NOT_FOUND`, `JOINT_NOT_ACTUATED`.
    pub async fn add_bound_slider(
        &self,
        name: &str,
        (minimum, maximum): (f64, f64),
        value: f64,
        joint: JointBinding,
        name_taken: NameTakenPolicy,
    ) -> Result<Parameter, Error> {
        let slider = Kind::Slider(Slider { minimum, maximum, value });
        self.add_parameter(name, slider, Some(joint), name_taken).await
    }

    /// Adds a button that was never pressed. Returns the added button.
    ///
    /// # Errors
    /// `PARAMETER_EXISTS` if the name is taken and the policy is to refuse, `OWNED_BY_ANOTHER` if the policy
    /// is to replace, `INVALID_VALUE`, `LIMIT_EXCEEDED`.
    pub async fn add_button(&self, name: &str, name_taken: NameTakenPolicy) -> Result<Parameter, Error> {
        self.add_parameter(name, Kind::Button(Button { presses: 0 }), None, name_taken).await
    }

    async fn add_parameter(
        &self,
        name: &str,
        kind: Kind,
        joint: Option<JointBinding>,
        name_taken: NameTakenPolicy,
    ) -> Result<Parameter, Error> {
        let parameter = Parameter { name: name.to_owned(), kind: Some(kind), joint, ..Default::default() };
        let (parameter, name_taken, take_over) = (Some(parameter), name_taken.into(), self.takes_over);
        let request = AddParameterRequest { parameter, name_taken, take_over, ..Default::default() };
        let answer = self.unary(self.parameter().add_parameter(self.claimed(request))).await?;
        present(answer.parameter, "parameter")
    }

    /// Moves sliders and presses buttons, all or none: see [`slide`] and [`press`]. Returns their new values.
    ///
    /// # Errors
    /// `PARAMETER_NOT_FOUND`, `INVALID_VALUE`; for sliders that are bound to joints, also the refusals of a
    /// target.
    pub async fn set_parameters(
        &self,
        changes: impl IntoIterator<Item = ParameterChange>,
    ) -> Result<Vec<Parameter>, Error> {
        let changes = changes.into_iter().collect();
        let request = SetParametersRequest { changes, ..Default::default() };
        Ok(self.unary(self.parameter().set_parameters(self.claimed(request))).await?.parameters)
    }

    /// Returns the parameters of these names, or all of them in the order in which they were added.
    ///
    /// # Errors
    /// `PARAMETER_NOT_FOUND`.
    pub async fn parameters(&self, names: Vec<String>) -> Result<ParameterList, Error> {
        let answer = self.unary(self.parameter().get_parameters(GetParametersRequest { names })).await?;
        present(answer.list, "list")
    }

    /// Returns all parameters once their `version` differs from `after_version` (0: at once). After `wait`,
    /// at most 60 s, returns the present ones.
    ///
    /// # Errors
    /// Returns an error if the daemon refuses or does not answer.
    pub async fn next_parameters(&self, after_version: u64, wait: Duration) -> Result<ParameterList, Error> {
        let timeout = wait.as_secs_f64();
        let request = NextParametersRequest { after_version, timeout };
        let answer = self.unary_for(wall_seconds(timeout), self.parameter().next_parameters(request)).await?;
        present(answer.list, "list")
    }

    /// Streams all parameters: now, and whenever one of them changes.
    ///
    /// # Errors
    /// Returns an error if the daemon does not answer.
    pub async fn watch_parameters(&self) -> Result<ParameterWatch, Error> {
        let lists = self.unary(self.parameter().watch_parameters(WatchParametersRequest {})).await?;
        Ok(ParameterWatch { client: self.clone(), lists })
    }

    /// Removes parameters, all or none. Without names, removes all that have no other owner. Returns the
    /// names of the removed ones.
    ///
    /// # Errors
    /// `PARAMETER_NOT_FOUND`, `OWNED_BY_ANOTHER`.
    pub async fn remove_parameters(&self, names: Vec<String>) -> Result<Vec<String>, Error> {
        let take_over = self.takes_over;
        let request = RemoveParametersRequest { names, take_over, ..Default::default() };
        Ok(self.unary(self.parameter().remove_parameters(self.claimed(request))).await?.removed)
    }
}

/// A stream of parameters: each message has all of them.
#[derive(Debug)]
pub struct ParameterWatch {
    client: Client,
    lists: Streaming<WatchParametersResponse>,
}

impl ParameterWatch {
    /// Returns the next list; `None` if the daemon ended the stream normally.
    ///
    /// # Errors
    /// Returns an error if the connection broke.
    pub async fn next(&mut self) -> Result<Option<ParameterList>, Error> {
        match self.lists.message().await {
            Ok(Some(answer)) => present(answer.list, "list").map(Some),
            Ok(None) => Ok(None),
            Err(status) => Err(Error::from_status(&status, self.client.endpoint())),
        }
    }
}
