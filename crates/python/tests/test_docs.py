"""Examples in docstrings, and docs of everything public."""

import doctest
import inspect

import linelit as ll
import pytest

PUBLIC = {name: getattr(ll, name) for name in ll.__all__ if not name.startswith("__")}
METHODS = {
    f"{owner}.{name}": getattr(cls, name)
    for owner, cls in PUBLIC.items()
    if inspect.isclass(cls)
    for name in vars(cls)
    if not name.startswith("_") and callable(getattr(cls, name)) and owner in ("Light", "Scene", "Study", "ViewFactors")
}
DOCUMENTED = {"linelit": ll, **PUBLIC, **METHODS}


@pytest.mark.parametrize("name", DOCUMENTED)
def test_everything_public_has_a_doc_whose_examples_run(name):
    doc = inspect.getdoc(DOCUMENTED[name])
    assert doc and len(doc.split("\n")[0]) > 10, name
    test = doctest.DocTestParser().get_doctest(doc, {}, name, None, 0)
    assert doctest.DocTestRunner(verbose=False).run(test).failed == 0


@pytest.mark.parametrize("name", METHODS)
def test_methods_say_what_they_take(name):
    doc = inspect.getdoc(METHODS[name])
    parameters = [p for p in inspect.signature(METHODS[name]).parameters if p != "self"]
    if parameters:
        assert "Parameters\n----------" in doc
    # `threads` and pairs such as `corner, u, v` are on lines of their own.
    heads = [line.split(":")[0] for line in doc.split("\n") if " : " in line]
    named = {word.strip() for head in heads for word in head.split(",")}
    assert named >= set(parameters), set(parameters) - named
