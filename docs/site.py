"""Makes the site of what the repository has: links between its files hold in both.

MkDocs calls the functions. Files at the top become pages; links to anything else outside `docs/`, such as examples,
become text, since the site does not have it.
"""

from __future__ import annotations

import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parent.parent
TOP = {"README.md": "index.md", "CONTRIBUTING.md": "contributing.md", "CHANGELOG.md": "changelog.md"}
LINK = re.compile(r"\[([^\]]+)\]\((?!https?:|#)([^)#]+)(#[^)]*)?\)")


def on_files(files: Files, *, config: MkDocsConfig) -> Files:
    """Add the files at the top as pages."""
    for name, page in TOP.items():
        text = (ROOT / name).read_text(encoding="utf-8")
        files.append(File.generated(config, page, content=with_links(text, ROOT)))
    return files


def on_page_markdown(markdown: str, **_: object) -> str:
    """Change the links of the pages in `docs/`; those of the others lead to pages already."""
    return with_links(markdown, ROOT / "docs")


def with_links(text: str, folder: Path) -> str:
    """Return a text from a file of `folder` with its links as the site has them."""

    def change(found: re.Match[str]) -> str:
        label, target, anchor = found[1], found[2], found[3] or ""
        if target in TOP.values():
            return found[0]
        path = (folder / target).resolve().relative_to(ROOT)
        if path.is_relative_to("docs"):
            return f"[{label}]({path.relative_to('docs')}{anchor})"
        return f"[{label}]({TOP[str(path)]}{anchor})" if str(path) in TOP else label

    return LINK.sub(change, text)
