"""python models/coupled_feedback/make_ssp.py UNIT.fmu SENSOR OUT.ssp: couple a unit of romgen with the controller.

The SSP holds both units, SystemStructure.ssd, and two parameter sets: open.ssv (gain 0) and closed.ssv.
"""

from __future__ import annotations

import sys
import tempfile
import zipfile
from pathlib import Path

from pythonfmu.builder import FmuBuilder

HERE = Path(__file__).parent
INPUT = "base_acceleration"

STRUCTURE = """<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
  xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" version="1.0" name="coupled_feedback">
  <ssd:System name="system">
    <ssd:Elements>
      <ssd:Component name="structure" type="application/x-fmu-sharedlibrary" source="resources/structure.fmu">
        <ssd:Connectors>
          <ssd:Connector name="base_acceleration" kind="input"><ssc:Real unit="m/s2"/></ssd:Connector>
          <ssd:Connector name="{sensor}_velocity" kind="output"><ssc:Real unit="m/s"/></ssd:Connector>
          <ssd:Connector name="{sensor}_displacement" kind="output"><ssc:Real unit="m"/></ssd:Connector>
        </ssd:Connectors>
      </ssd:Component>
      <ssd:Component name="controller" type="application/x-fmu-sharedlibrary" source="resources/controller.fmu">
        <ssd:Connectors>
          <ssd:Connector name="velocity" kind="input"><ssc:Real unit="m/s"/></ssd:Connector>
          <ssd:Connector name="acceleration" kind="output"><ssc:Real unit="m/s2"/></ssd:Connector>
        </ssd:Connectors>
      </ssd:Component>
    </ssd:Elements>
    <ssd:Connections>
      <ssd:Connection startElement="structure" startConnector="{sensor}_velocity"
        endElement="controller" endConnector="velocity"/>
      <ssd:Connection startElement="controller" startConnector="acceleration"
        endElement="structure" endConnector="base_acceleration"/>
    </ssd:Connections>
  </ssd:System>
  <ssd:Units>
    <ssc:Unit name="m/s2"><ssc:BaseUnit m="1" s="-2"/></ssc:Unit>
    <ssc:Unit name="m/s"><ssc:BaseUnit m="1" s="-1"/></ssc:Unit>
    <ssc:Unit name="m"><ssc:BaseUnit m="1"/></ssc:Unit>
  </ssd:Units>
</ssd:SystemStructureDescription>
"""

PARAMETERS = """<?xml version="1.0" encoding="UTF-8"?>
<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0" name="{name}">
  <ssv:Parameters>
{rows}
  </ssv:Parameters>
</ssv:ParameterSet>
"""


def parameter_set(name: str, values: dict[str, float]) -> str:
    """The text of an .ssv file."""
    rows = [
        f'    <ssv:Parameter name="{key}"><ssv:Real value="{value!r}"/></ssv:Parameter>'
        for key, value in values.items()
    ]
    return PARAMETERS.format(name=name, rows="\n".join(rows))


def make_ssp(unit: Path, sensor: str, out: Path, values: dict[str, float]) -> Path:
    """Write the SSP; ``values`` are the parameters of closed.ssv by path, e.g. "controller.gain"."""
    with tempfile.TemporaryDirectory() as folder:
        controller = FmuBuilder.build_FMU(HERE / "velocity_feedback.py", dest=Path(folder) / "controller.fmu")
        contents = {
            "SystemStructure.ssd": STRUCTURE.format(sensor=sensor).encode(),
            "closed.ssv": parameter_set("closed", values).encode(),
            "open.ssv": parameter_set("open", {**values, "controller.gain": 0.0}).encode(),
            "resources/structure.fmu": unit.read_bytes(),
            "resources/controller.fmu": Path(controller).read_bytes(),
        }
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in contents.items():
            archive.writestr(name, content)
    return out


if __name__ == "__main__":
    unit_, sensor_, out_ = sys.argv[1:]
    burst = {"controller.burst_level": 20.0, "controller.burst_frequency": 100.0, "controller.burst_end": 0.02}
    print(make_ssp(Path(unit_), sensor_, Path(out_), {"controller.gain": -20.0, **burst}))
