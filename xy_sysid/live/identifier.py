"""The online logic without any IO: feed(samples) -> requests for fits.

The same samples in any chunking, live or replayed, give the same requests, bit for bit: windows lie on a grid of the
sample counter, and a fit is due after a fixed number of seconds of data, never of clock time.
"""

from __future__ import annotations

from collections import Counter, deque
from dataclasses import dataclass, field

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.live.recent import Recent
from xy_sysid.response.coupling import LONGER, Coupling, RunningCrossSpectra, coupling_of
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.response.h1 import H1Options
from xy_sysid.response.methods import METHODS, Running
from xy_sysid.response.spectra import State
from xy_sysid.response.window_check import window_fault
from xy_sysid.response.windows import Window, Windower, WindowShape
from xy_sysid.samples.block import Block, Samples, StreamName
from xy_sysid.samples.pairing import QUANTITIES, RATE_TOLERANCE, Gap, Pairer
from xy_sysid.samples.rate import StampLine
from xy_sysid.samples.reference import ReferenceHold
from xy_sysid.settings import IdentifierSettings
from xy_sysid.units import USUAL, Units

STATE_VERSION = 1
CUTS = ("time_jump", "restart", "unequal_rates")  # gaps after which a new line is fitted to the time stamps


@dataclass(frozen=True, slots=True)
class AxisRequest:
    """The data for the fit of one axis.

    frf:     from all remembered windows
    recent:  from the newest ``alarm_windows`` windows, None before there are that many
    windows: windows used so far; dropped: windows not used, by reason
    """

    frf: FrequencyResponse
    recent: FrequencyResponse | None
    windows: int
    dropped: dict[str, int] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class FitRequest:
    """A fit is due.

    number: counts the requests from 1; seq: counter of the first sample after the newest window
    seconds: of received data; faults: samples or blocks not used, by reason; going_on: reasons that still occur, by axis
    """

    number: int
    seq: int
    seconds: float
    sampling_rate: float
    axes: dict[str, AxisRequest]
    faults: dict[str, int]
    going_on: dict[str, tuple[str, ...]]
    coupling: Coupling | None = None  # of the first two axes; None for one axis, in closed loop, and while it is unknown


