"""Texts and decisions of the page, without a browser: recordings by name, numbers, nodes, settings, stories."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml
from helpers import ROOT

from xy_sysid.errors import BadInput
from xy_sysid.files.story_models import model_text
from xy_sysid.linear.transfer_function import TransferFunction
from xy_sysid.live.plain_messages import ArrayMessage, StatusMessage
from xy_sysid.page.control import on_activate
from xy_sysid.page.document_words import look_alike_lines, model_effects, verdict_words
from xy_sysid.page.downloads import plain_name
from xy_sysid.page.facts import coherence_fact, dropped_words, facts, polynomial, seconds_text, transfer_function_html
from xy_sysid.page.live_figures import failing, failing_words, response_figure, tracking_figure
from xy_sysid.page.notices import BAD_STAYS, BEFORE, GOOD_STAYS, SHOWN, Notices
from xy_sysid.page.orders import Reading
from xy_sysid.page.session import Message, Session
from xy_sysid.page.settings_form import changes, limits
from xy_sysid.page.shelf import Shelf
from xy_sysid.page.topics_state import LOST, TopicsState, columns, thinned
from xy_sysid.page.views import view_of, views
from xy_sysid.settings import AxisExcitation, knobs


def test_the_design_knows_the_effects_that_the_page_was_given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The design gets the files of --effect-file, because it simulates a user's own effects."""
    pytest.importorskip("rclpy")
    from xy_sysid.nodes import settle

    wished: list[Any] = []

    class Settler:
        """Stores its arguments, and ends."""

        problem, outcome, ending, steps = "", "", "stopped", ()

        def __init__(self, wishes: Any, *_: Any) -> None:
            wished.append(wishes)

        def run(self) -> bool:
            return True

        def close(self) -> None:
            """Nothing to do."""

    monkeypatch.setattr(settle, "Settler", Settler)
    monkeypatch.setattr("xy_sysid.page.link.Link", lambda *_: SimpleNamespace(close=lambda: None))
    monkeypatch.setattr("xy_sysid.page.live.Live", lambda *_: None)
    session = Session(Shelf(tmp_path), True, "/xy", Reading({}, (), (Path("own.py"),)))
    assert session.settling is not None
    session.settling.start("x")
    session.close()
    assert wished[0].effect_files == ("own.py",)


@pytest.fixture
def shelf(tmp_path: Path) -> Shelf:
    folder = tmp_path / "shelf"
    for name in ("bag/metadata.yaml", "day/other/metadata.yaml", "a.csv", "b.NPZ", "notes.txt", ".hidden/metadata.yaml"):
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text("")
    (tmp_path / "secret.csv").write_text("")
    (folder / "link.csv").symlink_to(tmp_path / "secret.csv")
    (folder / "out").symlink_to(tmp_path)
    return Shelf(folder)


def test_the_shelf_lists_bags_and_tables_of_its_folder_only(shelf: Shelf) -> None:
    """No hidden folders, no links to other places, only recordings."""
    assert shelf.names() == ["a.csv", "b.NPZ", "bag", "day/other"]
    assert shelf.find("day/other") == shelf.folder / "day/other"


@pytest.mark.parametrize("name", ["../secret.csv", "/etc/passwd", "link.csv", "out/secret.csv", "bag/../../secret.csv", "", ".", "a.csv\0", "bag/"])
def test_a_name_from_a_browser_never_becomes_a_path_of_its_own(shelf: Shelf, name: str) -> None:
    """Only names in the list can be opened, with exact spelling."""
    with pytest.raises(BadInput, match="recording is"):
        shelf.find(name)


@pytest.mark.parametrize("name", ["../x", "a/b", "", ".hidden", "a" * 65, "a b", "x\n", "-rf", "bag", "a\0"])
def test_a_new_bag_has_a_plain_name_that_is_free(shelf: Shelf, name: str) -> None:
    """Letters, digits and - _ . only, in the folder of the shelf, never over an existing file."""
    with pytest.raises(BadInput, match="name of the bag"):
        shelf.new(name)
    assert shelf.new("xy_2026-01-01_12.5").parent == shelf.folder


