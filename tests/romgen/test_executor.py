"""One contract for every executor; a cluster that is not there is one clear line."""

from __future__ import annotations

import importlib.util
import os
import time

import pytest

from romgen.errors import InputError
from romgen.executor import DaskExecutor, Executor, ProcessExecutor, SerialExecutor, executor_for


def square(x: int) -> int:
    """Finish the first jobs last, so that order cannot come from luck."""
    time.sleep(0.02 * max(0, 3 - x))
    return x * x


def fail(x: int) -> int:
    raise InputError("bad job", value=x)


def process(_: int) -> int:
    return os.getpid()


@pytest.mark.parametrize("executor", [SerialExecutor(), ProcessExecutor(2)], ids=lambda e: type(e).__name__)
def test_contract(executor: Executor) -> None:
    assert executor.map(square, range(5)) == (0, 1, 4, 9, 16)
    assert executor.map(square, ()) == ()
    with pytest.raises(InputError, match="bad job"):
        executor.map(fail, [1])


def test_processes_are_other_processes() -> None:
    assert os.getpid() not in ProcessExecutor(2).map(process, range(2))


def test_names() -> None:
    assert executor_for("serial") == SerialExecutor()
    assert executor_for("processes:3") == ProcessExecutor(3)
    assert executor_for("processes") == ProcessExecutor(os.cpu_count() or 1)
    assert executor_for("tcp://host:8786") == DaskExecutor("tcp://host:8786")
    for wrong in ("", "threads", "processes:0", "processes:many", "host:8786"):
        with pytest.raises(InputError, match="unknown executor"):
            executor_for(wrong)


@pytest.mark.skipif(importlib.util.find_spec("distributed") is not None, reason="distributed is installed")
def test_missing_dask_says_what_to_install() -> None:
    with pytest.raises(InputError, match=r"pip install 'romgen\[cluster\]'"):
        DaskExecutor("tcp://localhost:1").map(square, [1])


@pytest.mark.skipif(importlib.util.find_spec("distributed") is None, reason="distributed is not installed")
@pytest.mark.filterwarnings("default")
def test_dask_cluster() -> None:
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, dashboard_address=None) as cluster:
        assert DaskExecutor(cluster.scheduler_address).map(square, range(5)) == (0, 1, 4, 9, 16)
