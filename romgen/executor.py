"""Independent jobs on this machine or on a cluster behind one protocol."""

from __future__ import annotations

import importlib
import multiprocessing
import os
from collections.abc import Callable, Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from romgen.errors import InputError

Job = TypeVar("Job")
Result = TypeVar("Result")


class Executor(Protocol):
    """Runs one function on many jobs; results come in the order of the jobs whatever finishes first."""

    def map(self, function: Callable[[Job], Result], jobs: Iterable[Job]) -> tuple[Result, ...]:
        """Return ``function(job)`` of every job; the first failure is raised as it is."""


@dataclass(frozen=True)
class SerialExecutor:
    """One job after the other in this process."""

    def map(self, function: Callable[[Job], Result], jobs: Iterable[Job]) -> tuple[Result, ...]:
        """Return ``function(job)`` of every job."""
        return tuple(function(job) for job in jobs)


@dataclass(frozen=True)
class ProcessExecutor:
    """Jobs in fresh processes of this machine (spawned: threads and compiled kernels do not survive a fork).

    Attributes
    ----------
    workers : number of processes.
    """

    workers: int

    def map(self, function: Callable[[Job], Result], jobs: Iterable[Job]) -> tuple[Result, ...]:
        """Return ``function(job)`` of every job; function and jobs are pickled."""
        context = multiprocessing.get_context("spawn")
        with ProcessPoolExecutor(self.workers, mp_context=context) as pool:
            return tuple(pool.map(function, jobs))


@dataclass(frozen=True)
class DaskExecutor:
    """Jobs on a Dask cluster.

    Attributes
    ----------
    address : of its scheduler, such as "tcp://host:8786".
    """

    address: str

    def map(self, function: Callable[[Job], Result], jobs: Iterable[Job]) -> tuple[Result, ...]:
        """Return ``function(job)`` of every job, computed by the workers of the cluster.

        Raises
        ------
        InputError : distributed is not installed, or no scheduler answers at the address.
        """
        distributed = _import_distributed()
        try:
            client = distributed.Client(self.address, timeout="10s")
        except (OSError, TimeoutError, ValueError) as error:
            raise InputError("no Dask scheduler answers", where="executor", value=self.address) from error
        with client:
            return tuple(client.gather(client.map(function, list(jobs), pure=False)))


def _import_distributed() -> Any:
    try:
        return importlib.import_module("distributed")
    except ImportError as error:
        raise InputError(
            "a cluster needs the packages dask and distributed",
            where="executor",
            advice="pip install 'romgen[cluster]'",
        ) from error


def executor_for(place: str) -> Executor:
    """Return the executor named by "serial", "processes", "processes:4" or a scheduler's address.

    Raises
    ------
    InputError : the name is none of these.
    """
    kind, _, count = place.partition(":")
    if place == "serial":
        return SerialExecutor()
    if kind == "processes" and (not count or (count.isdecimal() and int(count) > 0)):
        return ProcessExecutor(int(count) if count else os.cpu_count() or 1)
    if "://" in place:
        return DaskExecutor(place)
    raise InputError(
        "unknown executor",
        where="executor",
        value=place,
        advice="use serial, processes, processes:4 or a Dask address such as tcp://host:8786",
    )
