//! Parses expressions of Python to trees.

mod token;

use std::rc::Rc;

use self::token::{Token, tokens};
use crate::error::{Fault, not_supported, shown};
use crate::limits;
use crate::value::Value;

/// An expression.
#[derive(Debug)]
pub(crate) enum Expression {
    Value(Value),
    Name(Rc<str>),
    List(Vec<Expression>),
    Map(Vec<(Expression, Expression)>),
    Not(Box<Expression>),
    Minus(Box<Expression>),
    Binary(Operator, Box<Expression>, Box<Expression>),
    /// Compares each with the one before it: `a < b < c`.
    Compare(Box<Expression>, Vec<(Comparison, Expression)>),
    And(Box<Expression>, Box<Expression>),
    Or(Box<Expression>, Box<Expression>),
    /// Value if true, condition, value if false.
    If(Box<[Expression; 3]>),
    Call(Box<Expression>, Vec<Argument>),
    Index(Box<Expression>, Box<Expression>),
    /// First, end, step.
    Slice(Box<Expression>, Box<[Option<Expression>; 3]>),
    Comprehension(Box<Comprehension>),
    Lambda(Vec<Rc<str>>, Rc<Expression>),
    Attribute(Box<Expression>, Rc<str>),
}

/// `[value for name in all if condition]`, in any brackets.
#[derive(Debug)]
pub(crate) struct Comprehension {
    /// Key, for a dictionary.
    pub(crate) key: Option<Expression>,
    pub(crate) value: Expression,
    pub(crate) clauses: Vec<Clause>,
}

/// A part of a comprehension, which applies to all parts after it.
#[derive(Debug)]
pub(crate) enum Clause {
    For(Vec<Rc<str>>, Expression),
    If(Expression),
}

