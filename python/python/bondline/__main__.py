"""The command ``bondline``."""

import signal
import sys

from bondline._bondline import run_command


def main() -> int:
    """Run the command with the words of the command line, and return its exit code."""
    # The command stops a study itself; until then Ctrl-C ends the process, as it does without Python.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    return run_command(["bondline", *sys.argv[1:]])


if __name__ == "__main__":
    sys.exit(main())
