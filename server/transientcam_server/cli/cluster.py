"""The options ``--workers`` and ``--dask`` of verbs that a cluster can compute."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Annotated, Any

import typer

from transientcam.cli.terminal import Terminal
from transientcam_server.errors import ClusterError, MissingExtra

WorkersOption = Annotated[
    int | None, typer.Option(min=1, help="Compute with so many processes of this machine.")
]
DaskOption = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS",
        help="Compute on the Dask cluster whose scheduler this is, such as tcp://head:8786.",
    ),
]
_CONNECT_WITHIN_S = 10


@contextmanager
def cluster_client(workers: int | None, address: str | None, console: Terminal) -> Iterator[Any]:
    """Connect to a cluster, or start one on this machine that ends with the block.

    Raises MissingExtra if distributed is not installed; ClusterError if no scheduler answers at the
    address.
    """
    if workers is not None and address is not None:
        raise typer.BadParameter("--workers and --dask exclude each other", param_hint="--dask")
    try:
        import distributed
    except ModuleNotFoundError as error:
        option = "--dask" if workers is None else "--workers"
        raise MissingExtra(option, "distributed", "cluster") from error

    if address is not None:
        try:
            client = distributed.Client(address, timeout=_CONNECT_WITHIN_S)
        except (OSError, ValueError) as error:
            raise ClusterError(address, str(error)) from error
        with client:
            _say(console, client)
            yield client
        return
    with (
        # one thread each: the work holds no lock that threads of a process would share
        distributed.LocalCluster(
            n_workers=workers, threads_per_worker=1, dashboard_address="127.0.0.1:0"
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        _say(console, client)
        yield client


def _say(console: Terminal, client: Any) -> None:
    workers = len(client.scheduler_info(n_workers=-1)["workers"])
    console.print(f"{workers} workers, dashboard: {client.dashboard_link}")
