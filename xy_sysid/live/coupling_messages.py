"""Topic content for two axes driven at the same time: the cross responses, the coupling by band, and the verdict."""

from __future__ import annotations

import numpy as np

from xy_sysid.live.messages import table
from xy_sysid.live.plain_messages import OK, WARN, ArrayMessage, StatusMessage, topic_of
from xy_sysid.response.coupling import Coupling

CROSS_COLUMNS = ("frequency", "real", "imag", "sigma")
COUPLING_COLUMNS = ("low", "high", "at_least", "at_most")


def coupling_topics(axes: tuple[str, ...]) -> tuple[str, ...]:
    """The topics of the first two axes; empty for a single axis."""
    if len(axes) < 2:
        return ()
    one, other = axes[:2]
    crosses = (topic_of("cross_frf", f"{output}_from_{driven}") for output, driven in ((one, other), (other, one)))
    return (*crosses, _bands(one, other))


def coupling_messages(found: Coupling) -> list[ArrayMessage]:
    """``cross_frf/<output>_from_<input>`` of both directions, and ``coupling/<one>_and_<other>``."""
    first, second, bands = coupling_topics(found.axes)
    made = []
    for topic, (i, j) in ((first, (0, 1)), (second, (1, 0))):
        response = found.response[:, i, j]
        made.append(table(topic, CROSS_COLUMNS, np.column_stack((found.frequency, response.real, response.imag, found.sigma[:, i, j]))))
    rows = np.column_stack((found.band_edges[:-1], found.band_edges[1:], found.coupling, found.at_most))
    return [*made, ArrayMessage(bands, ("band", ",".join(COUPLING_COLUMNS)), (rows.shape[0], rows.shape[1]), np.ascontiguousarray(rows).ravel())]


def coupling_status(found: Coupling) -> StatusMessage:
    """``metrics``: the verdict; WARN if two single-axis models do not suffice."""
    values = {"largest (1)": f"{found.largest:.6g}", "suffice": str(found.suffice).lower(), "at least (1)": f"{float(np.max(found.coupling)):.6g}"}
    return StatusMessage(coupling_name(found.axes), WARN if found.coupled else OK, found.sentence, tuple(values.items()))


def coupling_name(axes: tuple[str, ...]) -> str:
    """The name of the status."""
    return f"coupling of {axes[0]} and {axes[1]}"


def _bands(one: str, other: str) -> str:
    return topic_of("coupling", f"{one}_and_{other}")
