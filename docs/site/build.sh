#!/bin/sh
# sh docs/site/build.sh: the documentation as a site in build/site/html. Needs the Debian packages mkdocs, mkdocs-material
# and doxygen. The reference for Python is made from docstrings where pdoc and the package llmt are installed in the Python
# of $PYTHON (default: build/python_env). The pages are those of the repository: the README becomes the start page, and links are moved with it.
set -eu
cd "$(dirname "$0")/../.."
for program in mkdocs doxygen; do
  command -v "$program" >/dev/null || { echo "docs/site/build.sh: $program is missing: apt-get install mkdocs mkdocs-material doxygen" >&2; exit 1; }
done
rm -rf build/site
mkdir -p build/site/pages
cp -r docs/. build/site/pages
rm -r build/site/pages/site
cp docs/site/mkdocs.yml build/site
cp CITATION.cff LICENSE cmake/setup build/site/pages
sed 's#](docs/#](#g; s#](cmake/setup)#](setup)#g; s#](cmake/packages)#](packages)#g; s#](tests/consumer)#](consumer)#g' README.md >build/site/pages/index.md
for page in CONTRIBUTING CHANGELOG; do sed 's#](docs/#](#g' "$page.md" >"build/site/pages/$page.md"; done
# Pages that point to the root of the repository.
find build/site/pages -maxdepth 1 -name '*.md' -exec sed -i 's#](\.\./\(CONTRIBUTING\|CHANGELOG\|README\)\.md#](\1.md#g; s#](README\.md#](index.md#g' {} +
mkdocs build --quiet --config-file build/site/mkdocs.yml
doxygen docs/site/Doxyfile
python=${PYTHON:-build/python_env/bin/python}
if PYTHONPATH=build/release/python "$python" -c 'import pdoc, llmt._core' 2>/dev/null; then
  PYTHONPATH=build/release/python "$python" -m pdoc --docformat numpy -o build/site/html/python-api llmt llmt.robotics llmt.export
else
  echo "docs/site/build.sh: no reference for Python: $python has no pdoc or no llmt" >&2
fi
echo "docs/site/build.sh: build/site/html/index.html"
