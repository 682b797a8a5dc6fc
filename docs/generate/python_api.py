"""Renew docs/reference/python.md from the docstrings of the Python package, in NumPy style.

    python_api.py [--check]

With --check nothing is written, and the exit code is 1 where the page is out of date. The sources are parsed and not
imported, so that no wheel is needed.
"""

import ast
import inspect
import re
import sys
import textwrap
from pathlib import Path

ROOT = Path(__file__).parents[2]
PACKAGE = ROOT / "python" / "python" / "bondline"
PAGE = ROOT / "docs" / "reference" / "python.md"
HEAD = """# Python package

<!-- Written by docs/generate/python_api.py from the docstrings. To renew: scripts/docs.sh --renew. -->

The public names of the package `bondline`; [](../how-to/use-python.md) shows their use. An array is a NumPy array of
float64 in C order.
"""
#: Modules that are imported by their own names.
MODULES = ["bondline.dask"]
COLUMNS = 120


def inline(text):
    """Roles and literals of reStructuredText as code of Markdown."""
    text = re.sub(r":\w+:`~?\.?([^`]+)`", lambda found: f"`{found[1].removeprefix('bondline.')}`", text)
    return text.replace("``", "`")


def filled(text, indent=""):
    """A paragraph, wrapped; code is not broken."""
    words = re.findall(r"(?:`[^`]*`|\S)+", inline(text))
    lines, line = [], indent
    for word in words:
        if len(line) + len(word) + (line != indent) > COLUMNS:
            lines.append(line)
            line = " " * len(indent)
        line += word if line.strip() in ("", ":") else f" {word}"
    return "\n".join([*lines, line]) if line.strip() else "\n".join(lines)


def sections(docstring):
    """The description, and the sections with an underlined heading: name and lines."""
    lines = inspect.cleandoc(docstring).splitlines()
    found = [("", [])]
    place = 0
    while place < len(lines):
        if place + 1 < len(lines) and lines[place] and set(lines[place + 1]) == {"-"}:
            found.append((lines[place], []))
            place += 2
            continue
        found[-1][1].append(lines[place])
        place += 1
    return found


def paragraphs(lines):
    """Paragraphs as texts."""
    return [" ".join(part.split()) for part in "\n".join(lines).split("\n\n") if part.strip()]


def entries(lines):
    """Entries of a section: a name, and the indented description below it."""
    found = []
    for line in lines:
        if line and not line.startswith(" "):
            found.append((line, []))
        elif found:
            found[-1][1].append(line.strip())
    return found


def described(node, where):
    """The docstring of a class or function in Markdown."""
    docstring = ast.get_docstring(node)
    if not docstring:
        raise SystemExit(f"{where} has no docstring")
    parts = []
    for heading, lines in sections(docstring):
        if not heading:
            parts += [filled(paragraph) for paragraph in paragraphs(lines)]
            continue
        parts.append(f"**{heading}**")
        for name, text in entries(lines):
            names = ", ".join(f"`{part}`" for part in name.split(", ")) if heading != "Returns" else inline(name)
            texts = [filled(paragraph, ": " if not place else "  ") for place, paragraph in enumerate(paragraphs(text))]
            parts.append(names + ("\n" + "\n\n".join(texts) if texts else ""))
    return "\n\n".join(parts)


def call(name, function, is_method):
    """The call in a block, without annotations: `march(points, progress=False)`."""
    arguments = function.args
    positional = [*arguments.posonlyargs, *arguments.args]
    defaults = [None] * (len(positional) - len(arguments.defaults)) + arguments.defaults
    words = [
        argument.arg + (f"={ast.unparse(default)}" if default is not None else "")
        for argument, default in zip(positional, defaults)
    ][1 if is_method else 0 :]
    if arguments.vararg:
        words.append(f"*{arguments.vararg.arg}")
    elif arguments.kwonlyargs:
        words.append("*")
    words += [
        argument.arg + (f"={ast.unparse(default)}" if default is not None else "")
        for argument, default in zip(arguments.kwonlyargs, arguments.kw_defaults)
    ]
    if arguments.kwarg:
        words.append(f"**{arguments.kwarg.arg}")
    line = f"{name}({', '.join(words)})"
    if len(line) > COLUMNS:
        body = textwrap.fill(", ".join(words), COLUMNS, initial_indent="    ", subsequent_indent="    ")
        line = f"{name}(\n{body}\n)"
    return f"```text\n{line}\n```"


