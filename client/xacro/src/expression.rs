//! Expressions of Python, from text to tree.

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
    /// Each with the one before it: `a < b < c`.
    Compare(Box<Expression>, Vec<(Comparison, Expression)>),
    And(Box<Expression>, Box<Expression>),
    Or(Box<Expression>, Box<Expression>),
    /// Then, condition, else.
    If(Box<[Expression; 3]>),
    Call(Box<Expression>, Vec<Expression>),
    Index(Box<Expression>, Box<Expression>),
    Attribute(Box<Expression>, Rc<str>),
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
}

/// Reads the whole text.
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
            Some(Token::Name(word)) if matches!(word.as_str(), "for" | "lambda" | "is") => {
                not_supported(&format!("`{word}` in an expression"))
            }
            Some(Token::Name(word) | Token::Text(word)) => format!("unexpected {}", shown(word)),
            Some(Token::Sign(sign @ ("&" | "|" | "^" | "~" | "<<" | ">>" | "@"))) => {
                not_supported(&format!("the operator `{sign}`"))
            }
            Some(Token::Sign(sign)) => format!("unexpected `{sign}`"),
            Some(Token::Int(_) | Token::Float(_)) => "an unexpected number".to_owned(),
        }
    }

    /// Each bracket and each sign before a value comes by here.
    fn deeper(&mut self) -> Result<(), Fault> {
        self.depth += 1;
        if self.depth > limits::BRACKETS {
            return Err(format!("an expression is nested deeper than {}", limits::BRACKETS));
        }
        Ok(())
    }

    fn expression(&mut self) -> Result<Expression, Fault> {
        self.deeper()?;
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
        let first = self.sum()?;
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
                _ => break,
            };
            self.at += 1;
            if comparison == Comparison::NotIn && !self.take_word("in") {
                return Err(self.unexpected());
            }
            others.push((comparison, self.sum()?));
        }
        Ok(if others.is_empty() { first } else { Expression::Compare(Box::new(first), others) })
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
                let arguments = self.list(")")?;
                left = Expression::Call(Box::new(left), arguments);
            } else if self.take("[") {
                let index = self.expression()?;
                if matches!(self.peek(), Some(Token::Sign(":"))) {
                    return Err(not_supported("slices of lists and texts"));
                }
                self.expect("]")?;
                left = Expression::Index(Box::new(left), Box::new(index));
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
                // Texts side by side are one.
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
                let mut inner = self.list(")")?;
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
                return Ok(Expression::List(self.list("]")?));
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

    /// Up to the closing bracket, which is taken too.
    fn list(&mut self, close: &str) -> Result<Vec<Expression>, Fault> {
        let mut all = Vec::new();
        while !self.take(close) {
            all.push(self.expression()?);
            if matches!(self.peek(), Some(Token::Sign("="))) {
                return Err(not_supported("arguments by name in an expression"));
            }
            if !self.take(",") {
                self.expect(close)?;
                break;
            }
        }
        Ok(all)
    }

    fn map(&mut self) -> Result<Expression, Fault> {
        let mut all = Vec::new();
        while !self.take("}") {
            let key = self.expression()?;
            self.expect(":")?;
            all.push((key, self.expression()?));
            if !self.take(",") {
                self.expect("}")?;
                break;
            }
        }
        Ok(Expression::Map(all))
    }
}