VALUES = {
    "windows": "14", "seconds of data (s)": "31.2", "dropped windows": "3", "dropped windows: lost": "2", "dropped windows: frozen": "1",
    "relative error (1)": "0.0123", "delay (s)": "0.00129", "delay 95 % low": "0.00128", "delay 95 % high": "0.0013", "gain (m/s/V)": "0.097",
    "resonance_1.frequency (Hz)": "47.3", "resonance_1.frequency 95 % low": "47.2", "resonance_1.frequency 95 % high": "47.4",
    "resonance watched (Hz)": "47.3", "resonance reference (Hz)": "47.5", "sampling rate (Hz)": "2000",
}  # fmt: skip


def test_numbers_are_in_people_s_units_with_intervals_and_a_meaning() -> None:
    """ms and mm/s/V, an interval if there is one, and whether it is good."""
    found = {fact.label: fact for fact in facts(VALUES)}
    assert found["delay"].text == "1.290 [1.280, 1.300] ms"
    assert found["gain"].text == "97 mm/s/V"
    assert found["relative error"].text == "1.23 %" and found["relative error"].good is True
    assert found["windows dropped"].text == "3 (samples lost 2, encoder frozen 1)" and found["windows dropped"].good is False
    assert all(len(fact.meaning) > 20 for fact in found.values())
    assert facts({}) == [] and dropped_words({"dropped windows": "0"}) == "none"
    assert {fact.label: fact.good for fact in facts({"relative error (1)": "0.2"})} == {"relative error": False}
    assert facts({"relative error (1)": "nan", "delay (s)": "x"})[0].text.startswith("–")


def test_a_transfer_function_reads_as_mathematics() -> None:
    """Falling powers, true minus signs, no ones before s, delay as an exponential."""
    assert polynomial(np.array([1.0, -2.5, 0.0, 3.0])) == "s³ − 2.5 s² + 3"
    assert polynomial(np.array([-1.0, 0.0])) == "−s" and polynomial(np.zeros(2)) == "0" and polynomial(np.array([1.0])) == "1"
    words = transfer_function_html(np.array([23.9]), np.array([1.0, 246.0, 0.0]), 0.00129)
    assert "23.9" in words and "s² + 246 s" in words and "1.29 ms" in words
    assert "e<sup>" not in transfer_function_html(np.array([1.0]), np.array([1.0]), 0.0)


@pytest.mark.parametrize(("seconds", "words"), [(7.2, "7 s"), (99.6, "1 min 40 s"), (180, "3 min"), (7260, "2 h 1 min")])
def test_times_are_short(seconds: float, words: str) -> None:
    """Seconds, minutes, hours."""
    assert seconds_text(seconds) == words


def status(name: str, level: int = 0, message: str = "well", **values: str) -> StatusMessage:
    return StatusMessage(name, level, message, tuple(values.items()))


def test_a_node_that_falls_silent_is_called_lost_and_comes_back() -> None:
    """A node that is missing in the graph and silent for a while is lost; one in the graph but silent does not answer."""
    heard = TopicsState()
    assert heard.nodes(100.0) == []
    heard.graph({"excitation", "identifier", "mine"}, 10.0)
    heard.status(status("streams"), 10.0)
    heard.status(status("excitation", 2, "no position"), 10.0)
    assert [(node.name, node.level, node.lost) for node in heard.nodes(11.0)] == [
        ("excitation", 2, False),
        ("identifier", 0, False),
        ("mine", 0, False),
    ]
    late = 10.5 + LOST
    heard.graph({"identifier"}, late)
    told = {node.name: node for node in heard.nodes(late)}
    assert told["excitation"].lost and "lost" in told["excitation"].words
    assert told["identifier"].lost and "does not answer" in told["identifier"].words
    heard.status(status("streams"), late)
    assert not {node.name: node for node in heard.nodes(late)}["identifier"].lost


