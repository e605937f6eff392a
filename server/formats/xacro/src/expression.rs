//! Parses expressions of Python to trees.
//!
//! * `operators`: operators and conditions, the loosest first.
//! * `brackets`: values, calls, indices, lists, dictionaries and comprehensions.
//! * `token`: words and signs.

mod brackets;
mod operators;
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
}
