"""A frequency response measured elsewhere -> FrequencyResponse, with the given uncertainty, or one from its coherence or its scatter."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from xy_sysid.errors import BadInput
from xy_sysid.response.frf import ComplexArray, FrequencyResponse
from xy_sysid.samples.block import FloatArray
from xy_sysid.samples.recording import Origin

FEWEST = 8  # lines; fewer do not determine a transfer function
NEIGHBOURS = 7  # lines to which a parabola is fitted; their residual is the noise of the middle one
KNOWN = 100.0  # number of averages assumed for a given sigma: it is known to 7 %
SMALLEST = 1e-6  # of the response: numbers in files are not more accurate


@dataclass(frozen=True, slots=True)
class Known:
    """Additional information on a response.

    sigma: (m,) standard deviation of the complex error; coherence: (m,) 0..1; averages: independent averages of the coherence
    sampling_rate: Hz, twice the highest line if it is unknown
    """

    sigma: Any = None
    coherence: Any = None
    averages: float | None = None
    sampling_rate: float | None = None


def given_response(frequency: Any, response: Any, known: Known, units: tuple[str, str], origin: Origin) -> FrequencyResponse:
    """A frequency response from arrays.

    frequency: (m,) Hz; response: (m,) complex; units: of input and output; origin: axis and notes
    Without sigma, and without a coherence with its averages, sigma is the scatter of each line about its neighbours.
    Raises BadInput for arrays that do not fit together or are too short.
    """
    try:
        f = np.asarray(frequency, dtype=np.float64).ravel()
        h = np.asarray(response, dtype=np.complex128).ravel()
    except (TypeError, ValueError):
        raise BadInput("frequency response", "not of numbers", "frequencies in Hz, and complex values", "Give two arrays of numbers.") from None
    if f.shape != h.shape:
        raise BadInput("frequency response", f"{f.size} frequencies and {h.size} values", "one value for each frequency", "Give both alike.")
    given = {"sigma": known.sigma, "coherence": known.coherence}
    told = {name: np.asarray(values, dtype=np.float64).ravel() for name, values in given.items() if values is not None}
    for name, values in told.items():
        if values.shape != f.shape:
            raise BadInput(name, f"of {values.size} lines", f"{f.size}, one for each frequency", "Give one value for each frequency.")
    good = np.isfinite(f) & np.isfinite(h) & (f > 0) & (np.abs(h) > 0)
    order = np.flatnonzero(good)[np.argsort(f[good], kind="stable")]
    order = order[np.concatenate(([True], np.diff(f[order]) > 0))] if order.size else order
    if order.size < FEWEST:
        raise BadInput("frequency response", f"{order.size} lines with a frequency above 0 and a value", f"{FEWEST} or more", "Measure more lines.")
    f, h = f[order], h[order]
    told = {name: values[order] for name, values in told.items()}
    error, counted, said = _sigma(f, h, told, known.averages)
    return FrequencyResponse(
        frequency=f,
        response=h,
        coherence=np.clip(told["coherence"], 0.0, 1.0) if "coherence" in told else np.ones(f.size),
        sigma=np.maximum(error, SMALLEST * np.abs(h)),
        trusted=np.isfinite(error),
        sampling_rate=float(known.sampling_rate) if known.sampling_rate else 2.0 * float(f[-1]),
        averages=counted,
        resolution=0.0,
        input_unit=units[0],
        output_unit=units[1],
        origin=replace(origin, notes=(*origin.notes, said)),
    )


def _sigma(f: FloatArray, h: ComplexArray, told: dict[str, FloatArray], averages: float | None) -> tuple[FloatArray, float, str]:
    """(m,) sigma, the equivalent number of averages, and the origin of sigma."""
    if "sigma" in told:
        return told["sigma"], averages or KNOWN, "the uncertainty is the standard deviation of the file"
    if "coherence" in told and averages:
        c = np.clip(told["coherence"], 1e-9, 1.0)
        return (
            np.abs(h) * np.sqrt((1.0 - c) / c / max(averages - 1.0, 1.0)),
            averages,
            f"the uncertainty follows from the coherence and {averages:g} averages",
        )
    error, freedom = _roughness(f, h)
    return error, 1.0 + freedom, "the uncertainty is the scatter of each line about its neighbours, as no standard deviation is given"


def _roughness(f: FloatArray, h: ComplexArray) -> tuple[FloatArray, float]:
    """(m,) scatter about a local parabola over the logarithm of frequency, and its degrees of freedom."""
    width = min(NEIGHBOURS, f.size)
    x = np.log(f)
    error = np.empty(f.size)
    for place in range(f.size):
        begin = min(max(place - width // 2, 0), f.size - width)
        near = slice(begin, begin + width)
        basis = np.vander((x[near] - x[place]) / max(float(np.ptp(x[near])), 1e-12), 3)
        left = h[near] - basis @ np.linalg.lstsq(basis.astype(np.complex128), h[near], rcond=None)[0]
        error[place] = float(np.sqrt(np.sum(np.abs(left) ** 2) / (width - 3)))
    return error, float(width - 3)
