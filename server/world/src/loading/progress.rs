//! Progress of a robot's load, for callers that wait for it.

use std::cell::Cell;
use std::sync::Arc;

use simd_model::robot::{MeshAsset, Sha256};
use simd_model::{Asset, Assets};
use tokio::sync::watch;

/// Phase of a load.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Phase {
    /// Other loads are read first.
    #[default]
    Waiting,
    /// The text and the meshes are read.
    Reading,
    /// Collision meshes become convex hulls.
    Hulls,
    /// The spawn waits for the end of a step.
    Spawning,
}

/// Progress of a load.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// Present phase.
    pub phase: Phase,
    /// Number of files that were read.
    pub done: usize,
    /// Total number of files.
    pub total: usize,
    /// File that is being read.
    pub uri: String,
}

/// Reports the progress of a load. The newest report wins: a slow listener blocks nothing.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reporter(Option<watch::Sender<Progress>>);

impl Reporter {
    /// Reports to a listener.
    pub(crate) fn to(listener: watch::Sender<Progress>) -> Self {
        Self(Some(listener))
    }

    pub(super) fn is_heard(&self) -> bool {
        self.0.as_ref().is_some_and(|listener| !listener.is_closed())
    }

    pub(crate) fn say(&self, phase: Phase) {
        if let Some(listener) = &self.0 {
            listener.send_modify(|progress| {
                progress.phase = phase;
                progress.uri.clear();
                if phase != Phase::Reading {
                    progress.done = progress.total;
                }
            });
        }
    }

    /// Wraps files so that each read is reported, as one of `total`.
    pub(super) fn counting<'a, A: Assets>(&'a self, assets: &'a A, total: usize) -> Counting<'a, A> {
        Counting { reporter: self, assets, total, begun: Cell::new(0) }
    }
}

/// Files whose reads are reported.
pub(super) struct Counting<'a, A> {
    reporter: &'a Reporter,
    assets: &'a A,
    total: usize,
    begun: Cell<usize>,
}

impl<A: Assets> Assets for Counting<'_, A> {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        if let Some(listener) = &self.reporter.0 {
            // Files found before this one are read by now.
            let done = self.begun.replace(self.begun.get() + 1);
            let (total, uri) = (self.total, uri.to_owned());
            listener.send_replace(Progress { phase: Phase::Reading, done, total, uri });
        }
        self.assets.find(uri)
    }

    fn note(&self, uri: &str) -> Option<String> {
        self.assets.note(uri)
    }

    fn mesh(
        &self,
        look: Sha256,
        format: &str,
        read: &mut dyn FnMut() -> Result<MeshAsset, String>,
    ) -> Result<Arc<MeshAsset>, String> {
        self.assets.mesh(look, format, read)
    }
}

#[cfg(test)]
mod tests {
    use simd_model::{ReadOptions, read};

    use super::*;

    /// Files that are all missing; each query records the last report before it.
    struct Asked<'a>(&'a watch::Receiver<Progress>);

    impl Assets for Asked<'_> {
        fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
            let said = self.0.borrow();
            assert_eq!((said.phase, said.total, said.uri.as_str()), (Phase::Reading, 2, uri));
            let expected = if uri == "first.stl" { 0 } else { 1 };
            assert_eq!(said.done, expected);
            Err(Vec::new())
        }
    }

    #[test]
    fn each_file_is_named_while_it_is_read_and_counted_after_that() {
        let (say, heard) = watch::channel(Progress::default());
        let reporter = Reporter::to(say);
        assert!(reporter.is_heard());
        let visual = |uri| format!("<visual><geometry><mesh filename=\"{uri}\"/></geometry></visual>");
        let urdf = format!(
            "<robot name=\"r\"><link name=\"l\">{}{}</link></robot>",
            visual("first.stl"),
            visual("second.stl")
        );
        reporter.say(Phase::Reading);
        let assets = Asked(&heard);
        read(urdf.as_bytes(), &reporter.counting(&assets, 2), &ReadOptions::default()).unwrap();
        reporter.say(Phase::Hulls);
        let expected = Progress { phase: Phase::Hulls, done: 2, total: 2, uri: String::new() };
        assert_eq!(*heard.borrow(), expected);
        drop(heard);
        assert!(!reporter.is_heard());
    }
}
