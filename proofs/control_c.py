"""Checks of an exported controller by tools that know nothing of forklift: compilers, Frama-C, cppcheck,
QEMU."""

import os
import re
import shutil
import subprocess
from collections.abc import Iterable
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
EVA_MAIN = "forklift_control_eva.c"
SOURCE, TEST, HELPERS = "forklift_control.c", "forklift_control_test.c", "forklift_control_helpers.c"
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


def helpers(controller) -> list[tuple[str, int]]:  # type: ignore[no-untyped-def]
    """Every helper of two 16-bit arguments, at the shifts that occur in the exported controller."""
    header, text = controller.core.c_sources(controller.name)[:2]
    shifts = sorted({int(shift) for shift in re.findall(r"= \{ -?\d+, (\d+)U \}", text)})
    factor = int(re.findall(r"FC_FACTOR_SHIFT (\d+)U", header)[0])
    return [
        *(("times", shift) for shift in shifts),
        ("rounded", factor),
        ("truncated", factor),
        ("saturated", 0),
        ("table", 0),
        ("table", 1),
    ]


def helper_equal(  # type: ignore[no-untyped-def]
    controller, folder: Path, helper: str, number: int, first: int = -(1 << 15), last: int = 1 << 15
) -> bool:
    """Whether the C and the core agree on a helper's every answer: by default all 2^32 pairs of arguments.

    Run with the sanitizer for undefined behaviour; the addresses are those of the random states' test.
    """
    digest = controller.core.helper_digest(helper, number, first, last)
    flags = [flag for flag in STRICT if not flag.startswith("-fsanitize")]
    defines = {
        "HELPER": f"FC_{helper.upper()}",
        "SHIFT": number,
        "FIRST": f"({first})",
        "LAST": f"({last})",
        "EXPECTED": f"{digest}ULL",
    }
    given = [f"-DFC_{name}={value}" for name, value in defines.items()]
    program = f"helper_{helper}_{number}"
    _built("cc", *flags, "-O2", "-fsanitize=undefined", *given, HELPERS, "-o", program, cwd=folder)
    done = _run(f"./{program}", cwd=folder)
    if done.stderr:
        raise AssertionError(done.stderr)
    return done.returncode == 0


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
    report = _run("frama-c", *EVA, SOURCE, EVA_MAIN, cwd=folder).stdout
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


RANGED = {
    "fc_filtered_speed": {"counts": "counts", "raw": "raw"},
    "fc_order": {
        "proportional": "proportional",
        "derivative": "derivative",
        "pid": "pid",
        "wanted": "u before saturation",
        "u": "u",
        "tracked": "integral before saturation",
    },
    "fc_learn": {"trim": "trim"},
    "fc_swing": {"change": "change"},
    "fc_current": {
        "sloped": "factor before saturation",
        "factor": "factor",
        "scaled": "scaled",
        "shift": "shift",
        "order": "order before saturation",
        "__retres": "current",
    },
    "fc_tick": {
        "ramp": "ramp",
        "smooth": "smooth",
        "early": "early",
        "wanted": "wanted",
        "asked": "asked",
        "references": "reference",
        "corrections": "correction",
        "speed": "speed",
        "error": "error",
        "integral": "integral",
        "trim": "trim",
        "cosine": "cosine",
        "sine": "sine",
    },
}
"""Where the exported C has the variables of the crate's table."""


def eva_ranges(folder: Path, hints: Iterable[int]) -> dict[tuple[str, str], tuple[int, int]]:
    """What Eva says each variable of `RANGED` can be, by function and name, with the controller's own gains.

    In a copy with two annotations: by one Eva goes through the tables a segment at a time, by the other it
    tries the hints as bounds of the endless loop before it takes the whole word. It proves what it then
    prints.
    """
    copy = folder.parent / "ranged"
    shutil.copytree(folder, copy)
    text, line = (copy / SOURCE).read_text(), "    const int64_t low = "
    assert text.count(line) == 1
    (copy / SOURCE).write_text(text.replace(line, f"    /*@ split segment; */\n{line}"))
    loop, text = "    while (on != 0) {", (copy / EVA_MAIN).read_text()
    assert text.count(loop) == 1
    tried = ", ".join(str(hint) for hint in sorted(set(hints)))
    (copy / EVA_MAIN).write_text(text.replace(loop, f'    /*@ loop widen_hints "all", {tried}; */\n{loop}'))
    command = ["frama-c", *EVA, "-cpp-extra-args=-DFC_OWN_GAINS", SOURCE, EVA_MAIN]
    report = _run(*command, cwd=copy).stdout
    if not re.search(r"\b0 alarms generated", report):
        raise AssertionError(report[-2000:])
    found: dict[tuple[str, str], tuple[int, int]] = {}
    parts = re.split(r"\[eva:final-states\] Values at end of function (\w+):\n", report)
    for function, values in zip(parts[1::2], parts[2::2], strict=True):
        for name, low, high in _values(values):
            if name in RANGED.get(function, {}):
                before = found.get((function, name), (low, high))
                found[function, name] = (min(low, before[0]), max(high, before[1]))
    return found


def _values(text: str) -> list[tuple[str, int, int]]:
    """Eva's lines: a name with its interval or its set; of a structure, the last name before the interval."""
    rows = []
    for names, interval, values in re.findall(
        r"^\s*(\S.*?)\s∈\s+(?:\[(-?\d+\.\.-?\d+)\]|\{([-0-9; ]+)\})", text, re.M
    ):
        ends = interval.split("..") if interval else values.split(";")
        whole = [int(end) for end in ends]
        for name in re.findall(r"[.]?([A-Za-z_]+)(?:\[[\d.]+\])?(?=[;}]|$)", names):
            rows.append((name, min(whole), max(whole)))
    return rows


