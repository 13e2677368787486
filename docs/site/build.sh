#!/bin/sh
# sh docs/site/build.sh: the documentation as a site in build/site/html. Needs the Debian packages mkdocs, mkdocs-material
# and doxygen. The reference for Python is made from docstrings where pdoc and the package llmt are installed in the Python
# of $PYTHON (default: build/python_env); without them there is none. A link that leads nowhere stops the build.
#
# The pages are those of the repository: the README becomes the start page, and the pages of docs stand beside it. What a
# page links to outside of docs lies in the site where it lies in the repository.
set -eu
cd "$(dirname "$0")/../.."
for program in mkdocs doxygen; do
  command -v "$program" >/dev/null || { echo "docs/site/build.sh: $program is missing: apt-get install mkdocs mkdocs-material doxygen" >&2; exit 1; }
done
rm -rf build/site
pages=build/site/pages
mkdir -p $pages
cp -r docs/. $pages
rm -r $pages/site
cp docs/site/mkdocs.yml build/site
cp CONTRIBUTING.md CHANGELOG.md CITATION.cff LICENSE $pages
cp README.md $pages/index.md
for linked in bench/distributed/mpi/README.md bench/logs/tx40.py cmake/setup robotics/catalogue.yaml \
  tests/CMakeLists.txt tests/consumer tests/bytes/manifest.txt tests/measures/table.md tests/python/requirements.txt; do
  mkdir -p "$pages/${linked%/*}"
  cp -r $linked $pages/$linked
done
sed -i 's#](docs/#](#g; s#](\.\./#](#g; s#](README\.md#](index.md#g' $pages/*.md
sed -i 's#](\.\./\.\./bench#](../bench#g' $pages/algorithms/*.md
# A link to a folder leads to the list of its files.
for folder in examples/python samples tests/consumer; do
  {
    printf '# Files of %s\n\n' $folder
    (cd $pages/$folder && find . -type f | sort | sed 's#^\./\(.*\)#- [\1](\1)#')
  } >build/site/files.md
  mv build/site/files.md $pages/$folder/index.md
done

doxygen docs/site/Doxyfile
python=${PYTHON:-build/python_env/bin/python}
if PYTHONPATH=build/release/python "$python" -c 'import pdoc, llmt._core' 2>/dev/null; then
  PYTHONPATH=build/release/python "$python" docs/site/python_api.py $pages/python-api
else
  echo "docs/site/build.sh: no reference for Python: $python has no pdoc or no llmt" >&2
  sed -i '/python-api/d' build/site/mkdocs.yml
fi
mkdocs build --strict --config-file build/site/mkdocs.yml 2>build/site/log || { cat build/site/log >&2; exit 1; }
echo "docs/site/build.sh: build/site/html/index.html"
