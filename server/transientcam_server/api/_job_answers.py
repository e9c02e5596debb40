"""Answers about jobs, of the routes that start one and of those that report it."""

from typing import Any, Final

from fastapi import Response

from transientcam_server.api._documents.job import JobDocument
from transientcam_server.camera import Job

ACCEPTED: Final[dict[int | str, dict[str, Any]]] = {
    202: {
        "description": "It has begun, or waits for its turn",
        "headers": {
            "Location": {
                "description": "where its progress is reported, relative to this address",
                "schema": {"type": "string"},
            }
        },
    }
}
"""What the OpenAPI document says of a route that starts a job."""


def job_document(job: Job) -> JobDocument:
    """Return where a job stands."""
    return JobDocument(**job.to_document())


def accepted(job: Job, response: Response) -> JobDocument:
    """Return the answer to a request that started a job."""
    response.headers["Location"] = f"/api/v1/jobs/{job.id}"
    return job_document(job)
