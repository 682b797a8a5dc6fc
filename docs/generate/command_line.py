"""Write docs/reference/command-line.md from clap's help: command_line.py PROGRAM."""

import subprocess
import sys
from pathlib import Path

INTRODUCTION = """\
# Command line

<!-- Written by docs/generate/command_line.py from the program's help. To renew: scripts/docs.sh --renew. -->

Results go to standard output, progress and error messages to standard error. Progress is shown on a terminal only.

| exit code | meaning |
|---|---|
| 0 | The command did what it was asked to do. |
| 1 | It failed: no convergence, failed members, a failed check, an [unusable](outputs.md) result, or no report. |
| 2 | The input is wrong: command line, case file, material file, output folder of another case. Nothing is written. |
| 3 | The device failed, or there is none of the kind asked for. |
"""


def help_of(program: str, words: list[str]) -> str:
    done = subprocess.run([program, *words, "--help"], capture_output=True, text=True, check=True)
    return "\n".join(line.rstrip() for line in done.stdout.splitlines()) + "\n"


def subcommands(text: str) -> list[str]:
    listed = text.partition("\nCommands:\n")[2].partition("\n\n")[0]
    names = [line.split()[0] for line in listed.splitlines() if line.startswith("  ") and line[2] != " "]
    return [name for name in names if name != "help"]


def sections(program: str, words: list[str]) -> list[str]:
    text = help_of(program, words)
    name = " ".join(["bondline", *words])
    own = f"\n## {name}\n\n```console\n$ {name} --help\n{text}```\n"
    return [own] + [part for word in subcommands(text) for part in sections(program, [*words, word])]


page = Path(__file__).parent.parent / "reference" / "command-line.md"
page.write_text(INTRODUCTION + "".join(sections(sys.argv[1], [])))
