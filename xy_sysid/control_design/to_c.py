"""The program in C99, which needs only the standard math library: simulation and feedforward, sample by sample."""

from __future__ import annotations

import ast
import math

from xy_sysid.control_design.printing import OPERATORS, Printer, math_name, range_of
from xy_sysid.control_design.program import ARRAYS, WHOLE, Program, body_of, independent, names_assigned, returns_of, whole_names
from xy_sysid.errors import BadInput

RESERVED = """auto break case char const continue default do double else enum extern float for goto if inline int long register restrict return short
signed sizeof static struct switch typedef union unsigned void volatile while main"""
KEYWORDS = frozenset(RESERVED.split())
WORDS = {"min": "fmin", "max": "fmax", "abs": "fabs", "float": "(double)"}


class CPrinter(Printer):
    """Prints functions one by one; ``outs``: how many values each known function returns."""

    def __init__(self, outs: dict[str, int]) -> None:
        super().__init__()
        self.outs = outs
        self.out = 0
        self.whole: set[str] = set()

    def function(self, node: ast.FunctionDef) -> None:
        """One definition."""
        told, body = body_of(node)
        self.out, self.whole = returns_of(node), whole_names(node)
        arguments = [self._declared(argument.arg) for argument in node.args.args]
        arguments += [f"double *out{k}" for k in range(self.out)] if self.out > 1 else []
        if told:
            self.put(f"/* {told} */")
        kind = "double" if self.out == 1 else "void"
        self.put(f"static {kind} {node.name}({', '.join(arguments)})")
        self.put("{")
        self.depth += 1
        loops = {item.target.id for item in ast.walk(node) if isinstance(item, ast.For) and isinstance(item.target, ast.Name)}
        for name in names_assigned(node):
            if name not in loops:
                self.put(f"int {self.name(name)} = 0;" if name in self.whole else f"double {self.name(name)} = 0.0;")
        self.depth -= 1
        self.statements(body)
        self.put("}")
        self.put("")

    def name(self, name: str) -> str:
        return f"{name}_" if name in KEYWORDS else name

    def number(self, value: float) -> str:
        if isinstance(value, float) and not math.isfinite(value):
            return "NAN" if math.isnan(value) else ("INFINITY" if value > 0 else "(-INFINITY)")
        return repr(value) if value >= 0 else f"({value!r})"

    def place(self, array: str, index: ast.expr) -> str:
        return f"{array}[{self.expression(index)}]"

    def arithmetic(self, node: ast.BinOp) -> str:
        """Quotients are of doubles: C would truncate those of integers."""
        if isinstance(node.op, ast.Div):
            return f"((double){self.expression(node.left)} / {self.expression(node.right)})"
        return super().arithmetic(node)

    def power(self, left: str, right: str) -> str:
        return f"pow({left}, {right})"

    def choice(self, test: str, yes: str, no: str) -> str:
        return f"({test} ? {yes} : {no})"

    def call(self, node: ast.Call) -> str:
        given = ", ".join(self.expression(argument) for argument in node.args)
        own = math_name(node)
        if own is not None:
            return f"{own}({given})"
        if isinstance(node.func, ast.Name):
            if node.func.id == "int":
                return f"(int)({given})"
            if node.func.id in WORDS or node.func.id in self.outs:
                return f"{WORDS.get(node.func.id, node.func.id)}({given})"
        raise self.refuse(node.func)

    def statement(self, node: ast.stmt) -> None:
        if isinstance(node, ast.Assign) and len(node.targets) == 1:
            self._assign(node.targets[0], node.value)
        elif isinstance(node, ast.AugAssign):
            self.put(f"{self.expression(_loaded(node.target))} {OPERATORS[type(node.op)]}= {self.expression(node.value)};")
        elif isinstance(node, ast.If):
            self.put(f"if {_bracketed(self.expression(node.test))} {{")
            self.statements(node.body)
            if node.orelse:
                self.put("} else {")
                self.statements(node.orelse)
            self.put("}")
        elif isinstance(node, ast.For) and isinstance(node.target, ast.Name):
            first, end = (self.expression(item) for item in range_of(node))
            name = node.target.id
            self.put(f"for (int {name} = {first}; {name} < {end}; {name}++) {{")
            self.statements(node.body)
            self.put("}")
        elif isinstance(node, ast.Return):
            self._give(node.value)
        elif isinstance(node, ast.Break):
            self.put("break;")
        elif isinstance(node, ast.Continue):
            self.put("continue;")
        elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
            self.put(f"{self.call(node.value)};")
        elif not isinstance(node, ast.Pass):
            raise self.refuse(node)

    def _declared(self, name: str) -> str:
        if name in ARRAYS:
            return f"double *{name}" if name in ("s", "w") else f"const double *{name}"
        return f"int {name}" if name in WHOLE else f"double {self.name(name)}"

    def _assign(self, target: ast.expr, value: ast.expr) -> None:
        if not isinstance(target, ast.Tuple):
            self.put(f"{self.expression(_loaded(target))} = {self.expression(value)};")
        elif isinstance(value, ast.Call):
            places = ", ".join(f"&{self.expression(_loaded(part))}" for part in target.elts)
            self.put(f"{self.call(value)[:-1]}, {places});")
        elif isinstance(value, ast.Tuple) and independent(target, value):
            for part, item in zip(target.elts, value.elts, strict=True):
                self.put(f"{self.expression(_loaded(part))} = {self.expression(item)};")
        else:
            raise self.refuse(value)

    def _give(self, value: ast.expr | None) -> None:
        if isinstance(value, ast.Tuple):
            for k, item in enumerate(value.elts):
                self.put(f"*out{k} = {self.expression(item)};")
            self.put("return;")
        else:
            self.put(f"return {self.expression(value)};" if value is not None else "return;")


