"""The declarations for ctypes against include/ptzcal.h and a C compiler."""

import ctypes
import os
import shutil
import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import ptzcal
from ptzcal import _native, _structs
from support import HEADER, Header, ROOT, TestCase

SCALARS = {
    "void": None,
    "double": ctypes.c_double,
    "int32_t": ctypes.c_int32,
    "int64_t": ctypes.c_int64,
    "uint32_t": ctypes.c_uint32,
    "uint64_t": ctypes.c_uint64,
    "size_t": ctypes.c_size_t,
    "ptrdiff_t": ctypes.c_ssize_t,
    "ptzcal_status": ctypes.c_int32,
}


def structs():
    classes = vars(_structs).values()
    return [
        c
        for c in classes
        if isinstance(c, type) and issubclass(c, ctypes.Structure) and c is not ctypes.Structure
    ]


class Declarations(TestCase):
    header = Header()

    def test_the_header_was_read(self):
        self.assertGreater(len(self.header.functions), 100)
        self.assertGreater(len(self.header.structs), 8)
        self.assertGreater(len(self.header.callbacks), 8)
        self.assertGreater(len(self.header.enums), 5)

    def test_every_function_is_declared(self):
        self.assertEqual(set(_native.PROTOTYPES), set(self.header.functions))

    def test_parameters_and_results(self):
        for name, (result, kinds) in self.header.functions.items():
            declared_result, *declared = _native.PROTOTYPES[name]
            with self.subTest(name):
                self.assertEqual(len(declared), len(kinds), kinds)
                self.check(declared_result, result)
                for kind, parameter in zip(kinds, declared):
                    self.check(parameter, kind)

    def test_callbacks(self):
        declared = {n for n in vars(_structs) if n.startswith("ptzcal_") and n.endswith("_fn")}
        self.assertEqual(declared, set(self.header.callbacks))
        for name, (result, kinds) in self.header.callbacks.items():
            function = getattr(_structs, name)
            with self.subTest(name):
                self.check(function._restype_, result)
                self.assertEqual(len(function._argtypes_), len(kinds))
                for kind, parameter in zip(kinds, function._argtypes_):
                    self.check(parameter, kind)

    def check(self, declared, kind):
        """A ctypes type against a C type."""
        kind = kind.replace("const ", "").replace(" const", "").strip()
        if kind in SCALARS:
            self.assertIs(declared, SCALARS[kind], kind)
        elif kind.endswith("_fn"):
            self.assertIs(declared, getattr(_structs, kind))
        elif kind == "char *":
            self.assertIs(declared, ctypes.c_char_p)
        elif kind.replace("*", "").strip() in self.header.structs:
            expected = getattr(_structs, kind.replace("*", "").strip())
            for _ in range(kind.count("*")):
                expected = ctypes.POINTER(expected)
            self.assertIs(declared, expected, kind)
        elif kind.endswith("**"):
            self.assertIs(declared, ctypes.POINTER(ctypes.c_void_p), kind)
        else:
            self.assertTrue(kind.endswith("*"), kind)
            scalar = SCALARS.get(kind[:-1].strip())
            pointers = [ctypes.c_void_p]
            if scalar is not None:
                pointers.append(ctypes.POINTER(scalar))
            self.assertIn(declared, pointers, kind)

    def test_structs_have_the_members(self):
        self.assertEqual({s.__name__ for s in structs()}, set(self.header.structs))
        for struct in structs():
            with self.subTest(struct.__name__):
                members = [field[0] for field in struct._fields_]
                self.assertEqual(members, self.header.structs[struct.__name__])

    def test_layout_is_the_compilers(self):
        compiler = os.environ.get("CC", "cc")
        if shutil.which(compiler) is None:
            print(f"SKIPPED layout of structs: {compiler} is not installed", file=sys.stderr)
            self.skipTest(f"{compiler} is not installed")
        lines, expected = [], []
        for struct in structs():
            name = struct.__name__
            lines.append(f'printf("{name} %zu\\n", sizeof({name}));')
            expected.append(f"{name} {ctypes.sizeof(struct)}")
            for member in (field[0] for field in struct._fields_):
                field = getattr(struct, member)
                lines.append(
                    f'printf("{name}.{member} %zu %zu\\n", offsetof({name}, {member}), '
                    f"sizeof((({name} *)0)->{member}));"
                )
                expected.append(f"{name}.{member} {field.offset} {field.size}")
        code = "#include <ptzcal.h>\n#include <stdio.h>\nint main(void) {\n"
        with tempfile.TemporaryDirectory() as folder:
            source, program = Path(folder, "layout.c"), Path(folder, "layout")
            source.write_text(code + "\n".join(lines) + "\nreturn 0;\n}\n")
            include = f"-I{HEADER.parent}"
            subprocess.run([compiler, include, str(source), "-o", str(program)], check=True)
            printed = subprocess.run([str(program)], check=True, stdout=subprocess.PIPE)
        self.assertEqual(printed.stdout.decode().splitlines(), expected)

    def test_enums(self):
        pairs = {
            ptzcal.Status: "PTZCAL_STATUS_",
            ptzcal.PixelFormat: "PTZCAL_PIXEL_FORMAT_",
            ptzcal.DistortionModel: "PTZCAL_DISTORTION_MODEL_",
            ptzcal.CameraFormat: "PTZCAL_CAMERA_FORMAT_",
            ptzcal.LaserColour: "PTZCAL_LASER_COLOUR_",
            ptzcal.PoseMethod: "PTZCAL_POSE_METHOD_",
            ptzcal.Motion: "PTZCAL_MOTION_",
            ptzcal.LogLevel: "PTZCAL_LOG_LEVEL_",
            ptzcal.RigParameter: "PTZCAL_RIG_PARAMETER_",
            ptzcal.MoveEnd: "PTZCAL_MOVE_END_",
            ptzcal.Focus: "PTZCAL_FOCUS_",
            ptzcal.head.Identity: "PTZCAL_IDENTITY_",
            ptzcal.ProbeFigure: "PTZCAL_PROBE_FIGURE_",
            ptzcal.StudyMethod: "PTZCAL_STUDY_METHOD_",
            ptzcal.StudyDraws: "PTZCAL_STUDY_DRAWS_",
            ptzcal.StudyQuantity: "PTZCAL_STUDY_QUANTITY_",
            ptzcal.StudyPlot: "PTZCAL_STUDY_PLOT_",
            ptzcal.CloudNoise: "PTZCAL_CLOUD_NOISE_",
            ptzcal.MeasuredBy: "PTZCAL_MEASURED_BY_",
            ptzcal.Verdict: "PTZCAL_VERDICT_",
            ptzcal.ShotState: "PTZCAL_SHOT_STATE_",
        }
        self.assertEqual(len(pairs), len(self.header.enums), "an enum has no Python counterpart")
        for enum, prefix in pairs.items():
            here = {prefix + member.name: member.value for member in enum}
            self.assertIn(here, list(self.header.enums.values()))

    def test_constants(self):
        text = HEADER.read_text()
        self.assertIn(f"#define PTZCAL_HEAD_CAMERA {ptzcal.HEAD_CAMERA}", text)
        self.assertIn(f"#define PTZCAL_NO_CAMERA {_native.NO_CAMERA}", text)
        self.assertIn(f"#define PTZCAL_LABEL_HANDOFF {_native.LABEL_HANDOFF}", text)
        self.assertIn(f"#define PTZCAL_RIG_PARAMETERS {len(ptzcal.RigParameter)}", text)
        self.assertIn(f"#define PTZCAL_ABI_VERSION {ptzcal.abi_version()}", text)
        self.assertEqual(ptzcal.__version__, ptzcal.version())
        pyproject = (ROOT / "bindings" / "python" / "pyproject.toml").read_text()
        self.assertIn(f'version = "{ptzcal.version()}"', pyproject)

    def test_status_names(self):
        for status in ptzcal.Status:
            name = _native.lib.ptzcal_status_name(status).decode()
            self.assertEqual(name, "PTZCAL_STATUS_" + status.name)


