"""The program as MATLAB functions in one file, for a MATLAB Function block or a script; a function returns the arrays that it changes."""

from __future__ import annotations

import ast
import math

from xy_sysid.control_design.printing import OPERATORS, Printer, math_name, range_of
from xy_sysid.control_design.program import ARRAYS, Program, body_of, returns_of

RESERVED = "break case catch classdef continue else elseif end for function global if otherwise parfor persistent return spmd switch try while"
KEYWORDS = frozenset(RESERVED.split())
HELPERS = """\
function out = pick(test, yes, no)
if test
    out = yes;
else
    out = no;
end
end

function out = copysign(size, way)
out = abs(size);
if way < 0
    out = -out;
end
end
"""


class MatlabPrinter(Printer):
    """Prints functions one by one; ``changed``: the arrays that each known function changes, ``outs``: how many values it returns."""

    UNEQUAL, NOT = "~=", "~"

    def __init__(self, functions: tuple[ast.FunctionDef, ...]) -> None:
        super().__init__()
        self.given = {item.name: [argument.arg for argument in item.args.args] for item in functions}
        self.outs = {item.name: returns_of(item) for item in functions}
        self.changed: dict[str, list[str]] = {}
        for item in functions:
            self.changed[item.name] = self._changes(item)
        self.out = 0

    def _changes(self, node: ast.FunctionDef) -> list[str]:
        """Arrays among the arguments that the function, or a function that it calls, writes to."""
        found = {
            item.value.id
            for item in ast.walk(node)
            if isinstance(item, ast.Subscript) and isinstance(item.ctx, ast.Store) and isinstance(item.value, ast.Name)
        }
        for item in ast.walk(node):
            if isinstance(item, ast.Call) and isinstance(item.func, ast.Name):
                found |= {given.id for _, given in self._handed(item) if isinstance(given, ast.Name)}
        return [argument.arg for argument in node.args.args if argument.arg in found and argument.arg in ARRAYS]

    def _handed(self, node: ast.Call) -> list[tuple[str, ast.expr]]:
        """(parameter, argument) for each array that a call changes."""
        called = node.func.id if isinstance(node.func, ast.Name) else ""
        pairs = zip(self.given.get(called, []), node.args, strict=False)
        return [(name, value) for name, value in pairs if name in self.changed.get(called, [])]

    def function(self, node: ast.FunctionDef) -> None:
        """One definition."""
        told, body = body_of(node)
        self.out = returns_of(node)
        gives = [*(f"out{k}" for k in range(self.out)), *self.changed[node.name]]
        self.put(f"function {_listed(gives)}{node.name}({', '.join(map(self.name, self.given[node.name]))})")
        if told:
            self.put(f"% {told}")
        self.statements(body)
        self.put("end")
        self.put("")

    def name(self, name: str) -> str:
        return "turn_" if name == "_" else f"{name}_" if name in KEYWORDS else name

    def number(self, value: float) -> str:
        return repr(value) if value >= 0 else f"({value!r})"

    def place(self, array: str, index: ast.expr) -> str:
        return f"{array}(({self.expression(index)}) + 1)"

    def power(self, left: str, right: str) -> str:
        return f"({left} ^ {right})"

    def choice(self, test: str, yes: str, no: str) -> str:
        return f"pick({test}, {yes}, {no})"

    def call(self, node: ast.Call) -> str:
        given = ", ".join(self.expression(argument) for argument in node.args)
        own = math_name(node) or (node.func.id if isinstance(node.func, ast.Name) else "")
        if own in ("int", "float"):
            return f"({given})"
        if not own or (own not in self.outs and own not in ("min", "max", "abs") and not hasattr(math, own)):
            raise self.refuse(node.func)
        return f"{own}({given})"

    def statement(self, node: ast.stmt) -> None:
        if isinstance(node, ast.Assign) and len(node.targets) == 1:
            self._assign(node.targets[0], node.value)
        elif isinstance(node, ast.AugAssign):
            target = self._stored(node.target)
            self.put(f"{target} = {target} {OPERATORS[type(node.op)]} {self.expression(node.value)};")
        elif isinstance(node, ast.If):
            self.put(f"if {self.expression(node.test)}")
            self.statements(node.body)
            if node.orelse:
                self.put("else")
                self.statements(node.orelse)
            self.put("end")
        elif isinstance(node, ast.For) and isinstance(node.target, ast.Name):
            first, end = (self.expression(item) for item in range_of(node))
            self.put(f"for {self.name(node.target.id)} = {first}:({end} - 1)")
            self.statements(node.body)
            self.put("end")
        elif isinstance(node, ast.Return):
            values = node.value.elts if isinstance(node.value, ast.Tuple) else [node.value] if node.value is not None else []
            for k, item in enumerate(values):
                self.put(f"out{k} = {self.expression(item)};")
            self.put("return")
        elif isinstance(node, ast.Break | ast.Continue):
            self.put("break" if isinstance(node, ast.Break) else "continue")
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            self.put(f"{_listed([self.expression(value) for _, value in self._handed(node.value)])}{self.call(node.value)};")
        elif not isinstance(node, ast.Pass):
            raise self.refuse(node)

    def _assign(self, target: ast.expr, value: ast.expr) -> None:
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Call):
            self.put(f"{_listed([self._stored(part) for part in target.elts])}{self.call(value)};")
        elif isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
            for part, item in zip(target.elts, value.elts, strict=True):
                self.put(f"{self._stored(part)} = {self.expression(item)};")
        else:
            self.put(f"{self._stored(target)} = {self.expression(value)};")

    def _stored(self, node: ast.expr) -> str:
        return self.expression(ast.parse(ast.unparse(node), mode="eval").body)


def _listed(names: list[str]) -> str:
    if not names:
        return ""
    return f"{names[0]} = " if len(names) == 1 else f"[{', '.join(names)}] = "


def source(of: Program, name: str, title: str) -> str:
    """A file NAME.m: NAME('reset') is a state at rest, NAME('step', state, u) one sample, NAME('input', state, r, v, a) the feedforward."""
    printer = MatlabPrinter(of.functions)
    for item in of.functions:
        printer.function(item)
    arrays = "\n".join(f"{key} = [{', '.join(map(repr, values.tolist()))}];" for key, values in of.arrays.items())
    return f"""\
function [out, state] = {name}(what, varargin)
% {title}
%   state = {name}('reset')                      at rest at position 0 ({of.rate:g} samples a second)
%   [y, state] = {name}('step', state, u)        holds u for a sample; y is what the encoder shows after it
%   [u, state] = {name}('input', state, r, v, a) the feedforward; r, v, a: of the path {of.ahead:.9g} s later
{arrays}
w = zeros(1, {of.room});
if strcmp(what, 'reset')
    out = zeros(1, {of.states});
    state = out;
elseif strcmp(what, 'step')
    [out, state] = one_sample(varargin{{2}}, MOVING, STILL, varargin{{1}}, w);
else
    [out, state] = one_input(varargin{{2}}, varargin{{3}}, varargin{{4}}, {1.0 / of.rate!r}, {of.parts}, LED, GUIDED, varargin{{1}}, w);
end
end

{chr(10).join(printer.lines)}
{HELPERS}"""
