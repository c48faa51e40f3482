"""The same blocks on Ray: one machine or a cluster. Ray's retries never change results, because a block is the same anywhere."""

from __future__ import annotations

import socket
from collections.abc import Iterable, Iterator
from importlib import import_module
from typing import Any

from .blocks import Block, run_block
from .pool import MAX_DEATHS, Lost, Outcome
from .specification import TaskSpec
from .tables import fault

#: How long a cluster may take to answer, in seconds.
CONNECT_SECONDS = 5.0


def run_on_ray(tasks: tuple[TaskSpec, ...], blocks: Iterable[Block], address: str, n_workers: int | None) -> Iterator[Outcome]:
    """Makes blocks on Ray.

    address: "local" starts Ray on this machine; "auto" takes the cluster that runs here; else that of a cluster.
    n_workers: blocks made at once; as many as the cluster has processors where nothing is said.

    Raises `InputError` (D130) where Ray is absent or not there.
    """
    try:
        ray: Any = import_module("ray")
    except ImportError:
        raise fault("D130", "--ray", "Ray is not installed", fix='pip install "regrasp[ray]"') from None
    began = not ray.is_initialized()
    if began:
        _join(ray, address, n_workers)
    try:
        yield from _run(ray, tasks, blocks, n_workers)
    finally:
        if began:
            ray.shutdown()


def _join(ray: Any, address: str, n_workers: int | None) -> None:
    try:
        host, separator, port = address.removeprefix("ray://").rpartition(":")
        if separator:
            # Ray itself would try for minutes.
            socket.create_connection((host, int(port)), CONNECT_SECONDS).close()
        if address == "local":
            ray.init(address="local", num_cpus=n_workers, include_dashboard=False, log_to_driver=False, logging_level="error")
        else:
            ray.init(address=address, log_to_driver=False, logging_level="error")
    except (OSError, ValueError, RuntimeError) as error:
        fix = "ray start --head on one machine and ray start --address=HEAD on the others; or --ray local"
        raise fault("D130", f"--ray {address}", f"no cluster of Ray there: {str(error).splitlines()[0]}", fix=fix) from None


def _run(ray: Any, tasks: tuple[TaskSpec, ...], blocks: Iterable[Block], n_workers: int | None) -> Iterator[Outcome]:
    # Deaths of workers and nodes are Ray's to retry; the results are the same bytes.
    remote = ray.remote(num_cpus=1, max_retries=MAX_DEATHS, retry_exceptions=False)(run_block)
    shared = ray.put(tasks)
    waiting = iter(blocks)
    running: dict[Any, Block] = {}
    while True:
        # A cluster grows and shrinks. Twice as many blocks as processors keep all of them busy.
        limit = 2 * (n_workers or max(1, int(ray.cluster_resources().get("CPU", 1))))
        while len(running) < limit and (block := next(waiting, None)) is not None:
            running[remote.remote(shared, block)] = block
        if not running:
            return
        done, _ = ray.wait(list(running), num_returns=1)
        for reference in done:
            block = running.pop(reference)
            try:
                yield block, ray.get(reference)
            except (ray.exceptions.RayError, ray.exceptions.RayTaskError) as error:
                yield block, Lost(f"Ray: {str(error).strip().splitlines()[-1]}")
