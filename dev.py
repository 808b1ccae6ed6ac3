#!/usr/bin/env python3
"""Everything there is to run, each with its own set-up: `python3 dev.py demo`, `python3 dev.py test`.

A virtual environment is made in .venv (FORKLIFT_VENV names another folder), forklift is built into it
with what the task needs, and both are used again as long as no source has changed. Needs Python 3.11 or
later and Rust; nothing is installed outside that folder and target/.
"""

import argparse
import hashlib
import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent
VENV = Path(os.environ.get("FORKLIFT_VENV") or ROOT / ".venv").absolute()
BIN = VENV / ("Scripts" if os.name == "nt" else "bin")
PYTHON = BIN / ("python.exe" if os.name == "nt" else "python")
STAMP = VENV / "forklift.json"
SPREAD = ("--numprocesses", "auto", "--dist", "loadfile")
"""Tests on all cores, those of one file on one."""


def demo():
    """build, record a simulated truck, compare it with the thesis's and say where to look"""
    install()
    out = os.path.relpath(ROOT / "demo")
    failed = run("forklift", "demo", out, cwd=None)
    if not failed:
        print(f"forklift itself is {os.path.relpath(BIN / 'forklift')}.")
    return failed


def test(*arguments):
    """all tests, of Rust and of Python, on all cores; further arguments go to pytest"""
    install("test")
    crates = ("-p", "fit_core", "-p", "hydro_core", "-p", "hydro_py")
    return max(
        run("cargo", "test", "--release", *crates, "--no-fail-fast"),
        run(PYTHON, "-m", "pytest", *SPREAD, "--durations", "25", *arguments),
    )


def lint():
    """formatting, lints and types of Rust and of Python, and the stub of the Rust core"""
    install("lint")
    return max(
        run("cargo", "fmt", "--all", "--check"),
        run("cargo", "clippy", "--workspace", "--all-targets", "--", "-D", "warnings"),
        run(PYTHON, "-m", "ruff", "check"),
        run(PYTHON, "-m", "ruff", "format", "--check"),
        run(PYTHON, "-m", "mypy"),
        run(PYTHON, "-m", "mypy.stubtest", "forklift._core"),
    )


def docs():
    """the documentation as pages, in docs/_build/html"""
    install("docs")
    failed = run(PYTHON, "-m", "sphinx", "-W", "--keep-going", "-q", "docs", "docs/_build/html")
    if not failed:
        print(f"Look at {os.path.relpath(ROOT / 'docs/_build/html/index.html')} in a browser.")
    return failed


def bench(*arguments):
    """speed, as ratios against peers of the same run; further arguments go to benches/peers/run.py"""
    install("bench")
    ours = "cargo bench --quiet --bench lowerings --"
    out = ROOT / "benches" / "measurements.md"
    return max(
        run("cargo", "bench", "--bench", "lowering"),
        run(PYTHON, "benches/peers/run.py", "--out", out, "--ours", ours, *arguments),
    )


def bench_fit(*arguments):
    """forklift's fit against what one would use instead; further arguments go to benches/estimation/run.py"""
    install("bench")
    out = ROOT / "benches" / "fits.md"
    return run(PYTHON, "benches/estimation/run.py", "--out", out, *arguments)


def coverage(*arguments):
    """do the intervals of simulated trucks hold the truth; further arguments go to proofs/coverage.py"""
    install()
    return run(PYTHON, "proofs/coverage.py", *arguments)


def starts(*arguments):
    """do scattered starts end in the same place; further arguments go to proofs/starts.py"""
    install()
    return run(PYTHON, "proofs/starts.py", *arguments)


def variations(*arguments):
    """what diagnoses say of trucks with something concealed; further arguments go to proofs/variations.py"""
    install()
    return run(PYTHON, "proofs/variations.py", *arguments)


def campaigns(*arguments):
    """are the bounds of the four simulated campaigns kept; further arguments go to proofs/campaigns.py"""
    install()
    return run(PYTHON, "proofs/campaigns.py", *arguments)


def separability(*arguments):
    """what recordings cannot part, from the second plant; further arguments go to proofs/separability.py"""
    install()
    return run(PYTHON, "proofs/separability.py", *arguments)


def sweep_intervals(*arguments):
    """do a sweep's intervals hold known probabilities; further arguments go to proofs/sweep_intervals.py"""
    install()
    return run(PYTHON, "proofs/sweep_intervals.py", *arguments)


