"""Checks of an exported controller by tools that know nothing of forklift: compilers, Frama-C, cppcheck,
QEMU."""

import os
import re
import shutil
import subprocess
from pathlib import Path

STRICT = [
    "-std=c99",
    "-O1",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Werror",
    "-fsanitize=undefined,address",
    "-fno-sanitize-recover=all",
]
EVA = ["-eva", "-eva-precision", "3", "-warn-signed-downcast", "-warn-signed-overflow"]
MACHINES = {"cortex-m0": "microbit", "cortex-m4": "mps2-an386"}
SOURCE, TEST = "forklift_control.c", "forklift_control_test.c"
CLAMP = "fc_saturated(tracked, FC_MOST_SPEED * FC_INTEGRAL_ONE); /* integrator's clamp */"

START = """
extern int main(void);
static void leave(int how)
{
    register int operation __asm__("r0") = 0x18;
    register int reason __asm__("r1") = how;
    __asm__ volatile("bkpt 0xab" : : "r"(operation), "r"(reason) : "memory");
}
void begin(void);
__attribute__((section(".vectors"), used)) void (*const vectors[2])(void) = { (void (*)(void))0x20004000,
begin };
void begin(void)
{
    leave((main() == 0) ? 0x20026 : 0x20023);
    for (;;) { }
}
"""
"""Start-up of a Cortex-M without a C library; it leaves by semihosting, with the status of main."""
LAYOUT = """
SECTIONS {
    . = 0x0;
    .text : { KEEP(*(.vectors)) *(.text*) *(.rodata*) *(.ARM.*) *(.data*) }
    . = 0x20000000;
    .bss : { *(.bss*) *(COMMON) }
}
"""


def missing(*tools: str) -> list[str]:
    """Those that are not installed."""
    return [tool for tool in tools if not shutil.which(tool)]


def _run(*command: str | Path, cwd: Path) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"PWD": str(cwd)}  # Frama-C believes it rather than the system
    return subprocess.run(
        [str(c) for c in command], cwd=cwd, env=environment, capture_output=True, text=True, check=False
    )


def _built(*command: str | Path, cwd: Path) -> None:
    done = _run(*command, cwd=cwd)
    if done.returncode:
        raise AssertionError(done.stderr)


def _defines(seed: int, ticks: int, digest: int) -> list[str]:
    return [f"-DFC_SEED={seed}ULL", f"-DFC_TICKS={ticks}U", f"-DFC_EXPECTED={digest}ULL"]


def run_test(folder: Path, *, seed: int, ticks: int, digest: int) -> bool:
    """Whether the C's digest is this one, with sanitizers that stop at undefined behaviour."""
    _built("cc", *STRICT, *_defines(seed, ticks, digest), SOURCE, TEST, "-o", "test", cwd=folder)
    done = _run("./test", cwd=folder)
    if done.stderr:
        raise AssertionError(done.stderr)
    return done.returncode == 0


def equal(controller, folder: Path, *, seed: int, ticks: int) -> bool:  # type: ignore[no-untyped-def]
    """Whether the C and the core agree on every bit of so many ticks from random states."""
    digest = controller.core.digest(seed, ticks)
    return run_test(folder, seed=seed, ticks=ticks, digest=digest)


def coverage(folder: Path) -> dict[str, float]:
    """Lines and branches of the C that the exported test runs through [%]."""
    _built("gcc", "-std=c99", "-O0", "--coverage", SOURCE, TEST, "-o", "covered", cwd=folder)
    _run("./covered", cwd=folder)
    report = _run("gcov", "-b", "-c", "covered-forklift_control.c", cwd=folder).stdout
    own = report.split(f"File '{SOURCE}'")[1].split("File '")[0]
    rows = re.findall(r"^(Lines executed|Taken at least once):([0-9.]+)%", own, re.M)
    return {name: float(share) for name, share in rows}


def alarms(folder: Path) -> int:
    """How many alarms Frama-C's Eva raises on endless ticks over every reading and request."""
    report = _run("frama-c", *EVA, SOURCE, "forklift_control_eva.c", cwd=folder).stdout
    found = re.search(r"(\d+) alarms? generated", report)
    if not found:
        raise AssertionError(report[-2000:])
    return int(found[1])


def without_clamp(folder: Path) -> Path:
    """A copy of the C whose integrator is not clamped."""
    copy = folder.parent / "without_clamp"
    shutil.copytree(folder, copy)
    text = (copy / SOURCE).read_text()
    assert text.count(CLAMP) == 1
    (copy / SOURCE).write_text(text.replace(CLAMP, "tracked;"))
    return copy


def misra(folder: Path) -> list[str]:
    """What cppcheck's add-on finds against MISRA C:2012."""
    report = _run("cppcheck", "--addon=misra", "--std=c99", "--quiet", SOURCE, cwd=folder).stderr
    return re.findall(r"^.*misra-c2012.*$", report, re.M)


def _cross(folder: Path, processor: str, name: str, defines: list[str]) -> Path:
    (folder / "start.c").write_text(START)
    (folder / "layout.ld").write_text(LAYOUT)
    flags = [f"-mcpu={processor}", "-mthumb", "-Os", "-std=gnu99", "-ffreestanding", "-nostartfiles"]
    sources = ["start.c", SOURCE, TEST, "-lgcc"]
    _built("arm-none-eabi-gcc", *flags, "-T", "layout.ld", *defines, *sources, "-o", name, cwd=folder)
    return folder / name


def on_cortex(controller, folder: Path, processor: str, *, ticks: int, seed: int = 3) -> bool:  # type: ignore[no-untyped-def]
    """Whether the C on an emulated processor agrees with the core, and refuses a wrong digest."""
    answers = []
    digest = controller.core.digest(seed, ticks)
    for wanted in (digest, digest ^ 1):
        image = _cross(folder, processor, f"{processor}.elf", _defines(seed, ticks, wanted))
        command = [
            "qemu-system-arm",
            "-machine",
            MACHINES[processor],
            "-nographic",
            "-semihosting",
            "-kernel",
        ]
        answers.append(_run(*command, image, cwd=folder).returncode == 0)
    return answers == [True, False]


def size(folder: Path, processor: str) -> dict[str, int]:
    """Flash and RAM of the controller alone [bytes]; its state is the caller's."""
    flags = [f"-mcpu={processor}", "-mthumb", "-Os", "-std=c99", "-c"]
    _built("arm-none-eabi-gcc", *flags, SOURCE, "-o", "alone.o", cwd=folder)
    row = _run("arm-none-eabi-size", "alone.o", cwd=folder).stdout.splitlines()[1].split()
    return {"flash": int(row[0]) + int(row[1]), "ram": int(row[1]) + int(row[2])}
