"""Circles: strongly connected components of modules under inclusion in C++, under import in Python."""

import ast
import re

from .sources import LIBRARIES


def strongly_connected(edges):
    """Components of more than one node, the largest first: Tarjan (1972), without recursion."""
    index, low, stack, on_stack, found = {}, {}, [], set(), []
    for start in edges:
        if start in index:
            continue
        work = [(start, iter(sorted(edges[start])))]
        index[start] = low[start] = len(index)
        stack.append(start)
        on_stack.add(start)
        while work:
            node, children = work[-1]
            for child in children:
                if child not in edges:
                    continue
                if child not in index:
                    index[child] = low[child] = len(index)
                    stack.append(child)
                    on_stack.add(child)
                    work.append((child, iter(sorted(edges[child]))))
                    break
                if child in on_stack:
                    low[node] = min(low[node], index[child])
            else:
                work.pop()
                if work:
                    low[work[-1][0]] = min(low[work[-1][0]], low[node])
                if low[node] == index[node]:
                    component = []
                    while True:
                        last = stack.pop()
                        on_stack.discard(last)
                        component.append(last)
                        if last == node:
                            break
                    if len(component) > 1:
                        found.append(sorted(component))
    return sorted(found, key=len, reverse=True)


_INCLUDE = re.compile(r'^\s*#\s*include\s*"([^"]+)"', re.M)


def cpp_modules(checkout):
    """What each module of the libraries includes. A module is a header with the source of the same path; a public
    header llmt/NAME.hpp is one module with the source NAME.cpp whose first include it is."""
    files = checkout.files(*LIBRARIES)
    sources = {}
    for path in files:
        if path.suffix == ".cpp":
            sources.setdefault((checkout.name(path).split("/")[0], path.stem), []).append(path)

    def stem(path):
        return path.relative_to(checkout.root).with_suffix("").as_posix()

    door = {}
    for path in files:
        library, _, include = checkout.name(path).partition("/include/")
        if include:
            same = [s for s in sources.get((library, path.stem), [])
                    if (first := _INCLUDE.search(checkout.text(s))) and first.group(1) == include]
            if len(same) == 1:
                door[stem(path)] = stem(same[0])

    def module(path):
        return door.get(stem(path), stem(path))

    edges = {}
    for path in files:
        reached = edges.setdefault(module(path), set())
        library = checkout.name(path).split("/")[0]
        for include in _INCLUDE.findall(checkout.text(path)):
            for folder in (f"{library}/src", f"{library}/include", "llmt/include", "robotics/include", "llmt"):
                if (checkout.root / folder / include).is_file():
                    reached.add(module(checkout.root / folder / include))
                    break
        reached.discard(module(path))
    return edges


def python_modules(checkout, package="apps/python/llmt"):
    """What each module of the package imports: at its top, in functions and for type checkers."""
    base = checkout.root / package
    modules = {}
    for path in checkout.files(package, endings=("py", "pyi")):
        parts = path.relative_to(base.parent).with_suffix("").parts
        modules[parts[:-1] if parts[-1] == "__init__" else parts] = path

    def has(module, name):
        return any(name in (getattr(node, "id", None), getattr(node, "asname", None), getattr(node, "name", None))
                   for node in checkout.nodes(modules[module]))

    edges = {}
    for parts, path in modules.items():
        reached = set()
        for node in checkout.nodes(path):
            if isinstance(node, ast.Import):
                reached |= {tuple(alias.name.split(".")) for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                here = parts if path.stem == "__init__" else parts[:-1]
                start = here[:len(here) - node.level + 1] if node.level else ()
                start += tuple(node.module.split(".")) if node.module else ()
                # The name is that of a module, or of something in a module. Compiled modules have no source.
                for alias in node.names:
                    inner = start + (alias.name,)
                    if inner in modules:
                        reached.add(inner)
                    elif start in modules and (modules[start].stem != "__init__" or has(start, alias.name)):
                        reached.add(start)
        edges[".".join(parts)] = {".".join(name) for name in reached if name in modules and name != parts}
    return edges
