"""Numbers for readers."""

from __future__ import annotations

import pytest

from xy_sysid.report.words import estimate_text, number, quantity, root
from xy_sysid.response.estimate import Estimate
from xy_sysid.units import readable


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [(-1.5, 3, "−1.5"), (293.4, 2, "290"), (4468611.0, 6, "4.46861·10⁶"), (3.2e-7, 2, "3.2·10⁻⁷"), (float("nan"), 3, "–"), (0.0, 3, "0")],
)
def test_a_number_has_a_true_minus_and_powers_of_ten_only_where_needed(value: float, digits: int, text: str) -> None:
    """No 1e+06 on a page."""
    assert number(value, digits) == text


def test_an_interval_keeps_its_zeros_and_shows_two_digits_of_its_half_width() -> None:
    """46.4070, not 46.407, next to 46.3928; milliseconds for seconds."""
    assert estimate_text(Estimate(name="r", value=46.3999, unit="Hz", low=46.3928, high=46.4070)) == "46.3999 [46.3928, 46.4070] Hz"
    assert estimate_text(Estimate(name="delay", value=1.29e-3, unit="s", low=1.28e-3, high=1.30e-3)) == "1.290 [1.280, 1.300] ms"
    assert estimate_text(Estimate(name="a", value=2.5e7, unit="", low=2.498e7, high=2.502e7)) == "2.5000 [2.4980, 2.5020]·10⁷"


def test_lengths_are_read_in_mm_and_other_units_stay() -> None:
    """m are shown as mm; rad are unchanged."""
    assert readable("m/s/V") == (1e3, "mm/s/V")
    assert quantity(0.0097, "m") == "9.7 mm"
    assert quantity(1.5, "rad") == "1.5 rad"


def test_a_pair_of_roots_is_written_once() -> None:
    """a ± bj."""
    assert root(complex(-12.18, 298.6)) == "−12.18 ± 298.6j"
    assert root(complex(-245.8, 0.0)) == "−245.8"
