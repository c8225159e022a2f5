"""romgen doctor: what this machine offers, and what is missing for which step."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import shutil
from pathlib import Path

import numba

import romgen
from romgen.cli.failures import reported
from romgen.cli.options import Json, Quiet
from romgen.cli.output import Output
from romgen.fmu.compilers import find_compiler, host_platform
from romgen.provenance import THREAD_VARIABLES, git_commit

OPTIONAL = {
    "scikit-fem": "finite-element studies: pip install 'romgen[fem]'",
    "meshio": "mesh import: pip install 'romgen[fem]'",
    "pypardiso": "faster factorisation on x86: pip install 'romgen[fem]'",
    "gmsh": "geometry and tetrahedra: pip install 'romgen[mesh]'",
    "ziglang": "FMU binaries for five platforms: pip install 'romgen[cross]'",
    "distributed": "jobs on a cluster: pip install 'romgen[cluster]'",
}
REQUIRED = ("numpy", "scipy", "h5py", "numba", "pydantic", "typer", "matplotlib", "jinja2", "fmpy", "pythonfmu")


@reported
def doctor(json_output: Json = False, quiet: Quiet = False) -> None:
    """Show versions, libraries, compiler, threads and memory of this machine."""
    out = Output(quiet=quiet, as_json=json_output)
    facts = machine_facts()
    required, optional = {name: _version(name) for name in REQUIRED}, {name: _version(name) for name in OPTIONAL}
    out.table(("machine", ""), [(name, value) for name, value in facts.items()])
    out.table(("library", "version"), [(name, version or "MISSING") for name, version in required.items()])
    rows = [(name, version or f"not installed, for {OPTIONAL[name]}") for name, version in optional.items()]
    out.table(("optional", "version"), rows)
    out.document({"machine": facts, "required": required, "optional": optional})


def machine_facts() -> dict[str, str]:
    """Return what matters about this machine by name."""
    compiler = find_compiler()
    threads = {name: os.environ[name] for name in THREAD_VARIABLES if name in os.environ}
    free = shutil.disk_usage(Path.cwd()).free
    return {
        "romgen": romgen.__version__,
        "source": git_commit(Path(romgen.__file__).parent) or "installed package",
        "python": platform.python_version(),
        "system": platform.platform(),
        "FMI platform": host_platform(),
        "processors": str(os.cpu_count() or 1),
        "numba threads": str(numba.get_num_threads()),
        "thread variables": ", ".join(f"{name}={value}" for name, value in threads.items()) or "none set",
        "memory": _memory(),
        "free disk": f"{free / 1e9:.1f} GB",
        "C compiler": "none: FMUs will hold sources only" if compiler is None else compiler.name,
    }


def _memory() -> str:
    if not hasattr(os, "sysconf") or "SC_PHYS_PAGES" not in os.sysconf_names:
        return "unknown"
    return f"{os.sysconf('SC_PHYS_PAGES') * os.sysconf('SC_PAGE_SIZE') / 1e9:.1f} GB"


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None
