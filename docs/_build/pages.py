"""Pages made at the build (a MkDocs hook): settings from the code, examples, and the changelog; links to them."""

from __future__ import annotations

import sys
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add what is not written by hand."""
    from mrslam.sim_driver.cli.config import as_markdown

    pages = {
        "settings.md": as_markdown(),
        "examples.md": _examples(),
        "changelog.md": (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"),
    }
    for name, text in pages.items():
        files.append(File.generated(config, name, content=text))
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Let links to the checkout's folder of examples lead to the page made of it, and the changelog's to the pages."""
    return markdown.replace("](../examples/)", "](examples.md)").replace("](docs/", "](")


def _examples() -> str:
    parts = ["# The Python API by example\n\nAll of them are in `examples/` and are run by the tests.\n"]
    for path in sorted((ROOT / "examples").glob("*.py")):
        parts.append(f"## {path.stem.replace('_', ' ').capitalize()}\n\n```py\n{path.read_text(encoding='utf-8')}```\n")
    return "\n".join(parts)
