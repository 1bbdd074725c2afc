"""An export as an FMU for co-simulation, FMI 2.0 or 3.0, with its sources and the binary of this machine."""

from __future__ import annotations

import io
import platform
import sys
import tempfile
import uuid
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Final
from xml.sax.saxutils import quoteattr

from ...envs.cues import GRAVITY
from ...envs.errors import ConfigurationError
from ...envs.storage import write_bytes
from .check import run_compiler
from .fmu_code import WRAPPERS, wrapper_code
from .source import Signal, Source, write_files

_LIBRARIES: Final = {"linux": ".so", "darwin": ".dylib", "win32": ".dll"}

_UNITS: Final = {
    "m": {"m": 1},
    "m/s": {"m": 1, "s": -1},
    "m/s^2": {"m": 1, "s": -2},
    "rad": {"rad": 1},
    "rad/s": {"rad": 1, "s": -1},
    "rad/s^2": {"rad": 1, "s": -2},
}
"""Exponents of the base units."""

_LINEAR: Final = 5
"""Of the nine axes, the first ones move along lines."""


def write_fmu(source: Source, path: Path, version: int = 2) -> None:
    """Compile an export and write it as an FMU.

    Args:
        source: The export.
        path: File to write; its name ends in .fmu.
        version: 2 or 3, of the FMI standard.

    Raises:
        CompilerError: there is no C compiler, or it fails.
        ConfigurationError: the standard's version is another one.
    """
    if version not in WRAPPERS:
        raise ConfigurationError(f"fmi must be one of {', '.join(map(str, WRAPPERS))}, found {version}")
    code = wrapper_code(source, version)
    token = str(uuid.uuid5(uuid.NAMESPACE_URL, source.header + source.code + code))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        files = [*write_files(source, folder), folder / "fmu.c"]
        files[-1].write_text(code.replace("@TOKEN@", token), encoding="utf-8")
        library = folder / f"{source.name}{_LIBRARIES.get(sys.platform, '.so')}"
        sources = [str(one) for one in files if one.suffix == ".c"]
        run_compiler(
            [
                "-std=c99",
                "-O3",
                "-shared",
                "-fPIC",
                "-fvisibility=hidden",
                "-o",
                str(library),
                *sources,
                "-lm",
            ]
        )
        packed = {
            "modelDescription.xml": _description(source, token, version).encode(),
            f"binaries/{_folder(version)}/{library.name}": library.read_bytes(),
            **{f"sources/{one.name}": one.read_bytes() for one in files},
        }
    if version == 3:
        packed["sources/buildDescription.xml"] = _build_description(source).encode()
    write_bytes(path, _zipped(packed))


