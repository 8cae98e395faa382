"""Every fenced block of a guide says in a comment in the line before it what becomes of it here:
    <!-- run -->                        it runs as it is printed
    <!-- run small: s/100/1/; s|A|B| -->  it runs with A replaced by B: text, no patterns, of which each must be there
    <!-- run small: COMMAND -->         this command runs instead
    <!-- not run: REASON -->            it doesn't
Those of one guide run one after another in a folder that is empty at first, as if somebody pasted them: npt is on the
path, NPT names the source folder, and folder, variables and environment last from block to block.
    sh, bash     bash -euo pipefail; `$ ` in front of commands is taken away
    console      the lines behind `$ ` alone
    python       python3 with numpy and the package, one process for all blocks of a guide
    cpp          a program with main is compiled, linked with the compiled objects and run; another piece compiles alone
                 or behind the guide's earlier pieces, at file scope or in a function
untagged_guides.txt lists guides whose blocks have no tags yet.
usage: test_blocks.py --npt PROGRAM [--python PYTHON --library LIBRARY] [--compiler FLAGS [--link OBJECTS]]"""

import argparse
import os
import re
import resource
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import markdown

LIST = "untagged_guides.txt"
BLOCK_SECONDS = 300
PROCESSOR_SECONDS = 360  # three minutes of two processors; wall time depends on what else runs
SHELL, PYTHON, CPP = ("sh", "bash", "console"), ("python", "py"), ("cpp", "c++")

WORKER = r'''
import io, sys, traceback
space = {"__name__": "__main__"}
for line in sys.stdin:
    name, place = line.rstrip("\n").split("\t")
    failed = 0
    try:
        with open(name) as file:
            exec(compile("\n" * (int(place) - 1) + file.read(), "block", "exec"), space)
    except SystemExit as end:
        failed = end.code or 0
    except BaseException:
        traceback.print_exc()
        failed = 1
    sys.stdout.flush()
    sys.stderr.flush()
    with open(name + ".done", "w") as file:
        file.write(str(failed))
'''


class BadTag(Exception):
    pass


def replaced(block, text):
    """The block's code with `s/A/B/; s|C|D|` done to it."""
    code, rest = block.code, text
    while rest:
        match = re.match(r"s([^\w\s])((?:(?!\1).)+)\1((?:(?!\1).)*)\1\s*(?:;\s*|$)", rest)
        if not match:
            raise BadTag(f"unreadable replacement '{rest}', expected s/A/B/; s/C/D/")
        if match.group(2) not in code:
            raise BadTag(f"'{match.group(2)}' is not in the block")
        code = code.replace(match.group(2), match.group(3))
        rest = rest[match.end():]
    return code


def code_to_run(block):
    """What runs of a block, as (language, code); None: nothing."""
    tag = block.tag
    if tag is None:
        raise BadTag("no tag in the line before: run, run small: COMMAND, or not run: REASON")
    if re.match(r"not run:\s*\S", tag):
        return None
    small = re.match(r"run small:\s*(\S.*)$", tag, re.DOTALL)
    if tag != "run" and not small:
        raise BadTag(f"unknown tag '{tag}', expected run, run small: COMMAND, or not run: REASON")
    if small and not re.match(r"s[^\w\s]", small.group(1)):
        return "bash", small.group(1) + "\n"
    if block.language not in SHELL + PYTHON + CPP:
        raise BadTag(f"a block of '{block.language}' can't run, only one of {', '.join(SHELL + PYTHON + CPP)}")
    code = replaced(block, small.group(1)) if small else block.code
    if block.language == "console":
        code = "".join(line[2:] + "\n" for line in code.split("\n") if line.startswith("$ "))
    elif block.language in SHELL:
        code = re.sub(r"^\$ ", "", code, flags=re.MULTILINE)
    return block.language, code


def tag_complaints(name):
    complaints = []
    for block in markdown.read(name).blocks:
        try:
            code_to_run(block)
        except BadTag as error:
            complaints.append(f"{name}:{block.line}: {error}")
    return complaints


