"""What making a campaign takes besides this package."""

from __future__ import annotations

import shutil
from importlib.util import find_spec

from forklift.base.errors import ForkliftError
from forklift.base.extras import how_to_install


def compiler() -> str:
    """The machine's C compiler.

    Raises
    ------
    ForkliftError
        ``"compiler-missing"``.
    """
    found = next(filter(None, map(shutil.which, ("cc", "gcc", "clang"))), None)
    if found is None:
        raise ForkliftError(
            "compiler-missing",
            "what a proof conceals is compiled, and no C compiler (cc, gcc, clang) is on the path; "
            "install one (on Debian and Ubuntu: apt-get install gcc libc6-dev)",
        )
    return found


def check_tools() -> None:
    """Whether campaigns can be made here.

    Raises
    ------
    ForkliftError
        ``"extra-missing"`` without CasADi, ``"compiler-missing"`` without a C compiler.
    """
    if find_spec("casadi") is None:
        raise ForkliftError(
            "extra-missing",
            f"a proof needs CasADi; install it with {how_to_install('proof', 'casadi')}",
            extra="proof",
            module="casadi",
        )
    compiler()
