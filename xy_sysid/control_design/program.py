"""A refined model as a program in a small language: functions of numbers and flat arrays, from which C, Python and MATLAB are printed.

The functions are the effects' laws from their files, the series, one sample of the simulation and one of the feedforward.
"""

from __future__ import annotations

import ast
import inspect
import math
import textwrap
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any

from xy_sysid.axis.model import AxisModel
from xy_sysid.control_design import series
from xy_sysid.control_design.inverse import ahead_of, guided, parts_of_sample
from xy_sysid.control_design.inverse_text import InverseText
from xy_sysid.control_design.law_text import NUMBERS, WHOLE_NUMBERS
from xy_sysid.control_design.sample_step import SERIES, Plant, plant
from xy_sysid.control_design.step_text import ROOM, StepText
from xy_sysid.effects._binding import called
from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray

ARRAYS = frozenset({"s", "w", "a", "still", "moving", "guided"})  # arguments that are arrays
WHOLE = frozenset({"n", "cuts"})  # integer arguments


@dataclass(frozen=True, slots=True)
class Program:
    """functions: in call order; the last two are one sample of the simulation and one of the feedforward.

    arrays: constants by name; states, room: sizes of the state and of the scratch array; parts: of a sample in the feedforward
    plant: the simulated model; ahead: preview of the path that the feedforward needs, s
    """

    functions: tuple[ast.FunctionDef, ...]
    arrays: dict[str, FloatArray]
    states: int
    room: int
    parts: int
    plant: Plant
    ahead: float

    @property
    def rate(self) -> float:
        """Rate at which simulation and feedforward are called, Hz."""
        return self.plant.sampling_rate


def program(model: AxisModel, sampling_rate: float, inverse: AxisModel | None = None) -> Program:
    """The model at one rate. Raises BadInput for an effect whose law uses syntax outside this language.

    inverse: the model whose laws the feedforward inverts; the model itself by default
    """
    ready = plant(model, sampling_rate, whole=False)
    undone = ready if inverse is None else plant(inverse, sampling_rate, whole=False)
    step = StepText(ready.layout.effects, ready.layout.hanging, model, _numbers(ready)).text("one_sample")
    back = InverseText(undone.layout.effects, undone.layout.hanging, undone.model, _numbers(undone)).text("one_input")
    effects = {effect.name: effect for effect in (*ready.layout.effects, *undone.layout.effects)}.values()
    laws = [_function(item, called(effect, name)) for effect in effects if effect.category != "motion" for name, item in effect.functions.items()]
    own = [_function(item, name, {"TERMS": series.TERMS, "ROUNDS": series.ROUNDS}) for name, item in SERIES.items()]
    last = [_only(ast.parse(text)) for text in (step, back)]
    used = _reached(last, [*laws, *own])
    return Program(
        functions=(*used, *last),
        arrays={"MOVING": ready.moving, "STILL": ready.still, "LED": undone.moving, "GUIDED": guided(undone)},
        states=max(ready.rest().size, undone.rest().size),
        room=ROOM * max(ready.order, undone.order),
        parts=parts_of_sample(undone),
        plant=ready,
        ahead=ahead_of(undone.model, sampling_rate),
    )


def _numbers(ready: Plant) -> dict[str, str]:
    """The numbers of a plant as text."""
    return {name: str(round(ready.number(name))) if name in WHOLE_NUMBERS else repr(ready.number(name)) for name in NUMBERS}


def _function(item: Callable[..., Any], name: str, known: dict[str, Any] | None = None) -> ast.FunctionDef:
    """A function from a file under another name, without decorators and types, with module constants replaced by their values."""
    plain = getattr(item, "py_func", item)
    try:
        made = _only(ast.parse(textwrap.dedent(inspect.getsource(plain))))
    except (OSError, TypeError, SyntaxError):
        raise BadInput(f"law {name}", "without source text", "a function in a file", "Write it into an effect file.") from None
    made.name = name
    made.decorator_list, made.returns = [], None
    for argument in made.args.args:
        argument.annotation = None
    numbers = {word: value for word, value in plain.__globals__.items() if isinstance(value, int | float) and not isinstance(value, bool)}
    changed = _Numbers({**numbers, **(known or {})}).visit(made)
    assert isinstance(changed, ast.FunctionDef)
    return changed


