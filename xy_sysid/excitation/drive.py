"""From an excitation signal to the applied voltage: ramps, centring, soft travel limits, amplitude limit.

Time and positions are arguments. The order of the guards for every sample is

    (signal * rms + offset + centring) * ramp-in -> travel limits -> fade-out -> amplitude limit

``next`` returns the result. Until the first usable position it is 0 V. Efforts and velocities of
ros2_control are handled in the same way. A position is sent as

    position at the start + limited(signal * rms + offset) * ramp-in -> fade-out to the present position -> inside the travel

and nothing is sent before the first usable position (NaN).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.excitation import signal
from xy_sysid.excitation.encoder_noise import EncoderNoise
from xy_sysid.excitation.following import FollowCheck
from xy_sysid.excitation.motion_check import MotionCheck, check_loop
from xy_sysid.excitation.sign_check import SignCheck
from xy_sysid.excitation.travel_limits import FURTHEST, Seen, TravelGuard
from xy_sysid.samples.block import Block, FloatArray
from xy_sysid.settings import ExcitationSettings, knobs

DriveState = Literal["idle", "active", "stopping", "stopped"]
Starts = Mapping[str, tuple[float, float]]  # by axis, lowest and highest start position

# Settings that may change while active; a new rms or offset is reached along a straight line over the next block.
LIVE_AXIS = frozenset({"rms", "limit", "offset", "centring", "travel_min", "travel_max", "brake", "brake_voltage", "velocity_gain", "breakaway"})
LIVE = frozenset({"duration", "watchdog", "abort_ramp", "patience"})

STOP_RAMP = 0.1  # maximum s of the fade-out at STOP, for any abort_ramp
AHEAD = 1.0  # s by which a stamp may be ahead of the commands, whose thread may be delayed
ABSURD = 10.0  # a position further than this many travel ranges from the middle is an encoder fault


@dataclass(frozen=True, slots=True)
class Report:
    """The drive's activity since the last report.

    rms: (axes,) of the applied voltage, V; clipped, braked: (axes,) samples changed by the amplitude limit and by the
    travel limits since the start
    """

    state: DriveState
    reason: str
    rms: FloatArray
    clipped: FloatArray
    braked: FloatArray


class Drive:
    """The voltage of all axes, block by block.

    settings: of the excitation; seq: counter of the first sample; watched: stop if motion and voltage do not match (False for
    recordings of a simulated machine); starts: allowed start positions of an experiment. Raises BadInput if a signal does not fit the rate.
    """

    def __init__(self, settings: ExcitationSettings, seq: int = 0, watched: bool = True, starts: Starts | None = None) -> None:
        self.axes = tuple(settings.axes)
        anywhere = (-np.inf, np.inf)
        self._starts = np.array([(starts or {}).get(axis, anywhere) for axis in self.axes])  # (axes, 2) m
        self._watched = watched
        self.state: DriveState = "idle"
        self.reason = ""
        self.blind = False  # stopped because of missing positions
        self.fault = False  # stopped by a guard
        self.seq = seq
        check_loop(settings)
        self._travel, self._noise, self._sign = TravelGuard(settings), EncoderNoise(len(self.axes)), SignCheck(settings)
        self._motion: MotionCheck | FollowCheck = FollowCheck(settings) if settings.holds else MotionCheck(settings)
        self._signals = [signal(axis.model_copy(update={"rms": 1.0}), settings.rate) for axis in settings.axes.values()]
        self._use(settings)
        self._gain, self._offset = self._rms, self._steady
        self._begun = 0  # samples since the first usable position
        self._fade_from, self._fade_at, self._fade_length = 1.0, 0, 0
        self._start: FloatArray | None = None
        self._last: FloatArray | None = None  # the newest sent values
        self._rest: FloatArray | None = None  # position at the stop
        self._silence, self._unusable, self._why = 0.0, 0, ""
        self._seen_time = -np.inf
        self._ticked: float | None = None
        self._squares, self._counted = np.zeros(len(self.axes)), 0
        self._clipped, self._braked = np.zeros(len(self.axes)), np.zeros(len(self.axes))

    def _use(self, settings: ExcitationSettings) -> None:
        self.settings = settings
        self._rms, self._steady = self._wanted("rms"), self._wanted("offset")
        self._limit, self._centring = self._wanted("limit"), self._wanted("centring")
        self._slow, self._slow_period = self._wanted("slow"), self._wanted("slow_period")
        self._travel.use(settings)
        self._motion.use(settings)
        self._sign.use(settings)

    def _wanted(self, name: str) -> FloatArray:
        return np.array([getattr(axis, name) for axis in self.settings.axes.values()], dtype=np.float64)

    def start(self) -> None:
        """Switch from idle to active; the ramp-in starts with the first usable position."""
        if self.state == "idle":
            self.state = "active"

    def stop(self, reason: str, seconds: float) -> None:
        """Fade out within this many seconds and store the reason; a stop that ends sooner than the current one replaces it."""
        if self.state == "idle":
            self.state, self.reason = "stopped", reason
        if self.state not in ("active", "stopping"):
            return
        length, level = round(seconds * self.settings.rate), self._level(self._fade_at)
        if self.state == "active":
            self._rest = None if self._travel.seen is None else self._travel.seen.position
            self.state, self.reason = "stopping", reason
        elif length >= self._fade_length - self._fade_at:
            return
        self._fade_from, self._fade_at, self._fade_length = level, 0, length

    def obey_stop(self) -> None:
        """STOP: fade out within ``abort_ramp``, and STOP_RAMP at most."""
        self.stop("STOP", min(self.settings.abort_ramp, STOP_RAMP))

    def _level(self, at: int) -> float:
        """Fraction of the voltage after this many samples of fading out."""
        if self.state != "stopping":
            return 1.0
        if at >= self._fade_length:
            return 0.0
        return self._fade_from * 0.5 * (1 + float(np.cos(np.pi * at / self._fade_length)))

    def change(self, settings: ExcitationSettings) -> None:
        """Use new settings from the next block on; raises BadInput for a setting that cannot change while active.

        While the drive fades out, they never make the voltage greater.
        """
        if self.state in ("active", "stopping"):
            before = {item.name: item.value for item in knobs(self.settings)}
            for item in knobs(settings):
                live = item.name in LIVE or item.name.partition(".")[2] in LIVE_AXIS
                if not live and before.get(item.name) != item.value:
                    live_names = ", ".join(sorted(LIVE_AXIS | LIVE))
                    raise BadInput(item.name, f"to change to {item.value} while active", f"while active: {live_names}", "Deactivate first.")
        check_loop(settings)
        old = self._rms, self._steady, self._limit, self._centring
        self._use(settings)
        if self.state == "stopping":  # a voltage that fades out does not rise again
            new = self._rms, self._steady, self._limit, self._centring
            self._rms, self._steady, self._limit, self._centring = (
                np.where(np.abs(after) > np.abs(before), before, after) for before, after in zip(old, new, strict=True)
            )

    def see(self, block: Block, overdue: int = 0) -> bool:
        """Read positions, (n, axes) in m; returns False if they are not usable (``unusable`` gives the reason).

        overdue: samples that are due but not sent yet because this computer was delayed; a position may be ahead by these

        The drive stops on motion that the voltage cannot have caused, and on missing motion.
        """
        why = self._why_unusable(block, overdue)
        if why:
            self._unusable, self._why = self._unusable + 1, why
            return False
        values, seq = block.values[:, [block.axes.index(axis) for axis in self.axes]], float(block.seq[-1])
        self._noise.saw(values)
        self._travel.saw(Seen(seq, values[-1].copy(), self._speed(values, block.seq)), self._noise.still)
        self._silence, self._unusable, self._seen_time = 0.0, 0, float(block.time[-1])
        if self._start is None:
            self._start = values[-1].copy()
            self._check_start(values[-1])
            outside = (values[-1] < self._travel.low) | (values[-1] > self._travel.high)
            if self.settings.holds and outside.any():
                axis = int(np.argmax(outside))
                span = f"{self._travel.low[axis]:g} to {self._travel.high[axis]:g} {self.settings.unit}"
                self.fault = True
                self.stop(f"{self.axes[axis]} stands at {values[-1, axis]:.6g} {self.settings.unit}, outside its travel from {span}", 0.0)
        reason = self._wrong(block.seq, values) if self._watched and self.state == "active" else ""
        if reason:
            self.fault = True
            self.stop(reason, self.settings.abort_ramp)
        return True

    def _check_start(self, place: FloatArray) -> None:
        """Stop before any motion if the axis is outside the start positions of the experiment."""
        low, high = self._starts.T
        outside = (place < low) | (place > high)
        if outside.any():
            axis, unit = int(np.argmax(outside)), self.settings.unit
            self.fault = True
            designed = f"its experiment was designed to begin between {low[axis]:.6g} and {high[axis]:.6g} {unit}"
            self.stop(f"{self.axes[axis]} stands at {place[axis]:.6g} {unit}, and {designed}. Move it there, or design it again", 0.0)

    def _wrong(self, seq: FloatArray, values: FloatArray) -> str:
        """The fault that the motion shows, or an empty text."""
        backwards = [] if self.settings.holds else self._sign.saw(seq, values, self._noise)
        if backwards:
            what = "voltage" if self.settings.output == "blocks" else self.settings.interface
            return (
                f"{self.axes[backwards[0]]}: plus {what} moves it to minus: swap the motor's wires or the encoder's sign. If run --first says that "
                "plus is plus, the delay is too long for so fast a signal: lower the setting low"
            )
        return self._motion.saw(seq, values)

    @property
    def unusable(self) -> str:
        """The fault of the last unusable position."""
        return self._why

    def _why_unusable(self, block: Block, overdue: int) -> str:
        if len(block) == 0:
            return "an empty block"
        missing = [axis for axis in self.axes if axis not in block.axes]
        if missing:
            return f"no column of axis {', '.join(missing)}"
        newest, seq = block.values[-1, [block.axes.index(axis) for axis in self.axes]], float(block.seq[-1])
        if not np.isfinite(newest).all() or not np.isfinite(block.seq).all():
            return "not a number"
        low, high = self._travel.low, self._travel.high
        if (np.abs(newest - (low + high) / 2) > ABSURD * (high - low)).any():
            return f"more than {ABSURD:g} travel ranges away"
        if (np.diff(block.seq) <= 0).any() or (self._travel.seen is not None and seq <= self._travel.seen.seq):
            return f"counter {seq:.0f}, which does not advance"
        if block.time[-1] < self._seen_time:
            return f"stamped {self._seen_time - block.time[-1]:.3g} s before the previous one"
        old, ahead = (self.seq - 1 - seq) / self.settings.rate, (seq + 1 - self.seq - overdue) / self.settings.rate
        if old > (self.settings.watchdog * max(self.settings.speed, 1.0) + FURTHEST) and not self.settings.lockstep:
            if self.settings.output == "commands":
                return f"{old:.3g} s old by its stamp: is it stamped in ROS time, by a clock that agrees with this one?"
            return f"{old:.3g} s old by its counter, which must be that of the voltage"
        if ahead > AHEAD:
            if self.settings.output == "commands":
                return f"stamped {ahead:.3g} s ahead: is it stamped in ROS time, by a clock that agrees with this one?"
            return f"{ahead:.3g} s ahead of the voltage by its counter: the machine does not follow this voltage yet, or counts by itself"
        return ""

    def _speed(self, values: FloatArray, seq: FloatArray) -> FloatArray:
        """(axes,) m/s over the block, or since the last position for a single row; 0 if it is unknown or within the noise."""
        first, at = values[0], float(seq[0])
        if len(seq) == 1 and self._travel.seen is not None:
            first, at = self._travel.seen.position, self._travel.seen.seq
        seconds = (float(seq[-1]) - at) / self.settings.rate
        step = np.where(np.abs(values[-1] - first) > self._noise.still, values[-1] - first, 0.0)
        speed = step / seconds if seconds > 0 else np.zeros(len(self.axes))
        return np.where(np.isfinite(speed), speed, 0.0)

    @property
    def answered(self) -> bool:
        """True if a usable position has arrived since the start."""
        return self._start is not None

    def tick(self, now: float) -> None:
        """Check the clock, s: fade out after too long a time without a usable position.

        A pause of the caller counts as at most a quarter of the allowed time, so that waiting positions are read before
        they are reported as missing.
        """
        waiting = self._start is None or self.settings.lockstep
        allowed = self.settings.patience if waiting else self.settings.watchdog
        if self._ticked is not None and self.state == "active":
            self._silence += min(now - self._ticked, allowed / 4)
        self._ticked = now
        if self.state == "active" and self._silence > allowed:
            self.blind = True
            self.fault = True
            unusable = f" ({self._unusable} unusable ones came: {self._why})" if self._unusable else ""
            if waiting:
                reason = f"no answer from the machine for {allowed:g} s{unusable}; is it running, and does it publish position?"
            else:
                reason = f"no position from the machine for {allowed * 1000:g} ms{unusable}"
            self.stop(reason, self.settings.abort_ramp)

    def skip(self, n: int) -> None:
        """Skip n samples after a delay of the caller; a controller holds the last command meanwhile."""
        if n > 0 and self.settings.output == "commands" and self._last is not None:
            self._travel.sent(self.seq, np.tile(self._last, (n, 1)))
            self._motion.sent(self.seq, np.tile(self._last, (n, 1)))
        self.seq += n
        if n > 0:
            self._sign.forget()
        if self._running():
            for stream in self._signals:
                stream.next(n)

    def catch_up(self, missed: int) -> Block:
        """The next sample, after ``missed`` skipped ones; a drive that knows the controller's motion meanwhile returns these samples too."""
        self.skip(missed)
        return self.next(1)

    @property
    def stopping_time(self) -> float:
        """Maximum s of the fade-out."""
        return self.settings.abort_ramp

    def _running(self) -> bool:
        return self.state in ("active", "stopping") and self._start is not None

    def next(self, n: int) -> Block:
        """The following n samples of voltage, (n, axes) in V, exactly as applied."""
        if self._running() and self.state == "active" and 0 < self.settings.duration <= self._begun / self.settings.rate:
            self.stop(f"the duration of {self.settings.duration:g} s is over", self.settings.ramp)
        values = (self._reference(n) if self.settings.holds else self._voltage(n)) if self._running() else np.tile(self.safe, (n, 1))
        if self.state == "stopping" and n and np.array_equal(values, np.tile(self.safe, (n, 1)), equal_nan=True):
            self.state = "stopped"
        if n and np.isfinite(values).all():
            self._travel.sent(self.seq, values)
            if self._watched:
                self._motion.sent(self.seq, values)
            self._last = values[-1]
            moved = values - self._start if self.settings.holds and self._start is not None else values
            self._squares += np.sum(moved * moved, axis=0)
            self._counted += n
        block = self.zeros(n)
        return Block(block.axes, block.seq, block.time, values)

    def zeros(self, n: int) -> Block:
        """The following n samples of the safe output, in any state."""
        seq = np.arange(self.seq, self.seq + n, dtype=np.float64)
        self.seq += n
        return Block(self.axes, seq, seq / self.settings.rate, np.tile(self.safe, (n, 1)))

    @property
    def safe(self) -> FloatArray:
        """(axes,) 0 V; for position commands the newest measured position, or that at the stop; NaN before the first."""
        if not self.settings.holds:
            return np.zeros(len(self.axes))
        if self._rest is not None or self._travel.seen is None:
            return np.full(len(self.axes), np.nan) if self._rest is None else self._rest
        return self._travel.seen.position

    def _reference(self, n: int) -> FloatArray:
        """(n, axes) position commands: about the start position; after a stop they fade to the position at the stop."""
        assert self._start is not None
        wanted = np.clip(self._driven(n)[0], -self._limit, self._limit)
        self._clipped += np.sum(np.abs(wanted) == self._limit, axis=0)
        reference = self._start + wanted
        if self.state == "stopping":
            left = np.array([self._level(self._fade_at + i) for i in range(n)])[:, None]
            reference = np.where(left > 0, self.safe + (reference - self.safe) * left, self.safe)
            self._fade_at += n
            return np.asarray(reference)
        kept = np.clip(reference, self._travel.low, self._travel.high)
        self._braked += np.sum(kept != reference, axis=0)
        return np.asarray(kept)

    def _driven(self, n: int) -> tuple[FloatArray, FloatArray]:
        """(n, axes) signal, slow sine and offset, and the same with centring; both with ramp-in."""
        driven = np.column_stack([stream.next(n) for stream in self._signals]) * _line(self._gain, self._rms, n)
        driven += _line(self._offset, self._steady, n)
        self._gain, self._offset = self._rms, self._steady
        if self._slow.any():
            since = (self._begun + np.arange(n))[:, None] / self.settings.rate
            driven += self._slow * np.sin(2 * np.pi * since / self._slow_period)
        ramp = round(self.settings.ramp * self.settings.rate)
        centred = driven if self.settings.holds else driven + self._centring * self._away()
        if self._begun < ramp:
            part = np.minimum(np.arange(self._begun, self._begun + n) / ramp, 1.0)
            fade = (0.5 * (1 - np.cos(np.pi * part)))[:, None]
            driven, centred = driven * fade, centred * fade
        self._begun += n
        return driven, centred

    def _away(self) -> FloatArray:
        """(axes,) distance from the present position back to the start position."""
        assert self._travel.seen is not None and self._start is not None
        return self._start - self._travel.seen.position

    def _voltage(self, n: int) -> FloatArray:
        excitation, driven = self._driven(n)
        guarded = self._travel.within(driven, self.seq)
        if self._watched:
            self._sign.sent(self.seq, np.clip(excitation, -self._limit, self._limit), (guarded != driven).any(axis=0))
        if self.state == "stopping":
            guarded *= np.array([self._level(self._fade_at + i) for i in range(n)])[:, None]
            self._fade_at += n
        applied = np.clip(guarded, -self._limit, self._limit)
        self._braked += np.sum(guarded != driven, axis=0) if self.state == "active" else 0
        self._clipped += np.sum(applied != guarded, axis=0)
        return applied

    def report(self) -> Report:
        """The applied voltage since the last report."""
        rms = np.sqrt(self._squares / max(1, self._counted))
        self._squares, self._counted = np.zeros(len(self.axes)), 0
        return Report(state=self.state, reason=self.reason, rms=rms, clipped=self._clipped.copy(), braked=self._braked.copy())


def _line(before: FloatArray, after: FloatArray, n: int) -> FloatArray:
    """(n, axes) along a straight line that ends at ``after``, or (axes,) if nothing changes."""
    return after if np.array_equal(before, after) else np.linspace(before, after, n + 1)[1:]
