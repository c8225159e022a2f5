"""Saved, serialised and reset states, several instances, and many of them."""

from __future__ import annotations

import resource
import subprocess
import sys
from pathlib import Path

from fmpy.fmi2 import FMU2Slave

from romgen.fmu.driver import Slave, opened_slave
from romgen.fmu.records import FmuExport
from tests.romgen.fmu.models import smooth_input

H = 1e-4
U = smooth_input(100, H, 2)


def run(slave: Slave, first: int, n: int) -> list[float]:
    """Steps with the input held; the states and displacements at the end."""
    vr = slave.references
    for k in range(first, first + n):
        slave.fmu.setReal(vr.inputs, U[k].tolist())
        slave.fmu.doStep(k * H, H)
    return slave.fmu.getReal([*vr.states, *vr.displacement])


def begin(slave: Slave) -> None:
    slave.fmu.setupExperiment(startTime=0.0)
    slave.fmu.setReal(slave.references.states, [0.4, 0.1, -0.2, 0.3])
    slave.fmu.enterInitializationMode()
    slave.fmu.exitInitializationMode()


def test_a_restored_state_replays_to_the_bit(native: FmuExport) -> None:
    with opened_slave(native.path) as slave:
        begin(slave)
        run(slave, 0, 40)
        state = slave.fmu.getFMUstate()
        first = run(slave, 40, 40)
        slave.fmu.setFMUstate(state)
        assert run(slave, 40, 40) == first
        slave.fmu.freeFMUstate(state)


def test_a_serialised_state_continues_in_another_process(native: FmuExport, tmp_path: Path) -> None:
    with opened_slave(native.path) as slave:
        begin(slave)
        run(slave, 0, 40)
        state = slave.fmu.getFMUstate()
        (tmp_path / "state").write_bytes(slave.fmu.serializeFMUstate(state))
        expected = run(slave, 40, 40)
    script = (
        "import sys; from pathlib import Path; from romgen.fmu.driver import opened_slave\n"
        "from tests.romgen.fmu.test_states import run\n"
        "with opened_slave(sys.argv[1]) as slave:\n"
        "    state = slave.fmu.deSerializeFMUstate(Path(sys.argv[2]).read_bytes())\n"
        "    slave.fmu.setFMUstate(state)\n"
        "    print(*[x.hex() for x in run(slave, 40, 40)])\n"
    )
    root = Path(__file__).parents[3]
    command = [sys.executable, "-c", script, native.path, str(tmp_path / "state")]
    result = subprocess.run(command, cwd=root, capture_output=True, text=True, check=True)
    assert [float.fromhex(word) for word in result.stdout.split()] == expected


def test_reset_equals_fresh(native: FmuExport) -> None:
    with opened_slave(native.path) as slave:
        begin(slave)
        fresh = run(slave, 0, 50)
        slave.fmu.reset()
        begin(slave)
        assert run(slave, 0, 50) == fresh


def test_interleaved_instances_do_not_meet(native: FmuExport) -> None:
    with opened_slave(native.path) as alone:
        begin(alone)
        expected = run(alone, 0, 50)
    with opened_slave(native.path) as a, opened_slave(native.path) as b:
        begin(a)
        begin(b)
        for k in range(50):
            last = run(a, k, 1)
            b.fmu.doStep(3e-5 * k, 3e-5)
    assert last == expected


def test_two_thousand_instances_leave_no_memory_behind(native: FmuExport, unpacked: Path) -> None:
    """Growth of the peak resident memory after a warm-up stays below 1 MB (measured 0 to 0.3 MB)."""
    description_guid = native.guid
    fmu = FMU2Slave(guid=description_guid, modelIdentifier="random_panel", unzipDirectory=str(unpacked))

    def cycle() -> None:
        fmu.instantiate()
        fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        fmu.doStep(0.0, H)
        fmu.getFMUstate()
        fmu.fmi2FreeInstance(fmu.component)

    for _ in range(200):
        cycle()
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    for _ in range(2000):
        cycle()
    grown_kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    assert grown_kib < 1024
