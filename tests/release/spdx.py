"""Writes what the pieces of a release hold, and under which licences, as SPDX 2.3 in JSON: spdx.py VERSION COMMIT FOLDER. The pieces are
what lies in the folder; what of others is in them stands in cmake/packages/parts.tsv."""

import datetime
import hashlib
import json
import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# Of each piece how its name begins and ends, and what it is.
PIECES = {
    "source": (r"npt-[\d.]+\.tar\.gz", "sources"),
    "deb": (r"npt_.*\.deb", "program, headers and weights for Debian 12"),
    "windows": (r"npt-.*-win64\.zip", "program, headers and weights for Windows"),
    "wheel": (r"npt-.*\.whl", "Python package"),
    "blender": (r"npt_pose_transfer-.*\.zip", "add-on for Blender"),
    "npm": (r"npt-web-.*\.tgz", "npm package in WebAssembly"),
    "site": (r"npt-site-.*\.tar\.gz", "guides, API and page for a static server"),
}
RELATIONS = {"contains": "CONTAINS", "static": "STATIC_LINK", "depends": "DEPENDS_ON"}
OWN = "MIT"


def read_parts():
    parts = []
    for line in (ROOT / "cmake/packages/parts.tsv").read_text(encoding="utf-8").splitlines():
        if line.startswith("#"):
            continue
        name, licence, source, how, packages, address = line.split("\t")
        unknown = set(packages.split()) - set(PIECES)
        if how not in RELATIONS or unknown:
            sys.exit(f"parts.tsv: {name}: found {how}, {packages}")
        parts.append((name, licence, source, how, packages.split(), address))
    return parts


def version_of(source):
    place, _, name = source.partition(":")
    if place != "debian":
        return place
    found = subprocess.run(["dpkg-query", "-W", "-f=${Version}", name], capture_output=True, text=True)
    if found.returncode != 0 or not found.stdout:
        sys.exit(f"spdx.py: {name} is not installed, whose version belongs into the list")
    return found.stdout


def copyright_of(source):
    """What the licence's text says of all files: the first Copyright field of a Debian copyright file, or a LICENSE's lines."""
    place, _, name = source.partition(":")
    file = Path("/usr/share/doc") / name / "copyright" if place == "debian" else ROOT / name
    text = file.read_text(encoding="utf-8", errors="replace") if file.name in ("copyright", "LICENSE") and file.exists() else ""
    field = re.search(r"^Copyright:[ \t]*(.*(?:\n[ \t]+\S.*)*)", text, re.MULTILINE)
    lines = field.group(1).splitlines() if field else re.findall(r"^.*Copyright (?:\(c\)|©|\d{4}).*$", text, re.MULTILINE | re.IGNORECASE)
    return "\n".join(line.strip() for line in lines if line.strip()) or "NOASSERTION"


def identifier(text):
    return "SPDXRef-" + re.sub(r"[^A-Za-z0-9.]+", "-", text).strip("-")


def package(name, version, licence, address="NOASSERTION", **more):
    made = {"SPDXID": identifier(f"{name}-{version}"), "name": name, "downloadLocation": address, "filesAnalyzed": False,
            "licenseConcluded": licence, "licenseDeclared": licence, "copyrightText": "NOASSERTION", **more}
    if version != "NOASSERTION":
        made["versionInfo"] = version
    return made


def main(version, commit, folder):
    folder = Path(folder)
    time = datetime.datetime.fromtimestamp(int(os.environ["SOURCE_DATE_EPOCH"]), datetime.timezone.utc)
    packages, relations = {}, []

    def relate(one, kind, other):
        relations.append({"spdxElementId": one, "relationshipType": kind, "relatedSpdxElement": other})

    weights = package("npt weights", version, OWN, copyrightText="Copyright (c) 2026 npt contributors",
                      comment="Trained on data that examples/weights/README.md names: CC0-1.0, MIT, or the project's own")
    pieces = {}
    for file in sorted(folder.iterdir()):
        for piece, (pattern, what) in PIECES.items():
            if re.fullmatch(pattern, file.name):
                made = package(file.name, version, "NOASSERTION", copyrightText="Copyright (c) 2026 npt contributors", summary=f"npt: {what}",
                               packageFileName=file.name, supplier="Organization: npt contributors",
                               checksums=[{"algorithm": "SHA256", "checksumValue": hashlib.sha256(file.read_bytes()).hexdigest()}])
                licences = [OWN]
                for name, licence, source, how, where, address in read_parts():
                    if piece not in where:
                        continue
                    part = package(name, version_of(source), licence, address, copyrightText=copyright_of(source))
                    packages.setdefault(part["SPDXID"], part)
                    relate(made["SPDXID"], RELATIONS[how], part["SPDXID"])
                    if how != "depends":
                        licences.append(f"({licence})" if " OR " in licence or " AND " in licence else licence)
                made["licenseDeclared"] = OWN
                made["licenseConcluded"] = " AND ".join(dict.fromkeys(licences))
                relate("SPDXRef-DOCUMENT", "DESCRIBES", made["SPDXID"])
                relate(made["SPDXID"], "CONTAINS", weights["SPDXID"])
                pieces[made["SPDXID"]] = made
    if not pieces:
        print("spdx.py: no pieces")
        return
    packages[weights["SPDXID"]] = weights
    document = {
        "spdxVersion": "SPDX-2.3",
        "dataLicense": "CC0-1.0",
        "SPDXID": "SPDXRef-DOCUMENT",
        "name": f"npt-{version}",
        "documentNamespace": f"https://npt.invalid/spdx/npt-{version}-{commit}",
        "creationInfo": {"created": time.strftime("%Y-%m-%dT%H:%M:%SZ"), "creators": ["Tool: npt tests/release/spdx.py"]},
        "packages": [*pieces.values(), *packages.values()],
        "relationships": relations,
    }
    (folder / f"npt-{version}.spdx.json").write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:])
