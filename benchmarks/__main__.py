"""python -m benchmarks [STUDY]: wall time and peak memory of every stage of the quick start, from nothing."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

QUICK_START = Path(__file__).parents[1] / "models" / "clamped_panel" / "study.toml"
TARGET_WALL_S, TARGET_MEMORY_BYTES = 360.0, 2e9


def measure(study: Path) -> tuple[dict[str, Any], float]:
    """Run a study in a fresh process and an empty folder; return its summary and the wall time in s."""
    with tempfile.TemporaryDirectory() as folder:
        start = time.perf_counter()
        command = [sys.executable, "-m", "romgen", "run", str(study), "--run-dir", folder, "--quiet"]
        subprocess.run(command, check=True)
        wall_s = time.perf_counter() - start
        return json.loads((Path(folder) / "summary.json").read_text(encoding="utf-8")), wall_s


def main() -> None:
    """Print the table."""
    study = Path(sys.argv[1]) if len(sys.argv) > 1 else QUICK_START
    summary, wall_s = measure(study)
    stages = summary["stages"]
    print(f"{'stage':<18}{'wall s':>10}{'share %':>10}{'peak MB':>10}")
    for name, stage in stages.items():
        share = 100.0 * stage["wall_s"] / wall_s
        print(f"{name:<18}{stage['wall_s']:>10.2f}{share:>10.1f}{stage['peak_memory_bytes'] / 1e6:>10.0f}")
    outside = wall_s - sum(stage["wall_s"] for stage in stages.values())
    print(f"{'start and storing':<18}{outside:>10.2f}{100.0 * outside / wall_s:>10.1f}")
    peak = max(stage["peak_memory_bytes"] for stage in stages.values())
    print(f"{'total':<18}{wall_s:>10.2f}{100.0:>10.1f}{peak / 1e6:>10.0f}")
    print(f"target {TARGET_WALL_S:.0f} s and {TARGET_MEMORY_BYTES / 1e6:.0f} MB: ", end="")
    print("met" if wall_s <= TARGET_WALL_S and peak <= TARGET_MEMORY_BYTES else "missed")


if __name__ == "__main__":
    main()
