#!/usr/bin/env python3
"""Pages of the guides: HTML of every Markdown file that is a guide, with what they link to. Called by docs/site.sh.
usage: pages.py ROOT OUT [--api] [--page] [--mermaid]
  --api, --page, --mermaid   OUT/api, OUT/page and OUT/assets/mermaid.min.js are there
Addresses and anchors are those of the Markdown files, so that a link that works there works here. At the end each link
within the site is followed: one that leads nowhere, or a script or picture from another host, is an error.
Needs Debian's python3-markdown-it and python3-pygments."""

import html
import os
import re
import shutil
import sys
from pathlib import Path
from urllib.parse import unquote

from markdown_it import MarkdownIt
from pygments import highlight
from pygments.formatters import HtmlFormatter
from pygments.lexers import TextLexer, get_lexer_by_name, get_lexer_for_filename
from pygments.util import ClassNotFound

from links import Links

# The order of guides: names in docs, or paths; those that aren't there are passed over, the others come last.
GROUPS = (
    ("Start", "README.md quickstart-artist quickstart-cpp quickstart-python quickstart-research"),
    ("What it does", "how-it-works results limits gallery troubleshooting alternatives glossary"),
    ("Reference", "program transfer network-options formats api embedding python web training "
                  "examples/weights/README.md performance numerics reproduction baselines design"),
)
GROUPS = tuple((title, [name if name.endswith(".md") else f"docs/{name}.md" for name in names.split()])
               for title, names in GROUPS)
PICTURES = (".png", ".jpg", ".jpeg", ".webp", ".gif", ".svg", ".mp4")
TEXT_LIMIT = 400_000  # a longer file is copied instead of shown
FORMATTER = HtmlFormatter(nowrap=True)


def slug_of(text):
    return re.sub(r"[^\w\- ]", "", text.lower()).strip().replace(" ", "-")


def page_of(name):
    """The page of a Markdown file or of a source file."""
    if name.endswith("README.md"):
        return name[:-len("README.md")] + "index.html"
    return name[:-3] + ".html" if name.endswith(".md") else name + ".html"


def coloured(code, lexer):
    return highlight(code, lexer, FORMATTER)


def lexer_of(language):
    try:
        return get_lexer_by_name(language) if language else TextLexer()
    except ClassNotFound:
        return TextLexer()


