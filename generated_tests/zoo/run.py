#!/usr/bin/env python3
"""Robot files of public packages through `straightline check`: read, or refused for a named reason.

Packages are fetched by pip into a folder that is not part of the repository, and unpacked there.

    generated_tests/zoo/run.py --work FOLDER --straightline target/release/straightline > table.md
"""

import argparse
import collections
import pathlib
import re
import subprocess
import shutil
import sys

PACKAGES = {
    "urdf": ["example-robot-data==6.0.0", "icub-models==3.2.0", "synriard==1.2.4"],
    "mjcf": [
        "brax==0.14.2",
        "gymnasium==1.4.0",
        "gymnasium-robotics==1.4.2",
        "dm-control==1.0.50",
        "robosuite-models==1.0.0",
        "openarm-mujoco==2.3.0",
        "synriard==1.2.4",
    ],
    "sdf": ["example-robot-data==6.0.0"],
}
# for a file
SECONDS = 120


def unpacked(package: str, work: pathlib.Path) -> pathlib.Path:
    """The folder of a package."""
    folder = work / package.replace("==", "-")
    if not folder.exists():
        wheels = work / "wheels" / folder.name
        subprocess.run(
            [sys.executable, "-m", "pip", "download", "-q", "--no-deps", "-d", str(wheels), package], check=True
        )
        for archive in wheels.iterdir():
            shutil.unpack_archive(archive, folder, "zip" if archive.suffix == ".whl" else None)
    return folder


def is_robot(path: pathlib.Path, kind: str) -> bool:
    """Whether a file is a robot of this kind; parts of MJCF that others include are none."""
    if kind in ("urdf", "sdf"):
        return path.suffix == f".{kind}"
    if path.suffix not in (".xml", ".mjcf"):
        return False
    text = path.read_text(errors="replace")
    text = re.sub(r"<!--.*?-->", "", text, flags=re.S)
    return re.search(r"<\s*mujoco[\s>]", text) is not None and "<worldbody" in text


def checked(path: pathlib.Path, straightline: str) -> str:
    """`read`, or the codes of the errors."""
    try:
        result = subprocess.run([straightline, "check", str(path)], capture_output=True, text=True, timeout=SECONDS)
    except subprocess.TimeoutExpired:
        return "no answer in time"
    said = result.stdout + result.stderr
    if result.returncode == 0:
        return "read"
    if result.returncode != 1 or "panicked" in said:
        return "failed"
    return ", ".join(sorted(set(re.findall(r"^error\[([a-z0-9-]+)\]", said, flags=re.M)))) or "failed"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", required=True, type=pathlib.Path)
    parser.add_argument("--straightline", required=True)
    parser.add_argument("--list", action="store_true", help="every file with what came of it")
    given = parser.parse_args()
    print("| files | package | robots | read | refused, by code |\n|---|---|---|---|---|")
    failed = []
    for kind, packages in PACKAGES.items():
        for package in packages:
            folder = unpacked(package, given.work)
            found = collections.Counter()
            for path in sorted(p for p in folder.rglob("*") if p.is_file() and is_robot(p, kind)):
                outcome = checked(path, given.straightline)
                found[outcome] += 1
                if outcome in ("failed", "no answer in time"):
                    failed.append(f"{path}: {outcome}")
                if given.list:
                    print(f"{path.relative_to(given.work)}: {outcome}", file=sys.stderr)
            read = found.pop("read", 0)
            refused = "; ".join(f"{count} × {codes}" for codes, count in sorted(found.items())) or "none"
            print(f"| {kind.upper()} | {package} | {read + sum(found.values())} | {read} | {refused} |", flush=True)
    if failed:
        sys.exit("\n".join(failed))


if __name__ == "__main__":
    main()
