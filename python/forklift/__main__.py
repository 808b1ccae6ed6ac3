"""``python -m forklift``: the command line, which answers Ctrl-C in one sentence while it still loads."""

from __future__ import annotations

import sys


def main() -> None:
    """`forklift.app.main.main`, loaded under guard."""
    try:
        from forklift.app import main as cli
    except KeyboardInterrupt:
        print("forklift: interrupted; nothing was left half-written.", file=sys.stderr)
        sys.exit(130)
    cli.main()


if __name__ == "__main__":
    main()
