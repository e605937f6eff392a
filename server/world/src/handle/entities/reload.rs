//! Reloading of robots.

use simd_core::collision::MeshShapes;
use simd_core::simulation::command::Reload;
use simd_core::{Command, Reply};
use simd_model::LoadReport;

use crate::driver::Done;
use crate::handle::{CallError, SimHandle};
use crate::loading::{LoadedRobot, Reporter, Source, summary};

/// A robot with a new model.
#[derive(Clone, Debug)]
pub struct Reloaded {
    /// Moment from which it has the model.
    pub done: Done,
    /// Findings of the load.
    pub report: LoadReport,
    /// Summary of the report in one line.
    pub summary: String,
    /// Joints that the old model did not have.
    pub added: Vec<String>,
    /// Joints that the new model does not have.
    pub removed: Vec<String>,
}

impl SimHandle {
    /// Gives a robot a new model, from a new source or by reading its present source again.
    ///
    /// # Errors
    /// Returns an error if the robot does not exist, or the model cannot be read.
    pub async fn reload(
        &self,
        robot: String,
        source: Option<Source>,
        strict: bool,
    ) -> Result<Reloaded, CallError> {
        self.note_robots([robot.as_str()]);
        let (origin, model, scale, mesh_shapes, srdf, fixed_base) = {
            let newest = self.newest();
            let Some((_, entity)) = newest.state.entity(&robot) else {
                let entities = newest.state.world.entities.iter();
                let known = entities.map(|entity| entity.name.clone()).collect();
                return Err(simd_core::Error::RobotNotFound { robot, known }.into());
            };
            let known = self.loader().with_known(&entity.model, |known| {
                (known.origin.clone(), known.scale, known.mesh_shapes, known.srdf)
            });
            let (origin, scale, mesh_shapes, srdf) = match (source, known) {
                (Some(source), Some((_, scale, mesh_shapes, srdf))) => {
                    (source.into(), scale, mesh_shapes, srdf)
                }
                (Some(source), None) => (source.into(), 1.0, MeshShapes::default(), None),
                (None, Some(known)) => known,
                (None, None) => {
                    let message = format!("it is not known where robot {robot:?} came from");
                    return Err(CallError::Internal { message });
                }
            };
            let srdf = srdf.and_then(|srdf| self.loader().asset(&srdf)).unwrap_or_default();
            (origin, entity.model.name.clone(), scale, mesh_shapes, srdf, entity.fixed_base)
        };
        let options = self.loader().load_options(scale, strict, mesh_shapes, Some(fixed_base));
        let LoadedRobot { model, shapes, report, .. } = self
            .loader()
            .load(&self.call.account, origin, &model, srdf, options, Reporter::default())
            .await?;
        let summary = summary(&model, &report);
        tracing::info!(robot, "reloads {summary}");
        let done = self.command(Command::Reload(Box::new(Reload { robot, model, shapes }))).await?;
        let (added, removed) = match &done.applied.reply {
            Reply::Reloaded { added, removed } => (added.clone(), removed.clone()),
            _ => Default::default(),
        };
        Ok(Reloaded { done, report, summary, added, removed })
    }
}
