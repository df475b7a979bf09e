"""Colours that all users can distinguish, on white and on near-black; and one convention for units on axes."""

from __future__ import annotations

import itertools
import re

import numpy as np
import pytest
from helpers.stories import told

from xy_sysid.report import theme
from xy_sysid.report.gallery import gallery
from xy_sysid.samples.block import FloatArray
from xy_sysid.story.document import document

# Machado, Oliveira and Fernandes 2009, severity 1, on linear RGB
SEES = {
    "all": np.eye(3),
    "no red": np.array([[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]),
    "no green": np.array([[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]),
    "no blue": np.array([[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]),
}
APART, READABLE = 18.0, 2.8  # CIE76 difference; WCAG contrast (3 is required for graphics without other cues; ours also have a dash or marker)
PAPERS = ("#ffffff", "#161b22")
GROUPS = {
    "story": (theme.MEASURED, theme.MODEL, theme.FLOOR, theme.FAILS, theme.UNTRUSTED),
    "axes": theme.AXES[:4],
    "methods": tuple(theme.METHODS.values()),
    "before and after": (theme.BEFORE, theme.AFTER),
}


def linear(colour: str) -> FloatArray:
    part = np.array([int(colour[k : k + 2], 16) / 255 for k in (1, 3, 5)])
    return np.where(part <= 0.04045, part / 12.92, ((part + 0.055) / 1.055) ** 2.4)


def lab(rgb: FloatArray) -> FloatArray:
    white = np.array([0.9505, 1.0, 1.089])
    xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]) @ np.clip(rgb, 0, 1) / white
    f = np.where(xyz > 0.008856, np.cbrt(xyz), 7.787 * xyz + 16 / 116)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def contrast(first: str, second: str) -> float:
    light = sorted(float(np.dot([0.2126, 0.7152, 0.0722], linear(colour))) + 0.05 for colour in (first, second))
    return light[1] / light[0]


@pytest.mark.parametrize("who", SEES)
@pytest.mark.parametrize("group", GROUPS)
def test_colours_of_a_figure_are_told_apart_by_everybody(group: str, who: str) -> None:
    """The curves are distinguishable without red, green or blue vision."""
    for first, second in itertools.combinations(GROUPS[group], 2):
        apart = np.linalg.norm(lab(SEES[who] @ linear(first)) - lab(SEES[who] @ linear(second)))
        assert apart > APART, (first, second, float(apart))


@pytest.mark.parametrize("paper", PAPERS)
def test_curves_are_readable_on_light_and_on_dark_paper(paper: str) -> None:
    """The same colours are readable on both."""
    for colour in itertools.chain(*GROUPS.values()):
        assert contrast(colour, paper) > READABLE, (colour, contrast(colour, paper))


def test_every_axis_has_a_name_and_a_unit_in_one_way() -> None:
    """A quantity with its unit in brackets; ratios and coherence have none; time in s, frequency in Hz, angles in degrees."""
    plain = {"coherence", "autocorrelation", "cross-correlation", "error / floor", "difference", ""}
    for name, figure in gallery(document(told())).items():
        titles = {str(axis.title.text or "") for axis in [*figure.select_xaxes(), *figure.select_yaxes()]}
        wrong = [title for title in titles - plain if not re.fullmatch(r"[a-z -]+ \((mm|mm/s|s|Hz|°|V|rad/s)\)|dB re 1 mm/V", title)]
        assert not wrong, (name, wrong)
