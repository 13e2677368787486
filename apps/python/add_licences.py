"""add_licences.py WHEEL FILE...: writes a wheel anew with the licences of the libraries that auditwheel put into it, of the
headers among the files, which are compiled in, and with those files that are licences themselves. Of libraries and headers
they are /usr/share/doc/PACKAGE/copyright of their Debian package. Needs Debian and the Python package wheel."""

import re
import subprocess
import sys
import tempfile
from pathlib import Path


def package_of(path: Path) -> str:
    """The Debian package of a file."""
    for name in (str(path), str(path).removeprefix("/usr")):
        said = subprocess.run(["dpkg-query", "-S", name], capture_output=True, text=True)
        if said.returncode == 0:
            return said.stdout.split(":", 1)[0]
    sys.exit(f"add_licences.py: no Debian package has {path}")


def of_system(library: str) -> Path:
    """What auditwheel called NAME-HASH.so.VERSION."""
    name = re.sub(r"-[0-9a-f]{8}([.]so.*)$", r"\1", library)
    for path in Path("/usr/lib").glob(f"*-linux-gnu/{name}*"):
        return path.resolve()
    sys.exit(f"add_licences.py: there is no {name}")


def main(wheel: Path, files: list[Path]) -> None:
    with tempfile.TemporaryDirectory() as work:
        subprocess.run([sys.executable, "-m", "wheel", "unpack", "--dest", work, wheel], check=True)
        (root,) = Path(work).iterdir()
        (info,) = root.glob("*.dist-info")
        bundled = info / "licenses" / "bundled"
        bundled.mkdir(parents=True)
        owned = [of_system(path.name) for path in (root / "llmt.libs").iterdir()]
        for file in owned + files:
            if file.name == "LICENSE":
                name, text = file.parents[1].name.split("-")[0], file
            elif file.name == "copyright":
                name, text = file.parent.name, file
            else:
                name = package_of(file)
                text = Path(f"/usr/share/doc/{name}/copyright")
            (bundled / f"{name}.txt").write_bytes(text.read_bytes())
        subprocess.run([sys.executable, "-m", "wheel", "pack", "--dest-dir", wheel.parent, root], check=True)


main(Path(sys.argv[1]), [Path(name) for name in sys.argv[2:]])
