//! Values, and what stands in brackets: calls, indices, lists, dictionaries and comprehensions.

use std::rc::Rc;

use super::token::Token;
use super::{Argument, Clause, Comprehension, Expression, Parser};
use crate::error::Fault;
use crate::value::Value;

/// Content of brackets.
enum Items {
    All(Vec<Expression>),
    Comprehension(Expression),
}

impl Parser {
    pub(super) fn postfix(&mut self) -> Result<Expression, Fault> {
        let mut left = self.atom()?;
        loop {
            if self.take("(") {
                let arguments = self.arguments()?;
                left = Expression::Call(Box::new(left), arguments);
            } else if self.take("[") {
                left = self.index(left)?;
            } else if self.take(".") {
                let Some(Token::Name(name)) = self.peek().cloned() else { return Err(self.unexpected()) };
                self.at += 1;
                left = Expression::Attribute(Box::new(left), name.into());
            } else {
                return Ok(left);
            }
        }
    }

    fn atom(&mut self) -> Result<Expression, Fault> {
        let Some(token) = self.peek().cloned() else { return Err(self.unexpected()) };
        let value = match token {
            Token::Int(int) => Value::Int(int),
            Token::Float(float) => Value::Float(float),
            Token::Text(mut text) => {
                // Adjacent texts are joined.
                while let Some(Token::Text(more)) = self.tokens.get(self.at + 1) {
                    text.push_str(more);
                    self.at += 1;
                }
                Value::text(&text)
            }
            Token::Name(name) => match name.as_str() {
                "True" | "true" => Value::Bool(true),
                "False" | "false" => Value::Bool(false),
                "None" => Value::None,
                "lambda" | "for" | "if" | "else" | "in" | "and" | "or" | "is" => {
                    return Err(self.unexpected());
                }
                _ => {
                    self.at += 1;
                    return Ok(Expression::Name(name.into()));
                }
            },
            Token::Sign("(") => {
                self.at += 1;
                let mut inner = match self.items(")")? {
                    Items::All(all) => all,
                    Items::Comprehension(made) => return Ok(made),
                };
                let is_tuple = matches!(self.tokens.get(self.at.saturating_sub(2)), Some(Token::Sign(",")));
                return Ok(match inner.pop() {
                    Some(only) if inner.is_empty() && !is_tuple => only,
                    last => {
                        inner.extend(last);
                        Expression::List(inner)
                    }
                });
            }
            Token::Sign("[") => {
                self.at += 1;
                return Ok(match self.items("]")? {
                    Items::All(all) => Expression::List(all),
                    Items::Comprehension(made) => made,
                });
            }
            Token::Sign("{") => {
                self.at += 1;
                return self.map();
            }
            Token::Sign(_) => return Err(self.unexpected()),
        };
        self.at += 1;
        Ok(Expression::Value(value))
    }

    /// Parses names with commas between them, with or without brackets.
    pub(super) fn names(&mut self) -> Result<Vec<Rc<str>>, Fault> {
        let bracket = self.take("(");
        let mut names = Vec::new();
        while let Some(Token::Name(name)) = self.peek().cloned() {
            if name == "in" {
                break;
            }
            self.at += 1;
            names.push(name.into());
            if !self.take(",") {
                break;
            }
        }
        if bracket {
            self.expect(")")?;
        }
        if names.is_empty() { Err(self.unexpected()) } else { Ok(names) }
    }

    /// Parses any number of `for a in b if c` at this place.
    fn clauses(&mut self) -> Result<Vec<Clause>, Fault> {
        let mut clauses = Vec::new();
        loop {
            if self.take_word("for") {
                let names = self.names()?;
                if !self.take_word("in") {
                    return Err(format!("{} instead of `in`", self.unexpected()));
                }
                clauses.push(Clause::For(names, self.or()?));
            } else if !clauses.is_empty() && self.take_word("if") {
                clauses.push(Clause::If(self.or()?));
            } else {
                return Ok(clauses);
            }
        }
    }

    /// Parses up to the closing bracket, including it.
    fn items(&mut self, close: &str) -> Result<Items, Fault> {
        let mut all = Vec::new();
        while !self.take(close) {
            let value = self.expression()?;
            let clauses = if all.is_empty() { self.clauses()? } else { Vec::new() };
            if !clauses.is_empty() {
                self.expect(close)?;
                let made = Comprehension { key: None, value, clauses };
                return Ok(Items::Comprehension(Expression::Comprehension(Box::new(made))));
            }
            all.push(value);
            if !self.take(",") {
                self.expect(close)?;
                break;
            }
        }
        Ok(Items::All(all))
    }

    /// Parses the arguments of a call, up to its closing bracket.
    fn arguments(&mut self) -> Result<Vec<Argument>, Fault> {
        let mut all = Vec::new();
        while !self.take(")") {
            let name = match (self.peek(), self.tokens.get(self.at + 1)) {
                (Some(Token::Name(name)), Some(Token::Sign("="))) => Some(Rc::from(name.as_str())),
                _ => None,
            };
            self.at += if name.is_some() { 2 } else { 0 };
            let value = self.expression()?;
            let clauses = if name.is_none() { self.clauses()? } else { Vec::new() };
            let value = match clauses.is_empty() {
                true => value,
                false => Expression::Comprehension(Box::new(Comprehension { key: None, value, clauses })),
            };
            all.push(Argument { name, value });
            if !self.take(",") {
                self.expect(")")?;
                break;
            }
        }
        Ok(all)
    }

    /// Parses an index or a slice after `[`.
    fn index(&mut self, of: Expression) -> Result<Expression, Fault> {
        let mut parts = [None, None, None];
        let mut colons = 0;
        loop {
            if self.take("]") {
                break;
            }
            if colons < 2 && self.take(":") {
                colons += 1;
                continue;
            }
            match parts.get_mut(colons) {
                Some(part @ None) => *part = Some(self.expression()?),
                _ => return Err(self.unexpected()),
            }
        }
        match parts {
            [Some(index), None, None] if colons == 0 => Ok(Expression::Index(Box::new(of), Box::new(index))),
            _ if colons == 0 => Err("an index is empty".to_owned()),
            parts => Ok(Expression::Slice(Box::new(of), Box::new(parts))),
        }
    }

    /// Parses a dictionary after `{`, or a set, which becomes a list.
    fn map(&mut self) -> Result<Expression, Fault> {
        let mut all = Vec::new();
        let mut set = Vec::new();
        while !self.take("}") {
            let key = self.expression()?;
            let (key, value) = match self.take(":") {
                true => (Some(key), self.expression()?),
                false => (None, key),
            };
            let clauses = if all.is_empty() && set.is_empty() { self.clauses()? } else { Vec::new() };
            if !clauses.is_empty() {
                self.expect("}")?;
                return Ok(Expression::Comprehension(Box::new(Comprehension { key, value, clauses })));
            }
            match key {
                Some(key) => all.push((key, value)),
                None => set.push(value),
            }
            if !self.take(",") {
                self.expect("}")?;
                break;
            }
        }
        match (all.is_empty(), set.is_empty()) {
            (_, true) => Ok(Expression::Map(all)),
            (true, false) => Ok(Expression::List(set)),
            (false, false) => Err("a dictionary has an entry without a key".to_owned()),
        }
    }
}
