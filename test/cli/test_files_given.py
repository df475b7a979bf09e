"""Named paths that are not regular files, or are far too long: one line at once, for every option."""

from __future__ import annotations

import os
import re
import shutil
import socket
import threading
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from helpers import ROOT
from helpers.busy import allowed
from helpers.cli_tools import RIGID, Said, cli, npz

from xy_sysid.bags.opening import too_much
from xy_sysid.errors import BadRecording, XySysidError
from xy_sysid.files.experiment import read_experiment
from xy_sysid.files.state import load_state
from xy_sysid.fleets.causes import causes
from xy_sysid.settings import ExcitationSettings

QUICK = 2.0  # s, limit for an error
DOUBLING = [("", "n0"), *((f"n{k}", f"n{k + 1}") for k in range(30))]  # each list contains the previous one twice


def doubling() -> str:
    """YAML of a few lines that expands to a thousand million values."""
    return "".join(f"{b}: &{b} [*{a}, *{a}]\n" if a else f"{b}: &{b} [1, 2]\n" for a, b in DOUBLING)


@contextmanager
def little_memory() -> Iterator[None]:
    """Python and NumPy use at most a tenth of the gigabyte that such files used before."""
    tracemalloc.start()
    try:
        yield
        assert tracemalloc.get_traced_memory()[1] < 100e6
    finally:
        tracemalloc.stop()


ENDLESS = 10.0  # s after which a command counts as hanging


def at_once(act: Callable[[], Said], seconds: float = ENDLESS) -> Said:
    """The output of a command; fails if it hangs, in which case its thread remains."""
    said: list[Said] = []
    thread = threading.Thread(target=lambda: said.append(act()), daemon=True)
    thread.start()
    thread.join(allowed(seconds))
    assert said, "it hangs"
    return said[0]


def refusal(*words: object, seconds: float = ENDLESS) -> str:
    """The one error line of a command within its time."""
    said = at_once(lambda: cli(*words), seconds)
    lines = [line for line in said.err.splitlines() if not line.startswith("note: ")]
    assert said.code == 2 and said.out == "" and len(lines) == 1, said
    return lines[0]


def told_at_once(act: Callable[[], object], seconds: float = ENDLESS) -> str:
    """The one error line of a function that raises it within its time."""

    def said() -> Said:
        try:
            return Said(0, str(act()), "")
        except XySysidError as problem:
            return Said(2, "", str(problem))

    found = at_once(said, seconds)
    assert found.code == 2 and "\n" not in found.err, found
    return found.err


def fifo(path: Path) -> None:
    os.mkfifo(path)


def device(path: Path) -> None:
    path.symlink_to("/dev/zero")


def folder(path: Path) -> None:
    path.mkdir()


@contextmanager
def within(place: Path) -> Iterator[None]:
    """Within a folder, because the name of a socket has at most 107 characters."""
    before = Path.cwd()
    os.chdir(place)
    try:
        yield
    finally:
        os.chdir(before)


def bound(path: Path) -> None:
    with within(path.parent), socket.socket(socket.AF_UNIX) as made:
        made.bind(path.name)


ODD = {"a pipe": fifo, "a device": device, "a socket": bound, "a folder": folder}
READS = {
    "a table": ("frf", "FILE.csv"),
    "an npz": ("fit", "FILE.npz"),
    "a mat": ("diagnose", "FILE.mat"),
    "a database": ("frf", "FILE.db3"),
    "an mcap": ("frf", "FILE.mcap"),
    "columns": ("columns", "FILE.csv"),
    "a model": ("compare", "REC", "FILE.yaml"),
    "a model before": ("compare", "REC", "--before", "FILE.yaml", "--after", "FILE.yaml"),
    "a model to check": ("validate", "REC", "FILE.yaml"),
    "parameters": ("fit", "REC", "--params", "FILE.yaml"),
    "an effect": ("refine", "REC", "--auto", "--effect-file", "FILE.py"),
    "a run file": ("run", "--params", "FILE.yaml"),
    "a machine": ("simulate", "new", "--machine", "FILE.yaml"),
    "limits": ("next", "--for", "nothing", "--params", "FILE.yaml"),
    "a walk": ("next", "--replay", "FOLDER/walk.json"),
    "a file of names": ("fleet", "REC", "-o", "table", "--names", "FILE.yaml"),
    "a table of a fleet": ("trend", "FOLDER/one.parquet"),
    "a model to use": ("use", "FILE.yaml"),
    "a recording of a day": ("trend", "FILE.csv", "--every", "10min"),
}


