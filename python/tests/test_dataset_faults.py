"""What goes wrong while a data set is made: nothing that was done is lost, and the final bytes are those of an undisturbed run."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import regrasp

pytest.importorskip("pyarrow")

from regrasp.dataset import make, specification_of, verify  # noqa: E402
from regrasp.dataset.blocks import blocks_of  # noqa: E402
from regrasp.dataset.folder import write_whole  # noqa: E402
from regrasp.dataset.specification import Specification  # noqa: E402
from test_dataset import shards, text_of  # noqa: E402


@pytest.fixture(scope="module")
def undisturbed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """The shards of a run in which nothing goes wrong."""
    folder = tmp_path_factory.mktemp("undisturbed")
    assert make(specification(), folder, workers=1).complete
    return shards(folder)


def specification() -> Specification:
    return specification_of(text_of(), "dataset.toml")


def start(folder: Path, *arguments: str, **environment: str) -> subprocess.Popen[str]:
    """The command line, in a process group of its own."""
    (folder / "dataset.toml").write_text(text_of())
    command = [sys.executable, "-m", "regrasp.dataset", "make", str(folder / "dataset.toml"), "-o", str(folder / "out"), *arguments]
    variables = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path), **environment}
    return subprocess.Popen(command, env=variables, stderr=subprocess.PIPE, text=True, start_new_session=True)


def wait_for_a_shard(folder: Path) -> None:
    for _ in range(1200):
        if list((folder / "out").rglob("*.parquet")):
            return
        time.sleep(0.05)
    raise AssertionError("no shard was written in a minute")


def test_a_killed_worker_is_replaced(tmp_path: Path, undisturbed: dict[str, bytes], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("REGRASP_TEST_FAULT", f"kill_once:4:{tmp_path / 'killed'}")
    said: list[str] = []
    result = make(specification(), tmp_path / "out", workers=2, say=said.append)
    assert (tmp_path / "killed").exists()
    assert result.complete and result.episodes == 12
    assert any("signal 9" in line and "spheres 4 to 7 are made again" in line for line in said)
    assert shards(tmp_path / "out") == undisturbed


def test_a_block_that_always_kills_its_worker_is_given_up_and_the_others_are_made(
    tmp_path: Path, undisturbed: dict[str, bytes], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("REGRASP_TEST_FAULT", "kill_always:4:")
    result = make(specification(), tmp_path, workers=1)
    assert len(result.lost) == 1 and "3 workers died of it" in result.lost[0][1]
    assert not result.complete and result.made == 2 and verify(tmp_path).ok
    # The cause is gone: the same command makes the rest.
    monkeypatch.delenv("REGRASP_TEST_FAULT")
    again = make(specification(), tmp_path, workers=1)
    assert (again.done_before, again.made) == (2, 1) and shards(tmp_path) == undisturbed


def test_a_killed_driver_goes_on_where_it_was(tmp_path: Path, undisturbed: dict[str, bytes]) -> None:
    driver = start(tmp_path, "--workers", "1")
    wait_for_a_shard(tmp_path)
    os.kill(driver.pid, signal.SIGKILL)
    driver.wait(30)
    assert driver.stderr is not None
    driver.stderr.close()
    # What a write that was cut off leaves behind.
    left = tmp_path / "out/shards/spheres/00000/.x.parquet.1.tmp"
    left.write_bytes(b"PAR1")
    assert verify(tmp_path / "out").ok
    said: list[str] = []
    result = make(specification(), tmp_path / "out", workers=1, say=said.append)
    assert result.done_before >= 1 and not left.exists()
    assert any("removed 1 unfinished files" in line for line in said)
    assert shards(tmp_path / "out") == undisturbed


def test_ctrl_c_leaves_a_valid_data_set(tmp_path: Path, undisturbed: dict[str, bytes]) -> None:
    driver = start(tmp_path, "--workers", "1")
    wait_for_a_shard(tmp_path)
    # As a terminal does: to the whole group.
    os.killpg(driver.pid, signal.SIGINT)
    _, told = driver.communicate(timeout=60)
    assert driver.returncode in (0, 130), told
    if driver.returncode == 130:
        assert "interrupted; what is done stays" in told and "Traceback" not in told
    assert verify(tmp_path / "out").ok and not list(tmp_path.rglob(".*.tmp"))
    assert make(specification(), tmp_path / "out", workers=1).complete
    assert shards(tmp_path / "out") == undisturbed


def test_truncated_and_foreign_shards_are_told_and_made_again(tmp_path: Path, undisturbed: dict[str, bytes]) -> None:
    make(specification(), tmp_path, workers=1)
    first, second, third = (tmp_path / name for name in undisturbed)
    first.write_bytes(first.read_bytes()[:-100])
    second.write_bytes(third.read_bytes())
    (third.parent / "notes.parquet").write_bytes(b"mine")
    verdict = verify(tmp_path)
    assert sum("D121" in problem for problem in verdict.problems) == 2 and any("D122" in p for p in verdict.problems)
    said: list[str] = []
    result = make(specification(), tmp_path, workers=1, say=said.append)
    assert (result.done_before, result.made, len(result.foreign)) == (1, 2, 1)
    assert any("D121" in line and "is no whole Parquet file" in line for line in said)
    assert any("D121" in line and "holds other episodes than its name says" in line for line in said)
    assert any("D122" in line and "notes.parquet" in line for line in said)
    (third.parent / "notes.parquet").unlink()
    assert shards(tmp_path) == undisturbed and verify(tmp_path).ok


def test_a_flipped_bit_is_found_by_verify(tmp_path: Path) -> None:
    make(specification(), tmp_path, workers=1)
    path = sorted(tmp_path.rglob("*.parquet"))[1]
    content = bytearray(path.read_bytes())
    content[len(content) // 3] ^= 0x10
    path.write_bytes(bytes(content))
    verdict = verify(tmp_path)
    assert not verdict.ok and str(path) in verdict.problems[0]


def test_plans_that_were_tampered_with_are_rejected(tmp_path: Path) -> None:
    """Rows changed by somebody who knows how to write a shard."""
    import json

    from regrasp.dataset.folder import about_of, rows_of
    from regrasp.dataset.schema import shard_of

    make(specification(), tmp_path, workers=1)
    path = sorted(tmp_path.rglob("*.parquet"))[0]
    rows, about = list(rows_of(path)), about_of(path)
    solved = next(row for row in rows if row["solved"])
    solved["joints"] = solved["joints"] + 0.01
    path.write_bytes(shard_of(rows, about))
    verdict = verify(tmp_path)
    assert any("the checker rejects the plan" in problem for problem in verdict.problems)
    rows = list(rows_of(path))
    rows[0]["seed"] += 1
    path.write_bytes(shard_of(rows, about))
    assert any("is not the episode of its number" in problem for problem in verify(tmp_path).problems)
    assert json.dumps(about)


def test_a_full_disk_is_told_and_leaves_nothing_half_written(tmp_path: Path) -> None:
    resource = pytest.importorskip("resource")
    before, handler = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    target = tmp_path / "shards/x.parquet"
    resource.setrlimit(resource.RLIMIT_FSIZE, (4096, before[1]))
    try:
        with pytest.raises(regrasp.InputError, match=r"D124 .*x\.parquet: cannot be written: .*\n  fix: free some space"):
            write_whole(target, b"x" * 10_000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, handler)
    assert not list(target.parent.iterdir())


def test_a_task_that_takes_its_whole_budget_is_a_row(tmp_path: Path) -> None:
    text = text_of(episodes=2).replace("[10, 60]", "[175, 179]").replace("episodes = 2", "episodes = 2\nmax_work = 100")
    result = make(specification_of(text, "dataset.toml"), tmp_path / "one", workers=1)
    assert result.complete and result.episodes == 2
    make(specification_of(text, "dataset.toml"), tmp_path / "two", workers=2)
    assert shards(tmp_path / "one") == shards(tmp_path / "two") and verify(tmp_path / "one").ok


def test_a_worker_without_memory_is_told(tmp_path: Path) -> None:
    pytest.importorskip("resource")
    # Less than what the interpreter has already.
    result = make(specification(), tmp_path, workers=1, memory=50_000_000)
    assert len(result.lost) == len(blocks_of(specification()))
    assert all(reason for _, reason in result.lost)
    assert make(specification(), tmp_path, workers=1).complete


def test_ray_that_is_absent_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "ray", None)
    with pytest.raises(regrasp.InputError, match=r'D130 .*Ray is not installed\n  fix: pip install "regrasp\[ray\]"'):
        make(specification(), tmp_path, ray="local")
