"""Pages of the documentation site that are made from other files; a hook of MkDocs (mkdocs.yml)."""

from __future__ import annotations

import re
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

ROOT = Path(__file__).parents[1]
COPIED = {
    "index.md": "README.md",
    "contributing.md": "CONTRIBUTING.md",
    "security.md": "SECURITY.md",
    "changelog.md": "CHANGELOG.md",
}
REFERENCE = ("fba", "player", "face", "body", "emotion", "capture", "persona", "formats", "codec")
LINK = re.compile(r"(!?)\[((?:[^\[\]]|\[[^]]*\])*)\]\(([^()\s]+)\)")


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the front page, the pages from the top of the repository, and one page of reference a package."""
    for target, source in COPIED.items():
        text = (ROOT / source).read_text(encoding="utf-8")
        files.append(File.generated(config, target, content=relinked(text, ROOT)))
    for name in REFERENCE:
        module = name if name == "fba" else f"fba.{name}"
        files.append(File.generated(config, f"reference/{name}.md", content=f"# {module}\n\n::: {module}\n"))
    return files


def on_page_markdown(markdown: str, page: object, config: MkDocsConfig, files: Files) -> str:
    """The page with links that work on the site."""
    return relinked(markdown, ROOT / "docs")


def relinked(text: str, folder: Path) -> str:
    """The text of a page that lies in `folder`, with its links as those of a page in docs/.

    A link to a file that is no page of the site becomes its text.
    """
    pages = {ROOT / source: target for target, source in COPIED.items()}

    def link(match: re.Match[str]) -> str:
        picture, words, target = match.groups()
        path, _, anchor = target.partition("#")
        if not path or ":" in path:
            return match[0]
        there = (folder / path).resolve()
        if there in pages:
            path = pages[there]
        elif there.is_relative_to(ROOT / "docs"):
            path = there.relative_to(ROOT / "docs").as_posix()
        elif there.exists():
            return words
        return f"{picture}[{words}]({path}{'#' if anchor else ''}{anchor})"

    return LINK.sub(link, text)