class Guide:
    """Runs the blocks of one guide, in one folder."""

    def __init__(self, options, folder):
        self.options, self.place, self.state = options, folder / "work", folder
        self.place.mkdir()
        self.worker, self.count, self.pieces = None, 0, []
        programs = folder / "bin"
        programs.mkdir()
        (programs / "npt").symlink_to(options.npt.resolve())
        self.environment = dict(os.environ, NPT=str(markdown.ROOT), HOME=str(self.place),
                                PATH=f"{programs}:{os.environ['PATH']}",
                                PYTHONPATH=str(markdown.ROOT / "examples" / "python"))
        self.environment.setdefault("NPT_WEIGHTS", str(markdown.ROOT / "examples" / "weights"))
        if options.library:
            self.environment["NPT_LIBRARY"] = str(options.library.resolve())
        if options.python:
            (programs / "python3").symlink_to(options.python)

    def run(self, block, language, code):
        """What the block prints, and whether all was well; None: it is skipped."""
        if language in SHELL:
            return self.run_shell(code)
        if language in PYTHON:
            if not self.options.python or not self.options.library:
                return None
            return self.run_python(block, code)
        return self.run_cpp(code)

    def process(self, command, **arguments):
        try:
            done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                  text=True, errors="replace", timeout=BLOCK_SECONDS, env=self.environment, **arguments)
            return done.stdout, done.returncode == 0
        except subprocess.TimeoutExpired as error:
            printed = error.stdout or b""
            return (printed if isinstance(printed, str) else printed.decode(errors="replace")) + \
                f"\nstopped after {BLOCK_SECONDS} s", False

    def run_shell(self, code):
        before, after = self.state / "before.sh", self.state / "after.sh"
        script = self.state / "block.sh"
        keep = f'{{ declare -p | grep -v "^declare -[a-zA-Z]*r"; declare -f; printf "cd %q\\n" "$PWD"; }} > {after}'
        read = f". {before} > /dev/null 2>&1\n" if before.exists() else ""
        script.write_text(f"{read}set -euo pipefail\n{code}\n{keep}\n")
        printed, good = self.process(["bash", str(script)], cwd=self.place)
        if after.exists():
            after.replace(before)
        return printed, good

    def run_python(self, block, code):
        log = self.state / "python.log"
        if self.worker is None:
            self.worker = subprocess.Popen([str(self.options.python), "-B", "-c", WORKER], cwd=self.place, text=True,
                                           stdin=subprocess.PIPE, stdout=log.open("w"), stderr=subprocess.STDOUT,
                                           env=self.environment)
        begin = log.stat().st_size
        self.count += 1
        name = self.state / f"block{self.count}.py"
        name.write_text(code)
        self.worker.stdin.write(f"{name}\t{block.line + 1}\n")
        self.worker.stdin.flush()
        done, end = Path(f"{name}.done"), time.monotonic() + BLOCK_SECONDS
        while not (done.exists() and done.read_text()):
            if self.worker.poll() is not None or time.monotonic() > end:
                self.close()
                return log.read_text()[begin:] + "\nended or stopped", False
            time.sleep(0.02)
        with log.open(errors="replace") as file:
            file.seek(begin)
            return file.read(), done.read_text() == "0"

    def run_cpp(self, code):
        if not self.options.compiler:
            return None
        source = self.state / "block.cpp"
        command = [*self.options.compiler, "-DNPT_COMPILED", f"-I{markdown.ROOT / 'include'}", str(source)]
        if re.search(r"\bint main\(", code):
            source.write_text(code)
            if not self.options.link:
                return self.process([*command, "-fsyntax-only"])
            program = self.state / "block"
            printed, good = self.process([*command, *self.options.link, "-o", str(program)])
            return self.process([str(program)], cwd=self.place) if good else (printed, good)
        self.pieces.append(code)
        first = None
        for pieces in ([code], self.pieces):
            for text in unit_texts(pieces):
                source.write_text(text)
                printed, good = self.process([*command, "-fsyntax-only"])
                if good:
                    return printed, good
                first = first or (printed, good)
            if len(self.pieces) == 1:
                break
        return first

    def close(self):
        if self.worker is not None:
            self.worker.stdin.close()
            try:
                self.worker.wait(5)
            except subprocess.TimeoutExpired:
                self.worker.kill()
                self.worker.wait()
            self.worker = None


def unit_texts(pieces):
    """Pieces of C++ as units: in a function, each in the scope of the one before it; or at file scope."""
    includes, bodies = ["#include <npt/npt.hpp>\n", "#include <npt/io/mesh_file.hpp>\n"], []
    for piece in pieces:
        includes += re.findall(r"^#include .*\n", piece, re.MULTILINE)
        bodies.append(re.sub(r"^#include .*\n", "", piece, flags=re.MULTILINE))
    head = "".join(dict.fromkeys(includes))
    inside = "void block() {\n" + "{\n".join(bodies) + "}\n" * len(bodies)
    return [head + inside, head + "".join(bodies)]


