"""The messages of the diagnoser for an axis, as plain numbers and words: error ladder and diagnosis."""

from __future__ import annotations

import numpy as np

from xy_sysid.diagnosis import words
from xy_sysid.live import status_values
from xy_sysid.live.plain_messages import OK, STALE, WARN, ArrayMessage, StatusMessage, topic_of
from xy_sysid.story.acts import sentence
from xy_sysid.story.story import Story

LADDER_COLUMNS = ("step", "train_error", "held_out_error", "noise_floor")


def ladder_message(story: Story) -> ArrayMessage:
    """``error_ladder/<axis>``: one row per step, the output's unit over s."""
    rows = np.array([(k, rung.training_error, rung.held_out_error, rung.noise_floor) for k, rung in enumerate(story.rungs)], dtype=np.float64)
    size = (len(story.rungs), len(LADDER_COLUMNS))
    return ArrayMessage(topic_of("error_ladder", story.axis), ("step", ",".join(LADDER_COLUMNS)), size, rows.ravel())


def diagnosis_status(story: Story) -> StatusMessage:
    """``diagnosis``: verdict, errors and ranking of one axis; OK if the model explains it or nothing is missing, else WARN."""
    values: dict[str, str] = {status_values.SECONDS: f"{story.seconds:.6g}", "tolerance (1)": f"{story.tolerance:.3g}"}
    found, now = story.diagnosis, story.now
    if found is not None:
        values |= {
            "verdict": found.verdict,
            "effect": found.effect or "",
            "effects": ", ".join(found.effects),
            "confidence (1)": f"{found.confidence:.3f}",
        }
    if now is not None:
        speed = story.units.judged
        values |= {
            f"error of the rigid model ({speed})": f"{story.rungs[0].held_out_error:.6g}",
            f"error now ({speed})": f"{now.held_out_error:.6g}",
            f"training error now ({speed})": f"{now.training_error:.6g}",
            f"noise floor ({speed})": f"{now.noise_floor:.6g}",
            "effects in the model": ", ".join(now.effects),
            "explained": str(now.explained).lower(),
        }
        for item in now.parameters:
            values |= status_values.written(item)
    if found is not None:
        values |= {f"candidate {k}": f"{one.name}: {words.evidence(found, one)}" for k, one in enumerate(found.candidates, start=1)}
        values |= {"runner-up": lost} if (lost := words.runner_up(found)) else {}
        values |= {f"look-alike {one.effect}": one.sentence for one in found.look_alikes}
        values |= {f"fails {k}": place.sentence for k, place in enumerate(found.where.places[:5] if found.where else (), start=1)}
        values["next experiment"] = found.next_experiment
    well = (now is not None and now.explained) or (found is not None and found.verdict == "nothing_missing")
    level = OK if well else STALE if found is not None and found.verdict == "not_enough_data" else WARN
    return StatusMessage(f"axis {story.axis}", level, sentence(story), tuple(values.items()))