class _Numbers(ast.NodeTransformer):
    """Replaces names of module constants by their values."""

    def __init__(self, numbers: dict[str, Any]) -> None:
        self.numbers = numbers

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        if isinstance(node.value, ast.Name) and node.value.id == "math" and node.attr in ("pi", "tau", "e"):
            return ast.copy_location(ast.Constant(getattr(math, node.attr)), node)
        return node

    def visit_Name(self, node: ast.Name) -> ast.expr:
        if isinstance(node.ctx, ast.Load) and node.id in self.numbers:
            return ast.copy_location(ast.Constant(self.numbers[node.id]), node)
        return node


def _only(module: ast.Module) -> ast.FunctionDef:
    (made,) = module.body
    assert isinstance(made, ast.FunctionDef)
    return made


def _reached(start: Iterable[ast.FunctionDef], known: list[ast.FunctionDef]) -> list[ast.FunctionDef]:
    """The functions of ``known`` that are called directly or indirectly, in their order."""
    by_name = {item.name: item for item in known}
    found: set[str] = set()
    todo = list(start)
    while todo:
        for node in ast.walk(todo.pop()):
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id in by_name and node.func.id not in found:
                found.add(node.func.id)
                todo.append(by_name[node.func.id])
    return [item for item in known if item.name in found]


def body_of(function: ast.FunctionDef) -> tuple[str, list[ast.stmt]]:
    """First line of the docstring, and the statements after it."""
    text = ast.get_docstring(function)
    return (text.split("\n")[0] if text else ""), function.body[1:] if text else function.body


def names_assigned(function: ast.FunctionDef) -> list[str]:
    """Plain names that a function assigns, in order, without its arguments."""
    found: dict[str, None] = {}
    for node in ast.walk(function):
        if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store):
            found.setdefault(node.id)
    own = {argument.arg for argument in function.args.args}
    return [name for name in found if name not in own]


def whole_names(function: ast.FunctionDef) -> set[str]:
    """Names of integer variables."""
    values: dict[str, list[ast.expr | None]] = {}
    for node in ast.walk(function):
        if isinstance(node, ast.For) and isinstance(node.target, ast.Name):
            values.setdefault(node.target.id, []).append(ast.Constant(0))
        elif isinstance(node, ast.Assign):
            for target in node.targets:
                for part in target.elts if isinstance(target, ast.Tuple) else [target]:
                    if isinstance(part, ast.Name):
                        values.setdefault(part.id, []).append(None if isinstance(target, ast.Tuple) else node.value)
        elif isinstance(node, ast.AugAssign) and isinstance(node.target, ast.Name):
            values.setdefault(node.target.id, []).append(node.value)
    found = set(values) | {argument.arg for argument in function.args.args if argument.arg in WHOLE}
    while True:
        kept = {name for name in found if name not in values or all(_is_whole(value, found) for value in values[name])}
        if kept == found:
            return kept
        found = kept


def _is_whole(value: ast.expr | None, names: set[str]) -> bool:
    if isinstance(value, ast.Constant):
        return isinstance(value.value, int)
    if isinstance(value, ast.Name):
        return value.id in names
    if isinstance(value, ast.BinOp):
        return isinstance(value.op, ast.Add | ast.Sub | ast.Mult) and _is_whole(value.left, names) and _is_whole(value.right, names)
    return isinstance(value, ast.Call) and isinstance(value.func, ast.Name) and value.func.id == "int"


def returns_of(function: ast.FunctionDef) -> int:
    """How many values a function returns."""
    for node in ast.walk(function):
        if isinstance(node, ast.Return) and node.value is not None:
            return len(node.value.elts) if isinstance(node.value, ast.Tuple) else 1
    return 0


def independent(targets: ast.Tuple, values: ast.Tuple) -> bool:
    """True if a tuple assignment equals assignments in sequence: no value reads a name that another assigns."""
    set_to = {node.id for part in targets.elts for node in ast.walk(part) if isinstance(node, ast.Name)}
    return not any(isinstance(node, ast.Name) and node.id in set_to for part in values.elts for node in ast.walk(part))
