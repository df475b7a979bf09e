"""xy-sysid coupling: do two single-axis models suffice?"""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

import numpy as np
import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.output import emit, say, table
from xy_sysid.cli.reading import read, reads

if TYPE_CHECKING:
    from xy_sysid.imports.reading import Reading

Combine = Annotated[str, typer.Option(help="for machines on which both drives move both axes: corexy (two motors) or gantry (two sides)")]


@reads
def coupling(recs: o.Recs, reading: Reading, combine: Combine = "", set_: o.Set = None, params: o.Params = None, json: o.Json = False) -> None:
    """Estimate the 2 x 2 response of two axes driven at once, and whether two single-axis models suffice."""
    from xy_sysid.fitting.two_axes import coupling_in

    settings = o.settings_from(params, set_)
    recording = read(recs, reading, json)
    found = coupling_in(recording, settings, combine)
    if json:
        emit(
            {
                "axes": found.axes,
                "notes": recording.notes,
                "sentence": found.sentence,
                "suffice": found.suffice,
                "largest": found.largest,
                "band_edges": found.band_edges,
                "coupling": found.coupling,
                "at_most": found.at_most,
                "frequency": found.frequency,
                "response": found.response.reshape(-1, 4),
                "sigma": found.sigma.reshape(-1, 4),
            }
        )
        return
    say(found.sentence, style="bold")
    edges = found.band_edges
    rows = [
        (f"{low:.3g} to {high:.3g}", f"{100 * size:.2g}", f"{100 * most:.2g}", f"{20 * np.log10(most):.0f}")
        for low, high, size, most in zip(edges[:-1], edges[1:], found.coupling, found.at_most, strict=True)
    ]
    table("", ("Hz", "coupling %", "at most %", "at most dB"), rows)