class Identifier:
    """Pairs samples, cuts windows, updates spectra; ``feed`` returns the fits that are due."""

    _both: RunningCrossSpectra | None  # of the first two axes
    _coupled: tuple[tuple[int, float, tuple[float, float]], Coupling | None] | None  # the newest coupling, and its windows, rate and band, Hz

    def __init__(self, settings: IdentifierSettings, axes: tuple[str, ...], units: Units = USUAL) -> None:
        if not axes:
            raise BadInput("axes", "empty", "one name or more", "Name the axes, for example x and y.")
        self.settings = settings
        self.axes = axes
        self._units = units
        self._method = METHODS[settings.response]
        self._shape = self._method.shape(settings.window, settings.length, settings.overlap)
        self._transform = self._method.transform(self._shape, settings.differenced)
        self.reset()

    def reset(self) -> None:
        """Delete all received data."""
        self._pairer: Pairer | None = None
        self._rate: float | None = None
        self._line = StampLine()
        self._hold = ReferenceHold(self.axes, self.settings.reorder) if self._method.reference else None
        self._windower = Windower(self._shape, len(self.axes), int(self.settings.differenced), self._method.reference)
        self._main: dict[str, Running] = {}
        self._recent: dict[str, Running] = {}
        self._start_coupling()
        self._used: Counter[str] = Counter()
        self._dropped: dict[str, Counter[str]] = {axis: Counter() for axis in self.axes}
        self._counts: Counter[str] = Counter()
        self._complaints = Recent()
        self._said: dict[str, str] = {}
        self._samples = 0
        self._slot = -1
        self._number = 0

    def change(self, settings: IdentifierSettings) -> None:
        """Use other settings from now on; only those that do not change the spectra (band, refit, coherence, frozen)."""
        self.settings = settings

    @property
    def sampling_rate(self) -> float | None:
        """Hz, from all time stamps of the samples in the windows; None while it is unknown."""
        return self._rate and (self._line.rate or self._rate)

    @property
    def samples(self) -> int:
        """Number of paired samples received."""
        return self._samples

    @property
    def faults(self) -> dict[str, int]:
        """Number of faults in the streams, by reason."""
        sources = (self._pairer.counts if self._pairer else Counter[str](), self._hold.counts if self._hold else Counter[str]())
        return dict(sum(sources, self._counts.copy()))

    @property
    def sentences(self) -> dict[str, str]:
        """The newest sentence for each reason."""
        return (self._hold.said if self._hold else {}) | (self._pairer.said if self._pairer else {}) | self._said

    @property
    def windows(self) -> dict[str, int]:
        """Number of windows used, by axis."""
        return {axis: self._used[axis] for axis in self.axes}

    @property
    def dropped(self) -> dict[str, dict[str, int]]:
        """Number of windows not used, by axis and reason."""
        return {axis: dict(self._dropped[axis]) for axis in self.axes}

    @property
    def waiting(self) -> dict[StreamName, int]:
        """Newest counter of each stream; -1 before the first sample."""
        paired = self._pairer.waiting if self._pairer else dict.fromkeys(QUANTITIES, -1)
        streams: dict[StreamName, int] = {kind: paired[kind] for kind in QUANTITIES}
        return streams | ({"reference": self._hold.newest} if self._hold else {})

    def feed(self, kind: StreamName, block: Block) -> list[FitRequest]:
        """Read one block of one stream; returns the fits that are due, in order. The reference is used in closed loop only."""
        requests: list[FitRequest] = []
        for event in self._events(kind, block):
            requests += self._gap(event) if isinstance(event, Gap) else self.take(event)
        return requests

    def _events(self, kind: StreamName, block: Block) -> list[Samples | Gap]:
        if kind == "reference":
            return self._hold.hear(block) if self._hold else []
        if self._pairer is None:
            self._pairer = Pairer(self.axes, self.settings.reorder)
        paired = self._pairer.feed(kind, block)
        return paired if self._hold is None else [event for one in paired for event in self._hold.take(one)]

    def take(self, samples: Samples, sampling_rate: float | None = None) -> list[FitRequest]:
        """Read samples that are already paired; windows of samples without a known rate are counted and dropped."""
        self._samples += len(samples)
        if samples.time is not None and sampling_rate is None:
            self._line.add(samples.seq, samples.time)
        if self._rate is None:
            self._rate = sampling_rate or (self._pairer.rate if self._pairer else None)
        requests: list[FitRequest] = []
        if self._both is not None:
            self._long_windows += self._long_windower.feed(samples)
        for window in self._windower.feed(samples):
            if self._rate is None or (self._pairer is not None and sampling_rate is None and self._pairer.rate is None):
                self._counts["no_rate"] += 1
            else:
                requests += self._window(window, self._follow_rate(self._rate))
        return requests

    def _follow_rate(self, before: float) -> float:
        """The rate of the current samples; spectra of another rate are deleted, with a message."""
        rate = self._pairer.rate if self._pairer is not None else None
        if rate is None or abs(rate / before - 1.0) <= RATE_TOLERANCE:
            return before
        self._counts["rate_changed"] += 1
        self._said["rate_changed"] = f"the source came back at {rate:.6g} Hz, before it was {before:.6g} Hz; the spectra are restarted"
        self._rate, self._samples, self._slot, self._line = rate, 0, -1, StampLine()
        self._main, self._recent, self._used = {}, {}, Counter()
        self._both, self._coupled = None if self._both is None else RunningCrossSpectra(self._long), None
        return rate

    def _gap(self, gap: Gap) -> list[FitRequest]:
        touched = bool(self._windower.pending())
        self._line.until(gap.seq)
        if gap.reason in CUTS:
            self._line.cut()
        self._windower.reset()
        self._long_windower.reset()
        for axis in self.axes:
            self._dropped[axis][gap.reason] += int(touched)
        return []

    def _window(self, window: Window, rate: float) -> list[FitRequest]:
        if not self._main:
            self._start_spectra(rate)
        frozen = max(round(self.settings.frozen * rate), 2)
        for column, (axis, spectrum) in enumerate(zip(self.axes, self._transform(window), strict=True)):
            fault = window_fault(window.voltage[:, column], window.position[:, column], frozen)
            if fault is None:
                self._main[axis].update(spectrum)
                self._recent[axis].update(spectrum)
                self._used[axis] += 1
            else:
                self._dropped[axis][fault] += 1
        end = window.index * self._shape.hop + self._shape.length
        self._hear_both(end, frozen)
        self._line.until(end)
        slot = end // max(round(self.settings.refit * rate), 1)
        if slot == self._slot or not any(self._used.values()):
            return []
        self._slot = slot
        self._number += 1
        return [self.request(end, self._line.rate or rate)]

    def _start_coupling(self) -> None:
        """For two axes whose inputs are the drive; uses all data since the start, and is not kept over a restart."""
        judged = len(self.axes) > 1 and self._method.plain and self.settings.differenced
        self._long = WindowShape.of(self.settings.window, LONGER * self.settings.length, self.settings.overlap)
        self._both = RunningCrossSpectra(self._long) if judged else None
        self._coupled = None
        self._long_windower = Windower(self._long, len(self.axes), 1)
        self._long_windows: deque[Window] = deque()

    def _hear_both(self, until: int, frozen: int) -> None:
        """Add long windows up to a counter, except those in which an encoder is frozen or jumps."""
        while self._both is not None and self._long_windows and self._long_windows[0].index * self._long.hop + self._long.length <= until:
            window = self._long_windows.popleft()
            if not any(window_fault(window.voltage[:, k], window.position[:, k], frozen) for k in (0, 1)):
                self._both.update(window.voltage[:, :2], np.diff(window.position[:, :2], axis=0))

    def _coupling(self, rate: float) -> Coupling | None:
        """The coupling from all long windows; computed again only if it can differ."""
        if self._both is None:
            return None
        band, spectra = (self.settings.band_low, self.settings.band_high), self._both.get()
        asked = spectra.windows, rate, band
        if self._coupled is None or self._coupled[0] != asked:
            try:
                found = coupling_of(spectra, self._long, rate, band, (self.axes[0], self.axes[1]), True)
            except BadInput:
                found = None
            self._coupled = asked, found
        return self._coupled[1]

    def _start_spectra(self, rate: float) -> None:
        memory = self.settings.memory
        forget = float(np.exp(-self._shape.hop / rate / memory)) if memory > 0 else 1.0
        for axis in self.axes:
            self._main[axis] = self._method.running(self._shape, forget, self.settings.sliding)
            self._recent[axis] = self._method.running(self._shape, 1.0, self.settings.alarm_windows)

    def request(self, seq: int, rate: float) -> FitRequest:
        """The fit request for the present data."""
        axes: dict[str, AxisRequest] = {}
        seconds = self._samples / rate
        streams = [reason for reason, count in self.faults.items() if self._complaints.goes_on(reason, count, seconds)]
        going_on = {}
        for axis in self.axes:
            dropped = [why for why, count in self._dropped[axis].items() if self._complaints.goes_on(f"{why} of {axis}", count, seconds)]
            going_on[axis] = tuple(sorted({*streams, *dropped}))
            if self._used[axis] == 0:
                continue
            enough = self._used[axis] >= self.settings.alarm_windows
            axes[axis] = AxisRequest(
                frf=self._frf(self._main[axis], rate),
                recent=self._frf(self._recent[axis], rate) if enough else None,
                windows=self._used[axis],
                dropped=dict(self._dropped[axis]),
            )
        return FitRequest(
            number=self._number,
            seq=seq,
            seconds=seconds,
            sampling_rate=rate,
            axes=axes,
            faults=self.faults,
            going_on=going_on,
            coupling=self._coupling(rate),
        )

    def _frf(self, running: Running, rate: float) -> FrequencyResponse:
        settings = self.settings
        options = H1Options(
            differenced=settings.differenced,
            band=(settings.band_low, settings.band_high),
            min_coherence=settings.min_coherence,
            units=self._units,
            rate_error=self._line.error,
        )
        return self._method.estimate(running.get(), self._shape, rate, options)

    def state(self) -> State:
        """All estimates as named arrays, to continue after a restart."""
        settings = self.settings
        state: State = {
            "version": np.array([STATE_VERSION], dtype=np.float64),
            "axes": np.array(self.axes),
            "key": np.array([settings.window, str(settings.length), str(settings.overlap), str(settings.differenced), *self._named]),
            "numbers": np.array([self._rate or 0.0, self._samples, self._number], dtype=np.float64),
            "clock": np.array([self._line.rate or 0.0, self._line.error], dtype=np.float64),
            "used": np.array([self._used[axis] for axis in self.axes], dtype=np.float64),
        }
        for name, group in (("main", self._main), ("recent", self._recent)):
            for axis, running in group.items():
                state.update({f"{name}/{axis}/{key}": value for key, value in running.state().items()})
        return state

    @property
    def _named(self) -> tuple[str, ...]:
        """Names for the states; states of output over input, the first method, have none."""
        return () if self._method.plain else (self.settings.response,)

    def restore(self, state: State) -> None:
        """Continue from a saved state; raises BadInput if it has other axes or windows."""
        fresh = self.state()
        for name in ("version", "axes", "key"):
            if name not in state or not np.array_equal(state[name], fresh[name]):
                saved = ", ".join(map(str, state.get(name, np.array(["missing"]))))
                raise BadInput(
                    f"saved state: {name}", saved, ", ".join(map(str, fresh[name])), "Delete the state file or restore the settings it was made with."
                )
        self.reset()
        rate, samples, number = np.real(np.asarray(state["numbers"], dtype=np.float64))
        self._rate, self._samples, self._number = (float(rate) or None), int(samples), int(number)
        if self._rate is None:
            return
        self._start_spectra(self._rate)
        clock = np.real(np.asarray(state.get("clock", np.zeros(2)), dtype=np.float64))
        if clock[0] > 0.0:
            self._line.start(*clock.tolist())
        for axis, used in zip(self.axes, np.asarray(state["used"], dtype=np.float64), strict=True):
            self._used[axis] = int(used)
            for name, group in (("main", self._main), ("recent", self._recent)):
                prefix = f"{name}/{axis}/"
                arrays = {key.removeprefix(prefix): np.asarray(value) for key, value in state.items() if key.startswith(prefix)}
                if arrays:
                    group[axis].restore(arrays)
