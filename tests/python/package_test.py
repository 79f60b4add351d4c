"""The package as a whole: types, examples, what the manual shows, and what the extension shows to others."""
import ast
import inspect
import os
import pathlib
import re
import shutil
import subprocess
import sys
import unittest

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent.parent / "checks"))
from docs_test import difference
from support import BUILD, FOLDER, SOURCE, library_file, samples

import kinespace
from kinespace import _kinespace

ENVIRONMENT = {**os.environ, "PYTHONPATH": str(BUILD / "python")}
EXAMPLES = sorted((SOURCE / "python" / "examples").glob("*.py"))


def run(arguments, **more):
    done = subprocess.run(arguments, env=ENVIRONMENT, capture_output=True, text=True, **more)
    if done.returncode != 0:
        raise AssertionError(f"{arguments}: {done.stdout}{done.stderr}")
    return done.stdout


def members(node):
    return {n.name for n in node.body if isinstance(n, ast.FunctionDef)} | {n.target.id for n in node.body if isinstance(n, ast.AnnAssign)}


class PackageTest(unittest.TestCase):
    def test_examples_run(self):
        self.assertTrue(EXAMPLES)
        for example in EXAMPLES:
            self.assertTrue(run([sys.executable, str(example), str(samples())], cwd=FOLDER))

    # In CI it has to be there.
    @unittest.skipUnless(shutil.which("mypy") or os.environ.get("CI"), "mypy is not here")
    def test_types_hold(self):
        mypy = ["mypy", "--strict", f"--python-executable={sys.executable}", f"--cache-dir={FOLDER / 'mypy'}"]
        run([*mypy, str(SOURCE / "python" / "kinespace"), *map(str, EXAMPLES)], cwd=FOLDER)
        wrong = FOLDER / "wrong.py"
        wrong.write_text("import kinespace\nkinespace.read_clip('a.bvh').positions.upper()\nkinespace.FunctionalPCA().fit([[1.0]]).nothing\n")
        done = subprocess.run([*mypy, str(wrong)], env={**ENVIRONMENT, "MYPYPATH": str(SOURCE / "python")}, capture_output=True, text=True, cwd=FOLDER)
        self.assertEqual(len(re.findall(r"wrong\.py:\d+: error", done.stdout)), 2, done.stdout)

    def test_the_stub_names_what_the_extension_has(self):
        stub = ast.parse((SOURCE / "python" / "kinespace" / "_kinespace.pyi").read_text())
        typed = {n.name: n for n in stub.body if isinstance(n, (ast.ClassDef, ast.FunctionDef))}
        names = {name for name in vars(_kinespace) if not name.startswith("_")}
        self.assertLessEqual(names, set(typed))
        for name in names & {"Clip", "Library", "Match"}:
            real = {n for n in vars(getattr(_kinespace, name)) if not n.startswith("_")}
            self.assertEqual(real, {n for n in members(typed[name]) if not n.startswith("_")}, name)
        for name in kinespace.__all__:
            self.assertTrue(hasattr(kinespace, name))

    def test_help_says_what_the_stub_says(self):
        for of, words in ((kinespace.Clip.positions, "[frames, joints, 3]: world positions in cm"), (kinespace.Library.query, "nearest first"),
                          (kinespace.Error, "file and line"), (kinespace.read_clip, "by its ending"), (kinespace.Library, "they take turns")):
            self.assertIn(words, of.__doc__)

    def test_defaults_are_those_of_the_library(self):
        shown = _kinespace.build_library.__doc__
        for name, parameter in inspect.signature(kinespace.MotionSpace.build).parameters.items():
            if parameter.default is not inspect.Parameter.empty:
                default = re.search(rf"\b{name}: [^=]*= ('[^']*'|[^,)]*)", shown)[1]
                self.assertEqual(ast.literal_eval(default), parameter.default, name)

    def test_the_manual_prints_what_it_shows(self):
        text = (SOURCE / "docs" / "python.md").read_text()
        folder = FOLDER / "manual"
        folder.mkdir()
        (folder / "clips").symlink_to(samples())
        (folder / "sample.kspace").symlink_to(library_file())
        program, wanted = ["import os", f"os.chdir({str(folder)!r})"], []
        blocks = re.findall(r"^```python\n(.*?)^```\n(?:\n```\n(.*?)^```\n)?", text, re.DOTALL | re.MULTILINE)
        self.assertGreater(len(blocks), 3)
        for code, shown in blocks:
            program.append(code)
            wanted += shown.splitlines()
        printed = run([sys.executable, "-c", "\n".join(program)]).splitlines()
        self.assertIsNone(difference(wanted, printed))
        self.assertEqual(len(printed), len(wanted))

    def test_the_extension_is_free_of_the_gpl_and_keeps_its_names(self):
        self.assertNotIn("alglib", run(["ldd", _kinespace.__file__]))
        defined = run(["nm", "-D", "--defined-only", _kinespace.__file__]).split()[2::3]
        self.assertIn("PyInit__kinespace", defined)
        self.assertEqual([name for name in defined if "kinespace" in name and name != "PyInit__kinespace"], [])