@pytest.fixture(scope="module")
def rec(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return npz(tmp_path_factory.mktemp("rec") / "rec.npz", rows=4000)


@pytest.mark.parametrize("odd", ODD)
@pytest.mark.parametrize("what", READS)
def test_what_is_no_regular_file_is_refused_wherever_one_is_read(what: str, odd: str, rec: Path, tmp_path: Path) -> None:
    """Reading it may never end: no command waits for it."""
    if (what, odd) in (("a database", "a folder"), ("an mcap", "a folder")):
        pytest.skip("a folder may be a bag")
    words = [
        str(rec) if word == "REC" else word.replace("FILE", str(tmp_path / "odd")).replace("FOLDER", str(tmp_path / "odd")) for word in READS[what]
    ]
    file = next(Path(word) for word in words if word.startswith(str(tmp_path / "odd")))
    if file.parent != tmp_path:  # for a folder, the command gets only the folder
        file.parent.mkdir()
        words[words.index(str(file))] = str(file.parent)
    ODD[odd](file)
    assert "odd" in refusal(*words)


@pytest.mark.parametrize("odd", ODD)
def test_what_is_no_regular_file_is_a_row_with_its_problem_in_a_fleet(odd: str, tmp_path: Path) -> None:
    """The other recordings of the fleet are analysed nevertheless."""
    ODD[odd](tmp_path / "odd.csv")
    said = at_once(lambda: cli("fleet", "--one", tmp_path / "odd.csv"))
    (row,) = said.json["rows"]
    assert said.code == 0 and row["stage"] == "reading" and row["problem"]


@pytest.mark.parametrize("odd", ODD)
def test_an_experiment_that_is_no_regular_file_is_refused(odd: str, tmp_path: Path) -> None:
    """The excitation reads it in configure, and must not hang."""
    ODD[odd](tmp_path / "odd.yaml")

    line = told_at_once(lambda: read_experiment(ExcitationSettings(), tmp_path / "odd.yaml"))
    assert line.startswith("experiment is ") and "odd.yaml: not a file but a pipe" in line


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    bag = tmp_path_factory.mktemp("bag") / "rec"
    assert cli("simulate", bag, "--duration", "2").code == 0
    return bag


@pytest.mark.parametrize("odd", ODD)
@pytest.mark.parametrize("name", ["named.db3", "rec.db3-journal", "rec.db3-wal"])
def test_a_bag_with_a_file_that_is_none_is_refused(name: str, odd: str, good: Path, tmp_path: Path) -> None:
    """As named in its metadata, or next to the database, where sqlite would open it."""
    bag = tmp_path / "rec"
    shutil.copytree(good, bag)
    ODD[odd](bag / name)
    if name == "named.db3":
        metadata = bag / "metadata.yaml"
        metadata.write_text(metadata.read_text().replace("rec.db3", name))
    line = refusal("frf", bag)
    assert name in line and "not a file but a pipe, a device, a socket or a folder" in line


@pytest.mark.parametrize(
    "words",
    [
        *[(name, "BAG") for name in ("columns", "fit", "coupling", "diagnose", "study", "steps", "servo", "next", "replay")],
        ("refine", "BAG", "--auto"),
        ("compare", "BAG", "MODEL"),
        ("validate", "BAG", "MODEL"),
        ("report", "BAG", "-o", "new.html"),
        ("figures", "BAG", "-o", "new"),
        ("trend", "BAG", "--every", "10min"),
    ],
    ids=lambda words: words[0],
)
def test_every_command_refuses_a_bag_that_names_a_pipe(words: tuple[str, ...], good: Path, rec: Path, model: str, tmp_path: Path) -> None:
    """None of them waits for a pipe without a writer."""
    bag, known = tmp_path / "rec", tmp_path / "model.yaml"
    shutil.copytree(good, bag)
    os.mkfifo(bag / "named.db3")
    metadata = bag / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace("rec.db3", "named.db3"))
    known.write_text(model)
    places = {"BAG": bag, "MODEL": known, "new": tmp_path / "new", "new.html": tmp_path / "new.html"}
    line = refusal(*(places.get(word, word) for word in words))
    assert "named.db3" in line and "not a file but a pipe" in line