class Loading(TestCase):
    def load(self, library):
        """What importing the package says with another library."""
        run = subprocess.run(
            [sys.executable, "-c", "import ptzcal"],
            env={**os.environ, "PTZCAL_LIBRARY": str(library)},
            stderr=subprocess.PIPE,
            universal_newlines=True,
        )
        self.assertNotEqual(run.returncode, 0)
        self.assertIn("ImportError", run.stderr)
        return run.stderr

    def compiled(self, folder, code):
        compiler = os.environ.get("CC", "cc")
        if shutil.which(compiler) is None:
            self.skipTest(f"{compiler} is not installed")
        source, library = Path(folder, "other.c"), Path(folder, "other.so")
        source.write_text(code)
        subprocess.run([compiler, "-shared", "-fPIC", str(source), "-o", str(library)], check=True)
        return library

    def test_no_library(self):
        said = self.load("/nowhere/libptzcal.so")
        self.assertIn("/nowhere/libptzcal.so", said)
        self.assertIn("PTZCAL_LIBRARY", said)

    def test_another_library(self):
        with tempfile.TemporaryDirectory() as folder:
            said = self.load(self.compiled(folder, "int other(void) { return 0; }"))
        self.assertIn("is not the ptzcal library", said)

    def test_another_abi(self):
        with tempfile.TemporaryDirectory() as folder:
            said = self.load(
                self.compiled(folder, "unsigned ptzcal_abi_version(void) { return 99; }")
            )
        self.assertIn("ABI 99", said)

    def test_an_older_library(self):
        with tempfile.TemporaryDirectory() as folder:
            said = self.load(
                self.compiled(folder, "unsigned ptzcal_abi_version(void) { return 1; }")
            )
        self.assertIn("older", said)


if __name__ == "__main__":
    unittest.main()
