"""Prints the statements and expressions of a program; subclasses define the syntax of a language."""

from __future__ import annotations

import ast
from abc import ABC, abstractmethod

from xy_sysid.errors import BadInput

OPERATORS: dict[type, str] = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/"}
COMPARISONS: dict[type, str] = {ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!="}


class Printer(ABC):
    """Common parts of C and MATLAB; a subclass prints calls, array elements, loops, powers and conditional values."""

    AND, OR, NOT, UNEQUAL = "&&", "||", "!", "!="

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.depth = 0

    def put(self, text: str) -> None:
        """A line at the present depth."""
        self.lines.append("    " * self.depth + text if text else "")

    def refuse(self, node: ast.AST) -> BadInput:
        """The error for syntax that this small language does not support."""
        return BadInput(
            "law", f"written with {type(node).__name__}", "numbers, arithmetic, if, for and functions of math", "Write it in simpler terms."
        )

    def expression(self, node: ast.expr) -> str:
        """The text of an expression, in brackets where needed."""
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            return self.number(node.value)
        if isinstance(node, ast.Name):
            return self.name(node.id)
        if isinstance(node, ast.Subscript) and isinstance(node.value, ast.Name):
            return self.place(node.value.id, node.slice)
        if isinstance(node, ast.BinOp):
            return self.arithmetic(node)
        if isinstance(node, ast.UnaryOp):
            sign = "-" if isinstance(node.op, ast.USub) else self.NOT if isinstance(node.op, ast.Not) else "+"
            return f"({sign}{self.expression(node.operand)})"
        if isinstance(node, ast.BoolOp):
            word = self.AND if isinstance(node.op, ast.And) else self.OR
            return "(" + f" {word} ".join(self.expression(value) for value in node.values) + ")"
        if isinstance(node, ast.Compare):
            return self.comparison(node)
        if isinstance(node, ast.IfExp):
            return self.choice(self.expression(node.test), self.expression(node.body), self.expression(node.orelse))
        if isinstance(node, ast.Call):
            return self.call(node)
        raise self.refuse(node)

    def comparison(self, node: ast.Compare) -> str:
        """The text of a comparison or of a chain of them."""
        parts, left = [], node.left
        for operator, right in zip(node.ops, node.comparators, strict=True):
            word = self.UNEQUAL if isinstance(operator, ast.NotEq) else COMPARISONS[type(operator)]
            parts.append(f"({self.expression(left)} {word} {self.expression(right)})")
            left = right
        return parts[0] if len(parts) == 1 else "(" + f" {self.AND} ".join(parts) + ")"

    def arithmetic(self, node: ast.BinOp) -> str:
        """Sums, products, quotients, powers."""
        left, right = self.expression(node.left), self.expression(node.right)
        if isinstance(node.op, ast.Pow):
            return self.power(left, right)
        if type(node.op) not in OPERATORS:
            raise self.refuse(node.op)
        return f"({left} {OPERATORS[type(node.op)]} {right})"

    def statements(self, body: list[ast.stmt]) -> None:
        """One after another, one level deeper."""
        self.depth += 1
        for statement in body:
            self.statement(statement)
        self.depth -= 1

    def name(self, name: str) -> str:
        """The name of a variable in the language."""
        return name

    @abstractmethod
    def number(self, value: float) -> str:
        """A number as the language writes it."""

    @abstractmethod
    def place(self, array: str, index: ast.expr) -> str:
        """An element of an array."""

    @abstractmethod
    def power(self, left: str, right: str) -> str:
        """A power."""

    @abstractmethod
    def choice(self, test: str, yes: str, no: str) -> str:
        """A conditional value."""

    @abstractmethod
    def call(self, node: ast.Call) -> str:
        """A call of a function."""

    @abstractmethod
    def statement(self, node: ast.stmt) -> None:
        """One statement."""


def math_name(node: ast.Call) -> str | None:
    """The name of a called function of math; None for any other."""
    at = node.func
    return at.attr if isinstance(at, ast.Attribute) and isinstance(at.value, ast.Name) and at.value.id == "math" else None


def range_of(node: ast.For) -> list[ast.expr]:
    """First and end of a loop over integers."""
    if isinstance(node.iter, ast.Call) and isinstance(node.iter.func, ast.Name) and node.iter.func.id == "range":
        given = list(node.iter.args)
        return given if len(given) == 2 else [ast.Constant(0), given[0]]
    raise BadInput("law", "a loop over something else than range", "for k in range(n)", "Write it in simpler terms.")
