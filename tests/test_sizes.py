"""No file and no function of the package is long without a reason in its docstring."""

import ast

from evidence.layout import has_reason, long_files, long_functions, sources


def test_long_files_say_why():
    assert not long_files(), "split it, or say in its docstring `It is long because …`"


def test_long_functions_say_why():
    assert not long_functions(), "split it, or say in its docstring `It is long because …`"


def test_the_whole_package_is_looked_at():
    names = {path.name for path in sources()}
    assert {"__init__.py", "walker.py", "newton_euler.py", "app.py"} <= names


def test_a_reason_may_run_over_a_line():
    assert has_reason(ast.parse('"""A sweep.\n\n    It is long\n    because it is one."""\n'))
    assert not has_reason(ast.parse('"""A sweep, which is long."""\n'))
