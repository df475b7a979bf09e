"""Does a joint follow the commanded position? If not, the controller does not respond, or the joint is blocked.

off the path    further from the recent references than the brake zone
no answer       the reference moves by a large part of its limit and the encoder reading is constant
"""

from __future__ import annotations

from collections import deque

import numpy as np

from xy_sysid.samples.block import FloatArray
from xy_sysid.settings import ExcitationSettings

MEMORY = 1.0  # s of reference and motion that are kept
MOVES = 0.25  # of the limit: a smaller motion of the reference is not checked


class FollowCheck:
    """Call ``sent`` and ``saw`` in the order of events; ``saw`` returns the reason to stop, or an empty text."""

    def __init__(self, settings: ExcitationSettings) -> None:
        self.axes = tuple(settings.axes)
        self._sent: deque[tuple[float, FloatArray, FloatArray]] = deque()  # last counter, minimum and maximum reference, (axes,) each
        self._seen: deque[tuple[float, FloatArray]] = deque()
        self.use(settings)

    def use(self, settings: ExcitationSettings) -> None:
        """Take limits from the settings."""
        self.rate, self._unit = settings.rate, settings.unit
        axes = list(settings.axes.values())
        self._limit, self._zone = np.array([a.limit for a in axes]), np.array([a.brake for a in axes])

    def sent(self, seq: float, values: FloatArray) -> None:
        """Store references, (n, axes); seq is the counter of the first."""
        self._sent.append((seq + len(values) - 1, values.min(axis=0), values.max(axis=0)))
        while self._sent[0][0] < self._sent[-1][0] - MEMORY * self.rate:
            self._sent.popleft()

    def saw(self, seq: FloatArray, values: FloatArray) -> str:
        """Check positions, (n, axes), with their counters; returns the reason to stop, or an empty text."""
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
