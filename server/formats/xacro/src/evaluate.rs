//! Evaluates texts and expressions to values.

mod call;

use std::rc::Rc;

use crate::error::{Fault, not_supported, shown};
use crate::expand::Expansion;
use crate::expression::{self, Expression};
use crate::functions;
use crate::limits;
use crate::scope::Entry;
use crate::text::{Part, parts};
use crate::value::{Closure, Value, put, too_long};

impl Expansion<'_> {
    /// Evaluates the expressions in a text. A text that is a single expression keeps its type.
    pub(crate) fn value(&mut self, text: &str, level: usize) -> Result<Value, Fault> {
        let parts = parts(text)?;
        if let [only] = parts.as_slice() {
            return self.part(only, level);
        }
        let mut whole = String::new();
        for part in &parts {
            whole += &self.part(part, level)?.show()?;
            if whole.len() > limits::VALUE_BYTES {
                return Err(too_long());
            }
        }
        Ok(Value::text(&whole))
    }

    /// Like [`value`](Self::value), as a text.
    pub(crate) fn text(&mut self, text: &str, level: usize) -> Result<String, Fault> {
        let text = self.value(text, level)?.show()?;
        self.step(text.len() / 16)?;
        Ok(text)
    }

    fn part(&mut self, part: &Part, level: usize) -> Result<Value, Fault> {
        match part {
            Part::Plain(text) => Ok(Value::text(text)),
            Part::Command(command) => self.command(command, level),
            Part::Expression(text) => {
                self.expression(text, level).map_err(|fault| in_expression(text, &fault))
            }
        }
    }

    /// Evaluates the content of `${}`. Commands in it are first replaced by their text, also within quotes:
    /// `${'$(arg side)' == 'left'}`.
    fn expression(&mut self, text: &str, level: usize) -> Result<Value, Fault> {
        let expression = if text.contains('$') {
            expression::parse(&self.inner_text(text, level)?)?
        } else {
            expression::parse(text)?
        };
        self.evaluate(&expression, level)
    }

    /// Returns the content of `${}` or `$()` as text; it may contain more of both.
    fn inner_text(&mut self, text: &str, level: usize) -> Result<String, Fault> {
        self.enter()?;
        self.step(text.len() / 16)?;
        let text = self.text(text, level)?;
        self.expression_depth -= 1;
        Ok(text)
    }

    /// Counts the nesting depth of expressions. An error ends the expansion of the element, which restarts at
    /// 0.
    fn enter(&mut self) -> Result<(), Fault> {
        self.expression_depth += 1;
        if self.expression_depth > limits::EXPRESSION_DEPTH {
            return Err(
                "an expression, with all the properties that it names, is nested too deeply".to_owned()
            );
        }
        Ok(())
    }

    /// Evaluates the content of `$()`.
    fn command(&mut self, command: &str, level: usize) -> Result<Value, Fault> {
        // A name may itself be an expression: `$(find ${package})`.
        let command = self.inner_text(command, level)?;
        if let Some(expression) = command.strip_prefix("eval ") {
            return self.eval(expression, level).map_err(|fault| format!("{fault}, in $(eval {expression})"));
        }
        let mut words = command.split_whitespace();
        match (words.next(), words.next(), words.next()) {
            (Some("arg"), Some(name), None) => self.argument(name),
            (Some("find"), Some(package), None) => Ok(Value::text(&format!("package://{package}"))),
            (Some("dirname"), None, None) => Ok(Value::text(&self.folder())),
            (Some("env"), Some(name), None) => self.variable(name, None),
            (Some("optenv"), Some(name), _) => {
                let default: Vec<&str> = command.split_whitespace().skip(2).collect();
                self.variable(name, Some(&default.join(" ")))
            }
            (Some(name), _, _) => Err(not_supported(&format!("$({name} ...)"))),
            (None, _, _) => Err("$() holds nothing".to_owned()),
        }
    }

    /// Evaluates `$(eval ...)`: an expression that sees arguments and no properties. The result is a text.
    fn eval(&mut self, expression: &str, level: usize) -> Result<Value, Fault> {
        if expression.contains("__") {
            return Err(not_supported("`__` in $(eval ...)"));
        }
        let expression = expression::parse(expression)?;
        let outer = (std::mem::replace(&mut self.in_eval, true), std::mem::take(&mut self.locals));
        let value = self.evaluate(&expression, level);
        (self.in_eval, self.locals) = outer;
        Ok(Value::text(&value?.show()?))
    }

    /// Evaluates an expression of a YAML file, which sees functions but no names of the robot.
    pub(crate) fn number(&mut self, text: &str) -> Result<Value, Fault> {
        let outer = (std::mem::replace(&mut self.in_eval, true), std::mem::take(&mut self.locals));
        let value = expression::parse(text).and_then(|expression| self.evaluate(&expression, 0));
        (self.in_eval, self.locals) = outer;
        value
    }

    /// Returns an environment variable, which the caller passes as an argument of that name.
    fn variable(&mut self, name: &str, default: Option<&str>) -> Result<Value, Fault> {
        if let Some(given) = self.given.get(name) {
            return Ok(Value::text(given));
        }
        let Some(default) = default else {
            return Err(format!(
                "$(env {name}) is not given: files cannot read your environment; pass the argument {name}=VALUE"
            ));
        };
        self.message(format!(
            "$(optenv {name}) takes its default {}: files cannot read your environment; the argument {name}=VALUE gives another value",
            shown(default)
        ));
        Ok(Value::text(default))
    }

    fn argument(&self, name: &str) -> Result<Value, Fault> {
        let found = self.arguments.get(name).map(|text| Value::text(text));
        found.ok_or_else(|| format!("the argument {} is not given and has no default", shown(name)))
    }

    /// Returns the value of a name: a property, or a builtin of Python or xacro.
    fn name(&mut self, name: &str, from: usize) -> Result<Value, Fault> {
        if let Some((_, local)) = self.locals.iter().rev().find(|(known, _)| &**known == name) {
            return Ok(local.clone());
        }
        if self.in_eval {
            let special = ["arg", "find", "dirname", "env", "optenv"].contains(&name);
            let special = special.then(|| Value::Function(Rc::from(format!("eval.{name}"))));
            let known = special.or_else(|| functions::builtin(name));
            return match (known, self.arguments.get(name)) {
                (Some(known), _) => Ok(known),
                (None, Some(argument)) => Ok(automatic(&Value::text(argument))),
                (None, None) => Err(format!("{} is not defined", shown(name))),
            };
        }
        let Some((level, entry)) = self.scopes.entry(name, from) else {
            return functions::builtin(name).ok_or_else(|| format!("{} is not defined", shown(name)));
        };
        match entry {
            Entry::Value(value) => Ok(value),
            Entry::Busy => Err(format!("the property {} is defined by itself", shown(name))),
            Entry::Lazy(text) => {
                self.scopes.set(level, name, Entry::Busy);
                // A property does not see the variables of the comprehension that uses it.
                let locals = std::mem::take(&mut self.locals);
                let value = self.value(&text, level).map(Value::into_literal);
                self.locals = locals;
                let entry = value.clone().map_or(Entry::Lazy(text), Entry::Value);
                self.scopes.set(level, name, entry);
                value.map_err(|fault| format!("in the property {}: {fault}", shown(name)))
            }
        }
    }

    fn evaluate(&mut self, expression: &Expression, level: usize) -> Result<Value, Fault> {
        self.step(1)?;
        self.enter()?;
        let value = self.evaluate_one(expression, level)?;
        self.expression_depth -= 1;
        self.step(match &value {
            Value::List(list) => list.len(),
            Value::Map(map) => map.len(),
            Value::Text(text) => text.len() / 16,
            _ => 0,
        })?;
        Ok(value)
    }

    fn evaluate_one(&mut self, expression: &Expression, level: usize) -> Result<Value, Fault> {
        Ok(match expression {
            Expression::Value(value) => value.clone(),
            Expression::Name(name) => self.name(name, level)?,
            Expression::List(all) => Value::List(Rc::new(self.evaluate_all(all, level)?)),
            Expression::Map(all) => {
                let mut map: Vec<(Value, Value)> = Vec::new();
                for (key, value) in all {
                    let (key, value) = (self.evaluate(key, level)?, self.evaluate(value, level)?);
                    self.step(map.len() / 4)?;
                    put(&mut map, key, value);
                }
                Value::Map(Rc::new(map))
            }
            Expression::Not(inner) => Value::Bool(!self.evaluate(inner, level)?.truth()),
            Expression::Minus(inner) => match self.evaluate(inner, level)? {
                Value::Float(float) => Value::Float(-float),
                value => functions::binary(expression::Operator::Subtract, &Value::Int(0), &value)?,
            },
            Expression::Binary(operator, a, b) => {
                let (a, b) = (self.evaluate(a, level)?, self.evaluate(b, level)?);
                functions::binary(*operator, &a, &b)?
            }
            Expression::Compare(first, others) => {
                let mut left = self.evaluate(first, level)?;
                for (comparison, right) in others {
                    let right = self.evaluate(right, level)?;
                    if !functions::compare(*comparison, &left, &right)? {
                        return Ok(Value::Bool(false));
                    }
                    left = right;
                }
                Value::Bool(true)
            }
            Expression::And(a, b) => match self.evaluate(a, level)? {
                value if value.truth() => self.evaluate(b, level)?,
                value => value,
            },
            Expression::Or(a, b) => match self.evaluate(a, level)? {
                value if value.truth() => value,
                _ => self.evaluate(b, level)?,
            },
            Expression::If(all) => {
                let [then, condition, otherwise] = &**all;
                let is = self.evaluate(condition, level)?.truth();
                self.evaluate(if is { then } else { otherwise }, level)?
            }
            Expression::Index(of, index) => {
                let (of, index) = (self.evaluate(of, level)?, self.evaluate(index, level)?);
                self.index(&of, &index)?
            }
            Expression::Slice(of, parts) => {
                let of = self.evaluate(of, level)?;
                let mut bounds = [None; 3];
                for (bound, part) in bounds.iter_mut().zip(parts.iter()) {
                    if let Some(part) = part {
                        let part = self.evaluate(part, level)?;
                        *bound = Some(part.int().ok_or_else(|| format!("{} is not an index", part.kind()))?);
                    }
                }
                functions::slice(&of, bounds)?
            }
            Expression::Comprehension(of) => self.comprehend(of, level)?,
            Expression::Lambda(parameters, body) => {
                self.step(self.locals.len())?;
                let (parameters, body) = (parameters.clone(), body.clone());
                let locals = self.locals.clone();
                Value::Lambda(Rc::new(Closure { parameters, body, locals, level }))
            }
            Expression::Attribute(of, name) => {
                let of = self.evaluate(of, level)?;
                self.attribute(&of, name)?
            }
            Expression::Call(function, arguments) => self.call(function, arguments, level)?,
        })
    }

    fn evaluate_all(&mut self, all: &[Expression], level: usize) -> Result<Vec<Value>, Fault> {
        all.iter().map(|expression| self.evaluate(expression, level)).collect()
    }

    /// Returns an entry; the search is linear.
    fn index(&mut self, of: &Value, index: &Value) -> Result<Value, Fault> {
        self.step(match of {
            Value::Map(map) => map.len() / 4,
            Value::Text(text) => text.len() / 4,
            _ => 0,
        })?;
        functions::index(of, index)
    }

    /// Returns the attribute after a dot: of a module, or an entry of a dictionary.
    fn attribute(&mut self, of: &Value, name: &str) -> Result<Value, Fault> {
        match of {
            Value::Module("xacro") => Ok(Value::Function(Rc::from(format!("xacro.{name}")))),
            Value::Module(module) => {
                functions::builtin(name).ok_or_else(|| not_supported(&format!("{module}.{name}")))
            }
            Value::Function(function) if &**function == "str" => {
                Ok(Value::Function(Rc::from(format!("str.{name}"))))
            }
            Value::Namespace(level) => self.name(name, *level),
            Value::Map(_) => self.index(of, &Value::text(name)),
            _ => Err(not_supported(&format!("the attribute {} of {}", shown(name), of.kind()))),
        }
    }
}

/// Returns an argument as `$(eval ...)` sees it: a number or a boolean if it reads as one.
fn automatic(value: &Value) -> Value {
    let Value::Text(text) = value else { return value.clone() };
    let number = match text.contains('.') {
        true => crate::value::float(text).map(Value::Float),
        false => text.trim().parse().ok().map(Value::Int),
    };
    number.unwrap_or_else(|| match text.to_lowercase().as_str() {
        "true" => Value::Bool(true),
        "false" => Value::Bool(false),
        _ => value.clone(),
    })
}

fn in_expression(text: &str, fault: &str) -> Fault {
    // Only the innermost expression is reported.
    if fault.ends_with('}') { fault.to_owned() } else { format!("{fault}, in ${{{}}}", short(text)) }
}

fn short(text: &str) -> String {
    let text: Vec<&str> = text.split_whitespace().collect();
    text.join(" ").chars().take(80).collect()
}