def control(*arguments):
    """does the controller's C hold what is said of it; further arguments go to proofs/controller.py"""
    install()
    return run(PYTHON, "proofs/controller.py", *arguments)


def rigs(*arguments):
    """what diagnoses say of two rigs that others recorded; further arguments go to proofs/rigs.py"""
    install()
    return run(PYTHON, "proofs/rigs.py", *arguments)


def install(*extras):
    """Put forklift with these extras into the environment, unless what is there is still the same."""
    if not shutil.which("cargo"):
        sys.exit("dev.py: there is no cargo; install Rust (rustup.rs tells how) and run this again.")
    if not PYTHON.exists():
        make_environment()
    there = json.loads(STAMP.read_text()) if STAMP.exists() else {"source": "", "extras": []}
    source, wanted = fingerprint(), sorted({*there["extras"], *extras})
    if there == {"source": source, "extras": wanted}:
        return
    print("Building forklift and installing what it needs; the first time takes some minutes.", flush=True)
    STAMP.unlink(missing_ok=True)
    what = f"{ROOT}[{','.join(wanted)}]" if wanted else str(ROOT)
    if run(PYTHON, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", what):
        sys.exit("dev.py: forklift could not be built or installed; what is above tells why.")
    STAMP.write_text(json.dumps({"source": source, "extras": wanted}))


def make_environment():
    try:
        import ensurepip
        import venv
    except ImportError as error:
        sys.exit(
            f"dev.py: this Python lacks {error.name}, which makes virtual environments; install it "
            "(on Debian and Ubuntu: apt-get install python3-venv) and run this again."
        )
    print(f"Making the virtual environment {VENV} with Python {sys.version.split()[0]}.", flush=True)
    del ensurepip  # looked for only: without it venv fails halfway
    venv.create(VENV, with_pip=True, clear=VENV.exists())


def fingerprint():
    """A hash of every file that goes into the package, by name and content."""
    files = [ROOT / "pyproject.toml", ROOT / "Cargo.toml", ROOT / "Cargo.lock"]
    for folder in ("crates", "python"):
        files += sorted(path for path in (ROOT / folder).rglob("*") if path.is_file())
    digest = hashlib.sha256()
    for path in files:
        if path.suffix not in (".so", ".pyd", ".pyc"):
            digest.update(f"{path.relative_to(ROOT)}\0".encode() + path.read_bytes() + b"\0")
    return digest.hexdigest()


def run(*command, cwd=ROOT):
    """Run a command in the environment and give its exit status."""
    command = [str(word) for word in command]
    print("$", *(os.path.relpath(word) if os.path.isabs(word) else word for word in command), flush=True)
    environment = os.environ | {
        "VIRTUAL_ENV": str(VENV),
        "PATH": f"{BIN}{os.pathsep}{os.environ.get('PATH', '')}",
        "PYO3_PYTHON": str(PYTHON),
    }
    program = shutil.which(command[0], path=environment["PATH"]) or command[0]
    return abs(subprocess.run([program, *command[1:]], cwd=cwd, env=environment).returncode)


PROOFS = (coverage, starts, campaigns, variations, separability, rigs, sweep_intervals, control)
TASKS = (demo, test, lint, docs, bench, bench_fit, *PROOFS)
PASSED_ON = (test, bench, bench_fit, *PROOFS)
"""Tasks that take further arguments."""


def main():
    if sys.version_info < (3, 11):  # noqa: UP036  (older ones are told so)
        sys.exit(f"dev.py: this is Python {sys.version.split()[0]}; run it with Python 3.11 or later.")
    tasks = {task.__name__.replace("_", "-"): task for task in TASKS}
    parser = argparse.ArgumentParser(
        description=__doc__.splitlines()[0], epilog="\n\n".join(__doc__.split("\n\n")[1:])
    )
    commands = parser.add_subparsers(dest="task", required=True, metavar="task")
    for name, task in tasks.items():
        commands.add_parser(name, help=task.__doc__, description=task.__doc__)
    try:
        known, others = parser.parse_known_args()
        if others and tasks[known.task] not in PASSED_ON:
            parser.error(f"{known.task} takes no {' '.join(others)}")
        sys.exit(tasks[known.task](*others))
    except KeyboardInterrupt:
        sys.exit(130)


if __name__ == "__main__":
    main()
