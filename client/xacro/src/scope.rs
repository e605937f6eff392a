//! Properties and macros by name, each macro's own before those of its caller.

use std::collections::HashMap;
use std::rc::Rc;

use crate::macros::Macro;
use crate::source::Element;
use crate::value::Value;
use crate::write::Made;

/// What a name stands for.
#[derive(Clone, Debug)]
pub(crate) enum Entry {
    Value(Value),
    /// Computed when it is first asked for, with what is known then.
    Lazy(Rc<str>),
    /// Being computed: a request for it is a cycle.
    Busy,
}

/// What `insert_block` inserts.
#[derive(Clone, Debug)]
pub(crate) enum Block {
    /// The content of a property, expanded where it is inserted.
    Source(Rc<Element>),
    /// What a call was given, expanded already.
    Made(Rc<Vec<Made>>),
}

/// One level of names.
#[derive(Debug, Default)]
struct Scope {
    entries: HashMap<String, Entry>,
    blocks: HashMap<String, Block>,
    macros: HashMap<String, Rc<Macro>>,
}

/// All levels, the file's own first.
#[derive(Debug)]
pub(crate) struct Scopes(Vec<Scope>);

impl Scopes {
    /// The file's own level.
    pub(crate) fn new() -> Self {
        Self(vec![Scope::default()])
    }

    /// Begins the level of a macro.
    pub(crate) fn enter(&mut self) {
        self.0.push(Scope::default());
    }

    /// Ends it.
    pub(crate) fn leave(&mut self) {
        self.0.pop();
    }

    /// The innermost level.
    pub(crate) fn top(&self) -> usize {
        self.0.len().saturating_sub(1)
    }

    /// An entry seen from a level, and the level that has it.
    pub(crate) fn entry(&self, name: &str, from: usize) -> Option<(usize, Entry)> {
        let mut levels = self.0.iter().enumerate().take(from.saturating_add(1)).rev();
        levels.find_map(|(level, scope)| Some((level, scope.entries.get(name)?.clone())))
    }

    /// Sets an entry of a level.
    pub(crate) fn set(&mut self, level: usize, name: &str, entry: Entry) {
        if let Some(scope) = self.0.get_mut(level) {
            scope.entries.insert(name.to_owned(), entry);
        }
    }

    /// A block seen from the innermost level.
    pub(crate) fn block(&self, name: &str) -> Option<Block> {
        self.0.iter().rev().find_map(|scope| scope.blocks.get(name)).cloned()
    }

    /// Sets a block of a level.
    pub(crate) fn set_block(&mut self, level: usize, name: &str, block: Block) {
        if let Some(scope) = self.0.get_mut(level) {
            scope.blocks.insert(name.to_owned(), block);
        }
    }

    /// A macro seen from the innermost level.
    pub(crate) fn find_macro(&self, name: &str) -> Option<Rc<Macro>> {
        self.0.iter().rev().find_map(|scope| scope.macros.get(name)).cloned()
    }

    /// Sets a macro of the innermost level.
    pub(crate) fn set_macro(&mut self, known: Macro) {
        if let Some(scope) = self.0.last_mut() {
            scope.macros.insert(known.name.clone(), Rc::new(known));
        }
    }
}
