"""Does a joint follow the position that its controller is told? If not, the controller does not listen, or something holds the joint.

off the way     further from where the reference was lately than the brake zone
no answer       the reference moves by a good part of its limit and the encoder shows one and the same number
"""

from __future__ import annotations

from collections import deque

import numpy as np

from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import ExcitationSettings

MEMORY = 1.0  # s of reference and motion that are looked at
MOVES = 0.25  # part of the limit by which the reference must have moved before standing still says anything


class FollowCheck:
    """``sent`` and ``saw`` in the order in which they happen; ``saw`` says why to stop, or nothing."""

    def __init__(self, settings: ExcitationSettings) -> None:
        self.axes = tuple(settings.axes)
        self._sent: deque[tuple[float, FloatArray, FloatArray]] = deque()  # last counter, least and greatest reference, (axes,) each
        self._seen: deque[tuple[float, FloatArray]] = deque()
        self.use(settings)

    def use(self, settings: ExcitationSettings) -> None:
        """Take limits from the settings."""
        self.rate, self._unit = settings.rate, settings.unit
        axes = list(settings.axes.values())
        self._limit, self._zone = np.array([a.limit for a in axes]), np.array([a.brake for a in axes])

    def sent(self, seq: float, values: FloatArray) -> None:
        """References, (n, axes), whose first sample has this counter."""
        self._sent.append((seq + len(values) - 1, values.min(axis=0), values.max(axis=0)))
        while self._sent[0][0] < self._sent[-1][0] - MEMORY * self.rate:
            self._sent.popleft()

    def saw(self, seq: FloatArray, values: FloatArray) -> str:
        """Positions, (n, axes), with their counters; why driving must end, or nothing."""
        self._seen.append((float(seq[-1]), values[-1]))
        while self._seen[0][0] < self._seen[-1][0] - MEMORY * self.rate:
            self._seen.popleft()
        if not self._sent:
            return ""
        low = np.min([least for _, least, _ in self._sent], axis=0)
        high = np.max([greatest for _, _, greatest in self._sent], axis=0)
        off = np.maximum(low - self._zone - values[-1], values[-1] - high - self._zone)
        if (off > 0).any():
            axis = int(np.argmax(off))
            return (
                f"{self.axes[axis]}: the position is {1000 * (off[axis] + self._zone[axis]):.3g} m{self._unit} away from where its reference was: "
                "the controller does not follow, or something pushes it"
            )
        places = np.array([place for _, place in self._seen])
        whole = self._sent[-1][0] - self._sent[0][0] > 0.9 * MEMORY * self.rate and self._seen[-1][0] - self._seen[0][0] > 0.9 * MEMORY * self.rate
        still = (np.ptp(places, axis=0) == 0) & (high - low > MOVES * self._limit)
        if whole and still.any():
            axis = int(np.argmax(still))
            return (
                f"{self.axes[axis]}: the position stands still while its reference moves by {1000 * (high - low)[axis]:.3g} m{self._unit}: "
                "the controller does not listen, the encoder is frozen, or friction holds it (raise rms)"
            )
        return ""