def test_the_resonance_is_remembered_until_the_identifier_begins_anew() -> None:
    """One entry per fit, with the alarm; fewer seconds than before clear the history."""
    heard = TopicsState()
    for seconds, level in ((10.0, 0), (12.0, 0), (14.0, 2)):
        values = tuple({**VALUES, "seconds of data (s)": str(seconds)}.items())
        heard.status(StatusMessage("axis x", level, "axis x: moved", values), seconds)
    assert [item.alarm for item in heard.resonances["x"]] == [False, False, True] and heard.alarms() == ["axis x: moved"]
    assert len(tracking_figure(list(heard.resonances["x"])).data) == 3
    heard.status(StatusMessage("axis x", 0, "", (("seconds of data (s)", "1"), *list(VALUES.items())[12:])), 20.0)
    assert len(heard.resonances["x"]) == 1
    assert heard.axes() == ("x",)


def test_what_is_not_a_story_is_said_and_left() -> None:
    """Broken JSON and other documents do not replace the last story."""
    heard = TopicsState()
    assert heard.story("x", json.dumps({"axis": "x"})) == "" and heard.stories["x"] == {"axis": "x"}
    assert "not JSON" in heard.story("x", "{") and "not a document" in heard.story("x", "[1]")
    assert heard.stories["x"] == {"axis": "x"} and heard.version["story x"] == 1


def responses(lines: int = 400) -> tuple[ArrayMessage, ArrayMessage]:
    """frf and comparison of a synthetic axis whose model fails from 20 to 40 Hz."""
    frequency = np.linspace(0.5, 500, lines)
    response = 1.0 / (2j * np.pi * frequency)
    coherence = np.where(frequency > 300, 0.1, 0.99)
    table = np.column_stack((frequency, response.real, response.imag, coherence, 0.01 * np.abs(response)))
    inside = frequency <= 300
    size = np.where((frequency > 20) & (frequency < 40), 50.0, 1.0)[inside]
    level = 20 * np.log10(np.abs(response[inside]))
    compared = np.column_stack((frequency[inside], level, level, size))
    frf = ArrayMessage("frf/x", ("line", "frequency,real,imag,coherence,sigma"), (lines, 5), table.ravel())
    return frf, ArrayMessage("comparison/x", ("line", "frequency,measured_db,model_db,residual_sigma"), (int(inside.sum()), 4), compared.ravel())


def test_failing_stretches_are_found_and_told_in_words() -> None:
    """One range, with its ends and size; none for a good model."""
    frf, comparison = responses()
    ((low, high, worst),) = failing(comparison)
    assert 18 < low < 22 and 37 < high < 42 and worst == 50.0
    assert "fails at" in failing_words(comparison) and "50 standard errors" in failing_words(comparison)
    quiet = columns(comparison)
    assert "within noise at every line" in failing_words(ArrayMessage(comparison.topic, comparison.labels, (2, 4), np.ones(8))) and len(quiet) == 4
    tf = TransferFunction(np.array([1.0]), np.array([1.0, 0.0]), 0.001)
    figure = response_figure(frf, comparison, tf, 2000.0)
    assert {"95 % band", "measured", "model", "not trusted", "residual"} <= {trace.name for trace in figure.data}
    assert any("fails" in (note.text or "") for note in figure.layout.annotations)


def test_long_responses_are_thinned_without_losing_a_peak() -> None:
    """Two million lines become about a thousand; the highest one is kept."""
    frequency = np.linspace(0.001, 1000, 2_000_000)
    size = np.ones(frequency.size)
    size[1_234_567] = 9.0
    kept = thinned(frequency, size, 1200)
    assert kept.size <= 1300 and 1_234_567 in kept and (np.diff(kept) > 0).all()
    assert columns(ArrayMessage("x", ("line", "a,b"), (2, 3), np.zeros(6))) == {}


