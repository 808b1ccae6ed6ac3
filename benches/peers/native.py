"""Builds the peers written in C and runs one of them over a file of lowerings."""

import os
import subprocess
from pathlib import Path

import numpy as np
from lowerings import read_trajectories

HERE = Path(__file__).parent
C = ["gcc", "-std=gnu11", "-O3", "-march=native"]
FORTRAN = ["gfortran", "-w", "-std=legacy", "-O3", "-march=native"]
SUNDIALS = ["cvode", "nvecserial", "sunlinsoldense", "sunmatrixdense"]


def build_lift(folder: Path) -> Path:
    """The right-hand side and Jacobian as a shared library."""
    library = folder / "free_lift.so"
    _run([*C, "-shared", "-fPIC", str(HERE / "free_lift.c"), "-o", str(library), "-lm"])
    return library


def build_cvode(folder: Path, source: Path | None) -> Path:
    """CVODE of SUNDIALS 6 or 7, from its source with full optimisation, or else the system's."""
    return _with_sundials(folder, source, "cvode.c", folder / "cvode")


def build_lift_cvode(folder: Path, source: Path | None) -> Path:
    """The same CVODE on one lift with any parameters, as a shared library."""
    return _with_sundials(folder, source, "lift_cvode.c", folder / "lift_cvode.so", "-shared", "-fPIC")


def _with_sundials(folder: Path, source: Path | None, file: str, out: Path, *options: str) -> Path:
    command = [*C, *options, str(HERE / file), "-o", str(out)]
    if source:
        prefix = _build_sundials(folder, source)
        core = "core" if (prefix / "lib/libsundials_core.a").exists() else "generic"
        archives = [str(prefix / f"lib/libsundials_{name}.a") for name in [*SUNDIALS, core]]
        _run([*command, f"-I{prefix}/include", *archives, "-lm"])
    else:
        _run([*command, *(f"-lsundials_{name}" for name in SUNDIALS), "-lm"])
    return out


def _build_sundials(folder: Path, source: Path) -> Path:
    prefix, build = folder / "sundials", folder / "sundials-build"
    if not prefix.exists():
        off = [f"-DBUILD_{name}=OFF" for name in ("SHARED_LIBS", "ARKODE", "CVODES", "IDA", "IDAS", "KINSOL")]
        off += [f"-DEXAMPLES_{name}=OFF" for name in ("ENABLE_C", "ENABLE_CXX", "INSTALL")]
        options = ["-DCMAKE_BUILD_TYPE=Release", "-DCMAKE_C_FLAGS_RELEASE=-O3 -march=native -DNDEBUG"]
        options.append("-DCMAKE_POSITION_INDEPENDENT_CODE=ON")
        where = [
            f"-DCMAKE_INSTALL_PREFIX={prefix}",
            "-DCMAKE_INSTALL_LIBDIR=lib",
            "-DSUNDIALS_LOGGING_LEVEL=0",
        ]
        _run(["cmake", "-S", str(source), "-B", str(build), *options, *where, *off])
        _run(["cmake", "--build", str(build), "--target", "install"])
    return prefix


def build_radau(folder: Path, source: Path) -> Path:
    """RADAU of Hairer and Wanner; `source` holds radau.f, decsol.f and dc_decsol.f."""
    objects = []
    for name in ("radau", "decsol", "dc_decsol"):
        objects.append(str(folder / f"{name}.o"))
        _run([*FORTRAN, "-c", str(source / f"{name}.f"), "-o", objects[-1]])
    program = folder / "radau"
    _run([*C, str(HERE / "radau.c"), *objects, "-o", str(program), "-lgfortran", "-lm"])
    return program


def integrate(command: list[str], lowerings: Path, options: dict[str, float]) -> tuple[np.ndarray, float]:
    """Run `command LOWERINGS TRAJECTORIES name=value ...`; trajectories and seconds of all lowerings."""
    out = lowerings.with_suffix(".out")
    _run([*command, str(lowerings), str(out), *(f"{name}={value!r}" for name, value in options.items())])
    return read_trajectories(out)


def _run(command: list[str]) -> None:
    env = os.environ | {"OMP_NUM_THREADS": "1", "RAYON_NUM_THREADS": "1"}
    done = subprocess.run(command, env=env, capture_output=True, text=True, check=False)
    if done.returncode:
        raise SystemExit(f"{' '.join(command)}\n{done.stderr}")
