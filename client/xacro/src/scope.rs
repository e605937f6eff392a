//! Properties and macros by name: those of a macro's call before those of its caller, and namespaces of includes.

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
    /// An earlier one, which is asked next.
    parent: Option<usize>,
    /// Of an include with `ns`.
    is_namespace: bool,
    entries: HashMap<String, Entry>,
    blocks: HashMap<String, Block>,
    macros: HashMap<String, Rc<Macro>>,
}

/// All levels, the file's own first.
#[derive(Debug)]
pub(crate) struct Scopes {
    all: Vec<Scope>,
    current: usize,
}

/// What [`Scopes::leave`] goes back to.
pub(crate) struct Mark {
    current: usize,
    length: usize,
}

impl Scopes {
    /// The file's own level.
    pub(crate) fn new() -> Self {
        Self { all: vec![Scope::default()], current: 0 }
    }

    /// Begins the level of a macro's call.
    pub(crate) fn enter(&mut self, parent: usize) -> Mark {
        let mark = Mark { current: self.current, length: self.all.len() };
        self.current = mark.length;
        self.all.push(Scope { parent: Some(parent.min(mark.length - 1)), ..Scope::default() });
        mark
    }

    /// Ends it, and forgets its namespaces.
    pub(crate) fn leave(&mut self, mark: &Mark) {
        self.all.truncate(mark.length);
        self.current = mark.current;
    }

    /// Begins a namespace that the current level keeps under a name. Returns the level to come back to.
    pub(crate) fn begin_namespace(&mut self, name: &str) -> usize {
        let (outer, level) = (self.current, self.all.len());
        self.set(outer, name, Entry::Value(Value::Namespace(level)));
        self.all.push(Scope { parent: Some(outer), is_namespace: true, ..Scope::default() });
        self.current = level;
        outer
    }

    /// Ends a namespace, which keeps its names.
    pub(crate) fn end_namespace(&mut self, outer: usize) {
        self.current = outer;
    }

    /// The innermost level.
    pub(crate) fn top(&self) -> usize {
        self.current
    }

    /// The level that `scope="parent"` means: the caller's. Namespaces between a macro and its caller are passed by.
    pub(crate) fn parent(&self, level: usize) -> usize {
        let parent = |level: usize| self.all.get(level).and_then(|scope| scope.parent);
        let is_namespace = |level: usize| self.all.get(level).is_some_and(|scope| scope.is_namespace);
        let mut above = parent(level).unwrap_or(level);
        while !is_namespace(level) && is_namespace(above) {
            above = parent(above).unwrap_or(0);
        }
        above
    }

    /// From a level outwards.
    fn outwards(&self, from: usize) -> impl Iterator<Item = (usize, &Scope)> {
        let mut next = Some(from);
        std::iter::from_fn(move || {
            let level = next?;
            let scope = self.all.get(level)?;
            next = scope.parent;
            Some((level, scope))
        })
    }

    /// An entry seen from a level, and the level that has it.
    pub(crate) fn entry(&self, name: &str, from: usize) -> Option<(usize, Entry)> {
        self.outwards(from).find_map(|(level, scope)| Some((level, scope.entries.get(name)?.clone())))
    }

    /// Sets an entry of a level.
    pub(crate) fn set(&mut self, level: usize, name: &str, entry: Entry) {
        if let Some(scope) = self.all.get_mut(level) {
            scope.entries.insert(name.to_owned(), entry);
        }
    }

    /// Forgets a property, seen from a level, on all levels.
    pub(crate) fn remove(&mut self, name: &str, from: usize) {
        let levels: Vec<usize> = self.outwards(from).map(|(level, _)| level).collect();
        for level in levels {
            if let Some(scope) = self.all.get_mut(level) {
                scope.entries.remove(name);
            }
        }
    }

    /// A block seen from the innermost level.
    pub(crate) fn block(&self, name: &str) -> Option<Block> {
        self.outwards(self.current).find_map(|(_, scope)| scope.blocks.get(name)).cloned()
    }

    /// Sets a block of a level.
    pub(crate) fn set_block(&mut self, level: usize, name: &str, block: Block) {
        if let Some(scope) = self.all.get_mut(level) {
            scope.blocks.insert(name.to_owned(), block);
        }
    }

    /// A macro seen from the innermost level, and the level that its call is in: that of its namespace for `namespace.name`.
    pub(crate) fn find_macro(&self, name: &str) -> Option<(Rc<Macro>, usize)> {
        let seen = |name: &str, from: usize| {
            self.outwards(from).find_map(|(_, scope)| scope.macros.get(name)).cloned()
        };
        if let Some(found) = seen(name, self.current) {
            return Some((found, self.current));
        }
        let (namespaces, name) = name.rsplit_once('.')?;
        let mut level = self.current;
        for namespace in namespaces.split('.') {
            let (_, Entry::Value(Value::Namespace(inner))) = self.entry(namespace, level)? else {
                return None;
            };
            level = inner;
        }
        Some((seen(name, level)?, level))
    }

    /// Sets a macro of the innermost level.
    pub(crate) fn set_macro(&mut self, known: Macro) {
        if let Some(scope) = self.all.get_mut(self.current) {
            scope.macros.insert(known.name.clone(), Rc::new(known));
        }
    }
}