class Site:
    def __init__(self, root, out, extras):
        self.root, self.out, self.extras = root, out, extras
        self.markdown = MarkdownIt("commonmark", {"html": True}).enable(["table", "strikethrough"])
        self.guides = self.find_guides()
        self.titles = {name: self.title_of(name) for name in self.guides}
        self.wanted, self.done = [], set()  # files and folders that pages link to

    def find_guides(self):
        names = {"README.md", "CHANGELOG.md", "bench/README.md"}
        for pattern in ("docs/*.md", "docs/notes/*.md", "docs/images/*.md", "examples/*/README.md",
                        "bench/*/README.md"):
            names.update(path.relative_to(self.root).as_posix() for path in self.root.glob(pattern))
        return sorted(name for name in names if (self.root / name).is_file())

    def title_of(self, name):
        found = re.search(r"^# (.+)$", (self.root / name).read_text(encoding="utf-8"), re.MULTILINE)
        return re.sub(r"[`*]", "", found.group(1)) if found else name

    def navigation(self, current):
        listed = {name for _, names in GROUPS for name in names}
        notes = [name for name in self.guides if name.startswith("docs/notes/")]
        more = [name for name in self.guides if name not in listed and name not in notes]
        groups = [*GROUPS, ("More", more), ("Laboratory notes", notes)]
        lines = []
        for title, names in groups:
            entries = []
            for name in names:
                if name not in self.guides:
                    continue
                here = ' aria-current="page"' if name == current else ""
                entries.append(f'<li><a href="{self.relative(current, page_of(name))}"{here}>'
                               f"{html.escape(self.titles[name])}</a></li>")
            if title == "Start" and "page" in self.extras:
                entries.append(f'<li><a href="{self.relative(current, "page/index.html")}">In this browser</a></li>')
            if title == "Reference" and "api" in self.extras:
                entries.append(f'<li><a href="{self.relative(current, "api/index.html")}">Generated API</a></li>')
            if entries:
                lines.append(f"<h2>{title}</h2>\n<ul>\n" + "\n".join(entries) + "\n</ul>")
        return "\n".join(lines)

    @staticmethod
    def relative(current, target):
        return os.path.relpath(target, os.path.dirname(page_of(current)) or ".")

    def address(self, current, target):
        """What a link of a Markdown file becomes; what it leads to is asked for."""
        if re.match(r"[a-z][a-z0-9+.\-]*:|//|#", target):
            return target
        path, mark, anchor = target.partition("#")
        name = os.path.normpath(os.path.join(os.path.dirname(current), unquote(path)))
        place = self.root / name
        if not place.exists() or name.startswith(".."):
            return target  # found at the end
        if name in self.guides:
            return self.relative(current, page_of(name)) + mark + anchor
        generated = self.generated_page(name) if current == "docs/api.md" else None
        if generated:
            return self.relative(current, generated)
        self.wanted.append(name)
        if place.is_dir():
            return self.relative(current, name + "/index.html")
        shown = name if self.is_copied(place) else page_of(name)
        return self.relative(current, shown) + mark + anchor

    def generated_page(self, name):
        """Doxygen's page of a header, which the API overview links to where there is one."""
        parts = [part.replace("_", "__").replace(".", "_8") for part in name.split("/")]
        # The second where names repeat.
        for page in (f"api/{parts[-1]}.html", "api/" + "_2".join(parts[-2:]) + ".html"):
            if "api" in self.extras and name.endswith(".hpp") and (self.out / page).is_file():
                return page
        return None

    @staticmethod
    def is_copied(place):
        if place.suffix.lower() in PICTURES or place.stat().st_size > TEXT_LIMIT:
            return True
        return b"\0" in place.read_bytes()[:4096]

    def write(self, name, title, body):
        page = self.out / page_of(name) if not name.endswith("/index") else self.out / (name + ".html")
        page.parent.mkdir(parents=True, exist_ok=True)
        up = os.path.relpath(self.out, page.parent)
        drawn = ("mermaid.min.js", "diagrams.js") if "mermaid" in self.extras and 'class="mermaid"' in body else ()
        script = "".join(f'\n<script src="{up}/assets/{source}"></script>' for source in drawn)
        page.write_text(f"""<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>{html.escape(title)}</title>
<link rel="icon" href="data:,">
<link rel="stylesheet" href="{up}/assets/site.css">
</head>
<body>
<a class="skip" href="#content">To the text</a>
<details class="menu"><summary>Contents</summary></details>
<nav aria-label="Guides">
{self.navigation(name)}
</nav>
<main id="content" tabindex="-1">
{body}
</main>{script}
</body>
</html>
""", encoding="utf-8")

    def guide(self, name):
        tokens = self.markdown.parse((self.root / name).read_text(encoding="utf-8"))
        count = {}
        for i, token in enumerate(tokens):
            if token.type == "heading_open":
                slug = slug_of("".join(child.content for child in tokens[i + 1].children
                                       if child.type in ("text", "code_inline")))
                number = count.get(slug, 0)
                count[slug] = number + 1
                token.attrSet("id", slug if number == 0 else f"{slug}-{number}")
            elif token.type == "html_block":
                token.content = self.html(name, token.content)
            for child in token.children or []:
                if child.type == "link_open":
                    child.attrSet("href", self.address(name, child.attrGet("href")))
                elif child.type == "image":
                    child.attrSet("src", self.address(name, child.attrGet("src")))
                    child.attrSet("loading", "lazy")
                elif child.type == "html_inline":
                    child.content = self.html(name, child.content)
        self.markdown.add_render_rule("fence", self.fence)
        body = self.markdown.renderer.render(tokens, self.markdown.options, {})
        body = body.replace("<table>", '<div class="table" tabindex="0"><table>').replace("</table>", "</table></div>")
        body = body.replace("<th></th>", "<td></td>")  # a heading of nothing helps no screen reader
        self.write(name, self.titles[name] + ("" if name == "README.md" else " - npt"), body)

    def html(self, name, text):
        """Addresses in HTML; comments go, tags of blocks and keys of numbers among them."""
        text = re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)
        return re.sub(r"""(\s(?:src|href|srcset)=["'])([^"']+)""",
                      lambda match: match.group(1) + self.address(name, match.group(2)), text)

    @staticmethod
    def fence(renderer, tokens, index, options, env):
        token = tokens[index]
        language = (token.info.split() or [""])[0]
        if language == "mermaid":
            return f'<pre class="mermaid">{html.escape(token.content)}</pre>\n'
        return f'<pre tabindex="0"><code>{coloured(token.content, lexer_of(language))}</code></pre>\n'

    def linked(self, name):
        """A file or a folder that a guide links to: as a page, or as it is."""
        place = self.root / name
        if place.is_dir():
            entries = []
            for path in sorted(place.iterdir(), key=lambda path: (path.is_file(), path.name)):
                inner = path.relative_to(self.root).as_posix()
                if path.is_dir() or inner.endswith((".pyc",)) or path.name.startswith("."):
                    continue
                entries.append(f'<li><a href="{os.path.relpath(self.target_of(inner), name)}">{path.name}</a></li>')
            self.write(name + "/index", name, f"<h1>{html.escape(name)}</h1>\n<ul>\n" + "\n".join(entries) + "\n</ul>")
        elif self.is_copied(place):
            (self.out / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(place, self.out / name)
        else:
            text = place.read_text(encoding="utf-8", errors="replace")
            try:
                lexer = get_lexer_for_filename(place.name)
            except ClassNotFound:
                lexer = TextLexer()
            code = f'<pre tabindex="0"><code>{coloured(text, lexer)}</code></pre>'
            self.write(name, name, f"<h1>{html.escape(name)}</h1>\n{code}")

    def target_of(self, name):
        if name in self.guides:
            return page_of(name)
        self.wanted.append(name)
        return name if self.is_copied(self.root / name) else page_of(name)

    def make(self):
        assets = self.out / "assets"
        assets.mkdir(parents=True, exist_ok=True)
        here = Path(__file__).resolve().parent
        for name in ("site.css", "diagrams.js"):
            shutil.copyfile(here / name, assets / name)
        for name in self.guides:
            self.guide(name)
        while self.wanted:
            name = self.wanted.pop()
            if name not in self.done:
                self.done.add(name)
                self.linked(name)


def complaints_of(out):
    pages = {}
    for path in out.rglob("*.html"):
        if path.relative_to(out).parts[0] not in ("api", "page"):
            pages[path] = Links()
            pages[path].feed(path.read_text(encoding="utf-8"))
    complaints = []
    for path, page in sorted(pages.items()):
        name = path.relative_to(out)
        for tag, target in page.found:
            if target.startswith("data:"):
                continue
            if re.match(r"[a-z][a-z0-9+.\-]*:|//", target):
                if tag != "a":
                    complaints.append(f"{name}: {target}: from another host")
                continue
            place, _, anchor = unquote(target).partition("#")
            found = path if not place else Path(os.path.normpath(path.parent / place))
            if not found.is_file():
                complaints.append(f"{name}: {target}: no such file")
            elif anchor and found in pages and anchor not in pages[found].anchors:
                complaints.append(f"{name}: {target}: no such anchor")
    return complaints


def main():
    names = [argument for argument in sys.argv[1:] if not argument.startswith("--")]
    if len(names) != 2:
        sys.exit(__doc__)
    root, out = Path(names[0]).resolve(), Path(names[1]).resolve()
    site = Site(root, out, {argument[2:] for argument in sys.argv[1:] if argument.startswith("--")})
    site.make()
    complaints = complaints_of(out)
    for complaint in complaints:
        print(f"site.sh: {complaint}", file=sys.stderr)
    print(f"{len(site.guides)} guides, {len(site.done)} files that they link to")
    sys.exit(1 if complaints else 0)


if __name__ == "__main__":
    main()
