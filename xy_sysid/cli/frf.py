"""xy-sysid frf: the non-parametric model."""

from __future__ import annotations

import cmath
import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from xy_sysid.cli import options as o
from xy_sysid.cli.output import aside, emit, say, say_refused, table
from xy_sysid.cli.reading import chosen, each, named, read, reads
from xy_sysid.units import over

if TYPE_CHECKING:
    from xy_sysid.fitting.of_recording import AxisEstimate
    from xy_sysid.imports.reading import Reading
    from xy_sysid.response.frf import FrequencyResponse


@reads
def frf(
    recs: o.Recs,
    reading: Reading,
    set_: o.Set = None,
    params: o.Params = None,
    period: o.Period = "auto",
    csv: Annotated[Path | None, typer.Option("--csv", metavar="FILE", help="write frequency, real, imag, coherence and sigma of every line")] = None,
    force: o.Force = False,
    json: o.Json = False,
) -> None:
    """Estimate frequency response, coherence and uncertainty of each axis."""
    import numpy as np

    from xy_sysid.fitting.of_recording import estimate

    settings = o.settings_from(params, set_)
    o.output_file("--csv", csv, force)
    recording = read(recs, reading, json)
    samples = o.period_from(period)
    done, problems = each(chosen(recording, reading.axes), lambda name: estimate(recording, name, settings, samples))
    found = list(done.values())
    if csv is not None:
        _write_csv(csv, found)
    if json:
        emit(
            {
                "recording": {"source": named(recs), "sampling_rate": recording.sampling_rate, "samples": len(recording), "notes": recording.notes},
                "axes": {item.axis: {"windows": item.windows, "period": item.period, "notes": item.notes, "frf": item.frf} for item in found}
                | {name: {"problem": text} for name, text in problems.items()},
            }
        )
        return
    for item in found:
        f = item.frf
        for note in item.notes:
            say(f"axis {item.axis}: {note}", aside)
        say(
            f"axis {item.axis}: {int(f.trusted.sum())} of {len(f)} lines trusted, {f.resolution:.4g} Hz apart, "
            f"{item.windows} windows ({f.averages:.1f} independent), {recording.sampling_rate:.6g} Hz"
        )
        lines = np.unique(np.clip(np.searchsorted(f.frequency, np.geomspace(max(f.frequency[0], 1e-9), f.frequency[-1], 16)), 0, len(f) - 1))
        rows = [_row(f, int(k)) for k in lines]
        unit = over(f.output_unit, f.input_unit)
        table(f"axis {item.axis}, {unit}", ("Hz", f"dB ({unit})", "phase deg", "coherence", "sigma %", "trusted"), rows)
    say_refused(problems, "no response. ")


def _row(f: FrequencyResponse, k: int) -> tuple[str, ...]:
    size, sigma = abs(complex(f.response[k])), float(f.sigma[k])
    level, phase = (f"{20 * math.log10(size):.2f}", f"{math.degrees(cmath.phase(complex(f.response[k]))):.1f}") if size > 0 else ("-", "-")
    spread = f"{100 * sigma / size:.2g}" if size > 0 and math.isfinite(sigma) else "-"
    return f"{f.frequency[k]:.4g}", level, phase, f"{f.coherence[k]:.4f}", spread, "yes" if f.trusted[k] else "no"


def _write_csv(path: Path, found: list[AxisEstimate]) -> None:
    import numpy as np

    from xy_sysid.bags.atomic import write_text

    rows = []
    for item in found:
        f = item.frf
        rows += [
            f"{item.axis},{a!r},{b.real!r},{b.imag!r},{c!r},{s!r},{int(t)}"
            for a, b, c, s, t in zip(*(np.asarray(v).tolist() for v in (f.frequency, f.response, f.coherence, f.sigma, f.trusted)), strict=True)
        ]
    write_text(path, "axis,frequency_hz,real,imag,coherence,sigma,trusted\n" + "\n".join(rows) + "\n")
