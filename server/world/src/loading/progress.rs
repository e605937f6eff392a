//! How far a robot is on its way into the world, for callers that wait for it.

use std::cell::Cell;
use std::sync::Arc;

use simd_model::robot::{MeshAsset, Sha256};
use simd_model::{Asset, Assets};
use tokio::sync::watch;

/// What is being done to a description.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Phase {
    /// Others are read before it.
    #[default]
    Waiting,
    /// Its text and its meshes are read.
    Reading,
    /// Its collision meshes become convex hulls.
    Hulls,
    /// It waits for the end of a step.
    Spawning,
}

/// How far a robot is.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// What is being done.
    pub phase: Phase,
    /// Files that are read.
    pub done: usize,
    /// How many there are.
    pub total: usize,
    /// The file that is read now.
    pub uri: String,
}

/// Says how far a robot is. The newest report wins: a slow listener blocks nothing.
#[derive(Clone, Debug, Default)]
pub(crate) struct Reporter(Option<watch::Sender<Progress>>);

impl Reporter {
    /// To a listener.
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

    /// The same files; says which is read, of `total`.
    pub(super) fn counting<'a, A: Assets>(&'a self, assets: &'a A, total: usize) -> Counting<'a, A> {
        Counting { reporter: self, assets, total, begun: Cell::new(0) }
    }
}

/// Files whose reading is reported.
pub(super) struct Counting<'a, A> {
    reporter: &'a Reporter,
    assets: &'a A,
    total: usize,
    begun: Cell<usize>,
}

impl<A: Assets> Assets for Counting<'_, A> {
    fn find(&self, uri: &str) -> Result<Asset, Vec<String>> {
        if let Some(listener) = &self.reporter.0 {
            // What was found before is read by now.
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

    /// Nothing is found; each question shows what was said before it.
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
