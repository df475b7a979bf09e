"""Story figures of where a model fails: its error divided by the noise floor, by frequency, speed, position and time."""

from __future__ import annotations

import numpy as np
import plotly.graph_objects as go

from xy_sysid.report.parts import frequency_axis, plain, positive
from xy_sysid.report.story_parts import Document, drawing, floor_line, legend_name, nothing, pictured, ratio_axis, row, shade, shade_held_out
from xy_sysid.report.theme import FAILS, MODEL, UNTRUSTED, fade
from xy_sysid.units import motion

LEAST = 0.25  # of the noise floor: the axis shows at least this range, so that a small mean error looks small


def residual(document: Document, step: int | None = None, mode: str = "light") -> go.Figure:
    """Error divided by the noise floor, by frequency, on held-out data; failing bands are shaded and labelled."""
    shown = pictured(document, step)
    if shown is None:
        return nothing(document["sentence"], mode)
    picture = shown["pictures"]["residual"]["frequency"]
    frequency, ratio = row(picture["frequency"]), row(picture["error_over_floor"])
    end = float(picture["up_to"])
    known, inside = np.isfinite(ratio), frequency <= 1.05 * end
    figure = drawing([1.0], 280, mode)
    if bool((known & ~inside).any()):
        beyond = known & (frequency >= frequency[known & inside][-1]) if bool((known & inside).any()) else known
        figure.add_scatter(
            x=frequency[beyond],
            y=positive(ratio[beyond]),
            mode="lines",
            line={"color": fade(UNTRUSTED, 0.8), "width": 1.2},
            name="noise only",
            row=1,
            col=1,
        )
    used = known & inside
    figure.add_scatter(
        x=frequency[used], y=positive(ratio[used]), mode="lines+markers", line={"color": MODEL, "width": 1.8}, marker={"size": 5},
        name=legend_name("error of the model", shown), row=1, col=1,
    )  # fmt: skip
    figure.update_layout(showlegend=True)
    ratio_axis(figure, [ratio])
    floor_line(figure)
    places = [item for item in shown["pictures"]["failing"] if item["kind"] == "frequency" and item["to"] > frequency[0]]
    shade(figure, places, (float(frequency[0]), float(frequency[-1])), log=True)
    frequency_axis(figure, 1, [frequency])
    return figure


def residual_speed(document: Document, step: int | None = None, mode: str = "light") -> go.Figure:
    """Error against velocity: rms divided by the noise floor, and mean. Friction shows at zero, saturation at the ends."""
    return _against(document, "speed", step, mode)


def residual_position(document: Document, step: int | None = None, mode: str = "light") -> go.Figure:
    """Error against position: rms divided by the noise floor, and mean. Cogging, lead errors and springs show here."""
    return _against(document, "position", step, mode)


def residual_time(document: Document, step: int | None = None, mode: str = "light") -> go.Figure:
    """Error against time: rms divided by the noise floor, and mean. Drift shows here. Held-out data are grey."""
    return _against(document, "time", step, mode)


def residual_correlation(document: Document, step: int | None = None, mode: str = "light") -> go.Figure:
    """Correlation of the error with itself and with past inputs. Grey: range for unrelated signals; stems outside it indicate a model fault."""
    shown = pictured(document, step)
    if shown is None:
        return nothing(document["sentence"], mode)
    picture = shown["pictures"]["residual"].get("correlation")
    if picture is None:
        return nothing("Too few samples to correlate the error with the input.", mode)
    figure = drawing([0.5, 0.5], 380, mode, gap=0.2, shared=False)
    curves = (
        (1, "lag", "autocorrelation", "white", "autocorrelation"),
        (2, "shift", "input_correlation", "unrelated", "cross-correlation"),
    )
    for at, by, name, bound, title in curves:
        time, value, limit = row(picture[by]), row(picture[name]), float(picture[bound])
        beyond = np.abs(value) > limit
        for chosen, colour, said in ((~beyond, UNTRUSTED, "within chance"), (beyond, FAILS, "beyond chance")):
            figure.add_bar(
                x=time[chosen], y=value[chosen], marker={"color": colour, "line": {"width": 0}}, name=said, legendgroup=said,
                showlegend=at == 2, row=at, col=1,
            )  # fmt: skip
        figure.add_hrect(y0=-limit, y1=limit, fillcolor=fade(UNTRUSTED, 0.25), line_width=0, layer="below", row=at, col=1)  # no shape without a curve
        seen = value[1:] if at == 1 else value  # at lag 0 it is 1 by definition
        reach = 1.15 * max(float(np.max(np.abs(seen), initial=0.0)), 1.5 * limit)
        figure.update_yaxes(title_text=title, range=[-reach, reach], tickformat="~g", row=at, col=1)
        figure.update_xaxes(title_text="lag (s)" if at == 1 else "lag behind the input (s)", row=at, col=1)
    figure.update_layout(bargap=0.15, barmode="overlay")
    return figure


def _against(document: Document, kind: str, step: int | None, mode: str) -> go.Figure:
    shown = pictured(document, step)
    if shown is None:
        return nothing(document["sentence"], mode)
    output = document["units"]["output"]
    scale, unit = {"speed": motion(f"{output}/s"), "position": motion(output), "time": (1.0, "s")}[kind]
    faster, speed = motion(f"{output}/s")
    picture = shown["pictures"]["residual"][kind]
    by, ratio, mean = row(picture[kind]), row(picture["error_over_floor"]), row(picture["mean_error"])
    figure = drawing([0.55, 0.45], 340, mode)
    style = {"mode": "lines+markers", "line": {"color": MODEL, "width": 1.8}, "marker": {"size": 4}}
    figure.add_scatter(x=by * scale, y=positive(ratio), name=legend_name("error of the model", shown), **style, row=1, col=1)
    figure.add_scatter(x=by * scale, y=mean * faster, name=f"mean error ({speed})", **style, showlegend=False, row=2, col=1)
    ratio_axis(figure, [ratio])
    floor_line(figure)
    places = [item for item in shown["pictures"]["failing"] if item["kind"] == kind and item["to"] > item["from"]]
    if by.size > 1:
        shade(figure, places, (float(by[0]), float(by[-1])), log=False, scale=scale)
    if by.size > 1 and kind == "speed":  # a place is a range of |speed|; the figure has signed velocity
        mirrored = [{**item, "from": -item["to"], "to": -item["from"]} for item in places]
        shade(figure, mirrored, (float(by[0]), float(by[-1])), log=False, scale=scale, named=0)
    if kind == "time":
        shade_held_out(figure, document, shown, at=(1, 2))
    least = LEAST * faster * float(shown["noise_floor"])
    reach = 1.1 * max(least, faster * float(np.nanmax(np.abs(mean), initial=0.0)))
    figure.update_layout(showlegend=True)
    figure.update_yaxes(title_text=f"mean ({plain(speed)})", range=[-reach, reach], tickformat="~g", row=2, col=1)
    figure.update_xaxes(title_text=f"{'velocity' if kind == 'speed' else kind} ({plain(unit)})", row=2, col=1)
    return figure
