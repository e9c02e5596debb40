"""The exceptions of the package."""

import pickle

import pytest

import transientcam_moments as tm


def test_everything_raised_is_a_moments_error_and_a_value_error() -> None:
    for error in (
        tm.ShapeError("b", "of shape (1,)", "more"),
        tm.ParameterError("n", 0, "> 0"),
        tm.UnlabelledImages(("harmonic",)),
    ):
        assert isinstance(error, tm.MomentsError)
        assert isinstance(error, ValueError)


def test_the_sentence_names_field_value_and_limit() -> None:
    assert str(tm.ParameterError("n", 0, "> 0")) == "n = 0 is outside of its limit: > 0"
    assert str(tm.ShapeError("b", "of shape (1,)", "more")) == "b is of shape (1,), expected more"


def test_errors_survive_a_process_boundary() -> None:
    error = pickle.loads(pickle.dumps(tm.ParameterError("n", 0, "> 0")))

    assert (error.field, error.value, error.limit) == ("n", 0, "> 0")


def test_one_except_clause_catches_all() -> None:
    with pytest.raises(tm.MomentsError):
        tm.levinson([1.0])
