"""Does the motion of each axis match its voltage? If not, encoder, wiring or settings are wrong, and the drive must stop.

One principle: the possible motion is calculated from the volt seconds beyond ``breakaway`` and the speed
per volt, and compared with the encoder. A constant encoder reading is accepted only while the axis cannot have moved far
(STRIDE of a brake zone). Therefore friction and dead zones up to ``breakaway``, and low voltage at rest, are no faults.

    a step          faster than FASTEST times the speed at the voltage limit: the encoder jumps, or its scale is wrong
    no answer       a stride was possible, and the encoder is constant, or shows less than LEAST of it or of its variation: frozen, or a wrong scale
    the wrong way   slow motion against the voltage: a sign is wrong
    outside         beyond a limit and not coming back, or not slowed by full inward voltage

The speed per volt is the setting ``velocity_gain``. If it is unknown, full voltage is assumed to cross the travel in CROSSING seconds,
until the motion has shown the real value.

The numbers were tested on the machines of config/machines, with and without another effect, at low to high amplitude, with most
kinds of signal.
"""

from __future__ import annotations

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import AxisExcitation, ExcitationSettings
from xy_sysid.units import over

REACTION = 0.006  # s of response time of a machine: 1.3 ms delay and 4 ms lag of a ball-screw axis
CROSSING = 0.3  # s in which an axis of unknown gain is assumed to cross its travel at full voltage (its limit, at least FULL)
FULL = 10.0  # V; a lower limit counts as caution, not as a drive of lower voltage
FASTEST = 10.0  # times that speed: no motion is faster
MEMORY = 1.0  # s of motion that are kept
SHORT = 0.4  # s in which a wrong sign shows in fast motion
STRIDE = 0.5  # of the brake zone, distance that may be travelled without an encoder change
LEAST = 0.003  # of a stride, least motion of the encoder; a scale that is 1000 times too small stays below
EVERY = 0.05  # s between two checks of the sign
SMOOTH = 0.1  # s over which slow motion is averaged; above resonances the sign of faster motion is reversed
LIVELY = 0.1  # of the brake zone, slow motion from which its sign is judged
LEADS = 2.0  # factor by which correlation with the integrated voltage must exceed that with the voltage, and the residual
SHARE = 0.05  # of the calculated motion; below this the sign is not judged
RETURN = 0.5  # s beyond a limit within which an axis must start to return
PROGRESS = 0.02  # of the brake zone, least motion of a returning axis
SLOWING = 0.03  # s within which outward motion under full inward voltage must slow down
BY_HAND = (
    "Switch the drive off and move it back by hand: if it moves off by itself, hold or balance the load; "
    "if it stays where it is left, run --first tells whether plus is plus"
)
STEADY = 0.5  # largest centring * speed per volt * age of a position; above 1.57 the loop is unstable


def full(settings: ExcitationSettings) -> FloatArray:
    """(axes,) V, full voltage of the machine: the limit, but at least FULL if voltage is published."""
    least = FULL if settings.output == "blocks" else 0.0
    return np.array([max(a.limit, least) for a in settings.axes.values()], dtype=np.float64)


def gains(settings: ExcitationSettings) -> FloatArray:
    """(axes,) m/s/V: the setting, 1 for a velocity command, or the value for which full voltage crosses the travel in CROSSING."""
    travels = np.array([a.travel_max - a.travel_min for a in settings.axes.values()], dtype=np.float64)
    usual = np.ones(len(travels)) if settings.output == "commands" and settings.interface == "velocity" else travels / (full(settings) * CROSSING)
    known = np.array([a.velocity_gain for a in settings.axes.values()], dtype=np.float64)
    return np.where(known > 0, known, usual)


def reaction(settings: ExcitationSettings) -> float:
    """s of response time; a controller of ros2_control reads the command one period later and reports one period after that."""
    return REACTION + (2.0 / settings.rate if settings.output == "commands" else 0.0)


def age(settings: ExcitationSettings) -> float:
    """s, worst-case age of a position when the resulting voltage acts."""
    blocks = (settings.ahead if settings.lockstep else 1) + 1
    return blocks * settings.step / settings.rate + reaction(settings)


def most_centring(settings: ExcitationSettings) -> FloatArray:
    """(axes,) V/m above which the loop would oscillate; inf for position commands, which have no centring."""
    if settings.holds:
        return np.full(len(settings.axes), np.inf)
    return np.asarray(STEADY / (gains(settings) * age(settings)))