def outside_the_crates_ranges(controller, folder: Path) -> list[str]:  # type: ignore[no-untyped-def]
    """Where a range of Eva's does not lie within the crate's for that variable (the wider lift's)."""
    printed: dict[str, tuple[int, int]] = {}
    for row in controller.core.ranges():
        for name, key in ((row["variable"], "kept"), (f"{row['variable']} before saturation", "reach")):
            low, high = printed.get(name, row[key])
            printed[name] = (min(low, row[key][0]), max(high, row[key][1]))
    ranges = eva_ranges(folder, (end for row in controller.core.ranges() for end in row["kept"]))
    wanted = {(function, name) for function, names in RANGED.items() for name in names}
    if wanted - set(ranges):
        raise AssertionError(f"Eva prints no range of {sorted(wanted - set(ranges))}")
    return [
        f"{function}: {name} in {low}..{high}, not within {printed[RANGED[function][name]]}"
        for (function, name), (low, high) in sorted(ranges.items())
        if not printed[RANGED[function][name]][0] <= low <= high <= printed[RANGED[function][name]][1]
    ]


def misra(folder: Path) -> list[str]:
    """What cppcheck's add-on finds against MISRA C:2012."""
    report = _run("cppcheck", "--addon=misra", "--std=c99", "--quiet", SOURCE, cwd=folder).stderr
    return re.findall(r"^.*misra-c2012.*$", report, re.M)


def _cross(folder: Path, processor: str, name: str, defines: list[str]) -> Path:
    (folder / "start.c").write_text(START)
    (folder / "layout.ld").write_text(LAYOUT)
    flags = [f"-mcpu={processor}", "-mthumb", "-Os", "-std=gnu99", "-ffreestanding", "-nostdlib"]
    sources = ["start.c", SOURCE, TEST, "-lgcc"]
    _built("arm-none-eabi-gcc", *flags, "-T", "layout.ld", *defines, *sources, "-o", name, cwd=folder)
    return folder / name


def on_cortex(  # type: ignore[no-untyped-def]
    controller, folder: Path, processor: str, *, ticks: int, seed: int = 3
) -> bool:
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
    """What the controller needs [bytes]: flash, and RAM as static data, state (the caller's) and stack.

    The stack is the deepest path of calls within the controller's own code, by GCC's call graph.
    """
    flags = [f"-mcpu={processor}", "-mthumb", "-Os", "-std=c99", "-c", "-fcallgraph-info=su"]
    (folder / "state.c").write_text('#include "forklift_control.h"\nfc_state state;\n')
    for name in (SOURCE, "state.c"):
        _built("arm-none-eabi-gcc", *flags, name, "-o", f"{Path(name).stem}.o", cwd=folder)

    def row(name: str) -> list[int]:
        shown = _run("arm-none-eabi-size", name, cwd=folder).stdout.splitlines()[1].split()
        return [int(word) for word in shown[:3]]

    text, data, bss = row("forklift_control.o")
    return {
        "flash": text + data,
        "static": data + bss,
        "state": row("state.o")[2],
        "stack": _deepest((folder / "forklift_control.ci").read_text(), "fc_tick"),
    }


def _deepest(graph: str, start: str) -> int:
    """The deepest stack from a function on [bytes], by what `-fcallgraph-info=su` writes."""
    own: dict[str, int] = {}
    for name, stack in re.findall(r'node: \{ title: "([^"]+)".*?(?:\\n(\d+) bytes \(static\))?" ', graph):
        own[name] = int(stack or 0)
    calls: dict[str, set[str]] = {}
    for caller, callee in re.findall(r'edge: \{ sourcename: "([^"]+)" targetname: "([^"]+)"', graph):
        calls.setdefault(caller, set()).add(callee)

    def depth(name: str) -> int:
        return own.get(name, 0) + max((depth(callee) for callee in calls.get(name, ())), default=0)

    return depth(next(name for name in own if name.endswith(start)))


def instructions(  # type: ignore[no-untyped-def]
    controller, folder: Path, processor: str, *, ticks: int, seed: int = 3
) -> dict[str, float]:
    """Instructions of a tick, helpers of the compiler's library included: the mean and the most over
    random states.

    QEMU translates one instruction at a time and writes each that it runs to a log. These are instructions,
    not cycles: what one costs depends on the processor and its memory.
    """
    digest = controller.core.digest(seed, ticks)
    image = _cross(folder, processor, f"{processor}.elf", _defines(seed, ticks, digest))
    symbols = _run("arm-none-eabi-nm", image, cwd=folder).stdout
    entry = int(re.search(r"^([0-9a-f]+) T fc_tick$", symbols, re.M)[1], 16) & ~1  # type: ignore[index]
    log = folder / f"{processor}.log"
    traced = ["-singlestep", "-d", "exec,nochain", "-D", log]
    command = ["qemu-system-arm", "-machine", MACHINES[processor], "-nographic", "-semihosting", *traced]
    if _run(*command, "-kernel", image, cwd=folder).returncode:
        raise AssertionError("the traced run's digest differs")
    counts, before, left = [], 0, None
    with log.open() as lines:
        for line in lines:
            place = int(line.split("[", 1)[1].split("/")[1], 16) if line.startswith("Trace") else None
            if place is None:
                continue
            if left is None and place == entry:
                # A call has four bytes.
                left = before + 4
                counts.append(0)
            elif place == left:
                left = None
            if left is not None:
                counts[-1] += 1
            before = place
    log.unlink()
    if len(counts) != ticks:
        raise AssertionError(f"{len(counts)} calls of fc_tick in {ticks} ticks")
    return {"mean": sum(counts) / len(counts), "most": max(counts)}
