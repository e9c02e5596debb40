"""Requests that follow from answers: what was made is read, changed, stopped, deleted, read again.

``python -m tests.server.fuzzing.stateful URL [PATHS TEXT]`` prints, as JSON, how often each
operation answered with which status, and whatever is wrong: an answer that is not one that the
OpenAPI document has, something deleted that can still be had, something made that cannot. With a
regular expression of paths and a text it leaves those out, and ends with the first story in which
something is wrong that contains the text.
"""

import collections
import contextlib
import json
import sys
from pathlib import Path
from typing import Any, Final

import httpx
import schemathesis
from hypothesis import HealthCheck, Phase, seed, settings
from hypothesis.errors import FlakyStrategyDefinition
from hypothesis.stateful import run_state_machine_as_test
from schemathesis.config import SchemathesisConfig
from schemathesis.core.failures import FailureGroup

CONFIG: Final = Path(__file__).with_name("schemathesis.toml")
LEFT_OUT: Final = r"mjpeg|/(plan|tradeoff|series)/jobs$|/recordings/import$|/camera$"
"""Answers without end, what computes for seconds each, and what would end the service."""
STORIES: Final = 30
STORY: Final = settings(
    max_examples=2,  # the first one is always the shortest
    stateful_step_count=12,
    database=None,
    deadline=None,
    phases=[Phase.generate],
    suppress_health_check=list(HealthCheck),
)


def clear(client: httpx.Client) -> None:
    """Delete all that an earlier story made."""
    for each in client.get("recordings").json()["recordings"]:
        if each["state"] == "recording":
            client.post(f"recordings/{each['id']}/stop")
        client.delete(f"recordings/{each['id']}")
    for each in client.get("jobs").json()["jobs"]:
        client.post(f"jobs/{each['id']}/cancel")
        client.get(f"jobs/{each['id']}", params={"wait_s": 10.0})
    for each in client.get("calibrations").json()["calibrations"]:
        client.delete(f"calibrations/{each['id']}")


def tell(url: str, left_out: str = LEFT_OUT, until: str | None = None) -> dict[str, Any]:
    """Run stateful tests on a daemon, and return the count of each answer, and the failures."""
    answers: collections.Counter[str] = collections.Counter()
    wrong: list[str] = []
    config = SchemathesisConfig.from_path(CONFIG)
    schema = schemathesis.openapi.from_url(f"{url}/openapi.json", config=config)
    # the links are schemathesis's own: it reads them off the names of parameters and of fields
    workflow: Any = schema.exclude(path_regex=left_out).as_state_machine()

    class Stories(workflow):  # type: ignore[misc]  # its class is made while it runs
        def validate_response(self, response: Any, case: Any, **kwargs: Any) -> None:
            answered = f"{case.method} {case.operation.path} {response.status_code}"
            answers[answered] += 1
            # never read again: by then the daemon would be another
            try:
                super().validate_response(response, case, **kwargs)
            except FailureGroup as group:
                wrong.extend(f"{answered}: {each}" for each in group.exceptions)

    with httpx.Client(base_url=f"{url}/api/v1/", timeout=60.0) as client:
        for number in range(STORIES):
            # what follows from an answer hangs on the moment, too, which hypothesis calls flaky
            with contextlib.suppress(FlakyStrategyDefinition):
                run_state_machine_as_test(seed(number)(Stories), settings=STORY)
            clear(client)
            if until is not None and any(until in each for each in wrong):
                break
    return {"answers": dict(sorted(answers.items())), "wrong": wrong}


if __name__ == "__main__":
    sys.stdout.write(json.dumps(tell(*sys.argv[1:4]), indent=1))
