//! Calls in expressions: functions, methods, lambdas, and functions of xacro.

use std::rc::Rc;

use crate::error::{Fault, not_supported, shown};
use crate::expand::Expansion;
use crate::expression::{Argument, Clause, Comparison, Comprehension, Expression};
use crate::functions;
use crate::limits;
use crate::value::{Closure, Value, put};

/// Removes and returns the argument of a name.
fn take(named: &mut Vec<(Rc<str>, Value)>, wanted: &str) -> Option<Value> {
    let at = named.iter().position(|(name, _)| &**name == wanted)?;
    Some(named.swap_remove(at).1)
}

/// Positional and named arguments.
type Given = (Vec<Value>, Vec<(Rc<str>, Value)>);

impl Expansion<'_> {
    pub(super) fn call(
        &mut self,
        function: &Expression,
        arguments: &[Argument],
        level: usize,
    ) -> Result<Value, Fault> {
        if let Expression::Attribute(of, name) = function {
            let of = self.evaluate(of, level)?;
            if !matches!(of, Value::Module(_) | Value::Function(_) | Value::Namespace(_)) {
                let (given, named) = self.given(arguments, level)?;
                if !named.is_empty() {
                    return Err(not_supported("arguments by name of a method"));
                }
                return functions::method(&of, name, &given);
            }
            let function = self.attribute(&of, name)?;
            return self.call_value(&function, arguments, level);
        }
        let function = match function {
            // An unknown name is reported as an unknown function.
            Expression::Name(name) => {
                self.name(name, level).map_err(|fault| match self.scopes.entry(name, level) {
                    Some(_) => fault,
                    None => not_supported(&format!("the function {name}()")),
                })?
            }
            function => self.evaluate(function, level)?,
        };
        self.call_value(&function, arguments, level)
    }

    fn given(&mut self, arguments: &[Argument], level: usize) -> Result<Given, Fault> {
        let (mut given, mut named) = (Vec::new(), Vec::new());
        for argument in arguments {
            let value = self.evaluate(&argument.value, level)?;
            match &argument.name {
                Some(name) => named.push((name.clone(), value)),
                None => given.push(value),
            }
        }
        Ok((given, named))
    }

    fn call_value(&mut self, function: &Value, arguments: &[Argument], level: usize) -> Result<Value, Fault> {
        let (given, mut named) = self.given(arguments, level)?;
        let Value::Function(name) = function else {
            if !named.is_empty() {
                return Err(not_supported("arguments by name of a lambda"));
            }
            return self.apply(function, given);
        };
        let value = match (&**name, given.as_slice()) {
            ("dict", given) => {
                let mut map = Vec::new();
                if let [of] = given {
                    for (key, value) in functions::pairs(of).ok_or("dict() needs pairs")? {
                        put(&mut map, key, value);
                    }
                }
                self.step(map.len())?;
                for (key, value) in named.drain(..) {
                    put(&mut map, Value::text(&key), value);
                }
                Value::Map(Rc::new(map))
            }
            ("sorted", [all]) => {
                let key = take(&mut named, "key").unwrap_or(Value::None);
                let is_reverse = take(&mut named, "reverse").is_some_and(|value| value.truth());
                let mut all = self.keyed(all, &key)?;
                let mut unordered = None;
                all.sort_by(|(a, _), (b, _)| {
                    functions::order(a, b).unwrap_or_else(|fault| {
                        unordered = Some(fault);
                        std::cmp::Ordering::Equal
                    })
                });
                if let Some(fault) = unordered {
                    return Err(fault);
                }
                if is_reverse {
                    all.reverse();
                }
                Value::List(Rc::new(all.into_iter().map(|(_, value)| value).collect()))
            }
            ("min" | "max", [all]) if named.iter().any(|(name, _)| &**name == "key") => {
                let key = take(&mut named, "key").unwrap_or(Value::None);
                let wanted = if &**name == "max" { Comparison::Greater } else { Comparison::Less };
                let mut most: Option<(Value, Value)> = None;
                for (key, value) in self.keyed(all, &key)? {
                    let is_more = match &most {
                        Some((known, _)) => functions::compare(wanted, &key, known)?,
                        None => true,
                    };
                    if is_more {
                        most = Some((key, value));
                    }
                }
                most.ok_or_else(|| format!("{name}() of nothing"))?.1
            }
            // Options for the output of messages are ignored.
            (name, _) if name.starts_with("xacro.") => {
                named.clear();
                self.apply(function, given)?
            }
            _ => self.apply(function, given)?,
        };
        match named.first() {
            Some((name, _)) => Err(not_supported(&format!("the argument {} by name", shown(name)))),
            None => Ok(value),
        }
    }

    /// Returns the values of a list, each with the result of a function.
    fn keyed(&mut self, all: &Value, key: &Value) -> Result<Vec<(Value, Value)>, Fault> {
        let all = functions::items(all).ok_or_else(|| format!("{} has no entries", all.kind()))?;
        self.step(all.len())?;
        all.iter()
            .map(|value| match key {
                Value::None => Ok((value.clone(), value.clone())),
                key => Ok((self.apply(key, vec![value.clone()])?, value.clone())),
            })
            .collect()
    }

    /// Calls a function with positional arguments.
    fn apply(&mut self, function: &Value, given: Vec<Value>) -> Result<Value, Fault> {
        let message = |given: &[Value]| {
            let words: Result<Vec<String>, Fault> = given.iter().map(Value::show).collect();
            words.map(|words| words.join(" "))
        };
        let name = match function {
            Value::Function(name) => name,
            Value::Lambda(closure) => return self.apply_lambda(closure, given),
            function => return Err(format!("{} cannot be called", function.kind())),
        };
        match (&**name, given.as_slice()) {
            ("load_yaml" | "xacro.load_yaml", [file]) => {
                let file = file.show()?;
                self.load_yaml(&file)
            }
            ("xacro.arg", [name]) => self.argument(&name.show()?),
            ("xacro.message" | "xacro.warning", all) => {
                let message = message(all)?;
                self.message(message);
                Ok(Value::text(""))
            }
            ("xacro.print_location", _) => Ok(Value::text("")),
            ("xacro.error" | "xacro.fatal", all) => Err(message(all)?),
            ("xacro.dotify", [map]) => Ok(map.clone()),
            ("xacro.abs_filename", [name]) => Ok(Value::text(&self.absolute(&name.show()?))),
            ("xacro.tokenize", [text, more @ ..]) => {
                let by = more.first().map_or(Ok(",; ".to_owned()), Value::show)?;
                let text = text.show()?;
                let words = text.split(|c| by.contains(c)).filter(|word| !word.is_empty());
                Ok(Value::List(Rc::new(words.map(Value::text).collect())))
            }
            (name, _) if name.starts_with("xacro.") => Err(not_supported(&format!("{name}()"))),
            ("eval.arg", [name]) => Ok(super::automatic(&self.argument(&name.show()?)?)),
            ("eval.find", [name]) => Ok(Value::text(&format!("package://{}", name.show()?))),
            ("eval.dirname", []) => Ok(Value::text(&self.folder())),
            ("eval.env", [name]) => self.variable(&name.show()?, None),
            ("eval.optenv", [name, default @ ..]) => {
                let default = default.first().map_or(Ok(String::new()), Value::show)?;
                self.variable(&name.show()?, Some(&default))
            }
            ("map", [function, lists @ ..]) if !lists.is_empty() => {
                let lists: Option<Vec<_>> = lists.iter().map(functions::items).collect();
                let lists = lists.ok_or("map() needs lists, texts or dictionaries")?;
                let length = lists.iter().map(|list| list.len()).min().unwrap_or(0);
                let mut made = Vec::new();
                for index in 0..length {
                    self.step(1)?;
                    let given = lists.iter().filter_map(|list| list.get(index).cloned()).collect();
                    made.push(self.apply(function, given)?);
                }
                Ok(Value::List(Rc::new(made)))
            }
            ("filter", [function, all]) => {
                let kept = self.keyed(all, function)?.into_iter().filter(|(is, _)| is.truth());
                Ok(Value::List(Rc::new(kept.map(|(_, value)| value).collect())))
            }
            // A method of a type: `str.strip`.
            (name, [of, rest @ ..]) if name.starts_with("str.") => {
                functions::method(of, name.trim_start_matches("str."), rest)
            }
            (name, all) => functions::call(name, all),
        }
    }

    fn apply_lambda(&mut self, closure: &Closure, given: Vec<Value>) -> Result<Value, Fault> {
        if given.len() != closure.parameters.len() {
            let wanted = closure.parameters.len();
            return Err(format!("a lambda with {wanted} parameters is called with {} values", given.len()));
        }
        self.step(closure.locals.len())?;
        let mut locals = closure.locals.clone();
        locals.extend(closure.parameters.iter().cloned().zip(given));
        let outer = std::mem::replace(&mut self.locals, locals);
        let value = self.evaluate(&closure.body, closure.level);
        self.locals = outer;
        value
    }

    /// Evaluates a comprehension.
    pub(super) fn comprehend(&mut self, of: &Comprehension, level: usize) -> Result<Value, Fault> {
        let known = self.locals.len();
        let mut made = Vec::new();
        self.clause(of, &of.clauses, level, &mut made)?;
        self.locals.truncate(known);
        if of.key.is_none() {
            return Ok(Value::List(Rc::new(made.into_iter().map(|(_, value)| value).collect())));
        }
        let mut map = Vec::new();
        for (key, value) in made {
            self.step(map.len() / 4)?;
            put(&mut map, key, value);
        }
        Ok(Value::Map(Rc::new(map)))
    }

    fn clause(
        &mut self,
        of: &Comprehension,
        clauses: &[Clause],
        level: usize,
        made: &mut Vec<(Value, Value)>,
    ) -> Result<(), Fault> {
        match clauses {
            [] => {
                if made.len() >= limits::ENTRIES {
                    return Err(format!("a comprehension gives more than {} values", limits::ENTRIES));
                }
                let key = of.key.as_ref().map_or(Ok(Value::None), |key| self.evaluate(key, level))?;
                made.push((key, self.evaluate(&of.value, level)?));
            }
            [Clause::If(condition), rest @ ..] => {
                if self.evaluate(condition, level)?.truth() {
                    self.clause(of, rest, level, made)?;
                }
            }
            [Clause::For(names, all), rest @ ..] => {
                let all = self.evaluate(all, level)?;
                let all = functions::items(&all).ok_or_else(|| format!("{} has no entries", all.kind()))?;
                let known = self.locals.len();
                for value in all.iter() {
                    self.step(1)?;
                    self.locals.truncate(known);
                    if let [name] = names.as_slice() {
                        self.locals.push((name.clone(), value.clone()));
                    } else {
                        let parts = functions::items(value).filter(|parts| parts.len() == names.len());
                        let parts = parts.ok_or_else(|| format!("a value is not {} values", names.len()))?;
                        self.locals.extend(names.iter().cloned().zip(parts.iter().cloned()));
                    }
                    self.clause(of, rest, level, made)?;
                }
            }
        }
        Ok(())
    }
}
