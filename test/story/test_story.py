"""One axis from the rigid base to the floor, step by step, without ROS: content of a step, and of the document."""

from __future__ import annotations

import json
import pickle
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from helpers.simulated import recorded
from helpers.stories import RATE, data, told, with_effects

from xy_sysid.axis.linear_part import linear_part, nonlinear
from xy_sysid.axis.model import STANDARD, AxisModel
from xy_sysid.diagnosis import rungs
from xy_sysid.errors import BadInput
from xy_sysid.greybox.free_run import GreyboxFit, fit_base
from xy_sysid.samples.recording import Run
from xy_sysid.story import story as story_of_axis
from xy_sysid.story.document import document
from xy_sysid.story.story import HELPS_NO_MORE, added, auto, begin, diagnosed, next_best, removed, tell


def test_the_error_falls_from_the_base_to_the_floor() -> None:
    """Base, diagnosis, the named effect added: the newest error is at the floor, and says so."""
    story = told()
    assert [rung.added for rung in story.rungs] == [None, "coulomb_friction"]
    first, last = story.rungs[0], story.rungs[-1]
    assert last.held_out_error < 1.05 * last.noise_floor < 0.2 * first.held_out_error
    assert last.explained and not first.explained
    assert story.diagnosis is not None and story.diagnosis.effect == "coulomb_friction"


