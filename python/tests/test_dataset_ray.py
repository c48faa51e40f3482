"""Data sets on Ray: the bytes of a run without it, whatever dies. `make test-ray` runs these alone."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

import pytest
import regrasp

pytest.importorskip("pyarrow")
pytest.importorskip("ray", reason="SKIPPED: Ray is not installed (pip install 'regrasp[ray]')")

from regrasp.dataset import make, specification_of  # noqa: E402
from regrasp.dataset.specification import Specification  # noqa: E402
from test_dataset import shards, text_of  # noqa: E402


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The shards of a run without Ray."""
    folder = tmp_path_factory.mktemp("undisturbed")
    assert make(specification(), folder, workers=1).complete
    return shards(folder)


def specification() -> Specification:
    return specification_of(text_of(episodes=12, block=1), "dataset.toml")


def test_ray_makes_the_same_bytes(tmp_path: Path, undisturbed: dict[str, bytes]) -> None:
    result = make(specification(), tmp_path, workers=2, ray="local")
    assert result.complete and shards(tmp_path) == undisturbed


def test_ray_makes_a_block_again_whose_worker_was_killed(
    tmp_path: Path, undisturbed: dict[str, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("REGRASP_TEST_FAULT", f"kill_once:4:{tmp_path / 'killed'}")
    assert make(specification(), tmp_path / "out", workers=1, ray="local").complete
    assert (tmp_path / "killed").exists() and shards(tmp_path / "out") == undisturbed


def test_a_cluster_that_loses_a_node_makes_the_same_bytes(tmp_path: Path, undisturbed: dict[str, bytes]) -> None:
    """Three nodes, each with a raylet of its own; one is killed with `kill -9` when the first blocks are done."""
    import ray
    from ray.cluster_utils import Cluster

    cluster: Any = Cluster(initialize_head=True, head_node_args={"num_cpus": 1, "include_dashboard": False})
    try:
        others = [cluster.add_node(num_cpus=1) for _ in range(2)]
        ray.init(address=cluster.address, log_to_driver=False)
        killed: list[int] = []

        def kill_a_node(line: str) -> None:
            if not killed and "episodes/s" in line:
                process = others[0].all_processes["raylet"][0].process
                os.kill(process.pid, signal.SIGKILL)
                killed.append(process.pid)

        assert len(ray.nodes()) == 3
        result = make(specification(), tmp_path, ray=cluster.address, say=kill_a_node)
        assert killed and result.complete
        assert shards(tmp_path) == undisturbed
    finally:
        ray.shutdown()
        cluster.shutdown()


def test_a_cluster_that_is_not_there_is_told(tmp_path: Path) -> None:
    with pytest.raises(regrasp.InputError, match="D130"):
        make(specification(), tmp_path, ray="127.0.0.1:1")
