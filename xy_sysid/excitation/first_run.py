"""The first motion of an unknown machine: one axis at a time, a push forth and back at increasing small voltages.

After each push the response is checked before the voltage is increased: this axis moved and no other; the sign is right; the motion is
plausible for the travel; it was at rest before; there is room for the next push. The first problem ends the run.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from xy_sysid.excitation.motion_check import gains
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import ExcitationSettings
from xy_sysid.units import bare
from xy_sysid.units import moved as in_words

FIRST, GROWS = 0.005, 1.6  # the first push as a fraction of the limit, and the factor between pushes
LOUDEST = 2.0  # the last push as a multiple of rms, within the limit
COUNTS, SIGMAS = 6.0, 6.0  # encoder counts, and standard deviations at rest, from which a change is motion
LARGE, SMALL = 30.0, 0.01  # times the speed per volt expected from travel and full voltage: outside this range the unit is wrong
CLEAR = 0.2  # of the longest push; a push must reach this to count for gain and friction: a smaller motion is elastic presliding
NEXT = 1.5  # factor by which the motion of the next push may exceed proportionality
SLOWEST = 0.1  # s, largest delay and lag; the travel limits look this far ahead
HALF = 0.5  # of the push, at which the voltage counts as on
RETURNS = 0.2  # of a push, elastic return at 0 V; with less, the axis stays where it was moved
LOADED = "a load drives it (it hangs or tips over), so the wiring cannot be checked. Hold or balance the load, and start again"
BY_HAND = "Switch the drive off and push it by hand: if it moves on by itself, hold or balance the load; if it stays where it is left, "
SWAP = "swap the motor's wires or the encoder's sign"


@dataclass(frozen=True, slots=True)
class Push:
    """The next push: an axis, and V forth and back."""

    axis: str
    volts: float


@dataclass(frozen=True, slots=True)
class PushResult:
    """The result of a push. moved: m forth and m back; sentence: for the user; problem: why the run must end, or empty."""

    push: Push
    moved: tuple[float, float]
    sentence: str
    problem: str = ""


@dataclass(frozen=True, slots=True)
class AxisFound:
    """The results for an axis: speed per volt (m/s/V), friction (V), greatest voltage without motion and least with
    motion (V), delay and lag together (s), noise at rest (m); None where unknown.
    """

    velocity_gain: float | None
    friction: float | None
    still: float
    moves: float | None
    lag: float | None
    noise: float


@dataclass(slots=True)
class _Seen:
    """Sums for one axis: V s and s of the pushes that moved it, and their distance, m."""

    still: float = 0.0
    moves: float | None = None
    pushed: list[tuple[float, float, float]] = field(default_factory=list)
    lag: float | None = None
    noise: float = 0.0


class FirstRun:
    """``next`` returns the next push, ``took`` reads its result; the caller drives the machine."""

    def __init__(self, settings: ExcitationSettings) -> None:
        self.settings = settings
        self.axes = tuple(settings.axes)
        self.problem = ""
        self._expected, self._units = gains(settings), settings.units
        unit = self._units.output
        self._asked = f"is the position in {unit}? Move it by hand and compare with a ruler or protractor; if the number is right, "
        self._seen = {axis: _Seen() for axis in self.axes}
        self._plan = [Push(axis, volts) for axis in self.axes for volts in self._levels(axis)]

    def _levels(self, axis: str) -> list[float]:
        wanted = self.settings.axes[axis]
        top = min(wanted.limit, LOUDEST * wanted.rms)
        count = max(0, int(np.ceil(np.log(max(top / (FIRST * wanted.limit), 1.0)) / np.log(GROWS))))
        return [*(FIRST * wanted.limit * GROWS**k for k in range(count)), top] if top > 0 else []

    def next(self) -> Push | None:
        """The next push, or None when the run is complete or a problem was found."""
        return None if self.problem or not self._plan else self._plan[0]

    def took(self, voltage: FloatArray, position: FloatArray) -> PushResult:
        """Read the samples of a push from rest to rest, (n, axes) V and m, as published."""
        push, rate = self._plan.pop(0), self.settings.rate
        column = self.axes.index(push.axis)
        seen, volts, place = self._seen[push.axis], voltage[:, column], position[:, column]
        forth, back = np.flatnonzero(volts > HALF * push.volts), np.flatnonzero(volts < -HALF * push.volts)
        if forth.size == 0 or back.size == 0 or not np.isfinite(position).all():
            return self._end(push, "the push or its positions did not arrive completely")
        begin, turn = int(np.flatnonzero(volts > 0)[0]), int(np.flatnonzero(volts < 0)[0])
        if begin < 8:
            return self._end(push, "no position at rest before the push")
        rest = position[:begin]
        line = np.linspace(-1.0, 1.0, begin)
        noise = (rest - np.polynomial.polynomial.polyval(line, np.polynomial.polynomial.polyfit(line, rest, 2)).T).std(axis=0)
        steps = np.abs(np.diff(position, axis=0))
        count = np.array([np.min(steps[:, k][steps[:, k] > 0], initial=np.inf) for k in range(len(self.axes))])
        least = np.maximum(SIGMAS * noise, COUNTS * np.where(np.isfinite(count), count, 0.0))
        middle, end = position[turn - 1] - rest.mean(axis=0), position[-1] - position[turn - 1]
        seen.noise = float(noise[column])
        moved = (float(middle[column]), float(end[column]))
        drift = np.abs(rest[-1] - rest[0])
        if not any(one.pushed or one.still for one in self._seen.values()) and (drift > least).any():
            worst = int(np.argmax(drift - least))
            went = in_words(drift[worst], self._units.output, 2)
            return self._end(push, f"{self.axes[worst]} moves by {went} at 0 V, before any push: {LOADED}", moved)
        others = [axis for k, axis in enumerate(self.axes) if k != column and abs(middle[k]) > max(least[k], abs(middle[column]))]
        if others:
            return self._end(push, f"{others[0]} moved and {push.axis} did not: cables or columns are swapped", moved)
        answer = _answers(place, begin, (int(forth[-1]), turn))
        problem = _which_way(answer, float(least[column]))
        if problem:
            return self._end(push, problem, moved)
        peak = float(np.abs(place[begin:turn] - rest[:, column].mean()).max())
        small = max(peak, abs(moved[1])) < SMALL * self._expected[column] * float(volts[:turn].sum()) / rate
        gives = small and abs(moved[0]) < (1 - RETURNS) * peak
        if gives or (abs(answer[0]) <= least[column] and abs(answer[1]) <= least[column]):
            seen.still = push.volts
            what = "held by friction or a spring: it yields and comes back" if gives and peak > least[column] else "at rest"
            return PushResult(push, moved, f"{push.axis} at {push.volts:.3g} V: {what} (noise {in_words(noise[column], self._units.output, 2)})")
        if answer[0] <= least[column]:
            words = f"{push.axis} at {push.volts:.3g} V: it moves back by {in_words(moved[1], self._units.output)}, and not forth: a load or friction"
            return PushResult(push, moved, words)
        return self._moved(push, moved, (volts[:turn] / rate, place[:turn] - rest[:, column].mean()))

    def _moved(self, push: Push, moved: tuple[float, float], forth: tuple[FloatArray, FloatArray]) -> PushResult:
        """It moved in the right direction: evaluate gain and delay, and whether there is room for more."""
        column, rate = self.axes.index(push.axis), self.settings.rate
        seen, sums = self._seen[push.axis], np.cumsum(forth[0])
        seen.moves = push.volts if seen.moves is None else seen.moves
        on = np.flatnonzero(forth[0] * rate > HALF * push.volts)
        seen.pushed.append((float(sums[-1]), on.size / rate, moved[0]))
        gain = moved[0] / float(sums[-1])
        seen.lag = max(0.0, float(sums[on[-1]] - forth[1][on[-1]] / gain) / push.volts)
        ratio = gain / self._expected[column]
        sentence = f"{push.axis} at {push.volts:.3g} V: +{bare(moved[0], self._units.output)} and {in_words(moved[1], self._units.output)}"
        sentence += f", {gain:.3g} {self._units.of('m/s/V')}, after {seen.lag * 1000:.2g} ms"
        if ratio > LARGE:
            return self._end(push, f"it moves {ratio:.0f} times as far as its travel suggests: {self._asked}set velocity_gain", moved)
        still_friction = seen.still > 0.5 * push.volts
        if ratio < SMALL and not still_friction and len(seen.pushed) > 2:
            what = f"it moves {1 / ratio:.0f} times less than its travel suggests: {self._asked}friction holds it, or it is slow: set velocity_gain"
            return self._end(push, what, moved)
        if seen.lag > SLOWEST:
            return self._end(
                push, f"it answers after {seen.lag * 1000:.0f} ms; the guards look {SLOWEST * 1000:.0f} ms ahead: shorten the signal path", moved
            )
        self._leave_room(push, moved)
        return PushResult(push, moved, sentence)

    def _leave_room(self, push: Push, moved: tuple[float, float]) -> None:
        """Leave out pushes that could go further than half of the travel between the brake zones."""
        wanted = self.settings.axes[push.axis]
        room = (wanted.travel_max - wanted.travel_min) / 2 - wanted.brake
        most = push.volts * room / (NEXT * max(abs(moved[0]), abs(moved[1])))
        self._plan = [one for one in self._plan if one.axis != push.axis or one.volts <= most]

    def _end(self, push: Push, problem: str, moved: tuple[float, float] = (0.0, 0.0)) -> PushResult:
        self.problem = f"{push.axis} at {push.volts:.3g} V: {problem}"
        return PushResult(push, moved, self.problem, problem)

    def found(self, axis: str) -> AxisFound:
        """The results for an axis so far."""
        seen = self._seen[axis]
        gain = friction = None
        clear = [push for push in seen.pushed if push[2] > CLEAR * max(one[2] for one in seen.pushed)]
        if len(clear) == 1:
            gain = clear[0][2] / clear[0][0]
        elif clear:  # moved = gain (V s - friction s)
            table = np.array(clear)
            gain, lost = (float(x) for x in np.linalg.lstsq(table[:, :2], table[:, 2], rcond=None)[0])
            friction = max(0.0, -lost / gain) if gain > 0 else None
        return AxisFound(velocity_gain=gain, friction=friction, still=seen.still, moves=seen.moves, lag=seen.lag, noise=seen.noise)

    def summary(self, axis: str) -> str:
        """The results in a sentence, with the lines for the run file."""
        found = self.found(axis)
        if found.velocity_gain is None or found.moves is None:
            return f"{axis}: did not move up to {found.still:.3g} V: raise rms, or look at brake and friction"
        friction = f", friction {found.friction:.2g} V" if found.friction is not None else ""
        answers = f", answers after {found.lag * 1000:.2g} ms" if found.lag is not None else ""
        return (
            f"{axis}: plus is plus, {found.velocity_gain:.3g} {self._units.of('m/s/V')}{friction}, moves from {found.moves:.3g} V{answers}; "
            f"write velocity_gain: {found.velocity_gain:.3g} and breakaway: {1.5 * max(found.moves, found.friction or 0.0):.2g}"
        )


def _answers(place: FloatArray, begin: int, turn: tuple[int, int]) -> tuple[float, float]:
    """Displacements, m, of the push forth, which starts at ``begin``, and of the push back, minus the drift before each.

    turn: last sample of the push forth, and first of the push back; the second half of the rest between them shows the drift there
    """
    rested = (turn[0] + turn[1]) // 2
    before = [float(np.polyfit(np.arange(len(part)), part, 1)[0]) if len(part) > 2 else 0.0 for part in (place[:begin], place[rested : turn[1]])]
    forth = float(place[turn[1] - 1] - place[:begin].mean()) - before[0] * (turn[1] - 1 - (begin - 1) / 2)
    back = float(place[-1] - place[turn[1] - 1]) - before[1] * (len(place) - turn[1])
    return forth, back


def _which_way(answer: tuple[float, float], least: float) -> str:
    """The problem with the direction, or empty; answer: displacements of a push forth and one back, m; least: m, the noise."""
    forth, back = answer
    if forth < -least and back > least:
        return f"plus volts move it to minus, and minus volts to plus: {SWAP}"
    if min(forth, back) > least or max(forth, back) < -least:
        return f"it moves to {'plus' if forth > 0 else 'minus'} at plus volts and at minus volts: {LOADED}"
    if forth < -least or back > least:
        return f"it moves {'to minus at plus volts' if forth < 0 else 'to plus at minus volts'}, and not the other way: {BY_HAND}{SWAP}"
    return ""