def test_a_whole_story_fits_its_base_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The story shows the rigid model with which the diagnosis begins."""
    fitted: list[GreyboxFit] = []

    def counted(*given: Any) -> GreyboxFit:
        fitted.append(fit_base(*given))
        return fitted[-1]

    for place in (rungs, story_of_axis):
        monkeypatch.setattr(place, "fit_base", counted)
    told = tell(Run("x", RATE, *recorded("", seconds=6.0).axis("x")))
    assert told.rungs and len(fitted) == 1
    assert told.diagnosis is not None and told.diagnosis.rungs[0].values == told.rungs[0].values
    assert told.diagnosis.rungs[0].gain == told.rungs[0].gain


def test_a_story_can_be_sent_to_another_process() -> None:
    """It is plain and small, without compiled code."""
    sent = pickle.dumps(told())
    assert document(pickle.loads(sent)) == document(told())
    assert len(sent) < 150_000


def test_the_document_is_small_json_with_the_contracts_keys() -> None:
    """The content of diagnose --json, the ladder, the model and figure data; no NaN; under 200 kB."""
    text = json.dumps(document(told()), allow_nan=False)
    assert len(text) < 200_000
    made = json.loads(text)
    keys = (
        "axis seconds verdict effect effects confidence tolerance sentence error where candidates next_experiment runner_up look_alikes ladder model "
        "explained noise discrepancy stopped refused"
    )
    assert set(keys.split()) <= set(made)
    assert made["error"]["held_out"] < 0.2 * made["error"]["now"]
    assert made["runner_up"] is None or (made["runner_up"]["effect"] != "coulomb_friction" and "mm/s" in made["runner_up"]["sentence"])
    assert made["explained"] > 0.97 and made["stopped"] is None
    apart = {item["effect"]: item["told_apart"] for item in made["look_alikes"]}
    assert apart["dead_zone"] and not apart["stribeck_friction"]
    assert [row["added"] for row in made["ladder"]] == [None, "coulomb_friction"]
    assert (
        made["model"]["parameters"]["coulomb_friction.coulomb"]["ci95"][0] < 0.2 < made["model"]["parameters"]["coulomb_friction.coulomb"]["ci95"][1]
    )


def test_the_pictures_show_where_the_base_fails_and_that_it_no_longer_does() -> None:
    """Measurement and model agree within the band with the effect; friction's mean error has the sign of the motion."""
    made = document(told())
    shown, (first, last) = made["measured"], [step["pictures"] for step in made["steps"]]
    response = shown["frequency_response"]
    trusted = np.array(response["trusted"]) & (np.array(response["frequency"]) > 2.0)
    assert trusted.sum() > 50
    distance = [np.abs(np.array(one["frequency_response"]["magnitude_db"]) - response["magnitude_db"])[trusted] for one in (first, last)]
    assert np.median(distance[1]) < 0.02 < np.median(distance[0])
    assert first["failing"] and not last["failing"]
    speed = first["residual"]["speed"]
    assert speed["speed"] == sorted(speed["speed"])
    slow, fast = np.array(speed["mean_error"])[[len(speed["speed"]) // 2 - 3, len(speed["speed"]) // 2 + 3]]
    assert slow > 0.0 > fast
    assert max(last["residual"]["frequency"]["error_over_floor"]) < 1.5 < max(first["residual"]["frequency"]["error_over_floor"])
    for one in (first, last):
        for group in ("time", "zoom"):
            assert len(one[group]["velocity" if group == "zoom" else "position"]) == len(shown[group]["velocity" if group == "zoom" else "position"])
    error = np.array(shown["zoom"]["velocity"]) - np.array(last["zoom"]["velocity"])
    assert np.std(error) < 0.5 * np.std(np.array(shown["zoom"]["velocity"]) - np.array(first["zoom"]["velocity"]))
    assert last["linear"]["delay"] == pytest.approx(1.29e-3, rel=0.01)
    assert sorted(root["real"] for root in last["linear"]["poles"])[0] == pytest.approx(-246.0, rel=0.02)


def test_effects_come_and_go_by_name() -> None:
    """One step each; unwanted effects are removed first; next_best and auto find effects by themselves."""
    run = Run("x", RATE, *data())
    story = begin(run)
    wrong = with_effects(story, run, "cogging")
    assert [rung.label for rung in wrong.rungs] == ["rigid, with delay", "with cogging"]
    right = with_effects(wrong, run, "coulomb_friction")
    assert [rung.label for rung in right.rungs[2:]] == ["without cogging", "with coulomb_friction"]
    assert right.effects == ("coulomb_friction",) and right.now is not None and right.now.explained
    assert next_best(story, run).effects == ("coulomb_friction",)
    done = auto(story, run)
    assert done.effects == ("coulomb_friction",)
    assert "Nothing is left to explain" in next_best(done, run).note
    assert removed(done, run, "coulomb_friction").effects == ()


def test_what_the_diagnosis_has_searched_is_not_searched_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """At the last rung of the diagnosis no effect helps, and the answer needs no fit."""
    run = Run("x", RATE, *data())
    story = diagnosed(begin(run), run)
    assert story.diagnosis is not None
    story = replace(story, diagnosis=replace(story.diagnosis, rungs=story.diagnosis.rungs[:1]))
    monkeypatch.setattr("xy_sysid.story.story.refine", None)
    assert next_best(story, run).note == HELPS_NO_MORE


def test_a_relative_replaces_its_own() -> None:
    """A second law of the same dry friction replaces the first."""
    story = added(told(), Run("x", RATE, *data()), "stribeck_friction")
    assert story.effects == ("stribeck_friction",)
    assert story.rungs[-1].label == "stribeck_friction instead of coulomb_friction"


@pytest.mark.parametrize(
    ("name", "words"), [("coulomb", "coulomb_friction"), ("time_delay", "part of every model"), ("coulomb_friction", "not in the model yet")]
)
def test_a_wrong_name_is_refused_in_one_line(name: str, words: str) -> None:
    """Unknown, in every model, in this model already."""
    with pytest.raises(BadInput, match=words):
        added(told(), Run("x", RATE, *data()), name)


def test_backlash_is_told_one_sample_ahead() -> None:
    """For an effect that free simulation cannot judge, the label says so, and the figures are those of the prediction."""
    story = tell(recorded("x:backlash", seconds=20.0).run("x"))
    last, (first, *_, drawn) = story.rungs[-1], story.pictures
    assert (last.added, last.explained) == ("backlash", True)
    assert first.failing and not drawn.failing  # an explained model is not drawn as failing
    assert "one sample ahead" in last.label
    assert len(drawn.failing) < len(first.failing)
    error = np.std(drawn.zoom_velocity - (story.measured.zoom_velocity if story.measured else 0.0))
    assert error < 2.0 * last.held_out_error


def test_without_enough_data_the_story_says_what_lacks() -> None:
    """A document without steps."""
    story = tell(Run("x", RATE, np.ones(4000), np.zeros(4000)))
    made = document(story)
    assert made["verdict"] == "not_enough_data" and "the input does not move" in made["sentence"]
    assert made["steps"] == [] and made["measured"] is None and made["model"] is None
    run = Run("x", RATE, *data())
    assert document(diagnosed(begin(run), run))["verdict"] == "missing_effect"


def test_the_linear_part_has_resonances_and_lags_and_leaves_friction_out() -> None:
    """Roots as given by the parameters, gain at low frequency unchanged."""
    model = AxisModel(0.1, 1e-3, 200.0).with_effect("screw_compliance", (0.5, 100.0, 0.02, 0.03)).with_effect("amplifier_lag", (1e-3,))
    tf = linear_part(model.with_effect("coulomb_friction", (0.2,)).with_effect("backlash"))
    assert sorted(mode.frequency for mode in tf.zero_modes())[0] == pytest.approx(100.0, rel=1e-3)
    assert tf.zero_modes()[0].damping == pytest.approx(0.02, rel=1e-2)
    assert sorted({round(mode.frequency, 1) for mode in tf.pole_modes()}) == [0.0, 31.8, 150.0, 159.2]
    assert abs(tf.response(np.array([0.01]))[0]) == pytest.approx(0.1 / (2 * np.pi * 0.01), rel=1e-3)
    assert nonlinear(model.with_effect("coulomb_friction")) == ("coulomb_friction",)
    assert set(nonlinear(AxisModel(0.1, 0.0, 200.0, tuple((e.name, e.typical) for e in STANDARD.acting)))) == {
        e.name for e in STANDARD.acting if e.name not in ("screw_compliance", "base_resonance", "load_side_resonance", "amplifier_lag")
    }


def test_every_noise_floor_of_a_story_is_of_its_own_tolerance() -> None:
    """With a tolerance of 2 % of the motion, the diagnosis, its ladder, the steps and the figures have one floor, well above encoder noise."""
    run = Run("x", RATE, *data())
    story = next_best(diagnosed(begin(run, tolerance=0.02), run), run)
    assert story.diagnosis is not None
    rungs = [*story.diagnosis.rungs, *story.rungs]
    (floor,) = {rung.noise_floor for rung in rungs}
    assert floor > 2.0 * story.diagnosis.noise
    assert document(story)["error"]["noise_floor"] == floor
