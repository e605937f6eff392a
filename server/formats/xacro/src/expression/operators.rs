//! Operators and conditions, the loosest first.

use std::rc::Rc;

use super::token::Token;
use super::{Comparison, Expression, Operator, Parser};
use crate::error::Fault;

impl Parser {
    pub(super) fn expression(&mut self) -> Result<Expression, Fault> {
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

    pub(super) fn or(&mut self) -> Result<Expression, Fault> {
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
}