def heading(level, code):
    return f"{'#' * level} `{code}`"


def decorators(node):
    return {ast.unparse(decorator).split(".")[-1] for decorator in node.decorator_list}


def members(node):
    """Public methods and properties of a class, in the order of the source."""
    return [
        member
        for member in node.body
        if isinstance(member, ast.FunctionDef) and not member.name.startswith("_")
    ]


def of_class(node):
    bases = [ast.unparse(base) for base in node.bases]
    parts = [heading(2, node.name), described(node, node.name)]
    if bases:
        parts.append(f"Has all of {', '.join(f'`{base}`' for base in bases)}.")
    for member in members(node):
        where = f"{node.name}.{member.name}"
        is_property = decorators(member) & {"property", "cached_property"}
        parts.append(heading(3, where))
        if not is_property:
            caller = node.name if "classmethod" in decorators(member) else node.name.lower()
            parts.append(call(f"{caller}.{member.name}", member, True))
        parts.append(described(member, where))
    return "\n\n".join(parts)


def of_function(node, module, level):
    name = f"{module}.{node.name}"
    return "\n\n".join([heading(level, name), call(name, node, False), described(node, name)])


def tree(path):
    return ast.parse(path.read_text(encoding="utf-8"), path.name)


def exported(module):
    """Names of ``__all__``."""
    for node in module.body:
        if isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            return ast.literal_eval(node.value)
    raise SystemExit("no __all__")


def exceptions():
    """The exceptions, which are declared in Rust: name, base class and meaning."""
    text = (ROOT / "python" / "src" / "errors.rs").read_text(encoding="utf-8")
    found = re.findall(r'create_exception!\(bondline, (\w+), (?:Py)?(\w+), "([^"]+)"\)', text)
    return {name: f"{heading(2, name)}\n\n{filled(meaning)} Derived from `{base}`." for name, base, meaning in found}


def page():
    package = tree(PACKAGE / "__init__.py")
    nodes = {
        node.name: node
        for path in [PACKAGE / "_case.py", PACKAGE / "_results.py", PACKAGE / "__init__.py"]
        for node in tree(path).body
        if isinstance(node, (ast.ClassDef, ast.FunctionDef))
    }
    raised = exceptions()
    parts = [HEAD.rstrip(), filled(" ".join(paragraphs((ast.get_docstring(package) or "").splitlines())))]
    order = sorted(exported(package), key=lambda name: (name in raised, name != "Case", name != "study", name))
    for name in order:
        if name in raised:
            parts.append(raised[name])
        elif name in nodes:
            node = nodes[name]
            parts.append(of_class(node) if isinstance(node, ast.ClassDef) else of_function(node, "bondline", 2))
        elif not name.startswith("__"):
            raise SystemExit(f"{name} is exported and not found")
    for module in MODULES:
        source = tree(PACKAGE / f"{module.removeprefix('bondline.')}.py")
        parts += [f"## Module `{module}`"]
        parts += [filled(paragraph) for paragraph in paragraphs((ast.get_docstring(source) or "").splitlines())]
        for node in source.body:
            if isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                parts.append(of_function(node, module, 3))
    return "\n\n".join(parts) + "\n"


def main():
    text = page()
    if "--check" not in sys.argv[1:]:
        PAGE.write_text(text, encoding="utf-8")
    elif not PAGE.exists() or PAGE.read_text(encoding="utf-8") != text:
        raise SystemExit(f"{PAGE.relative_to(ROOT)} is out of date: scripts/docs.sh --renew")


if __name__ == "__main__":
    main()
