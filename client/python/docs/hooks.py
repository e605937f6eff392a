"""Pages that are made of files outside of docs/, and links that lead out of it."""

from __future__ import annotations

import posixpath
import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

REPOSITORY = Path(__file__).parents[3]
PYTHON = REPOSITORY / "client" / "python"

# A link of Markdown whose target is a file: its text, the path, and an anchor.
LINK = re.compile(r"(?<!!)\[([^\]]*)\]\(([^)#:\s]+)(#[^)\s]*)?\)")

CLASSES = {
    "The connection": ["connect", "Simulation", "Robot", "Joint", "Joints", "Parameters", "Claim"],
    "Over time": ["Watch", "EventWatch", "Callbacks"],
    "Targets": ["Target", "Whole"],
    "Rollouts": ["Control", "Feedback", "Start", "Variation", "Observation", "Cost", "Rollout"],
}


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """The README is the first page; the API and the examples are two more."""
    pages = {
        "index.md": moved(REPOSITORY / "README.md", "index.md"),
        "python-api.md": api(),
        "python-examples.md": examples(),
    }
    for name, content in pages.items():
        files.append(File.generated(config, name, content=content))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """A link to a file of the repository that is not a page becomes its text. The file must exist."""
    folder = posixpath.dirname(posixpath.join("docs", page.file.src_uri))

    def shown(link: re.Match[str]) -> str:
        path = posixpath.normpath(posixpath.join(folder, link[2]))
        if path.startswith("docs/"):
            return link[0]
        if not (REPOSITORY / path).exists():
            raise PluginError(f"{page.file.src_uri} links to {link[2]}, and there is no {path}")
        return link[1]

    # Code is left as it is.
    parts = re.split(r"(^```.*?^```$)", markdown, flags=re.MULTILINE | re.DOTALL)
    return "".join(part if part.startswith("```") else LINK.sub(shown, part) for part in parts)


def moved(source: Path, name: str) -> str:
    """A page of the repository as a page of docs/, with its links as they are from there."""
    folder = source.parent.relative_to(REPOSITORY).as_posix()

    def relative(link: re.Match[str]) -> str:
        path = posixpath.relpath(posixpath.join(folder, link[2]), "docs")
        return f"[{link[1]}]({path}{link[3] or ''})"

    text = LINK.sub(relative, source.read_text())
    return text.replace("](docs/", "](")


def api() -> str:
    """Everything that `simd_client` exports: the classes that ask the daemon first, then what they return."""
    exports = dict(re.findall(r"^    \"(\w+)\",()$", (PYTHON / "src/simd_client/__init__.py").read_text(), re.MULTILINE))
    named = [name for names in CLASSES.values() for name in names]
    errors = [name for name in exports if name in errors_of(PYTHON / "src/simd_client/errors.py")]
    constants = {"API_VERSION", "DEFAULT_ENDPOINT"}
    rest = [name for name in exports if name not in {*named, *errors, *constants}]
    sections = {**CLASSES, "What calls return": rest, "Errors": errors}
    lines = [
        "# The Python client's names",
        "",
        "All of `simd_client`. [The guide](python.md) is where to begin. `simd_client.aio` has the same names: what asks the",
        "daemon is awaited there, properties too.",
    ]
    for title, names in sections.items():
        lines += ["", f"## {title}", ""]
        lines += [f"::: simd_client.{name}" for name in names]
    return "\n".join(lines) + "\n"


def errors_of(source: Path) -> set[str]:
    """The classes in a file."""
    return set(re.findall(r"^class (\w+)\(", source.read_text(), re.MULTILINE))


def examples() -> str:
    """The examples with their code."""
    folder = PYTHON / "examples"
    text = moved(folder / "README.md", "python-examples.md")
    for path in sorted(folder.glob("*.py")):
        text += f"\n## {path.name}\n\n```python\n{path.read_text().rstrip()}\n```\n"
    return text
