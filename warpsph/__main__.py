"""The command `warpsph`, and `python -m warpsph`: what is heavy is imported when Ctrl-C is answered already."""

import os
import signal
import sys


def main() -> int:
    """Run the command of `sys.argv`; returns its exit status."""
    from .cli.main import main as command  # which answers Ctrl-C itself, while it is at work

    return command()


def _leave(number: int, frame: object) -> None:
    """End at once: in the midst of an import there is nothing to keep, and an error would end as a traceback."""
    os.write(2, b"warpsph: interrupted\n")
    os._exit(128 + number)


# As this file is read, which only the command does: between that and the call of `main` Ctrl-C is answered too.
if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else it is ignored, as in the background
    signal.signal(signal.SIGINT, _leave)

if __name__ == "__main__":
    sys.exit(main())