def _loaded(node: ast.expr) -> ast.expr:
    """The same expression in load context."""
    made = ast.parse(ast.unparse(node), mode="eval").body
    assert isinstance(made, ast.expr)
    return made


def _bracketed(text: str) -> str:
    return text if text.startswith("(") and text.endswith(")") else f"({text})"


def functions(of: Program) -> str:
    """All functions of the program."""
    printer = CPrinter({item.name: returns_of(item) for item in of.functions})
    for item in of.functions:
        printer.function(item)
    return "\n".join(printer.lines)


def source(of: Program, name: str, title: str) -> tuple[str, str]:
    """(header, source) with the functions ``NAME_reset``, ``NAME_step`` and ``NAME_feedforward``; title: for the first comment.

    Raises BadInput for a name that is not an identifier.
    """
    if not name.isidentifier():
        raise BadInput("name", repr(name), "a name in C", "Choose another.")
    arrays = "\n".join(
        f"static const double {key}[{values.size}] = {{{', '.join(map(repr, values.tolist()))}}};" for key, values in of.arrays.items()
    )
    guard = f"{name.upper()}_H"
    header = f"""\
/* {title} */
#ifndef {guard}
#define {guard}

#define {name.upper()}_RATE {of.rate!r} /* Hz: one call a sample */
#define {name.upper()}_STATES {of.states}

typedef struct {{ double s[{of.states}]; double w[{of.room}]; }} {name}_state;

/* at rest at position 0; for the simulation and for the feedforward, each with a state of its own */
void {name}_reset({name}_state *state);
/* holds the input for one sample; returns the position that the encoder shows after it */
double {name}_step({name}_state *state, double input);
/* the input for this sample; position, speed and acceleration are those of the path {name.upper()}_AHEAD seconds later */
double {name}_feedforward({name}_state *state, double position, double speed, double acceleration);
#define {name.upper()}_AHEAD {of.ahead!r}

#endif
"""
    text = f"""\
/* {title} */
#include "{name}.h"
#include <math.h>

{arrays}

{functions(of)}
void {name}_reset({name}_state *state)
{{
    for (int k = 0; k < {of.states}; k++) state->s[k] = 0.0;
    for (int k = 0; k < {of.room}; k++) state->w[k] = 0.0;
}}

double {name}_step({name}_state *state, double input)
{{
    return one_sample(input, MOVING, STILL, state->s, state->w);
}}

double {name}_feedforward({name}_state *state, double position, double speed, double acceleration)
{{
    return one_input(position, speed, acceleration, {1.0 / of.rate!r}, {of.parts}, LED, GUIDED, state->s, state->w);
}}
"""
    return header, text
