"""modelDescription.xml, its identifier and the documentation page."""

from __future__ import annotations

import hashlib
import math
import os
import uuid
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime

import numpy as np

import romgen
from romgen.errors import InputError
from romgen.etdrk4 import largest_step
from romgen.fmu.interface import FmuInterface
from romgen.fmu.records import FmuInfo
from romgen.fmu.templates import render
from romgen.fmu.units import unit_of
from romgen.reduced_model import ReducedModel

NATIVE_INTERFACES = {
    "ModelExchange": {
        "needsExecutionTool": "false",
        "completedIntegratorStepNotNeeded": "false",
        "canBeInstantiatedOnlyOncePerProcess": "false",
        "canNotUseMemoryManagementFunctions": "true",
        "canGetAndSetFMUstate": "true",
        "canSerializeFMUstate": "true",
        "providesDirectionalDerivative": "true",
    },
    "CoSimulation": {
        "needsExecutionTool": "false",
        "canHandleVariableCommunicationStepSize": "true",
        "canInterpolateInputs": "true",
        "maxOutputDerivativeOrder": "1",
        "canRunAsynchronuously": "false",
        "canBeInstantiatedOnlyOncePerProcess": "false",
        "canNotUseMemoryManagementFunctions": "true",
        "canGetAndSetFMUstate": "true",
        "canSerializeFMUstate": "true",
        "providesDirectionalDerivative": "true",
    },
}
"""Capabilities of the C runtime by interface."""

PYTHON_INTERFACES = {
    "CoSimulation": {
        "needsExecutionTool": "true",
        "canHandleVariableCommunicationStepSize": "true",
        "canInterpolateInputs": "false",
        "canBeInstantiatedOnlyOncePerProcess": "false",
        "canNotUseMemoryManagementFunctions": "true",
        "canGetAndSetFMUstate": "false",
        "canSerializeFMUstate": "false",
    },
}
"""Capabilities of a pythonfmu unit: it needs a Python interpreter with numpy on the target."""

NAMESPACE = uuid.uuid5(uuid.NAMESPACE_URL, "https://fmi-standard.org/romgen")

DEFAULT_EPOCH = 315532800
"""1980-01-01, used when SOURCE_DATE_EPOCH is not set, so that the same model gives the same bytes."""


@dataclass(frozen=True)
class DescriptionText:
    """The head of a description: names, texts and capabilities.

    Attributes
    ----------
    name : model identifier.
    tool : generation tool.
    info : texts.
    step_size : s, of the default experiment.
    interfaces : attributes by interface element.
    source_files : C files, or () without sources.
    version : of FMI.
    """

    name: str
    tool: str
    info: FmuInfo
    step_size: float
    interfaces: Mapping[str, Mapping[str, str]]
    source_files: tuple[str, ...] = ()
    version: str = "2.0"


def tool_name() -> str:
    """Name and version written as generation tool."""
    return f"romgen {romgen.__version__}"


def generation_time() -> str:
    """SOURCE_DATE_EPOCH as FMI writes times, ending in Z."""
    given = os.environ.get("SOURCE_DATE_EPOCH", str(DEFAULT_EPOCH))
    if not given.isdecimal():
        advice = "give seconds since 1970, or unset it"
        raise InputError("no time", where="environment variable SOURCE_DATE_EPOCH", value=given, advice=advice)
    epoch = int(given)
    return datetime.fromtimestamp(epoch, UTC).strftime("%Y-%m-%dT%H:%M:%SZ")


def content_guid(*contents: str | bytes) -> str:
    """UUID5 of the SHA-256 of everything that defines the unit, in braces."""
    digest = hashlib.sha256()
    for content in contents:
        data = content.encode() if isinstance(content, str) else content
        digest.update(len(data).to_bytes(8, "little") + data)
    return f"{{{uuid.uuid5(NAMESPACE, digest.hexdigest())}}}"


def model_description(text: DescriptionText, interface: FmuInterface, *, guid: str, date: str) -> str:
    """The text of modelDescription.xml."""
    names = sorted({v.unit for v in interface.variables if v.unit is not None})
    return render(
        "modelDescription.xml.j2",
        name=text.name,
        info=text.info,
        guid=guid,
        date=date,
        tool=text.tool,
        step_size=repr(text.step_size),
        interfaces=text.interfaces,
        source_files=text.source_files,
        units=[unit_of(name) for name in names],
        unit_of=unit_of,
        variables=interface.variables,
        structure=(
            ("Outputs", interface.outputs),
            ("Derivatives", interface.derivatives),
            ("InitialUnknowns", interface.initial_unknowns),
        ),
    )


def documentation_page(model: ReducedModel, interface: FmuInterface, text: DescriptionText) -> str:
    """The text of documentation/index.html: origin, range, errors, variables, step advice."""
    omega = np.abs(model.eigenvalues)
    zeta = -model.eigenvalues.real / omega
    f_max = float(np.max(model.eigenvalues.imag)) / (2.0 * math.pi)
    modes = [
        {"frequency": float(w) / (2.0 * math.pi), "damping": float(d), "amplitude": float(a)}
        for w, d, a in zip(omega, zeta, model.trained_amplitude, strict=True)
    ]
    return render(
        "index.html.j2",
        name=model.name,
        info=text.info,
        tool=text.tool,
        version=text.version,
        is_native="ModelExchange" in text.interfaces,
        modes=modes,
        order=int(np.max(np.sum(model.displacement.exponents, axis=1))),
        variables=interface.variables,
        hold_percent=100.0 * math.pi * f_max * 1e-5,
        f_max=f_max,
        max_step=repr(largest_step(model.eigenvalues)),
        euler_limit=float(np.min(2.0 * zeta / omega)),
    )