def test_settings_typed_into_the_page_are_checked_before_they_are_sent() -> None:
    """Only changed values are sent, with their types; a value out of range is refused in a sentence."""
    now = {item.name: item.value for item in knobs(AxisExcitation())}
    assert changes(now, dict(now)) == {}
    assert changes(now, {"rms": 2, "steps": 30.0, "kind": "sweep"}) == {"rms": 2.0, "steps": 30, "kind": "sweep"}
    for typed, words in (
        ({"rms": -1.0}, "0"),
        ({"rms": None}, "empty"),
        ({"rms": "x"}, "number"),
        ({"steps": 1.5}, "whole"),
        ({"kind": "noyse"}, "noise"),
        ({"low": 400.0}, "below high"),
    ):
        with pytest.raises(BadInput, match=words):
            changes(now, typed)
    assert limits(next(item for item in knobs(AxisExcitation()) if item.name == "rms")) == "0 to 100 V"


def story(**more: Any) -> dict[str, Any]:
    """A small story document."""
    parameters = {"gain": {"value": 0.097, "unit": "m/s/V", "ci95": [0.096, 0.098]}}
    rung = {"label": "with coulomb_friction", "held_out_error": 3.3e-4, "noise_floor": 3.3e-4, "effects": ["coulomb_friction"], "explained": True}
    made: dict[str, Any] = {
        "axis": "x", "verdict": "missing_effect", "confidence": 0.98, "sentence": "Missing: coulomb_friction.", "effects": ["coulomb_friction"],
        "error": {"unit": "m/s"},
        "ladder": [rung], "runner_up": {"effect": "saturation", "sentence": "it leaves more."}, "next_experiment": "Go slowly.",
        "look_alikes": [{"effect": "dead_zone", "told_apart": False, "sentence": "both do", "experiment": ""}],
        "model": {"effects": ["coulomb_friction"], "parameters": parameters, "held_out_error": 3.3e-4, "noise_floor": 3.3e-4},
    }  # fmt: skip
    return {**made, **more}


def test_the_diagnosis_says_what_how_sure_and_what_came_second() -> None:
    """In one line each, for people and screen readers."""
    assert verdict_words(story()) == "Missing: coulomb friction. Confidence in coulomb friction: 98 %."
    lines = look_alike_lines(story())
    assert lines[0] == "Runner-up: saturation: it leaves more." and "not distinguished" in lines[1] and lines[2] == "Next experiment: Go slowly."
    assert model_effects(story(ladder=[{"held_out_error": 4e-3}])) == [] and model_effects(story()) == ["coulomb_friction"]


def test_the_shown_model_is_the_story_s_once_there_is_one() -> None:
    """Before a story the linear fit, then the newest model by default; the rigid one and the linear fit are one click away."""
    rigid, grown = {"label": "rigid, with delay", "effects": []}, {"label": "with coulomb_friction", "effects": ["coulomb_friction"]}
    assert views(None, True) == {"linear": "linear fit"} and views(None, False) == {}
    assert list(views({"steps": [rigid]}, True)) == ["now", "linear"]
    assert views({"steps": [rigid, grown]}, True) == {"now": "with coulomb friction", "rigid": "rigid, with delay", "linear": "linear fit"}
    assert list(views({"steps": [rigid, grown, rigid]}, False)) == ["now"]
    assert view_of("linear").linear and view_of("rigid").step == 0 and view_of("now").step is None


def test_a_tile_says_the_worst_and_not_the_usual() -> None:
    """A coherence of 0.45 in a few lines is named with its frequency, even if the others are good; a single line is not."""
    frequency = np.linspace(1.0, 100.0, 100)
    coherence = np.full(100, 0.999)
    coherence[10:16] = 0.45
    told = coherence_fact(frequency, coherence)
    assert told.text == "0.45 at 11 Hz" and told.good is False
    alone = np.full(100, 0.999)
    alone[10] = 0.1
    assert coherence_fact(frequency, alone).text.startswith("1 at")
    unsure = facts(VALUES, fails=True)
    assert not next(fact for fact in unsure if fact.label == "delay").sure and "too narrow" in unsure[0].meaning


