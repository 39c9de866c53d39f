import pytest

from tvist_shaping import SHAPERS, UnknownShaperError, shaper


def test_a_shaper_is_found_by_its_name():
    for name in SHAPERS:
        assert shaper(name).name == name


def test_the_catalogue_stands_shortest_first():
    durations = [entry.duration_periods for entry in SHAPERS.values()]
    assert durations == sorted(durations)


def test_an_unknown_name_lists_those_there_are_and_the_nearest():
    with pytest.raises(
        UnknownShaperError, match=r"did you mean 'zvddd'.*there are none, um_zv, zv, mzv"
    ) as error:
        shaper("zvdddd")
    assert error.value.name == "zvdddd"
    assert error.value.known == tuple(SHAPERS)
    assert error.value.nearest == "zvddd"


def test_a_name_like_no_other_gets_no_suggestion():
    with pytest.raises(UnknownShaperError) as error:
        shaper("qqqqqq")
    assert error.value.nearest is None


def test_the_catalogue_cannot_be_changed():
    with pytest.raises(TypeError):
        SHAPERS["mine"] = SHAPERS["zv"]
