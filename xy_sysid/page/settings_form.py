"""The excitation settings of one axis, with units and limits. The form refuses invalid values, and the node checks them again."""

from __future__ import annotations

from typing import Any

from nicegui import ui

from xy_sysid.errors import BadInput
from xy_sysid.page.fields import on_press, typed
from xy_sysid.page.session import Session
from xy_sysid.settings import AxisExcitation, Knob, changed, knobs
from xy_sysid.units import USUAL, Units

OFTEN = ("kind", "rms", "low", "high", "limit")  # shown first


def changes(knob_values: dict[str, Any], typed: dict[str, Any]) -> dict[str, Any]:
    """The typed values that differ from the node's, with the types of the settings.

    Raises BadInput that names the value, the allowed range and the next action.
    """
    known = {item.name: item for item in knobs(AxisExcitation())}
    wanted: dict[str, Any] = {}
    for name, value in typed.items():
        if value is None or value == "":
            raise BadInput(name, "empty", limits(known[name]), "Give a value.")
        kind = type(known[name].value)
        if kind in (int, float) and not isinstance(value, (int, float)):
            raise BadInput(name, repr(value), limits(known[name]), "Give a number.")
        if kind is int and float(value) != int(value):
            raise BadInput(name, value, "a whole number", "Change it.")
        wanted[name] = kind(value)
    before = changed(AxisExcitation(), {name: value for name, value in knob_values.items() if name in known})
    after = changed(before, wanted)
    return {name: getattr(after, name) for name in wanted if getattr(after, name) != getattr(before, name)}


def limits(item: Knob, units: Units = USUAL) -> str:
    """The allowed range as text, 0 to 100 V, or the choices; units: of input and output, shown for V and m."""
    if item.choices:
        return ", ".join(item.choices)
    if item.low is None or item.high is None:
        return "any"
    return f"{item.low:g} to {item.high:g} {units.of(item.unit)}".rstrip()


def labelled(item: Knob, units: Units = USUAL) -> str:
    """The label with its unit: rms (V), or rms (N m)."""
    return f"{item.name} ({units.of(item.unit)})" if item.unit else item.name


class SettingsForm:
    """One axis in one browser."""

    def __init__(self, session: Session, axis: str) -> None:
        self._session, self._axis = session, axis
        self._now: dict[str, Any] = {}
        self._fields: dict[str, Any] = {}
        self._tips: dict[str, Any] = {}
        self._units = USUAL
        rest = []
        with ui.element("div").classes("stack").style("gap:.4rem"):
            ui.html(f"<h3>Axis {axis}</h3>", sanitize=False) if axis.isidentifier() else None
            with ui.element("div").classes("form"):
                for item in knobs(AxisExcitation()):
                    if item.name in OFTEN:
                        self._field(item)
                    else:
                        rest.append(item)
            with ui.expansion("more").props("dense"), ui.element("div").classes("form"):
                for item in rest:
                    self._field(item)
            with ui.element("div").classes("buttons"):
                on_press(ui.button("Apply").props(f"outline dense no-caps data-apply={axis}"), self._fields.values, self._apply)
                ui.button("Read from the node", on_click=self.read).props("flat dense no-caps")
                self._told = ui.label("").classes("small").props(f"role=status aria-live=polite data-told={axis}")
        self._said = ("", True)
        ui.timer(0.3, self._show)
        self.read()

    def read(self) -> None:
        """Request the node's values."""
        if self._session.link is not None:
            names = [f"{self._axis}.{name}" for name in self._fields]
            self._session.link.get_parameters("excitation", names, self._got)

    def _field(self, item: Knob) -> None:
        if item.choices:
            made: Any = ui.select(list(item.choices), label=labelled(item), value=item.value)
        else:
            made = typed(ui.number(labelled(item), value=item.value))  # no min and max: wrong values are refused, never silently changed
        made.props(f"outlined dense data-knob={self._axis}.{item.name}")
        with made:
            self._tips[item.name] = ui.tooltip(f"{item.meaning}; {limits(item)}")
        self._fields[item.name] = made

    def _got(self, values: dict[str, Any]) -> None:
        """Store the values; called in the link's thread, shown by the timer."""
        self._now = {name.partition(".")[2]: value for name, value in values.items() if value is not None}
        self._fresh = True

    def _show(self) -> None:
        self._name(self._session.heard.units("excitation"))
        if getattr(self, "_fresh", False):
            self._fresh = False
            for name, value in self._now.items():
                if name in self._fields:
                    self._fields[name].set_value(value)
        text, good = self._said
        if text != self._told.text:
            self._told.set_text(text)
            self._told.classes(remove="good bad", add="good" if good else "bad")

    def _name(self, units: Units) -> None:
        """Label every field with the units of the excitation's output and feedback."""
        if units != self._units:
            self._units = units
            for item in knobs(AxisExcitation()):
                self._fields[item.name].props["label"] = labelled(item, units)
                self._fields[item.name].update()
                self._tips[item.name].set_text(f"{item.meaning}; {limits(item, units)}")

    def _apply(self) -> None:
        try:
            wanted = changes(self._now, {name: field.value for name, field in self._fields.items()})
        except BadInput as problem:
            self._said = (str(problem), False)
            return
        if not wanted:
            self._said = ("nothing was changed", True)
        elif self._session.link is not None:
            values = {f"{self._axis}.{name}": value for name, value in wanted.items()}
            self._session.link.set_parameters("excitation", values, self._answered)

    def _answered(self, done: bool, words: str) -> None:
        self._said = ("applied" if done else words, done)
        self.read()
