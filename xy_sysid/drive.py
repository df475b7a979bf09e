"""From an excitation signal to the voltage that is really applied: ramps, centring, soft travel limits, amplitude limit.

Told the time and the positions; asks for neither. The order of the guards for every sample is

    (signal * rms + offset + centring) * ramp-in -> travel limits -> fade-out -> amplitude limit

and what ``next`` returns is what comes out at the end. Until the first usable position it is 0 V.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.excitation import signal
from xy_sysid.settings import ExcitationSettings, knobs
from xy_sysid.stream import Block, FloatArray
from xy_sysid.travel import Seen, TravelGuard

State = Literal["idle", "active", "stopping", "stopped"]

# Settings that may change while active; a new rms or offset is reached along a straight line over the next block.
LIVE_AXIS = frozenset({"rms", "limit", "offset", "centring", "travel_min", "travel_max", "brake", "brake_voltage"})
LIVE = frozenset({"duration", "watchdog", "abort_ramp", "patience"})

ABSURD = 10.0  # a position so many travel ranges away from the middle is a broken encoder, not a place


@dataclass(frozen=True, slots=True)
class Report:
    """What the drive did since the last report.

    rms: (axes,) of the voltage applied, V; clipped, braked: (axes,) samples changed by the amplitude limit and by the
    travel limits since the start
    """

    state: State
    reason: str
    rms: FloatArray
    clipped: FloatArray
    braked: FloatArray


class Drive:
    """The voltage of all axes, block by block.

    settings: what to apply; seq: counter of the first sample. Raises BadInput if a signal does not fit the rate.
    """

    def __init__(self, settings: ExcitationSettings, seq: int = 0) -> None:
        self.axes = tuple(settings.axes)
        self.state: State = "idle"
        self.reason = ""
        self.blind = False  # stopped because positions did not come
        self.seq = seq
        self._travel = TravelGuard(settings)
        self._signals = [signal(axis.model_copy(update={"rms": 1.0}), settings.rate) for axis in settings.axes.values()]
        self._use(settings)
        self._gain, self._offset = self._rms, self._steady
        self._begun = 0  # samples since the first usable position
        self._fade_from, self._fade_at, self._fade_length = 1.0, 0, 0
        self._start: FloatArray | None = None
        self._silence, self._unusable = 0.0, 0
        self._ticked: float | None = None
        self._squares, self._counted = np.zeros(len(self.axes)), 0
        self._clipped, self._braked = np.zeros(len(self.axes)), np.zeros(len(self.axes))

    def _use(self, settings: ExcitationSettings) -> None:
        self.settings = settings
        self._rms, self._steady = self._wanted("rms"), self._wanted("offset")
        self._limit, self._centring = self._wanted("limit"), self._wanted("centring")
        self._travel.use(settings)

    def _wanted(self, name: str) -> FloatArray:
        return np.array([getattr(axis, name) for axis in self.settings.axes.values()], dtype=np.float64)

    def start(self) -> None:
        """From idle to active; the ramp-in begins with the first usable position."""
        if self.state == "idle":
            self.state = "active"

    def stop(self, reason: str, seconds: float) -> None:
        """Fade out over so many seconds and say why; a stop that is over sooner than the one under way replaces it."""
        if self.state == "idle":
            self.state, self.reason = "stopped", reason
        if self.state not in ("active", "stopping"):
            return
        length, level = round(seconds * self.settings.rate), self._level(self._fade_at)
        if self.state == "active":
            self.state, self.reason = "stopping", reason
        elif length >= self._fade_length - self._fade_at:
            return
        self._fade_from, self._fade_at, self._fade_length = level, 0, length

    def _level(self, at: int) -> float:
        """Part of the voltage left after so many samples of fading out."""
        if self.state != "stopping":
            return 1.0
        if at >= self._fade_length:
            return 0.0
        return self._fade_from * 0.5 * (1 + float(np.cos(np.pi * at / self._fade_length)))

    def change(self, settings: ExcitationSettings) -> None:
        """Use new settings from the next block on; raises BadInput for one that cannot change while active."""
        if self.state in ("active", "stopping"):
            before = {item.name: item.value for item in knobs(self.settings)}
            for item in knobs(settings):
                live = item.name in LIVE or item.name.partition(".")[2] in LIVE_AXIS
                if not live and before.get(item.name) != item.value:
                    live_names = ", ".join(sorted(LIVE_AXIS | LIVE))
                    raise BadInput(item.name, f"to change to {item.value} while active", f"while active: {live_names}", "Deactivate first.")
        self._use(settings)

    def see(self, block: Block) -> bool:
        """Take note of positions, (n, axes) in m; False if the newest is not usable (not finite, absurd, other axes)."""
        if not self._usable(block):
            self._unusable += 1
            return False
        values, seq = block.values[:, [block.axes.index(axis) for axis in self.axes]], float(block.seq[-1])
        self._travel.saw(Seen(seq, values[-1].copy(), self._speed(values, block.seq)))
        self._silence, self._unusable = 0.0, 0
        if self._start is None:
            self._start = values[-1].copy()
        return True

    def _usable(self, block: Block) -> bool:
        if len(block) == 0 or any(axis not in block.axes for axis in self.axes):
            return False
        newest = block.values[-1, [block.axes.index(axis) for axis in self.axes]]
        low, high = self._travel.low, self._travel.high
        near = np.abs(newest - (low + high) / 2) <= ABSURD * (high - low)  # False for NaN
        return bool(near.all()) and bool(np.isfinite(block.seq[-1]))

    def _speed(self, values: FloatArray, seq: FloatArray) -> FloatArray:
        """(axes,) m/s over the block, or since the last position if it has one row; 0 if neither tells."""
        first, at = values[0], float(seq[0])
        if len(seq) == 1 and self._travel.seen is not None:
            first, at = self._travel.seen.position, self._travel.seen.seq
        seconds = (float(seq[-1]) - at) / self.settings.rate
        speed = (values[-1] - first) / seconds if seconds > 0 else np.zeros(len(self.axes))
        return np.where(np.isfinite(speed), speed, 0.0)

    def tick(self, now: float) -> None:
        """Look at the clock, s: without a usable position for too long, fade out.

        A pause of the caller itself counts as a quarter of the time allowed at most, so that positions that wait to be
        read are read before they are missed.
        """
        waiting = self._start is None or self.settings.lockstep
        allowed = self.settings.patience if waiting else self.settings.watchdog
        if self._ticked is not None and self.state == "active":
            self._silence += min(now - self._ticked, allowed / 4)
        self._ticked = now
        if self.state == "active" and self._silence > allowed:
            self.blind = True
            unusable = f" ({self._unusable} came that were not usable)" if self._unusable else ""
            if waiting:
                reason = f"no answer from the machine for {allowed:g} s{unusable}; is it running, and does it publish position?"
            else:
                reason = f"no position from the machine for {allowed * 1000:g} ms{unusable}"
            self.stop(reason, self.settings.abort_ramp)

    def skip(self, n: int) -> None:
        """Let n samples of time pass without a voltage, after a stall of the caller."""
        self.seq += n
        if self._running():
            for stream in self._signals:
                stream.next(n)

    def _running(self) -> bool:
        return self.state in ("active", "stopping") and self._start is not None

    def next(self, n: int) -> Block:
        """The following n samples of voltage, (n, axes) in V, exactly as they are to be applied."""
        if self._running() and self.state == "active" and 0 < self.settings.duration <= self._begun / self.settings.rate:
            self.stop(f"the duration of {self.settings.duration:g} s is over", self.settings.ramp)
        values = self._voltage(n) if self._running() else np.zeros((n, len(self.axes)))
        if self.state == "stopping" and n and not values.any():
            self.state = "stopped"
        if n:
            self._travel.sent(self.seq, values)
        self._squares += np.sum(values * values, axis=0)
        self._counted += n
        block = self.zeros(n)
        return Block(block.axes, block.seq, block.time, values)

    def zeros(self, n: int) -> Block:
        """The following n samples at 0 V, whatever state this is in."""
        seq = np.arange(self.seq, self.seq + n, dtype=np.float64)
        self.seq += n
        return Block(self.axes, seq, seq / self.settings.rate, np.zeros((n, len(self.axes))))

    def _voltage(self, n: int) -> FloatArray:
        seen, start = self._travel.seen, self._start
        assert seen is not None and start is not None
        driven = np.column_stack([stream.next(n) for stream in self._signals]) * _line(self._gain, self._rms, n)
        driven += _line(self._offset, self._steady, n)
        self._gain, self._offset = self._rms, self._steady
        driven += self._centring * (start - seen.position)
        ramp = round(self.settings.ramp * self.settings.rate)
        if self._begun < ramp:
            part = np.minimum(np.arange(self._begun, self._begun + n) / ramp, 1.0)
            driven *= (0.5 * (1 - np.cos(np.pi * part)))[:, None]
        self._begun += n
        guarded = self._travel.within(driven, self.seq)
        if self.state == "stopping":
            guarded *= np.array([self._level(self._fade_at + i) for i in range(n)])[:, None]
            self._fade_at += n
        applied = np.clip(guarded, -self._limit, self._limit)
        self._braked += np.sum(guarded != driven, axis=0) if self.state == "active" else 0
        self._clipped += np.sum(applied != guarded, axis=0)
        return applied

    def report(self) -> Report:
        """What was applied since the last report."""
        rms = np.sqrt(self._squares / max(1, self._counted))
        self._squares, self._counted = np.zeros(len(self.axes)), 0
        return Report(self.state, self.reason, rms, self._clipped.copy(), self._braked.copy())


def _line(before: FloatArray, after: FloatArray, n: int) -> FloatArray:
    """(n, axes) along a straight line that ends at ``after``, or (axes,) if nothing changes."""
    return after if np.array_equal(before, after) else np.linspace(before, after, n + 1)[1:]