def _zipped(files: dict[str, bytes]) -> bytes:
    """An archive whose bytes depend on its content alone."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), content, zipfile.ZIP_DEFLATED)
    return buffer.getvalue()


def _folder(version: int) -> str:
    """Where an FMU holds the binary of this machine."""
    system = {"linux": "linux", "darwin": "darwin", "win32": "windows"}.get(sys.platform, sys.platform)
    arm = platform.machine().lower() in ("aarch64", "arm64")
    if version == 2 and not arm:
        return {"linux": "linux64", "darwin": "darwin64", "windows": "win64"}.get(system, system)
    return f"{'aarch64' if arm else 'x86_64'}-{system}"


def _description(source: Source, token: str, version: int) -> str:
    """``modelDescription.xml``."""
    variables = list(_variables(source))
    step = repr(source.time_step)
    units = [
        f'    <Unit name="{name}"><BaseUnit {" ".join(f"{k}={str(v)!r}" for k, v in base.items())}/></Unit>'
        for name, base in _UNITS.items()
    ]
    common = (
        f"modelName={quoteattr(source.name)} description={quoteattr(source.about)} "
        f'generationTool="Motion Cueing Gym" variableNamingConvention="structured"'
    )
    files = ["fmu.c", f"{source.name}.c"]
    if version == 2:
        listed = "".join(f'<File name="{name}"/>' for name in files)
        lines = [
            f'<fmiModelDescription fmiVersion="2.0" guid="{token}" {common}>',
            f'  <CoSimulation modelIdentifier="{source.name}" canHandleVariableCommunicationStepSize="false" '
            'canGetAndSetFMUstate="true" canInterpolateInputs="false">',
            f"    <SourceFiles>{listed}</SourceFiles>",
            "  </CoSimulation>",
        ]
    else:
        lines = [
            f'<fmiModelDescription fmiVersion="3.0" instantiationToken="{token}" {common}>',
            f'  <CoSimulation modelIdentifier="{source.name}" canHandleVariableCommunicationStepSize="false" '
            f'canGetAndSetFMUState="true" fixedInternalStepSize="{step}"/>',
        ]
    lines += ["  <UnitDefinitions>", *units, "  </UnitDefinitions>"]
    lines.append(f'  <DefaultExperiment startTime="0.0" stopTime="10.0" stepSize="{step}"/>')
    lines += ["  <ModelVariables>", *(_variable(k, version, *one) for k, one in enumerate(variables))]
    if version == 3:
        lines.append(
            f'    <Float64 name="time" valueReference="{len(variables)}" causality="independent" '
            'variability="continuous"/>'
        )
    lines.append("  </ModelVariables>")
    outputs = [k for k, (_, _, given) in enumerate(variables) if not given]
    lines += ["  <ModelStructure>", *_structure(outputs, version), "  </ModelStructure>"]
    return "\n".join(['<?xml version="1.0" encoding="UTF-8"?>', *lines, "</fmiModelDescription>"]) + "\n"


def _structure(outputs: list[int], version: int) -> list[str]:
    if version == 3:
        names = ("Output", "InitialUnknown")
        return [f'    <{name} valueReference="{k}"/>' for name in names for k in outputs]
    unknown = [f'      <Unknown index="{k + 1}"/>' for k in outputs]
    initial = ["    <InitialUnknowns>", *unknown, "    </InitialUnknowns>"]
    return ["    <Outputs>", *unknown, "    </Outputs>", *initial]


def _variables(source: Source) -> Iterator[tuple[Signal, int, bool]]:
    """Signal, entry of it, and whether it is an input, of every variable by its value reference."""
    for given, signals in ((True, source.inputs), (False, source.outputs)):
        for one in signals:
            for k in range(one.size):
                yield one, k, given


def _variable(reference: int, version: int, signal: Signal, entry: int, given: bool) -> str:
    """A variable's element of the description."""
    name = signal.name if signal.size == 1 else f"{signal.name}[{entry + 1}]"
    about = quoteattr(signal.about)
    linear, _, angular = signal.unit.partition(", ")
    unit = angular if angular and entry >= _LINEAR else linear
    attributes = f' unit="{unit}"' if unit in _UNITS else ""
    if given:
        # The cues of a car that stands.
        start = -GRAVITY if signal.name.startswith("force") and entry == 2 else 0.0
        attributes += f' start="{start}"'
    causality = "input" if given else "output"
    head = f'name="{name}" valueReference="{reference}" causality="{causality}" description={about}'
    if version == 3:
        return f'    <Float64 {head} variability="continuous"{attributes}/>'
    return f"    <ScalarVariable {head}><Real{attributes}/></ScalarVariable>"


def _build_description(source: Source) -> str:
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n<fmiBuildDescription fmiVersion="3.0">\n'
        f'  <BuildConfiguration modelIdentifier="{source.name}">\n    <SourceFileSet language="C99">\n'
        f'      <SourceFile name="fmu.c"/>\n      <SourceFile name="{source.name}.c"/>\n'
        "    </SourceFileSet>\n  </BuildConfiguration>\n</fmiBuildDescription>\n"
    )
