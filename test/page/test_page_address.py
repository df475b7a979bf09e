"""The view of the page in its address: it is restored from there, and invalid parts are ignored."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from xy_sysid.errors import BadInput
from xy_sysid.page.address import PageView, SourceView, query_of, view_of_query, without
from xy_sysid.page.orders import Reading, read_so

WORDS = st.text(st.characters(codec="utf-8", exclude_characters=",:\x00"), min_size=1, max_size=12)
NAMES = st.lists(WORDS, max_size=3).map(tuple)
OPTIONS = st.lists(st.tuples(st.sampled_from(["--map", "--unit", "--scale", "--rate"]), WORDS), max_size=2).map(lambda given: tuple(sum(given, ())))
SOURCES = st.builds(
    SourceView,
    name=WORDS,
    words=OPTIONS,
    axis=st.one_of(st.just(""), WORDS),
    model=st.sampled_from(["", "rigid", "linear"]),
    pictures=NAMES,
    effects=st.dictionaries(WORDS, st.lists(WORDS, min_size=1, max_size=3).map(tuple), max_size=2),
)

UNITS = st.sampled_from([(), ("um",), ("rpm",), ("in", "deg")])


@given(st.builds(PageView, sources=st.lists(SOURCES, max_size=3).map(tuple), theme=st.sampled_from(["", "light", "dark"]), units=UNITS))
def test_a_view_that_is_written_into_an_address_is_read_again(view: PageView) -> None:
    """Names in any script, several recordings, options of a table: the same view."""
    assert view_of_query(query_of(view)) == view


@given(st.text(max_size=300))
def test_any_query_is_read_and_a_read_one_is_written_the_same(query: str) -> None:
    """Any address is read without an error."""
    view = view_of_query(query)
    assert view_of_query(query_of(view)) == view


def test_an_address_reads_as_people_would_write_it() -> None:
    """No percent codes in it; the machine is named live."""
    dry = SourceView("days/dry.npz", axis="y", model="rigid", effects={"x": ("coulomb_friction", "cogging")})
    view = PageView((SourceView("", model="linear"), dry), "dark")
    written = "live=1&model=linear&rec=days/dry.npz&axis=y&model=rigid&effects=x:coulomb_friction,cogging&theme=dark"
    assert query_of(view) == written and view_of_query(written) == view
    assert query_of(PageView((SourceView(),))) == "" and view_of_query("axis=y&nonsense=1&%FF=&effects=x") == PageView()


def test_units_that_are_usual_or_unknown_are_not_kept() -> None:
    """One of lengths and one of angles, in any order; the defaults are not in the address."""
    assert view_of_query("units=deg,parsec,mm,um").units == ("um", "deg")
    assert query_of(PageView(units=("um", "deg"))) == "units=um,deg" and view_of_query("units=mm,mrad") == PageView()


def test_a_long_address_is_cut() -> None:
    """More sources than can be open, and more characters than a browser sends, are ignored."""
    assert len(view_of_query("&".join(f"rec={k}" for k in range(100))).sources) == 7
    assert view_of_query("&" * 100_000) == PageView() and view_of_query("&".join(f"a{k}=1" for k in range(900))) == PageView()


def test_the_token_goes_and_the_view_stays() -> None:
    """The redirect target of the guard."""
    assert without("token=secret&rec=dry.npz&axis=y&token=again", "token") == "rec=dry.npz&axis=y"


def test_options_of_a_table_in_words_read_it_and_others_are_refused() -> None:
    """The same as the command's options."""
    usual = Reading({"effort_as_voltage": True}, ("--effort",))
    read = read_so(usual, ("--map", "time=A,x.input=B", "--rate", "500", "--unit", "x.output=mm", "--scale", "x.input=2"))
    assert read.words[0] == "--effort" and read.words[-1] == "x.input=2"
    assert read.load == {
        "effort_as_voltage": True,
        "columns": {"time": "A", "x.input": "B"},
        "units": {"x.output": "mm"},
        "scales": {"x.input": 2.0},
        "rate": 500.0,
    }
    for words in (("--rate", "fast"), ("--rate", "-1"), ("--map", "A"), ("--map", "wheel=A"), ("--scale", "x.input=much")):
        with pytest.raises(BadInput):
            read_so(usual, words)