/// An argument of a call, named or positional.
#[derive(Debug)]
pub(crate) struct Argument {
    pub(crate) name: Option<Rc<str>>,
    pub(crate) value: Expression,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Operator {
    Add,
    Subtract,
    Multiply,
    Divide,
    FloorDivide,
    Modulo,
    Power,
    And,
    Or,
    ExclusiveOr,
    ShiftLeft,
    ShiftRight,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Comparison {
    Equal,
    NotEqual,
    Less,
    LessEqual,
    Greater,
    GreaterEqual,
    In,
    NotIn,
    Is,
    IsNot,
}

/// Parses the whole text.
pub(crate) fn parse(text: &str) -> Result<Expression, Fault> {
    if text.len() > limits::VALUE_BYTES {
        return Err(format!("an expression is longer than {} bytes", limits::VALUE_BYTES));
    }
    let mut parser = Parser { tokens: tokens(text)?, at: 0, depth: 0 };
    let expression = parser.expression()?;
    match parser.peek() {
        None => Ok(expression),
        // `a, b` without brackets is a tuple.
        Some(Token::Sign(",")) => {
            let mut all = vec![expression];
            while parser.take(",") {
                if parser.peek().is_some() {
                    all.push(parser.expression()?);
                }
            }
            if parser.peek().is_some() { Err(parser.unexpected()) } else { Ok(Expression::List(all)) }
        }
        Some(_) => Err(parser.unexpected()),
    }
}

struct Parser {
    tokens: Vec<Token>,
    at: usize,
    depth: usize,
}

impl Parser {
    fn peek(&self) -> Option<&Token> {
        self.tokens.get(self.at)
    }

    fn take(&mut self, sign: &str) -> bool {
        let is = matches!(self.peek(), Some(Token::Sign(found)) if *found == sign);
        self.at += usize::from(is);
        is
    }

    fn take_word(&mut self, word: &str) -> bool {
        let is = matches!(self.peek(), Some(Token::Name(found)) if found == word);
        self.at += usize::from(is);
        is
    }

    fn expect(&mut self, sign: &str) -> Result<(), Fault> {
        if self.take(sign) { Ok(()) } else { Err(format!("{} instead of `{sign}`", self.unexpected())) }
    }

    fn unexpected(&self) -> Fault {
        match self.peek() {
            None => "the expression ends too early".to_owned(),
            Some(Token::Name(word) | Token::Text(word)) => format!("unexpected {}", shown(word)),
            Some(Token::Sign(sign @ ("~" | "@"))) => not_supported(&format!("the operator `{sign}`")),
            Some(Token::Sign(sign)) => format!("unexpected `{sign}`"),
            Some(Token::Int(_) | Token::Float(_)) => "an unexpected number".to_owned(),
        }
    }

    /// Counts nesting: called for each bracket and each sign before a value.
    fn deeper(&mut self) -> Result<(), Fault> {
        self.depth += 1;
        if self.depth > limits::BRACKETS {
            return Err(format!("an expression is nested deeper than {}", limits::BRACKETS));
        }
        Ok(())
    }

    fn expression(&mut self) -> Result<Expression, Fault> {
        self.deeper()?;
        if self.take_word("lambda") {
            let parameters =
                if matches!(self.peek(), Some(Token::Sign(":"))) { Vec::new() } else { self.names()? };
            self.expect(":")?;
            let body = self.expression()?;
            self.depth -= 1;
            return Ok(Expression::Lambda(parameters, Rc::new(body)));
        }
        let then = self.or()?;
        let expression = if self.take_word("if") {
            let condition = self.or()?;
            if !self.take_word("else") {
                return Err(format!("{} instead of `else`", self.unexpected()));
            }
            let otherwise = self.expression()?;
            Expression::If(Box::new([then, condition, otherwise]))
        } else {
            then
        };
        self.depth -= 1;
        Ok(expression)
    }

    fn or(&mut self) -> Result<Expression, Fault> {
        let mut left = self.and()?;
        while self.take_word("or") {
            let right = self.and()?;
            left = Expression::Or(Box::new(left), Box::new(right));
        }
        Ok(left)
    }

    fn and(&mut self) -> Result<Expression, Fault> {
        let mut left = self.not()?;
        while self.take_word("and") {
            let right = self.not()?;
            left = Expression::And(Box::new(left), Box::new(right));
        }
        Ok(left)
    }

    fn not(&mut self) -> Result<Expression, Fault> {
        if !self.take_word("not") {
            return self.comparison();
        }
        self.deeper()?;
        let inner = self.not()?;
        self.depth -= 1;
        Ok(Expression::Not(Box::new(inner)))
    }

    fn comparison(&mut self) -> Result<Expression, Fault> {
        let first = self.bits(0)?;
        let mut others = Vec::new();
        loop {
            let comparison = match self.peek() {
                Some(Token::Sign("==")) => Comparison::Equal,
                Some(Token::Sign("!=")) => Comparison::NotEqual,
                Some(Token::Sign("<")) => Comparison::Less,
                Some(Token::Sign("<=")) => Comparison::LessEqual,
                Some(Token::Sign(">")) => Comparison::Greater,
                Some(Token::Sign(">=")) => Comparison::GreaterEqual,
                Some(Token::Name(word)) if word == "in" => Comparison::In,
                Some(Token::Name(word)) if word == "not" => Comparison::NotIn,
                Some(Token::Name(word)) if word == "is" => Comparison::Is,
                _ => break,
            };
            self.at += 1;
            if comparison == Comparison::NotIn && !self.take_word("in") {
                return Err(self.unexpected());
            }
            let is_not = comparison == Comparison::Is && self.take_word("not");
            let comparison = if is_not { Comparison::IsNot } else { comparison };
            others.push((comparison, self.bits(0)?));
        }
        Ok(if others.is_empty() { first } else { Expression::Compare(Box::new(first), others) })
    }

    /// Parses bitwise operators, the loosest first.
    fn bits(&mut self, level: usize) -> Result<Expression, Fault> {
        const LEVELS: &[&[(&str, Operator)]] = &[
            &[("|", Operator::Or)],
            &[("^", Operator::ExclusiveOr)],
            &[("&", Operator::And)],
            &[("<<", Operator::ShiftLeft), (">>", Operator::ShiftRight)],
        ];
        let Some(operators) = LEVELS.get(level) else { return self.sum() };
        let mut left = self.bits(level + 1)?;
        while let Some((_, operator)) = operators.iter().find(|(sign, _)| self.take(sign)) {
            left = Expression::Binary(*operator, Box::new(left), Box::new(self.bits(level + 1)?));
        }
        Ok(left)
    }

    fn sum(&mut self) -> Result<Expression, Fault> {
        let mut left = self.product()?;
        loop {
            let operator = match self.peek() {
                Some(Token::Sign("+")) => Operator::Add,
                Some(Token::Sign("-")) => Operator::Subtract,
                _ => return Ok(left),
            };
            self.at += 1;
            left = Expression::Binary(operator, Box::new(left), Box::new(self.product()?));
        }
    }

    fn product(&mut self) -> Result<Expression, Fault> {
        let mut left = self.sign()?;
        loop {
            let operator = match self.peek() {
                Some(Token::Sign("*")) => Operator::Multiply,
                Some(Token::Sign("/")) => Operator::Divide,
                Some(Token::Sign("//")) => Operator::FloorDivide,
                Some(Token::Sign("%")) => Operator::Modulo,
                _ => return Ok(left),
            };
            self.at += 1;
            left = Expression::Binary(operator, Box::new(left), Box::new(self.sign()?));
        }
    }

    fn sign(&mut self) -> Result<Expression, Fault> {
        let minus = self.take("-");
        if !minus && !self.take("+") {
            return self.power();
        }
        self.deeper()?;
        let inner = self.sign()?;
        self.depth -= 1;
        Ok(if minus { Expression::Minus(Box::new(inner)) } else { inner })
    }

    fn power(&mut self) -> Result<Expression, Fault> {
        let base = self.postfix()?;
        if !self.take("**") {
            return Ok(base);
        }
        self.deeper()?;
        let exponent = self.sign()?;
        self.depth -= 1;
        Ok(Expression::Binary(Operator::Power, Box::new(base), Box::new(exponent)))
    }

    fn postfix(&mut self) -> Result<Expression, Fault> {
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
    fn names(&mut self) -> Result<Vec<Rc<str>>, Fault> {
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

/// Content of brackets.
enum Items {
    All(Vec<Expression>),
    Comprehension(Expression),
}