def run_guide(name, options):
    """Complaints about the blocks of one guide; prints how long each took."""
    complaints = []
    with tempfile.TemporaryDirectory(prefix="npt_guide_") as folder:
        guide = Guide(options, Path(folder))
        for block in markdown.read(name).blocks:
            try:
                wanted = code_to_run(block)
            except BadTag as error:
                complaints.append(f"{name}:{block.line}: {error}")
                continue
            if wanted is None:
                continue
            begin = time.monotonic()
            result = guide.run(block, *wanted)
            if result is None:
                print(f"{name}:{block.line}: skipped: this build or machine lacks what {wanted[0]} needs")
                continue
            printed, good = result
            print(f"{name}:{block.line}: {'done' if good else 'FAILED'}, {time.monotonic() - begin:.1f} s", flush=True)
            if not good:
                complaints.append(f"{name}:{block.line}: a block of {wanted[0]} fails:\n{printed.rstrip()[-2000:]}")
        guide.close()
    return complaints


def check_rule():
    """The rule finds each kind of offence, and nothing else."""

    def run_of(tag, language="sh", code="npt --epochs 100 A\n"):
        block = markdown.Block(language, tag, 2)
        block.lines = code.rstrip("\n").split("\n")
        return code_to_run(block)

    def is_bad(*arguments):
        try:
            run_of(*arguments)
            return False
        except BadTag:
            return True

    assert run_of("run") == ("sh", "npt --epochs 100 A\n")
    assert run_of("run small: s/--epochs 100/--epochs 1/; s|A|b/c|") == ("sh", "npt --epochs 1 b/c\n")
    assert run_of("run small: npt --version") == ("bash", "npt --version\n")
    assert run_of("run small: npt --version", "text") == ("bash", "npt --version\n")
    assert run_of("not run: needs a GPU", "text") is None
    assert run_of("run", "console", "$ npt\nprinted\n") == ("console", "npt\n")
    assert run_of("run small: cd x\nnpt") == ("bash", "cd x\nnpt\n")
    assert is_bad(None) and is_bad("runs") and is_bad("not run:") and is_bad("run", "text")
    assert is_bad("run small: s/200/1/") and is_bad("run small: s/100/1") and is_bad("run small:")
    text = "- item\n\n  <!-- run -->\n  ```sh\n  a\n    b\n  ```\n\n````md\n```\n````\n"
    blocks = markdown.Document(text).blocks
    assert [(block.language, block.tag, block.line, block.code) for block in blocks] == \
        [("sh", "run", 4, "a\n  b\n"), ("md", None, 9, "```\n")]
    blocks = markdown.Document("<!-- run small:\nnpt -->\n```sh\na\n```\nText -->\n```sh\nb\n```\n").blocks
    assert [block.tag for block in blocks] == ["run small:\nnpt", None]


def parse():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--npt", type=Path, required=True)
    parser.add_argument("--python", type=Path)
    parser.add_argument("--library", type=Path)
    parser.add_argument("--compiler", type=str.split, default=[], help="the compiler and its flags, in one argument")
    parser.add_argument("--link", type=str.split, default=[], help="objects and libraries, in one argument")
    parser.add_argument("--list", action="store_true", help="print what the list would be today")
    parser.add_argument("guides", nargs="*", help="only these, listed or not")
    return parser.parse_args()


def main():
    check_rule()
    options = parse()
    if options.list:
        print("\n".join(name for name in markdown.guides() if tag_complaints(name)))
        return 0
    if shutil.which("bash") is None:
        print("SKIPPED: bash is not installed")
        return 0
    listed = markdown.read_list(LIST)
    complaints = [f"{name}: stands in tests/guides/{LIST}, but is no guide"
                  for name in listed if name not in markdown.guides()]
    for name in options.guides or markdown.guides():
        if name in listed and not options.guides:
            if not tag_complaints(name):
                complaints.append(f"{name}: all of its blocks have tags: take it out of tests/guides/{LIST}")
            continue
        complaints += run_guide(name, options)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    seconds = used.ru_utime + used.ru_stime
    print(f"{seconds:.0f} s of processor time")
    if seconds > PROCESSOR_SECONDS:
        complaints.append(f"{seconds:.0f} s of processor time, at most {PROCESSOR_SECONDS}: let some blocks run small")
    return markdown.report(complaints)


if __name__ == "__main__":
    sys.exit(main())
