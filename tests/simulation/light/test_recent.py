"""The last few results are kept, the others made again."""

from transientcam_simulation.light._recent import Recent


def test_the_last_ones_that_were_used_are_kept() -> None:
    made: list[str] = []

    def get(key: str) -> str:
        def make() -> str:
            made.append(key)
            return key.upper()

        return recent.get(key, make)

    recent: Recent[str, str] = Recent(2)
    assert [get(key) for key in "aabacab"] == list("AABACAB")
    assert made == ["a", "b", "c", "b"]


def test_a_result_of_none_is_a_result() -> None:
    recent: Recent[str, None] = Recent(1)
    made: list[None] = []
    for _ in range(2):
        recent.get("a", lambda: made.append(None))
    assert made == [None]
