//! Declarations of a file: properties, arguments, macros.

use std::rc::Rc;

use super::Expansion;
use crate::error::{Fault, shown};
use crate::macros::{Macro, parameters};
use crate::scope::{Block, Entry};
use crate::source::Element;
use crate::value::Value;

impl Expansion<'_> {
    pub(super) fn property(&mut self, element: &Rc<Element>) -> Result<(), Fault> {
        let name = self.required(element, "name")?;
        let top = self.scopes.top();
        let level = match element.attribute("scope") {
            None | Some("" | "local") => top,
            Some("parent") => self.scopes.parent(top),
            Some("global") => 0,
            Some(scope) => {
                self.message(format!("the scope {} is unknown and counts as local", shown(scope)));
                top
            }
        };
        let is_lazy = element.attribute("lazy_eval").is_none_or(|word| Value::literal(word).truth());
        if let Some(remove) = element.attribute("remove")
            && self.value(remove, top)?.condition()?
        {
            self.scopes.remove(&name, top);
            return Ok(());
        }
        let (text, is_default) = match (element.attribute("value"), element.attribute("default")) {
            (Some(text), _) => (Some(text), false),
            (None, default) => (default, default.is_some()),
        };
        if is_default && self.scopes.entry(&name, top).is_some() {
            return Ok(());
        }
        let Some(text) = text else {
            self.scopes.set_block(level, &name, Block::Source(element.clone()));
            return Ok(());
        };
        let entry = match Value::literal(text) {
            Value::Text(text) if level != top || !is_lazy => {
                Entry::Value(self.value(&text, top)?.into_literal())
            }
            Value::Text(text) if text.contains('$') => Entry::Lazy(text),
            value => Entry::Value(value),
        };
        self.step(text.len() / 16)?;
        self.scopes.set(level, &name, entry);
        Ok(())
    }

    pub(super) fn declare_argument(&mut self, element: &Element) -> Result<(), Fault> {
        let name = self.required(element, "name")?;
        if let Some(default) = element.attribute("default").filter(|_| !self.arguments.contains_key(&name)) {
            let default = self.text(default, self.scopes.top())?;
            self.arguments.insert(name, default);
        }
        Ok(())
    }

    pub(super) fn define(&mut self, element: &Rc<Element>) -> Result<(), Fault> {
        let name = self.required(element, "name")?;
        let name = name.strip_prefix("xacro:").unwrap_or(&name).to_owned();
        let parameters = parameters(element.attribute("params").unwrap_or_default())?;
        self.scopes.set_macro(Macro { name, parameters, element: element.clone() });
        Ok(())
    }
}
