//! Calls of macros: parameters, blocks, and their expansion.

use std::collections::BTreeMap;
use std::rc::Rc;

use super::{Body, Expansion};
use crate::error::{Error, Fault, shown};
use crate::macros::Parameter;
use crate::scope::{Block, Entry};
use crate::source::{Element, XACRO};
use crate::value::Value;
use crate::write::Made;

impl Expansion<'_> {
    pub(super) fn call_macro(
        &mut self,
        name: &str,
        element: &Rc<Element>,
        depth: usize,
        body: &mut Body,
    ) -> Result<(), Error> {
        let Some((known, parent)) = self.scopes.find_macro(name) else {
            return Err(self.at(element, format!("there is no macro {}", shown(name))));
        };
        let top = self.scopes.top();
        let mut values = BTreeMap::new();
        for (key, text) in element
            .attributes
            .iter()
            .filter(|(key, _)| !(key.starts_with(XACRO) || element.name == "call" && key == "macro"))
        {
            let is_known =
                known.parameters.iter().any(|p| matches!(p, Parameter::Value { name, .. } if name == key));
            if !is_known {
                let message = format!("the macro {} has no parameter {}", shown(name), shown(key));
                return Err(self.at(element, message));
            }
            let value = self.value(text, top).map_err(|fault| self.at(element, fault))?;
            values.insert(key.clone(), value.into_literal());
        }
        // Blocks are the elements in the call, expanded in the scope of the caller.
        let mut blocks = Vec::new();
        let given = self.children(element, depth + 1)?;
        let mut given = given.made.into_iter().filter_map(|made| match made {
            Made::Element(element) => Some(element),
            Made::Text(_) => None,
        });
        for parameter in &known.parameters {
            match parameter {
                Parameter::Block { name: block, content } => {
                    let Some(made) = given.next() else {
                        let message = format!("the call of {} lacks the block {}", shown(name), shown(block));
                        return Err(self.at(element, message));
                    };
                    let made = if *content { made.children.clone() } else { vec![Made::Element(made)] };
                    blocks.push((block.clone(), Block::Made(Rc::new(made))));
                }
                Parameter::Value { name: parameter, forward, default } if !values.contains_key(parameter) => {
                    let value = self.default(parameter, *forward, default.as_deref(), top);
                    let value = value.map_err(|fault| {
                        self.at(
                            element,
                            format!("the call of {} lacks {}: {fault}", shown(name), shown(parameter)),
                        )
                    })?;
                    values.insert(parameter.clone(), value);
                }
                Parameter::Value { .. } => {}
            }
        }
        if given.next().is_some() {
            return Err(self.at(element, format!("the call of {} has one block too many", shown(name))));
        }
        let mark = self.scopes.enter(parent);
        let level = self.scopes.top();
        for (name, value) in values {
            self.scopes.set(level, &name, Entry::Value(value));
        }
        for (name, block) in blocks {
            self.scopes.set_block(level, &name, block);
        }
        let outer = std::mem::replace(&mut self.file, known.element.file);
        self.content(&known.element, depth, body)?;
        self.file = outer;
        self.scopes.leave(&mark);
        Ok(())
    }

    fn default(
        &mut self,
        name: &str,
        forward: bool,
        default: Option<&str>,
        level: usize,
    ) -> Result<Value, Fault> {
        if forward && self.scopes.entry(name, level).is_some() {
            return self.value(&format!("${{{name}}}"), level);
        }
        let default = default.ok_or("it has no default")?;
        Ok(self.value(default, level)?.into_literal())
    }
}
