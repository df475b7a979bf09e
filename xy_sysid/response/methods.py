"""The methods for a frequency response, one row of METHODS each: windows to sums, addition of sums, sums to response."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from xy_sysid.response.batch_spectra import batch_spectra
from xy_sysid.response.closed_loop import LoopTransformer, RunningLoop, joint_input_output, loop_spectra
from xy_sysid.response.frf import FrequencyResponse
from xy_sysid.response.h1 import H1Options, frequency_response
from xy_sysid.response.local_polynomial import LocalTransformer, RunningLocal, added, local_response, of_window
from xy_sysid.response.spectra import RunningSpectra, State, Transformer
from xy_sysid.response.windows import Window, WindowShape
from xy_sysid.samples.block import FloatArray, StreamName
from xy_sysid.samples.pairing import QUANTITIES

Stretch = tuple[int, FloatArray, FloatArray, FloatArray]
"""Counter of the first sample, reference (n,) or (0,), input (n,), output (n,) of a gap-free stretch."""


class Running(Protocol):
    """Sums over windows."""

    def update(self, window: Any) -> None:
        """Add one window."""

    def get(self) -> Any:
        """The sums so far."""

    def state(self) -> State:
        """The state as arrays, to continue later."""

    def restore(self, state: State) -> None:
        """Continue from a state of the same shape."""


@dataclass(frozen=True, slots=True)
class ResponseMethod:
    """A method that estimates a frequency response.

    reference: True if it needs one; tapered: True if windows overlap and have a taper (settings), False if they are adjacent and rectangular
    transform: (shape, differenced) -> function from a window to the input of ``running``; running: (shape, forget, sliding)
    whole:     (pieces, shape, differenced) -> the sums over full stretches; estimate: (sums, shape, rate, options) -> the response
    windows:   sums -> number of windows in them
    """

    reference: bool
    tapered: bool
    transform: Callable[[WindowShape, bool], Callable[[Window], list[Any]]]
    running: Callable[[WindowShape, float, int], Running]
    whole: Callable[[list[Stretch], WindowShape, bool], Any]
    estimate: Callable[[Any, WindowShape, float, H1Options], FrequencyResponse]
    windows: Callable[[Any], float]
    note: str = ""

    @property
    def plain(self) -> bool:
        """True if it divides averaged spectra of output and input, with nothing else: H1."""
        return self.tapered and not self.reference

    @property
    def streams(self) -> tuple[StreamName, ...]:
        """The streams that it needs."""
        return (*QUANTITIES, "reference") if self.reference else QUANTITIES

    def shape(self, window: str, length: int, overlap: float) -> WindowShape:
        """The shape of the method's windows."""
        return WindowShape.of(window, length, overlap) if self.tapered else WindowShape.of("boxcar", length, 0.0)


def _whole_local(rational: bool) -> Callable[[list[Stretch], WindowShape, bool], Any]:
    def summed(pieces: list[Stretch], shape: WindowShape, differenced: bool) -> Any:
        total = None
        for seq, _, u, y in pieces:
            output = np.diff(y) if differenced else y
            for begin in range(-seq % shape.hop, output.shape[0] - shape.length + 1, shape.hop):
                total = added(total, of_window(u[begin : begin + shape.length], output[begin : begin + shape.length], rational))
        return total

    return summed


def _local(rational: bool, note: str) -> ResponseMethod:
    return ResponseMethod(
        reference=False,
        tapered=False,
        transform=lambda _shape, differenced: LocalTransformer(differenced, rational),
        running=lambda _shape, forget, sliding: RunningLocal(forget, sliding),
        whole=_whole_local(rational),
        estimate=local_response,
        windows=lambda sums: float(sums.weight),
        note=note,
    )


METHODS: dict[str, ResponseMethod] = {
    "h1": ResponseMethod(
        reference=False,
        tapered=True,
        transform=Transformer,
        running=RunningSpectra,
        whole=lambda pieces, shape, differenced: batch_spectra([(seq, u, y) for seq, _, u, y in pieces], shape, differenced),
        estimate=frequency_response,
        windows=lambda sums: float(sums.weight),
    ),
    "joint_input_output": ResponseMethod(
        reference=True,
        tapered=True,
        transform=LoopTransformer,
        running=RunningLoop,
        whole=loop_spectra,
        estimate=joint_input_output,
        windows=lambda sums: float(sums.output.weight),
        note="Closed loop: the joint input-output method, with the reference as instrument.",
    ),
    "local_polynomial": _local(False, "Local polynomial method: windows without a taper, their transients estimated and removed."),
    "local_rational": _local(True, "Local rational method: windows without a taper, their transients estimated and removed."),
}
