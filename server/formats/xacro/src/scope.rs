//! Properties and macros by name. A macro's call hides the names of its caller, and includes can have
//! namespaces.

use std::collections::HashMap;
use std::rc::Rc;

use crate::macros::Macro;
use crate::source::Element;
use crate::value::Value;
use crate::write::Made;

/// Entry of a name.
#[derive(Clone, Debug)]
pub(crate) enum Entry {
    Value(Value),
    /// Computed at its first use, with the names that are known then.
    Lazy(Rc<str>),
    /// Being computed: a request for it is a cycle.
    Busy,
}

/// Content for `insert_block`.
#[derive(Clone, Debug)]
pub(crate) enum Block {
    /// The content of a property, expanded where it is inserted.
    Source(Rc<Element>),
    /// An expanded argument of a call.
    Made(Rc<Vec<Made>>),
}

/// One level of names.
#[derive(Debug, Default)]
struct Scope {
    /// Index of the scope that is searched next.
    parent: Option<usize>,
    /// Whether it belongs to an include with `ns`.
    is_namespace: bool,
    entries: HashMap<String, Entry>,
    blocks: HashMap<String, Block>,
    macros: HashMap<String, Rc<Macro>>,
}

/// All scopes; the file's own is the first.
#[derive(Debug)]
pub(crate) struct Scopes {
    all: Vec<Scope>,
    current: usize,
}

/// State that [`Scopes::leave`] restores.
pub(crate) struct Mark {
    current: usize,
    length: usize,
}

impl Scopes {
    /// Makes the scope of a file.
    pub(crate) fn new() -> Self {
        Self { all: vec![Scope::default()], current: 0 }
    }

    /// Begins the scope of a macro's call.
    pub(crate) fn enter(&mut self, parent: usize) -> Mark {
        let mark = Mark { current: self.current, length: self.all.len() };
        self.current = mark.length;
        self.all.push(Scope { parent: Some(parent.min(mark.length - 1)), ..Scope::default() });
        mark
    }

    /// Ends the scope, with its namespaces.
    pub(crate) fn leave(&mut self, mark: &Mark) {
        self.all.truncate(mark.length);
        self.current = mark.current;
    }

    /// Begins a namespace that the current scope keeps under a name. Returns the scope to come back to.
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

    /// Returns the innermost scope.
    pub(crate) fn top(&self) -> usize {
        self.current
    }

    /// Returns the caller's scope, for `scope="parent"`. Skips namespaces between a macro and its caller.
    pub(crate) fn parent(&self, level: usize) -> usize {
        let parent = |level: usize| self.all.get(level).and_then(|scope| scope.parent);
        let is_namespace = |level: usize| self.all.get(level).is_some_and(|scope| scope.is_namespace);
        let mut above = parent(level).unwrap_or(level);
        while !is_namespace(level) && is_namespace(above) {
            above = parent(above).unwrap_or(0);
        }
        above
    }

    /// Iterates from a scope outwards.
    fn outwards(&self, from: usize) -> impl Iterator<Item = (usize, &Scope)> {
        let mut next = Some(from);
        std::iter::from_fn(move || {
            let level = next?;
            let scope = self.all.get(level)?;
            next = scope.parent;
            Some((level, scope))
        })
    }

    /// Returns the entry that a scope sees, and the scope that has it.
    pub(crate) fn entry(&self, name: &str, from: usize) -> Option<(usize, Entry)> {
        self.outwards(from).find_map(|(level, scope)| Some((level, scope.entries.get(name)?.clone())))
    }

    /// Sets an entry of a scope.
    pub(crate) fn set(&mut self, level: usize, name: &str, entry: Entry) {
        if let Some(scope) = self.all.get_mut(level) {
            scope.entries.insert(name.to_owned(), entry);
        }
    }

    /// Removes a property from all scopes that a scope sees.
    pub(crate) fn remove(&mut self, name: &str, from: usize) {
        let levels: Vec<usize> = self.outwards(from).map(|(level, _)| level).collect();
        for level in levels {
            if let Some(scope) = self.all.get_mut(level) {
                scope.entries.remove(name);
            }
        }
    }

    /// Returns the block that the innermost scope sees.
    pub(crate) fn block(&self, name: &str) -> Option<Block> {
        self.outwards(self.current).find_map(|(_, scope)| scope.blocks.get(name)).cloned()
    }

    /// Sets a block of a scope.
    pub(crate) fn set_block(&mut self, level: usize, name: &str, block: Block) {
        if let Some(scope) = self.all.get_mut(level) {
            scope.blocks.insert(name.to_owned(), block);
        }
    }

    /// Returns the macro that the innermost scope sees, and the scope of its call: for `namespace.name`, the
    /// scope of its namespace.
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

    /// Sets a macro of the innermost scope.
    pub(crate) fn set_macro(&mut self, known: Macro) {
        if let Some(scope) = self.all.get_mut(self.current) {
            scope.macros.insert(known.name.clone(), Rc::new(known));
        }
    }
}
