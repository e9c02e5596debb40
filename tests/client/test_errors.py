"""The tree of errors."""

import inspect
import pickle

import pytest

from transientcam import errors
from transientcam.errors import (
    CheckSkipped,
    CommandUnavailable,
    FrameTimeout,
    MissingExtra,
    ParameterError,
    ProblemError,
    PromiseBroken,
    ProtocolError,
    ServerUnreachable,
    StreamClosed,
    TransientcamError,
)

_TREE = [
    ServerUnreachable("http://h", "Connection refused"),
    ProblemError(status=404, type="/problems/x", title="Title", detail="Detail.", field="f"),
    ProtocolError("f", 1, "2"),
    StreamClosed(1001, "bye"),
    FrameTimeout(0.5),
    ParameterError("f", 1, "2"),
    CommandUnavailable("serve", "fastapi", "server"),
    MissingExtra("transientcam.open", "h5py", "server"),
    PromiseBroken("PUT /sequence is answered with 500"),
    CheckSkipped("the camera is a real one"),
]


def test_every_error_is_in_the_tree_drawn_at_the_top() -> None:
    classes = [
        each
        for _, each in inspect.getmembers(errors, inspect.isclass)
        if each.__module__ == errors.__name__ and not each.__name__.startswith("_")
    ]

    assert {type(error) for error in _TREE} == set(classes) - {TransientcamError}
    for each in classes:
        assert issubclass(each, TransientcamError)
        assert each.__name__ in (errors.__doc__ or "")


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        *zip(
            _TREE,
            [
                "No camera answers at http://h: Connection refused",
                "Detail. (404)",
                "f is 1, but must be 2",
                "The stream closed (1001): bye",
                "No frame came within 0.5 s",
                "f is 1, but must be 2",
                "'transientcam serve' needs fastapi, which is not installed: "
                "pip install 'transientcam[server]'",
                "transientcam.open needs h5py: pip install 'transientcam[server]'",
                "PUT /sequence is answered with 500",
                "the camera is a real one",
            ],
            strict=True,
        )
    ],
)
def test_an_error_says_one_sentence(error: TransientcamError, sentence: str) -> None:
    assert str(error) == sentence


def test_a_long_value_is_shown_on_one_line() -> None:
    text = str(ProtocolError("f", "line\n" * 1000, "short"))

    assert len(text) < 130
    assert "\n" not in text


def test_a_problem_without_words_still_says_something() -> None:
    assert str(ProblemError(status=0)) == "about:blank"
    assert str(ProblemError(status=500, title="Internal Server Error")) == (
        "Internal Server Error (500)"
    )


def test_an_error_shows_its_data_however_it_was_given() -> None:
    error = StreamClosed(reason="bye", code=1001)

    assert repr(error) == "StreamClosed(1001, 'bye')"
    assert repr(_TREE[1]) == "ProblemError(404, '/problems/x', 'Title', 'Detail.')"


def test_equal_errors_are_distinct_and_can_be_kept_in_sets() -> None:
    assert len({FrameTimeout(0.5), FrameTimeout(0.5)}) == 2


def test_a_parameter_error_is_a_value_error_as_callers_expect() -> None:
    assert isinstance(ParameterError("f", 1, "2"), ValueError)


@pytest.mark.parametrize("error", _TREE, ids=lambda error: type(error).__name__)
def test_an_error_survives_the_way_between_processes(error: TransientcamError) -> None:
    arrived = pickle.loads(pickle.dumps(error))

    assert type(arrived) is type(error)
    assert str(arrived) == str(error)
    assert vars(arrived) == vars(error)