def test_a_downloaded_model_is_the_yaml_of_refine() -> None:
    """Axis names are quoted; parameters keep unit and interval; the file's name is plain."""
    text = model_text("rec", {"y": story(), "x": {"model": None}})
    assert '"y":' in text
    loaded = yaml.safe_load(text)
    assert loaded["format"] == "xy_sysid axis model 1" and loaded["axes"]["y"]["parameters"]["gain"]["ci95"] == [0.096, 0.098]
    assert plain_name("../a b/c.npz") == ".._a_b_c.npz" and plain_name("") == "axis"


def test_what_was_said_a_moment_ago_is_one_message(tmp_path: Path) -> None:
    """STOP by the button and by the key within a second: one message; a different text is a second message."""
    session = Session(Shelf(tmp_path), live=False)
    for words in ("stopped: the voltage is zero", "stopped: the voltage is zero", "recorded a bag"):
        session.say(words, True)
    assert [message.words for message in session.messages] == ["stopped: the voltage is zero", "recorded a bag"]


def test_a_message_stays_from_when_the_page_could_first_show_it() -> None:
    """A page that was busy for a minute, or reloaded, misses no message; older ones are not shown; at most the newest few at a time."""
    stopped, refused = Message(1, "12:00:00", 100.0, "stopped", True), Message(2, "12:00:00", 100.0, "refused", False)
    notices = Notices(90.0)
    assert notices.shown([], 99.0) == []
    assert notices.shown([stopped, refused], 160.0) == [stopped, refused]
    assert notices.shown([stopped, refused], 160.0 + GOOD_STAYS + 0.1) == [refused]
    assert notices.shown([stopped, refused], 160.0 + BAD_STAYS + 0.1) == []
    assert Notices(100.0 + BEFORE).shown([stopped], 101.0 + BEFORE) == [stopped]
    assert Notices(100.1 + BEFORE).shown([stopped], 101.0 + BEFORE) == []
    many = [Message(number, "12:00:00", 100.0, "stopped", True) for number in range(SHOWN + 3)]
    assert Notices(100.0).shown(many, 101.0) == many[3:]


def test_a_picture_is_never_kept_under_a_stamp_that_is_newer_than_its_story() -> None:
    """Readers read the stamp before the document: after a change in between, the next update draws again."""
    heard = TopicsState()
    heard.story("x", json.dumps({"axis": "x", "n": 1}))
    seen = heard.version["story x"], heard.stories["x"]["n"]
    heard.story("x", json.dumps({"axis": "x", "n": 2}))
    assert seen == (1, 1) and heard.version["story x"] == 2  # the document is replaced before its version grows
    source = (ROOT / "xy_sysid" / "page" / "story_card.py").read_text(encoding="utf-8")
    refresh = source[source.index("async def refresh") :]
    assert refresh.index("self._source.stamp(axis)") < refresh.index("self._source.document(axis)") and refresh.count("source.stamp(") == 1


def test_a_stop_of_somebody_else_is_named_and_the_pages_own_is_not() -> None:
    """Activate releases the page's own STOP; other holders are named, also another page and one that has ended."""
    heard = TopicsState(own_stop="page_stop_here_1")
    assert heard.stopped_by_others() == ""
    other, gone = "page_stop_there_1", "page_stop_here_0 (gone)"
    for held, others in (("", ""), ("page_stop_here_1", ""), ("guard, page_stop_here_1", "guard"), (other, other), (gone, gone)):
        heard.status(StatusMessage("excitation", 1, "", (("stop held by", held),)), 0.0)
        assert heard.stopped_by_others() == others


def test_the_button_to_activate_says_what_it_does_with_stop() -> None:
    """The page releases its own STOP; that of another node it can only override, and both texts say so."""
    assert on_activate(False, "") == ("Activate", "")
    button, told = on_activate(True, "")
    assert button == "Release STOP and activate" and "releases it first" in told
    button, told = on_activate(True, "guard")
    assert button == "Override STOP" and "from guard" in told and "override it here" in told