def check_loop(settings: ExcitationSettings) -> None:
    """Raises BadInput if an axis would oscillate with its centring."""
    for (name, axis), gain, most in zip(settings.axes.items(), gains(settings), most_centring(settings), strict=True):
        if axis.centring > most:
            sent, unit = settings.units
            reckoned = over(settings.units.speed, sent)
            known = "velocity_gain" if axis.velocity_gain else f"a speed of {gain:.3g} {reckoned}, taken from limit and travel"
            raise BadInput(
                f"{name}.centring",
                f"{axis.centring:g} {sent}/{unit}",
                f"up to {most:.3g} {sent}/{unit} with {known} and blocks of {settings.step / settings.rate * 1000:g} ms; "
                "beyond that the loop oscillates",
                "Lower it, or set velocity_gain if the axis is slower.",
            )


class MotionCheck:
    """Call ``sent`` and ``saw`` in the order of events; ``saw`` returns the reason to stop, or an empty text."""

    def __init__(self, settings: ExcitationSettings) -> None:
        self.axes = tuple(settings.axes)
        self._learnt = np.full(len(self.axes), np.nan)  # m/s/V estimated from the motion
        self._count = np.full(len(self.axes), np.inf)  # m, the smallest change of the encoder so far
        self._total = np.zeros(len(self.axes))
        none = np.empty((0, len(self.axes)))
        self._ends, self._sums, self._means = np.empty(0), none, none  # of voltage: counter, V s beyond breakaway so far, V until here
        self._seqs, self._places, self._could = np.empty(0), none, none  # of motion: counter, m, V s that act there
        unknown = np.full((2, len(self.axes)), np.nan)
        self._ever = unknown  # m, minimum and maximum position since the start
        self._rest, self._since = unknown, unknown  # m and V s, minimum and maximum since the encoder last changed
        self._outside = np.full(len(self.axes), np.nan)  # counter since which an axis is beyond a limit without returning
        self._outermost = np.zeros(len(self.axes))
        self._judged = -np.inf  # counter of the last check of the sign
        self.use(settings)

    def use(self, settings: ExcitationSettings) -> None:
        """Take limits and machine properties from the settings."""
        axes: list[AxisExcitation] = list(settings.axes.values())
        self.rate = settings.rate
        self._gain = gains(settings)
        self._low, self._high = np.array([a.travel_min for a in axes]), np.array([a.travel_max for a in axes])
        self._zone = np.array([a.brake for a in axes])
        self._push = np.array([min(a.brake_voltage, a.limit) for a in axes])
        self._full = full(settings)
        self._idle = np.where([a.breakaway > 0 for a in axes], [a.breakaway for a in axes], self._full / 20)
        self._reaction = reaction(settings)
        self._sent, self._unit = settings.units
        self._what = "voltage" if settings.output == "blocks" else settings.interface
        self._spans = (SHORT, MEMORY) if settings.output == "blocks" else (MEMORY,)  # commands may be late, and the controller holds them

    @property
    def gain(self) -> FloatArray:
        """(axes,) m/s/V, estimated from the motion or given."""
        return np.where(np.isfinite(self._learnt), self._learnt, self._gain)

    def sent(self, seq: float, values: FloatArray) -> None:
        """Store voltage, (n, axes) in V; seq is the counter of its first sample."""
        beyond = np.sign(values) * np.maximum(np.abs(values) - self._idle, 0.0)
        before, self._total = self._total, self._total + beyond.sum(axis=0) / self.rate
        first = int(np.searchsorted(self._ends, seq - 2 * MEMORY * self.rate))
        self._ends = np.concatenate((self._ends[first:], (seq, seq + len(values))))
        self._sums = np.concatenate((self._sums[first:], (before, self._total)))
        self._means = np.concatenate((self._means[first:], (np.zeros(len(self.axes)), values.mean(axis=0))))

    def saw(self, seq: FloatArray, values: FloatArray) -> str:
        """Check positions, (n, axes) in m, with their counters; returns the reason to stop, or an empty text."""
        reason = self._step(seq, values)
        if reason or not self._ends.size:
            return reason
        at = seq[-1] - self._reaction * self.rate
        pushed = [np.interp(at, self._ends, self._sums[:, axis]) for axis in range(len(self.axes))]
        first = int(np.searchsorted(self._seqs, seq[-1] - MEMORY * self.rate))
        self._seqs = np.concatenate((self._seqs[first:], seq[-1:]))
        self._places = np.concatenate((self._places[first:], values[-1:]))
        self._could = np.concatenate((self._could[first:], [pushed]))
        if len(self._seqs) < 3:
            return ""
        times, place, could = self._seqs / self.rate, self._places, self._could
        reason = self._not_coming_back(times, place) or self._stands(place[-1], could[-1]) or self._no_answer(place, could)
        if not reason and seq[-1] - self._judged >= EVERY * self.rate:
            self._judged = float(seq[-1])
            reason = self._wrong_way(times, place, could)
        return reason

    def _step(self, seq: FloatArray, values: FloatArray) -> str:
        """Fault: a motion between two samples that is impossibly fast."""
        if self._seqs.size:
            later = seq > self._seqs[-1]
            seq, values = seq[later], values[later]
            seq, values = np.concatenate((self._seqs[-1:], seq)), np.concatenate((self._places[-1:], values))
        whole = np.isfinite(values).all(axis=1)
        seq, values = seq[whole], values[whole]
        seconds, steps = np.diff(seq)[:, None] / self.rate, np.abs(np.diff(values, axis=0))
        if len(steps):
            self._count = np.minimum(self._count, np.min(np.where(steps > 0, steps, np.inf), axis=0))
        over = steps - FASTEST * self._gain * self._full * seconds
        if over.size == 0 or over.max() <= 0:
            return ""
        row, axis = np.unravel_index(int(np.argmax(over)), over.shape)
        step, fastest = values[row + 1, axis] - values[row, axis], FASTEST * self._gain[axis] * self._full[axis]
        return (
            f"{self.axes[axis]}: the position stepped by {step:.3g} {self._unit} in {seconds[row, 0] * 1000:.3g} ms, faster than "
            f"{fastest:.3g} {self._unit}/s: encoder, cable, or its unit ({self._unit}) is wrong"
        )

    def _stands(self, place: FloatArray, could: FloatArray) -> str:
        """Fault: a large motion was possible since the encoder last changed. Low voltage for long counts like high voltage for short."""
        self._ever, self._rest, self._since = _wider(self._ever, place), _wider(self._rest, place), _wider(self._since, could)
        moved = np.ptp(self._rest, axis=0) > 2 * np.where(np.isfinite(self._count), self._count, 0.0)
        self._rest, self._since = np.where(moved, place, self._rest), np.where(moved, could, self._since)
        reckoned = np.ptp(self._since, axis=0) * self.gain
        over = reckoned > STRIDE * self._zone
        return self._unmoved(int(np.argmax(over)), np.ptp(self._rest, axis=0), reckoned) if over.any() else ""

    def _no_answer(self, place: FloatArray, could: FloatArray) -> str:
        """Fault: a large motion was possible, and the encoder has shown only a negligible part of it, or of its variation."""
        whole, ever = np.ptp(could, axis=0) * self.gain, np.ptp(self._ever, axis=0)
        ever = np.where((place[-1] > self._high) | (place[-1] < self._low), np.inf, ever)  # this is reported by another check
        if (whole <= STRIDE * self._zone).all():
            return ""
        varied, followed = np.ptp(_detrended(could), axis=0) * self.gain, np.ptp(_detrended(place), axis=0)
        for reckoned, shown in ((whole, ever), (varied, followed)):
            faint = (reckoned > STRIDE * self._zone) & (shown < LEAST * reckoned)
            if faint.any():
                return self._unmoved(int(np.argmax(faint)), shown, reckoned)
        return ""

    def _unmoved(self, axis: int, shown: FloatArray, reckoned: FloatArray) -> str:
        return (
            f"{self.axes[axis]}: the position moved by {shown[axis] * 1e6:.3g} u{self._unit} while the {self._what} could have moved it by "
            f"{reckoned[axis] * 1000:.3g} m{self._unit}: encoder frozen, its unit wrong, or held by a spring or by friction above "
            f"{self._idle[axis]:.2g} {self._sent} "
            "(then set breakaway, or velocity_gain of a slow axis)"
        )

    def _wrong_way(self, times: FloatArray, place: FloatArray, could: FloatArray) -> str:
        """Fault: slow motion against the voltage. Motion in the right direction gives an estimate of the speed per volt.

        Motion proportional to the voltage itself and not to its integral (a spring, a heavy mass) is not judged.
        """
        reckoned = could * self._gain
        for seconds in self._spans:
            rows = times > times[-1] - seconds - 1e-9
            if times[-1] - times[0] < 0.8 * seconds or rows.sum() < 12:
                continue
            width = max(1, round(SMOOTH / seconds * rows.sum()))
            a, b, c = (_detrended(_smooth(values[rows], width)) for values in (reckoned, place, np.gradient(reckoned, axis=0)))
            for axis in range(len(self.axes)):
                if np.ptp(a[:, axis]) < LIVELY * self._zone[axis]:
                    continue
                both = np.column_stack((a[:, axis], c[:, axis]))
                slope, also = np.linalg.lstsq(both, b[:, axis], rcond=None)[0]
                parts = float(np.std(slope * a[:, axis])), float(np.std(also * c[:, axis]))
                rest = float(np.std(b[:, axis] - both @ (slope, also)))
                if abs(slope) < SHARE or parts[0] < LEADS * max(parts[1], rest):
                    continue
                if slope < 0:
                    return f"{self.axes[axis]}: the position goes against the {self._what}: a sign is wrong, or a load drives it. {BY_HAND}"
                if seconds == MEMORY:
                    shown = float(slope * self._gain[axis])
                    self._learnt[axis] = shown if not np.isfinite(self._learnt[axis]) else 0.95 * self._learnt[axis] + 0.05 * shown
        return ""

    def _not_coming_back(self, times: FloatArray, place: FloatArray) -> str:
        """Fault: too long beyond a limit, or not slowed by full inward voltage."""
        now = place[-1]
        if ((now < self._high - self._zone) & (now > self._low + self._zone)).all():
            self._outside[:] = np.nan
            return ""
        side = np.where(now > self._high, 1.0, np.where(now < self._low, -1.0, 0.0))
        beyond = np.where(side > 0, now - self._high, self._low - now)
        for axis in np.flatnonzero(side):
            if beyond[axis] > self._zone[axis]:
                return self._lost(int(axis), f"is {beyond[axis] * 1000:.3g} m{self._unit} beyond its limit")
            if np.isnan(self._outside[axis]) or beyond[axis] < self._outermost[axis] - PROGRESS * self._zone[axis]:
                self._outside[axis], self._outermost[axis] = times[-1], beyond[axis]
            elif times[-1] - self._outside[axis] > RETURN:
                return self._lost(int(axis), f"is {beyond[axis] * 1000:.3g} m{self._unit} beyond its limit and does not come back")
        self._outside[side == 0] = np.nan
        return self._not_slowed(times, place)

    def _not_slowed(self, times: FloatArray, place: FloatArray) -> str:
        since = times[-1] - times
        if since[0] < 2 * SLOWING:
            return ""
        middle, before = int(np.argmin(np.abs(since - SLOWING))), int(np.argmin(np.abs(since - 2 * SLOWING)))
        acting = self._means[self._ends > (times[before] - self._reaction) * self.rate]
        acting = acting[acting.any(axis=1)]
        if not len(acting):
            return ""
        for sign, edge in ((1.0, self._high - self._zone), (-1.0, self._low + self._zone)):
            pushed = (-sign * acting >= 0.95 * self._push - 1e-12).all(axis=0) & (self._push > 0)
            last, first = sign * (place[-1] - place[middle]), sign * (place[middle] - place[before])
            going = pushed & (sign * (place[-1] - edge) > 0) & (last > PROGRESS * self._zone) & (last > 0.9 * first)
            if going.any():
                return self._lost(int(np.argmax(going)), f"moves outward, not slowed by full inward {self._what}")
        return ""

    def _lost(self, axis: int, what: str) -> str:
        return f"{self.axes[axis]} {what}: a sign is wrong, brake_voltage is too small, a load drives it, or it is held. {BY_HAND}"


def _wider(ends: FloatArray, values: FloatArray) -> FloatArray:
    """(2, axes) minimum and maximum, extended by these values."""
    return np.stack((np.fmin(ends[0], values), np.fmax(ends[1], values)))


def _smooth(values: FloatArray, width: int) -> FloatArray:
    """(n - width + 1, axes) moving averages over ``width`` rows."""
    sums = np.cumsum(np.vstack((np.zeros((1, values.shape[1])), values)), axis=0)
    return np.asarray((sums[width:] - sums[:-width]) / width, dtype=np.float64)


def _detrended(values: FloatArray) -> FloatArray:
    """The values without mean and straight line."""
    line = np.arange(len(values)) - (len(values) - 1) / 2
    centred = values - values.mean(axis=0)
    return np.asarray(centred - np.outer(line, line @ centred) / max(float(line @ line), 1e-300), dtype=np.float64)