def test_a_pipe_that_nobody_names_does_not_matter(good: Path, tmp_path: Path) -> None:
    """The files that the metadata names are read, and no other is opened."""
    bag = tmp_path / "rec"
    shutil.copytree(good, bag)
    os.mkfifo(bag / "other.db3")
    assert at_once(lambda: cli("columns", bag)).code == 0


def test_a_state_that_is_a_pipe_is_refused(tmp_path: Path) -> None:
    """The identifier renames it and starts without it."""
    os.mkfifo(tmp_path / "state")
    os.close(os.open(tmp_path / "state", os.O_RDWR | os.O_NONBLOCK))
    with pytest.raises(BadRecording, match="not a file but a pipe"):
        load_state(tmp_path / "state")


@pytest.fixture(scope="module")
def model(rec: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    """A model without its checksum, as after a change by hand."""
    path = tmp_path_factory.mktemp("model") / "model.yaml"
    assert cli("fit", rec, *RIGID, "--set", "length=1024", "--model", path).code == 0
    return path.read_text().partition("\n")[2]


@pytest.mark.parametrize(
    ("what", "change"),
    [
        ("40 MB", lambda text: text + "  # nothing\n" * 3_400_000),
        ("200,000 coefficients", lambda text: text.replace("numerator:", f"numerator: [{'1.0, ' * 200_000}1.0]\n      other:", 1)),
        ("90 coefficients", lambda text: text.replace("numerator:", f"numerator: [{'1.0, ' * 89}1.0]\n      other:", 1)),
        (
            "a list that doubles itself 30 times",
            lambda text: text + "".join(f"{b}: &{b} [*{a}, *{a}]\n" if a else f"{b}: &{b} [1, 2]\n" for a, b in DOUBLING),
        ),
    ],
)
def test_a_model_far_too_large_is_one_line_at_once(what: str, change: Callable[[str], str], rec: Path, model: str, tmp_path: Path) -> None:
    """A wrong file gives an error without a wait."""
    path = tmp_path / "model.yaml"
    path.write_text(change(model))
    with little_memory():
        line = refusal("compare", rec, path, seconds=QUICK)
    assert str(path) in line, what


@pytest.mark.parametrize(
    "words", [("fit", "REC", "--params", "FILE"), ("run", "--params", "FILE"), ("simulate", "new", "--machine", "FILE")], ids=lambda words: words[0]
)
def test_settings_far_too_long_are_one_line_at_once(words: tuple[str, ...], rec: Path, tmp_path: Path) -> None:
    """Parameters, run files and machines of 40 MB."""
    path = tmp_path / "p.yaml"
    path.write_text("a: 1\n" + "# nothing\n" * 4_000_000)
    line = refusal(*(str(rec) if word == "REC" else str(path) if word == "FILE" else word for word in words), seconds=QUICK)
    assert str(path) in line and " at most" in line


@pytest.mark.parametrize(("head", "text"), [("", "a" * 64), ("", "1.0 " * 16), ("time,u,y\n0,1,2\n1,2,3\n", "a;b;" * 16)])
def test_a_line_of_200_mb_is_refused_at_once(text: str, head: str, tmp_path: Path) -> None:
    """First or last line: an error, and no result."""
    path = tmp_path / "long.csv"
    with path.open("w") as file:
        file.write(head)
        for _ in range(50):
            file.write(text * 65536)
    with little_memory():
        line = refusal("columns", path, seconds=QUICK)
    assert "a line of more than 10 million characters" in line


@pytest.mark.parametrize("kind", ["40 MB", "doubling"])
@pytest.mark.parametrize(
    "words",
    [("simulate", "new", "--machine", "FILE"), ("fleet", "REC", "-o", "table", "--names", "FILE"), ("experiment", "FILE")],
    ids=lambda words: words[0],
)
def test_yaml_that_is_or_becomes_far_too_long_is_one_line_at_once(words: tuple[str, ...], kind: str, rec: Path, tmp_path: Path) -> None:
    """For any purpose: too long as text, or by repeated aliases."""
    path = tmp_path / "p.yaml"
    path.write_text("a: 1\n" + "# nothing\n" * 4_000_000 if kind == "40 MB" else f"{doubling()}pattern: *n30\ndescription: *n30\n")
    if words[0] == "experiment":
        assert "p.yaml" in told_at_once(lambda: read_experiment(ExcitationSettings(), path), QUICK)
        return
    line = refusal(*(str(rec) if word == "REC" else str(path) if word == "FILE" else word for word in words), seconds=QUICK)
    assert str(path) in line


def test_causes_that_repeat_themselves_are_one_line_at_once(tmp_path: Path) -> None:
    """The file that a user adds to the table of causes."""
    path = tmp_path / "causes.yaml"
    path.write_text(f"{doubling()}causes: *n30\n")

    assert "more than 20000 values" in told_at_once(lambda: causes(path), QUICK)


OPENS = re.compile(r"\.read_text\(|\.read_bytes\(|\.open\(\"r|\bopen\(\w+, \"r|os\.open\(|\.read_table\(|loadmat\(|np\.load\(")
LOOKS = re.compile(r"bags\.opening import|^def regular_file", re.MULTILINE)
ALONE = {
    "bags/atomic.py": "folders of our own",
    "bags/compression.py": "bags/reading.py has looked",
    "bags/mcap_file.py": "bags/reading.py has looked",
    "bags/sums.py": "is_file",
    "cli/__init__.py": "/dev/null",
    "cli/record.py": "a bag of our own, just written",
    "files/effects.py": "is_file",
    "files/fmu.py": "what the compiler has just made",
    "fleets/journal.py": "own_files has looked, and it is opened without following links",
    "imports/arrays.py": "imports/registry.py has looked, as for all of imports",
    "imports/csv.py": "",
    "imports/json_log.py": "",
    "imports/libraries/mat.py": "",
    "imports/libraries/parquet.py": "",
    "page/downloads.py": "what the report has just written",
    "page/server.py": "a file of the package",
    "report/sheet.py": "a file of the package",
}


def test_who_opens_a_file_that_somebody_names_has_looked_at_it() -> None:
    """A new reader must use ``bags.opening``, or be in this table with a reason."""
    there = {
        path.relative_to(ROOT / "xy_sysid").as_posix(): text
        for path in (ROOT / "xy_sysid").rglob("*.py")
        if OPENS.search(text := path.read_text(encoding="utf-8"))
    }
    bold = {name for name, text in there.items() if not LOOKS.search(text)}
    assert bold == set(ALONE)


def test_yaml_is_counted_as_it_reads_and_not_as_it_is_written() -> None:
    """Repeated parts count each time; a part that contains itself is refused; a few repeated parts are accepted."""
    assert too_much("a: &a [1, 2]\nb: [*a, *a]\n") == ""
    assert "values" in too_much("".join(f"{b}: &{b} [*{a}, *{a}]\n" if a else f"{b}: &{b} [1]\n" for a, b in DOUBLING))
    assert "values" in too_much("a: &a [*a]\n")
    assert "levels" in too_much("[" * 50 + "]" * 50)
