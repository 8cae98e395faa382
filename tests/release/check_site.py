"""The site from a static server, started in its folder: each page that others lead to, each file that a page names,
each place in a page that a link asks for. usage: check_site.py FOLDER"""

import functools
import http.server
import sys
import threading
import urllib.error
import urllib.parse
import urllib.request
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "docs/site"))
from links import Links  # noqa: E402


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


def main(folder):
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=folder))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    start = f"http://127.0.0.1:{server.server_port}/"
    opened, pages, asked, foreign, complaints = set(), {}, [], 0, []
    waiting = [(start, "index.html")]
    while waiting:
        address, source = waiting.pop()
        if address in opened:
            continue
        opened.add(address)
        try:
            with urllib.request.urlopen(address, timeout=30) as answer:
                text = answer.read()
                kind = answer.headers.get_content_type()
        except urllib.error.HTTPError as error:
            complaints.append(f"{source}: found {error.code} at {address}")
            continue
        if kind != "text/html":
            continue
        page = pages[address] = Links()
        page.feed(text.decode("utf-8", "replace"))
        for _, link in page.found:
            full, place = urllib.parse.urldefrag(urllib.parse.urljoin(address, link))
            if not full.startswith(start):
                foreign += full.startswith("http")
                continue
            waiting.append((full, address))
            if place:
                asked.append((full, urllib.parse.unquote(place), address))
    for full, place, source in asked:  # the generated API makes some places by a script
        if full in pages and place not in pages[full].anchors and "/api/" not in full:
            complaints.append(f"{source}: found no place #{place} in {full}")
    server.shutdown()
    if len(pages) < 20:
        complaints.append(f"{folder}: found {len(pages)} pages, expected 20 at least")
    for complaint in complaints[:20]:
        print(complaint.replace(start, ""), file=sys.stderr)
    print(f"{len(pages)} pages and {len(opened) - len(pages)} other files from a server, "
          f"{len(complaints)} broken links; {foreign} links lead elsewhere")
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
